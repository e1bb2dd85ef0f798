//! Edits as values: the only way in which a document changes. [`crate::Document::apply`] carries one out and
//! returns the edit that undoes it. This file knows what an edit says, not how it is carried out.

use glam::DAffine3;
use serde::{Deserialize, Serialize};

use crate::animation::ClipChoice;
use crate::assets::{Camera, Environment, Light, Material, Mesh, ShapeFault, ShapeSource, too_many_in_all};
use crate::document::Document;
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target};
use crate::node::{MAX_NODES, Subtree};
use crate::package::{MaterialEntry, PrefabPackage};
use crate::prefab::Prefab;
use crate::transform::Local;

/// A change of the document. The journal writes it as JSON, with files named and not written out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum Edit {
    /// Moves a node, or a part inside an instance (which becomes an override).
    SetTransform {
        /// What moves.
        target: Target,
        /// The new transform against its parent.
        local: Local,
    },
    /// Changes a name.
    Rename {
        /// What is renamed.
        target: Target,
        /// The new name.
        name: String,
    },
    /// Shows or hides a node or part with everything below.
    SetVisible {
        /// What is shown or hidden.
        target: Target,
        /// True: shown.
        visible: bool,
    },
    /// Keeps a node with everything below it from being changed, or lets go of it. [`Document::locked_against`] tells.
    SetLocked {
        /// Which node.
        node: NodeId,
        /// True: kept.
        locked: bool,
    },
    /// Says which rays meet the mesh of a node or part; what hangs below does not follow.
    SetRayVisibility {
        /// What it is about.
        target: Target,
        /// The camera sees it.
        camera_visible: bool,
        /// It stops light on its way.
        casts_shadows: bool,
    },
    /// Weighs the morph targets of a placed mesh. A clip that moves the weights outdoes it while a time is shown.
    SetMorphWeights {
        /// The node or part that places the mesh.
        target: Target,
        /// One a morph target; of a node also none: those of the mesh.
        weights: Vec<f32>,
    },
    /// Chooses what an instance plays.
    SetClip {
        /// The instance.
        node: NodeId,
        /// The clips.
        clip: ClipChoice,
    },
    /// Chooses the variant of materials that an instance shows.
    SetVariant {
        /// The instance.
        node: NodeId,
        /// Its name in [`crate::Prefab::variants`]; `None`: the materials that the meshes have.
        variant: Option<String>,
    },
    /// Chooses the scene of its source that an instance shows.
    SetScene {
        /// The instance.
        node: NodeId,
        /// Its name in [`crate::Prefab::scene_names`]; `None`: the one that the source shows by itself.
        scene: Option<String>,
    },
    /// Lets an instance show another prefab. Overrides stay, by path.
    SetPrefab {
        /// The instance.
        node: NodeId,
        /// The other prefab.
        prefab: PrefabId,
    },
    /// Makes a part follow its prefab again in one respect.
    ResetOverride {
        /// A part.
        target: Target,
        /// In which respect.
        field: OverrideField,
    },
    /// Gives one primitive of a placed mesh another material.
    AssignMaterial {
        /// The node or part that places the mesh.
        target: Target,
        /// Index of the primitive.
        primitive: u32,
        /// The material.
        material: MaterialId,
    },
    /// Changes the values of a material, wherever it is used.
    SetMaterial {
        /// Which material.
        material: MaterialId,
        /// Its new values.
        value: Box<Material>,
    },
    /// Adds a material. The id comes from [`Document::allocate_id`].
    AddMaterial {
        /// Its id.
        material: MaterialId,
        /// Its values.
        entry: Box<MaterialEntry>,
    },
    /// Removes a material that nothing uses.
    RemoveMaterial {
        /// Which material.
        material: MaterialId,
    },
    /// Changes a light.
    SetLight {
        /// The node or part that is the light.
        target: Target,
        /// Its new values.
        light: Light,
    },
    /// Changes a camera.
    SetCamera {
        /// The node or part that is the camera.
        target: Target,
        /// Its new values.
        camera: Camera,
    },
    /// Changes what surrounds the scene.
    SetEnvironment(Environment),
    /// Chooses the camera that renders when none is named.
    SetDefaultCamera(Option<Target>),
    /// Adds a node with everything below it. Ids come from [`Document::allocate_id`].
    AddNode {
        /// `None`: among the roots.
        parent: Option<NodeId>,
        /// Place among its siblings; past the end means last.
        index: usize,
        /// What is added.
        subtree: Subtree,
    },
    /// Removes a node with everything below it.
    RemoveNode {
        /// The top of what is removed.
        node: NodeId,
    },
    /// Hangs a node elsewhere, with the given transform. [`Document::reparent_edit`] makes one that keeps
    /// the node where it is in the world.
    Reparent {
        /// What is moved.
        node: NodeId,
        /// `None`: among the roots.
        parent: Option<NodeId>,
        /// Place among its new siblings, counted without the node itself; past the end means last.
        index: usize,
        /// Transform against the new parent.
        local: Local,
    },
    /// Moves a primitive inside its mesh, in every instance of the mesh.
    SetPrimitiveTransform {
        /// Which mesh.
        mesh: MeshId,
        /// Index of the primitive.
        primitive: u32,
        /// Its new place.
        mesh_from_primitive: DAffine3,
    },
    /// Adds a mesh of spheres and boxes, which belongs to no prefab. [`Document::add_shapes_edit`] makes one, with materials
    /// and a node.
    AddMesh {
        /// Its id, from [`Document::allocate_id`].
        mesh: MeshId,
        /// The mesh.
        value: Box<Mesh>,
    },
    /// Removes a mesh that nothing places and no prefab has brought.
    RemoveMesh {
        /// Which mesh.
        mesh: MeshId,
    },
    /// Describes the spheres and boxes of a mesh anew, in every instance. The number of primitives stays.
    SetShapes {
        /// Which mesh.
        mesh: MeshId,
        /// Their new description.
        source: Box<ShapeSource>,
    },
    /// Adds a prefab with its assets. [`Document::import_edit`] makes one.
    AddPrefab(Box<PrefabPackage>),
    /// Removes a prefab of which no instance is left, with its assets.
    RemovePrefab {
        /// Which prefab.
        prefab: PrefabId,
    },
    /// Puts a new reading of its source in a prefab's place; instances keep their overrides.
    /// [`Document::reload_edit`] makes one.
    ReplacePrefab(Box<PrefabPackage>),
    /// Several edits as one step.
    Batch {
        /// Name of the step, such as "duplicated Chair"; empty: that of the first edit.
        label: String,
        /// In order.
        edits: Vec<Edit>,
    },
}

