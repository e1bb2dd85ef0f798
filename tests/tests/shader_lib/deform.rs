//! Vertices that follow a pose against double precision: morph targets and joints through the whole pass, normals under
//! uneven, mirrored and flattened blends. The naive forms: normals by the matrix itself, joints as a plain weighted sum.

use caustica_renderer::gpu_types::{DeformJob, JointInfluences, MorphUse, Rows, VertexAttributes};
use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::{DMat3, DQuat, DVec3, DVec4};

use crate::table_pass::TablePass;

const JOINTS: u32 = 300;
/// Half a unit in the last place of 1.
const ROUNDING: f64 = 5.960_464_477_539_063e-8;

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// The linear part of a map, and its translation.
fn map_of(rows: &Rows) -> (DMat3, DVec3) {
    let rows = rows.map(|row| DVec4::from_array(row.map(f64::from)));
    let linear = DMat3::from_cols(rows[0].truncate(), rows[1].truncate(), rows[2].truncate()).transpose();
    (linear, DVec3::new(rows[0].w, rows[1].w, rows[2].w))
}

fn cofactor(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

fn absolute(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// A turn, an uneven scale and another turn; three in ten mirror.
fn random_rows(random: &mut Random) -> Rows {
    let mut axes =
        DVec3::new(random.magnitude(-1.0, 1.0), random.magnitude(-1.0, 1.0), random.magnitude(-1.0, 1.0));
    if random.unit() < 0.3 {
        axes.x = -axes.x;
    }
    let mut turn = || DMat3::from_quat(DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0)));
    let linear = turn() * DMat3::from_diagonal(axes) * turn();
    let translation = random.direction() * random.magnitude(-2.0, 2.0);
    [0, 1, 2].map(|r| {
        [linear.x_axis[r], linear.y_axis[r], linear.z_axis[r], translation[r]].map(|entry| entry as f32)
    })
}

/// A mesh with everything that deforms, in the form that the pass reads.
struct Deforming {
    positions: Vec<[f32; 3]>,
    attributes: Vec<VertexAttributes>,
    influences: Vec<JointInfluences>,
    joints: Vec<Rows>,
    targets: Vec<Target>,
}

/// Offsets of positions, normals and tangents, with the weight.
type Target = ([Vec<[f32; 3]>; 3], f32);

fn deforming(vertices: usize) -> Deforming {
    let mut random = Random::new(77);
    let mut list = |size: f64| -> Vec<[f32; 3]> {
        (0..vertices).map(|_| single(random.direction() * size * random.unit())).collect()
    };
    let positions = list(2.0);
    // The second target leaves normals and tangents alone, the third the positions.
    let targets = vec![
        ([list(1.0), list(0.3), list(0.3)], 0.75),
        ([list(1.0), Vec::new(), Vec::new()], -1.5),
        ([Vec::new(), list(0.3), list(0.3)], 0.25),
    ];
    let joints: Vec<Rows> = (0..JOINTS).map(|_| random_rows(&mut random)).collect();
    let attributes = (0..vertices).map(|_| random_attributes(&mut random)).collect();
    let influences = (0..vertices).map(|vertex| random_influences(&mut random, vertex)).collect();
    Deforming { positions, attributes, influences, joints, targets }
}

fn random_attributes(random: &mut Random) -> VertexAttributes {
    let normal = random.direction();
    let tangent = normal.any_orthonormal_vector().as_vec3();
    let hand = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    VertexAttributes {
        normal: single(normal),
        tangent: tangent.extend(hand).to_array(),
        tex_coord0: [random.unit() as f32, 3.0],
        tex_coord1: [random.unit() as f32, -4.0],
        color_rg: random.bits() as u32,
        color_ba: random.bits() as u32,
    }
}

