//! The environment: a constant or an equirectangular map with an alias table by radiance times solid angle.

use std::sync::Arc;

use caustica_gpu::{
    Device, Filter, Format, Frames, Image, ImageDesc, ImageUse, Recorder, Sampler, SamplerDesc, SceneSet,
    WrapMode,
};
use glam::Vec3;

use super::alias;
use super::table::{Download, Table};
use crate::delta::{Environment, RadianceMap};
use crate::error::Result;
use crate::gpu_types::AliasEntry;

/// The environment on the device.
pub(crate) struct EnvironmentTable {
    device: Arc<Device>,
    image: Image,
    sampler: Sampler,
    alias: Table<AliasEntry>,
    grid: (u32, u32),
    radiance: Vec3,
    rotation_rad: f32,
    is_map: bool,
    /// What the image and the alias table hold; turning or dimming it uploads nothing.
    map: Option<Arc<RadianceMap>>,
    stale: Vec<bool>,
}

impl EnvironmentTable {
    pub(crate) fn new(device: &Arc<Device>, recorder: &mut Recorder) -> Result<Self> {
        let sampler = Sampler::new(
            device,
            SamplerDesc {
                mag: Filter::Linear,
                min: Filter::Linear,
                mip: Filter::Nearest,
                mipmaps: false,
                wrap: [WrapMode::Repeat, WrapMode::ClampToEdge],
                anisotropy: 1,
            },
        )?;
        Ok(Self {
            device: Arc::clone(device),
            image: upload(device, recorder, 1, 1, &[[0.0; 3]])?,
            sampler,
            alias: Table::new(device, "environment alias table"),
            grid: (0, 0),
            radiance: Vec3::ZERO,
            rotation_rad: 0.0,
            is_map: false,
            map: None,
            stale: vec![true; Frames::in_flight()],
        })
    }

    /// Takes a new environment.
    pub(crate) fn set(&mut self, recorder: &mut Recorder, environment: &Environment) -> Result<()> {
        match environment {
            Environment::Constant(radiance) => {
                self.grid = (0, 0);
                self.radiance = *radiance;
                self.is_map = false;
            }
            Environment::Equirectangular { map, rotation_rad, scale } => {
                if !self.map.as_ref().is_some_and(|held| Arc::ptr_eq(held, map)) {
                    self.image = upload(&self.device, recorder, map.width, map.height, &map.rgb)?;
                    self.alias.replace(alias::build(&weights_of(map)));
                    self.stale.fill(true);
                    self.map = Some(Arc::clone(map));
                }
                self.grid = (map.width, map.height);
                self.radiance = Vec3::splat(*scale);
                self.rotation_rad = *rotation_rad;
                self.is_map = true;
            }
        }
        Ok(())
    }

    /// Brings the set of a frame that is free to record up to date.
    pub(crate) fn update_set(&mut self, frame_slot: usize, set: &SceneSet) {
        let index = frame_slot % self.stale.len();
        if std::mem::take(&mut self.stale[index]) {
            set.set_environment(&self.image, &self.sampler);
        }
    }

    /// Whether it gives any light.
    pub(crate) fn shines(&self) -> bool {
        self.radiance.max_element() > 0.0
    }

    pub(crate) fn is_map(&self) -> bool {
        self.is_map
    }

    pub(crate) fn grid(&self) -> (u32, u32) {
        self.grid
    }

    pub(crate) fn radiance(&self) -> [f32; 3] {
        self.radiance.to_array()
    }

    pub(crate) fn rotation_rad(&self) -> f32 {
        self.rotation_rad
    }

    pub(crate) fn alias_address(&self) -> u64 {
        self.alias.address()
    }

    /// Records the copy of the alias table back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        self.alias.download(recorder)
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.alias.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.alias.flush(recorder)
    }
}

fn upload(
    device: &Arc<Device>,
    recorder: &mut Recorder,
    width: u32,
    height: u32,
    rgb: &[[f32; 3]],
) -> Result<Image> {
    let desc = ImageDesc {
        extent: [width, height],
        format: Format::Rgba32Float,
        mip_levels: 1,
        usage: ImageUse::Texture,
    };
    let image = Image::new(device, "environment", desc)?;
    let texels: Vec<[f32; 4]> = rgb.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
    recorder.upload_image(&image, bytemuck::cast_slice(&texels))?;
    Ok(image)
}

/// Radiance times solid angle of every texel. The map is looked up with linear filtering, so that light bleeds into
/// neighbours: each texel's weight is the largest of its own and its neighbours' a quarter, so that no direction with
/// radiance has a probability of 0.
fn weights_of(map: &RadianceMap) -> Vec<f64> {
    let (width, height) = (map.width as usize, map.height as usize);
    let luminance = |x: usize, y: usize| {
        let [r, g, b] = map.rgb[y * width + x];
        f64::from(r) * 0.2126 + f64::from(g) * 0.7152 + f64::from(b) * 0.0722
    };
    let band = std::f64::consts::PI / height as f64;
    let mut weights = Vec::with_capacity(width * height);
    for y in 0..height {
        // Exact solid angle of a texel in this row.
        let solid_angle = (y as f64 * band).cos() - ((y + 1) as f64 * band).cos();
        for x in 0..width {
            let mut value = luminance(x, y);
            for dy in [y.saturating_sub(1), y, (y + 1).min(height - 1)] {
                for dx in [(x + width - 1) % width, x, (x + 1) % width] {
                    value = value.max(0.25 * luminance(dx, dy));
                }
            }
            weights.push(value * solid_angle);
        }
    }
    weights
}
