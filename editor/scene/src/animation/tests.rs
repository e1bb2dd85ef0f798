//! Values at a time against numbers worked out by hand, and rotations against axis and angle.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use super::*;

fn channel(path: ChannelPath, interpolation: Interpolation, times_s: &[f32], values: &[f32]) -> Channel {
    Channel { part: 0, path, interpolation, times_s: times_s.into(), values: values.into() }
}

fn x_at(channel: &Channel, time_s: f64) -> f64 {
    match channel.sample(time_s).unwrap() {
        Sample::Translation(v) | Sample::Scale(v) => v.x,
        other => panic!("{other:?}"),
    }
}

fn rotation_at(channel: &Channel, time_s: f64) -> DQuat {
    match channel.sample(time_s).unwrap() {
        Sample::Rotation(rotation) => rotation,
        other => panic!("{other:?}"),
    }
}

#[test]
fn step_holds_the_key_before() {
    let values = [10.0, 0.0, 0.0, 20.0, 0.0, 0.0, 30.0, 0.0, 0.0];
    let steps = channel(ChannelPath::Translation, Interpolation::Step, &[1.0, 2.0, 4.0], &values);
    let found = [0.0, 1.0, 1.999, 2.0, 3.9, 4.0, 99.0].map(|t| x_at(&steps, t));
    assert_eq!(found, [10.0, 10.0, 10.0, 20.0, 20.0, 30.0, 30.0]);
}

#[test]
fn linear_is_a_straight_line_and_ends_at_the_last_keys() {
    let values = [10.0, 1.0, 0.0, 20.0, 2.0, 0.0];
    let line = channel(ChannelPath::Scale, Interpolation::Linear, &[1.0, 5.0], &values);
    let found = [-3.0, 1.0, 2.0, 3.0, 5.0, 7.0].map(|t| x_at(&line, t));
    assert_eq!(found, [10.0, 10.0, 12.5, 15.0, 20.0, 20.0]);
    assert_eq!(line.sample(2.0), Some(Sample::Scale(DVec3::new(12.5, 1.25, 0.0))));
}

#[test]
fn a_cubic_spline_scales_its_tangents_by_the_time_between_the_keys() {
    // Keys at 1 and 3; values 2 and 5, out-tangent 3, in-tangent -1; the outer tangents must not count.
    let values =
        [99.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0, -1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 99.0, 0.0, 0.0];
    let spline = channel(ChannelPath::Translation, Interpolation::CubicSpline, &[1.0, 3.0], &values);
    assert_eq!(spline.width(), 3);
    // Half-way: 0.5 * 2 + 2 * 0.125 * 3 + 0.5 * 5 - 2 * 0.125 * -1 = 4.5.
    assert_eq!(x_at(&spline, 2.0), 4.5);
    // A quarter: 0.84375 * 2 + 2 * 0.140625 * 3 + 0.15625 * 5 + 2 * -0.046875 * -1 = 3.40625.
    assert_eq!(x_at(&spline, 1.5), 3.406_25);
    assert_eq!([0.0, 1.0, 3.0, 9.0].map(|t| x_at(&spline, t)), [2.0, 2.0, 5.0, 5.0]);
}

#[test]
fn weights_have_the_width_of_the_targets() {
    let line = channel(ChannelPath::Weights, Interpolation::Linear, &[0.0, 1.0], &[0.0, 1.0, 1.0, 0.0]);
    assert_eq!(line.sample(0.25), Some(Sample::Weights(vec![0.25, 0.75])));
    // In-tangents of both targets, then both values, then both out-tangents.
    let values = [9.0, 9.0, 0.0, 4.0, 0.0, 2.0, 0.0, 0.0, 1.0, 4.0, 9.0, 9.0];
    let spline = channel(ChannelPath::Weights, Interpolation::CubicSpline, &[0.0, 1.0], &values);
    // The first has no tangents: 3 t^2 - 2 t^3; the second 4 + 2 (t^3 - 2 t^2 + t).
    assert_eq!(spline.sample(0.5), Some(Sample::Weights(vec![0.5, 4.25])));
    assert_eq!(spline.sample(0.0), Some(Sample::Weights(vec![0.0, 4.0])));
}

