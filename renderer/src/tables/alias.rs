//! Alias tables: draw an index with a given probability in constant time (Walker 1977; Vose 1991).

use crate::gpu_types::AliasEntry;

/// Builds the table of `weights`. Weights that are not finite or below 0 count as 0; when all are 0 every entry is
/// equally likely.
pub(crate) fn build(weights: &[f64]) -> Vec<AliasEntry> {
    let n = weights.len();
    let clean: Vec<f64> = weights.iter().map(|w| if w.is_finite() && *w > 0.0 { *w } else { 0.0 }).collect();
    let total: f64 = clean.iter().sum();
    let probability = |w: f64| if total > 0.0 { w / total } else { 1.0 / n as f64 };
    let mut scaled: Vec<f64> = clean.iter().map(|w| probability(*w) * n as f64).collect();
    let mut entries: Vec<AliasEntry> = clean
        .iter()
        .enumerate()
        .map(|(i, w)| AliasEntry { threshold: 1.0, alias: i as u32, pdf: probability(*w) as f32 })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    while let (Some(low), Some(&high)) = (small.pop(), large.last()) {
        entries[low].threshold = scaled[low] as f32;
        entries[low].alias = high as u32;
        scaled[high] -= 1.0 - scaled[low];
        if scaled[high] < 1.0 {
            large.pop();
            small.push(high);
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Probability with which the table draws each entry.
    fn drawn(table: &[AliasEntry]) -> Vec<f64> {
        let mut result = vec![0.0; table.len()];
        for (i, entry) in table.iter().enumerate() {
            result[i] += f64::from(entry.threshold) / table.len() as f64;
            result[entry.alias as usize] += (1.0 - f64::from(entry.threshold)) / table.len() as f64;
        }
        result
    }

    #[test]
    fn draws_in_proportion_to_the_weights() {
        let weights = [0.0, 1.0, 2.5, 1e-9, 7.0, f64::NAN, -3.0];
        let table = build(&weights);
        for (i, (drawn, weight)) in drawn(&table).into_iter().zip(weights).enumerate() {
            let expected = if weight > 0.0 { weight / 10.500_000_001 } else { 0.0 };
            assert!((drawn - expected).abs() < 1e-6, "{i}: {drawn} {expected}");
            assert!((f64::from(table[i].pdf) - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn nothing_but_zeros_is_uniform() {
        assert!(drawn(&build(&[0.0, 0.0])).iter().all(|p| (p - 0.5).abs() < 1e-6));
        assert!(build(&[]).is_empty());
    }
}
