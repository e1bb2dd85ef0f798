//! Moving the eye: orbit, pan, dolly, fly, look, framing and axis views. Enters: a pose and how far to go.
//! Leaves: a pose. Double precision, world up is +Y, a camera looks along -Z. It knows no window and no keys.

use caustica_scene::Projection;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// How close to straight up or down orbiting and looking may come, radians.
const POLE_GAP_RAD: f64 = 0.002;
/// Room around what is framed.
const FRAME_MARGIN: f64 = 1.15;

/// Where the eye is and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Metres, world space.
    pub position: DVec3,
    /// Unit; turns camera space into world space.
    pub rotation: DQuat,
}

/// A view along a world axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisView {
    /// From +Z.
    Front,
    /// From -Z.
    Back,
    /// From +X.
    Right,
    /// From -X.
    Left,
    /// From +Y.
    Top,
    /// From -Y.
    Bottom,
}

impl Pose {
    /// The pose of a rigid `world_from_camera`.
    pub fn from_affine(world_from_camera: &DAffine3) -> Self {
        let rigid = caustica_scene::rigid(world_from_camera);
        Self { position: rigid.translation, rotation: DQuat::from_mat3(&rigid.matrix3).normalize() }
    }

    /// `world_from_camera`.
    pub fn to_affine(self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.rotation, self.position)
    }

    /// Unit viewing direction.
    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    /// Unit direction to the right.
    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    /// Unit direction to the top of the picture.
    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }

    /// The place `distance_m` in front.
    pub fn pivot(&self, distance_m: f64) -> DVec3 {
        self.position + self.forward() * distance_m
    }

    /// Turns in place: `yaw_rad` to the left about world up, `pitch_rad` up.
    pub fn look(self, yaw_rad: f64, pitch_rad: f64) -> Self {
        let elevation = self.forward().y.clamp(-1.0, 1.0).asin();
        let limit = std::f64::consts::FRAC_PI_2 - POLE_GAP_RAD;
        // A camera that already stands past the limit may come back but goes no further.
        let wanted = (elevation + pitch_rad).clamp(elevation.min(-limit), elevation.max(limit));
        let rotation =
            DQuat::from_rotation_y(yaw_rad) * self.rotation * DQuat::from_rotation_x(wanted - elevation);
        Self { rotation: rotation.normalize(), ..self }
    }

    /// Turns around the place `distance_m` in front, which stays where it is on the screen.
    pub fn orbit(self, distance_m: f64, yaw_rad: f64, pitch_rad: f64) -> Self {
        let pivot = self.pivot(distance_m);
        let turned = self.look(yaw_rad, pitch_rad);
        Self { position: pivot - turned.forward() * distance_m, ..turned }
    }

    /// Moves sideways and up by metres.
    pub fn pan(self, right_m: f64, up_m: f64) -> Self {
        Self { position: self.position + self.right() * right_m + self.up() * up_m, ..self }
    }

    /// Moves towards (factor below 1) or away from the place `distance_m` in front; gives the new distance too.
    pub fn dolly(self, distance_m: f64, factor: f64) -> (Self, f64) {
        let distance = (distance_m * factor).clamp(1e-6, 1e9);
        (Self { position: self.pivot(distance_m) - self.forward() * distance, ..self }, distance)
    }

    /// Moves along the camera's own axes: x right, y up, z forward, metres.
    pub fn fly(self, along_m: DVec3) -> Self {
        let step = self.right() * along_m.x + DVec3::Y * along_m.y + self.forward() * along_m.z;
        Self { position: self.position + step, ..self }
    }

    /// Looks at the place `pivot` from `distance_m` along an axis.
    pub fn along_axis(axis: AxisView, pivot: DVec3, distance_m: f64) -> Self {
        let (back, up) = match axis {
            AxisView::Front => (DVec3::Z, DVec3::Y),
            AxisView::Back => (DVec3::NEG_Z, DVec3::Y),
            AxisView::Right => (DVec3::X, DVec3::Y),
            AxisView::Left => (DVec3::NEG_X, DVec3::Y),
            AxisView::Top => (DVec3::Y, DVec3::NEG_Z),
            AxisView::Bottom => (DVec3::NEG_Y, DVec3::Z),
        };
        let rotation = DQuat::from_mat3(&DMat3::from_cols(up.cross(back), up, back));
        Self { position: pivot + back * distance_m, rotation }
    }

    /// Keeps the direction and moves so that the box fits the picture of `aspect` (width over height); gives the
    /// distance to the middle of the box too.
    pub fn frame(self, bounds: (DVec3, DVec3), projection: Projection, aspect: f64) -> (Self, f64) {
        let center = (bounds.0 + bounds.1) * 0.5;
        let radius = ((bounds.1 - bounds.0).length() * 0.5).max(1e-6);
        let distance = match projection {
            Projection::Perspective { yfov_rad } => {
                let half_y = f64::from(yfov_rad) * 0.5;
                let half_x = (half_y.tan() * aspect).atan();
                radius * FRAME_MARGIN / half_y.min(half_x).sin().max(1e-3)
            }
            Projection::Orthographic { .. } => radius * 4.0,
        };
        (Self { position: center - self.forward() * distance, ..self }, distance)
    }
}

