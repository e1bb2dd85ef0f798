//! UASTC: blocks of 16 bytes, each in one of 19 modes that are a part of ASTC.
//! In: the blocks of a level. Out: texels. Format: Khronos Data Format 1.3, chapter 25; partitions, weights and
//! endpoints as in chapter 23 (ASTC).

use super::{Block, Canvas};

pub(super) const BLOCK_BYTES: usize = 16;

/// How the numbers of a block are stored.
#[derive(Clone, Copy)]
struct Mode {
    /// The bits that name the mode, and how many they are.
    code: (u8, u8),
    /// Bits that other formats are made from, which say nothing about the texels.
    hint_bits: usize,
    /// Partitions, with the bits of the number that chooses among the seeds.
    subsets: usize,
    seeds: &'static [u16],
    pattern_bits: usize,
    /// Second set of weights: for a channel that the block names, or for one that is fixed.
    second: Second,
    /// 2: luminance and alpha, 3: RGB, 4: RGBA.
    channels: usize,
    weight_bits: usize,
    endpoints: Range,
}

#[derive(Clone, Copy, PartialEq)]
enum Second {
    No,
    Named,
    Alpha,
}

/// Whole numbers that endpoints are stored as: `bits` bits below a digit of base `base` (1: none).
#[derive(Clone, Copy)]
struct Range {
    bits: usize,
    base: u32,
}

const fn range(bits: usize, base: u32) -> Range {
    Range { bits, base }
}

/// Seeds of the ASTC partitions that BC7 has too: two subsets, three subsets, and three of BC7 as two.
const SEEDS_2: &[u16] = &[
    28, 20, 16, 29, 91, 9, 107, 72, 149, 204, 50, 114, 496, 17, 78, 39, 252, 828, 43, 156, 116, 210, 476,
    273, 684, 359, 246, 195, 694, 524,
];
const SEEDS_3: &[u16] = &[260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254];
const SEEDS_3_AS_2: &[u16] =
    &[36, 48, 61, 137, 161, 183, 226, 281, 302, 307, 479, 495, 593, 594, 605, 799, 812, 988, 993];

/// One colour for the whole block.
const SOLID: usize = 8;

const PLAIN: Mode = Mode {
    code: (0, 0),
    hint_bits: 15,
    subsets: 1,
    seeds: &[],
    pattern_bits: 0,
    second: Second::No,
    channels: 3,
    weight_bits: 2,
    endpoints: range(8, 1),
};
const TWO: Mode = Mode { subsets: 2, seeds: SEEDS_2, pattern_bits: 5, ..PLAIN };

/// The modes in the order of the specification.
const MODES: [Mode; 19] = [
    Mode { code: (0x01, 4), weight_bits: 4, endpoints: range(6, 3), ..PLAIN },
    Mode { code: (0x35, 6), ..PLAIN },
    Mode { code: (0x1d, 5), weight_bits: 3, endpoints: range(4, 1), ..TWO },
    Mode { code: (0x03, 5), subsets: 3, seeds: SEEDS_3, pattern_bits: 4, endpoints: range(2, 3), ..PLAIN },
    Mode { code: (0x13, 5), endpoints: range(3, 5), ..TWO },
    Mode { code: (0x0b, 5), weight_bits: 3, ..PLAIN },
    Mode { code: (0x1b, 5), second: Second::Named, endpoints: range(5, 5), ..PLAIN },
    Mode { code: (0x07, 5), seeds: SEEDS_3_AS_2, endpoints: range(3, 5), ..TWO },
    Mode { code: (0x17, 5), ..PLAIN },
    Mode { code: (0x0f, 5), hint_bits: 23, channels: 4, endpoints: range(4, 1), ..TWO },
    Mode { code: (0x02, 3), hint_bits: 17, channels: 4, weight_bits: 4, endpoints: range(4, 3), ..PLAIN },
    Mode {
        code: (0x00, 2),
        hint_bits: 17,
        channels: 4,
        second: Second::Named,
        endpoints: range(4, 3),
        ..PLAIN
    },
    Mode { code: (0x06, 3), hint_bits: 17, channels: 4, weight_bits: 3, endpoints: range(6, 3), ..PLAIN },
    Mode { code: (0x1f, 5), hint_bits: 23, channels: 4, weight_bits: 1, second: Second::Named, ..PLAIN },
    Mode { code: (0x0d, 5), hint_bits: 23, channels: 4, ..PLAIN },
    Mode { code: (0x05, 7), hint_bits: 23, channels: 2, weight_bits: 4, ..PLAIN },
    Mode { code: (0x15, 6), hint_bits: 23, channels: 2, ..TWO },
    Mode { code: (0x25, 6), hint_bits: 23, channels: 2, second: Second::Alpha, ..PLAIN },
    Mode { code: (0x09, 4), weight_bits: 5, endpoints: range(5, 1), ..PLAIN },
];

