//! Geometry that a file holds in compressed form: buffer views by meshoptimizer, primitives by Draco.
//! In: JSON and buffers. Out: the bytes that the file would have without compression; from there on nothing knows of it.
//! What a file claims to become is held against its size before anything is decoded.
//! Formats: `EXT_meshopt_compression`, `KHR_meshopt_compression`, `KHR_draco_mesh_compression`.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh as DracoMesh, MeshDecoder};
use rayon::prelude::*;

use super::super::meshopt;
use super::accessor::{Accessor, Component, View};
use super::buffers::Buffers;
use super::json::{Fault, Item};

/// Most bytes that the attributes of a vertex in a Draco stream may have.
const MAX_VERTEX_BYTES: u64 = 512;

/// The meshopt extension of a buffer or buffer view; the ratified name is looked at first.
pub(super) fn extension<'a>(item: &Item<'a>) -> Result<Option<Item<'a>>, Fault> {
    match item.extension("KHR_meshopt_compression")? {
        Some(extension) => Ok(Some(extension)),
        None => item.extension("EXT_meshopt_compression"),
    }
}

/// Bytes of all streams of a codec that a file names.
pub(super) fn stream_bytes(root: &Item<'_>) -> Result<usize, Fault> {
    let items = root.objects("bufferViews")?;
    let mut bytes = 0_usize;
    for item in &items {
        let length = extension(item)?.map(|extension| extension.size("byteLength")).transpose()?.flatten();
        bytes = bytes.saturating_add(length.unwrap_or(0));
    }
    for mesh in root.objects("meshes")? {
        for primitive in mesh.objects("primitives")? {
            let Some(extension) = primitive.extension("KHR_draco_mesh_compression")? else { continue };
            let view = extension.index("bufferView", items.len(), "buffer view")?.and_then(|i| items.get(i));
            let length = view.map(|view| view.size("byteLength")).transpose()?.flatten();
            bytes = bytes.saturating_add(length.unwrap_or(0));
        }
    }
    Ok(bytes)
}

fn take(buffers: &Buffers, item: &Item<'_>, bytes: usize) -> Result<(), Fault> {
    buffers.room().take(bytes, 1).map_err(|no_room| item.fault(format!("decompressed, {no_room}")))
}

/// The bytes of buffer views that are compressed; `None` for the others.
pub(super) fn views(items: &[Item<'_>], buffers: &Buffers) -> Result<Vec<Option<Vec<u8>>>, Fault> {
    let mut extensions = Vec::with_capacity(items.len());
    for item in items {
        let extension = extension(item)?;
        if extension.is_some() {
            take(buffers, item, item.required_size("byteLength")?)?;
        }
        extensions.push(extension);
    }
    let decode = |(item, extension): (&Item<'_>, Option<Item<'_>>)| {
        extension.map(|extension| view(item, &extension, buffers)).transpose()
    };
    items.par_iter().zip(extensions).map(decode).collect()
}

fn view(item: &Item<'_>, extension: &Item<'_>, buffers: &Buffers) -> Result<Vec<u8>, Fault> {
    let buffer = extension.required_size("buffer")?;
    let start = extension.size("byteOffset")?.unwrap_or(0);
    let end = start.saturating_add(extension.required_size("byteLength")?);
    let stream = buffers.bytes(buffer).get(start..end);
    let stream = stream.ok_or_else(|| extension.fault(format!("its bytes are not in buffer {buffer}")))?;
    let (count, stride) = (extension.required_size("count")?, extension.required_size("byteStride")?);
    if count.checked_mul(stride) != Some(item.required_size("byteLength")?) {
        let reason = format!("{count} elements of {stride} bytes are not the byteLength of its buffer view");
        return Err(extension.fault(reason));
    }
    if item.size("byteStride")?.is_some_and(|own| own != stride) {
        return Err(extension.fault("its byteStride is not that of its buffer view"));
    }
    let mode = extension.text("mode")?.ok_or_else(|| extension.fault("\"mode\" is missing"))?;
    let filter = extension.text("filter")?.unwrap_or("NONE");
    meshopt::decode(mode, filter, count, stride, stream).map_err(|reason| extension.fault(reason))
}

/// A primitive that is to be decoded.
struct Draco<'a> {
    extension: Item<'a>,
    view: View,
    vertices: usize,
    indices: usize,
    /// Id of the attribute in the stream, and the accessor that wants it.
    attributes: Vec<(u32, usize)>,
}

/// Puts what Draco compressed behind the accessors of its primitives. A primitive whose accessors all have bytes of
/// their own is left as it is.
pub(super) fn primitives(
    root: &Item<'_>,
    buffers: &mut Buffers,
    views: &[View],
    accessors: &mut [Accessor],
) -> Result<(), Fault> {
    let mut compressed = Vec::new();
    for mesh in root.objects("meshes")? {
        for primitive in mesh.objects("primitives")? {
            if let Some(extension) = primitive.extension("KHR_draco_mesh_compression")? {
                compressed.extend(read_primitive(&primitive, extension, buffers, views, accessors)?);
            }
        }
    }
    let decoded: Vec<Vec<(usize, Vec<u8>)>> = compressed
        .par_iter()
        .map(|primitive| primitive.decode(buffers, accessors))
        .collect::<Result<_, _>>()?;
    for (accessor, bytes) in decoded.into_iter().flatten() {
        let buffer = buffers.push(bytes);
        if let Some(accessor) = accessors.get_mut(accessor) {
            accessor.stand_on(buffer);
        }
    }
    Ok(())
}

