//! Clips of an imported file: key frames of its parts, and their values at a time (glTF 2.0, section 3.11 and
//! appendix C). In: times and values as the file has them. Out: values in double precision. Knows no document.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

mod begin;
mod property;

pub use property::Property;
pub(crate) use property::{Animated, hold};

use crate::ids::MaterialId;

/// Sine of the angle between two rotations below which they are mixed on a straight line.
const NEARLY_EQUAL_SINE: f64 = 1e-9;

/// Which clips of its source an instance plays. A clip that the source does not have is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClipChoice {
    /// The first clip, if there is one.
    #[default]
    First,
    /// It stands still.
    None,
    /// All clips at once, each at its own length; where two move the same thing, the first does.
    All,
    /// One clip, by its place in the source.
    Clip(u32),
}

impl ClipChoice {
    /// The chosen ones of `clips`, in order.
    pub fn of<T>(self, clips: &[T]) -> &[T] {
        let range = match self {
            Self::First => 0..clips.len().min(1),
            Self::None => 0..0,
            Self::All => 0..clips.len(),
            Self::Clip(index) => index as usize..(index as usize).saturating_add(1),
        };
        clips.get(range).unwrap_or(&[])
    }
}

/// One clip: channels that are played together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    /// Name in the file; may be empty.
    pub name: String,
    /// Time of the last key of all channels, seconds.
    pub duration_s: f64,
    /// What moves.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// A clip that lasts to the last key of its channels.
    pub fn new(name: impl Into<String>, channels: Vec<Channel>) -> Self {
        let ends = channels.iter().filter_map(|channel| channel.times_s.last());
        let duration_s = ends.fold(0.0, |longest, &end| f64::max(longest, end.into()));
        Self { name: name.into(), duration_s, channels }
    }

    /// Where in the clip a time of the document is: a clip that has ended starts again.
    pub fn local_time(&self, time_s: f64) -> f64 {
        match time_s > self.duration_s {
            true if self.duration_s > 0.0 => time_s % self.duration_s,
            true => self.duration_s,
            false => time_s,
        }
    }
}

/// What a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ChannelPath {
    /// Translation against the parent, metres.
    Translation,
    /// Rotation against the parent, (x, y, z, w).
    Rotation,
    /// Scale along the own axes.
    Scale,
    /// Weights of the morph targets.
    Weights,
    /// Whether it and all below it are there; 0: hidden.
    Visibility,
    /// A property of the light that the part is.
    Light(Property),
    /// A property of the camera that the part is.
    Camera(Property),
    /// A property of a material, wherever it is used.
    Material(MaterialId, Property),
}

impl ChannelPath {
    /// Whether it moves its part.
    pub fn is_transform(self) -> bool {
        matches!(self, Self::Translation | Self::Rotation | Self::Scale)
    }
}

/// What is between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the key before.
    Step,
    /// A straight line; for rotations the shorter arc at even speed.
    #[default]
    Linear,
    /// A cubic Hermite spline with tangents of its own at each key.
    CubicSpline,
}

/// Key frames of one thing that moves. Channels whose keys are the same list of a file share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Which part of the prefab; of no account where a material changes.
    pub part: u32,
    /// What of it.
    pub path: ChannelPath,
    /// What is between the keys.
    pub interpolation: Interpolation,
    /// Times of the keys, seconds, growing.
    pub times_s: Arc<[f32]>,
    /// [`Self::width`] numbers a key, key after key; with [`Interpolation::CubicSpline`] three times as many:
    /// in-tangent, value, out-tangent.
    pub values: Arc<[f32]>,
}

/// The value of a channel at a time.
#[derive(Clone, Debug, PartialEq)]
pub enum Sample {
    /// Metres.
    Translation(DVec3),
    /// A unit rotation.
    Rotation(DQuat),
    /// Along the own axes.
    Scale(DVec3),
    /// One a morph target.
    Weights(Vec<f32>),
    /// Whether it is there.
    Visibility(bool),
    /// Of a property.
    Numbers(Vec<f32>),
}

/// Where a time lies among the keys.
#[derive(Clone, Copy)]
enum Place {
    /// The value of this key holds.
    At(usize),
    /// After this key: `share` of the `seconds` to the next one are over.
    After { key: usize, share: f64, seconds: f64 },
}

/// The three sets of numbers that a key of a cubic spline has.
#[derive(Clone, Copy)]
enum Of {
    InTangent,
    Value,
    OutTangent,
}

impl Channel {
    /// Numbers in one value: 3, 4, or the number of morph targets.
    pub fn width(&self) -> usize {
        self.values.len() / (self.times_s.len() * self.sets()).max(1)
    }

