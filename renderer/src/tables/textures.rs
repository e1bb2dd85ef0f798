//! Bindless textures. Slot 0 is a white texel that fills every slot without a texture of its own.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use caustica_gpu::{
    Device, Filter, Format, Frames, Image, ImageDesc, ImageUse, Recorder, Sampler, SamplerDesc, SceneSet,
    WrapMode,
};

use crate::delta::{self, TextureId};
use crate::error::{RendererError, Result};
use crate::gpu_types::NO_TEXTURE;

/// Texture slots on a device that allows more.
const SLOTS: u32 = 4096;

struct Entry {
    slot: u32,
    image: Image,
    sampler: Arc<Sampler>,
}

/// One descriptor set and the slots that it does not show yet.
struct FrameSet {
    set: SceneSet,
    stale: BTreeSet<u32>,
}

/// All textures, by id, and the descriptor sets that hold them: one a frame in flight, so that a set is never
/// written while it is in use.
pub(crate) struct Textures {
    device: Arc<Device>,
    sets: Vec<FrameSet>,
    by_slot: HashMap<u32, TextureId>,
    by_id: BTreeMap<TextureId, Entry>,
    free: Vec<u32>,
    next: u32,
    samplers: HashMap<SamplerDesc, Arc<Sampler>>,
    white: Image,
    white_sampler: Arc<Sampler>,
}

impl Textures {
    pub(crate) fn new(device: &Arc<Device>, recorder: &mut Recorder) -> Result<Self> {
        let white = Image::new(device, "white texel", desc_of(1, 1, false, false))?;
        recorder.upload_image(&white, &[255; 4])?;
        let mut samplers = HashMap::new();
        let white_sampler = sampler_of(device, &mut samplers, delta::Sampler::default())?;
        let sets = (0..Frames::in_flight())
            .map(|_| {
                let set = SceneSet::new(device, SLOTS, &white, &white_sampler)?;
                Ok(FrameSet { set, stale: BTreeSet::new() })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            device: Arc::clone(device),
            sets,
            by_slot: HashMap::new(),
            by_id: BTreeMap::new(),
            free: Vec::new(),
            next: 1,
            samplers,
            white,
            white_sampler,
        })
    }

    /// The set of one frame in flight.
    pub(crate) fn set_of(&self, frame_slot: usize) -> &SceneSet {
        &self.sets[frame_slot % self.sets.len()].set
    }

    /// Brings the set of a frame that is free to record up to date.
    pub(crate) fn update_set(&mut self, frame_slot: usize) {
        let index = frame_slot % self.sets.len();
        for slot in std::mem::take(&mut self.sets[index].stale) {
            let entry = self.by_slot.get(&slot).and_then(|id| self.by_id.get(id));
            let (image, sampler) =
                entry.map_or((&self.white, &self.white_sampler), |e| (&e.image, &e.sampler));
            self.sets[index].set.set_texture(slot, image, sampler);
        }
    }

    /// The texture in a slot.
    pub(crate) fn id_of(&self, slot: u32) -> Option<TextureId> {
        self.by_slot.get(&slot).copied()
    }

    /// Slot of a texture in the shader's array.
    pub(crate) fn slot(&self, id: TextureId) -> u32 {
        self.by_id.get(&id).map_or(NO_TEXTURE, |entry| entry.slot)
    }

    /// Uploads a texture, or its new content. It keeps its slot, which materials name that are not sent again; frames
    /// that run go on to read the old image in sets of their own.
    pub(crate) fn set(
        &mut self,
        recorder: &mut Recorder,
        id: TextureId,
        texture: &delta::Texture,
    ) -> Result<()> {
        let desc = desc_of(texture.width, texture.height, texture.srgb, texture.sampler.mipmaps);
        let image = Image::new(&self.device, &texture.name, desc)?;
        recorder.upload_image(&image, &texture.rgba8)?;
        let sampler = sampler_of(&self.device, &mut self.samplers, texture.sampler)?;
        let slot = match self.by_id.get(&id) {
            Some(known) => known.slot,
            None => self.take_slot()?,
        };
        self.mark_stale(slot);
        self.by_slot.insert(slot, id);
        self.by_id.insert(id, Entry { slot, image, sampler });
        Ok(())
    }

    fn take_slot(&mut self) -> Result<u32> {
        if let Some(slot) = self.free.pop() {
            return Ok(slot);
        }
        let capacity = self.sets[0].set.capacity();
        if self.next >= capacity {
            let (asked, limit) = (u64::from(self.next), u64::from(capacity - 1));
            return Err(RendererError::Limit { what: String::from("textures"), asked, limit });
        }
        self.next += 1;
        Ok(self.next - 1)
    }

    pub(crate) fn remove(&mut self, id: TextureId) {
        let Some(entry) = self.by_id.remove(&id) else { return };
        self.by_slot.remove(&entry.slot);
        self.mark_stale(entry.slot);
        self.free.push(entry.slot);
        // A scene loaded afresh lies as in a new renderer.
        if self.by_id.is_empty() {
            self.free.clear();
            self.next = 1;
        }
    }

    /// All textures in order of id, with their slots.
    pub(crate) fn ids(&self) -> impl Iterator<Item = (TextureId, u32)> {
        self.by_id.iter().map(|(id, entry)| (*id, entry.slot))
    }

    fn mark_stale(&mut self, slot: u32) {
        for set in &mut self.sets {
            set.stale.insert(slot);
        }
    }

    /// The default image, for bindings that a variant does not use.
    pub(crate) fn white(&self) -> &Image {
        &self.white
    }
}

fn desc_of(width: u32, height: u32, srgb: bool, mipmaps: bool) -> ImageDesc {
    let levels = if mipmaps { width.max(height).max(1).ilog2() + 1 } else { 1 };
    ImageDesc {
        extent: [width, height],
        format: if srgb { Format::Rgba8Srgb } else { Format::Rgba8Unorm },
        mip_levels: levels,
        usage: ImageUse::Texture,
    }
}

fn sampler_of(
    device: &Arc<Device>,
    cache: &mut HashMap<SamplerDesc, Arc<Sampler>>,
    sampler: delta::Sampler,
) -> Result<Arc<Sampler>> {
    let filter = |linear| if linear { Filter::Linear } else { Filter::Nearest };
    let wrap = |wrap| match wrap {
        delta::Wrap::Repeat => WrapMode::Repeat,
        delta::Wrap::MirroredRepeat => WrapMode::MirroredRepeat,
        delta::Wrap::ClampToEdge => WrapMode::ClampToEdge,
    };
    let desc = SamplerDesc {
        mag: filter(sampler.mag_linear),
        min: filter(sampler.min_linear),
        mip: filter(sampler.mip_linear),
        mipmaps: sampler.mipmaps,
        wrap: [wrap(sampler.wrap_u), wrap(sampler.wrap_v)],
        anisotropy: if sampler.min_linear && sampler.mag_linear { 8 } else { 1 },
    };
    if let Some(found) = cache.get(&desc) {
        return Ok(Arc::clone(found));
    }
    let made = Arc::new(Sampler::new(device, desc)?);
    cache.insert(desc, Arc::clone(&made));
    Ok(made)
}