/// In which respect a part can differ from its prefab.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum OverrideField {
    /// Its name.
    Name,
    /// Its transform.
    Local,
    /// Its visibility.
    Visible,
    /// The material of one primitive.
    Material(u32),
    /// Its light.
    Light,
    /// Its camera.
    Camera,
    /// The weights of its morph targets.
    Weights,
    /// Which rays meet it.
    RayVisibility,
    /// Everything.
    All,
}

/// Why an edit cannot be carried out; the document is then as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The node is not in the document.
    #[error("node {} is not in the scene", .0.0)]
    NoNode(NodeId),
    /// The part is not in the prefab, or the node is no instance.
    #[error("{0:?} is no part of an instance in the scene")]
    NoPart(Target),
    /// The asset is not in the document.
    #[error("{0} is not in the scene")]
    NoAsset(String),
    /// The target is something else.
    #[error("{target:?} is no {wanted}")]
    WrongKind {
        /// What was named.
        target: Target,
        /// What the edit needs.
        wanted: &'static str,
    },
    /// The index lies past the end.
    #[error("there is no primitive {primitive}")]
    NoPrimitive {
        /// The index.
        primitive: u32,
    },
    /// There are more or fewer values than things that they are for.
    #[error("{found} weights for {wanted} morph targets")]
    WeightCount {
        /// Number of morph targets.
        wanted: usize,
        /// Number of weights.
        found: usize,
    },
    /// Somebody has locked it.
    #[error("{0} is locked")]
    Locked(String),
    /// The prefab has no such variant of materials.
    #[error("there is no variant {0}")]
    NoVariant(String),
    /// The source has no such scene.
    #[error("there is no scene {0}")]
    NoScene(String),
    /// No other instance shows the prefab.
    #[error("it is the only instance already")]
    OnlyInstance,
    /// An id is taken.
    #[error("{0} is already in the scene")]
    Taken(String),
    /// Something still uses it.
    #[error("{what} is still used by {by}")]
    InUse {
        /// What was to be removed.
        what: String,
        /// A user of it.
        by: String,
    },
    /// The description makes no shapes.
    #[error(transparent)]
    NoShapes(#[from] ShapeFault),
    /// The mesh holds triangles, or another number of primitives than these shapes have.
    #[error("these shapes do not fit that mesh")]
    OtherShapes,
    /// The document would have more nodes than it may.
    #[error("the scene would have {count} nodes, those inside of instances counted; it can have {MAX_NODES}")]
    TooManyNodes {
        /// How many there would be.
        count: usize,
    },
    /// The document would have more spheres and boxes than it may.
    #[error("{}", too_many_in_all(*count))]
    TooManyShapes {
        /// How many there would be.
        count: usize,
    },
    /// A node cannot hang below itself.
    #[error("a node cannot be moved into itself")]
    Cycle,
    /// The values hold a number that is not finite.
    #[error("a value is not a finite number")]
    NotFinite,
    /// The nodes to be added are not a tree.
    #[error("the nodes to be added are not a tree: {0}")]
    NoTree(String),
}

