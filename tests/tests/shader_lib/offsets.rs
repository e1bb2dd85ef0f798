//! Row 1: where rays leave a triangle, against planes in double precision, over scales, distances and angles.
//! The naive form: a fixed distance along the normal.

use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Mat3, Vec3};

/// One triangle in single precision, the point on it, the way out.
#[derive(Clone, Copy)]
struct Case {
    rows: [[f32; 4]; 3],
    corners: [[f32; 3]; 3],
    barycentric: [f32; 2],
    direction: [f32; 3],
    /// Size of the matrix's largest axis.
    scale: f64,
}

/// Scales 1e-6 to 1e6, vertices and translations up to 1e4 times the triangle's size, anisotropy, mirrors, and rays
/// at 50 to 89.9 degrees from the normal on both sides.
fn cases(count: usize) -> Vec<Case> {
    let mut random = Random::new(5);
    (0..count)
        .map(|_| {
            let scale = random.magnitude(-6.0, 6.0);
            let size = random.magnitude(-3.0, 3.0);
            let squeeze = random.magnitude(-3.0, 0.0);
            let mut axes = DVec3::new(1.0, squeeze, 1.0) * scale;
            if random.unit() < 0.3 {
                axes.x = -axes.x;
            }
            let mut turn = || DMat3::from_quat(DQuat::from_axis_angle(random.direction(), 2.0));
            let matrix = turn() * DMat3::from_diagonal(axes) * turn();
            let translation = random.direction() * scale * size * random.magnitude(-2.0, 4.0);
            let centre = random.direction() * size * random.magnitude(-2.0, 2.0);
            let corners = [0, 1, 2].map(|_| (centre + random.direction() * size).as_vec3().to_array());
            let root = random.unit().sqrt();
            let barycentric = DVec2::new(1.0 - root, random.unit() * root);
            let rows = [0, 1, 2].map(|r| {
                [matrix.x_axis[r], matrix.y_axis[r], matrix.z_axis[r], translation[r]].map(|x| x as f32)
            });
            let mut case = Case {
                rows,
                corners,
                barycentric: barycentric.as_vec2().to_array(),
                direction: [0.0; 3],
                scale,
            };
            let normal = case.plane().1;
            let flat = random.direction();
            let along = (flat - flat.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
            let rise = if random.unit() < 0.5 { 0.1_f64.to_radians() } else { 40_f64.to_radians() };
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            case.direction = (along * rise.cos() + normal * (side * rise.sin())).as_vec3().to_array();
            case
        })
        .collect()
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

impl Case {
    fn matrix(&self) -> DAffine3 {
        let row = |r: usize| self.rows[r].map(f64::from);
        let [a, b, c] = [row(0), row(1), row(2)];
        let column = |k: usize| DVec3::new(a[k], b[k], c[k]);
        DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
    }

    /// A point of the triangle's plane in render space, its unit normal, and the triangle's size.
    fn plane(&self) -> (DVec3, DVec3, f64) {
        let [a, b, c] = self.corners.map(|corner| self.matrix().transform_point3(double(corner)));
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
        (a, normal, (b - a).length().max((c - a).length()))
    }

    /// Whether a ray meets the triangle again, in single precision as a software traversal does it: the ray is taken
    /// into mesh space, then Moeller and Trumbore 1997.
    fn hits_again(&self, origin: Vec3) -> bool {
        let inverse = self.matrix().inverse();
        let linear = Mat3::from_cols(
            inverse.matrix3.x_axis.as_vec3(),
            inverse.matrix3.y_axis.as_vec3(),
            inverse.matrix3.z_axis.as_vec3(),
        );
        let start = linear * origin + inverse.translation.as_vec3();
        let way = linear * Vec3::from_array(self.direction);
        let [a, b, c] = self.corners.map(Vec3::from_array);
        let (edge1, edge2) = (b - a, c - a);
        let p = way.cross(edge2);
        let determinant = edge1.dot(p);
        let from = start - a;
        let u = from.dot(p) / determinant;
        let q = from.cross(edge1);
        let v = way.dot(q) / determinant;
        let t = edge2.dot(q) / determinant;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0
    }
}

/// The 64 floats a case is to the shader: rows, corners, barycentrics, direction.
fn packed(case: &Case) -> Vec<f32> {
    let rows = case.rows.iter().flatten().copied();
    let corners = case.corners.iter().flatten().copied();
    rows.chain(corners).chain(case.barycentric).chain(case.direction).collect()
}

#[test]
fn rays_leave_on_the_right_side_at_every_scale() {
    const COUNT: usize = 300_000;
    let cases = cases(COUNT);
    let input: Vec<f32> = cases.iter().flat_map(packed).collect();
    let body = "
        FloatTable t = FloatTable(inputs.at[0]);
        uint at = 26u * index;
        vec4 rows[3];
        for (uint r = 0u; r < 3u; ++r) {
            rows[r] = vec4(t.at[at + 4u * r], t.at[at + 4u * r + 1u], t.at[at + 4u * r + 2u], t.at[at + 4u * r + 3u]);
        }
        vec3 v[3];
        for (uint k = 0u; k < 3u; ++k) {
            v[k] = vec3(t.at[at + 12u + 3u * k], t.at[at + 13u + 3u * k], t.at[at + 14u + 3u * k]);
        }
        vec2 barycentric = vec2(t.at[at + 21u], t.at[at + 22u]);
        vec3 direction = vec3(t.at[at + 23u], t.at[at + 24u], t.at[at + 25u]);
        SurfacePoint p = surface_point(rows, v[0], v[1], v[2], vec3(0.0), 1.0, barycentric);
        write(0u, spawn_position(p.position, p.normal, p.offset_m, direction));
        write(3u, p.position);
        write(6u, p.normal);
        write(9u, p.offset_m);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/ray_offset.glsl"],
            body,
            values: 10,
            count: COUNT,
            inputs: &[bytes(&input)],
            ..Snippet::default()
        },
    );
    let mut ours = Tally::default();
    let mut naive = Tally::default();
    for (row, case) in values.chunks_exact(10).zip(&cases) {
        assert!(row.iter().all(|x| x.is_finite()), "scale {}: {row:?}", case.scale);
        let vector = |at: usize| Vec3::new(row[at], row[at + 1], row[at + 2]);
        let (position, normal) = (vector(3), vector(6));
        ours.add(case, vector(0), row[9]);
        const FIXED_M: f32 = 1e-2;
        let side = if Vec3::from_array(case.direction).dot(normal) < 0.0 { -FIXED_M } else { FIXED_M };
        naive.add(case, position + side * normal, FIXED_M);
    }
    assert_eq!((ours.wrong_side, ours.self_hits), (0, 0), "of {COUNT}");
    // The offset stays far below the triangle's size wherever the size is above the rounding of its place.
    assert!(
        ours.leaps < COUNT / 100,
        "{} offsets of {COUNT} exceed a hundredth of their triangle",
        ours.leaps
    );
    assert!(naive.wrong_side > COUNT / 100, "naive: wrong side {}", naive.wrong_side);
    assert!(naive.self_hits > COUNT / 200, "naive: self hits {}", naive.self_hits);
    assert!(naive.leaps > COUNT / 3, "naive: leaps {}", naive.leaps);
}

