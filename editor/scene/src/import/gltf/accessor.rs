//! Accessors: typed views into buffers. All are checked once against the bytes that exist; reading then
//! cannot leave them. In: JSON and buffers. Out: floats and indices, whatever the file stored.
//! Format: glTF 2.0, section 3.6.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::hash::Hash;
use std::sync::{Arc, Mutex, PoisonError};

use super::buffers::Buffers;
use super::check::Counts;
use super::compressed;
use super::json::{Fault, Item};
use crate::foreign::Numbers;
use crate::import::room::Room;
use crate::import::short;

/// Most elements of an accessor that no bytes stand behind.
const MAX_UNBACKED_COUNT: usize = 1 << 24;

/// Type of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn read(item: &Item<'_>) -> Result<Self, Fault> {
        match item.required_size("componentType")? {
            5120 => Ok(Self::I8),
            5121 => Ok(Self::U8),
            5122 => Ok(Self::I16),
            5123 => Ok(Self::U16),
            5125 => Ok(Self::U32),
            5126 => Ok(Self::F32),
            other => Err(item.fault(format!("component type {other} does not exist"))),
        }
    }

    /// Number of the format for it.
    const fn code(self) -> u32 {
        match self {
            Self::I8 => 5120,
            Self::U8 => 5121,
            Self::I16 => 5122,
            Self::U16 => 5123,
            Self::U32 => 5125,
            Self::F32 => 5126,
        }
    }

    pub const fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// A run of bytes in a buffer with a step, checked against it.
#[derive(Clone, Copy, Debug)]
struct Span {
    buffer: usize,
    start: usize,
    stride: usize,
}

#[derive(Clone, Copy, Debug)]
struct Sparse {
    count: usize,
    indices: Span,
    index_component: Component,
    values: Span,
}

/// One accessor.
#[derive(Clone, Debug)]
pub(super) struct Accessor {
    pub component: Component,
    /// Components in an element: 1 to 4, or 4, 9, 16 for matrices.
    pub width: usize,
    pub is_matrix: bool,
    pub normalized: bool,
    pub count: usize,
    span: Option<Span>,
    sparse: Option<Sparse>,
    place: String,
}

impl Accessor {
    /// Whether there are bytes behind it; without, all elements are zero.
    pub fn has_data(&self) -> bool {
        self.span.is_some() || self.sparse.is_some()
    }

    /// The floats that the bytes of an element stand for.
    fn floats_of(&self, element: &[u8]) -> impl Iterator<Item = f32> {
        let (component, normalized) = (self.component, self.normalized);
        element.chunks_exact(component.bytes()).map(move |bytes| float(component, normalized, bytes))
    }

    /// Bytes of all elements.
    pub fn byte_length(&self) -> usize {
        self.count.saturating_mul(self.width * self.component.bytes())
    }

    /// Stands on a whole buffer of [`Self::byte_length`] bytes from now on.
    pub fn stand_on(&mut self, buffer: usize) {
        self.span = Some(Span { buffer, start: 0, stride: self.width * self.component.bytes() });
        self.sparse = None;
    }
}

/// All accessors of a file with the bytes that they look at.
pub(super) struct Accessors<'a> {
    buffers: &'a Buffers,
    list: Vec<Accessor>,
    flat: Made<usize, f32>,
    plain: Made<(usize, bool), u8>,
}

/// Lists that several share, by what they are made from.
type Made<K, T> = Mutex<HashMap<K, Arc<[T]>>>;

/// The list of this key, made by the first who asks; others wait, so that it is counted once.
fn once<K: Hash + Eq, T>(
    made: &Made<K, T>,
    key: K,
    make: impl FnOnce() -> Result<Vec<T>, Fault>,
) -> Result<Arc<[T]>, Fault> {
    let mut made = made.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(match made.entry(key) {
        Entry::Occupied(known) => Arc::clone(known.get()),
        Entry::Vacant(place) => Arc::clone(place.insert(make()?.into())),
    })
}

/// A buffer view, checked against its buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub buffer: usize,
    pub start: usize,
    pub length: usize,
    stride: Option<usize>,
}

impl View {
    /// Its bytes.
    pub fn bytes(self, buffers: &Buffers) -> Option<&[u8]> {
        buffers.bytes(self.buffer).get(self.start..self.start + self.length)
    }
}

