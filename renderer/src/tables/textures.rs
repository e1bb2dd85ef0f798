//! Bindless textures. Slot 0 is a white texel that fills every slot without a texture of its own. Those that do not fit go
//! without their top levels, as `residency.rs` plans.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use caustica_gpu::{
    Device, Filter, Format, Frames, Image, ImageDesc, ImageUse, Recorder, Sampler, SamplerDesc, SceneSet,
    WrapMode,
};

use super::residency::{Wanted, bytes_of, extent_of, levels_of, plan, texels_of};
use crate::delta::{self, TextureId};
use crate::error::{RendererError, Result};
use crate::gpu_types::NO_TEXTURE;

/// Texture slots on a device that allows more.
const SLOTS: u32 = 4096;

/// Bytes of texels that come back in one frame, where it is not a single level that is larger.
const RETURNED_BYTES_A_FRAME: u64 = 64 << 20;
/// Frames at rest before room is looked for: what was retired is free by then.
const REST_FRAMES: usize = 1;
/// Less than this is not worth giving up.
const LEAST_BYTES: u64 = 64 << 10;

struct Entry {
    slot: u32,
    sampler: Arc<Sampler>,
    source: Arc<delta::Texture>,
    /// `None` until the next [`Textures::fit`].
    image: Option<Image>,
    /// Top levels that the image goes without.
    dropped: u32,
    /// Pixels along its longer side where it appears largest, as far as is known.
    seen_px: f32,
}

impl Entry {
    fn wanted(&self) -> Wanted {
        Wanted {
            extent: [self.source.width, self.source.height],
            mipmaps: self.source.sampler.mipmaps,
            seen_px: self.seen_px,
        }
    }

    fn bytes(&self) -> u64 {
        let Wanted { extent, mipmaps, .. } = self.wanted();
        self.image.as_ref().map_or(0, |_| bytes_of(extent_of(extent, self.dropped), mipmaps))
    }
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
    /// How long everything has been at rest, in frames, while it is open how much room there is; `None`: all is settled.
    settling: Option<usize>,
    /// It has been open since textures came: pictures until then were made with less than there is room for.
    begun: bool,
    /// Most bytes, since something else did not fit beside more.
    limit_bytes: Option<u64>,
    /// What was told last: textures without their top levels.
    told_reduced: usize,
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
            settling: None,
            begun: false,
            limit_bytes: None,
            told_reduced: 0,
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
            let shown = entry.and_then(|entry| Some((entry.image.as_ref()?, &entry.sampler)));
            let (image, sampler) = shown.unwrap_or((&self.white, &self.white_sampler));
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

    /// Takes a texture in, or its new content; [`Self::fit`] uploads it in the same frame. It keeps its slot, which materials
    /// name that are not sent again; frames that run go on to read the old image in sets of their own.
    pub(crate) fn set(&mut self, id: TextureId, texture: &Arc<delta::Texture>) -> Result<()> {
        let limit = u64::from(texture.width) * u64::from(texture.height) * 4;
        if texture.rgba8.len() as u64 != limit {
            let what = format!("bytes of texture {}", texture.name);
            return Err(RendererError::Limit { what, asked: texture.rgba8.len() as u64, limit });
        }
        let sampler = sampler_of(&self.device, &mut self.samplers, texture.sampler)?;
        let known = self.by_id.get(&id).map(|known| (known.slot, known.seen_px));
        let (slot, seen_px) = match known {
            Some(known) => known,
            // Until something is known of it, all count alike.
            None => (self.take_slot()?, 1.0),
        };
        let source = Arc::clone(texture);
        self.mark_stale(slot);
        self.by_slot.insert(slot, id);
        self.by_id.insert(id, Entry { slot, sampler, source, image: None, dropped: 0, seen_px });
        Ok(())
    }

    /// Uploads what is new. Where not everything has room, what comes after it, structures and targets, comes first:
    /// textures begin with little and get what is left once all is at rest.
    pub(crate) fn fit_new(&mut self, recorder: &mut Recorder) -> Result<()> {
        let (whole, free) = (self.whole_bytes(), self.free_bytes());
        let all_fit = whole <= free / 2 && self.limit_bytes.is_none_or(|limit| whole <= limit);
        let room = if all_fit { whole } else { (free / 4).max(self.bytes()) };
        self.fit(recorder, room.min(self.limit_bytes.unwrap_or(room)))?;
        if !all_fit {
            (self.settling, self.begun) = (Some(0), true);
        }
        Ok(())
    }

    /// Something changed, or came to rest: where not all textures are whole, others may have to be.
    pub(crate) fn note(&mut self, at_rest: bool) {
        let some_are_reduced = || self.by_id.values().any(|entry| entry.dropped > 0);
        self.settling = match self.settling {
            Some(frames) if at_rest => Some(frames + 1),
            None if at_rest || !some_are_reduced() => None,
            _ => Some(0),
        };
    }

    /// Whether it is open how much room there is.
    pub(crate) fn is_settling(&self) -> bool {
        self.settling.is_some()
    }

    /// Whether everything has been at rest long enough for [`Self::settle`].
    pub(crate) fn may_settle(&self) -> bool {
        self.settling.is_some_and(|frames| frames >= REST_FRAMES + Frames::in_flight())
    }

