//! Deltas hold what changed and no more.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod mirror;
pub(super) mod rig;

use std::sync::Arc;

use super::*;
use caustica_scene::{
    Animation, Channel, ChannelPath, Edit, Interpolation, Light, LightKind, Local, MaterialId, Node,
    NodeKind, Property, SkinData, Trs,
};
use glam::{Affine3A, Vec3};
use rig::{BODY, BOX, JOINT, LAMP, Rig, STATUE, TWIN, body, filled, imported};

fn light() -> NodeKind {
    NodeKind::Light(Light {
        color: Vec3::ONE,
        intensity: 2.0,
        kind: LightKind::Point { radius_m: 0.0, range_m: None },
    })
}

#[test]
fn a_light_is_sent_moved_and_removed() {
    let (mut document, mut sync) = (Document::new(), Sync::new());
    let (node, edit) = document.add_edit(Node::new("lamp", light()), None);
    document.apply(edit).unwrap();
    let delta = sync.delta(&mut document, DVec3::ZERO);
    assert_eq!(delta.lights.len(), 1);
    assert!(delta.environment.is_some());

    assert!(sync.delta(&mut document, DVec3::ZERO).is_empty(), "nothing changed");

    let local = Trs { translation: DVec3::new(1.0, 2.0, 3.0), ..Trs::default() }.into();
    document.apply(Edit::SetTransform { target: Target::node(node), local }).unwrap();
    let delta = sync.delta(&mut document, DVec3::ZERO);
    let delta::Light::Point { position, .. } = delta.lights[0].1 else { unreachable!("a point light") };
    assert_eq!(position, Vec3::new(1.0, 2.0, 3.0));

    document.apply(Edit::RemoveNode { node }).unwrap();
    let delta = sync.delta(&mut document, DVec3::ZERO);
    assert_eq!((delta.lights.len(), delta.removed_lights.len()), (0, 1));
}

#[test]
fn far_from_the_origin_positions_are_relative_to_the_render_origin() {
    let (mut document, mut sync) = (Document::new(), Sync::new());
    let far = DVec3::new(1e9, 0.0, 0.0);
    let local = Trs { translation: far + DVec3::new(0.125, 0.0, 0.0), ..Trs::default() };
    let (_, edit) = document.add_edit(Node::new("lamp", light()).with_local(local), None);
    document.apply(edit).unwrap();
    let delta = sync.delta(&mut document, far);
    let delta::Light::Point { position, .. } = delta.lights[0].1 else { unreachable!("a point light") };
    let world = sync.origin() + position.as_dvec3();
    assert_eq!(world - far, DVec3::new(0.125, 0.0, 0.0));
    assert!(delta.render_origin_changed);
}

fn at(x: f64) -> Local {
    Trs::from_translation(DVec3::new(x, 0.0, 0.0)).into()
}

fn moved_by(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, 0.0, 0.0))
}

/// Joints of the pose that an instance was sent with, and its weights.
fn sent_pose(delta: &SceneDelta, id: delta::InstanceId) -> Option<(Vec<Affine3A>, Vec<f32>)> {
    let (_, instance) = delta.instances.iter().find(|(sent, _)| *sent == id).unwrap();
    instance.pose.clone().map(|pose| (pose.joints, pose.weights))
}

#[test]
fn a_new_scene_is_sent_whole_with_poses_of_the_size_that_its_meshes_ask_for() {
    let mut rig = Rig::unsynced();
    rig.document.set_time(Some(1.0));
    let delta = rig.delta();
    let all = [
        ("meshes", 2),
        ("textures", 1),
        ("materials", 2),
        ("instances", 4),
        ("lights", 1),
        ("environment", 1),
    ];
    assert_eq!(filled(&delta), all);
    let deformations: Vec<_> = delta.meshes.iter().map(|(_, mesh)| mesh.deformation.as_ref()).collect();
    assert!(deformations[0].is_none(), "the box is rigid");
    let body = deformations[1].unwrap();
    assert_eq!((body.joint_count, body.joints.len(), body.weights.len(), body.targets.len()), (2, 3, 3, 1));

    assert_eq!(sent_pose(&delta, rig.id(BOX)), None);
    let half = moved_by(0.5);
    assert_eq!(sent_pose(&delta, rig.id(BODY)), Some((vec![half, half], vec![0.0])));
    assert_eq!(sent_pose(&delta, rig.id(TWIN)), Some((vec![half, half], vec![0.0])), "of three joints");
    assert_eq!(sent_pose(&delta, rig.id(STATUE)), Some((vec![Affine3A::IDENTITY; 2], vec![0.0])));
    assert!(rig.delta().is_empty(), "nothing changed");
}

