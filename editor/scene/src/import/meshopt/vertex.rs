//! Attributes: differences to the element before, each byte of an element apart, with as few bits as they need.
//! In: a stream of version 0 or 1. Out: elements. Format: `KHR_meshopt_compression`, appendix A, mode 0.

use super::Bytes;

/// First byte of a stream, by version.
const HEADERS: [u8; 2] = [0xa0, 0xa1];
/// Elements that share the number of bits of their differences.
const GROUP: usize = 16;
const MAX_BLOCK_BYTES: usize = 8192;
const MAX_BLOCK_ELEMENTS: usize = 256;
/// Least bytes of the end of a stream, by version.
const MIN_TAIL_BYTES: [usize; 2] = [32, 24];
/// Bits of the differences of a group by its code, version 0.
const BITS_V0: [u8; 4] = [0, 2, 4, 8];
/// Version 1 has two scales.
const BITS_V1: [[u8; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// How the four bytes of a channel follow from those of the element before (version 1).
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    Words,
    /// All 32 bits differ by exclusive or, turned right by so many bits.
    Bits(u32),
}

impl Channel {
    fn read(code: u8) -> Result<Self, String> {
        match code & 3 {
            0 => Ok(Self::Bytes),
            1 => Ok(Self::Words),
            2 => Ok(Self::Bits(u32::from(code >> 4))),
            _ => {
                Err(format!("the compressed stream has a channel of kind {code:#04x}, which does not exist"))
            }
        }
    }

    /// The value whose difference to the one before is `difference`.
    fn next(self, before: [u8; 4], difference: [u8; 4]) -> [u8; 4] {
        let signed = |code: u16| (code >> 1) ^ (code & 1).wrapping_neg();
        match self {
            Self::Bytes => std::array::from_fn(|i| {
                let code = difference[i];
                before[i].wrapping_add((code >> 1) ^ (code & 1).wrapping_neg())
            }),
            Self::Words => {
                let [a, b, c, d] = before;
                let [e, f, g, h] = difference;
                let low = u16::from_le_bytes([a, b]).wrapping_add(signed(u16::from_le_bytes([e, f])));
                let high = u16::from_le_bytes([c, d]).wrapping_add(signed(u16::from_le_bytes([g, h])));
                let ([a, b], [c, d]) = (low.to_le_bytes(), high.to_le_bytes());
                [a, b, c, d]
            }
            Self::Bits(turn) => {
                let turned = u32::from_le_bytes(difference).rotate_right(turn);
                (u32::from_le_bytes(before) ^ turned).to_le_bytes()
            }
        }
    }
}

/// Elements of `stride` bytes.
pub(super) fn decode(count: usize, stride: usize, mut stream: Bytes<'_>) -> Result<Vec<u8>, String> {
    if !(4..=256).contains(&stride) || !stride.is_multiple_of(4) {
        return Err(format!("byteStride is {stride}, it has to be a multiple of 4 from 4 to 256"));
    }
    let version = stream.header(&HEADERS)?;
    let kinds = if version == 0 { 0 } else { stride / 4 };
    let tail = stream.tail((stride + kinds).max(MIN_TAIL_BYTES[version]))?;
    let (before, kinds) = tail[tail.len() - stride - kinds..].split_at(stride);
    let channels: Vec<Channel> = match version {
        0 => vec![Channel::Bytes; stride / 4],
        _ => kinds.iter().map(|&kind| Channel::read(kind)).collect::<Result<_, _>>()?,
    };
    let mut before: Vec<[u8; 4]> = before.as_chunks::<4>().0.to_vec();
    let mut elements = Vec::new();
    let block = (MAX_BLOCK_BYTES / stride / GROUP * GROUP).min(MAX_BLOCK_ELEMENTS);
    let mut left = count;
    while left > 0 {
        let length = left.min(block);
        let start = elements.len();
        // Grown by the block, so that a count that the stream does not bear out takes no memory.
        elements.resize(start + length * stride, 0);
        let control = if version == 0 { &[][..] } else { stream.take(stride / 4)? };
        for (place, (channel, before)) in channels.iter().zip(&mut before).enumerate() {
            let control = control.get(place).copied();
            let columns = read_columns(control, length, &mut stream)?;
            let of_channel =
                elements[start..].chunks_exact_mut(stride).map(|element| &mut element[place * 4..][..4]);
            for (i, out) in of_channel.enumerate() {
                *before = channel.next(*before, columns.each_ref().map(|column| column[i]));
                out.copy_from_slice(before);
            }
        }
        left -= length;
    }
    stream.finish()?;
    Ok(elements)
}

/// The four bytes of a channel, `length` differences each.
fn read_columns(control: Option<u8>, length: usize, stream: &mut Bytes<'_>) -> Result<[Vec<u8>; 4], String> {
    let mut columns: [Vec<u8>; 4] = Default::default();
    for (place, column) in columns.iter_mut().enumerate() {
        let way = control.map(|control| control >> (place * 2) & 3);
        *column = match way {
            None => read_groups(BITS_V0, length, stream)?,
            Some(scale @ (0 | 1)) => read_groups(BITS_V1[usize::from(scale)], length, stream)?,
            Some(2) => vec![0; length],
            Some(_) => stream.take(length)?.to_vec(),
        };
    }
    Ok(columns)
}

/// Groups of differences after a header with two bits for each.
fn read_groups(bits: [u8; 4], length: usize, stream: &mut Bytes<'_>) -> Result<Vec<u8>, String> {
    let groups = length.div_ceil(GROUP);
    let header = stream.take(groups.div_ceil(4))?;
    let mut column = Vec::with_capacity(groups * GROUP);
    for group in 0..groups {
        let code = header[group / 4] >> (group % 4 * 2) & 3;
        read_group(bits[usize::from(code)], stream, &mut column)?;
    }
    Ok(column)
}

/// Sixteen differences of so many bits; one with all bits set stands for a byte that follows the group.
fn read_group(bits: u8, stream: &mut Bytes<'_>, column: &mut Vec<u8>) -> Result<(), String> {
    match bits {
        0 => column.extend([0; GROUP]),
        8 => column.extend(stream.take(GROUP)?),
        _ => {
            let packed = stream.take(usize::from(bits) * GROUP / 8)?;
            let escape = (1 << bits) - 1;
            for i in 0..GROUP as u8 {
                let bit = i * bits;
                let byte = packed[usize::from(bit / 8)];
                // Single bits begin with the lowest, wider ones with the uppermost.
                let shift = if bits == 1 { bit % 8 } else { 8 - bits - bit % 8 };
                let value = byte >> shift & escape;
                column.push(if value == escape { stream.byte()? } else { value });
            }
        }
    }
    Ok(())
}
