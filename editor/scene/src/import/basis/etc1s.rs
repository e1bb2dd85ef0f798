//! ETC1S: blocks that name a pair of colours and a pattern, both from lists of the file.
//! In: the global data of BasisLZ and the bytes of a level. Out: texels. Format: KTX 2.0, section 5 (BasisLZ).

use super::bits::{Bits, Code};
use super::{Block, Canvas};

/// What the four selectors add to the base colour, by intensity (ETC1, table 3.17.2, from dark to light).
const INTENSITIES: [[i16; 4]; 8] = [
    [-8, -2, 2, 8],
    [-17, -5, 5, 17],
    [-29, -9, 9, 29],
    [-42, -13, 13, 42],
    [-60, -18, 18, 60],
    [-80, -24, 24, 80],
    [-106, -33, 33, 106],
    [-183, -47, 47, 183],
];
const HEADER_BYTES: usize = 20;
const IMAGE_BYTES: usize = 20;
/// Flag of an image that is a difference to the one before.
const IS_DIFFERENCE: u32 = 2;
/// Symbol after which the last predictions are repeated.
const REPEAT_PREDICTIONS: u32 = 256;

/// Base colour in 5 bits a channel, and which row of [`INTENSITIES`].
#[derive(Clone, Copy, Default)]
struct Endpoint {
    color: [u8; 3],
    intensity: u8,
}

/// The lists and codes that all blocks share.
struct Codebook {
    endpoints: Vec<Endpoint>,
    /// Rows of selectors, two bits each.
    selectors: Vec<[u8; 4]>,
    prediction: Code,
    endpoint_step: Code,
    selector: Code,
    run: Code,
    history: usize,
}

/// Reads numbers and sections of the global data.
struct Sections<'a>(&'a [u8]);

impl<'a> Sections<'a> {
    fn bytes(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("its global data is cut off")?;
        self.0 = rest;
        Ok(taken)
    }

    fn numbers<const N: usize>(&mut self) -> Result<[u32; N], String> {
        let words = self.bytes(N * 4)?.as_chunks::<4>().0;
        Ok(std::array::from_fn(|i| u32::from_le_bytes(words[i])))
    }
}

/// Decodes the first image of a level into the canvas.
pub(super) fn decode(global: &[u8], level: &[u8], mut canvas: Canvas) -> Result<Vec<u8>, String> {
    let images = global.get(HEADER_BYTES..).unwrap_or_default();
    let [flags, color_start, color_length, alpha_start, alpha_length] = Sections(images).numbers()?;
    if flags & IS_DIFFERENCE != 0 {
        return Err("it is a frame of a film that needs the frame before".to_owned());
    }
    let codebook = Codebook::read(global)?;
    let slice = |start: u32, length: u32| {
        let end = (start as usize).saturating_add(length as usize);
        level.get(start as usize..end).ok_or("a slice lies outside of its level")
    };
    codebook.paint(slice(color_start, color_length)?, &mut canvas, |to, from| *to = from)?;
    if alpha_length > 0 {
        codebook.paint(slice(alpha_start, alpha_length)?, &mut canvas, |to, from| to[3] = from[1])?;
    }
    Ok(canvas.rgba8)
}

impl Codebook {
    fn read(global: &[u8]) -> Result<Self, String> {
        let mut sections = Sections(global);
        let [counts, endpoints, selectors, tables, _] = sections.numbers()?;
        // One image is described for each level; the sections stand at the end.
        let sizes = [endpoints, selectors, tables].map(|size| size as usize);
        let all = sizes.iter().fold(0_usize, |sum, &size| sum.saturating_add(size));
        let images = sections.0.len().checked_sub(all).filter(|&bytes| bytes >= IMAGE_BYTES);
        sections.bytes(images.ok_or("its global data is cut off")?)?;
        let [endpoints, selectors, tables] = sizes;
        let endpoints = read_endpoints(&mut Bits::new(sections.bytes(endpoints)?), counts & 0xffff)?;
        let selectors = read_selectors(&mut Bits::new(sections.bytes(selectors)?), counts >> 16)?;
        let bits = &mut Bits::new(sections.bytes(tables)?);
        Ok(Self {
            endpoints,
            selectors,
            prediction: Code::read(bits)?,
            endpoint_step: Code::read(bits)?,
            selector: Code::read(bits)?,
            run: Code::read(bits)?,
            history: bits.take(13)? as usize,
        })
    }

    fn paint(
        &self,
        slice: &[u8],
        canvas: &mut Canvas,
        write: fn(&mut [u8; 4], [u8; 4]),
    ) -> Result<(), String> {
        let (columns, rows) = canvas.blocks();
        let bits = &mut Bits::new(slice);
        let mut endpoints = Endpoints::new(columns);
        let mut selectors = Selectors::new(self);
        for row in 0..rows {
            for column in 0..columns {
                let endpoint = endpoints.next(self, bits, column, row)?;
                let selector = selectors.next(bits)?;
                let endpoint =
                    self.endpoints.get(endpoint).ok_or("a block names a colour that is not there")?;
                let selector =
                    self.selectors.get(selector).ok_or("a block names a pattern that is not there")?;
                canvas.fill(column, row, &texels(*endpoint, *selector), write);
            }
        }
        Ok(())
    }
}

