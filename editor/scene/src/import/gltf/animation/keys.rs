//! Keys that the format does not allow and that still say what is meant: a spline of one key, rotations of another length
//! than 1. In: a channel whose numbers are as many as they have to be. Out: one that may be written, and what was changed.

use crate::animation::{Channel, ChannelPath, Interpolation};
use crate::import::counted;

/// A length this close to 1 is rounding.
const LENGTH_TOLERANCE: f32 = 1e-3;

/// Puts a channel right; says what was wrong, in words.
pub(super) fn repair(channel: &mut Channel) -> Vec<String> {
    let mut said = Vec::new();
    if channel.interpolation == Interpolation::CubicSpline && channel.times_s.len() == 1 {
        let width = channel.values.len() / 3;
        channel.values = channel.values.iter().copied().skip(width).take(width).collect();
        channel.interpolation = Interpolation::Step;
        said.push("a spline has at least two keys; the one is taken as a step".to_owned());
    }
    if channel.path == ChannelPath::Rotation {
        let odd = make_unit(channel);
        if odd > 0 {
            let keys =
                counted(odd, "rotation is not of length 1 and was", "rotations are not of length 1 and were");
            said.push(format!("{keys} made so"));
        }
    }
    said
}

/// Makes rotations those of length 1, tangents with them; gives how many were not.
fn make_unit(channel: &mut Channel) -> usize {
    let (set, value) = if channel.interpolation == Interpolation::CubicSpline { (12, 4) } else { (4, 0) };
    let length_of = |key: &[f32]| {
        let squares = key.iter().skip(value).take(4).map(|v| f64::from(*v) * f64::from(*v));
        squares.sum::<f64>().sqrt() as f32
    };
    let is_odd = |key: &&[f32]| (length_of(key) - 1.0).abs() > LENGTH_TOLERANCE;
    let odd = channel.values.chunks_exact(set).filter(is_odd).count();
    if odd > 0 {
        let keys = channel.values.chunks_exact(set);
        channel.values = keys
            .flat_map(|key| {
                let length = if is_odd(&key) { length_of(key) } else { 1.0 };
                key.iter().map(move |v| v / length)
            })
            .collect();
    }
    odd
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(path: ChannelPath, interpolation: Interpolation, keys: usize, values: &[f32]) -> Channel {
        let times_s = (0..keys).map(|i| i as f32).collect();
        Channel { part: 0, path, interpolation, times_s, values: values.into() }
    }

    #[test]
    fn a_spline_of_one_key_is_a_step() {
        let numbers = [9.0, 9.0, 9.0, 1.0, 2.0, 3.0, 8.0, 8.0, 8.0];
        let mut one = channel(ChannelPath::Translation, Interpolation::CubicSpline, 1, &numbers);
        assert_eq!(repair(&mut one).len(), 1);
        assert_eq!((one.interpolation, &one.values[..]), (Interpolation::Step, &[1.0, 2.0, 3.0][..]));
    }

    #[test]
    fn rotations_are_of_length_one() {
        let keys = [0.0, 0.0, 127.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let mut turned = channel(ChannelPath::Rotation, Interpolation::Linear, 2, &keys);
        assert_eq!(repair(&mut turned), ["1 rotation is not of length 1 and was made so"]);
        assert_eq!(turned.values[..], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(repair(&mut turned).is_empty());
    }
}
