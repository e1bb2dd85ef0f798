//! Rows 6, 7 and 8: normals in 32 bits, normals under any matrix, frames around any direction.

use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::{Random, is_near};
use glam::{DMat3, DQuat, DVec3};

/// Random directions, the axes, and directions that all but are an axis.
fn directions(count: usize) -> Vec<[f32; 3]> {
    let mut random = Random::new(1);
    let mut list = Vec::with_capacity(count);
    for axis in DVec3::AXES {
        for sign in [-1.0, 1.0] {
            list.push(axis * sign);
            for tiny in [1e-3, 1e-6, 1e-12, 1e-25, 1e-38] {
                list.push((axis * sign + DVec3::new(tiny, -tiny, tiny) * (DVec3::ONE - axis)).normalize());
            }
        }
    }
    list.resize_with(count, || random.direction());
    list.into_iter().map(|d| d.as_vec3().to_array()).collect()
}

fn vector(values: &[f32]) -> DVec3 {
    DVec3::new(f64::from(values[0]), f64::from(values[1]), f64::from(values[2]))
}

/// Angle between two vectors, exact for small ones.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[test]
fn octahedral_normals_keep_their_direction() {
    let list = directions(200_000);
    let mut session = session();
    // Naive: three channels of 8 bits, as in a classic G-buffer.
    let body = "
        vec3 n = Vec3Table(inputs.at[0]).at[index];
        write(0u, octahedral_decode(octahedral_encode(n)));
        write(3u, normalize(unpackSnorm4x8(packSnorm4x8(vec4(n, 0.0))).xyz));";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/octahedral.glsl"],
            body,
            values: 6,
            count: list.len(),
            inputs: &[bytes(&list)],
            ..Snippet::default()
        },
    );
    let worst = |at: usize| {
        let errors = values.chunks_exact(6).zip(&list).map(|(row, n)| angle(vector(&row[at..]), vector(n)));
        errors.fold(0.0, f64::max)
    };
    assert!(worst(0) < 6.5e-5, "octahedral: {} rad", worst(0));
    assert!(worst(3) > 5e-3, "8 bits are expected to be coarse: {} rad", worst(3));
}

#[test]
fn frames_are_orthonormal_around_every_direction() {
    let list = directions(1_000_000);
    let mut session = session();
    let body = "
        mat3 m = basis_around(Vec3Table(inputs.at[0]).at[index]);
        write(0u, m[0]); write(3u, m[1]); write(6u, m[2]);";
    let input = [bytes(&list)];
    let snippet = Snippet {
        includes: &["lib/basis.glsl"],
        body,
        values: 9,
        count: list.len(),
        inputs: &input,
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let worst = values.chunks_exact(9).map(frame_error).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst}");

    // Naive: an up vector that is exchanged only when it equals the direction.
    let body = "
        vec3 l = Vec3Table(inputs.at[0]).at[index];
        vec3 up = l == vec3(0.0, 1.0, 0.0) ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
        vec3 t = normalize(cross(up, l));
        write(0u, t); write(3u, cross(l, t)); write(6u, l);";
    let naive = run(&mut session, &Snippet { body, count: 64, ..snippet });
    let broken = naive.chunks_exact(9).filter(|row| !is_near(frame_error(row), 0.0, 1e-6)).count();
    assert!(broken > 0, "the naive frame is expected to break beside its up vector");
}

/// Largest entry of M^T M - 1; infinite where the frame is left-handed or not a number.
fn frame_error(row: &[f32]) -> f64 {
    let m = DMat3::from_cols(vector(row), vector(&row[3..]), vector(&row[6..]));
    if m.determinant().is_nan() || m.determinant() <= 0.0 {
        return f64::INFINITY;
    }
    let e = m.transpose() * m - DMat3::IDENTITY;
    e.to_cols_array().into_iter().fold(0.0, |worst, x| if x.abs() > worst { x.abs() } else { worst })
}

/// A matrix (rows of four), a normal and two tangents whose dot products with it are exactly 0.
struct Case {
    rows: [[f32; 4]; 3],
    normal: DVec3,
    tangents: [DVec3; 2],
}

