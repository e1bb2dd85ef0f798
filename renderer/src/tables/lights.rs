//! Punctual lights with an alias table by power.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{Device, Recorder};
use glam::Vec3;

use super::alias;
use super::table::{Download, Table};
use crate::delta::{Light, LightId, SceneDelta};
use crate::error::Result;
use crate::gpu_types::{self, LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SPOT};

/// All lights, by id.
pub(crate) struct Lights {
    by_id: BTreeMap<LightId, Light>,
    table: Table<gpu_types::Light>,
    alias: Table<gpu_types::AliasEntry>,
}

impl Lights {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            by_id: BTreeMap::new(),
            table: Table::new(device, "lights"),
            alias: Table::new(device, "light alias table"),
        }
    }

    /// Takes the lights of a delta in.
    pub(crate) fn apply(&mut self, delta: &SceneDelta) {
        if delta.lights.is_empty() && delta.removed_lights.is_empty() {
            return;
        }
        for id in &delta.removed_lights {
            self.by_id.remove(id);
        }
        for (id, light) in &delta.lights {
            self.by_id.insert(*id, *light);
        }
        let shining: Vec<Light> =
            self.by_id.values().copied().filter(|light| power_of(light) > 0.0).collect();
        let entries = alias::build(&selection_weights(&shining));
        self.table
            .replace(shining.iter().zip(&entries).map(|(light, entry)| pack(light, entry.pdf)).collect());
        self.alias.replace(entries);
    }

    /// Lights that shine.
    pub(crate) fn len(&self) -> u32 {
        self.table.len() as u32
    }

    /// Number in the table of a light that shines; `None`: of the first.
    pub(crate) fn index_of(&self, id: Option<LightId>) -> Option<u32> {
        let mut shining = self.by_id.iter().filter(|(_, light)| power_of(light) > 0.0);
        let index = shining.position(|(other, _)| id.is_none_or(|id| id == *other))?;
        u32::try_from(index).ok()
    }

    /// Whether every light is a point, so that one ray decides its shadow.
    pub(crate) fn all_hard(&self) -> bool {
        self.by_id.values().all(|light| match light {
            Light::Point { radius_m, .. } | Light::Spot { radius_m, .. } => *radius_m <= 0.0,
            Light::Directional { angular_radius_rad, .. } => *angular_radius_rad <= 0.0,
        })
    }

    pub(crate) fn address(&self) -> u64 {
        self.table.address()
    }

    pub(crate) fn alias_address(&self) -> u64 {
        self.alias.address()
    }

    /// Records the copy of the table back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        self.table.download(recorder)
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.table.is_dirty() || self.alias.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.table.flush(recorder)?;
        self.alias.flush(recorder)
    }
}

fn luminance(rgb: Vec3) -> f64 {
    f64::from(rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722)))
}

/// Probabilities of choosing a light: half by power, half alike. The share of a directional light in the power depends
/// on the size of the scene, which is not known here; the equal half bounds every sample's weight by twice the number
/// of lights at any scale.
fn selection_weights(lights: &[Light]) -> Vec<f64> {
    let total: f64 = lights.iter().map(power_of).sum();
    lights.iter().map(|light| 0.5 / lights.len() as f64 + 0.5 * power_of(light) / total).collect()
}

/// A weight for choosing lights: radiant power of a point light, and of a directional light over a few square metres.
fn power_of(light: &Light) -> f64 {
    use std::f64::consts::PI;
    let power = match light {
        Light::Point { intensity, .. } => 4.0 * PI * luminance(*intensity),
        Light::Spot { intensity, cos_outer, .. } => {
            2.0 * PI * (1.0 - f64::from(*cos_outer)) * luminance(*intensity)
        }
        Light::Directional { irradiance, .. } => 10.0 * PI * luminance(*irradiance),
    };
    if power.is_finite() { power.max(0.0) } else { 0.0 }
}

fn pack(light: &Light, selection_pdf: f32) -> gpu_types::Light {
    let none = gpu_types::Light { selection_pdf, ..bytemuck::Zeroable::zeroed() };
    let limit = |range_m: f32| if range_m.is_finite() { range_m } else { 0.0 };
    match *light {
        Light::Point { position, intensity, radius_m, range_m } => gpu_types::Light {
            kind: LIGHT_POINT,
            position: position.to_array(),
            intensity: intensity.to_array(),
            radius_m,
            range_m: limit(range_m),
            ..none
        },
        Light::Spot { position, direction, intensity, radius_m, range_m, cos_inner, cos_outer } => {
            gpu_types::Light {
                kind: LIGHT_SPOT,
                position: position.to_array(),
                direction: direction.to_array(),
                intensity: intensity.to_array(),
                radius_m,
                range_m: limit(range_m),
                cos_inner,
                cos_outer,
                ..none
            }
        }
        Light::Directional { direction, irradiance, angular_radius_rad } => gpu_types::Light {
            kind: LIGHT_DIRECTIONAL,
            direction: direction.to_array(),
            intensity: irradiance.to_array(),
            angular_radius_rad,
            ..none
        },
    }
}
