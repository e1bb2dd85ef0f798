//! Meshes that are built from attributes of a few vertices.

use super::*;

fn triangle(p: Vec3, q: Vec3, r: Vec3) -> Arc<Attributes> {
    Arc::new(Attributes { positions: vec![p, q, r], ..Attributes::default() })
}

fn finished(builder: MeshBuilder<'_>) -> Mesh {
    let empty = || Mesh::new("refused".to_owned(), Arc::default(), Vec::new());
    builder.finish(String::new()).unwrap_or_else(|_| empty())
}

fn build(attributes: &Arc<Attributes>, indices: Vec<u32>) -> (Mesh, Repairs) {
    let mut builder = MeshBuilder::default();
    let input = PrimitiveInput { attributes, indices, material: MaterialId(0), normal_map_tex_coord: None };
    assert!(builder.add(input).is_ok());
    let repairs = builder.repairs;
    (finished(builder), repairs)
}

#[test]
fn missing_normals_are_flat() {
    let (mesh, _) = build(&triangle(Vec3::ZERO, Vec3::X, Vec3::Y), vec![0, 1, 2]);
    assert_eq!(mesh.data.normals, vec![Vec3::Z; 3]);
    let tangent = mesh.data.tangents[0];
    assert!(tangent.truncate().dot(Vec3::Z).abs() < 1e-6);
}

#[test]
fn triangles_without_area_or_with_nan_are_dropped_and_counted() {
    let bad = triangle(Vec3::ZERO, Vec3::X, Vec3::X * 2.0);
    let (mesh, repairs) = build(&bad, vec![0, 1, 2, 0, 0, 1]);
    assert_eq!(mesh.triangle_count(), 0);
    assert_eq!(repairs.degenerate_triangles, 2);
    let nan = triangle(Vec3::ZERO, Vec3::X, Vec3::NAN);
    let (_, repairs) = build(&nan, vec![0, 1, 2]);
    assert_eq!(repairs.non_finite_triangles, 1);
}

#[test]
fn tiny_and_huge_triangles_have_area() {
    for scale in [1e-30_f32, 1e-6, 1.0, 1e6, 1e18] {
        assert!(!has_no_area(Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale), "scale {scale}");
    }
}

#[test]
fn primitives_that_share_attributes_share_vertices() {
    let mut quad =
        Attributes { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE], ..Attributes::default() };
    quad.normals = Some(vec![Vec3::Z; 4]);
    let quad = Arc::new(quad);
    let mut builder = MeshBuilder::default();
    for indices in [vec![0, 1, 2], vec![1, 3, 2]] {
        let input = PrimitiveInput {
            attributes: &quad,
            indices,
            material: MaterialId(0),
            normal_map_tex_coord: None,
        };
        assert_eq!(builder.add(input), Ok(true));
    }
    let mesh = finished(builder);
    assert_eq!(mesh.data.positions.len(), 4);
    assert_eq!(mesh.primitives.len(), 2);
}
