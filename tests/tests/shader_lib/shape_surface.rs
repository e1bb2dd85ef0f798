//! Where rays leave spheres and boxes, and the boxes that hold them, against double precision, over scales, distances,
//! uneven and mirrored maps. The naive forms: a fixed distance along the normal, and boxes that are not rounded outwards.

use caustica_renderer::gpu_types::{Geometry, SHAPE_BOX, SHAPE_SPHERE, Shape, ShapeBox, ShapeBoxJob};
use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::table_pass::TablePass;

/// A shape, where it stands, a place on it, a way out.
struct Case {
    render_from_mesh: DAffine3,
    /// `None`: it was not moved.
    mesh_from_primitive: Option<DAffine3>,
    sphere: bool,
    centre: DVec3,
    half_extent: DVec3,
    unit: DVec3,
    normal: DVec3,
    direction: DVec3,
}

/// What single precision makes of a map.
fn rounded(map: DAffine3) -> DAffine3 {
    DAffine3 {
        matrix3: DMat3::from_cols_array(&map.matrix3.to_cols_array().map(|x| f64::from(x as f32))),
        translation: map.translation.as_vec3().as_dvec3(),
    }
}

fn rows(map: &DAffine3) -> [f32; 12] {
    let (m, t) = (map.matrix3, map.translation);
    let row = |r: usize| [m.x_axis[r], m.y_axis[r], m.z_axis[r], t[r]].map(|x| x as f32);
    let mut all = [0.0; 12];
    for (r, chunk) in all.chunks_exact_mut(4).enumerate() {
        chunk.copy_from_slice(&row(r));
    }
    all
}

/// Turned, uneven down to `10^squeeze`, three in ten mirrored.
fn map(random: &mut Random, scale: f64, squeeze: f64, translation: DVec3) -> DAffine3 {
    let mut axes = DVec3::new(1.0, random.magnitude(squeeze, 0.0), 1.0) * scale;
    if random.unit() < 0.3 {
        axes.x = -axes.x;
    }
    let mut turn = || DMat3::from_quat(DQuat::from_axis_angle(random.direction(), 2.0));
    rounded(DAffine3 { matrix3: turn() * DMat3::from_diagonal(axes) * turn(), translation })
}

fn place(random: &mut Random, sphere: bool) -> (DVec3, DVec3) {
    if sphere {
        let direction = random.direction().as_vec3().as_dvec3();
        return (direction, direction);
    }
    let mut unit =
        DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    let axis = random.bits() as usize % 3;
    let mut normal = DVec3::ZERO;
    normal[axis] = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    unit[axis] = normal[axis];
    (unit.as_vec3().as_dvec3(), normal)
}

