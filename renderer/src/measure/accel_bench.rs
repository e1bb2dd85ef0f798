//! What acceleration structures cost on a device, by the device's own clock. Enters: how many triangles, boxes or
//! instances. Leaves: milliseconds and bytes. Inputs are generated, lie in spatial order and in memory of the device.

mod inputs;

use std::sync::Arc;
use std::time::Instant;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, Background, BackgroundWork, BoxGeometry, Buffer,
    BufferUse, BuildMode, BuildPreference, Device, DeviceKind, Frames, GpuError, Location, MemoryUse,
    Recorder, ResourceId, Stage, TlasInstances, TriangleGeometry, Use,
};
use serde::Serialize;

use crate::error::{RendererError, Result};
use inputs::{CUBE_INDICES, CUBE_POSITIONS, IDENTITY, bumpy_grid, scattered_boxes, scattered_instances};

/// Label of the timed pass.
const LABEL: &str = "measure.accel";
/// Label of the work that keeps the device busy.
const LOAD_LABEL: &str = "measure.load";
/// Triangles of the structure that is built over and over for it.
const LOAD_TRIANGLES: u32 = 100_000;
/// Device time of one submit of it.
const LOAD_MS: f64 = 5.0;
/// Most builds in one submit of it.
const MOST_LOADS: usize = 64;
/// A device at rest lowers its clocks, and takes a while under load to raise them again.
const WARM_UP_MS: f64 = 300.0;
/// A processor has no clocks of its own to wake.
const WARM_UP_CPU_MS: f64 = 20.0;
/// Unmeasured runs: caches fill.
const UNMEASURED: usize = 2;
/// Measured runs, at the least and at most; they end once the device has worked for `SAMPLES_MS`.
const SAMPLES: (usize, usize) = (5, 15);
const SAMPLES_MS: f64 = 400.0;

/// Times and sizes of a BLAS; each time is a median.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlasTimes {
    /// Triangles or boxes.
    pub primitives: u32,
    /// Build of a structure that is traced often and may be compacted.
    pub build_fast_trace_ms: f64,
    /// Build of a structure that is refitted often.
    pub build_fast_build_ms: f64,
    /// Refit of the latter.
    pub refit_ms: f64,
    /// Copy of the former into its compacted size.
    pub compact_ms: f64,
    /// Bytes of the former.
    pub bytes: u64,
    /// Its bytes after compaction.
    pub compacted_bytes: u64,
}

/// Times and size of a TLAS; each time is a median.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TlasTimes {
    /// Instances of one cube.
    pub instances: u32,
    /// Build.
    pub build_ms: f64,
    /// Refit.
    pub refit_ms: f64,
    /// Bytes.
    pub bytes: u64,
}

/// What a structure is built from.
enum Shape {
    Triangles(TriangleGeometry),
    Boxes(BoxGeometry),
    Instances(TlasInstances),
}

impl Shape {
    fn geometry(&self) -> AccelGeometry<'_> {
        match self {
            Self::Triangles(one) => AccelGeometry::Triangles(std::slice::from_ref(one)),
            Self::Boxes(one) => AccelGeometry::Boxes(std::slice::from_ref(one)),
            Self::Instances(instances) => AccelGeometry::Instances(*instances),
        }
    }
}

/// A shape with the memory that it lies in.
struct Input {
    shape: Shape,
    buffers: Vec<Buffer>,
    /// What the instances place.
    _below: Option<BareStructure>,
}

/// An acceleration structure of generated input with nothing of a scene around it; built already.
pub struct BareStructure {
    input: Arc<Input>,
    preference: BuildPreference,
    structure: AccelStructure,
    _scratch: Buffer,
    scratch_address: u64,
}

impl BareStructure {
    fn work(&self, mode: BuildMode) -> AccelBuild<'_> {
        AccelBuild {
            target: &self.structure,
            geometry: self.input.shape.geometry(),
            preference: self.preference,
            mode,
            scratch: self.scratch_address,
        }
    }
}

