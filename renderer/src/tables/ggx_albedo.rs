//! Share of evenly arriving light that a white GGX interface reflects at once, by cosine and roughness. In: nothing.
//! Out: the table of `lib/ggx_albedo.glsl`, computed in double precision.

use std::f64::consts::TAU;

use crate::gpu_types::GGX_ALBEDO_SIDE;

/// Points of the integration over visible normals, in each of two directions.
const STEPS: u32 = 24;

/// Row by row from the smoothest, each from grazing to perpendicular: with x and y in 0..1 the cosine is x^2 and the
/// roughness y.
pub(super) fn table() -> Vec<f32> {
    let share = |i: u32| f64::from(i) / f64::from(GGX_ALBEDO_SIDE - 1);
    (0..GGX_ALBEDO_SIDE)
        .flat_map(|y| (0..GGX_ALBEDO_SIDE).map(move |x| (share(x) * share(x), share(y) * share(y))))
        .map(|(cosine, alpha)| albedo(cosine.max(1e-4), alpha) as f32)
        .collect()
}

/// Mean of G2 / G1 over directions drawn by visible normals (Heitz 2018; spherical caps, Dupuy and Benyoub 2023).
fn albedo(cosine: f64, alpha: f64) -> f64 {
    if alpha == 0.0 {
        return 1.0;
    }
    let v = [(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
    let stretched = normalized([alpha * v[0], 0.0, v[2]]);
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        let [a, b] = [i % STEPS, i / STEPS].map(|k| (f64::from(k) + 0.5) / f64::from(STEPS));
        let z = (1.0 - a) * (1.0 + stretched[2]) - stretched[2];
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sine, cosine) = (TAU * b).sin_cos();
        let half = [radius * cosine + stretched[0], radius * sine, z + stretched[2]];
        let h = normalized([alpha * half[0], alpha * half[1], half[2]]);
        let along = v[0] * h[0] + v[2] * h[2];
        let l_z = 2.0 * along * h[2] - v[2];
        if l_z > 0.0 {
            let (root_v, root_l) = (root(alpha, v[2]), root(alpha, l_z));
            sum += l_z * (v[2] + root_v) / (l_z * root_v + v[2] * root_l);
        }
    }
    sum / f64::from(STEPS * STEPS)
}

fn root(alpha: f64, cosine: f64) -> f64 {
    (alpha * alpha * (1.0 - cosine * cosine) + cosine * cosine).sqrt()
}

fn normalized(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_interfaces_reflect_everything_and_rough_ones_less() {
        let side = GGX_ALBEDO_SIDE as usize;
        let table = table();
        assert!(table[..side].iter().all(|share| *share == 1.0));
        assert!(table.iter().all(|share| (0.3..=1.0).contains(share)));
        let perpendicular: Vec<f32> = table.chunks_exact(side).map(|row| row[side - 1]).collect();
        assert!(perpendicular.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6));
    }
}
