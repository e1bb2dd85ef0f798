//! Textures: one for each image, sampler and colour space that a material asks for.
//! In: JSON, buffers, the wishes of the materials. Out: decoded textures; a bad image becomes a checker and
//! a warning.

use std::collections::HashMap;
use std::path::Path;

use rayon::prelude::*;

use super::super::image::{Pixels, decode, placeholder};
use super::accessor::View;
use super::buffers::{Buffers, read_image_uri};
use super::json::{Fault, Item};
use crate::assets::{Sampler, Texture, Wrap};
use crate::ids::TextureId;

/// What one texture of the scene is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    image: Option<usize>,
    sampler: Sampler,
    srgb: bool,
}

/// Collects what materials ask for, in order of first use.
pub(super) struct TextureTable {
    /// Image and sampler of each glTF texture.
    sources: Vec<(Option<usize>, Sampler, String)>,
    ids: HashMap<Key, TextureId>,
    wanted: Vec<(Key, String)>,
}

impl TextureTable {
    pub fn read(root: &Item<'_>) -> Result<Self, Fault> {
        let samplers: Vec<Sampler> =
            root.objects("samplers")?.iter().map(read_sampler).collect::<Result<_, _>>()?;
        let images = root.objects("images")?.len();
        let mut sources = Vec::new();
        for texture in root.objects("textures")? {
            let image = texture.index("source", images, "image")?;
            let sampler = texture.index("sampler", samplers.len(), "sampler")?;
            let sampler = sampler.and_then(|s| samplers.get(s)).copied();
            sources.push((image, sampler.unwrap_or_default(), texture.place().to_owned()));
        }
        Ok(Self { sources, ids: HashMap::new(), wanted: Vec::new() })
    }

    /// Number of textures in the file.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// The id of a glTF texture read as colour (`srgb`) or as data.
    pub fn want(&mut self, texture: usize, srgb: bool) -> TextureId {
        let (image, sampler, place) = match self.sources.get(texture) {
            Some((image, sampler, place)) => (*image, *sampler, place.clone()),
            None => (None, Sampler::default(), format!("/textures/{texture}")),
        };
        let key = Key { image, sampler, srgb };
        let next = TextureId(self.wanted.len() as u64);
        *self.ids.entry(key).or_insert_with(|| {
            self.wanted.push((key, place));
            next
        })
    }

    /// Decodes every image that is used, each once, on all cores.
    pub fn load(
        self,
        root: &Item<'_>,
        buffers: &Buffers,
        views: &[View],
        folder: &Path,
        max_extent_px: u32,
    ) -> Result<(Vec<Texture>, Vec<Fault>), Fault> {
        let images = root.objects("images")?;
        let mut used: Vec<usize> = self.wanted.iter().filter_map(|(key, _)| key.image).collect();
        used.sort_unstable();
        used.dedup();
        let decoded: HashMap<usize, Result<Pixels, String>> = used
            .into_par_iter()
            .filter_map(|index| {
                let image = images.get(index)?;
                let pixels =
                    encoded(image, buffers, views, folder).and_then(|bytes| decode(bytes, max_extent_px));
                Some((index, pixels))
            })
            .collect();
        let mut warnings: Vec<Fault> = decoded
            .iter()
            .filter_map(|(index, pixels)| {
                let reason = pixels.as_ref().err()?;
                let place = format!("/images/{index}");
                let text = format!("the image cannot be read ({reason}); a checker stands in");
                Some(Fault::new(place, text))
            })
            .collect();
        warnings.sort_by(|a, b| a.place.cmp(&b.place));
        let stand_in = placeholder();
        let mut textures = Vec::with_capacity(self.wanted.len());
        for (key, place) in self.wanted {
            if key.image.is_none() {
                let reason = "the texture has no image that can be read; a checker stands in";
                warnings.push(Fault::new(place, reason));
            }
            let pixels = key
                .image
                .and_then(|index| decoded.get(&index))
                .and_then(|pixels| pixels.as_ref().ok())
                .unwrap_or(&stand_in);
            let item = key.image.and_then(|index| images.get(index));
            textures.push(Texture {
                name: image_name(item)?,
                width: pixels.width,
                height: pixels.height,
                rgba8: pixels.rgba8.clone(),
                srgb: key.srgb,
                sampler: key.sampler,
                placeholder: pixels.placeholder,
                encoded: pixels.encoded.clone(),
            });
        }
        Ok((textures, warnings))
    }
}

fn image_name(image: Option<&Item<'_>>) -> Result<String, Fault> {
    let Some(image) = image else {
        return Ok(String::new());
    };
    let name = image.name()?;
    let uri = image.text("uri")?.filter(|uri| !uri.starts_with("data:"));
    Ok(match (name.is_empty(), uri) {
        (true, Some(uri)) => uri.to_owned(),
        _ => name,
    })
}

/// The bytes of an image file, wherever they are.
fn encoded(image: &Item<'_>, buffers: &Buffers, views: &[View], folder: &Path) -> Result<Vec<u8>, String> {
    let in_words = |fault: Fault| fault.reason;
    if let Some(index) = image.index("bufferView", views.len(), "buffer view").map_err(in_words)? {
        let bytes = views
            .get(index)
            .and_then(|view| buffers.bytes(view.buffer).get(view.start..view.start + view.length));
        return bytes.map(<[u8]>::to_vec).ok_or_else(|| format!("there is no buffer view {index}"));
    }
    match image.text("uri").map_err(in_words)? {
        Some(uri) => read_image_uri(uri, folder),
        None => Err("it has neither a URI nor a buffer view".to_owned()),
    }
}

fn read_sampler(item: &Item<'_>) -> Result<Sampler, Fault> {
    let wrap = |key| {
        Ok(match item.size(key)? {
            Some(33071) => Wrap::ClampToEdge,
            Some(33648) => Wrap::MirroredRepeat,
            None | Some(10497) => Wrap::Repeat,
            Some(other) => return Err(item.fault(format!("{key} {other} does not exist"))),
        })
    };
    let mag_linear = match item.size("magFilter")? {
        None | Some(9729) => true,
        Some(9728) => false,
        Some(other) => return Err(item.fault(format!("magFilter {other} does not exist"))),
    };
    // (minification, choice of level, levels in use)
    let (min_linear, mip_linear, mipmaps) = match item.size("minFilter")? {
        Some(9728) => (false, false, false),
        Some(9729) => (true, false, false),
        Some(9984) => (false, false, true),
        Some(9985) => (true, false, true),
        Some(9986) => (false, true, true),
        None | Some(9987) => (true, true, true),
        Some(other) => return Err(item.fault(format!("minFilter {other} does not exist"))),
    };
    Ok(Sampler {
        wrap_u: wrap("wrapS")?,
        wrap_v: wrap("wrapT")?,
        mag_linear,
        min_linear,
        mip_linear,
        mipmaps,
    })
}
