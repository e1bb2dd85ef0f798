//! Damage to files: bytes, lines, JSON, chunks and the lengths and sums that guard them.
//! In: a seed and numbers. Out: one of its files, damaged once to thrice, and words for what was done.

use crate::corpus::Seed;
use crate::json;
use crate::numbers::Numbers;

/// Bytes that a repetition may add.
const MOST_REPEATED: usize = 1 << 16;

/// A damaged file of a seed.
pub struct Damaged {
    pub file: usize,
    pub bytes: Vec<u8>,
    pub kinds: Vec<&'static str>,
}

/// Damages a seed.
pub fn damaged(seed: &Seed, seeds: &[Seed], numbers: &mut Numbers) -> Damaged {
    // The file that is named more often than those beside it; images are all that their seeds are about.
    let file =
        if numbers.below(10) < seed.entry_share { seed.entry } else { numbers.below(seed.files.len()) };
    let (name, sound) = &seed.files[file];
    let mut bytes = sound.clone();
    let mut kinds = Vec::new();
    let other = numbers.pick(seeds);
    let other = numbers.pick(&other.files).1.clone();
    for _ in 0..=numbers.below(2) * numbers.below(3) {
        let kind = match extension(name) {
            "gltf" | "json" if !numbers.one_in(5) => {
                replace(&mut bytes, |bytes| json::damage(bytes, numbers))
            }
            "glb" if !numbers.one_in(4) => glb(&mut bytes, numbers),
            "obj" | "mtl" | "csv" if !numbers.one_in(5) => lines(&mut bytes, numbers),
            "png" if !numbers.one_in(4) => png(&mut bytes, numbers),
            _ => raw(&mut bytes, &other, numbers),
        };
        kinds.push(kind);
        // Repeated repetition would have no end.
        if bytes.len() > 2 * sound.len() + MOST_REPEATED {
            break;
        }
    }
    Damaged { file, bytes, kinds }
}

fn extension(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or("")
}

fn replace(bytes: &mut Vec<u8>, damage: impl FnOnce(&[u8]) -> (Vec<u8>, &'static str)) -> &'static str {
    let (new, kind) = damage(bytes);
    *bytes = new;
    kind
}

/// A range that is not empty, short ones more often.
fn range(length: usize, numbers: &mut Numbers) -> std::ops::Range<usize> {
    let start = numbers.below(length);
    let most = 1 << numbers.below(12);
    start..(start + 1 + numbers.below(most)).min(length)
}

fn raw(bytes: &mut Vec<u8>, other: &[u8], numbers: &mut Numbers) -> &'static str {
    if bytes.is_empty() {
        bytes.push(numbers.next() as u8);
        return "byte inserted";
    }
    match numbers.below(9) {
        0 => {
            for _ in 0..=numbers.below(8) {
                let at = numbers.below(bytes.len());
                bytes[at] ^= 1 << numbers.below(8);
            }
            "bits flipped"
        }
        1 => {
            let at = numbers.below(bytes.len());
            bytes[at] = *numbers.pick(&[0, 1, 0x7f, 0x80, 0xfe, 0xff, b'-', b'9', b'"', b'{', b'\n']);
            "byte"
        }
        2 | 3 => {
            word(bytes, numbers);
            "word"
        }
        4 => {
            bytes.truncate(numbers.below(bytes.len()));
            "cut off"
        }
        5 => {
            bytes.drain(range(bytes.len(), numbers));
            "piece removed"
        }
        6 => {
            let piece = bytes[range(bytes.len(), numbers)].to_vec();
            let at = numbers.below(bytes.len());
            bytes.splice(at..at, piece);
            "piece twice"
        }
        7 => {
            let piece = other[range(other.len().max(1), numbers).start.min(other.len())..].to_vec();
            let at = range(bytes.len(), numbers);
            let length = at.len();
            bytes.splice(at, piece.into_iter().take(length * 2));
            "piece of another file"
        }
        _ => {
            let (first, second) = (range(bytes.len(), numbers), numbers.below(bytes.len()));
            for (offset, at) in first.enumerate() {
                let to = (second + offset) % bytes.len();
                bytes.swap(at, to);
            }
            "pieces swapped"
        }
    }
}

/// A little-endian or big-endian word of 2, 4 or 8 bytes becomes one that lengths overflow with.
fn word(bytes: &mut [u8], numbers: &mut Numbers) {
    let size = *numbers.pick(&[2, 4, 4, 8]);
    let length = bytes.len() as u64;
    let values = [
        0,
        1,
        length - 1,
        length + 1,
        1 << 15,
        0xffff,
        1 << 31,
        u64::from(u32::MAX),
        1 << 63,
        u64::MAX,
        0x7fc0_0000,
        0x7f80_0000,
    ];
    let mut value = numbers.pick(&values).to_le_bytes();
    let swapped = numbers.one_in(2);
    if swapped {
        value[..size].reverse();
    }
    let at = numbers.below(bytes.len()) & if numbers.one_in(2) { !3 } else { !0 };
    for (to, from) in bytes[at..].iter_mut().zip(&value[..size]) {
        *to = *from;
    }
}

fn le_word(bytes: &[u8], at: usize) -> usize {
    bytes.get(at..at + 4).map_or(0, |four| u32::from_le_bytes(four.try_into().unwrap()) as usize)
}

/// The JSON of a binary glTF, its lengths, or its bytes.
fn glb(bytes: &mut Vec<u8>, numbers: &mut Numbers) -> &'static str {
    let end = 20 + le_word(bytes, 12);
    if bytes.len() < 20 || end > bytes.len() {
        return raw(bytes, &[0], numbers);
    }
    if numbers.one_in(4) {
        let at = *numbers.pick(&[4, 8, 12, 16, end, end + 4]);
        let lie = *numbers.pick(&[
            0,
            1,
            0x7fff_ffff,
            0xffff_ffff,
            bytes.len() as u32,
            (bytes.len() as u32).wrapping_sub(1),
        ]);
        if let Some(four) = bytes.get_mut(at..at + 4) {
            four.copy_from_slice(&lie.to_le_bytes());
        }
        return "length";
    }
    let (mut json, kind) = json::damage(&bytes[20..end], numbers);
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut new = bytes[..12].to_vec();
    new.extend((json.len() as u32).to_le_bytes());
    new.extend(b"JSON");
    new.extend(json);
    new.extend(&bytes[end..]);
    let length = new.len() as u32;
    new[8..12].copy_from_slice(&length.to_le_bytes());
    *bytes = new;
    kind
}