fn normal_cases() -> Vec<Case> {
    let mut random = Random::new(7);
    let mut cases = Vec::new();
    for i in 0..20_000 {
        let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let size = random.magnitude(-18.0, 12.0);
        let mut scale = DVec3::from_array([0, 1, 2].map(|_| size * random.magnitude(-3.0, 3.0)));
        if i % 3 == 0 {
            scale.x = -scale.x;
        }
        // One axis in five is squeezed to nothing.
        let flat = i % 5 == 0;
        if flat {
            scale[i % 3] = 0.0;
        }
        let m = DMat3::from_quat(turn) * DMat3::from_diagonal(scale);
        let row = |r: usize| [m.x_axis[r] as f32, m.y_axis[r] as f32, m.z_axis[r] as f32, 1.0];
        // An axis of the mesh, or a diagonal between two, whose perpendiculars are exact.
        let (axis, next, last) = (i % 3, (i + 1) % 3, (i + 2) % 3);
        let diagonal = i % 2 == 0 && !flat;
        let (a, b) = if diagonal {
            (random.between(0.1, 1.0) as f32, random.between(0.1, 1.0) as f32)
        } else {
            (1.0, 0.0)
        };
        let mut normal = DVec3::ZERO;
        (normal[axis], normal[next]) = (f64::from(a), f64::from(b));
        let mut first = DVec3::ZERO;
        (first[axis], first[next]) = (f64::from(-b), f64::from(a));
        let mut second = DVec3::ZERO;
        second[last] = 1.0;
        cases.push(Case { rows: [row(0), row(1), row(2)], normal, tangents: [first, second] });
    }
    cases
}

impl Case {
    fn tangent(&self, which: usize) -> DVec3 {
        let t = self.tangents[which];
        DVec3::from_array([0, 1, 2].map(|r| vector(&self.rows[r]).dot(t)))
    }

    /// Worst cosine between a normal and the two tangents; tangents that are squeezed away do not count.
    fn fault(&self, normal: DVec3) -> f64 {
        let largest = self.tangent(0).length().max(self.tangent(1).length());
        let mut worst = 0.0_f64;
        for which in 0..2 {
            let tangent = self.tangent(which);
            if tangent.length() > 1e-12 * largest {
                let cosine = normal.dot(tangent) / normal.length() / tangent.length();
                worst = if cosine.is_nan() { f64::INFINITY } else { worst.max(cosine.abs()) };
            }
        }
        worst
    }
}

#[test]
fn normals_stand_upright_under_any_matrix() {
    let cases = normal_cases();
    let rows: Vec<[[f32; 4]; 3]> = cases.iter().map(|case| case.rows).collect();
    let normals: Vec<[f32; 3]> = cases.iter().map(|case| case.normal.as_vec3().to_array()).collect();
    let functions = "
        layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RowTable { vec4 at[]; };";
    // Naive: transpose(inverse(model)) at every hit.
    let body = "
        RowTable table = RowTable(inputs.at[0]);
        vec4 rows[3] = vec4[3](table.at[3u * index], table.at[3u * index + 1u], table.at[3u * index + 2u]);
        vec3 n = Vec3Table(inputs.at[1]).at[index];
        write(0u, normalize_or(n * cofactor_rows(rows), vec3(0.0)));
        mat3 m = transpose(mat3(rows[0].xyz, rows[1].xyz, rows[2].xyz));
        write(3u, normalize(transpose(inverse(m)) * n));
        write(6u, determinant_sign(rows));";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/vector.glsl"],
            functions,
            body,
            values: 7,
            count: cases.len(),
            inputs: &[bytes(&rows), bytes(&normals)],
            ..Snippet::default()
        },
    );
    let (mut worst, mut naive_broken, mut upright) = (0.0_f64, 0, 0);
    for (i, (row, case)) in values.chunks_exact(7).zip(&cases).enumerate() {
        let normal = vector(row);
        if normal == DVec3::ZERO {
            // The normal's own plane is squeezed to a line: no direction is right.
            assert_eq!(i % 5, 0, "a regular matrix lost its normal");
            continue;
        }
        upright += 1;
        worst = worst.max(case.fault(normal));
        naive_broken += usize::from(case.fault(vector(&row[3..])) > 1e-6);
        if i % 5 != 0 {
            assert_eq!(row[6] < 0.0, i % 3 == 0, "case {i}: the sign of the determinant");
        }
    }
    assert!(upright > cases.len() * 8 / 10);
    assert!(worst < 1e-6, "{worst}");
    assert!(naive_broken > cases.len() / 10, "the naive normal is expected to break: {naive_broken}");
}
