//! Random steps on a session: the same seed makes the same steps. Every kind of edit is among them, and so are undo, redo,
//! gestures that are given up, times of an animation, and edits that must be refused.

use std::collections::BTreeMap;

use caustica::session::Session;
use caustica_scene::import::Imported;
use caustica_scene::{
    AlphaMode, Clearcoat, ClipChoice, Document, Edit, EditError, Environment, Light, LightKind, Local,
    Material, MaterialEntry, MaterialId, MeshId, Node, NodeId, NodeKind, OverrideField, PrefabId,
    ShadingMode, Target, TextureUse, Trs,
};
use caustica_tests::numbers::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec2, Vec3, Vec4};

use crate::targets::{removal, targets_of};

/// Most nodes of the document, about.
const MOST_NODES: usize = 56;
/// Fewest nodes, about.
const FEWEST_NODES: usize = 16;

/// What makes the steps.
pub struct Churn {
    random: Random,
    /// The file, and as it is after somebody has edited it.
    models: [Imported; 2],
    sky: Environment,
    /// How often each kind of step was made.
    pub counts: BTreeMap<&'static str, u32>,
    /// Edits that the document has refused.
    pub refused: u32,
}

/// Every kind of edit with its share of the steps.
const KINDS: [(&str, usize); 27] = [
    ("add mesh", 8),
    ("add instance", 3),
    ("add light", 2),
    ("add group", 2),
    ("duplicate", 3),
    ("remove", 4),
    ("move", 14),
    ("move part", 10),
    ("show or hide", 8),
    ("ray visibility", 6),
    ("hang elsewhere", 6),
    ("move primitive", 6),
    ("morph", 7),
    ("bend", 8),
    ("assign material", 8),
    ("change material", 8),
    ("add material", 2),
    ("remove material", 2),
    ("change light", 4),
    ("surround", 2),
    ("choose clip", 2),
    ("reset override", 6),
    ("reload", 1),
    ("import", 1),
    ("remove prefab", 1),
    ("rename", 1),
    ("no number", 1),
];

