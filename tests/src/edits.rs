//! Random steps on an open scene without a device: edits of every kind, undo, redo, gestures and saves. The same seed makes
//! the same steps on the same scene, so that one process can tell what another has done.

use std::path::Path;

use caustica::open_scene::OpenScene;
use caustica_scene::import::{ImportOptions, Warning, load};
use caustica_scene::{
    Cloud, Document, Edit, Environment, LeftBehind, Light, LightKind, Local, Material, MaterialEntry,
    MaterialId, Node, NodeId, NodeKind, OverrideField, Project, ShapeSource, Target, Trs,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::numbers::Random;

/// About as many nodes as a scene gets.
const MOST_NODES: usize = 40;

/// Opens what a process has left behind in `journals`, else the project; keeps what is edited from now on. Whether anything
/// was left behind.
///
/// # Panics
/// When neither can be read, or something in them is not as it was.
pub fn open(project: &Path, journals: &Path) -> (OpenScene, bool) {
    let mut scene = OpenScene::new();
    scene.keep_journal(journals);
    let mut left = LeftBehind::find(journals);
    // A second one is there when the process died while it replaced its journal: the newer one says all that the other does.
    assert!(left.len() < 3, "one process, one journal: {left:?}");
    left.drain(1.min(left.len())..).for_each(LeftBehind::discard);
    let Some(left) = left.pop() else {
        let read = Project::load(project).expect("the project");
        assert!(read.warnings.is_empty(), "{:?}", read.warnings);
        scene.open(project.to_owned(), read);
        return (scene, false);
    };
    let recovered = left.recover(&ImportOptions::default(), &|_, _| ()).expect("the journal");
    let allowed = |warning: &Warning| warning.message.contains("has changed since");
    let warnings = &recovered.project.warnings;
    assert!(warnings.iter().all(allowed), "{warnings:?}");
    scene.recover(recovered);
    (scene, true)
}

/// What makes the steps.
pub struct Steps<'a> {
    random: Random,
    /// A model that is imported now and then.
    model: &'a Path,
}

impl<'a> Steps<'a> {
    /// Steps from a seed.
    pub fn new(seed: u64, model: &'a Path) -> Self {
        Self { random: Random::new(seed), model }
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.random.bits() >> 33) as usize % limit.max(1)
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> Option<T> {
        list.get(self.below(list.len())).copied()
    }

    /// Makes one step that succeeds. `save` saves the scene, or does nothing where another process has done it.
    pub fn step(&mut self, scene: &mut OpenScene, save: impl FnOnce(&mut OpenScene)) {
        if self.below(150) == 0 {
            scene.end_gesture();
            save(scene);
            return;
        }
        loop {
            let done = match self.below(20) {
                0..3 => scene.undo().is_some(),
                3..5 => scene.redo().is_some(),
                5 => {
                    let open = scene.history().gesture_is_open();
                    scene.cancel_gesture();
                    open
                }
                6 => self.push(scene, |steps, document| {
                    let edits = (0..3).map(|_| steps.edit(document)).collect();
                    Edit::batch("several", edits)
                }),
                _ => self.push(scene, Self::edit),
            };
            if done {
                return;
            }
        }
    }

    fn push(&mut self, scene: &mut OpenScene, make: impl FnOnce(&mut Self, &mut Document) -> Edit) -> bool {
        let pushed = scene.edit_with(|document| ((), make(self, document))).is_ok();
        if self.below(2) == 0 {
            scene.end_gesture();
        }
        pushed
    }

