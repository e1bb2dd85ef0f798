//! The maps of MTL: options and file name of a line, the image behind it, and the textures that materials get.
//! In: what follows a key such as `map_Kd`. Out: texture uses; an image that cannot be read becomes a checker and a warning.
//! Options: <http://paulbourke.net/dataformats/mtl/>, "Options for texture map statements".

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::Vec2;

use super::Warnings;
use super::bake::{self, Baked, Channel};
use super::mtl::Rest;
use crate::assets::{Sampler, Texture, TextureUse, Wrap};
use crate::ids::TextureId;
use crate::import::gltf::buffers::read_file;
use crate::import::image::{Pixels, decode, placeholder, texel_bytes};
use crate::import::{ImportOptions, memory, short, uri};

/// Largest image file that is read, bytes.
const MAX_IMAGE_FILE_BYTES: u64 = 1 << 30;

/// A line that names an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub file: String,
    /// `-s`, `-o`: coordinates are multiplied by the first, then the second is added; v points up.
    scale: Vec2,
    offset: Vec2,
    /// `-clamp on`
    clamp: bool,
    /// `-bm`
    pub bump: f32,
    /// `-imfchan`
    pub channel: Option<Channel>,
}

/// What of an image a texture holds. Equal ones of the same images are one texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Content {
    /// sRGB colours as they are.
    Color,
    /// A normal map as it is.
    Normals,
    /// Normals from heights; the bits of the strength.
    Heights(Channel, u32),
    /// sRGB colours with the opacity of the second image.
    Opacity(Option<Channel>),
    /// Roughness in green from the first, metalness in blue from the second image. The bits of an exponent that the
    /// first is a factor of.
    Surface([Channel; 2], Option<u32>),
}

type Key = (Content, [Option<String>; 2], bool);

/// The images of a model and the textures made of them.
pub(super) struct Maps<'a> {
    folder: &'a Path,
    options: &'a ImportOptions,
    warnings: &'a Warnings,
    images: HashMap<PathBuf, Pixels>,
    /// What they take, bytes.
    taken: u64,
    known: HashMap<Key, (TextureId, bake::Alpha)>,
    pub textures: Vec<Texture>,
}

/// An image with the line that names it.
pub(super) struct Image {
    pub map: Map,
    pub pixels: Pixels,
}

impl<'a> Maps<'a> {
    pub fn new(folder: &'a Path, options: &'a ImportOptions, warnings: &'a Warnings) -> Self {
        let (images, known, taken) = Default::default();
        Self { folder, options, warnings, images, taken, known, textures: Vec::new() }
    }

    /// The image that a line names; `None` when it names none.
    pub fn image(&mut self, rest: Rest<'_>) -> Option<Image> {
        let (map, ignored) = match Map::parse(rest.text) {
            Ok(parsed) => parsed,
            Err(reason) => {
                rest.warn(format!("{reason}; the map is left out"), self.warnings);
                return None;
            }
        };
        if !ignored.is_empty() {
            rest.warn(format!("the options {} are left out", ignored.join(" ")), self.warnings);
        }
        let path = self.place(&map.file, &rest.folder());
        let known = path.as_ref().ok().and_then(|path| self.images.get(path)).cloned();
        let pixels = known.unwrap_or_else(|| {
            let read = path.and_then(|path| {
                let bytes = read_file(&path, MAX_IMAGE_FILE_BYTES)?;
                self.taken = self.taken.saturating_add(texel_bytes(&bytes, self.options.max_image_extent_px));
                let refusal = memory::refusal(self.taken, self.options.max_image_bytes);
                refusal.map_or(Ok(()), |reason| Err(format!("with the images before it, {reason}")))?;
                let pixels = decode(bytes, self.options.max_image_extent_px)?;
                self.images.insert(path, pixels.clone());
                Ok(pixels)
            });
            read.unwrap_or_else(|reason| {
                let text = format!("{} cannot be read ({reason}); a checker stands in", short(&map.file));
                rest.warn(text, self.warnings);
                placeholder()
            })
        });
        Some(Image { map, pixels })
    }