impl Churn {
    /// Steps from a seed; `models` are what is imported and read again, `sky` is a map from a file.
    pub fn new(seed: u64, models: [Imported; 2], sky: Environment) -> Self {
        Self { random: Random::new(seed), models, sky, counts: BTreeMap::new(), refused: 0 }
    }

    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.random.bits() >> 33) as usize % limit.max(1)
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> Option<T> {
        list.get(self.below(list.len())).copied()
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.between(low, high)
    }

    fn color(&mut self) -> Vec3 {
        Vec3::from_array([0; 3].map(|_| self.between(0.05, 0.95) as f32))
    }

    /// Makes one step and says which.
    pub fn step(&mut self, session: &mut Session) -> String {
        match self.below(100) {
            0..6 => self.go_back_and_forth(session),
            6..9 => self.drag(session),
            9..12 => {
                let time_s = (self.below(3) > 0).then(|| self.between(0.0, 4.0));
                session.set_time(time_s);
                self.count("time");
                format!("time {time_s:?}")
            }
            12..18 => self.push(session, Self::batch),
            _ => self.push(session, Self::edit),
        }
    }

    fn count(&mut self, kind: &'static str) {
        *self.counts.entry(kind).or_default() += 1;
    }

    fn push(&mut self, session: &mut Session, make: fn(&mut Self, &mut Document) -> Edit) -> String {
        let before = session.document().clone();
        let mut words = String::new();
        let pushed = session.edit_with(|document| {
            let edit = make(self, document);
            words = edit.describe(document);
            ((), edit)
        });
        if self.below(3) == 0 {
            session.end_gesture();
        }
        match pushed {
            Ok(()) => words,
            Err(error) => {
                let expected =
                    matches!(error, EditError::Cycle | EditError::NotFinite | EditError::InUse { .. });
                assert!(expected, "{words}: {error}");
                assert!(*session.document() == before, "{words} was refused and left something behind");
                self.refused += 1;
                format!("{words}: refused, {error}")
            }
        }
    }

    fn go_back_and_forth(&mut self, session: &mut Session) -> String {
        let back = 1 + self.below(8);
        let undone = (0..back).filter_map(|_| session.undo()).count();
        let forth = self.below(back + 1);
        let redone = (0..forth).filter_map(|_| session.redo()).count();
        self.count("undo");
        format!("undid {undone} and redid {redone}")
    }

    /// Several places of one node, given up or kept.
    fn drag(&mut self, session: &mut Session) -> String {
        let nodes: Vec<NodeId> = session.document().nodes().map(|(id, _)| id).collect();
        let Some(node) = self.pick(&nodes) else { return String::from("nothing to drag") };
        session.end_gesture();
        for _ in 0..3 {
            let edit = Edit::SetTransform { target: Target::node(node), local: self.place() };
            session.push(edit).expect("a node can be moved");
        }
        self.count("drag");
        if self.below(2) == 0 {
            session.cancel_gesture();
            return format!("dragged {} and gave up", node.0);
        }
        session.end_gesture();
        format!("dragged {}", node.0)
    }

    fn batch(&mut self, document: &mut Document) -> Edit {
        self.count("batch");
        // All are made for the document before the first: none takes away what another names.
        let kinds =
            ["add mesh", "move", "show or hide", "bend", "change material", "move primitive", "duplicate"];
        let first = self.below(kinds.len() - 2);
        let edits = kinds[first..first + 3].iter().map(|kind| self.edit_of(document, kind)).collect();
        Edit::batch("did three", edits)
    }

    fn edit(&mut self, document: &mut Document) -> Edit {
        let count = document.node_count();
        let kind = match count {
            _ if count < FEWEST_NODES => ["add mesh", "add instance", "duplicate"][self.below(3)],
            _ if count > MOST_NODES => "remove",
            _ => {
                let total: usize = KINDS.iter().map(|(_, share)| share).sum();
                let mut place = self.below(total);
                let chosen = KINDS.iter().find(|(_, share)| {
                    let here = place < *share;
                    place = place.saturating_sub(*share);
                    here
                });
                chosen.map_or("move", |(kind, _)| kind)
            }
        };
        self.edit_of(document, kind)
    }

    fn edit_of(&mut self, document: &mut Document, kind: &'static str) -> Edit {
        let edit = match kind {
            "add mesh" | "add instance" | "add light" | "add group" | "duplicate" | "remove"
            | "hang elsewhere" => self.tree_edit(document, kind),
            "reload" | "import" | "remove prefab" | "add material" | "remove material" => {
                self.asset_edit(document, kind)
            }
            _ => self.value_edit(document, kind),
        };
        // Without anything to act upon another group does no harm.
        self.count(if edit.is_some() { kind } else { "nothing there" });
        edit.unwrap_or_else(|| document.add_edit(Node::new("spare", NodeKind::Group), None).1)
    }

    fn tree_edit(&mut self, document: &mut Document, kind: &str) -> Option<Edit> {
        let nodes: Vec<NodeId> = document.nodes().map(|(id, _)| id).collect();
        let parent = self.pick(&nodes).filter(|_| self.below(3) == 0);
        let name = format!("{kind} {}", document.next_id());
        let add = |churn: &mut Self, document: &mut Document, kind: NodeKind| {
            document.add_edit(Node::new(name, kind).with_local(churn.place()), parent).1
        };
        Some(match kind {
            "add mesh" => {
                let meshes: Vec<MeshId> = document.meshes().map(|(id, _)| id).collect();
                let mesh = self.pick(&meshes)?;
                let kind = self.mesh_node(document, mesh)?;
                add(self, document, kind)
            }
            "add instance" => {
                let prefabs: Vec<PrefabId> = document.prefabs().map(|(id, _)| id).collect();
                let prefab = self.pick(&prefabs)?;
                add(self, document, NodeKind::instance_of(prefab))
            }
            "add light" => {
                let light = self.light();
                add(self, document, NodeKind::Light(light))
            }
            "duplicate" => document.duplicate_edit(self.pick(&nodes)?).ok()?.1,
            "remove" => Edit::RemoveNode { node: self.pick(&nodes)? },
            "hang elsewhere" => {
                let (node, index) = (self.pick(&nodes)?, self.below(4));
                match self.below(2) {
                    0 => Edit::Reparent { node, parent, index, local: self.place() },
                    _ => document.reparent_edit(node, parent, index).ok()?,
                }
            }
            _ => add(self, document, NodeKind::Group),
        })
    }

    fn mesh_node(&mut self, document: &Document, mesh: MeshId) -> Option<NodeKind> {
        let found = document.mesh(mesh)?;
        let (primitives, targets) = (found.primitives.len(), found.data.morph.len());
        let materials = (0..primitives).filter_map(|_| self.material(document)).collect();
        let weights = match self.below(2) {
            0 => Vec::new(),
            _ => (0..targets).map(|_| self.between(-0.5, 1.5) as f32).collect(),
        };
        Some(NodeKind::Mesh { mesh, materials, weights })
    }

    fn asset_edit(&mut self, document: &mut Document, kind: &str) -> Option<Edit> {
        let prefabs: Vec<PrefabId> = document.prefabs().map(|(id, _)| id).collect();
        Some(match kind {
            "reload" => {
                let version = self.below(2);
                document.reload_edit(self.pick(&prefabs)?, self.models[version].clone()).ok()?
            }
            "import" if prefabs.len() < 3 => {
                let (prefab, add) = document.import_edit(self.models[0].clone());
                let (_, place) = document.instantiate_edit(prefab, None, self.place());
                Edit::batch("imported again", vec![add, place])
            }
            "import" => return None,
            "remove prefab" if prefabs.len() > 1 => {
                let prefab = self.pick(&prefabs)?;
                removal(document, prefab)?
            }
            "remove prefab" => Edit::RemovePrefab { prefab: self.pick(&prefabs)? },
            "add material" => {
                let material = MaterialId(document.allocate_id());
                let value = self.material_value(document, Material::default());
                Edit::AddMaterial { material, entry: Box::new(MaterialEntry::made_here(value)) }
            }
            _ => {
                let own: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
                Edit::RemoveMaterial { material: self.pick(&own)? }
            }
        })
    }

    fn value_edit(&mut self, document: &mut Document, kind: &str) -> Option<Edit> {
        let targets = targets_of(document);
        let any = self.pick(&targets)?;
        let parts: Vec<Target> = targets.iter().copied().filter(|target| target.part.is_some()).collect();
        let mut of = |wanted: &dyn Fn(Target) -> bool| {
            let list: Vec<Target> = targets.iter().copied().filter(|target| wanted(*target)).collect();
            self.pick(&list)
        };
        Some(match kind {
            "move" => Edit::SetTransform { target: Target::node(any.node), local: self.place() },
            "move part" => Edit::SetTransform { target: self.pick(&parts)?, local: self.place() },
            "show or hide" => Edit::SetVisible { target: any, visible: self.below(4) > 0 },
            "ray visibility" => {
                let target = of(&|target| document.mesh_of(target).is_some())?;
                let [camera_visible, casts_shadows] = [0; 2].map(|_| self.below(3) > 0);
                Edit::SetRayVisibility { target, camera_visible, casts_shadows }
            }
            "move primitive" => {
                let mesh = document.mesh_of(of(&|target| document.mesh_of(target).is_some())?)?;
                let primitive = self.below(document.mesh(mesh)?.primitives.len()) as u32;
                Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive: self.shift() }
            }
            "morph" => {
                let target = of(&|target| document.morph_weights(target).is_some())?;
                let count = document.morph_weights(target)?.len();
                let weights = (0..count).map(|_| self.between(-0.5, 1.5) as f32).collect();
                Edit::SetMorphWeights { target, weights }
            }
            "bend" => {
                let target = of(&|target| {
                    document.part(target).is_some_and(|part| part.name == "Knee" || part.name == "Toe")
                })?;
                let angle_rad = self.between(-1.2, 1.2);
                let local = Trs {
                    translation: DVec3::Y * 0.5,
                    rotation: DQuat::from_rotation_x(angle_rad),
                    ..Trs::default()
                };
                Edit::SetTransform { target, local: local.into() }
            }
            "assign material" => {
                let target = of(&|target| document.mesh_of(target).is_some())?;
                let mesh = document.mesh(document.mesh_of(target)?)?;
                let primitive = self.below(mesh.primitives.len()) as u32;
                Edit::AssignMaterial { target, primitive, material: self.material(document)? }
            }
            "change material" => {
                let material = self.material(document)?;
                let value = self.material_value(document, document.material(material)?.clone());
                Edit::SetMaterial { material, value: Box::new(value) }
            }
            "change light" => {
                let target = of(&|target| document.light_of(target).is_some())?;
                Edit::SetLight { target, light: self.light() }
            }
            "surround" => Edit::SetEnvironment(match self.below(4) {
                0 => Environment::Auto,
                1 => self.sky.clone(),
                2 => Environment::Constant(Vec3::ZERO),
                _ => Environment::Constant(self.color() * 0.3),
            }),
            "choose clip" => {
                let node = of(&|target| !document.clips_of(target.node).is_empty())?.node;
                let clips = [ClipChoice::First, ClipChoice::None, ClipChoice::All, ClipChoice::Clip(0)];
                Edit::SetClip { node, clip: clips[self.below(4)] }
            }
            "reset override" => {
                let target = of(&|target| document.part_override(target).is_some())?;
                Edit::ResetOverride { target, field: self.field() }
            }
            "rename" => Edit::Rename { target: any, name: format!("name {}", self.below(100)) },
            _ => {
                let local = Trs::from_translation(DVec3::new(0.0, f64::NAN, 0.0)).into();
                Edit::SetTransform { target: any, local }
            }
        })
    }

    fn field(&mut self) -> OverrideField {
        let fields = [
            OverrideField::Local,
            OverrideField::Visible,
            OverrideField::Material(0),
            OverrideField::Material(1),
            OverrideField::Light,
            OverrideField::Weights,
            OverrideField::RayVisibility,
            OverrideField::All,
        ];
        fields[self.below(fields.len())]
    }

    fn material(&mut self, document: &Document) -> Option<MaterialId> {
        let materials: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
        self.pick(&materials)
    }

    /// Changes what makes most work: whether light passes, whether it shines, which sides are seen, its texture, whether it has lobes.
    fn material_value(&mut self, document: &Document, old: Material) -> Material {
        let color = self.color();
        match self.below(10) {
            0 => Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..old },
            1 => Material { alpha: AlphaMode::Opaque, ..old },
            2 => Material { emissive: color, emissive_strength: self.between(0.5, 3.0) as f32, ..old },
            3 => Material { emissive: Vec3::ZERO, ..old },
            4 => Material { double_sided: !old.double_sided, ..old },
            5 => {
                let modes = [ShadingMode::Pbr, ShadingMode::Reflective, ShadingMode::Refractive];
                Material { mode: modes[self.below(3)], transmission: 0.0, has_volume: true, ..old }
            }
            6 => {
                let textures: Vec<_> = document.textures().map(|(id, _)| id).collect();
                let used = self.pick(&textures).map(|texture| TextureUse {
                    texture,
                    tex_coord: 0,
                    offset: Vec2::ZERO,
                    rotation_rad: 0.0,
                    scale: Vec2::ONE,
                });
                Material { base_color_texture: used.filter(|_| self.below(2) == 0), ..old }
            }
            7 => {
                let coat = Clearcoat { factor: 0.5, roughness: 0.5, ..Clearcoat::default() };
                Material { clearcoat: Some(coat).filter(|_| self.below(2) == 0), ..old }
            }
            _ => {
                let roughness = self.between(0.0, 1.0) as f32;
                let base_color = Vec4::from((color, 1.0));
                Material { base_color, roughness, metallic: 0.0, ..old }
            }
        }
    }

    fn light(&mut self) -> Light {
        let intensity = [0.0, 1.0, 4.0][self.below(3)];
        let radius_m = [0.0, 0.15][self.below(2)];
        let kind = match self.below(4) {
            0 => LightKind::Directional { angular_radius_rad: 0.01 },
            1 => LightKind::Spot { radius_m, range_m: None, inner_rad: 0.2, outer_rad: 0.7 },
            2 => LightKind::Point { radius_m, range_m: Some(3.0) },
            _ => LightKind::Point { radius_m, range_m: None },
        };
        Light { color: self.color(), intensity, kind }
    }

    fn rotation(&mut self) -> DQuat {
        let angle_rad = self.between(0.0, std::f64::consts::TAU);
        DQuat::from_axis_angle(self.random.direction(), angle_rad)
    }

    /// A place in sight; now and then mirrored, sheared, flat, without size, or very small.
    fn place(&mut self) -> Local {
        let translation =
            DVec3::new(self.between(-2.0, 2.0), self.between(0.1, 1.9), self.between(-2.0, 1.5));
        let rotation = self.rotation();
        let mut scale = DVec3::from_array([0; 3].map(|_| self.between(0.5, 1.2)));
        let matrix = |x: DVec3, y: DVec3, z: DVec3| {
            Local::Matrix(DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), translation))
        };
        match self.below(40) {
            0 => scale = DVec3::ZERO,
            1 => scale.y = 0.0,
            2 => return matrix(rotation * DVec3::X, rotation * DVec3::Y, rotation * DVec3::X),
            3 => return matrix(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::Z * 0.5),
            4 => scale *= 1e-4,
            5..9 => scale.x = -scale.x,
            _ => {}
        }
        Trs { translation, rotation, scale }.into()
    }

    /// A small shift inside a mesh, now and then turned over, flat, or very small.
    fn shift(&mut self) -> DAffine3 {
        let translation = DVec3::from_array([0; 3].map(|_| self.between(-0.3, 0.3)));
        let scale = match self.below(12) {
            0 => DVec3::new(1.0, 1.0, -1.0),
            1 => DVec3::new(1.0, 0.0, 1.0),
            2 => DVec3::splat(1e-3),
            3 => return DAffine3::IDENTITY,
            _ => DVec3::splat(self.between(0.6, 1.2)),
        };
        DAffine3::from_scale_rotation_translation(scale, self.rotation(), translation)
    }
}
