//! How the random numbers of a view are drawn. Enters: the sampler and how many samples are going to be taken. Leaves:
//! specialisation constants of `shaders/shared/sampler.glsl`, and where in its pixel a sample lies, which the host
//! draws from the same points as the shaders (`shaders/lib/random.glsl`, `low_discrepancy.glsl`).

use caustica_gpu::Specialization;
use glam::Vec2;

use crate::gpu_types::{
    SAMPLER_BLUE_NOISE, SAMPLER_HALTON, SAMPLER_HAMMERSLEY, SAMPLER_INDEPENDENT, SAMPLER_SOBOL,
};
use crate::settings::Sampler;

/// The largest float below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A sampler with what it has to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampling {
    sampler: Sampler,
    hammersley_size: u32,
}

impl Sampling {
    /// Points of a Hammersley set of each stream while nobody knows how many samples there will be, as in a window.
    pub const UNKNOWN_SET: u32 = 256;

    /// `samples`: how many are going to be taken, of both streams. A Hammersley set is made for those of one stream; past
    /// its end another one begins.
    pub fn of(sampler: Sampler, samples: Option<u64>) -> Self {
        let per_stream = samples.map(|n| n.div_ceil(2).clamp(1, 1 << 24) as u32);
        let known = per_stream.filter(|_| sampler == Sampler::Hammersley);
        Self { sampler, hammersley_size: known.unwrap_or(Self::UNKNOWN_SET) }
    }

    /// Constants of `shaders/shared/sampler.glsl`, in its order.
    pub fn specialization(self) -> Specialization {
        let sampler = match self.sampler {
            Sampler::Sobol => SAMPLER_SOBOL,
            Sampler::Halton => SAMPLER_HALTON,
            Sampler::Hammersley => SAMPLER_HAMMERSLEY,
            Sampler::Independent => SAMPLER_INDEPENDENT,
            Sampler::BlueNoise => SAMPLER_BLUE_NOISE,
        };
        Specialization { values: vec![(32, sampler), (33, self.hammersley_size)] }
    }

    /// Where in its pixel a sample lies, -0.5..0.5 from the centre, the same in all pixels: as `sample_2d` of pixel (0, 0)
    /// gives it for `PURPOSE_JITTER`.
    pub fn jitter_px(self, seed: u32, sample_index: u64) -> Vec2 {
        let stream = (sample_index & 1) as u32;
        let within = sample_index >> 1;
        let (index, high) = (within as u32, (within >> 32) as u32);
        let scramble = hash_combine(hash_combine(seed, stream), high);
        let point = match self.sampler {
            Sampler::Sobol => to_point(sobol_digits(index, jitter_seeds(0, scramble))),
            Sampler::Halton => {
                let [_, x, y, _] = jitter_seeds(0, run_scramble(scramble, index >> 24));
                let index = index & 0x00ff_ffff;
                Vec2::new(unit(owen_permute(index, x)), radical_inverse_3(index, y))
            }
            Sampler::Hammersley => {
                let size = self.hammersley_size;
                let seeds = jitter_seeds(0, run_scramble(scramble, index / size));
                hammersley_point(index % size, size, seeds)
            }
            Sampler::Independent => {
                let [x, y, ..] = jitter_seeds(0, hash_combine(scramble, index));
                to_point([x, y])
            }
            Sampler::BlueNoise => {
                let digits = sobol_digits(index, jitter_seeds(0, scramble));
                let offset = sobol_digits(0, jitter_seeds(1, scramble));
                to_point([digits[0] ^ offset[0], digits[1] ^ offset[1]])
            }
        };
        point - 0.5
    }
}

/// `hash_pcg4d` of pixel (x, 0) and the dimension of the jitter.
fn jitter_seeds(x: u32, scramble: u32) -> [u32; 4] {
    const PURPOSE_JITTER: u32 = 15;
    const PURPOSE_PAIRS: u32 = 4096;
    hash_pcg4d([x, 0, PURPOSE_JITTER * PURPOSE_PAIRS, scramble])
}

fn hash_pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn hash_combine(a: u32, b: u32) -> u32 {
    hash_pcg(b ^ hash_pcg(a).wrapping_mul(0x9e37_79b9).wrapping_add(0x7f4a_7c15))
}

