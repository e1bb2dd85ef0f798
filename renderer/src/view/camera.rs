//! Matrices of a camera. Camera space: x right, y up, looking along -z. Clip space is Vulkan's: y down, reverse depth
//! (1 at the near plane, 0 at infinity). Jitter is applied to the clip matrix alone, so that raster and rays agree.

use glam::{Mat4, Vec2, Vec4};

use crate::delta::{Camera, Projection};
use crate::gpu_types::Rows;
use crate::tables::rows_of;

/// An orthographic camera sees this many heights of its image deep.
const ORTHOGRAPHIC_DEPTH: f32 = 1e4;

/// What the passes need of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraMatrices {
    /// Without jitter.
    pub(crate) clip_from_render: Mat4,
    pub(crate) render_from_camera: Rows,
    /// Tangents of half the angles of view, or half width and height in metres.
    pub(crate) half_extent: Vec2,
    pub(crate) near_m: f32,
    pub(crate) orthographic: bool,
}

impl CameraMatrices {
    pub(crate) fn of(camera: &Camera, extent: [u32; 2]) -> Self {
        let aspect = extent[0] as f32 / extent[1] as f32;
        let near_m = if camera.near_m.is_finite() { camera.near_m.max(1e-9) } else { 0.01 };
        let camera_from_render = Mat4::from(camera.render_from_camera.inverse());
        let (projection, half_extent, orthographic) = match camera.projection {
            Projection::Perspective { yfov_rad } => {
                let half_height = (yfov_rad.clamp(1e-4, 3.1) * 0.5).tan();
                let half = Vec2::new(half_height * aspect, half_height);
                let projection = Mat4::from_cols(
                    Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
                    Vec4::new(0.0, -1.0 / half.y, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, 0.0, -1.0),
                    Vec4::new(0.0, 0.0, near_m, 0.0),
                );
                (projection, half, false)
            }
            Projection::Orthographic { ymag_m } => {
                let half = Vec2::new(ymag_m * aspect, ymag_m);
                let far_m = near_m + ymag_m * ORTHOGRAPHIC_DEPTH;
                let depth = 1.0 / (far_m - near_m);
                let projection = Mat4::from_cols(
                    Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
                    Vec4::new(0.0, -1.0 / half.y, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, depth, 0.0),
                    Vec4::new(0.0, 0.0, far_m * depth, 1.0),
                );
                (projection, half, true)
            }
        };
        Self {
            clip_from_render: projection * camera_from_render,
            render_from_camera: rows_of(&camera.render_from_camera),
            half_extent,
            near_m,
            orthographic,
        }
    }

    /// The clip matrix moved so that the sample at the pixel's centre plus `jitter_px` falls onto the centre.
    pub(crate) fn jittered(&self, jitter_px: Vec2, extent: [u32; 2]) -> Mat4 {
        let shift = -2.0 * jitter_px / Vec2::new(extent[0] as f32, extent[1] as f32);
        // Multiplied by w before the division: the shift is in normalised device coordinates.
        let mut result = self.clip_from_render;
        for column in [&mut result.x_axis, &mut result.y_axis, &mut result.z_axis, &mut result.w_axis] {
            *column += Vec4::new(shift.x * column.w, shift.y * column.w, 0.0, 0.0);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec3};

    fn camera() -> Camera {
        Camera {
            render_from_camera: Affine3A::IDENTITY,
            projection: Projection::Perspective { yfov_rad: 1.0 },
            near_m: 0.1,
        }
    }

    #[test]
    fn depth_is_one_at_the_near_plane_and_falls_to_zero() {
        let matrices = CameraMatrices::of(&camera(), [200, 100]);
        let near = matrices.clip_from_render.project_point3(Vec3::new(0.0, 0.0, -0.1));
        let far = matrices.clip_from_render.project_point3(Vec3::new(0.0, 0.0, -1e7));
        assert!((near.z - 1.0).abs() < 1e-6 && far.z > 0.0 && far.z < 1e-7);
    }

    #[test]
    fn up_is_up_and_the_edges_are_at_one() {
        let matrices = CameraMatrices::of(&camera(), [200, 100]);
        let top =
            matrices.clip_from_render.project_point3(Vec3::new(2.0 * 0.5_f32.tan(), 0.5_f32.tan(), -1.0));
        assert!((top.x - 1.0).abs() < 1e-6 && (top.y + 1.0).abs() < 1e-6);
    }

    #[test]
    fn jitter_moves_the_image_by_its_pixels() {
        let extent = [200, 100];
        let matrices = CameraMatrices::of(&camera(), extent);
        let jitter = Vec2::new(0.25, -0.5);
        let point = Vec3::new(0.3, 0.2, -4.0);
        let pixels = |m: Mat4| (m.project_point3(point).truncate() * 0.5 + 0.5) * Vec2::new(200.0, 100.0);
        let moved = pixels(matrices.jittered(jitter, extent)) - pixels(matrices.clip_from_render);
        assert!((moved + jitter).abs().max_element() < 1e-4, "{moved}");
    }
}
