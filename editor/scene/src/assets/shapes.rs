//! Spheres and boxes without triangles, as the document says them: by numbers, as a cloud, or by a file.
//! In: a description. Out: the shapes, always the same ones: they are made on load and never stored. No device.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::deform::{Bounds, join};

/// Most shapes that one description may make: they take about 130 bytes each on the host and on the device.
pub const MOST_SHAPES: u32 = 1 << 24;

/// Most shapes that a document may have.
pub(crate) const MOST_SHAPES_IN_ALL: usize = 1 << 25;

/// Why it may not have so many, in words.
pub(crate) fn too_many_in_all(count: usize) -> String {
    format!(
        "with those of the others it would have {count} spheres and boxes; a scene can have {MOST_SHAPES_IN_ALL}"
    )
}

/// What a [`Shape`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// A sphere; a transform with unequal scales makes an ellipsoid of it.
    Sphere,
    /// A box with faces along the axes.
    Box,
}

/// A sphere or a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Which of them.
    pub kind: ShapeKind,
    /// Its centre, primitive space, metres.
    pub centre: Vec3,
    /// Half of its size, metres, not negative; of a sphere all three are the radius.
    pub half_extent: Vec3,
}

impl Shape {
    /// A sphere.
    pub fn sphere(centre: Vec3, radius_m: f32) -> Self {
        Self { kind: ShapeKind::Sphere, centre, half_extent: Vec3::splat(radius_m) }
    }

    /// A box.
    pub fn cuboid(centre: Vec3, half_extent: Vec3) -> Self {
        Self { kind: ShapeKind::Box, centre, half_extent }
    }

    /// Smallest and largest corner.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (centre, half) = (self.centre.as_dvec3(), self.half_extent.as_dvec3());
        (centre - half, centre + half)
    }
}

/// Where shapes come from. Lengths in metres, primitive space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum ShapeSource {
    /// One sphere.
    Sphere {
        /// Its centre.
        #[serde(default)]
        centre: Vec3,
        /// Its radius.
        radius_m: f32,
    },
    /// One box with faces along the axes.
    Box {
        /// Its centre.
        #[serde(default)]
        centre: Vec3,
        /// Half of its size.
        half_extent_m: Vec3,
    },
    /// Many, drawn from a seed. Those of even number are the first primitive, the others the second.
    Cloud(Cloud),
    /// Many, read from a file; primitives as those of a cloud.
    File(ShapeFile),
}

/// How the centres of a cloud lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Distribution {
    /// Alike everywhere in the box.
    #[default]
    Box,
    /// Alike everywhere in the largest ellipsoid that the box holds.
    Ball,
    /// In the middle of the cells of a grid over the box, or as far from it as the jitter says.
    Grid {
        /// Share of a cell over which a centre is spread, 0 to 1.
        jitter: f32,
    },
}

/// A cloud of spheres and cubes. Shape number `i` depends on the seed and on `i` alone, in a grid on the count too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Cloud {
    /// Another seed, another cloud.
    pub seed: u64,
    /// How many.
    pub count: u32,
    /// Where the centres lie.
    pub distribution: Distribution,
    /// Half of the box around all centres.
    pub half_extent_m: Vec3,
    /// Smallest and largest radius; of a cube, half of its side.
    pub radius_m: [f32; 2],
    /// Share of cubes, 0 to 1; the rest are spheres.
    pub boxes: f32,
}

impl Default for Cloud {
    fn default() -> Self {
        Self {
            seed: 1,
            count: 10_000,
            distribution: Distribution::Box,
            half_extent_m: Vec3::ONE,
            radius_m: [0.005, 0.02],
            boxes: 0.5,
        }
    }
}

/// Shapes of a text file: see [`crate::import::load_shapes`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeFile {
    /// Where it was read.
    pub path: PathBuf,
    /// What was read, in the order of the file; `None`: the file is missing, and nothing is shown.
    #[serde(skip)]
    pub shapes: Option<Arc<[Shape]>>,
}

/// Why a description makes no shapes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ShapeFault(String);

