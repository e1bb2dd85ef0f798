//! EXR files: named channels of 32-bit floats, scene-linear, with attributes. Written whole or not at all; what is read has a
//! size that was asked for, so that no file claims memory.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, bail};
use exr::image::{AnyChannel, AnyChannels, FlatSamples, Image, Layer};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, LineOrder, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{Blocks, Compression, Encoding, ReadChannels, ReadLayers, WritableImage, read as reader};

use crate::whole_file;

/// Whole rows, which every reader takes.
const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

/// What is written beside the pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Note {
    /// A text; what Latin-1 lacks is left out, as EXR texts hold no more.
    Text(String),
    /// A number.
    Number(f64),
}

/// The names and values of an image, row by row from the top.
pub(crate) type Channels = BTreeMap<String, Vec<f32>>;

/// Three channels of pixels.
pub(crate) fn channels_of(names: [&str; 3], pixels: &[[f32; 3]]) -> impl Iterator<Item = (String, Vec<f32>)> {
    names.into_iter().enumerate().map(|(i, name)| (name.to_owned(), pixels.iter().map(|p| p[i]).collect()))
}

/// The pixels of three channels, where all are there.
pub(crate) fn pixels_of(names: [&str; 3], channels: &Channels) -> Option<Vec<[f32; 3]>> {
    let [r, g, b] = names.map(|name| channels.get(name).map(|values| values.iter().copied()));
    Some(r?.zip(g?).zip(b?).map(|((r, g), b)| [r, g, b]).collect())
}

/// Writes an image.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write<'a>(
    path: &Path,
    extent: [u32; 2],
    channels: Channels,
    notes: impl IntoIterator<Item = (&'a str, Note)>,
) -> anyhow::Result<()> {
    let size = extent.map(|side| side as usize);
    let channels = channels
        .into_iter()
        .map(|(name, values)| AnyChannel::new(Text::from(name.as_str()), FlatSamples::F32(values)));
    let mut attributes = LayerAttributes::named("");
    attributes.layer_name = None;
    attributes.software_name = Some(Text::from(concat!("caustica ", env!("CARGO_PKG_VERSION"))));
    for (name, note) in notes {
        let value = match note {
            Note::Number(number) => AttributeValue::F64(number),
            Note::Text(text) => AttributeValue::Text(latin(&text)),
        };
        attributes.other.insert(Text::from(name), value);
    }
    let layer = Layer::new((size[0], size[1]), attributes, ENCODING, AnyChannels::sort(channels.collect()));
    let image = Image::from_layer(layer);
    whole_file::replace(path, |path| -> anyhow::Result<()> { Ok(image.write().to_file(path)?) })
        .with_context(|| path.display().to_string())
}

fn latin(text: &str) -> Text {
    let text: String = text.chars().filter(|c| u32::from(*c) < 256).collect();
    Text::new_or_none(text).unwrap_or_else(|| Text::from(""))
}

/// Reads an image of a known size: its channels, and its notes that are texts.
///
/// # Errors
/// When the file cannot be read or has another size.
pub(crate) fn read(path: &Path, extent: [u32; 2]) -> anyhow::Result<(Channels, BTreeMap<String, String>)> {
    let named = || path.display().to_string();
    let meta = MetaData::read_from_file(path, false).with_context(named)?;
    let size = meta.headers.first().with_context(named)?.layer_size;
    if [size.x(), size.y()] != extent.map(|side| side as usize) {
        let [width, height] = extent;
        bail!("{}: it is {} x {}, not {width} x {height}", path.display(), size.x(), size.y());
    }
    let image = reader().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let layer = image.all_attributes().from_file(path).with_context(named)?.layer_data;
    let values = |samples: &FlatSamples| samples.values_as_f32().collect();
    let channels = layer.channel_data.list.iter();
    let channels = channels.map(|channel| (channel.name.to_string(), values(&channel.sample_data))).collect();
    let notes = layer.attributes.other.iter().filter_map(|(name, value)| match value {
        AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    });
    Ok((channels, notes.collect()))
}
