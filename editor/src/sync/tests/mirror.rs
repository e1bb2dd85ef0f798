//! A stand-in for the renderer that takes deltas in as it does and refuses what it would refuse; and many edits in any
//! order, after each of which it must hold what a renderer holds that is given the whole scene.

use std::collections::{BTreeMap, BTreeSet};

use caustica_renderer::delta::{
    Geometry, Instance, InstanceId, Light, LightId, Material, MaterialId, MeshId, Pose, SceneDelta, TextureId,
};
use caustica_scene::{ClipChoice, Document, Edit, Local, NodeId, Target, Trs};
use glam::{DAffine3, DQuat, DVec3};

use super::super::{Sync, least_bytes};
use super::rig::{BODY, BOX, JOINT, LAMP, Rig, STATUE, TWIN};

#[derive(Clone, Debug, Default, PartialEq)]
struct MirrorMesh {
    geometries: Vec<Geometry>,
    joints: usize,
    targets: usize,
}

/// What a renderer holds.
#[derive(Debug, Default, PartialEq)]
struct Mirror {
    meshes: BTreeMap<MeshId, MirrorMesh>,
    materials: BTreeMap<MaterialId, Material>,
    textures: BTreeSet<TextureId>,
    instances: BTreeMap<InstanceId, Instance>,
    lights: BTreeMap<LightId, Light>,
}

impl Mirror {
    fn apply(&mut self, delta: &SceneDelta) {
        self.apply_assets(delta);
        for id in &delta.removed_instances {
            assert!(self.instances.remove(id).is_some(), "{id:?} is not there");
        }
        self.instances.extend(delta.instances.iter().cloned());
        let whole: BTreeSet<InstanceId> = delta.instances.iter().map(|(id, _)| *id).collect();
        assert_eq!(whole.len(), delta.instances.len(), "an instance is sent twice");
        for (id, place) in &delta.transforms {
            self.detail(id, &whole).render_from_mesh = *place;
        }
        for (id, seen) in &delta.visibility {
            self.detail(id, &whole).visibility = *seen;
        }
        for (id, pose) in &delta.poses {
            self.detail(id, &whole).pose = Some(pose.clone());
        }
        for id in &delta.removed_lights {
            assert!(self.lights.remove(id).is_some(), "light {id:?} is not there");
        }
        self.lights.extend(delta.lights.iter().copied());
        for id in &delta.removed_meshes {
            assert!(self.meshes.remove(id).is_some(), "{id:?} is not there");
        }
        self.assert_whole();
    }

    fn detail(&mut self, id: &InstanceId, whole: &BTreeSet<InstanceId>) -> &mut Instance {
        assert!(!whole.contains(id), "{id:?} is sent whole and in detail");
        self.instances.get_mut(id).unwrap()
    }

    fn apply_assets(&mut self, delta: &SceneDelta) {
        for (id, mesh) in &delta.meshes {
            let (joints, targets) = mesh
                .deformation
                .as_ref()
                .map_or((0, 0), |shape| (shape.joint_count as usize, shape.targets.len()));
            self.meshes.insert(*id, MirrorMesh { geometries: mesh.geometries.clone(), joints, targets });
        }
        for (id, index, map) in &delta.primitive_transforms {
            self.meshes.get_mut(id).unwrap().geometries[*index as usize].mesh_from_primitive = *map;
        }
        self.textures.extend(delta.textures.iter().map(|(id, _)| *id));
        for id in &delta.removed_textures {
            assert!(self.textures.remove(id), "{id:?} is not there");
        }
        self.materials.extend(delta.materials.iter().cloned());
        for id in &delta.removed_materials {
            assert!(self.materials.remove(id).is_some(), "{id:?} is not there");
        }
    }

    /// Nothing names what is not there, and poses fit.
    fn assert_whole(&self) {
        for (id, instance) in &self.instances {
            let mesh = &self.meshes[&instance.mesh];
            assert_eq!(instance.materials.len(), mesh.geometries.len(), "{id:?}");
            assert!(instance.materials.iter().all(|id| self.materials.contains_key(id)), "{id:?}");
            let size = |pose: &Pose| (pose.joints.len(), pose.weights.len());
            let deforms = (mesh.joints, mesh.targets) != (0, 0);
            assert_eq!(instance.pose.as_ref().map(size), deforms.then_some((mesh.joints, mesh.targets)));
        }
        for material in self.materials.values() {
            let texture = material.base_color_texture.map(|used| used.texture);
            assert!(texture.is_none_or(|id| self.textures.contains(&id)));
        }
    }