/// Measures on one device. The medians are of runs with other work right before them in the same submit, so that the
/// device's clocks are those of a device at work.
pub struct AccelBench<'a> {
    device: Arc<Device>,
    frames: &'a mut Frames,
    background: Background,
    /// Stands for all structures and scratch memory: one build after the other.
    group: ResourceId,
    load: Option<BareStructure>,
    /// Builds of the load in one submit.
    loads: usize,
}

impl<'a> AccelBench<'a> {
    /// Prepares to measure.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, frames: &'a mut Frames) -> Result<Self> {
        let mut bench = Self {
            device: Arc::clone(device),
            frames,
            background: Background::new(device)?,
            group: device.new_resource_id(),
            load: None,
            loads: 1,
        };
        bench.load = Some(bench.bare_triangles(LOAD_TRIANGLES, BuildPreference::FastTrace)?);
        let mut once_ms = f64::INFINITY;
        for _ in 0..=UNMEASURED {
            once_ms = once_ms.min(bench.submit_load()?);
        }
        bench.loads = ((LOAD_MS / once_ms).ceil() as usize).clamp(1, MOST_LOADS);
        Ok(bench)
    }

    /// A BLAS of `count` triangles (at least 1): a bumpy grid.
    ///
    /// # Errors
    /// [`RendererError::Limit`] for more than the device takes; when memory runs out; when the device fails.
    pub fn triangles(&mut self, count: u32) -> Result<BlasTimes> {
        let input = self.triangle_input(count)?;
        self.blas(&input, count.max(1))
    }

    /// A BLAS of `count` boxes (at least 1) scattered in a cube.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn boxes(&mut self, count: u32) -> Result<BlasTimes> {
        let count = self.checked("boxes", count, self.device.limits().max_primitives)?;
        let boxes = self.upload(bytemuck::cast_slice(&scattered_boxes(count)))?;
        let shape = Shape::Boxes(BoxGeometry { boxes: boxes.address(), count, opaque: true });
        self.blas(&Arc::new(Input { shape, buffers: vec![boxes], _below: None }), count)
    }

    /// A TLAS of `count` instances (at least 1) of one cube, scattered in a cube.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn instances(&mut self, count: u32) -> Result<TlasTimes> {
        let tlas = self.bare_instances(count)?;
        Ok(TlasTimes {
            instances: count.max(1),
            build_ms: self.median_of(&tlas, BuildMode::Build)?,
            refit_ms: self.median_of(&tlas, BuildMode::Refit)?,
            bytes: tlas.structure.size(),
        })
    }

    /// The BLAS of [`Self::triangles`], to be built or refitted between other work.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn bare_triangles(&mut self, count: u32, preference: BuildPreference) -> Result<BareStructure> {
        let input = self.triangle_input(count)?;
        self.bare(&input, preference)
    }

    /// The TLAS of [`Self::instances`], likewise.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn bare_instances(&mut self, count: u32) -> Result<BareStructure> {
        let count = self.checked("instances", count, self.device.limits().max_instances)?;
        let cube = self.mesh_input(&CUBE_POSITIONS, &CUBE_INDICES)?;
        let blas = self.bare(&Arc::new(cube), BuildPreference::FastTrace)?;
        let descriptors = self.upload(&scattered_instances(count, blas.structure.address()))?;
        let shape = Shape::Instances(TlasInstances { descriptors: descriptors.address(), count });
        let input = Input { shape, buffers: vec![descriptors], _below: Some(blas) };
        self.bare(&Arc::new(input), BuildPreference::FastTrace)
    }

    /// Builds (or, with [`BuildMode::Refit`], refits) once in a frame of its own and waits. Milliseconds on the device, with
    /// the clocks that it happens to have.
    ///
    /// # Errors
    /// When the device fails.
    pub fn run(&mut self, bare: &BareStructure, mode: BuildMode) -> Result<f64> {
        let uses = self.uses(&bare.input);
        self.timed(false, &mut |recorder| recorder.build(&[bare.work(mode)], &uses))
    }

    /// Keeps the device at work without a gap for `ms` milliseconds at the least, and waits for it.
    ///
    /// # Errors
    /// When the device fails.
    pub fn keep_busy(&mut self, ms: f64) -> Result<()> {
        let start = Instant::now();
        while start.elapsed().as_secs_f64() * 1e3 < ms {
            let mut recorder = self.frames.begin()?;
            self.record_load(&mut recorder)?;
            self.frames.submit(recorder, None)?;
        }
        Ok(self.frames.finish()?)
    }

    /// Keeps the device busy until it has the clocks of a device at work.
    ///
    /// # Errors
    /// When the device fails.
    pub fn warm_up(&mut self) -> Result<()> {
        let cpu = self.device.kind() == DeviceKind::Cpu;
        self.keep_busy(if cpu { WARM_UP_CPU_MS } else { WARM_UP_MS })
    }

    /// Positions and corners of the triangles that [`Self::triangles`] builds.
    pub fn grid(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        bumpy_grid(count.max(1))
    }

    fn triangle_input(&mut self, count: u32) -> Result<Arc<Input>> {
        let count = self.checked("triangles", count, self.device.limits().max_primitives)?;
        let (positions, indices) = bumpy_grid(count);
        Ok(Arc::new(self.mesh_input(&positions, &indices)?))
    }

    fn mesh_input(&mut self, positions: &[[f32; 3]], indices: &[[u32; 3]]) -> Result<Input> {
        let places = self.upload(bytemuck::cast_slice(positions))?;
        let corners = self.upload(bytemuck::cast_slice(indices))?;
        let transform = self.upload(bytemuck::cast_slice(&IDENTITY))?;
        let shape = Shape::Triangles(TriangleGeometry {
            positions: places.address(),
            vertex_count: positions.len() as u32,
            indices: corners.address(),
            triangle_count: indices.len() as u32,
            transform: transform.address(),
            opaque: true,
        });
        Ok(Input { shape, buffers: vec![places, corners, transform], _below: None })
    }

    /// Makes a structure and builds it, so that it may be refitted.
    fn bare(&mut self, input: &Arc<Input>, preference: BuildPreference) -> Result<BareStructure> {
        let geometry = input.shape.geometry();
        let sizes = self.device.build_sizes(geometry, preference);
        let top_level = matches!(geometry, AccelGeometry::Instances(_));
        let alignment = self.device.limits().scratch_alignment.max(1);
        let scratch_bytes = sizes.build_scratch.max(sizes.refit_scratch) + alignment;
        let (usage, kind) = (BufferUse::General, MemoryUse::AccelerationStructures);
        let scratch = Buffer::new(&self.device, "scratch", scratch_bytes, usage, Location::Device, kind)?;
        let bare = BareStructure {
            input: Arc::clone(input),
            preference,
            structure: AccelStructure::new(&self.device, "measured", sizes.structure, top_level)?,
            scratch_address: scratch.address().next_multiple_of(alignment),
            _scratch: scratch,
        };
        self.run(&bare, BuildMode::Build)?;
        Ok(bare)
    }

    fn blas(&mut self, input: &Arc<Input>, primitives: u32) -> Result<BlasTimes> {
        let fixed = self.bare(input, BuildPreference::FastTrace)?;
        let build_fast_trace_ms = self.median_of(&fixed, BuildMode::Build)?;
        let (compact_ms, compacted_bytes) = self.compaction(&fixed.structure)?;
        let bytes = fixed.structure.size();
        drop(fixed);
        let moving = self.bare(input, BuildPreference::FastBuild)?;
        Ok(BlasTimes {
            primitives,
            build_fast_trace_ms,
            build_fast_build_ms: self.median_of(&moving, BuildMode::Build)?,
            refit_ms: self.median_of(&moving, BuildMode::Refit)?,
            compact_ms,
            bytes,
            compacted_bytes,
        })
    }

    /// Milliseconds of a compacting copy, and the bytes of the copy.
    fn compaction(&mut self, from: &AccelStructure) -> Result<(f64, u64)> {
        let ticket = self.background.submit(&[BackgroundWork::QuerySize(from)])?;
        let size = self.background.wait(ticket)?.first().copied().unwrap_or_else(|| from.size());
        let to = AccelStructure::new(&self.device, "measured, compacted", size, false)?;
        let uses = [Use::Group(self.group, Stage::AccelBuild, Access::AccelWrite)];
        let ms = self.median(|recorder| recorder.compact(from, &to, &uses))?;
        Ok((ms, size))
    }

    fn median_of(&mut self, bare: &BareStructure, mode: BuildMode) -> Result<f64> {
        let uses = self.uses(&bare.input);
        self.median(|recorder| recorder.build(&[bare.work(mode)], &uses))
    }

    fn uses<'b>(&self, input: &'b Input) -> Vec<Use<'b>> {
        let read = |buffer: &'b Buffer| Use::Buffer(buffer, Stage::AccelBuild, Access::BuildInput);
        let written = Use::Group(self.group, Stage::AccelBuild, Access::AccelWrite);
        input.buffers.iter().map(read).chain([written]).collect()
    }

    /// Median milliseconds of what `record` records.
    fn median(&mut self, mut record: impl FnMut(&mut Recorder)) -> Result<f64> {
        self.warm_up()?;
        for _ in 0..UNMEASURED {
            self.timed(true, &mut record)?;
        }
        let (least, most) = SAMPLES;
        let mut times: Vec<f64> = Vec::with_capacity(most);
        while times.len() < least || (times.len() < most && times.iter().sum::<f64>() < SAMPLES_MS) {
            times.push(self.timed(true, &mut record)?);
        }
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied().ok_or_else(|| unmeasured("no run"))
    }

    /// Milliseconds of what `record` records in a frame of its own. `loaded`: right behind other work.
    fn timed(&mut self, loaded: bool, record: &mut impl FnMut(&mut Recorder)) -> Result<f64> {
        let mut recorder = self.frames.begin()?;
        if loaded {
            self.record_load(&mut recorder)?;
        }
        recorder.pass(LABEL, |recorder| {
            record(recorder);
            Ok::<(), GpuError>(())
        })?;
        self.frames.submit(recorder, None)?;
        self.time_of(LABEL)
    }

    fn submit_load(&mut self) -> Result<f64> {
        let mut recorder = self.frames.begin()?;
        self.record_load(&mut recorder)?;
        self.frames.submit(recorder, None)?;
        self.time_of(LOAD_LABEL)
    }

    fn record_load(&self, recorder: &mut Recorder) -> Result<()> {
        let Some(load) = &self.load else { return Ok(()) };
        let uses = self.uses(&load.input);
        recorder.pass(LOAD_LABEL, |recorder| {
            (0..self.loads).for_each(|_| recorder.build(&[load.work(BuildMode::Build)], &uses));
            Ok::<(), GpuError>(())
        })?;
        Ok(())
    }

    fn time_of(&mut self, label: &str) -> Result<f64> {
        self.frames.finish()?;
        let passes = &self.frames.finished().passes;
        let time = passes.iter().find(|pass| pass.label == label).map(|pass| pass.ms);
        time.ok_or_else(|| unmeasured("the device gave no time"))
    }

    fn upload(&mut self, bytes: &[u8]) -> Result<Buffer> {
        let (usage, kind) = (BufferUse::Geometry, MemoryUse::Geometry);
        let size = bytes.len() as u64;
        let buffer = Buffer::new(&self.device, "measured input", size, usage, Location::Device, kind)?;
        let mut recorder = self.frames.begin()?;
        recorder.upload(&buffer, 0, bytes)?;
        self.frames.submit(recorder, None)?;
        Ok(buffer)
    }

    fn checked(&self, what: &str, count: u32, limit: u64) -> Result<u32> {
        let asked = u64::from(count);
        if asked > limit {
            return Err(RendererError::Limit { what: what.to_owned(), asked, limit });
        }
        Ok(count.max(1))
    }
}

fn unmeasured(reason: &str) -> RendererError {
    RendererError::Profile { what: String::from(LABEL), reason: reason.to_owned() }
}