/// A description with the shapes that it makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Shapes {
    source: ShapeSource,
    list: Arc<[Shape]>,
}

impl Shapes {
    /// Makes the shapes.
    ///
    /// # Errors
    /// In words, when the description holds a number that is none, negative or too large.
    pub fn new(source: ShapeSource) -> Result<Self, ShapeFault> {
        if let Some(fault) = source.fault() {
            return Err(ShapeFault(fault));
        }
        let list = source.make();
        Ok(Self { source, list })
    }

    /// Where they come from.
    pub fn source(&self) -> &ShapeSource {
        &self.source
    }

    /// The shapes, those of the first primitive first.
    pub fn list(&self) -> &Arc<[Shape]> {
        &self.list
    }

    /// First shape and number of shapes of each primitive.
    pub fn ranges(&self) -> Vec<(u32, u32)> {
        let count = self.list.len() as u32;
        match self.source.primitive_count() {
            1 => vec![(0, count)],
            _ => vec![(0, count.div_ceil(2)), (count.div_ceil(2), count / 2)],
        }
    }

    /// Smallest and largest corner of a range of shapes after an affine map.
    pub(super) fn bounds(&self, (first, count): (u32, u32)) -> Option<Bounds> {
        let end = first.saturating_add(count) as usize;
        self.list.get(first as usize..end)?.iter().map(Shape::bounds).reduce(join)
    }
}

impl ShapeSource {
    /// How many primitives, each with a material of its own: 1, or 2 that take turns.
    pub fn primitive_count(&self) -> usize {
        match self {
            Self::Sphere { .. } | Self::Box { .. } => 1,
            Self::Cloud(_) | Self::File(_) => 2,
        }
    }

    /// What is wrong with it, in words.
    fn fault(&self) -> Option<String> {
        let size = |size: Vec3| size.is_finite() && size.min_element() >= 0.0;
        let fault = match self {
            Self::Sphere { centre, radius_m } => match (centre.is_finite(), size(Vec3::splat(*radius_m))) {
                (false, _) => "the centre is no finite number",
                (_, false) => "the radius is negative or no finite number",
                _ => return None,
            },
            Self::Box { centre, half_extent_m } => match (centre.is_finite(), size(*half_extent_m)) {
                (false, _) => "the centre is no finite number",
                (_, false) => "the size is negative or no finite number",
                _ => return None,
            },
            Self::Cloud(cloud) => return cloud.fault(),
            Self::File(file) => {
                let count = file.shapes.as_ref().map_or(0, |shapes| shapes.len());
                return (count > MOST_SHAPES as usize).then(|| too_many(count as u64));
            }
        };
        Some(fault.to_owned())
    }

    fn make(&self) -> Arc<[Shape]> {
        match self {
            Self::Sphere { centre, radius_m } => Arc::new([Shape::sphere(*centre, *radius_m)]),
            Self::Box { centre, half_extent_m } => Arc::new([Shape::cuboid(*centre, *half_extent_m)]),
            Self::Cloud(cloud) => {
                let side = grid_side(cloud.count);
                taking_turns(cloud.count as usize, |i| cloud.shape(i as u32, side))
            }
            Self::File(ShapeFile { shapes, .. }) => {
                let shapes = shapes.as_deref().unwrap_or_default();
                let none = Shape::sphere(Vec3::ZERO, 0.0);
                taking_turns(shapes.len(), |i| shapes.get(i).copied().unwrap_or(none))
            }
        }
    }
}

fn too_many(count: u64) -> String {
    format!("{count} shapes are more than {MOST_SHAPES}")
}

/// Those of even number, then the others.
fn taking_turns(count: usize, shape: impl Fn(usize) -> Shape) -> Arc<[Shape]> {
    let even = count.div_ceil(2);
    // An exact length, so that they are collected where they stay.
    (0..count).map(|i| shape(if i < even { 2 * i } else { 2 * (i - even) + 1 })).collect()
}