/// Decodes blocks row by row into the canvas.
pub(super) fn decode(blocks: &[u8], mut canvas: Canvas) -> Result<Vec<u8>, String> {
    let (columns, rows) = canvas.blocks();
    let (wanted, found) = (columns * rows * BLOCK_BYTES, blocks.len());
    if found != wanted {
        return Err(format!("its largest level has {found} bytes, its size in texels needs {wanted}"));
    }
    let modes: [Option<usize>; 128] = std::array::from_fn(|code| {
        let is_its = |mode: &Mode| code & ((1 << mode.code.1) - 1) == usize::from(mode.code.0);
        MODES.iter().position(is_its)
    });
    let patterns: [Vec<Pattern>; MODES.len()] =
        MODES.map(|mode| mode.seeds.iter().map(|&seed| pattern(seed, mode.subsets)).collect());
    for (place, bytes) in blocks.as_chunks::<BLOCK_BYTES>().0.iter().enumerate() {
        let number = modes[usize::from(bytes[0] & 127)];
        let texels = number.and_then(|number| texels(u128::from_le_bytes(*bytes), number, &patterns[number]));
        let texels = texels.ok_or_else(|| format!("block {place} is of a kind that does not exist"))?;
        canvas.fill(place % columns, place / columns, &texels, |to, from| *to = from);
    }
    Ok(canvas.rgba8)
}

/// The subset of each texel.
type Pattern = [u8; 16];

/// Bits of a block, the lowest first.
struct Bits(u128);

impl Bits {
    fn take(&mut self, count: usize) -> u32 {
        let value = (self.0 & ((1 << count) - 1)) as u32;
        self.0 >>= count;
        value
    }
}

/// `None` for a partition that does not exist.
fn texels(block: u128, number: usize, patterns: &[Pattern]) -> Option<Block> {
    let mode = MODES[number];
    let mut bits = Bits(block >> mode.code.1);
    if number == SOLID {
        return Some([[(); 4].map(|()| bits.take(8) as u8); 16]);
    }
    bits.take(mode.hint_bits);
    let pattern = match mode.subsets {
        1 => [0; 16],
        _ => *patterns.get(bits.take(mode.pattern_bits) as usize)?,
    };
    let second = match mode.second {
        Second::No => None,
        Second::Named => Some(bits.take(2) as usize),
        Second::Alpha => Some(3),
    };
    let endpoints = read_endpoints(&mut bits, &mode);
    let planes = if second.is_some() { 2 } else { 1 };
    let mut weights = [[0; 2]; 16];
    for (place, weights) in weights.iter_mut().enumerate() {
        // The first texel of each subset has a weight whose highest bit is 0 and is left out.
        let is_first = !pattern[..place].contains(&pattern[place]);
        for weight in weights.iter_mut().take(planes) {
            *weight = weight_of(bits.take(mode.weight_bits - usize::from(is_first)), mode.weight_bits);
        }
    }
    Some(std::array::from_fn(|texel| {
        std::array::from_fn(|channel| {
            let [low, high] = endpoints[usize::from(pattern[texel])][channel];
            mixed(low, high, weights[texel][usize::from(second == Some(channel))])
        })
    }))
}

/// Both ends of each channel of each subset.
fn read_endpoints(bits: &mut Bits, mode: &Mode) -> [[[u8; 2]; 4]; 3] {
    let count = mode.channels * 2 * mode.subsets;
    let mut digits = read_digits(bits, count, mode.endpoints.base);
    let mut values = [0; 18];
    for (value, digit) in values.iter_mut().zip(&mut digits).take(count) {
        *value = endpoint(bits.take(mode.endpoints.bits), *digit, mode.endpoints);
    }
    let mut endpoints = [[[255; 2]; 4]; 3];
    let of_subset = values.chunks_exact(mode.channels * 2);
    for (ends, values) in endpoints.iter_mut().zip(of_subset).take(mode.subsets) {
        let value = |channel: usize| [values[channel * 2], values[channel * 2 + 1]];
        match mode.channels {
            2 => *ends = [value(0), value(0), value(0), value(1)],
            channels => (0..channels).for_each(|channel| ends[channel] = value(channel)),
        }
    }
    endpoints
}