/// Reads and checks the buffer views; those that are compressed become buffers of their own.
pub(super) fn views(root: &Item<'_>, buffers: &mut Buffers, counts: &Counts) -> Result<Vec<View>, Fault> {
    let items = root.objects("bufferViews")?;
    let decoded = compressed::views(&items, buffers)?;
    let mut views = Vec::with_capacity(items.len());
    for (item, decoded) in items.iter().zip(decoded) {
        let (buffer, start) = match decoded {
            Some(bytes) => (buffers.push(bytes), 0),
            None => {
                let buffer = item.required_index("buffer", counts.buffers, "buffer")?;
                (buffer, item.size("byteOffset")?.unwrap_or(0))
            }
        };
        let length = item.required_size("byteLength")?;
        let available = buffers.bytes(buffer).len();
        let end = start.saturating_add(length);
        if end > available {
            let over = end - available;
            return Err(item.fault(format!("{over} bytes past the end of buffer {buffer}")));
        }
        let stride = item.size("byteStride")?;
        if let Some(stride) = stride
            && !((4..=252).contains(&stride) && stride % 4 == 0)
        {
            return Err(
                item.fault(format!("byteStride is {stride}, it has to be a multiple of 4 from 4 to 252"))
            );
        }
        views.push(View { buffer, start, length, stride });
    }
    Ok(views)
}

impl<'a> Accessors<'a> {
    /// Reads and checks all accessors; what Draco compressed becomes buffers of its own.
    pub fn read(root: &Item<'_>, buffers: &'a mut Buffers, views: &[View]) -> Result<Self, Fault> {
        let mut list: Vec<Accessor> =
            root.objects("accessors")?.iter().map(|item| accessor(item, views)).collect::<Result<_, _>>()?;
        compressed::primitives(root, buffers, views, &mut list)?;
        Ok(Self { buffers, list, flat: Made::default(), plain: Made::default() })
    }