impl Cloud {
    fn fault(&self) -> Option<String> {
        let [least, most] = self.radius_m;
        let share = |share: f32| (0.0..=1.0).contains(&share);
        let fault = if self.count > MOST_SHAPES {
            return Some(too_many(self.count.into()));
        } else if !(self.half_extent_m.is_finite() && self.half_extent_m.min_element() >= 0.0) {
            "the size is negative or no finite number"
        } else if !(least >= 0.0 && least <= most && most.is_finite()) {
            "the radii are negative, in the wrong order or no finite numbers"
        } else if !share(self.boxes) {
            "the share of boxes is not between 0 and 1"
        } else if matches!(self.distribution, Distribution::Grid { jitter } if !share(jitter)) {
            "the jitter is not between 0 and 1"
        } else {
            return None;
        };
        Some(fault.to_owned())
    }

    /// Only exact arithmetic and roundings that IEEE 754 fixes: the same on every machine.
    fn shape(&self, index: u32, grid_side: u32) -> Shape {
        let mut draws = Draws::new(self.seed, index);
        let [least, most] = self.radius_m;
        let is_box = draws.share() < self.boxes;
        let radius_m = least + (most - least) * draws.share();
        let place = match self.distribution {
            Distribution::Box => draws.place(),
            Distribution::Ball => draws.in_ball(),
            Distribution::Grid { jitter } => grid_place(index, grid_side, draws.place() * jitter),
        };
        let centre = place * self.half_extent_m;
        if is_box { Shape::cuboid(centre, Vec3::splat(radius_m)) } else { Shape::sphere(centre, radius_m) }
    }
}

/// Side of the smallest cube of cells that holds `count`.
fn grid_side(count: u32) -> u32 {
    (1..).find(|side| u64::from(*side).pow(3) >= u64::from(count)).unwrap_or(1)
}

/// Cell `index` of a cube of `side` cells a side, filled from below, with a place in the cell; -1 to 1.
fn grid_place(index: u32, side: u32, in_cell: Vec3) -> Vec3 {
    let cell = [index % side, index / (side * side), index / side % side].map(|cell| cell as f32);
    (2.0 * Vec3::from_array(cell) + 1.0 + in_cell) / side as f32 - 1.0
}

/// Random numbers of one shape: SplitMix64 (Steele, Lea and Flood, OOPSLA 2014), begun at a hash of seed and number.
struct Draws(u64);

