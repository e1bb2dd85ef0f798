//! The built-in surroundings of a scene that brings no light: a soft sky over a grey floor with two large soft boxes,
//! as in a photographer's studio. Made here, so that no file has to be found.

use caustica_renderer::delta::RadianceMap;
use glam::Vec3;

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// A rectangular lamp, as seen from the centre.
struct SoftBox {
    direction: Vec3,
    half_width_rad: f32,
    half_height_rad: f32,
    radiance: Vec3,
}

/// Renders the map. Radiance is about 0.5 overall, so that white surfaces come out near 1 at exposure 0.
pub fn default_sky() -> RadianceMap {
    let boxes = [
        SoftBox {
            direction: Vec3::new(0.55, 0.65, 0.55),
            half_width_rad: 0.42,
            half_height_rad: 0.30,
            radiance: Vec3::new(7.0, 6.6, 6.0),
        },
        SoftBox {
            direction: Vec3::new(-0.9, 0.35, 0.1),
            half_width_rad: 0.20,
            half_height_rad: 0.45,
            radiance: Vec3::new(2.6, 2.9, 3.3),
        },
    ];
    let mut rgb = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let direction = direction_of((x as f32 + 0.5) / WIDTH as f32, (y as f32 + 0.5) / HEIGHT as f32);
            let lamps: Vec3 = boxes.iter().map(|lamp| lamp.radiance * coverage(lamp, direction)).sum();
            rgb.push((backdrop(direction) + lamps).to_array());
        }
    }
    RadianceMap { name: String::from("built-in sky"), width: WIDTH, height: HEIGHT, rgb }
}

/// Direction of a texel: u = 0.5 looks along -Z, v = 0 is the zenith.
fn direction_of(u: f32, v: f32) -> Vec3 {
    let (azimuth, polar) = ((u - 0.5) * std::f32::consts::TAU, v * std::f32::consts::PI);
    Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

/// Sky above, floor below, a soft horizon between.
fn backdrop(direction: Vec3) -> Vec3 {
    let horizon = Vec3::new(0.55, 0.57, 0.60);
    let zenith = Vec3::new(0.28, 0.36, 0.52);
    let floor = Vec3::new(0.20, 0.19, 0.18);
    if direction.y >= 0.0 {
        horizon.lerp(zenith, direction.y.sqrt())
    } else {
        horizon.lerp(floor, (-direction.y * 4.0).min(1.0))
    }
}

/// How much of a lamp is seen in a direction, with soft edges.
fn coverage(lamp: &SoftBox, direction: Vec3) -> f32 {
    let axis = lamp.direction.normalize();
    let right = axis.cross(Vec3::Y).normalize_or(Vec3::X);
    let up = right.cross(axis);
    let depth = direction.dot(axis);
    if depth <= 0.0 {
        return 0.0;
    }
    let edge = |along: f32, half: f32| {
        let angle = (along / depth).atan().abs();
        ((half - angle) / 0.06 + 0.5).clamp(0.0, 1.0)
    };
    edge(direction.dot(right), lamp.half_width_rad) * edge(direction.dot(up), lamp.half_height_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_is_finite_and_of_reasonable_brightness() {
        let map = default_sky();
        assert_eq!(map.rgb.len(), (map.width * map.height) as usize);
        assert!(map.rgb.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        let mean = map.rgb.iter().flatten().sum::<f32>() / (map.rgb.len() * 3) as f32;
        assert!((0.3..1.5).contains(&mean), "{mean}");
    }
}