fn cases(count: usize) -> Vec<Case> {
    let mut random = Random::new(17);
    (0..count)
        .map(|_| {
            let (scale, size) = (random.magnitude(-6.0, 6.0), random.magnitude(-3.0, 3.0));
            let sphere = random.unit() < 0.5;
            let uneven = DVec3::new(random.unit(), random.unit(), random.unit()) * 0.9 + 0.1;
            let half_extent = if sphere { DVec3::ONE } else { uneven } * size;
            // A fifth stand at the origin unturned: nothing but the shape itself is rounded.
            let plain = random.unit() < 0.2;
            let centre = random.direction() * size * random.magnitude(-2.0, 2.0);
            let centre = if plain { DVec3::ZERO } else { centre };
            let moved = random.unit() < 0.6 && !plain;
            let shift = random.direction() * size * random.magnitude(-2.0, 2.0);
            let stretch = random.magnitude(-2.0, 2.0);
            let inner = map(&mut random, stretch, -2.0, shift);
            let away = random.direction() * scale * size * random.magnitude(-2.0, 4.0);
            let outer = map(&mut random, scale, -2.0, away);
            let (unit, normal) = place(&mut random, sphere);
            let mut case = Case {
                render_from_mesh: if plain { DAffine3::IDENTITY } else { outer },
                mesh_from_primitive: moved.then_some(inner),
                sphere,
                centre: centre.as_vec3().as_dvec3(),
                half_extent: half_extent.as_vec3().as_dvec3(),
                unit,
                normal,
                direction: DVec3::ZERO,
            };
            let normal = case.outwards();
            let flat = random.direction();
            let along = (flat - flat.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
            let rise = if random.unit() < 0.5 { 0.1_f64 } else { 40.0 }.to_radians();
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            case.direction = (along * rise.cos() + normal * (side * rise.sin())).as_vec3().as_dvec3();
            case
        })
        .collect()
}

impl Case {
    /// Unit space to render space.
    fn render_from_unit(&self) -> DAffine3 {
        let grow = DAffine3 { matrix3: DMat3::from_diagonal(self.half_extent), translation: self.centre };
        self.render_from_mesh * self.mesh_from_primitive.unwrap_or(DAffine3::IDENTITY) * grow
    }

    /// Unit normal in render space.
    fn outwards(&self) -> DVec3 {
        (self.render_from_unit().matrix3.inverse().transpose() * self.normal).normalize()
    }

    /// How far a point stands outside, in unit space; below 0: inside.
    fn outside(&self, point: DVec3) -> f64 {
        let at = self.render_from_unit().inverse().transform_point3(point);
        if self.sphere { at.length() - 1.0 } else { at.abs().max_element() - 1.0 }
    }

    /// Whether a step inwards of up to three times the offset leaves the shape again: beside an edge, a tip, or in a thin shape. There is
    /// no place for the start of a ray there.
    fn is_cramped(&self, offset_m: f64) -> bool {
        let start = self.render_from_unit().transform_point3(self.unit);
        [1.0, 2.0, 3.0].iter().any(|k| self.outside(start - *k * offset_m * self.outwards()) >= 0.0)
    }

    /// The largest half extent in render space, about.
    fn size(&self) -> f64 {
        let m = self.render_from_unit().matrix3;
        m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length())
    }

    fn packed(&self) -> Vec<f32> {
        let inner = self.mesh_from_primitive;
        let mut all = Vec::with_capacity(PACKED);
        all.extend(rows(&self.render_from_mesh));
        all.extend(rows(&self.render_from_mesh.inverse()));
        all.extend(rows(&inner.unwrap_or(DAffine3::IDENTITY)));
        all.extend([if inner.is_some() { 1.0 } else { 0.0 }, if self.sphere { 0.0 } else { 1.0 }]);
        for v in [self.centre, self.half_extent, self.unit, self.normal, self.direction] {
            all.extend(v.as_vec3().to_array());
        }
        all
    }
}

/// Floats of one case.
const PACKED: usize = 53;

const FETCH: &str = "
    struct Given { PlacedShape shape; vec4 mesh_from_render[3]; ShapePlace place; vec3 direction; };
    vec4[3] rows_at(FloatTable t, uint at) {
        vec4 rows[3];
        for (uint r = 0u; r < 3u; ++r) {
            rows[r] = vec4(t.at[at + 4u * r], t.at[at + 4u * r + 1u], t.at[at + 4u * r + 2u], t.at[at + 4u * r + 3u]);
        }
        return rows;
    }
    vec3 vector_at(FloatTable t, uint at) { return vec3(t.at[at], t.at[at + 1u], t.at[at + 2u]); }
    Given given(uint index) {
        FloatTable t = FloatTable(inputs.at[0]);
        uint at = 53u * index;
        Given g;
        g.shape.render_from_mesh = rows_at(t, at);
        g.mesh_from_render = rows_at(t, at + 12u);
        g.shape.mesh_from_primitive = rows_at(t, at + 24u);
        g.shape.moved = t.at[at + 36u] != 0.0;
        g.shape.kind = t.at[at + 37u] == 0.0 ? SHAPE_SPHERE : SHAPE_BOX;
        g.shape.centre = vector_at(t, at + 38u);
        g.shape.half_extent = vector_at(t, at + 41u);
        g.place = ShapePlace(vector_at(t, at + 44u), vector_at(t, at + 47u));
        g.direction = vector_at(t, at + 50u);
        g.shape.winding = determinant_sign(g.shape.render_from_mesh)
            * (g.shape.moved ? determinant_sign(g.shape.mesh_from_primitive) : 1.0);
        return g;
    }
    // What a ray from here meets, as shape.rint finds it: both distances, below 0 for none.
    vec2 met(Given g, vec3 origin) {
        vec3 o = transform_point(g.mesh_from_render, origin);
        vec3 d = transform_vector(g.mesh_from_render, g.direction);
        float speed;
        vec2 t;
        if ((g.shape.moved && !line_before(g.shape.mesh_from_primitive, o, d))
            || !line_in_unit_space(g.shape.centre, g.shape.half_extent, o, d, speed)) {
            return vec2(-1.0);
        }
        bool hit = g.shape.kind == SHAPE_SPHERE ? intersect_sphere(o, d, vec3(0.0), 1.0, t)
            : intersect_box(o, d, vec3(-1.0), vec3(1.0), t);
        return hit ? t : vec2(-1.0);
    }";

