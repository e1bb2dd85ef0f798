//! The gizmo's mathematics against places worked out by hand.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use caustica_scene::Projection;

use super::*;

const SIZE: DVec2 = DVec2::new(800.0, 600.0);

fn view() -> ViewProjection {
    let rotation = DQuat::from_euler(glam::EulerRot::YXZ, 0.6, -0.5, 0.0);
    let camera = DAffine3::from_rotation_translation(rotation, rotation * DVec3::new(0.0, 0.0, 10.0));
    ViewProjection::new(camera, Projection::Perspective { yfov_rad: 0.8 }, SIZE)
}

fn frame(view: &ViewProjection) -> Frame {
    Frame::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], view)
}

fn point(view: &ViewProjection, place: DVec3) -> DVec2 {
    view.project(place).unwrap()
}

#[test]
fn the_tip_of_an_axis_is_hit_and_empty_space_is_not() {
    let view = view();
    let frame = frame(&view);
    for axis in 0..3 {
        let tip = point(&view, frame.at(axis, 0.9));
        assert_eq!(hit(Tool::Move, &frame, &view, tip), Some(Handle::Axis(axis)));
        assert_eq!(hit(Tool::Scale, &frame, &view, tip), Some(Handle::Axis(axis)));
    }
    assert_eq!(hit(Tool::Move, &frame, &view, SIZE * 0.5), Some(Handle::Center));
    assert_eq!(hit(Tool::Move, &frame, &view, DVec2::new(5.0, 5.0)), None);
    assert_eq!(hit(Tool::Select, &frame, &view, SIZE * 0.5), None);
}

#[test]
fn planes_and_rings_are_hit() {
    let view = view();
    let frame = frame(&view);
    for axis in 0..3 {
        let corners = frame.plane_corners(axis);
        let middle = corners.iter().sum::<DVec3>() / 4.0;
        assert_eq!(hit(Tool::Move, &frame, &view, point(&view, middle)), Some(Handle::Plane(axis)));
        // The place of the ring that is nearest to the eye belongs to no other ring.
        let towards = view.towards_eye(DVec3::ZERO);
        let outwards = (towards - frame.axes[axis] * frame.axes[axis].dot(towards)).normalize();
        let nearest = DQuat::from_axis_angle(frame.axes[axis], 0.3) * outwards * frame.size_m;
        assert_eq!(hit(Tool::Rotate, &frame, &view, point(&view, nearest)), Some(Handle::Ring(axis)));
    }
}

#[test]
fn an_axis_drag_moves_exactly_as_far_as_the_pointer_shows() {
    let view = view();
    let frame = frame(&view);
    for axis in 0..3 {
        let (from, to) = (frame.at(axis, 0.8), frame.at(axis, 0.8) + frame.axes[axis] * 1.7);
        let mut drag = Drag::new(Tool::Move, Handle::Axis(axis), frame, point(&view, from));
        // The pointer may leave the axis sideways: only the part along it counts.
        let Motion::Translate(moved) = drag.motion(&view, point(&view, to), false).unwrap() else {
            unreachable!()
        };
        assert!((moved - frame.axes[axis] * 1.7).length() < 1e-9, "{axis}: {moved}");
    }
}

#[test]
fn a_plane_drag_stays_in_the_plane() {
    let view = view();
    let frame = frame(&view);
    let wanted = DVec3::new(0.7, 0.0, -0.4);
    let mut drag = Drag::new(Tool::Move, Handle::Plane(1), frame, point(&view, DVec3::ZERO));
    let motion = drag.motion(&view, point(&view, wanted), false).unwrap();
    let Motion::Translate(moved) = motion else { unreachable!() };
    assert!((moved - wanted).length() < 1e-9);
}

#[test]
fn snapped_moves_are_whole_steps() {
    let view = view();
    let frame = frame(&view);
    let step = snap_step_m(frame.size_m);
    let mut drag = Drag::new(Tool::Move, Handle::Axis(0), frame, point(&view, frame.at(0, 0.5)));
    let pointer = point(&view, frame.at(0, 0.5) + DVec3::X * step * 2.6);
    let Motion::Translate(moved) = drag.motion(&view, pointer, true).unwrap() else { unreachable!() };
    assert!((moved - DVec3::X * step * 3.0).length() < 1e-9);
}

#[test]
fn a_ring_turns_by_the_angle_between_the_places() {
    let view = view();
    let frame = frame(&view);
    for axis in 0..3 {
        let normal = frame.axes[axis];
        let arm = normal.any_orthonormal_vector() * frame.size_m;
        let mut drag = Drag::new(Tool::Rotate, Handle::Ring(axis), frame, point(&view, arm));
        let pointer = point(&view, DQuat::from_axis_angle(normal, 0.8) * arm);
        let Motion::Rotate { angle_rad, .. } = drag.motion(&view, pointer, false).unwrap() else {
            unreachable!()
        };
        assert!((angle_rad - 0.8).abs() < 1e-9, "{axis}: {angle_rad}");
    }
}