    /// The bytes of the file, and what was decompressed of it.
    pub fn buffers(&self) -> &'a Buffers {
        self.buffers
    }

    /// An accessor by index; the index was checked.
    pub fn get(&self, index: usize) -> Result<&Accessor, Fault> {
        self.list.get(index).ok_or_else(|| Fault::new("/accessors", format!("there is no accessor {index}")))
    }

    /// What the file may still take in memory, asked for what is at `place`.
    pub fn take(&self, count: usize, size: usize, place: &str) -> Result<(), Fault> {
        self.buffers.room().take(count, size).map_err(|no_room| Fault::new(place, no_room.to_string()))
    }

    /// What the file may still take in memory.
    pub const fn room(&self) -> &'a Room {
        self.buffers.room()
    }

    /// The elements as `N` floats each: integers are converted as `normalized` says, missing components are
    /// `fill`.
    pub fn floats<const N: usize>(&self, index: usize, fill: f32) -> Result<Vec<[f32; N]>, Fault> {
        let accessor = self.get(index)?;
        let mut zero = [fill; N];
        zero.iter_mut().take(accessor.width).for_each(|v| *v = 0.0);
        self.elements(accessor, zero, |element| {
            let mut out = [fill; N];
            out.iter_mut().zip(accessor.floats_of(element)).for_each(|(to, from)| *to = from);
            out
        })
    }

    /// The elements as floats, one after the other; each list is made once for all who ask.
    pub fn flat_floats(&self, index: usize) -> Result<Arc<[f32]>, Fault> {
        let accessor = self.get(index)?;
        once(&self.flat, index, || {
            let length = accessor.count.saturating_mul(accessor.width);
            self.take(length, size_of::<f32>(), &accessor.place)?;
            let mut floats = vec![0.0; length];
            self.each(accessor, |at, element| {
                let own = floats.iter_mut().skip(at * accessor.width);
                own.zip(accessor.floats_of(element)).for_each(|(to, from)| *to = from);
            })?;
            Ok(floats)
        })
    }

    /// The elements of four unsigned components each.
    pub fn quadruples(&self, index: usize) -> Result<Vec<[u32; 4]>, Fault> {
        let accessor = self.get(index)?;
        let component = accessor.component;
        self.elements(accessor, [0; 4], |element| {
            let mut out = [0; 4];
            for (to, from) in out.iter_mut().zip(element.chunks_exact(component.bytes())) {
                *to = whole(component, from);
            }
            out
        })
    }

    /// The elements as whole numbers that are not negative.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, Fault> {
        let accessor = self.get(index)?;
        let unsigned = matches!(accessor.component, Component::U8 | Component::U16 | Component::U32);
        if accessor.width != 1 || !unsigned {
            return Err(Fault::new(&accessor.place, "vertex indices have to be unsigned scalars"));
        }
        let component = accessor.component;
        self.elements(accessor, 0, |element| whole(component, element))
    }

    /// The elements as they stand in the file; `as_floats`: as the floats that they stand for. They are made once for all
    /// who ask.
    pub fn numbers(&self, index: usize, as_floats: bool) -> Result<Numbers, Fault> {
        let accessor = self.get(index)?;
        let kind = match (accessor.width, accessor.is_matrix) {
            (1, _) => "SCALAR",
            (2, _) => "VEC2",
            (3, _) => "VEC3",
            (4, false) => "VEC4",
            (4, true) => "MAT2",
            (9, _) => "MAT3",
            _ => "MAT4",
        };
        Ok(Numbers {
            component: if as_floats { Component::F32.code() } else { accessor.component.code() },
            kind,
            normalized: accessor.normalized && !as_floats,
            count: accessor.count,
            bytes: once(&self.plain, (index, as_floats), || self.bytes(accessor, as_floats))?,
        })
    }

    fn bytes(&self, accessor: &Accessor, as_floats: bool) -> Result<Vec<u8>, Fault> {
        let component = if as_floats { Component::F32 } else { accessor.component };
        let size = accessor.width * component.bytes();
        self.take(accessor.count, size, &accessor.place)?;
        let mut bytes = vec![0; accessor.count.saturating_mul(size)];
        self.each(accessor, |at, element| {
            let own = bytes.iter_mut().skip(at * size).take(size);
            if as_floats {
                let floats = accessor.floats_of(element).flat_map(f32::to_le_bytes);
                own.zip(floats).for_each(|(to, from)| *to = from);
            } else {
                own.zip(element).for_each(|(to, from)| *to = *from);
            }
        })?;
        Ok(bytes)
    }

    fn elements<T: Copy>(
        &self,
        accessor: &Accessor,
        zero: T,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        self.take(accessor.count, size_of::<T>(), &accessor.place)?;
        let mut elements = vec![zero; accessor.count];
        self.each(accessor, |at, element| {
            elements.get_mut(at).into_iter().for_each(|to| *to = read(element));
        })?;
        Ok(elements)
    }

    /// Gives each element that is not zero with its place; what a sparse accessor replaces comes twice.
    fn each(&self, accessor: &Accessor, mut put: impl FnMut(usize, &[u8])) -> Result<(), Fault> {
        let size = accessor.width * accessor.component.bytes();
        if let Some(span) = accessor.span {
            let mut count = 0;
            for element in self.chunks(span, size, accessor.count) {
                put(count, element);
                count += 1;
            }
            if count != accessor.count {
                return Err(Fault::new(&accessor.place, "it reaches past its buffer"));
            }
        }
        let Some(sparse) = accessor.sparse else {
            return Ok(());
        };
        let index_size = sparse.index_component.bytes();
        let indices = self.chunks(sparse.indices, index_size, sparse.count);
        let values = self.chunks(sparse.values, size, sparse.count);
        let mut next = 0;
        for (index, value) in indices.zip(values) {
            let index = whole(sparse.index_component, index) as usize;
            let fault = |reason: &str| Fault::new(format!("{}/sparse", accessor.place), reason);
            if index < next {
                return Err(fault("the indices do not grow"));
            }
            if index >= accessor.count {
                return Err(fault("an index lies past the end"));
            }
            next = index + 1;
            put(index, value);
        }
        Ok(())
    }

    fn chunks(&self, span: Span, size: usize, count: usize) -> impl Iterator<Item = &'a [u8]> {
        let bytes = self.buffers.bytes(span.buffer);
        (0..count).map_while(move |i| {
            let start = span.start + i * span.stride;
            bytes.get(start..start + size)
        })
    }
}