impl Edit {
    /// Several edits as one step; `label` such as "duplicated Chair" names it.
    pub fn batch(label: impl Into<String>, edits: Vec<Edit>) -> Self {
        Self::Batch { label: label.into(), edits }
    }

    /// Whether the picture may be another afterwards.
    pub fn changes_picture(&self) -> bool {
        match self {
            Self::Rename { .. } | Self::SetLocked { .. } | Self::SetDefaultCamera(_) => false,
            Self::Batch { edits, .. } => edits.iter().any(Self::changes_picture),
            _ => true,
        }
    }

    /// What it does in words for the status bar and the undo list, such as "moved Chair".
    /// Call it before the edit is applied when the edit removes something.
    pub fn describe(&self, document: &Document) -> String {
        let name = |target: &Target| document.display_name(*target);
        let material_name = |id: &MaterialId| {
            document.material(*id).map_or_else(
                || format!("material {}", id.0),
                |material| shown(&material.name, "material", id.0),
            )
        };
        let mesh_name = |id: &MeshId| {
            let name = document.mesh(*id).map_or("", |mesh| mesh.name.as_str());
            shown(name, "mesh", id.0)
        };
        match self {
            Self::SetTransform { target, .. } => format!("moved {}", name(target)),
            Self::Rename { target, name: new } => format!("renamed {} to {new}", name(target)),
            Self::SetVisible { target, visible } => {
                format!("{} {}", if *visible { "showed" } else { "hid" }, name(target))
            }
            Self::SetLocked { node, locked } => {
                format!("{} {}", if *locked { "locked" } else { "unlocked" }, name(&Target::node(*node)))
            }
            Self::SetRayVisibility { target, .. } => {
                format!("changed the ray visibility of {}", name(target))
            }
            Self::SetMorphWeights { target, .. } => format!("shaped {}", name(target)),
            Self::SetClip { node, clip } => describe_clip(document, *node, *clip),
            Self::SetVariant { node, variant } => {
                let variant = variant.as_deref().unwrap_or("its own materials");
                format!("showed {} in {variant}", name(&Target::node(*node)))
            }
            Self::SetScene { node, scene } => {
                let scene = scene.as_deref().unwrap_or("its own scene");
                format!("showed {scene} of {}", name(&Target::node(*node)))
            }
            Self::SetPrefab { node, .. } => format!("gave {} another source", name(&Target::node(*node))),
            Self::ResetOverride { target, .. } => format!("reset {}", name(target)),
            Self::AssignMaterial { target, material, .. } => {
                format!("gave {} to {}", material_name(material), name(target))
            }
            Self::SetMaterial { material, .. } => format!("changed {}", material_name(material)),
            Self::AddMaterial { material, entry } => {
                format!("added {}", shown(&entry.value.name, "material", material.0))
            }
            Self::RemoveMaterial { material } => format!("removed {}", material_name(material)),
            Self::SetLight { target, .. } => format!("changed light {}", name(target)),
            Self::SetCamera { target, .. } => format!("changed camera {}", name(target)),
            Self::SetEnvironment(_) => "changed the environment".to_owned(),
            Self::SetDefaultCamera(_) => "chose the camera".to_owned(),
            Self::AddNode { subtree, .. } => match subtree.nodes.first() {
                Some((id, node)) => format!("added {}", shown(&node.name, "node", id.0)),
                None => "added nothing".to_owned(),
            },
            Self::RemoveNode { node } => format!("removed {}", name(&Target::node(*node))),
            Self::Reparent { node, .. } => format!("regrouped {}", name(&Target::node(*node))),
            Self::SetPrimitiveTransform { mesh, primitive, .. } => {
                format!("moved primitive {primitive} of {}", mesh_name(mesh))
            }
            Self::AddMesh { mesh, value } => format!("added {}", shown(&value.name, "mesh", mesh.0)),
            Self::RemoveMesh { mesh } => format!("removed {}", mesh_name(mesh)),
            Self::SetShapes { mesh, .. } => format!("reshaped {}", mesh_name(mesh)),
            Self::AddPrefab(package) => format!("imported {}", package.prefab.name),
            Self::RemovePrefab { prefab } => {
                let prefab_name = document.prefab(*prefab).map_or("", |p| p.name.as_str());
                format!("removed prefab {}", shown(prefab_name, "", prefab.0))
            }
            Self::ReplacePrefab(package) => describe_source(document, package),
            Self::Batch { label, edits } if label.is_empty() => {
                edits.first().map_or_else(String::new, |edit| edit.describe(document))
            }
            Self::Batch { label, .. } => label.clone(),
        }
    }

