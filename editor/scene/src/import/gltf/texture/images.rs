//! The images of a file. In: JSON, buffers and the folder. Out: decoded ones: those that are the same bytes once, all
//! cores at work, and nothing where together they are more than memory holds.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::super::accessor::View;
use super::super::buffers::{Buffers, read_image_uri};
use super::super::json::{Fault, Item};
use crate::import::ImportOptions;
use crate::import::image::{Pixels, decode, texel_bytes};
use crate::import::memory;
use crate::import::uri::{Location, resolve};

/// Where the bytes of an image are.
#[derive(PartialEq, Eq, Hash)]
enum Place<'a> {
    View(usize, usize, usize),
    File(PathBuf),
    /// A data URI, or one that leads nowhere.
    Text(&'a str),
    Nowhere,
}

/// The images, and which of them is the first of the same bytes.
pub(in super::super) struct Images<'a> {
    pub items: Vec<Item<'a>>,
    first: Vec<usize>,
    buffers: &'a Buffers,
    views: &'a [View],
    folder: &'a Path,
    options: &'a ImportOptions,
    /// What those take that were decoded.
    taken: u64,
}

impl<'a> Images<'a> {
    pub fn read(
        root: &Item<'a>,
        buffers: &'a Buffers,
        views: &'a [View],
        folder: &'a Path,
        options: &'a ImportOptions,
    ) -> Result<Self, Fault> {
        let items = root.objects("images")?;
        let (mut known, mut first) = (HashMap::new(), Vec::with_capacity(items.len()));
        for (index, item) in items.iter().enumerate() {
            let place = match item.index("bufferView", views.len(), "buffer view")?.and_then(|i| views.get(i))
            {
                Some(view) => Place::View(view.buffer, view.start, view.length),
                None => match item.text("uri")? {
                    Some(uri) if uri.starts_with("data:") => Place::Text(uri),
                    Some(uri) => match resolve(uri, folder) {
                        Ok(Location::File(path)) => Place::File(path),
                        _ => Place::Text(uri),
                    },
                    None => Place::Nowhere,
                },
            };
            first.push(*known.entry(place).or_insert(index));
        }
        Ok(Self { items, first, buffers, views, folder, options, taken: 0 })
    }

    /// Decodes these, each with its pixels or why there are none.
    pub fn decode(
        &mut self,
        wanted: BTreeSet<usize>,
    ) -> Result<BTreeMap<usize, Result<Pixels, String>>, Fault> {
        let firsts: BTreeSet<usize> =
            wanted.iter().filter_map(|&index| self.first.get(index).copied()).collect();
        let encoded: Vec<(usize, Result<Vec<u8>, String>)> = firsts
            .into_par_iter()
            .filter_map(|index| Some((index, self.encoded(self.items.get(index)?))))
            .collect();
        let extent_px = self.options.max_image_extent_px;
        for (index, bytes) in &encoded {
            let texels = bytes.as_deref().map_or(0, |bytes| texel_bytes(bytes, extent_px));
            self.taken = self.taken.saturating_add(texels);
            if let Some(reason) = memory::refusal(self.taken, self.options.max_image_bytes) {
                return Err(Fault::new(
                    format!("/images/{index}"),
                    format!("with the images before it, {reason}"),
                ));
            }
        }
        let decoded: BTreeMap<usize, Result<Pixels, String>> = encoded
            .into_par_iter()
            .map(|(index, bytes)| (index, bytes.and_then(|bytes| decode(bytes, extent_px))))
            .collect();
        let of = |index: usize| Some((index, decoded.get(self.first.get(index)?)?.clone()));
        Ok(wanted.into_iter().filter_map(of).collect())
    }

    /// The bytes of an image file, wherever they are.
    fn encoded(&self, image: &Item<'_>) -> Result<Vec<u8>, String> {
        let in_words = |fault: Fault| fault.reason;
        if let Some(index) = image.index("bufferView", self.views.len(), "buffer view").map_err(in_words)? {
            let bytes = self.views.get(index).and_then(|view| view.bytes(self.buffers));
            return bytes.map(<[u8]>::to_vec).ok_or_else(|| format!("there is no buffer view {index}"));
        }
        match image.text("uri").map_err(in_words)? {
            Some(uri) => read_image_uri(uri, self.folder),
            None => Err("it has neither a URI nor a buffer view".to_owned()),
        }
    }
}
