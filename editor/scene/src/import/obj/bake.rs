//! Textures that are made of the images of MTL: opacity into colours, roughness beside metalness, heights to normals.
//! In: decoded images. Out: texels. Where two images differ in size the result has the larger extents and takes the nearest texels.

use std::sync::Arc;

use glam::Vec3;

use super::material::roughness_of_exponent;
use crate::import::image::Pixels;

/// Which number of a texel counts (`-imfchan`), 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    /// Rec. 709 weights on the values as they are stored.
    Luminance,
}

impl Channel {
    /// `z`, the depth, is in no image that is read.
    pub fn of_letter(letter: &str) -> Option<Self> {
        Some(match letter {
            "r" => Self::Red,
            "g" => Self::Green,
            "b" => Self::Blue,
            "m" => Self::Alpha,
            "l" => Self::Luminance,
            _ => return None,
        })
    }

    /// 0..255; a grey texel gives its grey in every channel but alpha.
    fn of([red, green, blue, alpha]: [u8; 4], channel: Self) -> u8 {
        match channel {
            Self::Red => red,
            Self::Green => green,
            Self::Blue => blue,
            Self::Alpha => alpha,
            // The weights sum to 256.
            Self::Luminance => {
                ((54 * u32::from(red) + 183 * u32::from(green) + 19 * u32::from(blue)) >> 8) as u8
            }
        }
    }
}

/// What opacities an image has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// 255 everywhere.
    Full,
    /// Only 0 and 255.
    Holes,
    /// Values in between.
    Shades,
}

/// Texels of a new texture.
pub(super) struct Baked {
    pub width: u32,
    pub height: u32,
    pub rgba8: Arc<[u8]>,
    pub alpha: Alpha,
    /// The file when the texels are those of one.
    pub encoded: Option<Arc<[u8]>>,
}

/// The texel of an image at a place in a texture of another size.
fn texel(image: &Pixels, [x, y]: [u32; 2], [width, height]: [u32; 2]) -> [u8; 4] {
    let scaled =
        |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(from) / u64::from(to.max(1))) as usize;
    let place = scaled(y, image.height, height) * image.width as usize + scaled(x, image.width, width);
    image.rgba8.as_chunks::<4>().0.get(place).copied().unwrap_or([255; 4])
}

fn bake(images: &[Option<&Pixels>], texel_of: impl Fn([u32; 2], [u32; 2]) -> [u8; 4]) -> Baked {
    let largest =
        |extent: fn(&Pixels) -> u32| images.iter().flatten().map(|image| extent(image)).max().unwrap_or(1);
    let extent = [largest(|image| image.width), largest(|image| image.height)];
    let [width, height] = extent;
    let mut rgba8 = Vec::with_capacity(width as usize * height as usize * 4);
    for at in (0..height).flat_map(|y| (0..width).map(move |x| [x, y])) {
        rgba8.extend(texel_of(at, extent));
    }
    Baked { width, height, rgba8: rgba8.into(), alpha: Alpha::Full, encoded: None }
}

/// Colours, or white, whose alpha is a channel of the second image: without a choice its alpha where it has any,
/// else its luminance.
pub(super) fn opacity(color: Option<&Pixels>, opacity: &Pixels, channel: Option<Channel>) -> Baked {
    let has_alpha = || opacity.rgba8.as_chunks::<4>().0.iter().any(|texel| texel[3] < 255);
    let channel = channel.unwrap_or_else(|| if has_alpha() { Channel::Alpha } else { Channel::Luminance });
    let mut baked = bake(&[color, Some(opacity)], |at, extent| {
        let [red, green, blue, _] = color.map_or([255; 4], |color| texel(color, at, extent));
        [red, green, blue, Channel::of(texel(opacity, at, extent), channel)]
    });
    let mut alphas = baked.rgba8.as_chunks::<4>().0.iter().map(|texel| texel[3]).filter(|&alpha| alpha < 255);
    baked.alpha = match alphas.next() {
        None => Alpha::Full,
        Some(0) if alphas.all(|alpha| alpha == 0) => Alpha::Holes,
        Some(_) => Alpha::Shades,
    };
    baked
}

/// Roughness in green, metalness in blue, 255 where an image is missing. With an exponent the first image is a factor
/// of it, and the roughness is worked out for each texel.
pub(super) fn surface(
    [roughness, metallic]: [Option<&Pixels>; 2],
    [first, second]: [Channel; 2],
    exponent: Option<f32>,
) -> Baked {
    let rough = |value: u8| match exponent {
        Some(exponent) => {
            let roughness = roughness_of_exponent(exponent * f32::from(value) / 255.0);
            (roughness * 255.0).round() as u8
        }
        None => value,
    };
    bake(&[roughness, metallic], |at, extent| {
        let green = roughness.map_or(255, |image| rough(Channel::of(texel(image, at, extent), first)));
        let blue = metallic.map_or(255, |image| Channel::of(texel(image, at, extent), second));
        [255, green, blue, 255]
    })
}

/// Normals of a height field by central differences. From black to white is `strength` texels high, so that a step between two
/// texels at strength 1 is a slope of 45 degrees. Tiles, or goes on past its border.
pub(super) fn normals(heights: &Pixels, channel: Channel, strength: f32, clamp: bool) -> Baked {
    bake(&[Some(heights)], |[x, y], extent @ [width, height]| {
        let near = |at: u32, step: i64, size: u32| {
            let at = i64::from(at) + step;
            let size = i64::from(size);
            (if clamp { at.clamp(0, size - 1) } else { at.rem_euclid(size) }) as u32
        };
        let value = |at| strength * f32::from(Channel::of(texel(heights, at, extent), channel)) / 255.0;
        let right = value([near(x, 1, width), y]) - value([near(x, -1, width), y]);
        let down = value([x, near(y, 1, height)]) - value([x, near(y, -1, height)]);
        // Green points up in the image.
        let normal = Vec3::new(-0.5 * right, 0.5 * down, 1.0).normalize_or(Vec3::Z);
        let [red, green, blue] = normal.to_array().map(|part| (127.5 + 127.5 * part).round() as u8);
        [red, green, blue, 255]
    })
}

/// Whether an image is a normal map and no height field: it is bluish, as vectors that point outward are, on the mean.
pub(super) fn is_normal_map(image: &Pixels) -> bool {
    let (texels, _) = image.rgba8.as_chunks::<4>();
    let mut sums = [0_u64; 3];
    for texel in texels {
        for (sum, &value) in sums.iter_mut().zip(texel) {
            *sum += u64::from(value);
        }
    }
    let [red, green, blue] = sums;
    // By a sixteenth at least: greys of a JPEG are never quite grey.
    blue > red.max(green) + red.max(green) / 16
}
