//! Rotations as three angles for number fields. Enters and leaves: unit rotations and degrees about X, then Y, then Z
//! (fixed axes). The angles stay what was typed for as long as they still mean the rotation that is shown.

use caustica_scene::Target;
use glam::{DQuat, DVec3, EulerRot};

/// The rotation that turns by `degrees.x` about X, then by `y` about Y, then by `z` about Z.
pub fn rotation_from_degrees(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// Angles that mean the rotation; of the many, those nearest to zero that the decomposition gives.
pub fn degrees_from_rotation(rotation: DQuat) -> DVec3 {
    let (z, y, x) = rotation.to_euler(EulerRot::ZYX);
    // Minus zero looks odd in a number field.
    DVec3::new(x, y, z).map(|angle| angle.to_degrees() + 0.0)
}

/// The angles shown in the inspector.
#[derive(Clone, Copy, Debug, Default)]
pub struct EulerFields {
    shown: Option<(Target, DQuat, DVec3)>,
}

impl EulerFields {
    /// The angles to show for a target with this rotation.
    pub fn degrees(&mut self, target: Target, rotation: DQuat) -> DVec3 {
        if let Some((whose, meant, degrees)) = self.shown
            && whose == target
            && meant.dot(rotation).abs() > 1.0 - 1e-12
        {
            return degrees;
        }
        let degrees = degrees_from_rotation(rotation);
        self.shown = Some((target, rotation, degrees));
        degrees
    }

    /// Keeps angles that the user set; gives the rotation they mean.
    pub fn set(&mut self, target: Target, degrees: DVec3) -> DQuat {
        let rotation = rotation_from_degrees(degrees);
        self.shown = Some((target, rotation, degrees));
        rotation
    }
}

#[cfg(test)]
mod tests {
    use caustica_scene::NodeId;

    use super::*;

    const TARGET: Target = Target::node(NodeId(1));

    #[test]
    fn angles_and_rotations_go_round() {
        for x in (-180..=180).step_by(30) {
            for y in (-90..=90).step_by(15) {
                for z in (-180..=180).step_by(45) {
                    let rotation =
                        rotation_from_degrees(DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
                    let again = rotation_from_degrees(degrees_from_rotation(rotation));
                    assert!(again.dot(rotation).abs() > 1.0 - 1e-9, "{x} {y} {z}");
                }
            }
        }
    }

    #[test]
    fn x_comes_first_then_y_then_z() {
        let rotation = rotation_from_degrees(DVec3::new(90.0, 0.0, 90.0));
        // +Y goes to +Z by the turn about X, and stays there under the turn about Z.
        assert!((rotation * DVec3::Y - DVec3::Z).length() < 1e-12);
        assert!((rotation * DVec3::X - DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn typed_angles_do_not_jump_also_where_they_are_not_unique() {
        let mut fields = EulerFields::default();
        let typed = DVec3::new(20.0, 90.0, 400.0);
        let rotation = fields.set(TARGET, typed);
        assert_eq!(fields.degrees(TARGET, rotation), typed);
        assert_eq!(fields.degrees(TARGET, -rotation), typed, "a quaternion and its negative mean the same");
        let other = Target::node(NodeId(2));
        assert_ne!(fields.degrees(other, rotation), typed, "another object shows its own angles");
    }

    #[test]
    fn a_rotation_from_elsewhere_replaces_them() {
        let mut fields = EulerFields::default();
        fields.set(TARGET, DVec3::new(10.0, 0.0, 0.0));
        let degrees = fields.degrees(TARGET, rotation_from_degrees(DVec3::new(0.0, 30.0, 0.0)));
        assert!((degrees - DVec3::new(0.0, 30.0, 0.0)).length() < 1e-9);
    }
}