#[derive(Default)]
struct Tally {
    wrong_side: usize,
    self_hits: usize,
    leaps: usize,
}

impl Tally {
    fn add(&mut self, case: &Case, origin: Vec3, offset_m: f32) {
        let (point, normal, size) = case.plane();
        let side = double(case.direction).dot(normal).signum() * (origin.as_dvec3() - point).dot(normal);
        self.wrong_side += usize::from(side <= 0.0);
        self.self_hits += usize::from(case.hits_again(origin));
        self.leaps += usize::from(f64::from(offset_m) > 0.01 * size);
    }
}

#[test]
fn the_line_of_a_pixel_finds_its_own_point() {
    const COUNT: usize = 20_000;
    let mut random = Random::new(9);
    let mut input = Vec::new();
    let mut expected = Vec::new();
    for _ in 0..COUNT {
        let scale = random.magnitude(-6.0, 6.0);
        let corners = [0, 1, 2].map(|_| ((random.direction() + DVec3::NEG_Z * 4.0) * scale).as_vec3());
        let root = random.unit().sqrt();
        let (u, v) = (1.0 - root, random.unit() * root);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let target = a + (b - a) * u + (c - a) * v;
        input.extend(corners.iter().flat_map(|corner| corner.to_array()));
        input.extend(target.normalize().as_vec3().to_array());
        // A needle seen along its edge has no well-defined point.
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let facing = normal.dot(target.normalize()).abs();
        let width = (b - a).cross(c - a).length() / (b - a).length().max((c - a).length()) / scale;
        expected.push((facing > 0.05 && width > 0.05).then_some((u, v)));
    }
    let body = "
        FloatTable t = FloatTable(inputs.at[0]);
        vec3 v[4];
        for (uint k = 0u; k < 4u; ++k) {
            v[k] = vec3(t.at[12u * index + 3u * k], t.at[12u * index + 3u * k + 1u], t.at[12u * index + 3u * k + 2u]);
        }
        vec2 b = line_barycentric(vec3(0.0), v[3], v[0], v[1], v[2]);
        write(0u, b.x); write(1u, b.y);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/ray_offset.glsl"],
            body,
            values: 2,
            count: COUNT,
            inputs: &[bytes(&input)],
            ..Snippet::default()
        },
    );
    let mut worst = 0.0_f64;
    for (row, expected) in values.chunks_exact(2).zip(&expected) {
        assert!(row.iter().all(|x| x.is_finite()));
        if let Some((u, v)) = expected {
            worst = worst.max((f64::from(row[0]) - u).abs()).max((f64::from(row[1]) - v).abs());
        }
    }
    assert!(worst < 1e-3, "{worst}");
}