#[test]
fn a_ring_counts_more_than_half_a_turn() {
    let view = view();
    let frame = frame(&view);
    let arm = DVec3::X * frame.size_m;
    let mut drag = Drag::new(Tool::Rotate, Handle::Ring(1), frame, point(&view, arm));
    let mut last = 0.0;
    for step in 1..=45 {
        let turned = DQuat::from_rotation_y(f64::from(step) * 0.1) * arm;
        let motion = drag.motion(&view, point(&view, turned), false).unwrap();
        let Motion::Rotate { angle_rad, .. } = motion else { unreachable!() };
        last = angle_rad;
    }
    assert!((last - 4.5).abs() < 1e-6, "{last}");
}

#[test]
fn an_edge_on_ring_turns_along_its_line() {
    let camera = DAffine3::from_translation(DVec3::new(0.0, 0.0, 10.0));
    let view = ViewProjection::new(camera, Projection::Perspective { yfov_rad: 0.8 }, SIZE);
    let frame = frame(&view);
    // The ring about Y is a horizontal line here; its near side moves to the right for positive angles.
    let mut drag = Drag::new(Tool::Rotate, Handle::Ring(1), frame, SIZE * 0.5);
    let motion = drag.motion(&view, SIZE * 0.5 + DVec2::new(30.0, 0.0), false).unwrap();
    let Motion::Rotate { angle_rad, .. } = motion else { unreachable!() };
    assert!(angle_rad > 0.2 && angle_rad < 0.6, "{angle_rad}");
}

#[test]
fn scaling_doubles_when_the_handle_is_twice_as_far_out() {
    let view = view();
    let frame = frame(&view);
    let mut drag = Drag::new(Tool::Scale, Handle::Axis(2), frame, point(&view, frame.at(2, 0.6)));
    let motion = drag.motion(&view, point(&view, frame.at(2, 1.2)), false).unwrap();
    let Motion::Scale(factors) = motion else { unreachable!() };
    assert!((factors - DVec3::new(1.0, 1.0, 2.0)).length() < 1e-9, "{factors}");
}

fn start_below_a_turned_parent() -> Start {
    let parent = DAffine3::from_scale_rotation_translation(
        DVec3::splat(2.0),
        DQuat::from_rotation_y(1.0),
        DVec3::new(1.0, 2.0, 3.0),
    );
    let trs = Trs {
        translation: DVec3::new(0.5, -1.0, 2.0),
        rotation: DQuat::from_rotation_x(0.4),
        scale: DVec3::new(1.0, 2.0, 3.0),
    };
    Start { local: Local::Trs(trs), world_from_parent: parent, middle: DVec3::ZERO }
}

#[test]
fn a_child_moves_in_world_space_whatever_its_parent() {
    let start = start_below_a_turned_parent();
    let by = DVec3::new(0.3, 0.2, -0.1);
    let moved = start.moved(Motion::Translate(by), DVec3::ZERO).unwrap();
    let before = start.world_from_parent * start.local.to_affine();
    let after = start.world_from_parent * moved.to_affine();
    assert!((after.translation - before.translation - by).length() < 1e-12);
    assert!((after.matrix3.x_axis - before.matrix3.x_axis).length() < 1e-12);
}

#[test]
fn a_child_turns_in_world_space_about_the_pivot() {
    let start = start_below_a_turned_parent();
    let pivot = DVec3::new(4.0, 0.0, 0.0);
    let axis = DVec3::new(1.0, 2.0, -1.0).normalize();
    let moved = start.moved(Motion::Rotate { axis, angle_rad: 0.9 }, pivot).unwrap();
    let before = start.world_from_parent * start.local.to_affine();
    let turn = DAffine3::from_axis_angle(axis, 0.9);
    let wanted = DAffine3::from_translation(pivot) * turn * DAffine3::from_translation(-pivot) * before;
    let after = start.world_from_parent * moved.to_affine();
    assert!(after.abs_diff_eq(wanted, 1e-9), "{after} against {wanted}");
    assert!(matches!(moved, Local::Trs(_)), "no shear arises");
}

#[test]
fn a_child_of_a_mirrored_parent_turns_the_right_way() {
    let mut start = start_below_a_turned_parent();
    start.world_from_parent = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let axis = DVec3::new(1.0, 1.0, 0.0).normalize();
    let moved = start.moved(Motion::Rotate { axis, angle_rad: 0.5 }, DVec3::ZERO).unwrap();
    let before = start.world_from_parent * start.local.to_affine();
    let after = start.world_from_parent * moved.to_affine();
    assert!(after.abs_diff_eq(DAffine3::from_axis_angle(axis, 0.5) * before, 1e-9));
}

#[test]
fn what_is_scaled_keeps_its_middle_where_it_was() {
    let middle = DVec3::new(2.0, 0.5, -1.0);
    let start = Start { middle, ..start_below_a_turned_parent() };
    let scaled = start.moved(Motion::Scale(DVec3::new(2.0, 1.0, 0.5)), DVec3::ZERO).unwrap();
    let place = |local: Local| local.to_affine().transform_point3(middle);
    assert!((place(scaled) - place(start.local)).length() < 1e-12);
    assert_eq!(scaled.nearest_trs().scale, DVec3::new(2.0, 2.0, 1.5));
}

#[test]
fn below_a_flattened_parent_nothing_moves() {
    let mut start = start_below_a_turned_parent();
    start.world_from_parent = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    assert_eq!(start.moved(Motion::Translate(DVec3::X), DVec3::ZERO), None);
}
