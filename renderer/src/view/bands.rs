//! A still sample is cut into bands of rows, one a submit, so that a slow device answers the window in between.
//! Enters: a budget and measured times. Leaves: the rows of the next submit. Random numbers depend on pixel and sample
//! alone, so that the image does not depend on how it was cut.

use std::ops::Range;

use caustica_gpu::FrameResult;

/// Bands of the first sample, before anything was measured.
const FIRST_BANDS: u32 = 16;
/// Most bands of a sample.
const MOST_BANDS: u32 = 128;
/// Passes that are cut; the others run once a sample.
const CUT_PASSES: [&str; 3] = ["shadow.trace", "shading.trace", "path_trace"];

/// Rows of one submit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Band {
    pub(crate) rows: Range<u32>,
    /// The G-buffer is made now.
    pub(crate) first: bool,
    /// The sample is complete with it.
    pub(crate) last: bool,
}

/// How the samples of a view are cut.
#[derive(Debug, Default)]
pub(crate) struct Bands {
    budget_ms: Option<f64>,
    next_row: u32,
    rows_per_band: Option<u32>,
    height: u32,
    sample: u64,
    /// Times of the sample that is being collected, by its number.
    collected: (u64, Vec<(String, f64)>),
}

impl Bands {
    /// Device time that one submit may take; `None`: samples are not cut.
    pub(crate) fn set_budget(&mut self, budget_ms: Option<f64>) {
        self.budget_ms = budget_ms;
    }

    /// Starts the sample again.
    pub(crate) fn abandon(&mut self) {
        self.next_row = 0;
    }

    /// The next rows of an image of `height` rows. `whole`: all of them at once.
    pub(crate) fn next(&mut self, height: u32, whole: bool) -> Band {
        if height != self.height {
            // The cost of a row hardly changes: the rows of a band are kept in proportion.
            let scaled =
                |rows: u32| (u64::from(rows) * u64::from(height) / u64::from(self.height.max(1))) as u32;
            self.rows_per_band = self.rows_per_band.map(|rows| scaled(rows).max(1));
            (self.height, self.next_row) = (height, 0);
        }
        let rows = match self.budget_ms {
            Some(_) if !whole => self.rows_per_band.unwrap_or_else(|| height.div_ceil(FIRST_BANDS)),
            _ => height,
        };
        let start = if whole { 0 } else { self.next_row };
        let end = (start + rows.max(1)).min(height);
        let (first, last) = (start == 0, end == height);
        self.sample += u64::from(first);
        self.next_row = if last { 0 } else { end };
        Band { rows: start..end, first, last }
    }

    /// Number that marks the submit of a band.
    pub(crate) fn tag(&self, band: &Band) -> u64 {
        self.sample << 1 | u64::from(band.last)
    }

    /// Takes the times of a finished submit; gives those of the whole sample when it was the last.
    pub(crate) fn note(&mut self, finished: &FrameResult) -> Option<Vec<(String, f64)>> {
        let sample = finished.tag >> 1;
        if sample == 0 {
            return None;
        }
        if sample != self.collected.0 {
            self.collected = (sample, Vec::new());
        }
        for pass in &finished.passes {
            match self.collected.1.iter_mut().find(|(label, _)| *label == pass.label) {
                Some((_, ms)) => *ms += pass.ms,
                None => self.collected.1.push((pass.label.clone(), pass.ms)),
            }
        }
        if finished.tag & 1 == 0 {
            return None;
        }
        let times = std::mem::take(&mut self.collected).1;
        self.plan(&times);
        Some(times)
    }

    fn plan(&mut self, times: &[(String, f64)]) {
        let Some(budget_ms) = self.budget_ms else { return };
        let cut_ms: f64 =
            times.iter().filter(|(label, _)| CUT_PASSES.contains(&label.as_str())).map(|(_, ms)| ms).sum();
        let bands = (cut_ms / budget_ms.max(1.0)).ceil().clamp(1.0, f64::from(MOST_BANDS));
        self.rows_per_band = Some((f64::from(self.height) / bands).ceil() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustica_gpu::PassTime;

    fn finished(bands: &Bands, band: &Band, ms: f64) -> FrameResult {
        let passes = vec![PassTime { label: String::from("shadow.trace"), ms }];
        FrameResult { passes, tag: bands.tag(band) }
    }

    #[test]
    fn bands_cover_every_row_once() {
        let mut bands = Bands::default();
        bands.set_budget(Some(30.0));
        let mut covered = Vec::new();
        loop {
            let band = bands.next(100, false);
            assert_eq!(band.first, covered.is_empty());
            covered.extend(band.rows.clone());
            if band.last {
                break;
            }
        }
        assert_eq!(covered, (0..100).collect::<Vec<_>>());
    }

    #[test]
    fn times_of_a_sample_are_added_up_and_fast_devices_are_not_cut() {
        let mut bands = Bands::default();
        bands.set_budget(Some(30.0));
        let mut total = None;
        while total.is_none() {
            let band = bands.next(160, false);
            let result = finished(&bands, &band, 1.0);
            total = bands.note(&result);
        }
        assert_eq!(total, Some(vec![(String::from("shadow.trace"), 16.0)]));
        let band = bands.next(160, false);
        assert_eq!(band, Band { rows: 0..160, first: true, last: true });
        let result = finished(&bands, &band, 300.0);
        bands.note(&result);
        assert_eq!(bands.next(160, false).rows, 0..16);
    }

    #[test]
    fn without_a_budget_nothing_is_cut() {
        let mut bands = Bands::default();
        assert_eq!(bands.next(50, false), Band { rows: 0..50, first: true, last: true });
    }

    #[test]
    fn a_move_starts_again() {
        let mut bands = Bands::default();
        bands.set_budget(Some(30.0));
        bands.next(160, false);
        bands.abandon();
        assert!(bands.next(160, false).first);
        assert_eq!(bands.next(160, true).rows, 0..160);
    }
}
