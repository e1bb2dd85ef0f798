//! Images, samplers and textures. In: textures of the document as materials ask for them. Out: the lists of the file.
//! An image is written as the file that it was read from, byte for byte, else as PNG.

use std::collections::HashMap;
use std::sync::Arc;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::foreign::Sources;
use super::json::{Extensions, Object, Pool, Put};
use crate::assets::{Sampler, Texture, Wrap};
use crate::document::Document;
use crate::ids::TextureId;

/// What is collected.
pub(super) struct Textures<'a> {
    document: &'a Document,
    /// What is said of each image, and its bytes.
    images: Vec<(Object, Arc<[u8]>)>,
    places: HashMap<(String, Arc<[u8]>), usize>,
    samplers: Pool,
    textures: Pool,
    /// Names of textures that are not there.
    pub missing: Vec<String>,
}

/// The finished lists.
pub(super) struct TextureLists {
    pub images: Vec<Value>,
    pub samplers: Vec<Value>,
    pub textures: Vec<Value>,
}

impl<'a> Textures<'a> {
    pub fn new(document: &'a Document) -> Self {
        Self {
            document,
            images: Vec::new(),
            places: HashMap::new(),
            samplers: Pool::default(),
            textures: Pool::default(),
            missing: Vec::new(),
        }
    }

    /// The place of a texture in the file; `None` when the document does not have it.
    pub fn place(&mut self, id: TextureId, sources: &Sources<'_>, used: &mut Extensions) -> Option<usize> {
        let texture = self.document.texture(id)?;
        let kept = sources.texture(id);
        let mut object = Object::new();
        let mut own = Object::new();
        if let Some((prefab, kept)) = kept {
            own.put_text("name", &kept.sampler_name);
            sources.put(&mut own, Some((prefab, &kept.sampler)), Object::new(), used);
            object.put_text("name", &kept.name);
        }
        if texture.sampler != Sampler::default() || !own.is_empty() {
            let mut sampler = sampler(&texture.sampler);
            sampler.extend(own);
            object.put("sampler", self.samplers.place(sampler));
        }
        let mut image = Object::new();
        image.put_text("name", &texture.name);
        sources.put(&mut image, kept.map(|(prefab, kept)| (prefab, &kept.image)), Object::new(), used);
        match self.image(texture, image) {
            Some(image) => object.put("source", image),
            None => {
                self.missing.push(texture.name.clone());
                // There is no image to have the name.
                if !object.contains_key("name") {
                    object.put_text("name", &texture.name);
                }
            }
        }
        sources.put(&mut object, kept.map(|(prefab, kept)| (prefab, &kept.unknown)), Object::new(), used);
        Some(self.textures.place(object))
    }

    fn image(&mut self, texture: &Texture, image: Object) -> Option<usize> {
        if texture.placeholder {
            return None;
        }
        let bytes = texture.encoded.clone().or_else(|| png(texture))?;
        let next = self.images.len();
        let key = (Value::Object(image.clone()).to_string(), bytes);
        Some(*self.places.entry(key).or_insert_with_key(|(_, bytes)| {
            self.images.push((image, Arc::clone(bytes)));
            next
        }))
    }

    /// The lists; the images go into the buffer.
    pub fn finish(self, buffer: &mut Buffer) -> TextureLists {
        let mut images = Vec::with_capacity(self.images.len());
        for (mut image, bytes) in self.images {
            let is_png = bytes.starts_with(b"\x89PNG");
            image.put("mimeType", if is_png { "image/png" } else { "image/jpeg" });
            image.put("bufferView", buffer.view(&bytes, Use::Other));
            images.push(Value::Object(image));
        }
        TextureLists { images, samplers: self.samplers.into_list(), textures: self.textures.into_list() }
    }
}

/// `None` when the texels do not fill the image, which no import makes.
fn png(texture: &Texture) -> Option<Arc<[u8]>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&texture.rgba8, texture.width, texture.height, ExtendedColorType::Rgba8)
        .ok()?;
    Some(bytes.into())
}

fn sampler(sampler: &Sampler) -> Object {
    let wrap = |wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    };
    let min = match (sampler.min_linear, sampler.mip_linear, sampler.mipmaps) {
        (false, _, false) => 9728,
        (true, _, false) => 9729,
        (false, false, true) => 9984,
        (true, false, true) => 9985,
        (false, true, true) => 9986,
        (true, true, true) => 9987,
    };
    let mut object = Object::new();
    object.put("magFilter", if sampler.mag_linear { 9729 } else { 9728 });
    object.put("minFilter", min);
    object.put("wrapS", wrap(sampler.wrap_u));
    object.put("wrapT", wrap(sampler.wrap_v));
    object
}