    /// Beside the library, else beside the model; from a library in a folder below, up to that of the model.
    fn place(&self, file: &str, library: &Path) -> Result<PathBuf, String> {
        let beside_library = uri::below(file, library, self.folder);
        if let Ok(path) = &beside_library
            && path.is_file()
        {
            return beside_library;
        }
        // What names no file beside the model either is told of where it is expected first.
        uri::beside(file, self.folder).or(beside_library)
    }

    /// Colours as they are.
    pub fn color(&mut self, image: &Image) -> TextureUse {
        self.texture(Content::Color, image, [Some(image), None], || None).0
    }

    /// A normal map as it is.
    pub fn normals(&mut self, image: &Image) -> TextureUse {
        self.texture(Content::Normals, image, [Some(image), None], || None).0
    }

    /// Normals from heights.
    pub fn heights(&mut self, image: &Image) -> TextureUse {
        let Map { bump, channel, clamp, .. } = image.map;
        let channel = channel.unwrap_or(Channel::Luminance);
        let make = || Some(bake::normals(&image.pixels, channel, bump, clamp));
        self.texture(Content::Heights(channel, bump.to_bits()), image, [Some(image), None], make).0
    }

    /// Colours, or white, with an opacity; and what opacities there are.
    pub fn with_opacity(&mut self, color: Option<&Image>, opacity: &Image) -> (TextureUse, bake::Alpha) {
        let channel = opacity.map.channel;
        let make = || Some(bake::opacity(color.map(|image| &image.pixels), &opacity.pixels, channel));
        self.texture(Content::Opacity(channel), color.unwrap_or(opacity), [color, Some(opacity)], make)
    }

    /// Roughness and metalness. With an exponent, the first image is a factor of it.
    pub fn surface(
        &mut self,
        roughness: Option<&Image>,
        metallic: Option<&Image>,
        exponent: Option<f32>,
    ) -> Option<TextureUse> {
        let either = roughness.or(metallic)?;
        let of =
            |image: Option<&Image>, otherwise| image.and_then(|image| image.map.channel).unwrap_or(otherwise);
        let first = if exponent.is_some() { Channel::Luminance } else { Channel::Green };
        let channels = [of(roughness, first), of(metallic, Channel::Blue)];
        let sources = [roughness, metallic].map(|image| image.map(|image| &image.pixels));
        let content = Content::Surface(channels, exponent.map(f32::to_bits));
        let make = || Some(bake::surface(sources, channels, exponent));
        Some(self.texture(content, either, [roughness, metallic], make).0)
    }

    /// A texture of these images, made when it is new; the first has the say about its transform.
    fn texture(
        &mut self,
        content: Content,
        first: &Image,
        images: [Option<&Image>; 2],
        make: impl FnOnce() -> Option<Baked>,
    ) -> (TextureUse, bake::Alpha) {
        let files = images.map(|image| image.map(|image| image.map.file.clone()));
        let name = files.iter().flatten().cloned().collect::<Vec<_>>().join(" + ");
        let key = (content, files, first.map.clamp);
        let next = TextureId(self.textures.len() as u64);
        let (id, alpha) = *self.known.entry(key).or_insert_with(|| {
            let Pixels { width, height, rgba8, encoded, .. } = first.pixels.clone();
            let as_read = Baked { width, height, rgba8, alpha: bake::Alpha::Full, encoded };
            let baked = make().unwrap_or(as_read);
            let wrap = if first.map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
            self.textures.push(Texture {
                name,
                width: baked.width,
                height: baked.height,
                rgba8: baked.rgba8,
                srgb: matches!(content, Content::Color | Content::Opacity(_)),
                sampler: Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() },
                placeholder: images.into_iter().flatten().any(|image| image.pixels.placeholder),
                encoded: baked.encoded,
            });
            (next, baked.alpha)
        });
        (first.map.texture_use(id), alpha)
    }
}

