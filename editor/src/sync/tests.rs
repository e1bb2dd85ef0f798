//! Deltas hold what changed and no more.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use caustica_scene::{Edit, Light, LightKind, Node, NodeKind, Trs};
use glam::Vec3;

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
