//! Random numbers for test input, and the statistics that judge output. All in double precision.

/// SplitMix64 (Steele, Lea and Flood 2014): a generator that is independent of the one under test.
pub struct Random(u64);

impl Random {
    /// A generator; the same seed gives the same numbers.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 2f64.powi(-53)
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Ten to a power that is uniform between two numbers.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.between(low, high))
    }

    /// A unit vector, uniform over the sphere.
    pub fn direction(&mut self) -> glam::DVec3 {
        let z = self.between(-1.0, 1.0);
        let turn = self.between(0.0, std::f64::consts::TAU);
        let across = ((1.0 - z) * (1.0 + z)).sqrt();
        glam::DVec3::new(across * turn.cos(), across * turn.sin(), z)
    }
}

/// Pearson's statistic of counts against equal expectation, as a standard normal deviate (Wilson and Hilferty 1931).
/// Beyond 4 happens once in 30,000 by chance; the input is fixed, so a test that passes once passes always.
pub fn chi_square_deviate(counts: &[u64]) -> f64 {
    let expected = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    let statistic: f64 = counts.iter().map(|n| (*n as f64 - expected).powi(2) / expected).sum();
    chi_square_to_normal(statistic, counts.len() as f64 - 1.0)
}

/// Pearson's statistic of counts against given expectations (cells that expect less than 5 are pooled), as a
/// standard normal deviate.
pub fn chi_square_deviate_against(counts: &[u64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells, mut pooled_count, mut pooled_expected) = (0.0, 0.0, 0.0, 0.0);
    for (count, expected) in counts.iter().zip(expected) {
        if *expected < 5.0 {
            pooled_count += *count as f64;
            pooled_expected += expected;
        } else {
            statistic += (*count as f64 - expected).powi(2) / expected;
            cells += 1.0;
        }
    }
    if pooled_expected > 0.0 {
        statistic += (pooled_count - pooled_expected).powi(2) / pooled_expected;
        cells += 1.0;
    }
    chi_square_to_normal(statistic, cells - 1.0)
}

fn chi_square_to_normal(statistic: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    ((statistic / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Whether two numbers are nearer than `bound`; a NaN is near nothing.
pub fn is_near(a: f64, b: f64, bound: f64) -> bool {
    (a - b).abs() < bound
}

/// Pearson's correlation of two series of the same length.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let covariance: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    let variance = |values: &[f64], mean: f64| values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    covariance / (variance(a, mean_a) * variance(b, mean_b)).sqrt()
}

/// Star discrepancy of points in the unit square, by brute force over the corners that the points span.
pub fn star_discrepancy(points: &[[f64; 2]]) -> f64 {
    let mut columns: Vec<f64> = points.iter().map(|p| p[0]).chain([1.0]).collect();
    columns.sort_by(f64::total_cmp);
    let mut by_row = points.to_vec();
    by_row.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let n = points.len() as f64;
    let mut worst = 0.0_f64;
    for x in columns {
        let (mut below, mut at_most) = (0.0, 0.0);
        for point in &by_row {
            let area = x * point[1];
            // The open box ends just before this point, the closed one holds it.
            worst = worst.max(area - below / n);
            at_most += f64::from(u8::from(point[0] <= x));
            below += f64::from(u8::from(point[0] < x));
            worst = worst.max(at_most / n - area);
        }
        worst = worst.max(x - below / n);
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_counts_are_even_and_lopsided_ones_are_not() {
        assert!(chi_square_deviate(&[100, 103, 98, 99]) < 0.0);
        assert!(chi_square_deviate(&[200, 100, 50, 50]) > 5.0);
        assert!(chi_square_deviate_against(&[10, 20, 70, 1], &[10.0, 20.0, 69.0, 2.0]) < 0.5);
    }

    #[test]
    fn discrepancy_of_known_sets() {
        // One point in the middle: the open box up to (1, 1/2) holds nothing, the closed one up to the point too much.
        assert!((star_discrepancy(&[[0.5, 0.5]]) - 0.75).abs() < 1e-12);
        // n points in one corner leave the whole square empty.
        assert!(star_discrepancy(&[[0.999, 0.999]; 4]) > 0.99);
        let grid: Vec<[f64; 2]> = (0..64)
            .map(|i| [f64::from(i % 8) / 8.0 + 1.0 / 16.0, f64::from(i / 8) / 8.0 + 1.0 / 16.0])
            .collect();
        assert!(star_discrepancy(&grid) < 0.13);
    }

    #[test]
    fn correlation_is_one_for_equal_and_none_for_independent_series() {
        let mut random = Random::new(1);
        let [a, b] = [0, 1].map(|_| (0..1000).map(|_| random.unit()).collect::<Vec<_>>());
        assert!((correlation(&a, &a) - 1.0).abs() < 1e-12);
        assert!(correlation(&a, &b).abs() < 0.15);
    }
}
