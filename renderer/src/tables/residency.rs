//! How much of each texture is on the device when not all of them fit. Enters: sizes, how large each appears, a budget.
//! Leaves: how many of its top levels each goes without, and the texels of what is left. It knows no device.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::LazyLock;

use crate::delta::Texture;

/// A texture that asks for room.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Columns and rows of the whole texture.
    pub(crate) extent: [u32; 2],
    /// Whether smaller levels come with it.
    pub(crate) mipmaps: bool,
    /// Pixels that it covers along its longer side where it appears largest; at least 1.
    pub(crate) seen_px: f32,
}

/// Columns and rows without the first `dropped` levels.
pub(crate) fn extent_of(extent: [u32; 2], dropped: u32) -> [u32; 2] {
    extent.map(|side| side.checked_shr(dropped).unwrap_or(0).max(1))
}

/// How many levels come with an image.
pub(crate) fn levels_of(extent: [u32; 2], mipmaps: bool) -> u32 {
    if mipmaps { extent[0].max(extent[1]).max(1).ilog2() + 1 } else { 1 }
}

/// Bytes of an RGBA8 image with its levels.
pub(crate) fn bytes_of(extent: [u32; 2], mipmaps: bool) -> u64 {
    let level = |level| extent_of(extent, level).map(u64::from).iter().product::<u64>() * 4;
    (0..levels_of(extent, mipmaps)).map(level).sum()
}

/// How many top levels each texture goes without so that together they take at most `budget_bytes`, or one texel each.
/// Again and again the texture with the most texels for a pixel that it covers gives a level.
pub(crate) fn plan(wanted: &[Wanted], budget_bytes: u64) -> Vec<u32> {
    let bytes = |index: usize, dropped: u32| {
        let Wanted { extent, mipmaps, .. } = wanted[index];
        bytes_of(extent_of(extent, dropped), mipmaps)
    };
    // Positive floats are ordered as their bits are.
    let surplus = |index: usize, dropped: u32| {
        let [width, height] = extent_of(wanted[index].extent, dropped);
        (width.max(height) as f32 / wanted[index].seen_px.max(1.0)).to_bits()
    };
    let mut dropped = vec![0; wanted.len()];
    let mut total: u64 = (0..wanted.len()).map(|index| bytes(index, 0)).sum();
    let mut queue: BinaryHeap<(u32, Reverse<usize>)> =
        (0..wanted.len()).map(|index| (surplus(index, 0), Reverse(index))).collect();
    while total > budget_bytes
        && let Some((_, Reverse(index))) = queue.pop()
    {
        if extent_of(wanted[index].extent, dropped[index]) == [1, 1] {
            continue;
        }
        total -= bytes(index, dropped[index]);
        dropped[index] += 1;
        total += bytes(index, dropped[index]);
        queue.push((surplus(index, dropped[index]), Reverse(index)));
    }
    dropped
}

/// The texels of a texture without its first `dropped` levels: each texel is the mean of those that it stands for, in
/// linear light.
pub(crate) fn texels_of(texture: &Texture, dropped: u32) -> Cow<'_, [u8]> {
    let mut texels = Cow::Borrowed(&texture.rgba8[..]);
    for level in 0..dropped {
        let from = extent_of([texture.width, texture.height], level);
        let to = extent_of([texture.width, texture.height], level + 1);
        texels = Cow::Owned(halved(&texels, from, to, texture.srgb));
    }
    texels
}

fn halved(texels: &[u8], from: [u32; 2], to: [u32; 2], srgb: bool) -> Vec<u8> {
    let columns = shares(from[0] as usize, to[0] as usize);
    let rows = shares(from[1] as usize, to[1] as usize);
    let mut result = Vec::with_capacity(rows.len() * columns.len() * 4);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0_f32; 4];
            for &(y, of_row) in row {
                for &(x, of_column) in column {
                    let at = (y * from[0] as usize + x) * 4;
                    let texel = texels.get(at..at + 4).unwrap_or(&[0; 4]);
                    for (channel, sum) in sum.iter_mut().enumerate() {
                        let linear = srgb && channel < 3;
                        let value = if linear {
                            LINEAR[usize::from(texel[channel])]
                        } else {
                            f32::from(texel[channel])
                        };
                        *sum += value * of_row * of_column;
                    }
                }
            }
            for (channel, value) in sum.into_iter().enumerate() {
                result.push(if srgb && channel < 3 { encoded(value) } else { (value + 0.5) as u8 });
            }
        }
    }
    result
}

