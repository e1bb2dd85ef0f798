//! Where the instances stand in the TLAS: a place for every slot, near its neighbours in space, and how far the
//! instances have left the places that the last build gave them. Pure bookkeeping.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::policy::{DISPLACEMENT_LIMIT, SMALLEST_DISPLACEMENT, SORTED_SLOTS};
use crate::tables::order_of;

/// Places of all slots, free ones among them.
#[derive(Debug, Default)]
pub(crate) struct Places {
    of_slot: Vec<u32>,
    /// Slots taken or given up since the places were sorted.
    unsorted: u32,
}

impl Places {
    /// Follows the number of slots; new ones stand at the end. `touched`: slots that are used for something else now.
    pub(crate) fn follow(&mut self, count: u32, touched: u32) {
        if (count as usize) < self.of_slot.len() {
            self.of_slot.clear();
        }
        self.of_slot.extend(self.of_slot.len() as u32..count);
        self.unsorted = self.unsorted.saturating_add(touched);
    }

    /// Whether the order should be made anew at the next build.
    pub(crate) fn wants_sorting(&self) -> bool {
        let count = self.of_slot.len() as u32;
        self.unsorted > 0 && (count <= SORTED_SLOTS || self.unsorted > count / 8)
    }

    /// Sorts along a Morton curve. `centres`: one a slot, not finite for free ones.
    pub(crate) fn sort(&mut self, centres: &[DVec3]) {
        for (place, slot) in order_of(centres).into_iter().enumerate() {
            self.of_slot[slot as usize] = place as u32;
        }
        self.unsorted = 0;
    }

    pub(crate) fn of(&self, slot: u32) -> u32 {
        self.of_slot.get(slot as usize).copied().unwrap_or(slot)
    }

    pub(crate) fn len(&self) -> u32 {
        self.of_slot.len() as u32
    }
}

/// How far instances have moved since the last build, as a share of the scene.
#[derive(Debug, Default)]
pub(crate) struct Displacement {
    /// Where each slot that moved stood at the build, and its share.
    moved: BTreeMap<u32, (Vec3, f64)>,
    sum: f64,
    bounds: Option<(Vec3, Vec3)>,
}

impl Displacement {
    /// The tree was built: everything stands where it should.
    pub(crate) fn reset(&mut self) {
        self.moved.clear();
        self.sum = 0.0;
    }

    /// An instance has gone from `before` to `now`.
    pub(crate) fn note(&mut self, slot: u32, before: Vec3, now: Vec3) {
        if !now.is_finite() || !before.is_finite() {
            return;
        }
        let (low, high) = self.bounds.get_or_insert((before, before));
        (*low, *high) = (low.min(before).min(now), high.max(before).max(now));
        let diagonal = low.as_dvec3().distance(high.as_dvec3());
        let entry = self.moved.entry(slot).or_insert((before, 0.0));
        let distance = entry.0.as_dvec3().distance(now.as_dvec3());
        let share = if diagonal > 0.0 { distance / diagonal } else { 0.0 };
        self.sum += share - entry.1;
        entry.1 = share;
    }

    /// An instance stands there: the scene reaches that far.
    pub(crate) fn reach(&mut self, centre: Vec3) {
        if centre.is_finite() {
            let (low, high) = self.bounds.get_or_insert((centre, centre));
            (*low, *high) = (low.min(centre), high.max(centre));
        }
    }

    /// The scene reaches as far as these centres, whatever has been farther out before. Those of free slots are not finite.
    pub(crate) fn enclose(&mut self, centres: &[DVec3]) {
        self.bounds = None;
        centres.iter().for_each(|centre| self.reach(centre.as_vec3()));
    }

    /// Whether the tree has become loose.
    pub(crate) fn demands_build(&self, count: usize) -> bool {
        self.sum > (DISPLACEMENT_LIMIT * count as f64).max(SMALLEST_DISPLACEMENT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_scenes_are_sorted_at_once_and_large_ones_now_and_then() {
        let mut places = Places::default();
        places.follow(3, 3);
        assert!(places.wants_sorting());
        places.sort(&[DVec3::X * 2.0, DVec3::NAN, DVec3::ZERO]);
        assert_eq!([0, 1, 2].map(|slot| places.of(slot)), [1, 2, 0]);
        assert!(!places.wants_sorting());
        let mut many = Places::default();
        many.follow(10_000, 10_000);
        many.sort(&vec![DVec3::ZERO; 10_000]);
        many.follow(10_001, 1);
        assert!(!many.wants_sorting() && many.of(10_000) == 10_000);
        many.follow(12_000, 1999);
        assert!(many.wants_sorting());
    }

    #[test]
    fn what_was_far_out_once_counts_no_more_once_the_places_are_sorted() {
        let mut displacement = Displacement::default();
        displacement.reach(Vec3::X * 1e6);
        let centres: Vec<DVec3> = (0..100).map(|i| DVec3::X * f64::from(i)).chain([DVec3::NAN]).collect();
        let crowd = |displacement: &mut Displacement| {
            (0..20).for_each(|slot| displacement.note(slot, Vec3::X * 5.0, Vec3::X * 45.0));
        };
        crowd(&mut displacement);
        assert!(!displacement.demands_build(100), "forty metres of a thousand kilometres");
        displacement.reset();
        displacement.enclose(&centres);
        crowd(&mut displacement);
        assert!(displacement.demands_build(100));
    }

    #[test]
    fn a_tree_is_loose_when_much_has_moved_far() {
        let mut displacement = Displacement::default();
        for slot in 0..100 {
            displacement.reach(Vec3::X * slot as f32);
        }
        displacement.note(5, Vec3::X * 5.0, Vec3::X * 60.0);
        assert!(!displacement.demands_build(100), "one of a hundred");
        displacement.note(5, Vec3::X * 60.0, Vec3::X * 5.0);
        for slot in 0..20 {
            displacement.note(slot, Vec3::X * slot as f32, Vec3::X * (slot as f32 + 40.0));
        }
        assert!(displacement.demands_build(100), "twenty of a hundred");
        displacement.reset();
        assert!(!displacement.demands_build(100));
    }
}