    /// Whether `later` carries on what `self` does, as the steps of one drag do: both set the same values
    /// of the same thing. Two such steps merge into one: keep the undo of the first and drop the undo of
    /// the later, because it already restores everything that both changed.
    pub fn same_gesture(&self, later: &Edit) -> bool {
        match (self, later) {
            (Self::SetTransform { target: a, .. }, Self::SetTransform { target: b, .. })
            | (Self::Rename { target: a, .. }, Self::Rename { target: b, .. })
            | (Self::SetLight { target: a, .. }, Self::SetLight { target: b, .. })
            | (Self::SetMorphWeights { target: a, .. }, Self::SetMorphWeights { target: b, .. })
            | (Self::SetCamera { target: a, .. }, Self::SetCamera { target: b, .. }) => a == b,
            (Self::SetMaterial { material: a, .. }, Self::SetMaterial { material: b, .. }) => a == b,
            (Self::SetEnvironment(_), Self::SetEnvironment(_)) => true,
            (Self::SetShapes { mesh: a, .. }, Self::SetShapes { mesh: b, .. }) => a == b,
            (
                Self::SetPrimitiveTransform { mesh: a, primitive: p, .. },
                Self::SetPrimitiveTransform { mesh: b, primitive: q, .. },
            ) => a == b && p == q,
            (Self::Batch { edits: a, .. }, Self::Batch { edits: b, .. }) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.same_gesture(b))
            }
            _ => false,
        }
    }
}

fn describe_clip(document: &Document, node: NodeId, clip: ClipChoice) -> String {
    let name = document.display_name(Target::node(node));
    let clips = document.clips_of(node);
    match clip {
        ClipChoice::None => format!("stopped {name}"),
        ClipChoice::All => format!("let {name} play all clips"),
        ClipChoice::First => format!("let {name} play its first clip"),
        ClipChoice::Clip(index) => {
            let clip_name = clips.get(index as usize).map_or("", |clip| clip.name.as_str());
            format!("let {name} play {}", shown(clip_name, "clip", index.into()))
        }
    }
}

/// The step of a prefab whose source was read again, or that got another one.
fn describe_source(document: &Document, package: &PrefabPackage) -> String {
    let file_of =
        |prefab: &Prefab| prefab.source.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let old = document.prefab(package.id).unwrap_or(&package.prefab);
    let name = if old.name.is_empty() { file_of(old) } else { old.name.clone() };
    let name = shown(&name, "prefab", package.id.0);
    if old.source == package.prefab.source {
        format!("reloaded the source of {name}")
    } else {
        format!(
            "replaced the source of {name} by {}",
            shown(&file_of(&package.prefab), "another", package.id.0)
        )
    }
}

/// A name, or what kind of thing it is with its id when it has none.
pub(crate) fn shown(name: &str, kind: &str, id: u64) -> String {
    if name.is_empty() { format!("{kind} {id}").trim_start().to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::NodeId;

    #[test]
    fn names_do_not_change_the_picture() {
        let rename = || Edit::Rename { target: Target::node(NodeId(1)), name: String::from("Chair") };
        let hide = Edit::SetVisible { target: Target::node(NodeId(1)), visible: false };
        assert!(!rename().changes_picture() && hide.changes_picture());
        assert!(!Edit::batch("names", vec![rename(), rename()]).changes_picture());
        assert!(Edit::batch("both", vec![rename(), hide]).changes_picture());
    }
}
