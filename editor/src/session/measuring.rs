//! The error of a session's picture, measured on the device while it is rendered. Enters: a reference, an error to stop at. Leaves: the
//! newest figures.

use std::sync::Arc;

use caustica_renderer::{Accumulated, LiveError};

use super::Session;

impl Session {
    /// Asks for the error of the picture with its next sample.
    pub fn measure(&mut self) {
        if let Ok(view) = self.renderer.view_mut(self.view) {
            view.measure();
        }
    }

    /// The newest error measured of the present picture; `None`: none yet.
    pub fn live_error(&self) -> Option<&LiveError> {
        let statistics = self.statistics();
        statistics.error.as_ref().filter(|error| error.resets == statistics.resets)
    }

    /// What the picture is compared with, where it has the same size.
    pub fn set_reference(&mut self, reference: Option<Arc<Accumulated>>) {
        if let Ok(view) = self.renderer.view_mut(self.view) {
            view.set_reference(reference);
        }
    }

    /// Whether there is something that the picture is compared with.
    pub fn has_reference(&self) -> bool {
        self.renderer.view(self.view).is_ok_and(|view| view.has_reference())
    }

    /// Size of the picture as it is rendered, pixels.
    pub fn picture_extent(&self) -> [u32; 2] {
        self.renderer.view(self.view).map_or([1, 1], |view| view.extent())
    }

    /// Takes no more samples once the noise, or the error where there is a reference, is so small; 0.01 is 1 %.
    pub fn set_stop_at(&mut self, error: Option<f64>) {
        self.stop_at = error;
    }

    /// Whether the picture is as good as was asked for.
    pub(super) fn is_good_enough(&self) -> bool {
        let (Some(target), Some(error)) = (self.stop_at, self.live_error()) else { return false };
        let found = error.against.map(|against| against.split.total);
        found.or_else(|| Some(error.noise?.error().value)).is_some_and(|found| found <= target)
    }
}
