//! What the renderer reads back from the device: radiance, the display image, what is under a pixel. Waits for the device.

use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Frames, Image, Location, MemoryUse};

use super::{Accumulated, PickHit, Renderer};
use crate::error::{RendererError, Result};
use crate::frame;
use crate::gpu_types::AccumulatorPixel;
use crate::view::{CameraMatrices, ViewId};

impl Renderer {
    /// Reads the accumulated image of a view. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_back(&mut self, frames: &mut Frames, id: ViewId) -> Result<Accumulated> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let accumulator = self.view(id)?.accumulator.as_ref().ok_or_else(nothing)?;
        let size = accumulator.size();
        let kind = MemoryUse::Staging;
        let host =
            Buffer::new(&self.device, "read-back", size, BufferUse::General, Location::ReadBack, kind)?;
        let mut recorder = frames.begin()?;
        let slot = recorder.slot();
        recorder.copy_buffer(accumulator, &host, size)?;
        let counters = &self.view(id)?.counters;
        let copied = &counters.host[slot % counters.host.len()];
        recorder.copy_buffer(&counters.device, copied, counters.device.size())?;
        frames.submit(recorder, None)?;
        frames.finish()?;
        let view = self.view_mut(id)?;
        frame::read_counters(view, slot);
        Ok(mean_of(bytemuck::cast_slice(host.mapped()), view.extent(), view.accumulation.samples()))
    }

    /// Reads the tone-mapped image of a view: linear RGBA half floats as floats. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_display(&mut self, frames: &mut Frames, id: ViewId) -> Result<Vec<[f32; 4]>> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let image = self.view(id)?.display_image().ok_or_else(nothing)?;
        let halves: Vec<u16> = words_of(&read_image(&self.device, frames, image)?);
        Ok(halves.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|i| half_to_float(p[i]))).collect())
    }

    /// Reads the radiance of the last frame of a view, denoised where that frame was. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_frame(&mut self, frames: &mut Frames, id: ViewId) -> Result<Vec<[f32; 3]>> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let (_, targets) = self.view(id)?.targets.as_ref().ok_or_else(nothing)?;
        let floats: Vec<f32> = words_of(&read_image(&self.device, frames, &targets.shaded)?);
        Ok(floats.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect())
    }

    /// What is seen through a pixel in the last frame. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed, or the device fails.
    pub fn pick(&mut self, frames: &mut Frames, id: ViewId, pixel: [u32; 2]) -> Result<Option<PickHit>> {
        let view = self.view(id)?;
        let (Some((_, targets)), Some(parity)) = (view.targets.as_ref(), view.seen) else { return Ok(None) };
        if (0..2).any(|i| pixel[i] >= view.extent()[i]) {
            return Ok(None);
        }
        let depth = &targets.depth[parity % targets.depth.len()];
        let mut recorder = frames.begin()?;
        recorder.copy_to_buffer(&targets.id, pixel, [1, 1], &self.picked, 0)?;
        recorder.copy_to_buffer(depth, pixel, [1, 1], &self.picked, 16)?;
        frames.submit(recorder, None)?;
        frames.finish()?;
        let words: Vec<u32> = words_of(&self.picked.mapped()[..20]);
        let depth = f32::from_bits(words[4]);
        let Some(slot) = words[0].checked_sub(1).and_then(|slot| self.tables.instances.get(slot)) else {
            return Ok(None);
        };
        let matrices = CameraMatrices::of(view.camera(), view.extent());
        Ok(Some(PickHit {
            instance: slot.id,
            geometry: words[1] & 0x7fff_ffff,
            distance_m: (!matrices.orthographic && depth > 0.0).then(|| matrices.near_m / depth),
        }))
    }
}

fn read_image(device: &Arc<Device>, frames: &mut Frames, image: &Image) -> Result<Vec<u8>> {
    let [width, height] = image.extent();
    let size = u64::from(width) * u64::from(height) * image.desc().format.texel_bytes();
    let kind = MemoryUse::Staging;
    let host = Buffer::new(device, "read-back", size, BufferUse::General, Location::ReadBack, kind)?;
    let mut recorder = frames.begin()?;
    recorder.copy_to_buffer(image, [0, 0], [width, height], &host, 0)?;
    frames.submit(recorder, None)?;
    frames.finish()?;
    Ok(host.mapped().to_vec())
}

/// Copies bytes into a vector of plain values, whatever their alignment.
fn words_of<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

/// Mean and half difference of the two streams, in double precision.
fn mean_of(pixels: &[AccumulatorPixel], extent: [u32; 2], samples: u64) -> Accumulated {
    let count = extent[0] as usize * extent[1] as usize;
    let (mut mean, mut half_difference) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for pixel in pixels.iter().take(count) {
        let sums = [0, 1].map(|s| {
            let stream = &pixel.stream[s];
            [0, 1, 2, 3]
                .map(|c| f64::from(stream.high[c]) + f64::from(stream.low[c]) + f64::from(stream.block[c]))
        });
        let n = sums[0][3] + sums[1][3];
        let channel = |c: usize| if n > 0.0 { (sums[0][c] + sums[1][c]) / n } else { 0.0 };
        let of_stream =
            |s: usize, c: usize| if sums[s][3] > 0.0 { sums[s][c] / sums[s][3] } else { channel(c) };
        mean.push([0, 1, 2].map(|c| channel(c) as f32));
        half_difference.push([0, 1, 2].map(|c| (0.5 * (of_stream(0, c) - of_stream(1, c))) as f32));
    }
    Accumulated { extent, samples, mean, half_difference }
}

/// IEEE 754 binary16 to binary32.
fn half_to_float(half: u16) -> f32 {
    let sign = if half & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from((half >> 10) & 0x1f), f32::from(half & 0x3ff));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_become_floats() {
        for (half, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x0001, 5.960_464_5e-8), (0x7bff, 65504.0)] {
            assert_eq!(half_to_float(half), value);
        }
        assert!(half_to_float(0x7e00).is_nan());
    }
}
