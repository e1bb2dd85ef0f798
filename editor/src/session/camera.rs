//! The camera of a view: in double precision, free of the document's cameras once it was placed.

use anyhow::bail;
use caustica_scene::{Document, Placed, Projection, rigid};
use glam::{DAffine3, DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A camera that looks along its -Z, +Y is up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewCamera {
    /// Camera space to world space, a rotation and a translation in metres.
    pub world_from_camera: DAffine3,
    /// Projection.
    pub projection: Projection,
    /// Nothing nearer than this is drawn, metres.
    pub near_m: f64,
}

impl Default for ViewCamera {
    fn default() -> Self {
        Self::looking_at(DVec3::new(3.0, 2.2, 4.0), DVec3::ZERO, 0.7, 0.01)
    }
}

impl ViewCamera {
    /// A camera at `eye` that looks at `target` with the full vertical angle `yfov_rad`.
    pub fn looking_at(eye: DVec3, target: DVec3, yfov_rad: f32, near_m: f64) -> Self {
        let back = (eye - target).try_normalize().unwrap_or(DVec3::Z);
        let right = DVec3::Y.cross(back).try_normalize().unwrap_or(DVec3::X);
        let rotation = DMat3::from_cols(right, back.cross(right), back);
        Self {
            world_from_camera: DAffine3::from_mat3_translation(rotation, eye),
            projection: Projection::Perspective { yfov_rad },
            near_m,
        }
    }

    /// A camera of the document.
    pub fn of_placed(camera: &Placed<caustica_scene::Camera>) -> Self {
        Self {
            world_from_camera: rigid(&camera.world_from_node),
            projection: camera.value.projection,
            near_m: f64::from(camera.value.near_m),
        }
    }

    /// The document's camera of this name.
    ///
    /// # Errors
    /// With the names there are, when it is none of them.
    pub fn named(document: &Document, name: &str) -> anyhow::Result<Self> {
        let Some(camera) = document.find_camera(name) else {
            let known = document.camera_names();
            let known = if known.is_empty() { String::from("the file has none") } else { known.join(", ") };
            bail!("no camera '{name}'; there is: {known}");
        };
        Ok(Self::of_placed(&camera))
    }

    /// The document's main camera, else one that frames everything in an image of width / height `aspect`.
    pub fn of_document(document: &Document, aspect: f64) -> Self {
        match (document.main_camera(), document.bounds()) {
            (Some(camera), _) => Self::of_placed(&camera),
            (None, Some((low, high))) => Self::framing(low, high, aspect),
            (None, None) => Self::default(),
        }
    }

    /// A camera that sees the box from above its front right, in an image of width / height `aspect`.
    pub fn framing(low: DVec3, high: DVec3, aspect: f64) -> Self {
        const YFOV_RAD: f32 = 0.7;
        let centre = (low + high) * 0.5;
        let radius = ((high - low).length() * 0.5).max(1e-9);
        let half_angle = ((f64::from(YFOV_RAD) * 0.5).tan() * aspect.clamp(0.01, 1.0)).atan();
        let distance = radius / half_angle.sin();
        let eye = centre + DVec3::new(0.55, 0.35, 1.0).normalize() * distance;
        Self::looking_at(eye, centre, YFOV_RAD, (distance - radius).max(radius * 0.01) * 0.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn framing_looks_at_the_centre_from_outside() {
        let camera = ViewCamera::framing(DVec3::splat(-1.0), DVec3::new(3.0, 1.0, 1.0), 1.0);
        let forward = -camera.world_from_camera.z_axis;
        let to_centre = (DVec3::new(1.0, 0.0, 0.0) - camera.world_from_camera.translation).normalize();
        assert!(forward.dot(to_centre) > 1.0 - 1e-9);
        assert!((camera.world_from_camera.matrix3.determinant() - 1.0).abs() < 1e-12);
        assert!(camera.near_m > 0.0);
    }
}
