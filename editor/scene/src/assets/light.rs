//! Lights and cameras: their own values, without a place.
//! Both look along their node's -Z; the node gives the place.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A light without a mesh (KHR_lights_punctual, with a size). It shines along its node's -Z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Linear colour.
    pub color: Vec3,
    /// Candela (point, spot) or lux (directional), taken 1:1 as radiant units.
    pub intensity: f32,
    /// Shape.
    pub kind: LightKind,
}

/// Shape of a light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Shines equally to all sides.
    Point {
        /// Radius of the sphere that shines, metres; 0: hard shadows.
        radius_m: f32,
        /// Distance past which nothing arrives, metres; `None`: no end.
        range_m: Option<f32>,
    },
    /// A point light in a cone.
    Spot {
        /// Radius of the sphere that shines, metres; 0: hard shadows.
        radius_m: f32,
        /// Distance past which nothing arrives, metres; `None`: no end.
        range_m: Option<f32>,
        /// Angle from the axis where the fall-off begins, radians.
        inner_rad: f32,
        /// Angle from the axis where the light ends, radians.
        outer_rad: f32,
    },
    /// Light from infinitely far.
    Directional {
        /// Half of the angle under which the source is seen, radians; 0: hard shadows.
        angular_radius_rad: f32,
    },
}

impl Light {
    /// Colour times intensity.
    pub fn radiant(&self) -> Vec3 {
        self.color * self.intensity
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let shape = match self.kind {
            LightKind::Point { radius_m, range_m } => [radius_m, range_m.unwrap_or(0.0), 0.0, 0.0],
            LightKind::Spot { radius_m, range_m, inner_rad, outer_rad } => {
                [radius_m, range_m.unwrap_or(0.0), inner_rad, outer_rad]
            }
            LightKind::Directional { angular_radius_rad } => [angular_radius_rad, 0.0, 0.0, 0.0],
        };
        self.color.is_finite() && self.intensity.is_finite() && shape.iter().all(|v| v.is_finite())
    }

    /// What no lamp can be, in words.
    pub fn faults(&self) -> Vec<&'static str> {
        use std::f32::consts::{FRAC_PI_2, PI};
        let (range_m, cone, sun_rad) = match self.kind {
            LightKind::Point { range_m, .. } => (range_m, None, 0.0),
            LightKind::Spot { range_m, inner_rad, outer_rad, .. } => {
                (range_m, Some((inner_rad, outer_rad)), 0.0)
            }
            LightKind::Directional { angular_radius_rad } => (None, None, angular_radius_rad),
        };
        let faults = [
            (
                self.color.min_element() < 0.0 || self.intensity < 0.0,
                "it takes light away: its intensity is below 0",
            ),
            (
                range_m.is_some_and(|range_m| range_m <= 0.0),
                "its range ends where it stands: it lights nothing",
            ),
            (cone.is_some_and(|(inner, outer)| inner > outer), "its inner cone is wider than the outer one"),
            (
                cone.is_some_and(|(_, outer)| !(0.0..=FRAC_PI_2).contains(&outer)),
                "its cone is no cone: 0 to 90 degrees from the axis",
            ),
            (!(0.0..=PI).contains(&sun_rad), "it is seen under more than the whole sky"),
        ];
        faults.into_iter().filter(|(is_so, _)| *is_so).map(|(_, words)| words).collect()
    }
}

/// A camera; it looks along its node's -Z, +Y is up, the node's scale does not act on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Projection.
    pub projection: Projection,
    /// Nothing nearer than this is drawn, metres, above 0; of a parallel camera at least 0.
    pub near_m: f32,
    /// Nothing farther than this is drawn, metres; `None`: no end. Kept for export, rays have no far plane.
    pub far_m: Option<f32>,
    /// Width by height that the author had in mind, if any.
    pub aspect: Option<f32>,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective { yfov_rad: 0.7 },
            near_m: 0.01,
            far_m: None,
            aspect: None,
        }
    }
}

impl Camera {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let size = match self.projection {
            Projection::Perspective { yfov_rad } => yfov_rad,
            Projection::Orthographic { ymag_m } => ymag_m,
        };
        [size, self.near_m, self.far_m.unwrap_or(0.0), self.aspect.unwrap_or(0.0)]
            .iter()
            .all(|v| v.is_finite())
    }
}

/// How a camera maps directions to the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full vertical angle of view, radians.
        yfov_rad: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the height of the image, metres.
        ymag_m: f32,
    },
}