impl Map {
    /// Options and name of a file; the second list names options that change the picture and are left out.
    fn parse(text: &str) -> Result<(Self, Vec<&str>), String> {
        let mut map = Self {
            file: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            bump: 1.0,
            channel: None,
        };
        let mut ignored = Vec::new();
        let mut rest = text.trim();
        while rest.starts_with('-') {
            let option = word(&mut rest);
            match option {
                "-s" => map.scale = pair(&mut rest, map.scale),
                "-o" => map.offset = pair(&mut rest, map.offset),
                "-clamp" => map.clamp = word(&mut rest) == "on",
                "-bm" => map.bump = number(&mut rest).unwrap_or(map.bump),
                "-imfchan" => map.channel = Channel::of_letter(word(&mut rest)),
                "-blendu" | "-blendv" | "-cc" | "-boost" | "-texres" | "-type" => {
                    word(&mut rest);
                }
                "-mm" | "-t" => {
                    let given = pair(&mut rest, Vec2::ZERO);
                    let nothing = if option == "-mm" { Vec2::Y } else { Vec2::ZERO };
                    ignored.extend((given != nothing).then_some(option));
                }
                other => return Err(format!("\"{}\" is no option of a map", short(other))),
            }
        }
        let name = unquoted(rest);
        name.clone_into(&mut map.file);
        match name.is_empty() {
            true => Err("there is no file name".to_owned()),
            false => Ok((map, ignored)),
        }
    }

    /// v points up in OBJ and down in glTF: 1 - (s v + o) of 1 - v is s v + (1 - s - o).
    fn texture_use(&self, texture: TextureId) -> TextureUse {
        let (scale, offset) = (self.scale, self.offset);
        TextureUse {
            offset: Vec2::new(offset.x, 1.0 - scale.y - offset.y),
            scale,
            ..TextureUse::new(texture)
        }
    }

    /// Whether both are laid on a surface alike.
    pub fn lies_like(&self, other: &Self) -> bool {
        (self.scale, self.offset, self.clamp) == (other.scale, other.offset, other.clamp)
    }
}

/// A name without the quotes that some programs put around those with spaces.
pub(super) fn unquoted(name: &str) -> &str {
    name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(name).trim()
}

/// Takes a word off the front.
fn word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    *rest = after.trim_start();
    word
}

/// Takes a finite number off the front, unless it is all that is left, which is the name of the file.
fn number(rest: &mut &str) -> Option<f32> {
    let mut after = *rest;
    let number = word(&mut after).parse().ok().filter(|number: &f32| number.is_finite())?;
    *rest = Some(after).filter(|after| !after.is_empty())?;
    Some(number)
}

/// `u v w`, the last two as they were where they are missing; w is for textures of three dimensions.
fn pair(rest: &mut &str, default: Vec2) -> Vec2 {
    let [x, y, _] = [number(rest), number(rest), number(rest)];
    Vec2::new(x.unwrap_or(default.x), y.unwrap_or(default.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_before_a_name_with_blanks() {
        let (map, ignored) =
            Map::parse("-clamp on -s 2 3 1 -o .5 -bm -0.25 -mm 0 2 -imfchan g old wood 1.png")
                .unwrap_or_else(|reason| {
                    unreachable!("{reason}");
                });
        assert_eq!(map.file, "old wood 1.png");
        assert_eq!((map.scale, map.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0)));
        assert_eq!((map.clamp, map.bump, map.channel), (true, -0.25, Some(Channel::Green)));
        assert_eq!(ignored, ["-mm"]);
        // The place where OBJ has v = 0.25 is where glTF has 0.75.
        let placed = map.texture_use(TextureId(0));
        assert_eq!(placed.offset.y + placed.scale.y * 0.75, 1.0 - (3.0 * 0.25));
        for bad in ["", "-clamp on", "-wobble 3 a.png"] {
            assert!(Map::parse(bad).is_err(), "{bad}");
        }
        assert!(Map::parse("-s 1 2").is_ok_and(|(map, _)| map.file == "2"));
    }
}