#[test]
fn what_moves_is_sent_as_transforms_and_lights_alone() {
    let mut rig = Rig::new();
    let (delta, undo) = rig.apply(Edit::SetTransform { target: rig.node.into(), local: at(2.0) });
    assert_eq!(filled(&delta), [("transforms", 4), ("lights", 1)]);
    assert!(delta.transforms.iter().all(|(_, place)| *place == moved_by(2.0)));
    let (delta, _) = rig.apply(undo);
    assert_eq!(filled(&delta), [("transforms", 4), ("lights", 1)]);
    let (delta, _) = rig.apply(Edit::SetTransform { target: rig.part(BOX), local: at(3.0) });
    assert_eq!(filled(&delta), [("transforms", 1)]);
    assert_eq!(delta.transforms, [(rig.id(BOX), moved_by(3.0))]);
    let (delta, _) = rig.apply(Edit::SetTransform { target: rig.part(LAMP), local: at(3.0) });
    assert_eq!(filled(&delta), [("lights", 1)]);
    // A skinned mesh goes where its joints go, not with its part.
    let (delta, _) = rig.apply(Edit::SetTransform { target: rig.part(BODY), local: at(3.0) });
    assert_eq!(filled(&delta), []);
}

#[test]
fn what_is_hidden_is_sent_as_visibility_and_a_hidden_light_goes() {
    let mut rig = Rig::new();
    let (delta, undo) = rig.apply(Edit::SetVisible { target: rig.node.into(), visible: false });
    assert_eq!(filled(&delta), [("visibility", 4), ("removed lights", 1)]);
    assert!(delta.visibility.iter().all(|(_, seen)| !seen.shown && seen.to_camera && seen.to_shadows));
    let (delta, _) = rig.apply(undo);
    assert_eq!(filled(&delta), [("visibility", 4), ("lights", 1)]);

    let target = rig.part(BOX);
    for (to_camera, to_shadows) in [(false, true), (true, false), (true, true)] {
        let edit = Edit::SetRayVisibility { target, camera_visible: to_camera, casts_shadows: to_shadows };
        let (delta, _) = rig.apply(edit);
        assert_eq!(filled(&delta), [("visibility", 1)]);
        let seen = delta::Visibility { shown: true, to_camera, to_shadows };
        assert_eq!(delta.visibility, [(rig.id(BOX), seen)]);
    }
}

#[test]
fn a_primitive_that_moves_is_sent_alone_and_not_with_its_mesh() {
    let mut rig = Rig::new();
    let (mesh, map) = (rig.mesh_of(BOX), DAffine3::from_translation(DVec3::X));
    let (delta, _) = rig.apply(Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive: map });
    assert_eq!(filled(&delta), [("primitives", 1)]);
    assert_eq!(delta.primitive_transforms, [(delta::MeshId(mesh.0), 1, moved_by(1.0))]);
    // Who is synced afterwards gets the mesh as it is now.
    let mut fresh = Sync::new();
    rig.document.mark_all_added("again");
    let delta = fresh.delta(&mut rig.document, DVec3::ZERO);
    assert!(delta.primitive_transforms.is_empty());
    assert_eq!(delta.meshes[0].1.geometries[1].mesh_from_primitive, moved_by(1.0));
}