/// Four joints; a fifth of the vertices follow one alone, a fifth none.
fn random_influences(random: &mut Random, vertex: usize) -> JointInfluences {
    let mut pair = || (random.bits() as u32 % JOINTS) | ((random.bits() as u32 % JOINTS) << 16);
    let (joints_01, joints_23) = (pair(), pair());
    let mut weights = [0, 1, 2, 3].map(|_| random.unit());
    weights.sort_by(|a, b| b.total_cmp(a));
    match vertex % 5 {
        0 => weights = [1.0, 0.0, 0.0, 0.0],
        1 => weights = [0.0; 4],
        _ => {}
    }
    let sum = weights.iter().sum::<f64>().max(1e-9);
    JointInfluences { joints_01, joints_23, weights: weights.map(|weight| (weight / sum) as f32) }
}

impl Deforming {
    /// The sum of rest and weighted offsets, and the same of their magnitudes.
    fn morphed(&self, list: usize, vertex: usize, rest: DVec3) -> (DVec3, DVec3) {
        self.targets.iter().fold((rest, rest.abs()), |(sum, magnitude), (lists, weight)| {
            let offset =
                lists[list].get(vertex).map_or(DVec3::ZERO, |offset| double(*offset)) * f64::from(*weight);
            (sum + offset, magnitude + offset.abs())
        })
    }

    /// The blended map, and the largest entries of the joints that take part in it.
    fn blend(&self, vertex: usize) -> Option<(DMat3, DVec3, DMat3, DVec3)> {
        let JointInfluences { joints_01, joints_23, weights } = self.influences[vertex];
        let joints = [joints_01 & 0xffff, joints_01 >> 16, joints_23 & 0xffff, joints_23 >> 16];
        let sum: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
        let zero = (DMat3::ZERO, DVec3::ZERO, DMat3::ZERO, DVec3::ZERO);
        (sum > 0.0).then(|| {
            joints.iter().zip(weights).fold(
                zero,
                |(linear, translation, top, top_translation), (joint, weight)| {
                    let share = f64::from(weight) / sum;
                    let (m, t) = map_of(&self.joints[*joint as usize]);
                    let a = absolute(&m);
                    let top = DMat3::from_cols(
                        top.x_axis.max(a.x_axis),
                        top.y_axis.max(a.y_axis),
                        top.z_axis.max(a.z_axis),
                    );
                    (linear + m * share, translation + t * share, top, top_translation.max(t.abs()))
                },
            )
        })
    }

    /// Runs the pass over vertices that were at `before`; `posed`: false leaves them at rest.
    fn run(&self, before: &[[f32; 3]], posed: bool, groups: u32) -> Posed {
        let mut session = session();
        let lists: Vec<&[u8]> =
            self.targets.iter().flat_map(|(lists, _)| lists).map(|list| bytes(list)).collect();
        let mut inputs = vec![
            bytes(&self.positions),
            bytes(&self.attributes),
            bytes(&self.influences),
            bytes(&self.joints),
        ];
        inputs.extend(lists.iter().map(|list| if list.is_empty() { &[0_u8; 4][..] } else { list }));
        let previous = vec![0xff_u8; size_of_val(before)];
        let attributes = vec![0xff_u8; size_of_val(self.attributes.as_slice())];
        let file = "passes/deform/deform.comp";
        let outputs: [&[u8]; 3] = [bytes(before), &previous, &attributes];
        let pass = TablePass { file, groups, inputs: &inputs, outputs: &outputs };
        let outputs = pass.run(&mut session, |recorder, inputs, outputs| {
            let address = |i: usize| if lists[i].is_empty() { 0 } else { inputs[4 + i] };
            let target = |(i, (_, weight)): (usize, &(_, f32))| MorphUse {
                positions: address(3 * i),
                normals: address(3 * i + 1),
                tangents: address(3 * i + 2),
                weight: *weight,
                pad0: 0,
            };
            let targets: Vec<MorphUse> = self.targets.iter().enumerate().map(target).collect();
            let job = DeformJob {
                rest_positions: inputs[0],
                rest_attributes: inputs[1],
                influences: if posed { inputs[2] } else { 0 },
                joints: inputs[3],
                targets: recorder.stage_bytes(bytes(&targets)).expect("staging memory"),
                positions: outputs[0],
                previous_positions: outputs[1],
                attributes: outputs[2],
                vertex_count: self.positions.len() as u32,
                target_count: if posed { targets.len() as u32 } else { 0 },
            };
            bytes(&[job]).to_vec()
        });
        Posed {
            positions: bytemuck::pod_collect_to_vec(&outputs[0]),
            previous: bytemuck::pod_collect_to_vec(&outputs[1]),
            attributes: bytemuck::pod_collect_to_vec(&outputs[2]),
        }
    }
}

