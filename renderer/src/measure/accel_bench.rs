//! What acceleration structures cost on a device, by the device's own clock. Enters: how many triangles, boxes or
//! instances. Leaves: milliseconds and bytes. Inputs are generated, lie in spatial order and in memory of the device.

use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, Background, BackgroundWork, BoxGeometry, Buffer,
    BufferUse, BuildMode, BuildPreference, Device, Frames, GpuError, Location, MemoryUse, Recorder,
    ResourceId, Stage, TlasInstances, TriangleGeometry, Use, pack_instance,
};
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::error::{RendererError, Result};
use crate::tables::order_of;

/// Label of the timed pass.
const LABEL: &str = "measure.accel";
/// Unmeasured runs, at the least and at most; they end once the device has worked for `WARM_UP_MS`.
const WARM_UPS: (usize, usize) = (2, 32);
const WARM_UP_MS: f64 = 20.0;
/// Measured runs, at the least and at most; they end once the device has worked for `SAMPLES_MS`.
const SAMPLES: (usize, usize) = (5, 15);
const SAMPLES_MS: f64 = 400.0;

const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

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

/// Measures on one device. Every run is a frame of its own that is waited for.
pub struct AccelBench<'a> {
    device: Arc<Device>,
    frames: &'a mut Frames,
    background: Background,
    /// Stands for all structures and scratch memory: one build after the other.
    group: ResourceId,
}

/// A structure and the scratch memory for its builds.
struct Room {
    structure: AccelStructure,
    scratch: Buffer,
    alignment: u64,
}

impl Room {
    fn build<'a>(
        &'a self,
        geometry: AccelGeometry<'a>,
        preference: BuildPreference,
        mode: BuildMode,
    ) -> AccelBuild<'a> {
        let scratch = self.scratch.address().next_multiple_of(self.alignment);
        AccelBuild { target: &self.structure, geometry, preference, mode, scratch }
    }
}

