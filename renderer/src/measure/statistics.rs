//! The figures of the last frame. Enters: counts from the tables, times from the device. Leaves: one struct that the
//! editor shows and `--json` prints.

use serde::Serialize;

/// What was done to the TLAS in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TlasWork {
    /// Nothing.
    #[default]
    Kept,
    /// Refitted in place.
    Refit,
    /// Built anew.
    Built,
}

/// Acceleration structures.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AccelStatistics {
    /// BLASes alive.
    pub blas_count: u64,
    /// BLASes built in this frame.
    pub blas_built: u64,
    /// BLASes refitted in this frame.
    pub blas_refit: u64,
    /// BLASes that were built or compacted in the background and came into use in this frame.
    pub blas_swapped: u64,
    /// Those of them that were compacted.
    pub blas_compacted: u64,
    /// BLASes that are still to be built for the first time: what they hold is not in the picture yet.
    pub blas_pending: u64,
    /// BLASes that the background builds or copies now.
    pub blas_background: u64,
    /// Work on the TLAS in this frame.
    pub tlas: TlasWork,
    /// BLASes built since the start.
    pub total_blas_built: u64,
    /// BLASes refitted since the start.
    pub total_blas_refit: u64,
    /// BLASes swapped since the start.
    pub total_blas_swapped: u64,
    /// BLASes compacted since the start.
    pub total_blas_compacted: u64,
    /// TLAS builds since the start.
    pub total_tlas_built: u64,
    /// TLAS refits since the start.
    pub total_tlas_refit: u64,
    /// Instances in the scene.
    pub instance_count: u64,
    /// Triangles in all meshes, each counted once.
    pub triangle_count: u64,
    /// Bytes of all BLASes.
    pub blas_bytes: u64,
}

impl AccelStatistics {
    /// Adds the work of the frame before to the totals and starts a new frame.
    pub(crate) fn forget_frame(&mut self) {
        self.blas_built = 0;
        self.blas_refit = 0;
        self.tlas = TlasWork::Kept;
    }

    /// Adds the work of this frame to the totals.
    pub(crate) fn add_up(&mut self) {
        self.total_blas_built += self.blas_built;
        self.total_blas_refit += self.blas_refit;
        self.total_blas_swapped += self.blas_swapped;
        self.total_blas_compacted += self.blas_compacted;
        match self.tlas {
            TlasWork::Kept => {}
            TlasWork::Refit => self.total_tlas_refit += 1,
            TlasWork::Built => self.total_tlas_built += 1,
        }
    }
}

/// Something that this scene does not need and so was not built or not run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What, such as "shadow rays".
    pub what: String,
    /// Why, such as "the scene has no light".
    pub why: String,
}

/// The figures of one view's last frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// Milliseconds a pass on the device, of the newest frame that has finished.
    pub passes: Vec<(String, f64)>,
    /// Samples accumulated in every pixel.
    pub samples: u64,
    /// Why the last reset happened.
    pub reset_reason: String,
    /// Resets since the view was made.
    pub resets: u64,
    /// Acceleration structures.
    pub acceleration: AccelStatistics,
    /// Bytes by kind of memory.
    pub memory: Vec<(String, u64)>,
    /// What was left out and why.
    pub left_out: Vec<LeftOut>,
    /// Samples dropped since the last reset because a channel was not finite.
    pub non_finite: u64,
    /// Shadow rays of the last frame to punctual lights from the first surfaces, estimated from one pixel in 64; counted with
    /// [`ShadowRate::Penumbra`](crate::ShadowRate::Penumbra) alone.
    pub shadow_rays: u64,
    /// Bytes uploaded in the last frame, constants included.
    pub uploaded_bytes: u64,
    /// The newest error that was measured, where that was asked for.
    pub error: Option<super::LiveError>,
}