fn accessor(item: &Item<'_>, views: &[View]) -> Result<Accessor, Fault> {
    let component = Component::read(item)?;
    let kind = item.text("type")?.ok_or_else(|| item.fault("\"type\" is missing"))?;
    let (width, is_matrix) = match kind {
        "SCALAR" => (1, false),
        "VEC2" => (2, false),
        "VEC3" => (3, false),
        "VEC4" => (4, false),
        "MAT2" => (4, true),
        "MAT3" => (9, true),
        "MAT4" => (16, true),
        other => return Err(item.fault(format!("type {} does not exist", short(other)))),
    };
    let count = item.required_size("count")?;
    if count == 0 {
        return Err(item.fault("its count is 0, it has to be at least 1"));
    }
    let element = width * component.bytes();
    let view = item.index("bufferView", views.len(), "buffer view")?;
    let span = match view {
        None => None,
        Some(view) => Some(span(item, views, view, element, count)?),
    };
    if span.is_none() && count > MAX_UNBACKED_COUNT {
        return Err(item.fault(format!("it has {count} elements and no data")));
    }
    let sparse = match item.child("sparse")? {
        None => None,
        Some(sparse) => Some(read_sparse(&sparse, views, element, count)?),
    };
    Ok(Accessor {
        component,
        width,
        is_matrix,
        normalized: item.bool_or("normalized", false)?,
        count,
        span,
        sparse,
        place: item.place().to_owned(),
    })
}

fn read_sparse(sparse: &Item<'_>, views: &[View], element: usize, total: usize) -> Result<Sparse, Fault> {
    let count = sparse.required_size("count")?;
    if count == 0 || count > total {
        return Err(sparse.fault(format!("its count is {count}, the accessor has {total} elements")));
    }
    let missing = |key: &str| sparse.fault(format!("\"{key}\" is missing"));
    let indices = sparse.child("indices")?.ok_or_else(|| missing("indices"))?;
    let values = sparse.child("values")?.ok_or_else(|| missing("values"))?;
    let index_component = Component::read(&indices)?;
    if !matches!(index_component, Component::U8 | Component::U16 | Component::U32) {
        return Err(indices.fault("the indices have to be unsigned"));
    }
    let view_of = |item: &Item<'_>| item.required_index("bufferView", views.len(), "buffer view");
    let index_view = view_of(&indices)?;
    let value_view = view_of(&values)?;
    Ok(Sparse {
        count,
        indices: span(&indices, views, index_view, index_component.bytes(), count)?,
        index_component,
        values: span(&values, views, value_view, element, count)?,
    })
}

/// Where `count` elements of `element` bytes are, checked against the buffer view.
fn span(item: &Item<'_>, views: &[View], index: usize, element: usize, count: usize) -> Result<Span, Fault> {
    let Some(view) = views.get(index) else {
        return Err(item.fault(format!("there is no buffer view {index}")));
    };
    let offset = item.size("byteOffset")?.unwrap_or(0);
    let stride = view.stride.unwrap_or(element);
    if stride < element {
        return Err(item.fault(format!(
            "an element has {element} bytes, the stride of buffer view {index} is {stride}"
        )));
    }
    let end = (count - 1)
        .checked_mul(stride)
        .and_then(|bytes| bytes.checked_add(element))
        .and_then(|bytes| bytes.checked_add(offset))
        .unwrap_or(usize::MAX);
    if end > view.length {
        let over = end - view.length;
        return Err(item.fault(format!("{over} bytes past the end of bufferView {index}")));
    }
    Ok(Span { buffer: view.buffer, start: view.start + offset, stride })
}

/// Conversion of normalised integers as in glTF 2.0, section 3.6.2.2.
fn float(component: Component, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, largest) = match (component, bytes) {
        (Component::I8, &[a]) => (f32::from(a as i8), 127.0),
        (Component::U8, &[a]) => (f32::from(a), 255.0),
        (Component::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (Component::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (Component::U32, &[a, b, c, d]) => (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32),
        (Component::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        _ => return 0.0,
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn whole(component: Component, bytes: &[u8]) -> u32 {
    match (component, bytes) {
        (Component::U8, &[a]) => u32::from(a),
        (Component::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (Component::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}