impl<'a> AccelBench<'a> {
    /// Prepares to measure.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, frames: &'a mut Frames) -> Result<Self> {
        Ok(Self {
            device: Arc::clone(device),
            frames,
            background: Background::new(device)?,
            group: device.new_resource_id(),
        })
    }

    /// A BLAS of `count` triangles (at least 1): a bumpy grid.
    ///
    /// # Errors
    /// [`RendererError::Limit`] for more than the device takes; when memory runs out; when the device fails.
    pub fn triangles(&mut self, count: u32) -> Result<BlasTimes> {
        let count = self.checked("triangles", count, self.device.limits().max_primitives)?;
        let (positions, indices) = bumpy_grid(count);
        let vertex_count = positions.len() as u32;
        let positions = self.upload(bytemuck::cast_slice(&positions))?;
        let indices = self.upload(bytemuck::cast_slice(&indices))?;
        let transform = self.upload(bytemuck::cast_slice(&IDENTITY))?;
        let list = [TriangleGeometry {
            positions: positions.address(),
            vertex_count,
            indices: indices.address(),
            triangle_count: count,
            transform: transform.address(),
            opaque: true,
        }];
        self.blas(AccelGeometry::Triangles(&list), count, &[&positions, &indices, &transform])
    }

    /// A BLAS of `count` boxes (at least 1) scattered in a cube.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn boxes(&mut self, count: u32) -> Result<BlasTimes> {
        let count = self.checked("boxes", count, self.device.limits().max_primitives)?;
        let boxes = self.upload(bytemuck::cast_slice(&scattered_boxes(count)))?;
        let list = [BoxGeometry { boxes: boxes.address(), count, opaque: true }];
        self.blas(AccelGeometry::Boxes(&list), count, &[&boxes])
    }

    /// A TLAS of `count` instances (at least 1) of one cube, scattered in a cube.
    ///
    /// # Errors
    /// As [`Self::triangles`].
    pub fn instances(&mut self, count: u32) -> Result<TlasTimes> {
        let count = self.checked("instances", count, self.device.limits().max_instances)?;
        let positions = self.upload(bytemuck::cast_slice(&CUBE_POSITIONS))?;
        let indices = self.upload(bytemuck::cast_slice(&CUBE_INDICES))?;
        let transform = self.upload(bytemuck::cast_slice(&IDENTITY))?;
        let cube = [TriangleGeometry {
            positions: positions.address(),
            vertex_count: CUBE_POSITIONS.len() as u32,
            indices: indices.address(),
            triangle_count: CUBE_INDICES.len() as u32,
            transform: transform.address(),
            opaque: true,
        }];
        let preference = BuildPreference::FastTrace;
        let cube_shape = AccelGeometry::Triangles(&cube);
        let blas = self.room(cube_shape, preference)?;
        let build = blas.build(cube_shape, preference, BuildMode::Build);
        self.run(&build, &[&positions, &indices, &transform])?;

        let descriptors = self.upload(&scattered_instances(count, blas.structure.address()))?;
        let shape = AccelGeometry::Instances(TlasInstances { descriptors: descriptors.address(), count });
        let tlas = self.room(shape, preference)?;
        let mut time = |mode| self.time_build(&tlas.build(shape, preference, mode), &[&descriptors]);
        Ok(TlasTimes {
            instances: count,
            build_ms: time(BuildMode::Build)?,
            refit_ms: time(BuildMode::Refit)?,
            bytes: tlas.structure.size(),
        })
    }

    fn blas(
        &mut self,
        geometry: AccelGeometry<'_>,
        primitives: u32,
        inputs: &[&Buffer],
    ) -> Result<BlasTimes> {
        let fixed = self.room(geometry, BuildPreference::FastTrace)?;
        let build = fixed.build(geometry, BuildPreference::FastTrace, BuildMode::Build);
        let build_fast_trace_ms = self.time_build(&build, inputs)?;
        let (compact_ms, compacted_bytes) = self.compaction(&fixed.structure)?;
        let bytes = fixed.structure.size();
        drop(fixed);
        let moving = self.room(geometry, BuildPreference::FastBuild)?;
        let mut time =
            |mode| self.time_build(&moving.build(geometry, BuildPreference::FastBuild, mode), inputs);
        Ok(BlasTimes {
            primitives,
            build_fast_trace_ms,
            build_fast_build_ms: time(BuildMode::Build)?,
            refit_ms: time(BuildMode::Refit)?,
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

    fn time_build(&mut self, build: &AccelBuild<'_>, inputs: &[&Buffer]) -> Result<f64> {
        let uses = self.uses(inputs);
        self.median(|recorder| recorder.build(&[*build], &uses))
    }

    /// Builds once, without measuring.
    fn run(&mut self, build: &AccelBuild<'_>, inputs: &[&Buffer]) -> Result<()> {
        let uses = self.uses(inputs);
        self.once(&mut |recorder| recorder.build(&[*build], &uses)).map(|_| ())
    }

    fn uses<'b>(&self, inputs: &[&'b Buffer]) -> Vec<Use<'b>> {
        let read = |buffer: &&'b Buffer| Use::Buffer(buffer, Stage::AccelBuild, Access::BuildInput);
        let written = Use::Group(self.group, Stage::AccelBuild, Access::AccelWrite);
        inputs.iter().map(read).chain([written]).collect()
    }

    /// Median milliseconds of what `record` records. The first runs are not counted: clocks rise, caches fill.
    fn median(&mut self, mut record: impl FnMut(&mut Recorder)) -> Result<f64> {
        self.repeat(WARM_UPS, WARM_UP_MS, &mut record)?;
        let mut times = self.repeat(SAMPLES, SAMPLES_MS, &mut record)?;
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied().ok_or_else(|| unmeasured("no run"))
    }

    fn repeat(
        &mut self,
        (least, most): (usize, usize),
        enough_ms: f64,
        record: &mut impl FnMut(&mut Recorder),
    ) -> Result<Vec<f64>> {
        let mut times = Vec::with_capacity(most);
        let mut spent_ms = 0.0;
        while times.len() < least || (times.len() < most && spent_ms < enough_ms) {
            let ms = self.once(record)?;
            spent_ms += ms;
            times.push(ms);
        }
        Ok(times)
    }

    fn once(&mut self, record: &mut impl FnMut(&mut Recorder)) -> Result<f64> {
        let mut recorder = self.frames.begin()?;
        recorder.pass(LABEL, |recorder| {
            record(recorder);
            Ok::<(), GpuError>(())
        })?;
        self.frames.submit(recorder, None)?;
        self.frames.finish()?;
        let passes = &self.frames.finished().passes;
        let time = passes.iter().find(|pass| pass.label == LABEL).map(|pass| pass.ms);
        time.ok_or_else(|| unmeasured("the device gave no time"))
    }

    fn room(&self, geometry: AccelGeometry<'_>, preference: BuildPreference) -> Result<Room> {
        let sizes = self.device.build_sizes(geometry, preference);
        let top_level = matches!(geometry, AccelGeometry::Instances(_));
        let alignment = self.device.limits().scratch_alignment.max(1);
        let scratch_bytes = sizes.build_scratch.max(sizes.refit_scratch) + alignment;
        let (usage, kind) = (BufferUse::General, MemoryUse::AccelerationStructures);
        Ok(Room {
            structure: AccelStructure::new(&self.device, "measured", sizes.structure, top_level)?,
            scratch: Buffer::new(&self.device, "scratch", scratch_bytes, usage, Location::Device, kind)?,
            alignment,
        })
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

/// The corners of a unit cube, x first.
const CUBE_POSITIONS: [[f32; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];

const CUBE_INDICES: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// The smallest whole number whose power is at least `count`.
fn side_of(count: u32, power: u32) -> u32 {
    let enough = |side: u32| u64::from(side).pow(power) >= u64::from(count);
    let guess = f64::from(count).powf(1.0 / f64::from(power)) as u32;
    // The root is rounded: the side is one of a few near it.
    (guess.saturating_sub(1).max(1)..).find(|side| enough(*side)).unwrap_or(guess)
}

/// Exactly `count` triangles on a square grid of shared vertices with bumps, along a Morton curve.
fn bumpy_grid(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let side = side_of(count.div_ceil(2), 2);
    let row = side + 1;
    let height = |x: u32, y: u32| (x as f32 * 0.7).sin() * (y as f32 * 0.45).cos();
    let positions =
        (0..row).flat_map(|y| (0..row).map(move |x| [x as f32, y as f32, height(x, y)])).collect();
    let cells: Vec<DVec3> =
        (0..side).flat_map(|y| (0..side).map(move |x| DVec3::new(f64::from(x), f64::from(y), 0.0))).collect();
    let triangles = order_of(&cells)
        .into_iter()
        .flat_map(|cell| {
            let corner = cell / side * row + cell % side;
            [[corner, corner + 1, corner + row], [corner + 1, corner + row + 1, corner + row]]
        })
        .take(count as usize)
        .collect();
    (positions, triangles)
}

/// `count` cells of a cube of cells 2 apart, along a Morton curve.
fn scattered(count: u32) -> impl Iterator<Item = (u32, Vec3)> {
    let side = side_of(count, 3);
    let at =
        move |i: u32| DVec3::new(f64::from(i % side), f64::from(i / side % side), f64::from(i / side / side));
    let cells: Vec<DVec3> = (0..count).map(at).collect();
    order_of(&cells).into_iter().map(move |i| (i, at(i).as_vec3() * 2.0))
}

/// Boxes of sides 0.5 to 1.5.
fn scattered_boxes(count: u32) -> Vec<[f32; 6]> {
    scattered(count)
        .map(|(i, low)| {
            let high = low + 0.5 + (i % 11) as f32 * 0.1;
            [low.x, low.y, low.z, high.x, high.y, high.z]
        })
        .collect()
}

/// Packed descriptors of unit cubes.
fn scattered_instances(count: u32, blas_address: u64) -> Vec<u8> {
    scattered(count)
        .flat_map(|(i, at)| {
            let mut transform = IDENTITY;
            for (row, shift) in transform.iter_mut().zip(at.to_array()) {
                row[3] = shift;
            }
            pack_instance(transform, i, 0xff, 0, blas_address)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_holds_the_count_and_no_less_would() {
        for (count, power) in [(1, 2), (2, 2), (4, 2), (5, 2), (50_000, 2), (27, 3), (28, 3), (2_000_000, 3)]
        {
            let side = side_of(count, power);
            assert!(u64::from(side).pow(power) >= u64::from(count), "{side} for {count}");
            assert!(u64::from(side - 1).pow(power) < u64::from(count), "{side} for {count}");
        }
    }

    #[test]
    fn the_grid_has_the_triangles_asked_for_each_once() {
        for count in [1, 2, 7, 1000] {
            let (positions, mut triangles) = bumpy_grid(count);
            assert_eq!(triangles.len(), count as usize);
            assert!(triangles.iter().flatten().all(|vertex| (*vertex as usize) < positions.len()));
            triangles.sort_unstable();
            triangles.dedup();
            assert_eq!(triangles.len(), count as usize, "no triangle twice");
        }
    }

    #[test]
    fn boxes_and_instances_are_distinct_and_neighbours_lie_together() {
        let boxes = scattered_boxes(1000);
        assert!(boxes.iter().all(|b| b[0] < b[3] && b[1] < b[4] && b[2] < b[5]));
        let near = boxes.windows(2).filter(|pair| {
            let step: f32 = (0..3).map(|axis| (pair[0][axis] - pair[1][axis]).abs()).sum();
            assert!(step > 0.0, "two boxes in one place");
            step <= 4.0
        });
        // Three in four steps of a Morton curve go to a neighbour or across one edge of a block of eight.
        assert!(near.count() > 700);
        assert_eq!(scattered_instances(10, 7).len(), 640);
    }
}