    /// Gives textures the room that is left, those that appear largest before the others. True: samples have to begin anew.
    pub(crate) fn settle(
        &mut self,
        recorder: &mut Recorder,
        seen_px: &BTreeMap<TextureId, f32>,
        read_back_bytes: u64,
    ) -> Result<bool> {
        for (id, entry) in &mut self.by_id {
            entry.seen_px = seen_px.get(id).copied().unwrap_or(1.0);
        }
        let free = self.free_bytes();
        // An eighth stays for what comes and goes: staging, scratch, images that are being replaced.
        let room = (free - free / 8).saturating_sub(read_back_bytes);
        if self.limit_bytes.is_some_and(|limit| room >= limit.saturating_mul(2)) {
            self.limit_bytes = None;
        }
        let changed = self.fit(recorder, room.min(self.limit_bytes.unwrap_or(room)))?;
        self.settling = changed.then_some(0);
        if changed {
            return Ok(true);
        }
        self.tell(free);
        Ok(std::mem::take(&mut self.begun))
    }

    /// Makes room for something else, which failed; false when there is none to be made. To be followed by
    /// [`Self::fit_new`], once everything was taken in anew.
    pub(crate) fn give_up_half(&mut self) -> bool {
        let bytes = self.bytes();
        if bytes > LEAST_BYTES {
            self.limit_bytes = Some(bytes / 2);
        }
        bytes > LEAST_BYTES
    }

    /// Brings every image to the level that the plan for `room` bytes has for it. Levels come back one at a time, and only
    /// when none has to go. Returns whether an image that was there is another now.
    fn fit(&mut self, recorder: &mut Recorder, room: u64) -> Result<bool> {
        let wanted: Vec<Wanted> = self.by_id.values().map(Entry::wanted).collect();
        let ids: Vec<TextureId> = self.by_id.keys().copied().collect();
        let (mut changed, mut waiting) = (false, Vec::new());
        for (id, dropped) in ids.into_iter().zip(plan(&wanted, room)) {
            match self.by_id.get(&id) {
                Some(entry) if entry.image.is_none() => self.upload(recorder, id, dropped)?,
                Some(entry) if entry.dropped < dropped => {
                    self.upload(recorder, id, dropped)?;
                    changed = true;
                }
                Some(entry) if entry.dropped > dropped => waiting.push((id, entry.dropped - 1)),
                _ => {}
            }
        }
        let mut returned = 0;
        for (id, dropped) in if changed { Vec::new() } else { waiting } {
            match self.upload(recorder, id, dropped) {
                Err(error) if error.is_out_of_memory() => {
                    self.limit_bytes = Some(self.bytes());
                    break;
                }
                done => done?,
            }
            changed = true;
            returned += self.by_id.get(&id).map_or(0, Entry::bytes);
            if returned >= RETURNED_BYTES_A_FRAME {
                break;
            }
        }
        Ok(changed)
    }

    fn upload(&mut self, recorder: &mut Recorder, id: TextureId, dropped: u32) -> Result<()> {
        let Some(entry) = self.by_id.get_mut(&id) else { return Ok(()) };
        let Wanted { extent, mipmaps, .. } = entry.wanted();
        let [width, height] = extent_of(extent, dropped);
        let desc = desc_of(width, height, entry.source.srgb, mipmaps);
        let image = Image::new(&self.device, &entry.source.name, desc)?;
        recorder.upload_image(&image, &texels_of(&entry.source, dropped))?;
        (entry.image, entry.dropped) = (Some(image), dropped);
        let slot = entry.slot;
        self.mark_stale(slot);
        Ok(())
    }

    /// Bytes that all would take when whole.
    fn whole_bytes(&self) -> u64 {
        self.by_id.values().map(Entry::wanted).map(|wanted| bytes_of(wanted.extent, wanted.mipmaps)).sum()
    }

    fn bytes(&self) -> u64 {
        self.by_id.values().map(Entry::bytes).sum()
    }

    /// Bytes that nothing but textures has.
    fn free_bytes(&self) -> u64 {
        let memory = self.device.memory_budget();
        let others = memory.used_bytes.saturating_sub(self.bytes());
        memory.budget_bytes.saturating_sub(others)
    }

    fn tell(&mut self, free: u64) {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let reduced = self.by_id.values().filter(|entry| entry.dropped > 0).count();
        if reduced > 0 && reduced != self.told_reduced {
            tracing::warn!(
                "{reduced} of {} textures are shown without their largest levels, those first that appear smallest: whole they \
                 take {:.1} MiB, {:.1} MiB of device memory are free for them, {:.1} MiB are in use",
                self.by_id.len(),
                mib(self.whole_bytes()),
                mib(free),
                mib(self.bytes())
            );
        } else if reduced == 0 && self.told_reduced > 0 {
            tracing::info!("all textures are whole again");
        }
        self.told_reduced = reduced;
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
    ImageDesc {
        extent: [width, height],
        format: if srgb { Format::Rgba8Srgb } else { Format::Rgba8Unorm },
        mip_levels: levels_of([width, height], mipmaps),
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