fn read_primitive<'a>(
    primitive: &Item<'a>,
    extension: Item<'a>,
    buffers: &Buffers,
    views: &[View],
    accessors: &[Accessor],
) -> Result<Option<Draco<'a>>, Fault> {
    let missing = |key: &str| extension.fault(format!("\"{key}\" is missing"));
    let view = extension.required_index("bufferView", views.len(), "buffer view")?;
    let view = *views.get(view).ok_or_else(|| missing("bufferView"))?;
    let ids = extension.child("attributes")?.ok_or_else(|| missing("attributes"))?;
    let own = primitive.child("attributes")?.ok_or_else(|| missing("attributes"))?;
    let mut attributes = Vec::new();
    for name in ids.object()?.keys() {
        let id = ids.required_index(name, u32::MAX as usize, "attribute")? as u32;
        attributes.push((id, own.required_index(name, accessors.len(), "accessor")?));
    }
    let indices = primitive.required_index("indices", accessors.len(), "accessor")?;
    let wanted =
        || attributes.iter().map(|(_, accessor)| *accessor).chain([indices]).filter_map(|i| accessors.get(i));
    if wanted().all(Accessor::has_data) {
        return Ok(None);
    }
    if primitive.size("mode")?.unwrap_or(4) != 4 {
        return Err(extension.fault("of what Draco compressed only lists of triangles (mode 4) are read"));
    }
    let bytes = wanted().fold(0, |sum: usize, accessor| sum.saturating_add(accessor.byte_length()));
    take(buffers, &extension, bytes)?;
    let vertices = wanted().next().map_or(0, |accessor| accessor.count);
    Ok(Some(Draco { extension, view, vertices, indices, attributes }))
}

impl Draco<'_> {
    /// The bytes of each accessor.
    fn decode(&self, buffers: &Buffers, accessors: &[Accessor]) -> Result<Vec<(usize, Vec<u8>)>, Fault> {
        let get =
            |index: usize| accessors.get(index).ok_or_else(|| self.extension.fault("an accessor is missing"));
        let View { buffer, start, length, .. } = self.view;
        let stream = buffers.bytes(buffer).get(start..start + length).unwrap_or(&[]);
        let faces = get(self.indices)?.count / 3;
        let mesh = decode_draco(stream, self.vertices, faces, buffers.room().limit())
            .map_err(|reason| self.extension.fault(reason))?;
        if mesh.num_faces() != faces || mesh.num_points() != self.vertices {
            let reason = format!(
                "the stream has {} triangles and {} vertices, its accessors have {faces} and {}",
                mesh.num_faces(),
                mesh.num_points(),
                self.vertices
            );
            return Err(self.extension.fault(reason));
        }
        let corners = mesh.faces().iter().flatten().map(|point| f64::from(point.0));
        let mut decoded = vec![(self.indices, written(get(self.indices)?.component, corners))];
        for &(id, index) in &self.attributes {
            let accessor = get(index)?;
            let missing =
                || self.extension.fault(format!("the stream has no attribute {id} for accessor {index}"));
            let attribute = mesh.attribute_by_unique_id(id).ok_or_else(missing)?;
            if accessor.count != self.vertices || usize::from(attribute.num_components()) != accessor.width {
                let reason =
                    format!("attribute {id} of the stream has not the type or count of accessor {index}");
                return Err(self.extension.fault(reason));
            }
            let values = attribute.read_f32s(self.vertices, accessor.width);
            decoded.push((index, written(accessor.component, values.into_iter().map(f64::from))));
        }
        Ok(decoded)
    }
}

fn decode_draco(
    stream: &[u8],
    vertices: usize,
    faces: usize,
    most_bytes: usize,
) -> Result<DracoMesh, String> {
    let limits = DecodeLimits::default()
        .with_max_points(vertices as u64)
        .with_max_faces(faces as u64)
        .with_max_decoded_bytes((vertices as u64).saturating_mul(MAX_VERTEX_BYTES).min(most_bytes as u64));
    let mut mesh = DracoMesh::new();
    let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
    let reason = |error| format!("the Draco stream cannot be read: {error}");
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(reason)?;
    Ok(mesh)
}

/// Numbers as the bytes of an accessor; those of vertices and of 8 and 16 bits survive it.
fn written(component: Component, values: impl Iterator<Item = f64>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.size_hint().0 * component.bytes());
    for value in values {
        match component {
            Component::I8 => bytes.extend((value as i8).to_le_bytes()),
            Component::U8 => bytes.extend((value as u8).to_le_bytes()),
            Component::I16 => bytes.extend((value as i16).to_le_bytes()),
            Component::U16 => bytes.extend((value as u16).to_le_bytes()),
            Component::U32 => bytes.extend((value as u32).to_le_bytes()),
            Component::F32 => bytes.extend((value as f32).to_le_bytes()),
        }
    }
    bytes
}