#[test]
fn a_time_step_sends_what_the_clip_moves_and_bends() {
    let mut rig = Rig::new();
    for (time_s, x) in [(Some(1.0), 0.5), (Some(2.0), 1.0), (None, 0.0)] {
        rig.document.set_time(time_s);
        let delta = rig.delta();
        assert_eq!(filled(&delta), [("transforms", 1), ("poses", 2)], "{time_s:?}");
        assert_eq!(delta.reason, "animation");
        assert_eq!(delta.transforms, [(rig.id(BOX), moved_by(x))]);
        let pose = |part| (rig.id(part), delta::Pose { joints: vec![moved_by(x); 2], weights: vec![0.0] });
        assert_eq!(delta.poses, [pose(BODY), pose(TWIN)]);
    }
    rig.document.set_time(None);
    assert!(rig.delta().is_empty(), "the same time again");
}

#[test]
fn joints_and_weights_are_sent_as_poses() {
    let mut rig = Rig::new();
    let (delta, _) = rig.apply(Edit::SetTransform { target: rig.part(JOINT + 2), local: at(1.0) });
    assert_eq!(filled(&delta), [("poses", 1)], "only the twin's skin has a toe");
    assert_eq!(delta.poses[0].1.joints, [Affine3A::IDENTITY, moved_by(1.0)]);
    let edit = Edit::SetMorphWeights { target: rig.part(STATUE), weights: vec![0.5] };
    let (delta, _) = rig.apply(edit);
    assert_eq!(filled(&delta), [("poses", 1)]);
    let pose = delta::Pose { joints: vec![Affine3A::IDENTITY; 2], weights: vec![0.5] };
    assert_eq!(delta.poses, [(rig.id(STATUE), pose)]);
}

#[test]
fn what_is_no_number_in_single_precision_bends_nothing() {
    let mut rig = Rig::new();
    let (delta, _) = rig.apply(Edit::SetTransform { target: rig.part(JOINT), local: at(1e300) });
    assert_eq!(delta.poses[0].1.joints, [Affine3A::IDENTITY; 2]);
}

#[test]
fn materials_come_and_go_with_their_textures() {
    let mut rig = Rig::new();
    let of = |rig: &Rig| rig.document.renderable(rig.part(BOX)).unwrap().materials;
    let [plain, textured] = of(&rig)[..] else { unreachable!("two primitives") };
    let assign = |target, material| Edit::AssignMaterial { target, primitive: 1, material };
    let (delta, undo) = rig.apply(assign(rig.part(BOX), plain));
    assert_eq!(filled(&delta), [("removed textures", 1), ("removed materials", 1), ("instances", 1)]);
    let (delta, _) = rig.apply(undo);
    assert_eq!(filled(&delta), [("textures", 1), ("materials", 1), ("instances", 1)]);

    let mut value = rig.document.material(textured).unwrap().clone();
    value.roughness = 0.25;
    let edit = |value: &caustica_scene::Material| Edit::SetMaterial {
        material: textured,
        value: Box::new(value.clone()),
    };
    let (delta, _) = rig.apply(edit(&value));
    assert_eq!(filled(&delta), [("materials", 1)]);
    value.base_color_texture = None;
    let (delta, _) = rig.apply(edit(&value));
    assert_eq!(filled(&delta), [("removed textures", 1), ("materials", 1)]);
    let material = delta::MaterialId(textured.0);
    assert_eq!(delta.materials.iter().map(|(id, _)| *id).collect::<Vec<_>>(), [material]);
}

/// A clip changes a material: it is sent as the time has it.
#[test]
fn materials_are_sent_in_their_pose() {
    let roughness = Property::of_material("pbrMetallicRoughness/roughnessFactor").unwrap();
    let mut file = imported(body());
    file.prefab.animations = vec![Arc::new(Animation::new(
        "polish",
        vec![Channel {
            part: 0,
            path: ChannelPath::Material(MaterialId(0), roughness),
            interpolation: Interpolation::Linear,
            times_s: [0.0, 1.0].into(),
            values: [1.0, 0.0].into(),
        }],
    ))];
    let mut rig = Rig::of(file);
    rig.delta();
    let material: MaterialId = rig.document.renderable(rig.part(BOX)).unwrap().materials[0];
    rig.document.set_time(Some(0.5));
    let delta = rig.delta();
    assert_eq!(filled(&delta), [("materials", 1)]);
    assert_eq!((delta.materials[0].0, delta.materials[0].1.roughness), (delta::MaterialId(material.0), 0.5));
    rig.document.set_time(None);
    assert_eq!(rig.delta().materials[0].1.roughness, 1.0);
}

