//! How an error falls with run time. Enters: errors at growing numbers of samples. Leaves: the error at a time, the time to an error,
//! the slope. It renders nothing.

use caustica_renderer::{ErrorMetrics, Split};
use serde::Serialize;

/// The error of a picture at one number of samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Samples a pixel.
    pub samples: u64,
    /// Milliseconds of all passes on the device until then.
    pub gpu_ms: f64,
    /// Seconds of a clock until then, without those of measuring.
    pub wall_s: f64,
    /// Against the reference.
    pub metrics: ErrorMetrics,
    /// Mean of FLIP of what is shown, 0 to 1.
    pub flip: f64,
    /// Mean of HDR-FLIP, of the last point alone; `None`: the reference has no median exposure.
    pub flip_hdr: Option<f64>,
    /// Noise and bias.
    pub split: Split,
}

/// Points of one way to make a picture, by samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curve(pub Vec<Point>);

impl Curve {
    /// The error after so many milliseconds on the device, on a straight line in logarithms between two points; `None`: before the
    /// first or after the last.
    pub fn error_at(&self, gpu_ms: f64) -> Option<f64> {
        self.between(
            gpu_ms,
            |point| point.gpu_ms,
            |point| point.split.total,
            |before, after| (before..=after).contains(&gpu_ms),
        )
    }

    /// Milliseconds on the device until the error is so small; `None`: it was larger at the end, or smaller from the start.
    pub fn gpu_ms_to(&self, error: f64) -> Option<f64> {
        self.between(
            error,
            |point| point.split.total,
            |point| point.gpu_ms,
            |before, after| before >= error && error >= after,
        )
    }

    /// `y` where `x` has this value, in the first pair of points that encloses it.
    fn between(
        &self,
        value: f64,
        x: impl Fn(&Point) -> f64,
        y: impl Fn(&Point) -> f64,
        encloses: impl Fn(f64, f64) -> bool,
    ) -> Option<f64> {
        let pair = self.0.windows(2).find(|pair| encloses(x(&pair[0]), x(&pair[1])))?;
        let [x0, x1] = [x(&pair[0]).ln(), x(&pair[1]).ln()];
        let [y0, y1] = [y(&pair[0]).ln(), y(&pair[1]).ln()];
        let share = if x1 == x0 { 0.0 } else { (value.ln() - x0) / (x1 - x0) };
        Some((y0 + share * (y1 - y0)).exp())
    }

    /// Exponent with which the noise's relMSE falls with the samples, by least squares in logarithms: -1 for independent samples.
    /// `None`: there is no noise, or there are fewer than two points.
    pub fn slope(&self) -> Option<f64> {
        slope(self.0.iter().map(|point| (point.samples as f64, point.split.noise.powi(2))))
    }
}

/// Slope of the straight line through the logarithms that misses them least; `None` for fewer than two points above 0.
pub fn slope(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<(f64, f64)> =
        points.filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|log| log.0), mean(|log| log.1));
    let spread: f64 = logs.iter().map(|log| (log.0 - x).powi(2)).sum();
    let product: f64 = logs.iter().map(|log| (log.0 - x) * (log.1 - y)).sum();
    (spread > 0.0).then(|| product / spread)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;
    use caustica_renderer::Estimate;

    fn curve() -> Curve {
        let point = |power: i32| {
            let samples = 1_u64 << power;
            let noise = (1.0 / samples as f64).sqrt();
            let bias = Estimate { value: 0.0, low: 0.0, high: 0.0 };
            Point {
                samples,
                gpu_ms: 10.0 * samples as f64,
                wall_s: 0.0,
                metrics: ErrorMetrics::default(),
                flip: 0.0,
                flip_hdr: None,
                split: Split { total: noise, noise, bias },
            }
        };
        Curve((0..=6).map(point).collect())
    }

    #[test]
    fn times_and_errors_are_read_between_the_points() {
        let curve = curve();
        // 12 samples, and back.
        let error = curve.error_at(120.0).unwrap();
        assert!((error - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12, "{error}");
        assert!((curve.gpu_ms_to(error).unwrap() - 120.0).abs() < 1e-9);
        assert_eq!((curve.error_at(5.0), curve.error_at(1e6), curve.gpu_ms_to(0.01)), (None, None, None));
        assert!((curve.slope().unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(Curve::default().slope(), None);
    }
}