/// Which of `from` texels each of `to` texels in a row stands for, and by what share; the shares of one add up to 1.
fn shares(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let width = from as f32 / to as f32;
    let of = |index: usize| {
        let (low, high) = (index as f32 * width, (index + 1) as f32 * width);
        let covered = |texel: usize| (high.min(texel as f32 + 1.0) - low.max(texel as f32)).max(0.0) / width;
        let last = (high.ceil() as usize).min(from);
        (low as usize..last).map(|texel| (texel, covered(texel))).filter(|(_, share)| *share > 0.0).collect()
    };
    (0..to).map(of).collect()
}

/// Linear light of an sRGB byte, 0..1 (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let value = byte as f32 / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    })
});

/// Steps of linear light in [`ENCODED`]: five for each byte where they lie closest.
const STEPS: usize = 1 << 14;

/// The sRGB byte of linear light in steps from 0 to 1.
static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let byte = |step: usize| {
        let linear = step as f32 / STEPS as f32;
        let value =
            if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (value * 255.0 + 0.5) as u8
    };
    (0..=STEPS).map(byte).collect()
});

/// The sRGB byte of linear light.
fn encoded(linear: f32) -> u8 {
    ENCODED.get((linear * STEPS as f32 + 0.5) as usize).copied().unwrap_or(255)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delta::Sampler;

    fn wanted(side: u32, seen_px: f32) -> Wanted {
        Wanted { extent: [side, side], mipmaps: true, seen_px }
    }

    #[test]
    fn what_fits_is_whole() {
        let list = [wanted(1024, 10.0), wanted(512, 10.0)];
        let all: u64 = list.iter().map(|w| bytes_of(w.extent, true)).sum();
        assert_eq!(plan(&list, all), [0, 0]);
        assert_eq!(plan(&list, all - 1), [1, 0], "the larger one has more to give");
        assert_eq!(plan(&[], 0), [0_u32; 0]);
    }

    #[test]
    fn what_is_seen_least_gives_first_and_all_fit() {
        let list = [wanted(1024, 1000.0), wanted(1024, 10.0), wanted(1024, 100.0)];
        for budget in [9 << 20, 6 << 20, 3 << 20, 1 << 20, 64 << 10] {
            let dropped = plan(&list, budget);
            let bytes: u64 =
                list.iter().zip(&dropped).map(|(w, d)| bytes_of(extent_of(w.extent, *d), true)).sum();
            assert!(bytes <= budget, "{budget}: {dropped:?}");
            assert!(dropped[0] <= dropped[2] && dropped[2] <= dropped[1], "{budget}: {dropped:?}");
        }
        assert_eq!(plan(&list, 0), [10, 10, 10], "one texel each is the least");
    }

    #[test]
    fn levels_are_means_in_linear_light() {
        let texture = |srgb, width, height, rgba8: Vec<u8>| Texture {
            name: String::new(),
            width,
            height,
            rgba8: rgba8.into(),
            srgb,
            sampler: Sampler::default(),
        };
        let checker = [[0, 0, 0, 0], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 0]].concat();
        assert_eq!(*texels_of(&texture(false, 2, 2, checker.clone()), 1), [128, 128, 128, 128]);
        assert_eq!(*texels_of(&texture(true, 2, 2, checker.clone()), 1), [188, 188, 188, 128]);
        assert_eq!(*texels_of(&texture(true, 2, 2, checker.clone()), 0), checker[..]);
        // Three columns become one, each with the same weight.
        let row = [[30, 0, 0, 255], [60, 0, 0, 255], [90, 0, 0, 255]].concat();
        assert_eq!(*texels_of(&texture(false, 3, 1, row), 1), [60, 0, 0, 255]);
        // Five columns become two: the middle one belongs to both.
        let row = (0..5).flat_map(|x| [x * 50, 0, 0, 255]).collect();
        assert_eq!(*texels_of(&texture(false, 5, 1, row), 1), [40, 0, 0, 255, 160, 0, 0, 255]);
        for byte in 0..=255 {
            assert_eq!(encoded(LINEAR[usize::from(byte)]), byte);
        }
    }
}