#[test]
fn rotations_turn_evenly_about_their_axis() {
    let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
    for (first, last) in [(0.0, 1.0), (0.3, 3.0), (-1.0, 1e-3), (2.0, 2.0)] {
        let keys = [first, last].map(|angle: f64| DQuat::from_axis_angle(axis, angle));
        let narrow = keys.map(|q| q.to_array().map(|v| v as f32));
        let turn =
            channel(ChannelPath::Rotation, Interpolation::Linear, &[0.0, 2.0], narrow.concat().as_slice());
        for step in 0..=8 {
            let t = f64::from(step) / 8.0;
            let expected = DQuat::from_axis_angle(axis, first + (last - first) * t);
            let found = rotation_at(&turn, 2.0 * t);
            assert!((found.length() - 1.0).abs() < 1e-15);
            // The keys are in single precision.
            assert!(found.dot(expected).abs() > 1.0 - 1e-13, "{first} {last} {t}: {found} {expected}");
            assert!((found - expected).length() < 2e-7, "{first} {last} {t}: {found} {expected}");
        }
    }
}

#[test]
fn slerp_agrees_with_the_angles_in_double_precision() {
    let axis = DVec3::new(0.2, 0.9, -0.4).normalize();
    for angle in [1e-12, 1e-8, 1e-4, 0.5, 1.0, 2.0, 3.0, 3.1] {
        for step in 0..=16 {
            let t = f64::from(step) / 16.0;
            let found = slerp(DQuat::IDENTITY, DQuat::from_axis_angle(axis, angle), t);
            let expected = DQuat::from_axis_angle(axis, angle * t);
            assert!((found - expected).length() < 1e-15, "{angle} {t}: {found} {expected}");
        }
    }
}

#[test]
fn rotations_take_the_short_way_round() {
    let quarter = DQuat::from_rotation_y(1.0);
    let keys = [DQuat::IDENTITY, -quarter].map(|q| q.to_array().map(|v| v as f32));
    let turn = channel(ChannelPath::Rotation, Interpolation::Linear, &[0.0, 1.0], keys.concat().as_slice());
    let half = DQuat::from_rotation_y(0.5);
    assert!((rotation_at(&turn, 0.5) - half).length() < 1e-7);
    assert!((rotation_at(&turn, 1.0).dot(quarter).abs() - 1.0).abs() < 1e-13);
}

#[test]
fn cubic_rotations_are_normalised_and_useless_ones_do_not_spread() {
    let mut values = vec![0.0; 24];
    (values[7], values[4 + 12 + 1]) = (2.0, 2.0);
    let turn = channel(ChannelPath::Rotation, Interpolation::CubicSpline, &[0.0, 1.0], &values);
    assert_eq!(rotation_at(&turn, 0.0), DQuat::IDENTITY);
    // Without tangents half of each: (0, 1, 0, 1), made one long.
    let half = DQuat::from_xyzw(0.0, 0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt());
    assert!((rotation_at(&turn, 0.5) - half).length() < 1e-15);
    let nothing = channel(ChannelPath::Rotation, Interpolation::CubicSpline, &[0.0, 1.0], &[0.0; 24]);
    assert_eq!(rotation_at(&nothing, 0.5), DQuat::IDENTITY);
    assert_eq!(channel(ChannelPath::Scale, Interpolation::Linear, &[], &[]).sample(0.0), None);
}

#[test]
fn a_clip_that_has_ended_starts_again() {
    let line = channel(ChannelPath::Scale, Interpolation::Linear, &[0.5, 2.0], &[0.0; 6]);
    let clip = Animation::new("walk", vec![line]);
    assert_eq!(clip.duration_s, 2.0);
    assert_eq!([0.0, 1.0, 2.0, 2.5, 4.0, 5.0].map(|t| clip.local_time(t)), [0.0, 1.0, 2.0, 0.5, 0.0, 1.0]);
    assert_eq!(Animation::new("still", Vec::new()).local_time(3.0), 0.0);
}

#[test]
fn choices_name_clips() {
    let clips = ["a", "b", "c"];
    assert_eq!(ClipChoice::First.of(&clips), ["a"]);
    assert_eq!(ClipChoice::All.of(&clips), clips);
    assert_eq!(ClipChoice::Clip(2).of(&clips), ["c"]);
    for none in [ClipChoice::None, ClipChoice::Clip(3), ClipChoice::Clip(u32::MAX)] {
        assert_eq!(none.of(&clips), [""; 0]);
    }
    assert_eq!(ClipChoice::First.of(&[0; 0]), [0; 0]);
}
