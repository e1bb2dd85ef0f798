//! Shapes of the benchmark scenes, turned on a lathe. Enters: a profile. Leaves: plain vertices and triangles.

use std::f32::consts::TAU;
use std::sync::Arc;

use caustica_scene::import::Imported;
use caustica_scene::{Material, MaterialId, Mesh, MeshData, Prefab, Primitive, SkinData};
use glam::{DAffine3, Vec2, Vec3, Vec4};

/// Vertices of a surface of revolution around y, one run of `segments + 1` a point of the profile.
pub(super) struct Lathe {
    pub(super) positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
    tex_coords: Vec<Vec2>,
    indices: Vec<u32>,
}

/// Turns a profile of (radius, height), from the bottom up, around y. Triangles without area at the poles are left out.
pub(super) fn lathe(profile: &[Vec2], segments: u32) -> Lathe {
    let mut made = Lathe {
        positions: Vec::new(),
        normals: Vec::new(),
        tangents: Vec::new(),
        tex_coords: Vec::new(),
        indices: Vec::new(),
    };
    let point = |k: usize| profile.get(k).copied().unwrap_or_default();
    let row = segments + 1;
    for k in 0..profile.len() {
        let along = point((k + 1).min(profile.len() - 1)) - point(k.saturating_sub(1));
        let outward = Vec2::new(along.y, -along.x).normalize_or(Vec2::X);
        for j in 0..row {
            let share = j as f32 / segments as f32;
            let (sin, cos) = (TAU * share).sin_cos();
            made.positions.push(Vec3::new(point(k).x * cos, point(k).y, point(k).x * sin));
            made.normals.push(Vec3::new(outward.x * cos, outward.y, outward.x * sin));
            made.tangents.push(Vec4::new(-sin, 0.0, cos, 1.0));
            made.tex_coords.push(Vec2::new(share, k as f32 / profile.len() as f32));
        }
    }
    for k in 1..profile.len() {
        for j in 0..segments {
            let low = (k as u32 - 1) * row + j;
            let high = low + row;
            if point(k).x > 0.0 {
                made.indices.extend([low, high, high + 1]);
            }
            if point(k - 1).x > 0.0 {
                made.indices.extend([low, high + 1, low + 1]);
            }
        }
    }
    made
}

/// A ball of diameter 1 around the origin.
fn ball(segments: u32) -> Lathe {
    let rings = segments / 2;
    let at = |k: u32| {
        let (sin, cos) = (TAU * 0.5 * k as f32 / rings as f32).sin_cos();
        // The sine of pi is not zero in single precision, and the poles must be points.
        Vec2::new(if k == 0 || k == rings { 0.0 } else { 0.5 * sin }, -0.5 * cos)
    };
    lathe(&(0..=rings).map(at).collect::<Vec<_>>(), segments)
}

/// The small meshes that crowds are made of, each about 1 m large, and [`LONE_MESH`] last; with four materials.
pub(super) fn props() -> Imported {
    let profile = |points: &[[f32; 2]]| points.iter().map(|p| Vec2::from_array(*p)).collect::<Vec<_>>();
    let made = [
        lathe(&profile(&[[0.0, -0.5], [0.5, -0.5], [0.5, 0.5], [0.0, 0.5]]), 4),
        lathe(&profile(&[[0.0, -0.5], [0.5, -0.5], [0.0, 0.5]]), 6),
        lathe(&profile(&[[0.0, -0.5], [0.5, 0.0], [0.0, 0.5]]), 4),
        ball(8),
        ball(64),
    ];
    let colours =
        [Vec3::new(0.7, 0.2, 0.1), Vec3::new(0.1, 0.5, 0.2), Vec3::new(0.2, 0.3, 0.7), Vec3::splat(0.6)];
    let material = |colour: Vec3| Material {
        base_color: colour.extend(1.0),
        metallic: 0.0,
        roughness: 0.8,
        ..Material::default()
    };
    Imported {
        prefab: Prefab::new("props", ""),
        meshes: made.into_iter().map(|made| mesh_of(made, None)).collect(),
        materials: colours.map(material).into(),
        ..Imported::default()
    }
}

/// Index among the props of the mesh that only one node of a scene uses.
pub(super) const LONE_MESH: usize = 4;

/// A mesh of one primitive; a skin may bend it.
pub(super) fn mesh_of(made: Lathe, skin: Option<SkinData>) -> Mesh {
    let primitive = Primitive {
        first_index: 0,
        index_count: made.indices.len() as u32,
        material: MaterialId(0),
        mesh_from_primitive: DAffine3::IDENTITY,
    };
    let data = MeshData {
        positions: made.positions,
        normals: made.normals,
        tangents: made.tangents,
        tex_coords0: made.tex_coords,
        indices: made.indices,
        skin,
        ..MeshData::default()
    };
    Mesh::new(String::from("prop"), Arc::new(data), vec![primitive])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_has_an_area_and_looks_outward() {
        let imported = props();
        for mesh in &imported.meshes {
            let data = &mesh.data;
            let at = |i: u32| (data.positions[i as usize], data.normals[i as usize]);
            for triangle in data.indices.chunks_exact(3) {
                let [(a, na), (b, nb), (c, nc)] = [at(triangle[0]), at(triangle[1]), at(triangle[2])];
                let facing = (b - a).cross(c - a);
                assert!(facing.length() > 1e-6 && facing.dot(na + nb + nc) > 0.0, "{triangle:?}");
            }
            assert!(data.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
            let (low, high) = mesh.bounds.unwrap_or_default();
            assert!((high - low).max_element() <= 1.0 + 1e-6);
        }
        assert!(imported.meshes.len() == LONE_MESH + 1);
    }
}
