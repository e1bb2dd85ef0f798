//! Images, samplers and textures. In: textures of the document as materials ask for them. Out: the lists of the file.
//! An image is written as the file that it was read from, byte for byte, else as PNG.

use std::collections::HashMap;
use std::sync::Arc;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::json::{Object, Pool, Put};
use crate::assets::{Sampler, Texture, Wrap};
use crate::document::Document;
use crate::ids::TextureId;

/// What is collected.
pub(super) struct Textures<'a> {
    document: &'a Document,
    images: Vec<(String, Arc<[u8]>)>,
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
    pub fn place(&mut self, id: TextureId) -> Option<usize> {
        let texture = self.document.texture(id)?;
        let mut object = Object::new();
        if texture.sampler != Sampler::default() {
            object.put("sampler", self.samplers.place(sampler(&texture.sampler)));
        }
        match self.image(texture) {
            Some(image) => object.put("source", image),
            None => self.missing.push(texture.name.clone()),
        }
        Some(self.textures.place(object))
    }

    fn image(&mut self, texture: &Texture) -> Option<usize> {
        if texture.placeholder {
            return None;
        }
        let bytes = texture.encoded.clone().or_else(|| png(texture))?;
        let next = self.images.len();
        let key = (texture.name.clone(), bytes);
        Some(*self.places.entry(key).or_insert_with_key(|key| {
            self.images.push(key.clone());
            next
        }))
    }

    /// The lists; the images go into the buffer.
    pub fn finish(self, buffer: &mut Buffer) -> TextureLists {
        let mut images = Vec::with_capacity(self.images.len());
        for (name, bytes) in self.images {
            let mut image = Object::new();
            image.put_text("name", &name);
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
