//! The bytes of the file in the making: buffer views and accessors. Equal data is stored once.
//! In: numbers. Out: places of accessors, and in the end the lists and the bytes. Format: glTF 2.0, section 3.6.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use serde_json::Value;

use super::json::{Object, Pool, Put};
use crate::foreign::Numbers;

/// What a buffer view is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Use {
    /// Attributes of vertices. Data that is equal is one view for meshes that number their attribute sets alike, and two
    /// for two sets of one mesh, which would be read as one.
    Vertices { set: usize },
    /// Indices of triangles.
    Indices,
    /// The same with bytes from one to the next, which is said, as a view may come to be that of several accessors.
    Strided { set: usize, stride: usize },
    /// Key frames, matrices, images.
    Other,
}

impl Use {
    /// With the bytes from one vertex to the next.
    fn with_stride(self, stride: usize) -> Self {
        match self {
            Self::Vertices { set } => Self::Strided { set, stride },
            other => other,
        }
    }
}

/// Views, accessors and bytes.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    ranges: Vec<Range<usize>>,
    known: HashMap<(u64, Use), Vec<usize>>,
    accessors: Pool,
}

/// The finished lists.
pub(super) struct Lists {
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
}

impl Buffer {
    /// The view of some bytes.
    pub fn view(&mut self, bytes: &[u8], usage: Use) -> usize {
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        let known = self.known.entry((hasher.finish(), usage)).or_default();
        let same = |view: &&usize| {
            self.ranges.get(**view).and_then(|range| self.bytes.get(range.clone())) == Some(bytes)
        };
        if let Some(&view) = known.iter().find(same) {
            return view;
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        let mut view = Object::new();
        view.put("buffer", 0);
        view.put("byteOffset", start);
        view.put("byteLength", bytes.len());
        match usage {
            Use::Vertices { .. } => view.put("target", 34962),
            Use::Strided { stride, .. } => {
                view.put("byteStride", stride);
                view.put("target", 34962);
            }
            Use::Indices => view.put("target", 34963),
            Use::Other => {}
        }
        self.views.push(Value::Object(view));
        self.ranges.push(start..self.bytes.len());
        known.push(self.views.len() - 1);
        self.views.len() - 1
    }

    /// An accessor of floats. `bounds`: with the smallest and largest value of each component.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], bounds: bool, usage: Use) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, usage.with_stride(N * 4));
        self.float_accessor(values, bounds, Some(view))
    }

    /// An accessor of numbers as they were read. `bounds`: likewise.
    pub fn numbers(&mut self, numbers: &Numbers, bounds: bool, usage: Use) -> usize {
        let size = numbers.bytes.len() / numbers.count.max(1);
        let stride = size.next_multiple_of(4);
        let view = match usage {
            // Attributes start at multiples of 4: section 3.6.2.4.
            Use::Vertices { set } if stride != size => {
                let filled = |element: &[u8]| {
                    let mut filled = element.to_vec();
                    filled.resize(stride, 0);
                    filled
                };
                let bytes: Vec<u8> = numbers.bytes.chunks(size.max(1)).flat_map(filled).collect();
                self.view(&bytes, Use::Strided { set, stride })
            }
            _ => self.view(&numbers.bytes, usage.with_stride(size)),
        };
        let mut accessor = accessor(Some(view), numbers.component, numbers.kind, numbers.count);
        if numbers.normalized {
            accessor.put("normalized", true);
        }
        if bounds && numbers.component == 5126 {
            let elements = numbers.bytes.chunks(size.max(1)).map(|element| {
                element.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect::<Vec<_>>()
            });
            put_bounds(&mut accessor, elements);
        }
        self.accessors.place(accessor)
    }

    /// An accessor of zeros, which takes no bytes.
    pub fn zeros<const N: usize>(&mut self, count: usize, bounds: bool) -> usize {
        self.float_accessor(&vec![[0.0; N]; count], bounds, None)
    }

    fn float_accessor<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        bounds: bool,
        view: Option<usize>,
    ) -> usize {
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        let mut accessor = accessor(view, 5126, kind, values.len());
        if bounds {
            put_bounds(&mut accessor, values.iter().copied());
        }
        self.accessors.place(accessor)
    }

    /// An accessor of four joints a vertex.
    pub fn joints(&mut self, values: &[[u16; 4]], usage: Use) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, usage.with_stride(8));
        self.accessors.place(accessor(Some(view), 5123, "VEC4", values.len()))
    }

    /// An accessor of indices of triangles, 16 bits each where that is enough.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        // The largest number of a type is no index: section 3.7.2.1.
        let narrow = values.iter().all(|&index| index < u32::from(u16::MAX));
        let (bytes, component): (Vec<u8>, _) = match narrow {
            true => (values.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect(), 5123),
            false => (values.iter().flat_map(|index| index.to_le_bytes()).collect(), 5125),
        };
        let view = self.view(&bytes, Use::Indices);
        self.accessors.place(accessor(Some(view), component, "SCALAR", values.len()))
    }

    /// The lists; the bytes are filled up to a multiple of 4.
    pub fn finish(mut self) -> Lists {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        Lists { bytes: self.bytes, views: self.views, accessors: self.accessors.into_list() }
    }
}

/// The smallest and largest value of each component.
fn put_bounds<E: AsRef<[f32]> + AsMut<[f32]> + Clone>(
    accessor: &mut Object,
    mut elements: impl Iterator<Item = E>,
) {
    let Some(first) = elements.next() else { return };
    let (mut least, mut largest) = (first.clone(), first);
    for element in elements {
        for (a, b) in least.as_mut().iter_mut().zip(element.as_ref()) {
            *a = a.min(*b);
        }
        for (a, b) in largest.as_mut().iter_mut().zip(element.as_ref()) {
            *a = a.max(*b);
        }
    }
    // With all digits: they have to equal the bytes in double precision too.
    let wide =
        |values: &[f32]| -> Value { values.iter().map(|value| Value::from(f64::from(*value))).collect() };
    accessor.put("min", wide(least.as_ref()));
    accessor.put("max", wide(largest.as_ref()));
}

fn accessor(view: Option<usize>, component: u32, kind: &str, count: usize) -> Object {
    let mut accessor = Object::new();
    if let Some(view) = view {
        accessor.put("bufferView", view);
    }
    accessor.put("componentType", component);
    accessor.put("count", count);
    accessor.put("type", kind);
    accessor
}