    /// The value at a time; before the first key that of the first, after the last that of the last. `None`
    /// without keys.
    pub fn sample(&self, time_s: f64) -> Option<Sample> {
        let place = self.place(time_s)?;
        let vector = || DVec3::new(self.mixed(place, 0), self.mixed(place, 1), self.mixed(place, 2));
        Some(match self.path {
            ChannelPath::Translation => Sample::Translation(vector()),
            ChannelPath::Scale => Sample::Scale(vector()),
            ChannelPath::Rotation => Sample::Rotation(self.rotation(place)),
            ChannelPath::Weights => Sample::Weights(self.numbers(place)),
            ChannelPath::Visibility => Sample::Visibility(self.mixed(place, 0) != 0.0),
            ChannelPath::Light(_) | ChannelPath::Camera(_) | ChannelPath::Material(..) => {
                Sample::Numbers(self.numbers(place))
            }
        })
    }

    fn numbers(&self, place: Place) -> Vec<f32> {
        (0..self.width()).map(|i| self.mixed(place, i) as f32).collect()
    }

    /// Sets of numbers that a key has.
    fn sets(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    fn place(&self, time_s: f64) -> Option<Place> {
        self.times_s.first()?;
        let next = self.times_s.partition_point(|&key_s| f64::from(key_s) <= time_s);
        let Some(key) = next.checked_sub(1) else {
            return Some(Place::At(0));
        };
        let (Some(&start_s), Some(&end_s)) = (self.times_s.get(key), self.times_s.get(next)) else {
            return Some(Place::At(key));
        };
        if self.interpolation == Interpolation::Step {
            return Some(Place::At(key));
        }
        let seconds = f64::from(end_s) - f64::from(start_s);
        Some(Place::After { key, share: (time_s - f64::from(start_s)) / seconds, seconds })
    }

    /// The `i`-th number of a key.
    fn number(&self, key: usize, of: Of, i: usize) -> f64 {
        let set = match (of, self.interpolation) {
            (Of::Value, Interpolation::CubicSpline) => 1,
            (Of::OutTangent, _) => 2,
            _ => 0,
        };
        let index = (key * self.sets() + set) * self.width() + i;
        self.values.get(index).copied().unwrap_or_default().into()
    }

    /// The `i`-th number at a place: glTF 2.0, appendix C.2, C.3 and C.5.
    fn mixed(&self, place: Place, i: usize) -> f64 {
        let (key, t, seconds) = match place {
            Place::At(key) => return self.number(key, Of::Value, i),
            Place::After { key, share, seconds } => (key, share, seconds),
        };
        let (from, to) = (self.number(key, Of::Value, i), self.number(key + 1, Of::Value, i));
        if self.interpolation != Interpolation::CubicSpline {
            return (1.0 - t) * from + t * to;
        }
        let (leaving, arriving) =
            (self.number(key, Of::OutTangent, i), self.number(key + 1, Of::InTangent, i));
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * from
            + seconds * (t3 - 2.0 * t2 + t) * leaving
            + (3.0 * t2 - 2.0 * t3) * to
            + seconds * (t3 - t2) * arriving
    }

    fn rotation(&self, place: Place) -> DQuat {
        let of = |place| DQuat::from_array([0, 1, 2, 3].map(|i| self.mixed(place, i)));
        let key_rotation = |key| unit(of(Place::At(key))).unwrap_or(DQuat::IDENTITY);
        match place {
            Place::At(key) => key_rotation(key),
            Place::After { key, share, .. } if self.interpolation == Interpolation::Linear => {
                slerp(key_rotation(key), key_rotation(key + 1), share)
            }
            Place::After { key, .. } => unit(of(place)).unwrap_or_else(|| key_rotation(key)),
        }
    }
}

/// `None` for a rotation without direction.
fn unit(rotation: DQuat) -> Option<DQuat> {
    let length = rotation.length();
    (length.is_finite() && length > 0.0).then(|| rotation / length)
}

/// From one unit rotation to another on the shorter arc at even speed: glTF 2.0, appendix C.4. The angle comes
/// from the lengths of sum and difference (Kahan), because the arc cosine loses half of the digits near 1.
fn slerp(from: DQuat, to: DQuat, share: f64) -> DQuat {
    let to = if from.dot(to) < 0.0 { -to } else { to };
    let angle = 2.0 * (to - from).length().atan2((to + from).length());
    let sine = angle.sin();
    let mixed = if sine < NEARLY_EQUAL_SINE {
        from * (1.0 - share) + to * share
    } else {
        from * (((1.0 - share) * angle).sin() / sine) + to * ((share * angle).sin() / sine)
    };
    unit(mixed).unwrap_or(from)
}

#[cfg(test)]
mod tests;