    /// An edit that may not fit.
    fn edit(&mut self, document: &mut Document) -> Edit {
        let nodes: Vec<NodeId> = document.nodes().map(|(id, _)| id).collect();
        let node = self.pick(&nodes).unwrap_or_default();
        let target = self.target(document, node);
        let kinds = if nodes.len() < MOST_NODES { 20 } else { 15 };
        match self.below(kinds) {
            0 => Edit::Rename { target, name: format!("name \"{}\"\n", self.below(1000)) },
            1 => Edit::SetVisible { target, visible: self.below(2) == 0 },
            2 => Edit::SetRayVisibility { target, camera_visible: self.below(2) == 0, casts_shadows: true },
            3 => self.material_edit(document),
            4 => {
                let materials: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
                let material = self.pick(&materials).unwrap_or_default();
                Edit::AssignMaterial { target, primitive: self.below(2) as u32, material }
            }
            5 => Edit::SetLight { target, light: self.light() },
            6 => Edit::SetEnvironment(Environment::Constant(Vec3::splat(self.random.unit() as f32))),
            7 => Edit::ResetOverride { target, field: OverrideField::All },
            8 => {
                let meshes: Vec<_> = document.meshes().map(|(id, _)| id).collect();
                let mesh_from_primitive = DAffine3::from_translation(self.random.direction());
                Edit::SetPrimitiveTransform {
                    mesh: self.pick(&meshes).unwrap_or_default(),
                    primitive: 0,
                    mesh_from_primitive,
                }
            }
            9 => {
                Edit::Reparent { node, parent: self.pick(&nodes), index: self.below(4), local: self.local() }
            }
            10 if nodes.len() > MOST_NODES / 2 => Edit::RemoveNode { node },
            11 if self.below(4) == 0 => Edit::SetLocked { node, locked: self.below(4) == 0 },
            11 if self.below(3) == 0 && document.prefabs().count() < 6 => document
                .make_unique_edit(node)
                .map_or_else(|_| Edit::batch("none", Vec::new()), |copies| copies.edit),
            11 => self.removal(document),
            10 | 12..15 => Edit::SetTransform { target, local: self.local() },
            15 => document.add_edit(Node::new("Lamp", NodeKind::Light(self.light())), self.pick(&nodes)).1,
            16 => document
                .duplicate_edit(node)
                .map_or_else(|_| Edit::batch("none", Vec::new()), |(_, edit)| edit),
            17 => self.shapes(document),
            18 if document.prefabs().count() < 4 => self.import(document),
            _ => {
                let prefabs: Vec<_> = document.prefabs().map(|(id, _)| id).collect();
                document
                    .instantiate_edit(
                        self.pick(&prefabs).unwrap_or_default(),
                        self.pick(&nodes),
                        self.local(),
                    )
                    .1
            }
        }
    }

    /// The node or a part of it.
    fn target(&mut self, document: &Document, node: NodeId) -> Target {
        let prefab = document.node(node).and_then(Node::prefab).and_then(|id| document.prefab(id));
        match prefab.map_or(0, |prefab| prefab.nodes().len()) {
            0 => Target::node(node),
            parts if self.below(3) > 0 => Target::part(node, self.below(parts) as u32),
            _ => Target::node(node),
        }
    }

    fn local(&mut self) -> Local {
        let rotation = DQuat::from_axis_angle(self.random.direction(), self.random.between(0.0, 6.0));
        let trs = Trs {
            translation: self.random.direction() * 9.0,
            rotation,
            scale: DVec3::splat(self.random.between(0.1, 3.0)),
        };
        if self.below(4) == 0 {
            Local::Matrix(DAffine3::from_mat3(glam::DMat3::from_cols_array(
                &[0; 9].map(|_| self.random.unit()),
            )))
        } else {
            trs.into()
        }
    }

    fn light(&mut self) -> Light {
        let kind = LightKind::Point { radius_m: self.random.unit() as f32, range_m: None };
        Light { color: Vec3::ONE, intensity: self.random.between(0.0, 100.0) as f32, kind }
    }

    fn material_edit(&mut self, document: &mut Document) -> Edit {
        let ids: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
        let value = Material { roughness: self.random.unit() as f32, ..Material::default() };
        match self.pick(&ids).filter(|_| self.below(4) > 0) {
            Some(material) => Edit::SetMaterial { material, value: Box::new(value) },
            None => {
                let material = MaterialId(document.allocate_id());
                Edit::AddMaterial { material, entry: Box::new(MaterialEntry::made_here(value)) }
            }
        }
    }

    /// Removes what may be unused; the document refuses when it is not.
    fn removal(&mut self, document: &Document) -> Edit {
        let prefabs: Vec<_> = document.prefabs().map(|(id, _)| id).collect();
        let meshes: Vec<_> = document.meshes().map(|(id, _)| id).collect();
        let materials: Vec<_> = document.materials().map(|(id, _)| id).collect();
        match self.below(3) {
            0 => Edit::RemovePrefab { prefab: self.pick(&prefabs).unwrap_or_default() },
            1 => Edit::RemoveMesh { mesh: self.pick(&meshes).unwrap_or_default() },
            _ => Edit::RemoveMaterial { material: self.pick(&materials).unwrap_or_default() },
        }
    }

    fn shapes(&mut self, document: &mut Document) -> Edit {
        let source = match self.below(2) {
            0 => ShapeSource::Sphere { centre: Vec3::ZERO, radius_m: self.random.unit() as f32 },
            _ => ShapeSource::Cloud(Cloud { seed: self.random.bits(), count: 9, ..Cloud::default() }),
        };
        let (_, edit) = document.add_shapes_edit("Shapes", source, &[], self.local()).expect("shapes");
        edit
    }

    fn import(&mut self, document: &mut Document) -> Edit {
        let imported = load(self.model, &ImportOptions::default()).expect("the model");
        let (prefab, add) = document.import_edit(imported);
        let (_, place) = document.instantiate_edit(prefab, None, self.local());
        Edit::batch("imported", vec![add, place])
    }
}