/// What the pass made.
struct Posed {
    positions: Vec<[f32; 3]>,
    previous: Vec<[f32; 3]>,
    attributes: Vec<VertexAttributes>,
}

#[test]
fn vertices_follow_their_pose() {
    const COUNT: usize = 20_000;
    // Of the magnitudes of all terms: sums of three targets, of four joints and of four products in a row. 2 were seen.
    const BOUND: f64 = 6.0 * ROUNDING;
    let mesh = deforming(COUNT);
    let before: Vec<[f32; 3]> = (0..COUNT).map(|i| [i as f32, 0.5, -1.0]).collect();
    let posed = mesh.run(&before, true, 50);
    assert_eq!(posed.previous, before, "the last positions");
    let mut worst: f64 = 0.0;
    for vertex in 0..COUNT {
        let (rest, rest_magnitude) = mesh.morphed(0, vertex, double(mesh.positions[vertex]));
        let (expected, magnitude) = match mesh.blend(vertex) {
            Some((linear, translation, top, top_translation)) => {
                (linear * rest + translation, top * rest_magnitude + top_translation)
            }
            None => (rest, rest_magnitude),
        };
        let error = (double(posed.positions[vertex]) - expected).abs();
        worst = worst.max((error / magnitude).max_element());
        assert!((error / magnitude).max_element() <= BOUND, "vertex {vertex}: {expected}, off by {error}");
        let (found, rest) = (&posed.attributes[vertex], &mesh.attributes[vertex]);
        let kept = |a: &VertexAttributes| (a.tex_coord0, a.tex_coord1, a.color_rg, a.color_ba, a.tangent[3]);
        assert_eq!(kept(found), kept(rest), "vertex {vertex}");
    }
    eprintln!("largest error: {:.1} roundings", worst / ROUNDING);
}

#[test]
fn directions_follow_their_pose() {
    const COUNT: usize = 20_000;
    let mesh = deforming(COUNT);
    let posed = mesh.run(&mesh.positions, true, 313);
    for vertex in 0..COUNT {
        let (found, rest) = (&posed.attributes[vertex], &mesh.attributes[vertex]);
        let [x, y, z, _] = rest.tangent;
        let blend = mesh.blend(vertex).map_or(DMat3::IDENTITY, |(linear, ..)| linear);
        let normal = mesh.morphed(1, vertex, double(rest.normal)).0.normalize();
        let tangent = mesh.morphed(2, vertex, double([x, y, z])).0.normalize();
        let [x, y, z, _] = found.tangent;
        for (what, found, map, unit) in [
            ("normal", double(found.normal), cofactor(&blend), normal),
            ("tangent", double([x, y, z]), blend, tangent),
        ] {
            assert!(
                (found.length() - 1.0).abs() < 1e-6,
                "vertex {vertex}: {what} of length {}",
                found.length()
            );
            // What the map nearly takes away is found less exactly.
            let turned = map * unit;
            let bound = 1e-5 * (absolute(&map) * DVec3::ONE).length() / turned.length();
            let error = (found - turned.normalize()).length();
            assert!(error < bound, "vertex {vertex}: {what} off by {error}, {bound} allowed");
        }
    }
}

