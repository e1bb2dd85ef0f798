//! Channels whose keys begin before a clip does. In: a channel. Out: the same from 0 on, as glTF wants it.

use super::{Channel, Interpolation, Of, Place};
use crate::animation::ChannelPath;

impl Channel {
    /// Leaves out the keys before 0; what is there at 0 becomes a key of its own. From 0 on nothing changes.
    pub(crate) fn begin_at_zero(&mut self) {
        let before = self.times_s.partition_point(|&time_s| time_s < 0.0);
        if before == 0 {
            return;
        }
        let key = match self.times_s.get(before) {
            // There is one already.
            Some(&0.0) => None,
            _ => self.key_at_zero(),
        };
        let per_key = self.width() * self.sets();
        let times_s = self.times_s.get(before..).unwrap_or(&[]);
        let values = self.values.get(before * per_key..).unwrap_or(&[]);
        let added = key.is_some().then_some(0.0);
        let values = key.into_iter().flatten().chain(values.iter().copied()).collect();
        self.times_s = added.into_iter().chain(times_s.iter().copied()).collect();
        self.values = values;
    }

    /// The numbers of a key at 0: a cubic over a part of its span is the cubic of the slope at the cut.
    fn key_at_zero(&self) -> Option<Vec<f32>> {
        let place = self.place(0.0)?;
        let width = self.width();
        let single = |number: f64| number.clamp(f32::MIN.into(), f32::MAX.into()) as f32;
        let value = |i| single(self.mixed(place, i));
        if self.path == ChannelPath::Rotation && self.interpolation == Interpolation::Linear {
            return Some(self.rotation(place).to_array().map(|number| number as f32).to_vec());
        }
        if self.interpolation != Interpolation::CubicSpline {
            return Some((0..width).map(value).collect());
        }
        let slopes: Vec<f32> = (0..width).map(|i| single(self.slope(place, i))).collect();
        Some(slopes.iter().copied().chain((0..width).map(value)).chain(slopes.iter().copied()).collect())
    }

    /// How fast the `i`-th number of a cubic spline grows at a place, a second.
    fn slope(&self, place: Place, i: usize) -> f64 {
        let Place::After { key, share: t, seconds } = place else { return 0.0 };
        let (from, to) = (self.number(key, Of::Value, i), self.number(key + 1, Of::Value, i));
        let (leaving, arriving) =
            (self.number(key, Of::OutTangent, i), self.number(key + 1, Of::InTangent, i));
        let t2 = t * t;
        (6.0 * t2 - 6.0 * t) * (from - to) / seconds
            + (3.0 * t2 - 4.0 * t + 1.0) * leaving
            + (3.0 * t2 - 2.0 * t) * arriving
    }
}