fn lines(bytes: &mut Vec<u8>, numbers: &mut Numbers) -> &'static str {
    const WORDS: [&str; 24] = [
        "nan",
        "-inf",
        "1e39",
        "-0",
        "0",
        "-1",
        "4294967296",
        "9223372036854775807",
        "-9223372036854775808",
        "1/2/3/4",
        "1//",
        "/",
        "1/-1/1",
        "#",
        "\\",
        "-s",
        "-bm",
        "-clamp",
        "../../etc/passwd",
        "C:\\a.png",
        "f",
        "usemtl",
        "\u{0}",
        "\u{FFFD}",
    ];
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if lines.is_empty() {
        return raw(bytes, &[0], numbers);
    }
    let at = numbers.below(lines.len());
    let kind = match numbers.below(7) {
        0 => {
            lines.remove(at);
            "line removed"
        }
        1 => {
            let to = numbers.below(lines.len());
            lines.swap(at, to);
            "lines swapped"
        }
        2 => {
            let line = lines[at].clone();
            let times = (*numbers.pick(&[1, 2, 1000])).min(1 + MOST_REPEATED / line.len().max(1));
            lines.splice(at..at, std::iter::repeat_n(line, times));
            "line repeated"
        }
        3 => {
            let mut words: Vec<&str> = lines[at].split(' ').collect();
            let copy = words.clone();
            let times = (*numbers.pick(&[1, 2, 3000])).min(1 + MOST_REPEATED / lines[at].len().max(1));
            (0..times).for_each(|_| words.extend(copy.iter().skip(1)));
            lines[at] = words.join(" ");
            "words repeated"
        }
        4 => {
            let mut words: Vec<&str> = lines[at].split(' ').collect();
            words.remove(numbers.below(words.len()));
            lines[at] = words.join(" ");
            "word removed"
        }
        _ => {
            let mut words: Vec<&str> = lines[at].split(' ').collect();
            let place = numbers.below(words.len());
            words[place] = WORDS[numbers.below(WORDS.len())];
            lines[at] = words.join(" ");
            "word"
        }
    };
    *bytes = lines.join("\n").into_bytes();
    kind
}

/// Data of a chunk, with a sum that fits, or the order of the chunks.
fn png(bytes: &mut Vec<u8>, numbers: &mut Numbers) -> &'static str {
    let mut chunks: Vec<Vec<u8>> = Vec::new();
    let mut at = 8;
    while at + 12 <= bytes.len() {
        let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let Some(chunk) = bytes.get(at + 4..at + 8 + length) else { break };
        chunks.push(chunk.to_vec());
        at += 12 + length;
    }
    if chunks.is_empty() {
        return raw(bytes, &[0], numbers);
    }
    let place = numbers.below(chunks.len());
    let kind = match numbers.below(6) {
        0 => {
            chunks.remove(place);
            "chunk removed"
        }
        1 => {
            let to = numbers.below(chunks.len());
            chunks.swap(place, to);
            "chunks swapped"
        }
        2 => {
            let chunk = chunks[place].clone();
            chunks.insert(place, chunk);
            "chunk twice"
        }
        3 => {
            // Width, height, depth, colour type.
            if let Some(head) = chunks.iter_mut().find(|chunk| chunk.starts_with(b"IHDR")) {
                word(&mut head[4..], numbers);
            }
            "size"
        }
        _ => {
            let data = &mut chunks[place];
            let mut tail = data.split_off(4);
            raw(&mut tail, b"caustica", numbers);
            data.extend(tail);
            "chunk"
        }
    };
    bytes.truncate(8);
    for chunk in chunks {
        bytes.extend((chunk.len() as u32 - 4).to_be_bytes());
        bytes.extend(&chunk);
        bytes.extend(crc32(&chunk).to_be_bytes());
    }
    kind
}

/// PNG specification, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}
