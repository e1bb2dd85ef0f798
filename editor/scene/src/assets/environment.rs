//! What surrounds the scene: nothing, a constant, the built-in sky or a map from a file.
//! Plain data; the map is loaded elsewhere.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::project::EnvironmentRecord;

/// What shines is cut at this radiance, far above every real light, so that a sum of samples stays finite.
pub const MAX_RADIANCE: f32 = 1e15;

/// What surrounds the scene, as the document says it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "EnvironmentRecord", into = "EnvironmentRecord")]
pub enum Environment {
    /// Nothing was said: see [`crate::Document::effective_environment`].
    #[default]
    Auto,
    /// The built-in sky.
    DefaultSky,
    /// The same radiance from everywhere; black: none.
    Constant(Vec3),
    /// An equirectangular image file.
    File(EnvironmentFile),
}

/// An environment read from a file.
#[derive(Clone, Debug)]
pub struct EnvironmentFile {
    /// Where it was read.
    pub path: PathBuf,
    /// Turn around +Y, radians.
    pub rotation_rad: f32,
    /// Multiplies the map.
    pub scale: f32,
    /// What was read; `None` when the file is missing: then it is black, and said so.
    pub map: Option<Arc<RadianceMap>>,
}

impl PartialEq for Environment {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Auto, Self::Auto) | (Self::DefaultSky, Self::DefaultSky) => true,
            (Self::Constant(a), Self::Constant(b)) => a == b,
            (Self::File(a), Self::File(b)) => a == b,
            _ => false,
        }
    }
}

impl PartialEq for EnvironmentFile {
    fn eq(&self, other: &Self) -> bool {
        let same_map = match (&self.map, &other.map) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a == b,
            (None, None) => true,
            _ => false,
        };
        self.path == other.path
            && self.rotation_rad == other.rotation_rad
            && self.scale == other.scale
            && same_map
    }
}

/// Linear radiance in an equirectangular layout, first row at the zenith, +Y up, u = 0.5 looks along -Z.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RadianceMap {
    /// Shown in messages.
    pub name: String,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width * height` values, finite and not negative.
    pub rgb: Vec<[f32; 3]>,
}
