//! Bits of a stream, the lowest of a byte first, and the prefix codes that ETC1S is made of.
//! In: bytes. Out: numbers. A stream that ends early and a code that does not exist are errors.
//! Format: KTX 2.0, section 5 (BasisLZ); canonical codes as in RFC 1951, section 3.2.2.

/// Longest code in bits.
const MAX_LENGTH: usize = 16;
/// Order in which the lengths of the codes for lengths are stored.
const LENGTH_ORDER: [usize; 21] = [17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16];

/// Bits that are still to be read.
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// The next `count` bits, at most 32.
    pub fn take(&mut self, count: usize) -> Result<u32, String> {
        let mut value = 0;
        let mut taken = 0;
        while taken < count {
            let byte = self.bytes.get(self.at / 8).ok_or("its stream of bits is cut off")?;
            let (skip, wanted) = (self.at % 8, count - taken);
            let here = wanted.min(8 - skip);
            let bits = u32::from(*byte) >> skip & ((1 << here) - 1);
            value |= bits << taken;
            taken += here;
            self.at += here;
        }
        Ok(value)
    }

    /// Chunks of `size` bits, each followed by a bit that says whether more follow.
    pub fn variable(&mut self, size: usize) -> Result<u32, String> {
        let mut value = 0_u32;
        for shift in (0..32).step_by(size) {
            let chunk = self.take(size + 1)?;
            value |= (chunk & ((1 << size) - 1)) << shift;
            if chunk >> size == 0 {
                return Ok(value);
            }
        }
        Err("a number in its stream has more than 32 bits".to_owned())
    }
}

/// A canonical prefix code.
pub(super) struct Code {
    /// How many symbols have a code of so many bits.
    counts: [u32; MAX_LENGTH + 1],
    /// Symbols by length of their code, then by number.
    symbols: Vec<u16>,
}

impl Code {
    fn from_lengths(lengths: &[u8]) -> Result<Self, String> {
        let mut counts = [0; MAX_LENGTH + 1];
        for &length in lengths {
            counts[usize::from(length).min(MAX_LENGTH)] += 1;
        }
        counts[0] = 0;
        let used = (1..=MAX_LENGTH)
            .fold(0_u64, |sum, length| sum + (u64::from(counts[length]) << (MAX_LENGTH - length)));
        if used > 1 << MAX_LENGTH {
            return Err("a prefix code in it has too many short codes".to_owned());
        }
        let mut symbols: Vec<u16> =
            (0..).zip(lengths).filter(|(_, length)| **length > 0).map(|(s, _)| s).collect();
        symbols.sort_by_key(|&symbol| lengths.get(usize::from(symbol)).copied());
        Ok(Self { counts, symbols })
    }

    /// Reads a code, whose lengths are themselves coded.
    pub fn read(bits: &mut Bits<'_>) -> Result<Self, String> {
        let total = bits.take(14)? as usize;
        let stored = bits.take(5)? as usize;
        let mut of_lengths = [0; LENGTH_ORDER.len()];
        for &place in LENGTH_ORDER.get(..stored).ok_or("a prefix code in it has too many kinds of lengths")? {
            of_lengths[place] = bits.take(3)? as u8;
        }
        let of_lengths = Self::from_lengths(&of_lengths)?;
        let mut lengths: Vec<u8> = Vec::new();
        while lengths.len() < total {
            let symbol = of_lengths.next(bits)?;
            let (length, times) = match symbol {
                17 => (0, 3 + bits.take(3)?),
                18 => (0, 11 + bits.take(7)?),
                19 | 20 => {
                    let last = lengths.last().copied().filter(|&length| length > 0);
                    let last = last.ok_or("a prefix code in it repeats a length that is not there")?;
                    (last, if symbol == 19 { 3 + bits.take(2)? } else { 7 + bits.take(7)? })
                }
                length => (length as u8, 1),
            };
            lengths.extend(std::iter::repeat_n(length, times as usize));
        }
        match lengths.len() == total {
            true => Self::from_lengths(&lengths),
            false => Err("a prefix code in it has more lengths than symbols".to_owned()),
        }
    }

    /// The next symbol.
    pub fn next(&self, bits: &mut Bits<'_>) -> Result<u32, String> {
        let (mut code, mut first, mut before) = (0, 0, 0);
        for &count in &self.counts[1..] {
            code |= bits.take(1)?;
            if code < first + count {
                let symbol = self.symbols.get((before + code - first) as usize);
                return symbol.map(|&symbol| symbol.into()).ok_or_else(|| "a symbol is missing".to_owned());
            }
            before += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        Err("its stream has a code that does not exist".to_owned())
    }
}
