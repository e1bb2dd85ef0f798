//! Share of evenly arriving light that the sheen lobe reflects (KHR_materials_sheen), by cosine and roughness: what the
//! layers below it are scaled by. In: nothing. Out: the table of `lib/sheen.glsl`, computed once, in double precision.

use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

use crate::gpu_types::SHEEN_ALBEDO_SIDE;

/// Roughness below which the lobe is that of this roughness; `SHEEN_ROUGHNESS_MIN` in `lib/sheen.glsl`.
const ROUGHNESS_MIN: f64 = 0.05;
/// Cosines below this count as this; `SHEEN_COSINE_MIN` in `lib/sheen.glsl`.
const COSINE_MIN: f64 = 1e-3;
/// Steps of the integration over the polar angle, and over half of the turn.
const STEPS: [usize; 2] = [128, 64];

/// Row by row from the smallest roughness, each from grazing to perpendicular: with x and y in 0..1 the cosine is
/// `COSINE_MIN + (1 - COSINE_MIN) x^2` and the roughness `ROUGHNESS_MIN + (1 - ROUGHNESS_MIN) y`.
#[must_use]
pub fn albedo_table() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..SHEEN_ALBEDO_SIDE).flat_map(row).collect())
}

fn row(y: u32) -> impl Iterator<Item = f32> {
    let share = |i: u32| f64::from(i) / f64::from(SHEEN_ALBEDO_SIDE - 1);
    let roughness = ROUGHNESS_MIN + (1.0 - ROUGHNESS_MIN) * share(y);
    let cosines = (0..SHEEN_ALBEDO_SIDE).map(move |x| COSINE_MIN + (1.0 - COSINE_MIN) * share(x) * share(x));
    cosines.map(move |cosine| albedo(cosine, roughness * roughness) as f32)
}

/// Integral of the lobe times the cosine over the directions of light, by the midpoint rule in (sqrt(cosine), turn).
fn albedo(cosine: f64, alpha: f64) -> f64 {
    let [polar, turns] = STEPS.map(|steps| steps as f64);
    let across = (1.0 - cosine * cosine).sqrt();
    let lambda_v = lambda(cosine, alpha);
    let mut sum = 0.0;
    for i in 0..STEPS[0] {
        let u = (i as f64 + 0.5) / polar;
        let z = u * u;
        let held = z.max(COSINE_MIN);
        let visibility = z / (4.0 * cosine * held * (1.0 + lambda_v + lambda(held, alpha)));
        let radius = (1.0 - z * z).sqrt();
        let mut distribution_sum = 0.0;
        for k in 0..STEPS[1] {
            let turn = PI * (k as f64 + 0.5) / turns;
            let half = [across + radius * turn.cos(), radius * turn.sin(), cosine + z];
            let sin2 = half[0] * half[0] + half[1] * half[1];
            distribution_sum += distribution(sin2 / (sin2 + half[2] * half[2]), alpha);
        }
        sum += distribution_sum * visibility * 2.0 * u;
    }
    sum * TAU / (polar * turns)
}

/// "Charlie": Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017; 1/sr. `sin2`: of the half vector.
fn distribution(sin2: f64, alpha: f64) -> f64 {
    (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) / TAU
}

/// Their fit of the Smith function.
fn lambda(cosine: f64, alpha: f64) -> f64 {
    let share = (1.0 - alpha) * (1.0 - alpha);
    let mix = |x: f64, y: f64| x + (y - x) * share;
    let fit = |x: f64| {
        mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
            + mix(-1.97760, -1.27393) * x
            + mix(-4.32054, -4.85967)
    };
    if cosine < 0.5 { fit(cosine).exp() } else { (2.0 * fit(0.5) - fit(1.0 - cosine)).exp() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_finite_and_falls_towards_the_perpendicular() {
        let table = albedo_table();
        let side = SHEEN_ALBEDO_SIDE as usize;
        assert_eq!(table.len(), side * side);
        assert!(table.iter().all(|value| value.is_finite() && *value >= 0.0));
        for row in table.chunks_exact(side) {
            assert!(row[side / 4] > row[side / 2] && row[side / 2] > row[side - 1], "{row:?}");
        }
    }

    /// Known values: the integral by 400 Gauss points in the square root of the cosine and 400 turns.
    #[test]
    fn the_integral_is_near_a_finer_one() {
        for (roughness, cosine, expected) in
            [(0.1_f64, 0.1, 0.5218), (0.3, 0.2, 0.3407), (0.5, 0.5, 0.1879), (1.0, 0.9, 0.1943)]
        {
            let found = albedo(cosine, roughness * roughness);
            assert!((found - expected).abs() < 5e-4, "{roughness} {cosine}: {found} {expected}");
        }
    }
}