#[test]
fn rays_leave_shapes_on_the_right_side_at_every_scale() {
    const COUNT: usize = 200_000;
    const FIXED_M: f32 = 1e-2;
    let cases = cases(COUNT);
    let input: Vec<f32> = cases.iter().flat_map(Case::packed).collect();
    let body = format!(
        "
        Given g = given(index);
        ShapePlace place = shape_decode_place(g.shape.kind, shape_encode_place(g.shape.kind, g.place));
        SurfacePoint p = shape_point(g.shape, place);
        vec3 origin = spawn_position(p.position, p.normal, p.offset_m, g.direction);
        vec2 t = met(g, origin);
        write(0u, origin); write(3u, p.normal); write(6u, p.offset_m); write(7u, t.x); write(8u, t.y);
        origin = spawn_position(p.position, p.normal, {FIXED_M:?}, g.direction);
        t = met(g, origin);
        write(9u, origin); write(12u, t.x); write(13u, t.y);"
    );
    let mut session = session();
    let snippet = Snippet {
        includes: &["lib/intersect.glsl", "lib/shape.glsl"],
        functions: FETCH,
        body: &body,
        values: 14,
        count: COUNT,
        inputs: &[bytes(&input)],
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let (mut ours, mut naive, mut leaps, mut cramped) = (0, 0, 0, 0);
    for (row, case) in values.chunks_exact(14).zip(&cases) {
        assert!(row[..7].iter().all(|x| x.is_finite()), "{row:?}");
        let vector = |at: usize| Vec3::new(row[at], row[at + 1], row[at + 2]);
        let normal = vector(3).as_dvec3();
        assert!(normal.dot(case.outwards()) > 1.0 - 1e-4, "{normal} is not {}", case.outwards());
        let leaves = case.direction.dot(case.outwards()) > 0.0;
        // Outwards: on the outside, and nothing is met again. Inwards: inside, and the way in is behind.
        let is_wrong = |origin: Vec3, near: f32, far: f32| {
            (case.outside(origin.as_dvec3()) > 0.0) != leaves || if leaves { far >= 0.0 } else { near >= 0.0 }
        };
        if !leaves && case.is_cramped(f64::from(row[6])) {
            cramped += 1;
        } else {
            ours += usize::from(is_wrong(vector(0), row[7], row[8]));
        }
        naive += usize::from(is_wrong(vector(9), row[12], row[13]));
        leaps += usize::from(f64::from(row[6]) > 0.01 * case.size());
    }
    assert_eq!(ours, 0, "of {COUNT}");
    assert!(cramped < COUNT / 20, "{cramped} of {COUNT}");
    assert!(leaps < COUNT / 20, "{leaps} offsets of {COUNT} exceed a hundredth of their shape");
    assert!(naive > COUNT / 10, "naive: {naive} of {COUNT} are wrong");
}

#[test]
fn the_line_of_a_pixel_finds_the_place_where_it_enters_and_leaves() {
    const COUNT: usize = 50_000;
    let cases = cases(COUNT);
    let input: Vec<f32> = cases.iter().flat_map(Case::packed).collect();
    // From a point of the line some way off, along the direction in which the line leaves or enters at the place.
    let body = "
        Given g = given(index);
        SurfacePoint p = shape_point(g.shape, g.place);
        float away = 3.0 * safe_length(shape_render_vector(g.shape, g.place.unit));
        bool leaving = dot(g.direction, p.normal) > 0.0;
        vec3 from = p.position - away * g.direction;
        ShapePlace found = shape_line_place(g.shape, from, g.direction, leaving);
        write(0u, found.unit); write(3u, found.normal);";
    let mut session = session();
    let snippet = Snippet {
        includes: &["lib/intersect.glsl", "lib/shape.glsl"],
        functions: FETCH,
        body,
        values: 6,
        count: COUNT,
        inputs: &[bytes(&input)],
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let mut far = 0;
    for (row, case) in values.chunks_exact(6).zip(&cases) {
        assert!(row.iter().all(|x| x.is_finite()), "{row:?}");
        let unit = DVec3::new(f64::from(row[0]), f64::from(row[1]), f64::from(row[2]));
        far += usize::from(unit.distance(case.unit) > 1e-2);
    }
    // Grazing lines and shapes far smaller than their distance have no well-defined place in single precision.
    assert!(far < COUNT / 4, "{far} of {COUNT} places are elsewhere");
}

#[test]
fn boxes_hold_their_shapes_and_little_more() {
    const COUNT: usize = 3000;
    let cases = cases(COUNT);
    let mut shapes = Vec::new();
    let mut records = Vec::new();
    for case in &cases {
        shapes.push(Shape {
            centre: case.centre.as_vec3().to_array(),
            kind: if case.sphere { SHAPE_SPHERE } else { SHAPE_BOX },
            half_extent: case.half_extent.as_vec3().to_array(),
        });
        let mut record: Geometry = bytemuck::Zeroable::zeroed();
        let rows = rows(&case.mesh_from_primitive.unwrap_or(DAffine3::IDENTITY));
        for (target, row) in record.mesh_from_primitive.iter_mut().zip(rows.chunks_exact(4)) {
            target.copy_from_slice(row);
        }
        records.push(record);
    }
    let before = vec![0_u8; COUNT * size_of::<ShapeBox>()];
    let mut session = session();
    let mut found = Vec::new();
    // One record a shape here: each is its own geometry, and the pass takes one job a dispatch.
    for (index, record) in records.iter().enumerate().take(400) {
        let pass = TablePass {
            file: "passes/shape_boxes/shape_boxes.comp",
            groups: 1,
            inputs: &[bytes(&shapes[index..=index])],
            outputs: &[&before[..size_of::<ShapeBox>()]],
        };
        let outputs = pass.run(&mut session, |recorder, inputs, outputs| {
            let record = Geometry { positions: inputs[0], ..*record };
            let geometry = recorder.stage_bytes(bytes(&[record])).expect("staging memory");
            bytes(&[ShapeBoxJob { geometry, boxes: outputs[0], count: 1, pad0: 0 }]).to_vec()
        });
        found.push(bytemuck::pod_read_unaligned::<ShapeBox>(&outputs[0]));
    }
    let mut tight = 0;
    for (found, case) in found.iter().zip(&cases) {
        let inner = case.mesh_from_primitive.unwrap_or(DAffine3::IDENTITY);
        let m = inner.matrix3 * DMat3::from_diagonal(case.half_extent);
        let middle = inner.transform_point3(case.centre);
        for axis in 0..3 {
            let row = m.row(axis);
            let reach = if case.sphere { row.length() } else { row.abs().element_sum() };
            let (low, high) = (f64::from(found.low[axis]), f64::from(found.high[axis]));
            assert!(low < middle[axis] - reach && high > middle[axis] + reach, "axis {axis}: {found:?}");
            tight += usize::from(high - low < 2.0 * reach * 1.001);
        }
    }
    assert!(tight > found.len() * 3 * 9 / 10, "{tight} of {} are tight", found.len() * 3);
}