#[test]
fn what_nothing_moves_stays_the_same_to_the_bit() {
    let mesh = deforming(1000);
    let rest = mesh.run(&mesh.positions, false, 16);
    assert_eq!(rest.positions, mesh.positions);
    assert_eq!(rest.attributes, mesh.attributes);
    // Joints that agree on the identity, whatever the weights, and targets without offsets.
    let nothing = || [vec![[0.0; 3]; 1000], vec![[0.0; 3]; 1000], Vec::new()];
    let still = still(mesh, vec![(nothing(), 0.7)]);
    let posed = still.run(&still.positions, true, 16);
    assert_eq!(posed.positions, still.positions);
    assert_eq!(posed.attributes, still.attributes);
}

#[test]
fn offsets_beyond_all_numbers_move_nothing() {
    let far = || [(); 3].map(|()| vec![[0.0, 1e30, 0.0]; 1000]);
    let mesh = still(deforming(1000), vec![(far(), 1e30), (far(), -1e30)]);
    let posed = mesh.run(&mesh.positions, true, 16);
    assert_eq!(posed.positions, mesh.positions);
    assert_eq!(posed.attributes, mesh.attributes);
}

/// The mesh with other targets, and joints that do nothing.
fn still(mesh: Deforming, targets: Vec<Target>) -> Deforming {
    let identity: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    Deforming { joints: vec![identity; JOINTS as usize], targets, ..mesh }
}

/// Rows of a map, a normal, a tangent.
fn skin_input(rows: &Rows, normal: DVec3, tangent: DVec3) -> Vec<f32> {
    rows.iter().flatten().copied().chain(single(normal)).chain(single(tangent)).collect()
}

const READ: &str = "
    FloatTable t = FloatTable(inputs.at[0]);
    uint at = 18u * index;
    vec4 rows[3];
    for (uint r = 0u; r < 3u; ++r) {
        rows[r] = vec4(t.at[at + 4u * r], t.at[at + 4u * r + 1u], t.at[at + 4u * r + 2u], t.at[at + 4u * r + 3u]);
    }
    DeformVertex vertex = DeformVertex(vec3(1.0, 2.0, 3.0), vec3(t.at[at + 12u], t.at[at + 13u], t.at[at + 14u]),
        vec3(t.at[at + 15u], t.at[at + 16u], t.at[at + 17u]));
    DeformVertex moved = skin(vertex, rows);
    write(0u, moved.position); write(3u, moved.normal); write(6u, moved.tangent);
    write(9u, normalize(transform_vector(rows, vertex.normal)));";

