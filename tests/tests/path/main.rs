//! The path tracer against what is known: images of an independent path tracer, closed forms, conservation of energy,
//! and the other pipelines where they compute the same.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

mod energy;
mod lights;
mod references;

use caustica_renderer::{Accumulated, Pipeline, ViewSettings};

fn settings() -> ViewSettings {
    ViewSettings { pipeline: Pipeline::Path, temporal: false, ..ViewSettings::default() }
}

/// How far a mean of this standard error may be from what it should be: 4 of them and `rounding`. An error above
/// `error_max` would make that no test.
fn within(error: f64, rounding: f64, error_max: f64) -> f64 {
    assert!(error < error_max, "the error is {error}, not below {error_max}");
    4.0 * error + rounding
}

/// Mean of a channel, and the standard error of that mean as the two streams tell it.
fn mean_and_error(image: &Accumulated, channel: usize) -> (f64, f64) {
    let count = image.mean.len() as f64;
    let mean = image.mean.iter().map(|p| f64::from(p[channel])).sum::<f64>() / count;
    let squares = image.half_difference.iter().map(|d| f64::from(d[channel]).powi(2)).sum::<f64>();
    (mean, squares.sqrt() / count)
}
