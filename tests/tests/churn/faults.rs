//! One of two hundred instances is spoilt through the document: it is lost, and no other. What spoils one through the renderer
//! is tested in `pipelines.rs`.

use std::collections::BTreeSet;

use caustica::session::Session;
use caustica_renderer::delta::InstanceId;
use caustica_renderer::{NeedsMode, Pipeline, ViewSettings};
use caustica_scene::{Edit, EditError, Local, Node, NodeId, NodeKind, Target, Trs};
use caustica_tests::gpu;
use caustica_tests::numbers::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::images::{Image, differing};
use crate::{EXTENT, frame, furnish, model, new_session, settings};

/// Two hundred instances of a mesh with two primitives, anywhere in sight.
fn crowd(session: &mut Session) -> Vec<NodeId> {
    let mesh = session.document().meshes().find(|(_, mesh)| mesh.name == "Pair").expect("the pair").0;
    let paint = session.document().materials().next().expect("a material").0;
    let mut random = Random::new(200);
    let mut number = |low: f64, high: f64| random.between(low, high);
    (0..200)
        .map(|_| {
            let local = Trs {
                translation: DVec3::new(number(-2.5, 2.5), number(0.1, 2.0), number(-3.0, 1.5)),
                rotation: DQuat::from_rotation_y(number(0.0, 6.0)) * DQuat::from_rotation_x(number(0.0, 6.0)),
                scale: DVec3::splat(number(0.2, 0.5)),
            };
            let kind = NodeKind::Mesh { mesh, materials: vec![paint; 2], weights: Vec::new() };
            let node = Node::new("box", kind).with_local(local);
            session.edit_with(|document| document.add_edit(node, None)).expect("a box")
        })
        .collect()
}

/// The first, the last and one in the middle of those that the camera sees.
fn seen_of(session: &mut Session, crowd: &[NodeId]) -> [NodeId; 3] {
    let mut seen: BTreeSet<NodeId> = BTreeSet::new();
    for pixel in (0..EXTENT[0]).step_by(4).flat_map(|x| (0..EXTENT[1]).step_by(4).map(move |y| [x, y])) {
        seen.extend(session.pick(pixel).expect("a pick").map(|pick| pick.target.node));
    }
    let seen: Vec<NodeId> = crowd.iter().copied().filter(|node| seen.contains(node)).collect();
    assert!(seen.len() > 30, "{} are seen", seen.len());
    [seen[0], seen[seen.len() / 2], seen[seen.len() - 1]]
}

fn picture(session: &mut Session, pipeline: Pipeline) -> Image {
    // Another seed and back: the samples start again.
    session.set_settings(ViewSettings { seed: 9, ..settings(pipeline, NeedsMode::Auto) });
    session.set_settings(settings(pipeline, NeedsMode::Auto));
    for _ in 0..4 {
        frame(session, EXTENT);
    }
    assert_eq!(session.samples(), 4);
    Image(vec![session.read_back().expect("an image")])
}

/// Transforms that leave nothing to be seen, and one that is too large for single precision.
fn spoilt() -> [(&'static str, Local); 4] {
    let scaled = |scale: DVec3| Local::from(Trs { scale, ..Trs::from_translation(DVec3::Y) });
    let x = DVec3::new(0.3, 0.4, 0.0);
    let alike = DAffine3::from_mat3_translation(DMat3::from_cols(x, x, x * 2.0), DVec3::Y);
    [
        ("without size", scaled(DVec3::ZERO)),
        ("all axes alike", Local::Matrix(alike)),
        ("a line", scaled(DVec3::new(1.0, 0.0, 0.0))),
        ("past single precision", scaled(DVec3::splat(1e300))),
    ]
}

#[test]
fn a_spoilt_instance_of_two_hundred_is_lost_alone() {
    let gpu = gpu::session();
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = new_session(&gpu, NeedsMode::Auto, None);
    furnish(&mut session, &model::write(folder.path()));
    let crowd = crowd(&mut session);
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Raster] {
        let whole = picture(&mut session, pipeline);
        for victim in seen_of(&mut session, &crowd) {
            let target = Target::node(victim);
            session.push(Edit::SetVisible { target, visible: false }).expect("hidden");
            let without = picture(&mut session, pipeline);
            session.undo();
            assert!(differing(&whole, &without) > 3, "it is seen, or its shadow is");
            for (name, local) in spoilt() {
                session.push(Edit::SetTransform { target, local }).expect("a place");
                let found = picture(&mut session, pipeline);
                assert_eq!(differing(&found, &without), 0, "{name}, {}", pipeline.name());
                let inventory = session.inventory().expect("an inventory");
                let lost: Vec<_> =
                    inventory.instances.iter().filter(|(_, i)| i.blas.is_none()).map(|(id, _)| *id).collect();
                assert_eq!(lost, [InstanceId { node: victim.0, part: 0 }], "{name}");
                session.undo();
            }
            let back = picture(&mut session, pipeline);
            assert_eq!(differing(&back, &whole), 0, "and back, {}", pipeline.name());
        }
    }
    let nan = Trs::from_translation(DVec3::NAN).into();
    let refused = session.push(Edit::SetTransform { target: Target::node(crowd[7]), local: nan });
    assert_eq!(refused, Err(EditError::NotFinite));
}

/// Maps of a primitive that leave single precision: the last two with entries that are all in it.
fn beyond() -> [(&'static str, DAffine3); 4] {
    let far = DVec3::splat(3e38);
    [
        ("far beyond", DAffine3::from_translation(DVec3::Y * 1e300)),
        ("large beyond", DAffine3::from_scale(DVec3::splat(1e39))),
        ("far", DAffine3::from_translation(far)),
        ("sheared", DAffine3::from_mat3(DMat3::from_cols(far, -far, DVec3::Z))),
    ]
}

#[test]
fn a_spoilt_primitive_is_lost_alone() {
    let gpu = gpu::session();
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = new_session(&gpu, NeedsMode::Auto, None);
    furnish(&mut session, &model::write(folder.path()));
    crowd(&mut session);
    let mesh = session.document().meshes().find(|(_, mesh)| mesh.name == "Pair").expect("the pair").0;
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Raster] {
        let whole = picture(&mut session, pipeline);
        let mut put = |map: DAffine3| {
            let edit = Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive: map };
            session.push(edit).expect("a place");
            let found = picture(&mut session, pipeline);
            session.undo();
            found
        };
        let without = put(DAffine3::from_scale(DVec3::ZERO));
        assert!(differing(&whole, &without) > 100, "the primitive is seen");
        for (name, map) in beyond() {
            assert_eq!(differing(&put(map), &without), 0, "{name}, {}", pipeline.name());
        }
        // Boxes touch each other, and another tree may find the other one first.
        assert!(differing(&picture(&mut session, pipeline), &whole) < 40, "and back, {}", pipeline.name());
    }
}
