//! A skinned tube that sways, as an imported file would be. Enters: how many clips. Leaves: prefab, skin, mesh and clips.

use std::sync::Arc;

use caustica_scene::import::Imported;
use caustica_scene::{
    Animation, Channel, ChannelPath, Interpolation, Material, MeshId, PartNode, Prefab, Skin, SkinData, Trs,
};
use glam::{DAffine3, DVec3, Quat, Vec2};

use super::shapes::{lathe, mesh_of};

/// Joints of the skin, one above the other.
pub(super) const JOINTS: u32 = 16;
const SEGMENTS: u32 = 20;
/// With [`SEGMENTS`] these make 2000 triangles.
const RINGS: u32 = 51;
const HEIGHT_M: f32 = 2.0;
const RADIUS_M: f32 = 0.15;
/// Keys of a clip, and their distance.
const KEYS: u16 = 49;
const KEY_S: f32 = 1.0 / 24.0;

/// Triangles of the tube.
pub(super) const fn triangles() -> u32 {
    (RINGS - 1) * SEGMENTS * 2
}

/// A tube with `clips` clips, each at another phase, so that no two instances need be in the same pose.
pub(super) fn tube(clips: usize) -> anyhow::Result<Imported> {
    let between_m = f64::from(HEIGHT_M) / f64::from(JOINTS - 1);
    let mut parts =
        vec![PartNode { mesh: Some(MeshId(0)), skin: Some(0), visible: true, ..PartNode::default() }];
    parts.extend((0..JOINTS).map(|joint| PartNode {
        parent: joint.checked_sub(1).map(|below| below + 1),
        local: Trs::from_translation(if joint == 0 { DVec3::ZERO } else { DVec3::Y * between_m }).into(),
        visible: true,
        ..PartNode::default()
    }));
    let mut prefab = Prefab::new("tube", "");
    let at_rest = |joint: u32| DAffine3::from_translation(DVec3::NEG_Y * between_m * f64::from(joint));
    prefab.set_skins(vec![Skin {
        joints: (1..=JOINTS).collect(),
        inverse_bind: (0..JOINTS).map(at_rest).collect(),
    }]);
    prefab.set_nodes(parts)?;
    prefab.animations = (0..clips).map(|clip| Arc::new(sway(clip as f32 * 0.37))).collect();
    let height = |ring: u32| HEIGHT_M * ring as f32 / (RINGS - 1) as f32;
    let profile: Vec<Vec2> = (0..RINGS).map(|ring| Vec2::new(RADIUS_M, height(ring))).collect();
    let made = lathe(&profile, SEGMENTS);
    let heights_m: Vec<f32> = made.positions.iter().map(|position| position.y).collect();
    let meshes = vec![mesh_of(made, Some(held(&heights_m)))];
    let material = Material { metallic: 0.0, roughness: 0.8, ..Material::default() };
    Ok(Imported { prefab, meshes, materials: vec![material], ..Imported::default() })
}

/// Every vertex hangs on the two joints next to it.
fn held(heights_m: &[f32]) -> SkinData {
    let of_vertex = |height_m: &f32| {
        let at = height_m / HEIGHT_M * (JOINTS - 1) as f32;
        let below = at.floor().clamp(0.0, (JOINTS - 1) as f32);
        let upper = (at - below).clamp(0.0, 1.0);
        // Where the weight is 0 the joint is 0.
        let joints =
            if upper > 0.0 { [below as u16, below as u16 + 1, 0, 0] } else { [below as u16, 0, 0, 0] };
        (joints, [1.0 - upper, upper, 0.0, 0.0])
    };
    let (joints, weights) = heights_m.iter().map(of_vertex).unzip();
    SkinData { joints, weights }
}

/// Every joint turns a little against the one below it, as sea grass does.
fn sway(phase_rad: f32) -> Animation {
    let times_s: Arc<[f32]> = (0..KEYS).map(|key| f32::from(key) * KEY_S).collect();
    let turn = |joint: u32, time_s: f32| {
        let angle_rad = 0.08 * (time_s * std::f32::consts::PI + joint as f32 * 0.4 + phase_rad).sin();
        Quat::from_rotation_z(angle_rad).to_array()
    };
    let channel = |joint: u32| Channel {
        part: joint + 1,
        path: ChannelPath::Rotation,
        interpolation: Interpolation::Linear,
        values: times_s.iter().flat_map(|time_s| turn(joint, *time_s)).collect(),
        times_s: Arc::clone(&times_s),
    };
    Animation::new("sway", (0..JOINTS).map(channel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tube_has_its_triangles_and_whole_weights() {
        let tube = tube(3).unwrap_or_default();
        assert_eq!((triangles(), tube.meshes[0].triangle_count()), (2000, 2000));
        assert_eq!(tube.prefab.animations.len(), 3);
        let skin = tube.meshes[0].data.skin.clone().unwrap_or_default();
        assert_eq!(skin.weights.len(), tube.meshes[0].data.positions.len());
        for (joints, weights) in skin.joints.iter().zip(&skin.weights) {
            assert!(joints.iter().all(|joint| u32::from(*joint) < JOINTS));
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6 && weights.iter().all(|w| *w >= 0.0));
            assert!(joints.iter().zip(weights).all(|(joint, weight)| *weight > 0.0 || *joint == 0));
        }
    }
}