fn skinned(input: &[f32]) -> Vec<[DVec3; 4]> {
    let mut session = session();
    let snippet = Snippet {
        includes: &["lib/deform.glsl"],
        body: READ,
        values: 12,
        count: input.len() / 18,
        inputs: &[bytes(input)],
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let vectors = |row: &[f32]| [0, 3, 6, 9].map(|i| double([row[i], row[i + 1], row[i + 2]]));
    values.chunks_exact(12).map(vectors).collect()
}

#[test]
fn normals_stay_perpendicular_and_hands_stay_the_same() {
    const COUNT: usize = 20_000;
    let mut random = Random::new(9);
    let cases: Vec<(Rows, DVec3, DVec3)> = (0..COUNT)
        .map(|_| {
            let rows = random_rows(&mut random);
            let normal = random.direction();
            let tangent = normal.cross(random.direction()).normalize();
            (rows, normal, tangent)
        })
        .collect();
    let input: Vec<f32> = cases.iter().flat_map(|(rows, n, t)| skin_input(rows, *n, *t)).collect();
    let (mut naive_broken, mut mirrored) = (0, 0);
    for ((rows, normal, tangent), [_, moved_normal, moved_tangent, naive]) in
        cases.iter().zip(skinned(&input))
    {
        let (linear, _) = map_of(rows);
        assert!(moved_normal.dot(moved_tangent).abs() < 2e-5, "{rows:?} {normal} {tangent}");
        // The bitangent is carried by the map as every vector of the surface; against it the hand shows.
        let bitangent = linear * normal.cross(*tangent);
        let side = moved_normal.cross(moved_tangent).dot(bitangent.normalize());
        assert!(side > 0.0, "{rows:?} changes hands: {side}");
        mirrored += usize::from(linear.determinant() < 0.0);
        naive_broken += usize::from(naive.dot(moved_tangent).abs() > 0.01);
    }
    assert!(mirrored > COUNT / 5, "only {mirrored} of {COUNT} mirror");
    assert!(naive_broken > COUNT / 2, "the naive form fails in {naive_broken} of {COUNT} cases only");
}

#[test]
fn blends_that_take_a_direction_away_leave_unit_vectors() {
    let flat = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let line = [[1.0, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4]];
    let tiny = [[1e-30, 0.0, 0.0, 0.0], [0.0, 1e-30, 0.0, 0.0], [0.0, 0.0, 1e-30, 0.0]];
    let huge = [[3e38, 3e38, 3e38, 3e38], [-3e38, 3e38, 3e38, 3e38], [0.0, 0.0, 1.0, 0.0]];
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    // A map, normal and tangent before, and after.
    let cases: [(Rows, DVec3, DVec3, DVec3, DVec3); 7] = [
        (flat, y, x, y, x),
        (flat, x, y, x, y),
        (line, y, x, y, x),
        ([[0.0; 4]; 3], y, x, y, x),
        (tiny, z, y, z, y),
        (tiny, DVec3::ZERO, y, DVec3::ZERO, y),
        (huge, z, z, z, z),
    ];
    let input: Vec<f32> = cases.iter().flat_map(|(rows, n, t, ..)| skin_input(rows, *n, *t)).collect();
    for ((rows, normal, tangent, after_normal, after_tangent), [position, found_normal, found_tangent, _]) in
        cases.iter().zip(skinned(&input))
    {
        assert!(position.is_finite(), "{rows:?}: {position}");
        let near = |found: DVec3, expected: DVec3| (found - expected).length() < 1e-6;
        assert!(near(found_normal, *after_normal), "{rows:?}: normal {normal} becomes {found_normal}");
        assert!(near(found_tangent, *after_tangent) || *rows == huge, "{rows:?}: {tangent}: {found_tangent}");
        assert!(found_tangent.is_finite(), "{rows:?}: {found_tangent}");
    }
}

#[test]
fn joints_that_agree_come_out_exactly() {
    const COUNT: usize = 4096;
    let mut session = session();
    let body = "
        vec2 a = sample_2d(sequence_begin(5u, uvec2(index, 0u), 0ul), 0u);
        vec2 b = sample_2d(sequence_begin(5u, uvec2(index, 0u), 0ul), 1u);
        vec4 weights = vec4(1.0 - 0.3 * (a.x + a.y + b.x), 0.3 * a.x, 0.3 * a.y, 0.3 * b.x);
        vec4 joint[3] = vec4[3](vec4(a, b), vec4(b, a) * 3.0, vec4(a.x, b.y, b.x, 1e4 * a.y));
        vec4 rows[3];
        blend_joints(joint, joint, joint, joint, weights, rows);
        vec4 naive = joint[2] * weights.x + joint[2] * weights.y + joint[2] * weights.z + joint[2] * weights.w;
        write(0u, rows == joint ? 1.0 : 0.0); write(1u, naive == joint[2] ? 1.0 : 0.0);";
    let snippet = Snippet {
        includes: &["lib/random.glsl", "lib/deform.glsl"],
        body,
        values: 2,
        count: COUNT,
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let exact = |i: usize| values.chunks_exact(2).filter(|row| row[i] == 1.0).count();
    assert_eq!(exact(0), COUNT);
    assert!(exact(1) < COUNT * 9 / 10, "the naive form is exact in {} of {COUNT} cases", exact(1));
}