fn hash_pcg4d(mut v: [u32; 4]) -> [u32; 4] {
    let mix = |v: &mut [u32; 4]| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

fn run_scramble(scramble: u32, run: u32) -> u32 {
    if run == 0 { scramble } else { hash_combine(scramble, run) }
}

/// The upper 24 bits as a float.
fn unit(word: u32) -> f32 {
    (word >> 8) as f32 * 2f32.powi(-24)
}

fn to_point(digits: [u32; 2]) -> Vec2 {
    Vec2::new(unit(digits[0]), unit(digits[1]))
}

/// Owen's scrambling of the binary radical inverse of an index, or of any number whose digits are turned around.
fn owen_permute(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed.wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

fn sobol_digits(index: u32, seeds: [u32; 4]) -> [u32; 2] {
    let shuffled = owen_permute(index.reverse_bits(), seeds[0]);
    let mut second = shuffled;
    for (shift, mask) in [(16, !0), (8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        second ^= (second >> shift) & mask;
    }
    [owen_permute(shuffled, seeds[1]), owen_permute(second, seeds[2])]
}

/// `radical_inverse_scrambled` in base 3, the second base of the jitter's Halton pair.
fn radical_inverse_3(mut index: u32, seed: u32) -> f32 {
    const BASE: u32 = 3;
    let (mut node, mut value, mut scale) = (seed, 0, 1_u32);
    while scale < 1 << 24 {
        let digit = index % BASE;
        index /= BASE;
        let a = 1 + below(node & 0xffff, BASE - 1);
        value = value * BASE + (a * digit + below(node >> 16, BASE)) % BASE;
        scale *= BASE;
        node = hash_pcg(node ^ (digit + 1).wrapping_mul(0x9e37_79b9));
    }
    (value as f32 / scale as f32).min(BELOW_ONE)
}

fn below(half_word: u32, count: u32) -> u32 {
    (half_word * count) >> 16
}

fn hammersley_point(index: u32, size: u32, seeds: [u32; 4]) -> Vec2 {
    let strip = shuffle_below(index, size, seeds[0]);
    let x = (strip as f32 + unit(hash_combine(seeds[1], strip))) / size as f32;
    Vec2::new(x.min(BELOW_ONE), unit(owen_permute(strip, seeds[2])))
}

fn shuffle_below(index: u32, size: u32, seed: u32) -> u32 {
    let bits = u32::BITS - (size - 1).leading_zeros();
    let mask = (1_u32 << bits) - 1;
    let mut x = index;
    loop {
        let mut key = seed;
        for _ in 0..4 {
            key = hash_pcg(key);
            x = x.wrapping_mul(key | 1).wrapping_add(key >> 16) & mask;
            x ^= x >> bits.div_ceil(2);
        }
        if x < size {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_fills_the_pixel_evenly() {
        for sampler in Sampler::ALL {
            let sampling = Sampling::of(sampler, Some(2048));
            let mut cells = [0_u32; 16];
            for i in 0..1024 {
                let at = (sampling.jitter_px(3, i * 2) + 0.5) * 4.0;
                assert!(at.min_element() >= 0.0 && at.max_element() < 4.0, "{sampler:?}: {at}");
                cells[at.y as usize * 4 + at.x as usize] += 1;
            }
            // Five standard deviations of independent numbers; the even ones are far nearer.
            let apart = if sampler == Sampler::Independent { 39 } else { 3 };
            assert!(cells.iter().all(|n| n.abs_diff(64) <= apart), "{sampler:?}: {cells:?}");
        }
    }

    #[test]
    fn a_hammersley_set_is_made_for_the_samples_of_a_stream() {
        let size = |samples| Sampling::of(Sampler::Hammersley, samples).hammersley_size;
        let sizes = [Some(0), Some(7), Some(64), Some(u64::MAX), None].map(size);
        assert_eq!(sizes, [1, 4, 32, 1 << 24, Sampling::UNKNOWN_SET]);
        // The others are the same whatever is asked for, and so are their pipelines.
        assert_eq!(Sampling::of(Sampler::Sobol, Some(7)), Sampling::of(Sampler::Sobol, None));
    }
}