/// The half height of an orthographic picture of `aspect` that the box fits; other projections stay as they are.
pub fn framing_projection(bounds: (DVec3, DVec3), projection: Projection, aspect: f64) -> Projection {
    match projection {
        Projection::Perspective { .. } => projection,
        Projection::Orthographic { .. } => {
            let radius = ((bounds.1 - bounds.0).length() * 0.5).max(1e-6);
            Projection::Orthographic { ymag_m: (radius * FRAME_MARGIN / aspect.min(1.0)) as f32 }
        }
    }
}

/// A near plane for looking at things `distance_m` away, metres.
pub fn near_for(distance_m: f64) -> f64 {
    (distance_m * 1e-3).clamp(1e-6, 0.05)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn start() -> Pose {
        Pose { position: DVec3::new(0.0, 1.0, 5.0), rotation: DQuat::IDENTITY }
    }

    #[test]
    fn orbiting_keeps_pivot_and_distance() {
        let pose = start();
        let pivot = pose.pivot(5.0);
        let turned = pose.orbit(5.0, 0.9, 0.4);
        assert!((turned.pivot(5.0) - pivot).length() < 1e-12);
        assert!((turned.position.distance(pivot) - 5.0).abs() < 1e-12);
        assert!(turned.right().y.abs() < 1e-12, "the horizon stays level");
    }

    #[test]
    fn a_quarter_orbit_ends_on_the_axis() {
        let pose = Pose { position: DVec3::new(0.0, 0.0, 5.0), rotation: DQuat::IDENTITY };
        let turned = pose.orbit(5.0, FRAC_PI_2, 0.0);
        assert!((turned.position - DVec3::new(5.0, 0.0, 0.0)).length() < 1e-12);
    }

    #[test]
    fn looking_stops_before_the_pole() {
        let mut pose = start();
        for _ in 0..100 {
            pose = pose.look(0.0, 0.2);
        }
        let elevation = pose.forward().y.asin();
        assert!(elevation < FRAC_PI_2 && elevation > 1.5);
        assert!(pose.look(0.0, -0.5).forward().y < pose.forward().y, "and comes back");
    }

    #[test]
    fn from_a_pole_one_can_look_back() {
        let top = Pose::along_axis(AxisView::Top, DVec3::ZERO, 3.0);
        let back = top.look(0.0, 0.5);
        assert!(back.forward().y > top.forward().y + 0.05);
    }

    #[test]
    fn dolly_scales_the_distance_and_keeps_the_pivot() {
        let pose = start();
        let (near, distance) = pose.dolly(4.0, 0.25);
        assert!((distance - 1.0).abs() < 1e-12);
        assert!((near.pivot(distance) - pose.pivot(4.0)).length() < 1e-12);
    }

    #[test]
    fn a_framed_box_fits_the_picture() {
        let bounds = (DVec3::new(-1.0, -2.0, -3.0), DVec3::new(4.0, 2.0, 1.0));
        let projection = Projection::Perspective { yfov_rad: 0.7 };
        let size = glam::DVec2::new(500.0, 900.0);
        let (pose, _) = start().orbit(5.0, 0.6, -0.3).frame(bounds, projection, size.x / size.y);
        let view = crate::projection::ViewProjection::new(pose.to_affine(), projection, size);
        for corner in 0..8 {
            let pick = |bit: i32, low: f64, high: f64| if corner & bit == 0 { low } else { high };
            let world = DVec3::new(
                pick(1, bounds.0.x, bounds.1.x),
                pick(2, bounds.0.y, bounds.1.y),
                pick(4, bounds.0.z, bounds.1.z),
            );
            let point = view.project(world);
            assert!(
                point.is_some_and(|p| p.cmpge(glam::DVec2::ZERO).all() && p.cmple(size).all()),
                "{point:?}"
            );
        }
    }

    #[test]
    fn axis_views_look_at_the_pivot_with_a_level_picture() {
        let pivot = DVec3::new(1.0, 2.0, 3.0);
        for axis in [
            AxisView::Front,
            AxisView::Back,
            AxisView::Right,
            AxisView::Left,
            AxisView::Top,
            AxisView::Bottom,
        ] {
            let pose = Pose::along_axis(axis, pivot, 7.0);
            assert!((pose.pivot(7.0) - pivot).length() < 1e-12, "{axis:?}");
            assert!((pose.rotation.length() - 1.0).abs() < 1e-12);
            assert!(
                (pose.right().cross(pose.up()) + pose.forward()).length() < 1e-12,
                "{axis:?} is right-handed"
            );
        }
    }

    #[test]
    fn a_pose_survives_its_matrix() {
        let pose = start().look(0.4, -0.2);
        let again = Pose::from_affine(&pose.to_affine());
        assert!(again.rotation.dot(pose.rotation).abs() > 1.0 - 1e-12);
        assert!((again.position - pose.position).length() < 1e-12);
    }
}