fn read_endpoints(bits: &mut Bits<'_>, count: u32) -> Result<Vec<Endpoint>, String> {
    let steps = [Code::read(bits)?, Code::read(bits)?, Code::read(bits)?];
    let intensity_step = Code::read(bits)?;
    let is_gray = bits.take(1)? == 1;
    let mut last = Endpoint { color: [16; 3], intensity: 0 };
    let mut endpoints = Vec::new();
    for _ in 0..count {
        last.intensity = (intensity_step.next(bits)? as u8).wrapping_add(last.intensity) & 7;
        for channel in last.color.iter_mut().take(if is_gray { 1 } else { 3 }) {
            let steps = match *channel {
                0..=9 => &steps[0],
                10..=21 => &steps[1],
                _ => &steps[2],
            };
            *channel = channel.wrapping_add(steps.next(bits)? as u8) & 31;
        }
        if is_gray {
            last.color = [last.color[0]; 3];
        }
        endpoints.push(last);
    }
    Ok(endpoints)
}

fn read_selectors(bits: &mut Bits<'_>, count: u32) -> Result<Vec<[u8; 4]>, String> {
    if bits.take(2)? != 0 {
        return Err("it needs a list of patterns that is not in the file".to_owned());
    }
    let is_raw = bits.take(1)? == 1;
    let step = if is_raw { None } else { Some(Code::read(bits)?) };
    let mut last = [0; 4];
    let mut selectors = Vec::new();
    for place in 0..count {
        for row in &mut last {
            *row = match &step {
                Some(step) if place > 0 => *row ^ step.next(bits)? as u8,
                _ => bits.take(8)? as u8,
            };
        }
        selectors.push(last);
    }
    Ok(selectors)
}

/// Which endpoint the blocks have: that of a neighbour, or one a step further in the list.
struct Endpoints {
    /// Endpoints of the blocks above, then of those already read in this row.
    above: Vec<usize>,
    above_left: usize,
    left: usize,
    /// Predictions of the blocks below in each pair of columns.
    below: Vec<u32>,
    predictions: u32,
    last_symbol: u32,
    repeats: u32,
}

impl Endpoints {
    fn new(columns: usize) -> Self {
        Self {
            above: vec![0; columns],
            above_left: 0,
            left: 0,
            below: vec![0; columns.div_ceil(2)],
            predictions: 0,
            last_symbol: 0,
            repeats: 0,
        }
    }

    fn next(
        &mut self,
        book: &Codebook,
        bits: &mut Bits<'_>,
        column: usize,
        row: usize,
    ) -> Result<usize, String> {
        if column.is_multiple_of(2) {
            let below = &mut self.below[column / 2];
            if row.is_multiple_of(2) {
                if self.repeats > 0 {
                    self.repeats -= 1;
                } else {
                    let symbol = book.prediction.next(bits)?;
                    match symbol == REPEAT_PREDICTIONS {
                        true => self.repeats = bits.variable(4)?.saturating_add(2),
                        false => self.last_symbol = symbol,
                    }
                }
                self.predictions = self.last_symbol;
                *below = self.last_symbol >> 4;
            } else {
                self.predictions = *below;
            }
        }
        let outside = || "a block is predicted from one outside of the image".to_owned();
        let endpoint = match self.predictions & 3 {
            0 if column > 0 => self.left,
            1 if row > 0 => self.above[column],
            2 if column > 0 && row > 0 => self.above_left,
            3 => {
                let stepped = self.left + book.endpoint_step.next(bits)? as usize;
                // Once around the list at most.
                if stepped >= book.endpoints.len() { stepped - book.endpoints.len() } else { stepped }
            }
            _ => return Err(outside()),
        };
        self.predictions >>= 2;
        self.above_left = std::mem::replace(&mut self.above[column], endpoint);
        self.left = endpoint;
        Ok(endpoint)
    }
}

/// Which pattern the blocks have: one of the list, or one that was used shortly before.
struct Selectors<'a> {
    book: &'a Codebook,
    /// Used before; those that are used again move to the front half.
    history: Vec<usize>,
    next: usize,
    run: u32,
}

impl<'a> Selectors<'a> {
    fn new(book: &'a Codebook) -> Self {
        Self { book, history: vec![0; book.history], next: book.history / 2, run: 0 }
    }

    fn next(&mut self, bits: &mut Bits<'_>) -> Result<usize, String> {
        let count = self.book.selectors.len();
        let place = if self.run > 0 {
            self.run -= 1;
            0
        } else {
            let symbol = self.book.selector.next(bits)? as usize;
            let Some(place) = symbol.checked_sub(count) else {
                self.add(symbol);
                return Ok(symbol);
            };
            if place == self.history.len() {
                // This block is the first of at least three.
                self.run = match self.book.run.next(bits)? {
                    63 => bits.variable(7)?.saturating_add(2),
                    run => run + 2,
                };
                0
            } else {
                place
            }
        };
        let selector = *self.history.get(place).ok_or("a block names a pattern of a list that is shorter")?;
        self.history.swap(place, place / 2);
        Ok(selector)
    }

    fn add(&mut self, selector: usize) {
        if let Some(slot) = self.history.get_mut(self.next) {
            *slot = selector;
            self.next += 1;
            if self.next == self.history.len() {
                self.next /= 2;
            }
        }
    }
}

fn texels(endpoint: Endpoint, selectors: [u8; 4]) -> Block {
    let base = endpoint.color.map(|v| i16::from(v << 3 | v >> 2));
    let steps = INTENSITIES[usize::from(endpoint.intensity & 7)];
    let palette = steps.map(|step| {
        let [r, g, b] = base.map(|v| (v + step).clamp(0, 255) as u8);
        [r, g, b, 255]
    });
    std::array::from_fn(|i| palette[usize::from(selectors[i / 4] >> (i % 4 * 2) & 3)])
}
