//! Times of many runs in a few numbers.

use serde::Serialize;

use super::table::figure;

/// What was measured again and again.
#[derive(Clone, Debug, Default)]
pub(in crate::cli) struct Series(Vec<f64>);

/// Median and 95th percentile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(in crate::cli) struct Spread {
    pub(in crate::cli) median: f64,
    pub(super) p95: f64,
}

impl Series {
    pub(in crate::cli) fn push(&mut self, value: f64) {
        self.0.push(value);
    }

    pub(in crate::cli) fn spread(&self) -> Spread {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
            sorted.get(index).copied().unwrap_or(0.0)
        };
        Spread { median: at(0.5), p95: at(0.95) }
    }
}

impl Spread {
    /// Median by median; `None`: nothing was measured.
    pub(super) fn over(&self, other: &Self) -> Option<f64> {
        (other.median > 0.0).then(|| self.median / other.median)
    }
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", figure(self.median), figure(self.p95))
    }
}

/// Sum of the passes of which the label begins with one of `beginnings`.
pub(super) fn passes_ms(passes: &[(String, f64)], beginnings: &[&str]) -> f64 {
    let counts = |label: &str| beginnings.iter().any(|beginning| label.starts_with(beginning));
    passes.iter().filter(|(label, _)| counts(label)).fold(0.0, |sum, (_, ms)| sum + ms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_and_the_slow_end() {
        let mut series = Series::default();
        (0..=100).rev().for_each(|i| series.push(f64::from(i)));
        assert_eq!(series.spread(), Spread { median: 50.0, p95: 95.0 });
        assert_eq!(Series::default().spread(), Spread::default());
    }

    #[test]
    fn passes_are_added_by_the_beginning_of_their_label() {
        let passes = [("accel.tlas", 2.0), ("accel.blas", 1.0), ("shadow.trace", 9.0), ("deform", 0.5)];
        let passes = passes.map(|(label, ms)| (label.to_owned(), ms));
        assert_eq!(passes_ms(&passes, &["accel.", "deform"]), 3.5);
        assert!(passes_ms(&passes, &["absent"]).is_sign_positive(), "not the -0 of an empty sum");
    }
}