#[test]
fn of_several_edits_in_a_frame_each_thing_is_sent_once() {
    let mut rig = Rig::new();
    let target = rig.part(BOX);
    let material: MaterialId = rig.document.renderable(target).unwrap().materials[0];
    rig.document.apply(Edit::SetTransform { target, local: at(1.0) }).unwrap();
    rig.document.apply(Edit::SetVisible { target, visible: false }).unwrap();
    rig.document.set_time(Some(1.0));
    let (delta, _) = rig.apply(Edit::AssignMaterial { target, primitive: 1, material });
    let expected = [("removed textures", 1), ("removed materials", 1), ("instances", 1), ("poses", 2)];
    assert_eq!(filled(&delta), expected);
    let sent = &delta.instances[0].1;
    assert!(!sent.visibility.shown);
    assert_eq!(sent.render_from_mesh, moved_by(0.5), "the clip's word counts");
}

#[test]
fn what_is_removed_takes_its_assets_along_and_comes_back_as_it_was() {
    let mut rig = Rig::new();
    rig.document.set_time(Some(2.0));
    rig.delta();
    let (delta, undo) = rig.apply(Edit::RemoveNode { node: rig.node });
    let gone = [
        ("removed meshes", 2),
        ("removed textures", 1),
        ("removed materials", 2),
        ("removed instances", 4),
        ("removed lights", 1),
    ];
    assert_eq!(filled(&delta), gone);
    let (delta, _) = rig.apply(undo);
    let back = [("meshes", 2), ("textures", 1), ("materials", 2), ("instances", 4), ("lights", 1)];
    assert_eq!(filled(&delta), back);
    assert_eq!(sent_pose(&delta, rig.id(BODY)).unwrap().0, [moved_by(1.0); 2], "in the pose of the time");
}

#[test]
fn a_mesh_with_other_joints_sends_the_poses_of_whoever_places_it() {
    let mut rig = Rig::new();
    let mesh = rig.mesh_of(BODY);
    let materials = rig.document.renderable(rig.part(BODY)).unwrap().materials;
    let kind = NodeKind::Mesh { mesh, materials, weights: Vec::new() };
    let (_, add) = rig.document.add_edit(Node::new("copy", kind), None);
    rig.apply(add);
    let whole = [1.0, 0.0, 0.0, 0.0];
    let mut data = rig::body();
    data.skin = Some(SkinData { joints: vec![[0; 4]; 3], weights: vec![whole; 3] });
    let edit = rig.document.reload_edit(rig.prefab, rig::imported(data)).unwrap();
    let (delta, _) = rig.apply(edit);
    assert_eq!(delta.poses.len(), 0);
    let counts = delta.instances.iter().filter_map(|(_, sent)| Some(sent.pose.as_ref()?.joints.len()));
    assert_eq!(counts.collect::<Vec<_>>(), [1; 4], "the copy too, which belongs to no instance");
}

#[test]
fn another_render_origin_moves_everything_and_bends_nothing() {
    let mut rig = Rig::new();
    let far = DVec3::new(1e9, 0.0, 0.0);
    let delta = rig.sync.delta(&mut rig.document, far);
    assert_eq!(filled(&delta), [("transforms", 4), ("lights", 1), ("origin", 1)]);
    assert_eq!(delta.reason, "render origin");
}

#[test]
fn clearing_takes_out_all_that_was_sent() {
    let gone = Rig::new().sync.clear();
    let all = [
        ("removed meshes", 2),
        ("removed textures", 1),
        ("removed materials", 2),
        ("removed instances", 4),
        ("removed lights", 1),
    ];
    assert_eq!(filled(&gone), all);
}
