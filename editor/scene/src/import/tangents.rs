//! Tangents: from the normal map's texture coordinates by MikkTSpace, or any that complete a frame.
//! In: positions, normals, texture coordinates. Out: unit tangents with handedness, never zero or NaN.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

/// Square of the length below which a vector has no direction.
const SHORTEST_SQUARED: f64 = 1e-24;
/// A square of the length this close to 1 is that of a unit vector in single precision.
const UNIT_ROUNDING: f64 = 2.5e-7;

/// A tangent that completes an orthonormal frame: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
pub(crate) fn any(normal: Vec3) -> Vec4 {
    let sign = 1.0_f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    Vec4::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x, 1.0)
}

/// The vector at unit length; `None` when it has no direction. In double precision, because the square of a
/// large finite number is not finite in single precision. A unit vector stays as it is, bit for bit: what was
/// exported comes back the same.
pub(super) fn unit(vector: Vec3) -> Option<Vec3> {
    let wide = vector.as_dvec3();
    if (wide.length_squared() - 1.0).abs() <= UNIT_ROUNDING {
        return Some(vector);
    }
    let usable = wide.is_finite() && wide.length_squared() > SHORTEST_SQUARED;
    usable.then(|| wide.normalize().as_vec3())
}

/// The tangent made a unit vector with handedness 1 or -1, or [`any`] when it has no direction beside the normal.
pub(super) fn usable_or_any(tangent: Vec4, normal: Vec3) -> Vec4 {
    let sideways = |xyz: &Vec3| {
        let along = normal * normal.dot(*xyz);
        (*xyz - along).length_squared() > 1e-8
    };
    match unit(tangent.truncate()).filter(sideways) {
        Some(xyz) if tangent.w.is_finite() => xyz.extend(1.0_f32.copysign(tangent.w)),
        _ => any(normal),
    }
}

/// One tangent for each corner, in the order of the indices.
pub(super) fn mikktspace(
    positions: &[Vec3],
    normals: &[Vec3],
    tex_coords: &[Vec2],
    indices: &[u32],
) -> Vec<Vec4> {
    let mut corners =
        Corners { positions, normals, tex_coords, indices, tangents: vec![Vec4::ZERO; indices.len()] };
    let generated = generate_tangents(&mut corners).is_ok();
    let Corners { tangents, .. } = corners;
    let normal_of = |&i: &u32| {
        let normal = normals.get(i as usize).copied();
        normal.and_then(unit).unwrap_or(Vec3::Z)
    };
    tangents
        .into_iter()
        .zip(indices)
        .map(|(tangent, i)| match generated {
            true => usable_or_any(tangent, normal_of(i)),
            false => any(normal_of(i)),
        })
        .collect()
}

struct Corners<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    tex_coords: &'a [Vec2],
    indices: &'a [u32],
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn value<T: Copy + Default>(&self, values: &[T], face: usize, corner: usize) -> T {
        let index = self.indices.get(face * 3 + corner);
        index.and_then(|&i| values.get(i as usize)).copied().unwrap_or_default()
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.value(self.positions, face, corner).to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.value(self.normals, face, corner).normalize_or(Vec3::Z).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.value(self.tex_coords, face, corner);
        if uv.is_finite() { uv.to_array() } else { [0.0; 2] }
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // The bitangent of MikkTSpace goes with growing v, which points down in glTF's images, while the green
        // of a glTF normal map points up (section 3.9.3): the handedness is the opposite one.
        let tangent = space.map_or(Vec4::ZERO, |space| {
            let [x, y, z, w] = space.tangent_encoded();
            Vec4::new(x, y, z, -w)
        });
        if let Some(slot) = self.tangents.get_mut(face * 3 + corner) {
            *slot = tangent;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_completes_a_frame_for_every_direction() {
        let mut normals = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        for i in 0..10_000_u32 {
            let (a, b) = (i as f32 * 0.618_034, (i as f32 + 0.5) / 5_000.0 - 1.0);
            let ring = (1.0 - b * b).sqrt();
            let angle = a.fract() * std::f32::consts::TAU;
            normals.push(Vec3::new(ring * angle.cos(), ring * angle.sin(), b));
        }
        for normal in normals {
            let tangent = any(normal).truncate();
            assert!(tangent.dot(normal).abs() < 1e-6, "{normal} {tangent}");
            assert!((tangent.length() - 1.0).abs() < 1e-6, "{normal} {tangent}");
        }
    }

    #[test]
    fn useless_tangents_are_replaced() {
        for tangent in [Vec4::ZERO, Vec4::NAN, Vec4::new(0.0, 0.0, 2.0, 1.0)] {
            let repaired = usable_or_any(tangent, Vec3::Z);
            assert!(repaired.truncate().dot(Vec3::Z).abs() < 1e-6);
            assert_eq!(repaired.w.abs(), 1.0);
        }
    }

    #[test]
    fn mikktspace_takes_any_finite_vertices() {
        let values = [0.0, 1.0, -1.0, 1e-30, 1e30, f32::MAX, f32::MIN_POSITIVE, 0.5];
        let value = |i: usize| values[(i * 7 + i / 5 + i * i) % values.len()];
        let positions: Vec<Vec3> = (0..60).map(|i| Vec3::new(value(i), value(i + 1), value(3 * i))).collect();
        let normals: Vec<Vec3> = (0..60).map(|i| positions[(i * 11) % 60]).collect();
        let tex_coords: Vec<Vec2> =
            (0..60).map(|i| Vec2::new(value(2 * i), if i % 9 == 0 { f32::NAN } else { value(i) })).collect();
        let indices: Vec<u32> = (0..300).map(|i| (i * 13 + i / 7) % 60).collect();
        for tangent in mikktspace(&positions, &normals, &tex_coords, &indices) {
            assert!((tangent.truncate().length() - 1.0).abs() < 1e-4, "{tangent}");
        }
    }

    #[test]
    fn mikktspace_follows_the_texture() {
        // u along +X; v down in the image is -Y in space, so that the image stands upright.
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let tex_coords = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::ZERO];
        let tangents = mikktspace(&positions, &[Vec3::Z; 3], &tex_coords, &[0, 1, 2]);
        for tangent in tangents {
            assert!((tangent.truncate() - Vec3::X).length() < 1e-6);
            let bitangent = Vec3::Z.cross(tangent.truncate()) * tangent.w;
            assert!((bitangent - Vec3::Y).length() < 1e-6, "green points up in space");
        }
    }
}
