//! Indices: triangles by edges and vertices used shortly before, and plain sequences by differences.
//! In: a stream. Out: indices, which may be any number: who uses them checks them against the vertices.
//! Format: `EXT_meshopt_compression`, appendix A, modes 1 and 2.

use super::Bytes;

const TRIANGLE_HEADER: u8 = 0xe1;
const SEQUENCE_HEADER: u8 = 0xd1;
/// Bytes of the table of common codes, at the end of a stream of triangles.
const TABLE_BYTES: usize = 16;
/// Bytes of padding at the end of a sequence.
const SEQUENCE_TAIL_BYTES: usize = 4;

/// The last 16 things that were seen.
struct Recent<T> {
    ring: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(empty: T) -> Self {
        Self { ring: [empty; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = value;
        }
        self.next = (self.next + 1) % 16;
    }

    /// The `age`-th before the last one, 0 to 15.
    fn get(&self, age: u8) -> T {
        self.ring[(self.next + 15 - usize::from(age)) % 16]
    }
}

struct Triangles<'a> {
    edges: Recent<(u32, u32)>,
    vertices: Recent<u32>,
    /// The next vertex that was never seen.
    next: u32,
    /// The last vertex that was given by its difference.
    last: u32,
    data: Bytes<'a>,
}

/// Three indices a triangle.
pub(super) fn triangles(count: usize, mut stream: Bytes<'_>) -> Result<Vec<u32>, String> {
    if !count.is_multiple_of(3) {
        return Err(format!("{count} indices are no triangles"));
    }
    stream.header(&[TRIANGLE_HEADER])?;
    let table = stream.tail(TABLE_BYTES)?;
    let codes = stream.take(count / 3)?;
    let mut state = Triangles {
        edges: Recent::new((u32::MAX, u32::MAX)),
        vertices: Recent::new(u32::MAX),
        next: 0,
        last: 0,
        data: stream,
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        let triangle = match code {
            0..0xf0 => state.beside_an_edge(code >> 4, code & 15)?,
            _ => state.apart(code, table)?,
        };
        indices.extend(triangle);
    }
    state.data.finish()?;
    Ok(indices)
}

impl Triangles<'_> {
    fn fresh(&mut self) -> u32 {
        let vertex = self.next;
        self.next = self.next.wrapping_add(1);
        vertex
    }

    fn by_difference(&mut self) -> Result<u32, String> {
        self.last = self.last.wrapping_add(signed(variable_length(&mut self.data)?));
        Ok(self.last)
    }

    fn beside_an_edge(&mut self, edge: u8, vertex: u8) -> Result<[u32; 3], String> {
        let (a, b) = self.edges.get(edge);
        let c = match vertex {
            0 => self.fresh(),
            1..13 => self.vertices.get(vertex),
            13 => self.neighbour(u32::MAX),
            14 => self.neighbour(1),
            _ => self.by_difference()?,
        };
        if !(1..13).contains(&vertex) {
            self.vertices.push(c);
        }
        self.edges.push((c, b));
        self.edges.push((a, c));
        Ok([a, b, c])
    }

    fn neighbour(&mut self, difference: u32) -> u32 {
        self.last = self.last.wrapping_add(difference);
        self.last
    }

    fn apart(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        let common = code < 0xfe;
        let pair = match table.get(usize::from(code & 15)).filter(|_| common) {
            Some(&pair) => pair,
            None => self.data.byte()?,
        };
        if !common && pair == 0 {
            self.next = 0;
        }
        let (second, third) = (pair >> 4, pair & 15);
        // All that come from elsewhere are looked up before the differences are read.
        let a = if code == 0xff { None } else { Some(self.fresh()) };
        let b = self.known(second);
        let c = self.known(third);
        let mut or_difference = |vertex: Option<u32>| vertex.map_or_else(|| self.by_difference(), Ok);
        let triangle = [or_difference(a)?, or_difference(b)?, or_difference(c)?];
        let [a, b, c] = triangle;
        self.vertices.push(a);
        for (code, vertex) in [(second, b), (third, c)] {
            if matches!(code, 0 | 15) {
                self.vertices.push(vertex);
            }
        }
        for edge in [(b, a), (c, b), (a, c)] {
            self.edges.push(edge);
        }
        Ok(triangle)
    }

    /// A vertex that is new or was seen shortly before; `None`: it is given by its difference.
    fn known(&mut self, code: u8) -> Option<u32> {
        match code {
            0 => Some(self.fresh()),
            15 => None,
            _ => Some(self.vertices.get(code - 1)),
        }
    }
}

/// Indices in any order, each a difference to one of two before it.
pub(super) fn sequence(count: usize, mut stream: Bytes<'_>) -> Result<Vec<u32>, String> {
    stream.header(&[SEQUENCE_HEADER])?;
    stream.tail(SEQUENCE_TAIL_BYTES)?;
    if stream.0.len() < count {
        return Err(super::CUT_OFF.to_owned());
    }
    let mut last = [0_u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let code = variable_length(&mut stream)?;
        let last = &mut last[code as usize & 1];
        *last = last.wrapping_add(signed(code >> 1));
        indices.push(*last);
    }
    stream.finish()?;
    Ok(indices)
}

/// Seven bits a byte, the lowest first; the uppermost bit says that more follow.
fn variable_length(data: &mut Bytes<'_>) -> Result<u32, String> {
    let mut value = 0;
    for shift in (0..35).step_by(7) {
        let byte = data.byte()?;
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Err("an index has more than 32 bits".to_owned())
}

/// A difference whose sign is its lowest bit.
fn signed(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}