/// Digits of base 3 or 5, five or three of them in a number of as many bits as those that are left need.
fn read_digits(bits: &mut Bits, count: usize, base: u32) -> [u32; 18] {
    let (bundle, widths): (usize, &[usize]) = match base {
        3 => (5, &[0, 2, 4, 5, 7, 8]),
        5 => (3, &[0, 3, 5, 7]),
        _ => return [0; 18],
    };
    let mut digits = [0; 18];
    for digits in digits[..count].chunks_mut(bundle) {
        let mut number = bits.take(widths[digits.len()]);
        for digit in digits {
            *digit = number % base;
            number /= base;
        }
    }
    digits
}

/// A stored endpoint as 8 bits (Khronos Data Format 1.3, section 23.13).
fn endpoint(bits: u32, digit: u32, range: Range) -> u8 {
    let upper = bits >> 1;
    let (factor, spread) = match (range.bits, range.base) {
        (2, 3) => (93, upper << 8 | upper << 4 | upper << 2 | upper << 1),
        (4, 3) => (22, upper << 6 | upper),
        (6, 3) => (5, upper << 4 | upper >> 4),
        (3, 5) => (26, upper << 7 | upper << 1 | upper >> 1),
        (5, 5) => (6, upper << 5 | upper >> 3),
        (width, _) => return replicated(bits, width, 8) as u8,
    };
    let flip = if bits & 1 == 1 { 0x1ff } else { 0 };
    let value = (digit * factor + spread) ^ flip;
    (flip & 0x80 | value >> 2) as u8
}

/// The upper bits again below, until there are `to` of them.
fn replicated(bits: u32, from: usize, to: usize) -> u32 {
    let twice = bits << from | bits;
    if from * 2 >= to { twice >> (from * 2 - to) } else { replicated(twice, from * 2, to) }
}

/// A stored weight as 0 to 64.
fn weight_of(bits: u32, width: usize) -> u32 {
    let weight = if width == 1 { bits * 63 } else { replicated(bits, width, 6) };
    weight + u32::from(weight > 32)
}

/// Between two ends, in 16 bits, of which the upper ones are kept.
fn mixed(low: u8, high: u8, weight: u32) -> u8 {
    let [low, high] = [low, high].map(|end| u32::from(end) * 257);
    ((low * (64 - weight) + high * weight + 32) >> 6 >> 8) as u8
}

/// The partition of a 4 x 4 block (Khronos Data Format 1.3, section 23.21).
fn pattern(seed: u16, subsets: usize) -> Pattern {
    let seed = u32::from(seed) + (subsets as u32 - 1) * 1024;
    let random = hash(seed);
    let (one, two) = (if seed & 2 == 0 { 5 } else { 4 }, if subsets == 3 { 6 } else { 5 });
    let shifts = if seed & 1 == 1 { [one, two] } else { [two, one] };
    let slope = |nibble: u32| {
        let value = random >> (nibble * 4) & 15;
        (value * value) >> shifts[nibble as usize % 2]
    };
    std::array::from_fn(|texel| {
        // Small blocks are spread to twice their size.
        let (x, y) = (texel as u32 % 4 * 2, texel as u32 / 4 * 2);
        let plane = |subset: u32| {
            let value = slope(subset * 2) * x + slope(subset * 2 + 1) * y + (random >> (14 - subset * 4));
            if (subset as usize) < subsets { value & 63 } else { 0 }
        };
        match (plane(0), plane(1), plane(2)) {
            (a, b, c) if a >= b && a >= c => 0,
            (_, b, c) if b >= c => 1,
            _ => 2,
        }
    })
}

fn hash(seed: u32) -> u32 {
    let mut p = seed;
    p ^= p >> 15;
    p = p.wrapping_sub(p << 17);
    p = p.wrapping_add(p << 7);
    p = p.wrapping_add(p << 4);
    p ^= p >> 5;
    p = p.wrapping_add(p << 16);
    p ^= p >> 7;
    p ^= p >> 3;
    p ^= p << 6;
    p ^ p >> 17
}