    /// What a renderer would hold that had the whole scene sent to it.
    fn of(document: &Document, eye: DVec3) -> Self {
        let mut document = document.clone();
        document.drain_changes();
        document.mark_all_added("whole");
        let mut mirror = Self::default();
        mirror.apply(&Sync::new().delta(&mut document, eye));
        mirror
    }
}

/// A generator that gives the same numbers everywhere (Knuth's MMIX constants).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }

    fn yes(&mut self) -> bool {
        self.below(2) == 0
    }

    fn place(&mut self) -> Local {
        let mut number = || self.below(2000) as f64 * 0.01 - 10.0;
        let translation = DVec3::new(number(), number(), number());
        let rotation = DQuat::from_rotation_y(number());
        Trs { translation, rotation, scale: DVec3::splat(number()) }.into()
    }
}

/// An edit of one of the instances; some do not fit and are refused.
fn any_edit(rig: &mut Rig, nodes: &[NodeId], numbers: &mut Numbers) -> Edit {
    let node = nodes[numbers.below(nodes.len() as u64) as usize];
    let part = Target::part(node, [BOX, BODY, TWIN, STATUE][numbers.below(4) as usize]);
    let any = Target::part(node, numbers.below(u64::from(LAMP) + 1) as u32);
    let mesh = rig.document.mesh_of(part);
    match numbers.below(12) {
        0 => Edit::SetTransform { target: node.into(), local: numbers.place() },
        1 => Edit::SetTransform { target: any, local: numbers.place() },
        2 => Edit::SetTransform { target: Target::part(node, JOINT), local: numbers.place() },
        3 => {
            Edit::SetVisible { target: if numbers.yes() { any } else { node.into() }, visible: numbers.yes() }
        }
        4 => Edit::SetRayVisibility {
            target: part,
            camera_visible: numbers.yes(),
            casts_shadows: numbers.yes(),
        },
        5 => Edit::SetMorphWeights { target: part, weights: vec![numbers.below(5) as f32 * 0.25] },
        6 => {
            let clip = [ClipChoice::First, ClipChoice::None, ClipChoice::All][numbers.below(3) as usize];
            Edit::SetClip { node, clip }
        }
        7 => {
            let mesh_from_primitive = DAffine3::from_translation(DVec3::X * numbers.below(4) as f64);
            let primitive = numbers.below(2) as u32;
            Edit::SetPrimitiveTransform {
                mesh: mesh.unwrap_or(caustica_scene::MeshId(0)),
                primitive,
                mesh_from_primitive,
            }
        }
        8 | 9 => {
            let materials: Vec<_> = rig.document.materials().map(|(id, _)| id).collect();
            let material = materials[numbers.below(materials.len() as u64) as usize];
            Edit::AssignMaterial { target: part, primitive: numbers.below(2) as u32, material }
        }
        10 => Edit::RemoveNode { node },
        _ => rig.document.instantiate_edit(rig.prefab, None, numbers.place()).1,
    }
}

#[test]
fn whatever_the_edits_the_renderer_holds_what_the_whole_scene_would_give_it() {
    let mut rig = Rig::unsynced();
    let mut numbers = Numbers(20_261_125);
    let mut mirror = Mirror::default();
    let mut undos: Vec<Edit> = Vec::new();
    let mut refused = 0;
    for step in 0..600 {
        for _ in 0..=numbers.below(3) {
            let nodes: Vec<NodeId> = rig.document.nodes().map(|(id, _)| id).collect();
            let edit = match undos.pop() {
                Some(undo) if nodes.is_empty() || numbers.below(4) == 0 => undo,
                kept => {
                    undos.extend(kept);
                    any_edit(&mut rig, &nodes, &mut numbers)
                }
            };
            match rig.document.apply(edit) {
                Ok(undo) => undos.push(undo),
                Err(_) => refused += 1,
            }
        }
        if numbers.below(3) == 0 {
            let time_s = numbers.yes().then(|| numbers.below(9) as f64 * 0.25);
            rig.document.set_time(time_s);
        }
        let eye = DVec3::X * if numbers.below(5) == 0 { 1e9 } else { 0.0 };
        let delta = rig.sync.delta(&mut rig.document, eye);
        mirror.apply(&delta);
        assert_eq!(mirror, Mirror::of(&rig.document, eye), "step {step}: {}", delta.reason);
        let placed: BTreeSet<_> = rig.document.renderables().map(|placed| placed.mesh).collect();
        let meshes = placed.iter().filter_map(|id| rig.document.mesh(*id));
        assert_eq!(rig.sync.mesh_bytes(), meshes.map(least_bytes).sum::<u64>(), "step {step}");
    }
    assert!(refused < 600, "most edits fit: {refused} were refused");
}
