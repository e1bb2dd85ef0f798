//! The render origin: world space less one point, so that single precision is enough on the device. A pure function
//! of the camera's place and of the smallest extent in the scene: it has no memory, and is zero near zero.

use std::collections::BTreeMap;

use caustica_scene::Target;
use glam::DVec3;

/// A cell of the grid of origins is this many times the smallest extent. Single precision carries 2^24 steps: at the
/// edge of a cell the smallest thing is still cut into 2^24 / 2^14 = 1024 steps.
const CELL_PER_EXTENT: f64 = 16_384.0;
/// With nothing in the scene.
const EMPTY_CELL_M: f64 = 1024.0;

/// Extents of everything placed, by powers of two, so that the smallest is known at once.
#[derive(Debug, Default)]
pub struct Extents {
    by_target: BTreeMap<Target, i32>,
    counts: BTreeMap<i32, usize>,
}

impl Extents {
    /// Notes the length of the diagonal of a target's bounds, metres.
    pub fn set(&mut self, target: Target, diagonal_m: f64) {
        self.remove(target);
        if diagonal_m.is_finite() && diagonal_m > 0.0 {
            let exponent = diagonal_m.log2().floor() as i32;
            self.by_target.insert(target, exponent);
            *self.counts.entry(exponent).or_insert(0) += 1;
        }
    }

    /// Forgets a target.
    pub fn remove(&mut self, target: Target) {
        if let Some(exponent) = self.by_target.remove(&target)
            && let Some(count) = self.counts.get_mut(&exponent)
        {
            *count -= 1;
            if *count == 0 {
                self.counts.remove(&exponent);
            }
        }
    }

    /// The origin for a camera at `eye`, world space, metres.
    pub fn render_origin(&self, eye: DVec3) -> DVec3 {
        let smallest = self.counts.keys().next().map(|exponent| 2f64.powi(*exponent));
        let cell = smallest.map_or(EMPTY_CELL_M, |extent| extent * CELL_PER_EXTENT);
        let snapped = (eye / cell).round() * cell;
        if snapped.is_finite() { snapped + DVec3::ZERO } else { DVec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustica_scene::NodeId;

    #[test]
    fn zero_near_zero_and_near_the_camera_far_out() {
        let mut extents = Extents::default();
        extents.set(Target::node(NodeId(1)), 1.0);
        assert_eq!(extents.render_origin(DVec3::new(8000.0, -3.0, 2.0)), DVec3::ZERO);
        let eye = DVec3::new(1e6, 0.0, -5e5);
        assert!((extents.render_origin(eye) - eye).abs().max_element() <= 8192.0);
    }

    #[test]
    fn the_way_there_does_not_matter() {
        let (mut a, mut b) = (Extents::default(), Extents::default());
        a.set(Target::node(NodeId(1)), 1e-3);
        a.set(Target::node(NodeId(2)), 5.0);
        a.remove(Target::node(NodeId(1)));
        b.set(Target::node(NodeId(2)), 5.0);
        let eye = DVec3::splat(1e7);
        assert_eq!(a.render_origin(eye), b.render_origin(eye));
    }

    #[test]
    fn nonsense_does_not_spread() {
        let mut extents = Extents::default();
        extents.set(Target::node(NodeId(1)), f64::NAN);
        assert_eq!(extents.render_origin(DVec3::NAN), DVec3::ZERO);
    }
}
