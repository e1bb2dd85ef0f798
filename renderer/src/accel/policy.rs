//! When to build, refit, rebuild, compact: decisions without a device, so that they are tested without one.

use glam::Vec3;

use crate::measure::DeviceProfile;

/// A refitted BLAS whose boxes have grown to more than this multiple of their surface at the last build is rebuilt.
pub(crate) const SURFACE_LIMIT: f64 = 2.0;
/// A BLAS that was edited and then rested for this many frames is built once more, to be traced fast.
pub(crate) const REST_FRAMES: u64 = 120;
/// The TLAS is rebuilt when its instances have moved on average by more than this share of the scene since its last build.
pub(crate) const DISPLACEMENT_LIMIT: f64 = 0.02;
/// Below this sum of displacements a tree is never loose: a handful of instances is traced fast in any order.
pub(crate) const SMALLEST_DISPLACEMENT: f64 = 4.0;
/// Scenes up to this many slots sort their instances anew at every build of the TLAS; larger ones when an eighth is new.
pub(crate) const SORTED_SLOTS: u32 = 4096;

/// Scratch memory that the builds of one batch may share, bytes.
pub(crate) const SCRATCH_BUDGET: u64 = 64 << 20;

/// Time that a frame of a window may spend on first builds, milliseconds.
const FRAME_BUILDS_MS: f64 = 8.0;

/// What the device's profile and the kind of run make of acceleration structures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelPolicy {
    /// A changed BLAS is refitted; false: built anew each time, where that is as cheap.
    pub refit: bool,
    /// The TLAS is refitted when only transforms moved; false: built anew.
    pub refit_tlas: bool,
    /// Static BLASes are compacted.
    pub compact: bool,
    /// Triangles that one frame may build for the first time; what goes past it is built in the background. `None`: all.
    pub frame_triangles: Option<u64>,
    /// Bytes of scratch memory that the builds of one batch in the background may share; a single one may take more.
    pub background_scratch: u64,
    /// The next frame waits for background work, so that a run does not depend on the clock.
    pub wait: bool,
}

impl Default for AccelPolicy {
    fn default() -> Self {
        Self {
            refit: true,
            refit_tlas: true,
            compact: true,
            frame_triangles: None,
            background_scratch: SCRATCH_BUDGET,
            wait: true,
        }
    }
}

impl AccelPolicy {
    /// What suits a device. In a window no frame waits for the background; elsewhere no figure of the clock decides what a
    /// frame holds.
    pub fn of(profile: &DeviceProfile, window: bool) -> Self {
        Self {
            refit: profile.refit_pays(),
            refit_tlas: profile.refits_tlas(),
            compact: profile.compaction_pays(),
            frame_triangles: window.then(|| profile.triangles_in(FRAME_BUILDS_MS)),
            wait: !window,
            ..Self::default()
        }
    }

    /// Whether a first build of `triangles` fits into a frame that has already built `before`.
    pub(crate) fn fits_frame(&self, before: u64, triangles: u64) -> bool {
        self.frame_triangles.is_none_or(|limit| before + triangles <= limit)
    }
}

/// What happens to a BLAS whose vertices or primitives have moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Refit in place.
    Refit,
    /// Build in place, with the same flags and so the same size.
    Rebuild,
    /// A new structure that may be refitted from now on.
    MakeDynamic,
}

/// `dynamic`: the structure was built to be updated.
pub(crate) fn change_of(policy: &AccelPolicy, dynamic: bool) -> Change {
    match (dynamic, policy.refit) {
        (false, _) => Change::MakeDynamic,
        (true, true) => Change::Refit,
        (true, false) => Change::Rebuild,
    }
}

/// How far primitives that moved inside their mesh stretch the boxes of a tree built before: surface of the boxes around
/// their old and new places over that of the old ones. It bounds the growth of nodes that neighbours share with them.
pub(crate) fn stretch(at_build: &[(Vec3, Vec3)], now: &[(Vec3, Vec3)]) -> f64 {
    let united = at_build.iter().zip(now).map(|(a, b)| surface(a.0.min(b.0), a.1.max(b.1)));
    let (grown, old): (f64, f64) = (united.sum(), at_build.iter().map(|b| surface(b.0, b.1)).sum());
    match (old > 0.0, grown > 0.0) {
        (true, _) => grown / old,
        // A tree around points is good for nothing else.
        (false, true) => f64::INFINITY,
        (false, false) => 1.0,
    }
}

/// Surface of a box.
fn surface(low: Vec3, high: Vec3) -> f64 {
    let d = (high - low).max(Vec3::ZERO).as_dvec3();
    2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
}

#[cfg(test)]
mod tests {
    use caustica_gpu::DeviceKind;

    use super::*;

    #[test]
    fn the_profile_decides_what_pays_and_the_window_what_may_come_later() {
        let profile = |kind| DeviceProfile::default_of("device", "driver", kind);
        let (card, processor) = (profile(DeviceKind::Discrete), profile(DeviceKind::Cpu));
        assert_eq!(AccelPolicy::of(&card, false), AccelPolicy::default());
        let plain = AccelPolicy { refit: false, compact: false, ..AccelPolicy::default() };
        assert_eq!(AccelPolicy::of(&processor, false), plain);
        let triangles = Some(processor.triangles_in(8.0));
        let shown = AccelPolicy { frame_triangles: triangles, wait: false, ..plain };
        assert_eq!(AccelPolicy::of(&processor, true), shown);

        let refits_tlas = |tlas_refit_ms| {
            let mut profile = processor.clone();
            (profile.tlas_refit_ms, profile.tlas_build_ms) = (tlas_refit_ms, 1.0);
            AccelPolicy::of(&profile, false).refit_tlas
        };
        assert!(refits_tlas(1.2) && !refits_tlas(1.21));
    }

    #[test]
    fn primitives_that_part_stretch_the_tree() {
        let unit = (Vec3::ZERO, Vec3::ONE);
        let moved = |by: f32| (Vec3::ZERO + Vec3::X * by, Vec3::ONE + Vec3::X * by);
        assert_eq!(stretch(&[unit, unit], &[unit, unit]), 1.0);
        // The united box is 4 x 1 x 1: 18 against 6; the other primitive stays: (18 + 6) / 12.
        assert_eq!(stretch(&[unit, unit], &[unit, moved(3.0)]), 2.0);
        assert!(stretch(&[unit, unit], &[unit, moved(0.1)]) < 1.1);
        assert_eq!(stretch(&[], &[]), 1.0);
        let point = (Vec3::ZERO, Vec3::ZERO);
        assert_eq!((stretch(&[point], &[point]), stretch(&[point], &[unit])), (1.0, f64::INFINITY));
    }

    #[test]
    fn only_what_was_built_for_it_is_refitted() {
        let refits = AccelPolicy::default();
        let rebuilds = AccelPolicy { refit: false, ..refits };
        assert_eq!(change_of(&refits, false), Change::MakeDynamic);
        assert_eq!(change_of(&refits, true), Change::Refit);
        assert_eq!(change_of(&rebuilds, true), Change::Rebuild);
    }

    #[test]
    fn a_frame_builds_up_to_its_budget() {
        let policy = AccelPolicy { frame_triangles: Some(100), ..AccelPolicy::default() };
        assert!(policy.fits_frame(0, 100) && !policy.fits_frame(1, 100));
        assert!(AccelPolicy::default().fits_frame(u64::MAX / 2, 1));
    }
}
