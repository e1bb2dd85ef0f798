//! Textures: one for each image, sampler and colour space that a material asks for.
//! In: JSON, buffers, the wishes of the materials. Out: decoded textures; a bad image becomes a checker and
//! a warning.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::super::image::placeholder;
use super::foreign::unknown;
use super::json::{Fault, Item};
use crate::assets::{Sampler, Texture, Wrap};
use crate::foreign::KeptTexture;
use crate::ids::TextureId;

mod images;

pub(super) use images::Images;

/// Extensions that give a texture an image in a format that glTF itself does not know.
const IMAGE_EXTENSIONS: [&str; 2] = ["KHR_texture_basisu", "EXT_texture_webp"];

/// What one texture of the scene is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    image: Option<usize>,
    /// What is shown if that image cannot be read.
    fallback: Option<usize>,
    sampler: Sampler,
    srgb: bool,
}

/// What a glTF texture is made from.
#[derive(Clone, Copy, Default)]
struct Source {
    image: Option<usize>,
    fallback: Option<usize>,
    sampler: Sampler,
    /// Place of the sampler in the file.
    sampler_item: Option<usize>,
}

/// Collects what materials ask for, in order of first use.
pub(super) struct TextureTable {
    /// Each glTF texture with its place.
    sources: Vec<(Source, String)>,
    ids: HashMap<Key, TextureId>,
    wanted: Vec<(Key, String)>,
    /// Which glTF texture each of these was made for first.
    first: Vec<usize>,
    used: BTreeSet<usize>,
}

impl TextureTable {
    pub fn read(root: &Item<'_>) -> Result<Self, Fault> {
        let samplers: Vec<Sampler> =
            root.objects("samplers")?.iter().map(read_sampler).collect::<Result<_, _>>()?;
        let images = root.objects("images")?.len();
        let mut sources = Vec::new();
        for texture in root.objects("textures")? {
            let plain = texture.index("source", images, "image")?;
            let mut extended = None;
            for name in IMAGE_EXTENSIONS {
                if let Some(extension) = texture.extension(name)? {
                    extended = extended.or(extension.index("source", images, "image")?);
                }
            }
            let sampler = texture.index("sampler", samplers.len(), "sampler")?;
            let sampler_item = sampler;
            let sampler = sampler.and_then(|s| samplers.get(s)).copied();
            let source = Source {
                image: extended.or(plain),
                fallback: plain.filter(|_| extended.is_some()),
                sampler: sampler.unwrap_or_default(),
                sampler_item,
            };
            sources.push((source, texture.place().to_owned()));
        }
        let (ids, wanted, first, used) = Default::default();
        Ok(Self { sources, ids, wanted, first, used })
    }

    /// Number of textures in the file.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// The id of a glTF texture read as colour (`srgb`) or as data.
    pub fn want(&mut self, texture: usize, srgb: bool) -> TextureId {
        self.used.insert(texture);
        let (Source { image, fallback, sampler, .. }, place) = match self.sources.get(texture) {
            Some((source, place)) => (*source, place.clone()),
            None => (Source::default(), format!("/textures/{texture}")),
        };
        let key = Key { image, fallback, sampler, srgb };
        let next = TextureId(self.wanted.len() as u64);
        *self.ids.entry(key).or_insert_with(|| {
            self.wanted.push((key, place));
            self.first.push(texture);
            next
        })
    }

    /// What is not read of the file, with its number.
    pub fn unused(&self) -> Option<(String, usize)> {
        let count = self.sources.len().saturating_sub(self.used.len());
        (count > 0).then(|| ("a texture that no material has".to_owned(), count))
    }

    /// What is not known of the textures that are used, and of their images and samplers.
    pub fn kept(&self, root: &Item<'_>) -> Result<BTreeMap<usize, KeptTexture>, Fault> {
        let (textures, images, samplers) =
            (root.objects("textures")?, root.objects("images")?, root.objects("samplers")?);
        let mut kept = BTreeMap::new();
        for (place, &texture) in self.first.iter().enumerate() {
            let Some((item, (source, _))) = textures.get(texture).zip(self.sources.get(texture)) else {
                continue;
            };
            let sampler = source.sampler_item.and_then(|index| samplers.get(index));
            let image = source.image.and_then(|index| images.get(index));
            let one = KeptTexture {
                name: item.name()?,
                unknown: unknown(item, &[]),
                image: image.map(|image| unknown(image, &[])).unwrap_or_default(),
                sampler_name: sampler.map_or_else(|| Ok(String::new()), Item::name)?,
                sampler: sampler.map(|sampler| unknown(sampler, &[])).unwrap_or_default(),
            };
            if one != KeptTexture::default() {
                kept.insert(place, one);
            }
        }
        Ok(kept)
    }

    /// Decodes every image that is used, each once, on all cores.
    pub fn load(self, root: &Item<'_>, mut images: Images<'_>) -> Result<(Vec<Texture>, Vec<Fault>), Fault> {
        let items = root.objects("textures")?;
        let keys = || self.wanted.iter().map(|(key, _)| key);
        let mut decoded = images.decode(keys().filter_map(|key| key.image).collect())?;
        let failed = |index: &usize| decoded.get(index).is_none_or(Result::is_err);
        let fallbacks =
            keys().filter(|key| key.image.as_ref().is_some_and(failed)).filter_map(|key| key.fallback);
        let fallbacks = fallbacks.collect();
        decoded.extend(images.decode(fallbacks)?);
        let read = |index: usize| decoded.get(&index)?.as_ref().ok().map(|pixels| (index, pixels));

        let mut warnings = Vec::new();
        let stand_in = placeholder();
        let mut textures = Vec::with_capacity(self.wanted.len());
        let replaced: BTreeSet<usize> =
            keys().filter(|key| key.fallback.and_then(read).is_some()).filter_map(|key| key.image).collect();
        for (index, pixels) in &decoded {
            let text = match pixels {
                Err(reason) => {
                    let instead = match replaced.contains(index) {
                        true => "the image for programs that do not know its format is shown",
                        false => "a checker stands in",
                    };
                    format!("the image cannot be read ({reason}); {instead}")
                }
                Ok(pixels) if pixels.of_print => {
                    "the image has the colours of print (CMYK), which glTF does not know; exports write it as PNG".to_owned()
                }
                Ok(_) => continue,
            };
            warnings.push(Fault::new(format!("/images/{index}"), text));
        }
        for ((key, place), first) in self.wanted.iter().zip(&self.first) {
            if key.image.is_none() {
                let reason = "the texture has no image that can be read; a checker stands in";
                warnings.push(Fault::new(place, reason));
            }
            let shown = key.image.and_then(read).or_else(|| key.fallback.and_then(read));
            let pixels = shown.map_or(&stand_in, |(_, pixels)| pixels);
            let item = shown.map(|(index, _)| index).or(key.image).and_then(|index| images.items.get(index));
            textures.push(Texture {
                name: item
                    .map(image_name)
                    .or(items.get(*first).map(Item::name))
                    .unwrap_or_else(|| Ok(String::new()))?,
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

fn image_name(image: &Item<'_>) -> Result<String, Fault> {
    let name = image.name()?;
    let uri = image.text("uri")?.filter(|uri| !uri.starts_with("data:"));
    Ok(match (name.is_empty(), uri) {
        (true, Some(uri)) => uri.to_owned(),
        _ => name,
    })
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