impl Draws {
    fn new(seed: u64, index: u32) -> Self {
        let mut of_seed = Self(seed);
        Self(of_seed.next() ^ u64::from(index).wrapping_mul(0xd1b5_4a32_d192_ed03))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to below 1, in steps of 2^-24.
    fn share(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// In the cube from -1 to 1.
    fn place(&mut self) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| 2.0 * self.share() - 1.0))
    }

    /// In the ball of radius 1, by rejection.
    fn in_ball(&mut self) -> Vec3 {
        // One of two is inside: after 64 the middle is as good as any.
        (0..64).map(|_| self.place()).find(|p| p.length_squared() <= 1.0).unwrap_or_default()
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn shapes(cloud: Cloud) -> Shapes {
        Shapes::new(ShapeSource::Cloud(cloud)).unwrap()
    }

    #[test]
    fn a_cloud_is_the_same_every_time_and_another_with_another_seed() {
        let one = shapes(Cloud::default());
        assert_eq!(one, shapes(Cloud::default()));
        assert_ne!(one.list(), shapes(Cloud { seed: 2, ..Cloud::default() }).list());
        // Written down once: a file must show the same cloud on every machine and in every later version.
        let digest = one.list().iter().fold(0_u64, |digest, shape| {
            let numbers = [shape.centre.x, shape.centre.y, shape.centre.z, shape.half_extent.x];
            let bits =
                numbers.iter().fold(shape.kind as u64, |all, x| all.rotate_left(13) ^ u64::from(x.to_bits()));
            (digest ^ bits).wrapping_mul(0x100_0000_01b3)
        });
        assert_eq!(digest, 0x8d81_ae55_8299_1e55, "{digest:#x}");
    }

    #[test]
    fn a_cloud_is_as_it_is_described() {
        let count = 27_000;
        for distribution in [Distribution::Box, Distribution::Ball, Distribution::Grid { jitter: 0.5 }] {
            let half_extent_m = Vec3::new(1.0, 2.0, 4.0);
            let cloud = Cloud { count, distribution, half_extent_m, boxes: 0.25, ..Cloud::default() };
            let made = shapes(cloud);
            assert_eq!(made.ranges(), [(0, 13_500), (13_500, 13_500)]);
            let boxes = made.list().iter().filter(|shape| shape.kind == ShapeKind::Box).count();
            assert!((6350..7150).contains(&boxes), "{boxes} boxes");
            let unit: Vec<Vec3> = made.list().iter().map(|shape| shape.centre / half_extent_m).collect();
            assert!(unit.iter().all(|p| p.abs().max_element() <= 1.0));
            let mean = unit.iter().sum::<Vec3>() / count as f32;
            assert!(mean.abs().max_element() < 0.02, "{distribution:?}: {mean}");
            let inside = unit.iter().filter(|p| p.length() <= 1.0).count() as f32 / count as f32;
            let expected = if distribution == Distribution::Ball { 1.0 } else { std::f32::consts::PI / 6.0 };
            assert!((inside - expected).abs() < 0.02, "{distribution:?}: {inside}");
            let radii: Vec<f32> = made.list().iter().map(|shape| shape.half_extent.x).collect();
            assert!(radii.iter().all(|r| (0.005..=0.02).contains(r)));
        }
    }

    #[test]
    fn a_grid_without_jitter_has_one_shape_a_cell() {
        let distribution = Distribution::Grid { jitter: 0.0 };
        let made = shapes(Cloud { count: 27, distribution, ..Cloud::default() });
        let mut cells: Vec<[i32; 3]> =
            made.list().iter().map(|s| (s.centre * 1.5).round().to_array().map(|x| x as i32)).collect();
        cells.sort_unstable();
        cells.dedup();
        assert_eq!(cells.len(), 27);
        assert!(cells.iter().flatten().all(|x| (-1..=1).contains(x)));
    }

    #[test]
    fn numbers_that_are_none_are_refused_in_words() {
        let refused = |source: ShapeSource, words: &str| {
            let fault = Shapes::new(source).unwrap_err().to_string();
            assert!(fault.contains(words), "'{fault}' does not say '{words}'");
        };
        let cloud = Cloud::default;
        refused(ShapeSource::Sphere { centre: Vec3::ZERO, radius_m: -1.0 }, "radius");
        refused(ShapeSource::Sphere { centre: Vec3::NAN, radius_m: 1.0 }, "centre");
        refused(ShapeSource::Box { centre: Vec3::ZERO, half_extent_m: Vec3::NAN }, "size");
        refused(ShapeSource::Cloud(Cloud { count: MOST_SHAPES + 1, ..cloud() }), "more than");
        refused(ShapeSource::Cloud(Cloud { radius_m: [2.0, 1.0], ..cloud() }), "order");
        refused(ShapeSource::Cloud(Cloud { half_extent_m: -Vec3::ONE, ..cloud() }), "size");
        refused(ShapeSource::Cloud(Cloud { boxes: f32::NAN, ..cloud() }), "share");
        let grid = Cloud { distribution: Distribution::Grid { jitter: 1.5 }, ..cloud() };
        refused(ShapeSource::Cloud(grid), "jitter");
    }

    #[test]
    fn bounds_hold_the_whole_shape() {
        let (low, high) = Shape::sphere(Vec3::X, 0.5).bounds();
        assert_eq!((low, high), (DVec3::new(0.5, -0.5, -0.5), DVec3::new(1.5, 0.5, 0.5)));
    }

    #[test]
    fn clouds_of_none_and_one_have_two_primitives() {
        for count in [0, 1] {
            let made = shapes(Cloud { count, ..Cloud::default() });
            assert_eq!(made.ranges(), [(0, count), (count, 0)]);
        }
    }
}
