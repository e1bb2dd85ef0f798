//! Random rays against spheres and boxes on the device, beside double precision: outside of a stated band at the outline the same
//! rays hit the same shapes on the same side, with stated errors of distance and normal. `CAUSTICA_SHAPE_RAYS=1000000` for more
//! rays; `docs/shapes.md` holds the figures.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

mod oracle;
mod tracer;

use caustica_renderer::gpu_types::{HIT_BOX, HIT_LEAVING, HIT_SPHERE, SHAPE_BOX, SHAPE_SPHERE, Shape};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3};

use oracle::{Hit, Line, Placed, first};
use tracer::{Found, Part, ROW, Ray, trace};

/// Rays of an ordinary run.
const RAYS: usize = 100_000;
/// Shapes of each of the two geometries.
const SHAPES: usize = 32;
/// Rounding of single precision.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;
/// The band: where a line is nearer to touching than this many roundings, times the reach of the ray (see [`Line::reach`]), either
/// answer stands.
const BAND: f64 = 4.0;
/// A hit may lie beside the surface by this many roundings of its distance plus the shape's size, and of the detour over primitive
/// space where the shape was moved; the angle of a normal, radians, by so many times the reach. Both where the line is further from touching than
/// [`CLEAR`]: nearer, they grow as one over the root of the margin.
const DISTANCE: f64 = 12.0;
const ANGLE: f64 = 16.0;
const CLEAR: f64 = 0.01;

/// Rows of a map as single precision holds them, and that map in double.
fn rounded(map: DAffine3) -> ([[f32; 4]; 3], DAffine3) {
    let (m, t) = (map.matrix3, map.translation);
    let rows = [0, 1, 2].map(|r| [m.x_axis[r], m.y_axis[r], m.z_axis[r], t[r]].map(|x| x as f32));
    let column = |c: usize| DVec3::from_array([0, 1, 2].map(|r| f64::from(rows[r][c])));
    let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
    (rows, DAffine3 { matrix3, translation: column(3) })
}

/// Shapes of half a metre on a grid of 4 m: those of the second geometry are turned and stretched unevenly.
fn parts(random: &mut Random) -> (Vec<Part>, Vec<Placed>) {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.9));
    let stretch = DMat3::from_diagonal(DVec3::new(0.7, -1.4, 1.1));
    let (rows, map) = rounded(DAffine3 { matrix3: turn * stretch, translation: DVec3::new(1.0, -2.0, 0.5) });
    let mut placed = Vec::new();
    let parts = [None, Some((rows, map))].map(|moved| {
        let mut shapes = Vec::new();
        for index in 0..SHAPES {
            let layer = index / 16 + if moved.is_some() { 2 } else { 0 };
            let wanted = DVec3::new((index % 4) as f64, (index / 4 % 4) as f64, layer as f64) * 4.0;
            let inner = moved.map_or(DAffine3::IDENTITY, |(_, map)| map);
            let centre = inner.inverse().transform_point3(wanted).as_vec3();
            let sphere = random.unit() < 0.5;
            let axes = DVec3::from_array([(); 3].map(|()| random.magnitude(-2.0, 0.0)));
            let half = if sphere { DVec3::splat(axes.x) } else { axes }.as_vec3();
            let kind = if sphere { SHAPE_SPHERE } else { SHAPE_BOX };
            shapes.push(Shape { centre: centre.to_array(), kind, half_extent: half.to_array() });
            let map = moved.map(|(_, map)| map);
            placed.push(Placed::new(sphere, map, centre.as_dvec3(), half.as_dvec3()));
        }
        Part { shapes, mesh_from_primitive: moved.map(|(rows, _)| rows) }
    });
    (parts.into(), placed)
}

/// A ray at a shape: a third of them anywhere, the others near its outline, a quarter of all from its inside.
fn ray_at(random: &mut Random, shape: &Placed) -> Ray {
    let d = random.direction();
    let side = random.direction().cross(d).normalize_or(d.any_orthonormal_vector());
    // The margin is 1 off the reach, which grows with the distance from the axis.
    let reach = |p: DVec3| {
        let world = |p| shape.world_from_unit.transform_point3(p);
        let line = shape.line(world(p), shape.world_from_unit.transform_vector3(d));
        if line.met.is_some() { 1.0 - line.margin } else { 1.0 + line.margin }
    };
    let near = |random: &mut Random, low, high| {
        let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        1.0 + sign * random.magnitude(low, high)
    };
    let share = match random.bits() % 3 {
        0 => random.between(0.0, 1.5),
        1 => near(random, -4.0, -2.0),
        _ => near(random, -8.0, -4.0),
    };
    let p = side * (share / reach(side).max(1e-9));
    let inside = random.unit() < 0.25 && shape.outside(p) < -0.02;
    let along =
        if inside { random.between(-0.5, 0.5) * -shape.outside(p) } else { -random.magnitude(0.2, 4.0) };
    let world = |p: DVec3| shape.world_from_unit.transform_point3(p);
    let origin = world(p + along * d).as_vec3();
    let direction = (world(p + d) - world(p)).normalize().as_vec3();
    Ray { origin: origin.to_array(), direction: direction.to_array() }
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn lines(placed: &[Placed], ray: &Ray) -> Vec<Line> {
    placed.iter().map(|shape| shape.line(double(ray.origin), double(ray.direction))).collect()
}

/// Rays whose origin lies on no shape's surface, where which side it is on would be rounding.
fn rays(random: &mut Random, placed: &[Placed], count: usize) -> Vec<Ray> {
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        let shape = &placed[random.bits() as usize % placed.len()];
        let ray = ray_at(random, shape);
        let clear = |(shape, line): (&Placed, &Line)| shape.outside(line.origin).abs() > 1e-3;
        if placed.iter().zip(&lines(placed, &ray)).all(clear) {
            rays.push(ray);
        }
    }
    rays
}

/// What was found of one kind of shape.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    rays: usize,
    /// Rays that hit it by one account and not by the other.
    differ: usize,
    /// Largest margin of those, in roundings times reach.
    band: f64,
    /// The same as a share of the shape's size, whatever the distance.
    margin: f64,
    distance: f64,
    angle: f64,
    /// Boxes: largest distance from an edge, in roundings times reach, where another face was named.
    edge: f64,
    sides: usize,
}

/// Sphere, box, moved sphere, moved box; each from outside and from inside.
#[derive(Default)]
struct Report([Worst; 8]);

impl Report {
    fn of(&mut self, shape: &Placed, line: &Line) -> &mut Worst {
        let inside = shape.outside(line.origin) < 0.0;
        &mut self.0[usize::from(!shape.sphere) + 2 * usize::from(shape.moved) + 4 * usize::from(inside)]
    }

    fn print(&self) {
        let names = ["sphere", "box", "moved sphere", "moved box"];
        println!(
            "| shape | from | rays | differ | band, roundings x reach | largest margin | beside the surface, roundings | normal, roundings x reach | edge, roundings x reach | wrong side |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|");
        for (index, w) in self.0.iter().enumerate() {
            let from = if index < 4 { "outside" } else { "inside" };
            println!(
                "| {} | {from} | {} | {} | {:.2} | {:.1e} | {:.2} | {:.2} | {:.2} | {} |",
                names[index % 4],
                w.rays,
                w.differ,
                w.band,
                w.margin,
                w.distance,
                w.angle,
                w.edge,
                w.sides
            );
        }
    }
}

fn compare(report: &mut Report, placed: &[Placed], ray: &Ray, found: &Found) {
    let lines = lines(placed, ray);
    let expected = first(&lines);
    let met = (found.t_m >= 0.0).then_some(found.geometry as usize * SHAPES + found.primitive as usize);
    if let Some(shape) = met.or(expected.map(|hit| hit.shape)) {
        report.of(&placed[shape], &lines[shape]).rays += 1;
    }
    if met != expected.map(|hit| hit.shape) {
        // The one that is there by one account alone, or the nearer of two.
        let extra = met.filter(|shape| lines[*shape].met.is_none());
        let Some(shape) = extra.or(expected.map(|hit| hit.shape)).or(met) else { return };
        let worst = report.of(&placed[shape], &lines[shape]);
        worst.differ += 1;
        worst.band = worst.band.max(lines[shape].margin / (lines[shape].reach * ROUNDING));
        worst.margin = worst.margin.max(lines[shape].margin);
    } else if let Some(hit) = expected {
        compare_hit(report, &placed[hit.shape], &lines[hit.shape], &hit, ray, found);
    }
}

fn compare_hit(report: &mut Report, shape: &Placed, line: &Line, hit: &Hit, ray: &Ray, found: &Found) {
    let kind = if shape.sphere { HIT_SPHERE } else { HIT_BOX } | if hit.leaving { HIT_LEAVING } else { 0 };
    let worst = report.of(shape, line);
    worst.sides += usize::from(found.kind != kind);
    if line.margin < CLEAR {
        return;
    }
    let direction = double(ray.direction);
    let point = double(ray.origin) + hit.t * direction;
    let (normal, edge) = shape.normal(point);
    let beside = (f64::from(found.t_m) - hit.t) * normal.dot(direction);
    let distance = beside.abs() / (hit.t + shape.size() + line.detour_m);
    worst.distance = worst.distance.max(distance / ROUNDING);
    let angle = normal.cross(double(found.normal)).length().atan2(normal.dot(double(found.normal)));
    let scale = line.reach * ROUNDING;
    if !shape.sphere && angle > 1e-2 {
        worst.edge = worst.edge.max(edge / scale);
    } else {
        worst.angle = worst.angle.max(angle / scale);
    }
}

#[test]
fn rays_hit_what_double_precision_says_outside_of_a_narrow_band() {
    let asked = std::env::var("CAUSTICA_SHAPE_RAYS").ok().and_then(|count| count.parse().ok());
    let count = asked.unwrap_or(RAYS).next_multiple_of(ROW);
    let mut random = Random::new(29);
    let (parts, placed) = parts(&mut random);
    let rays = rays(&mut random, &placed, count);
    let mut session = session();
    println!("{count} rays, {} shapes, {}", placed.len(), session.device.name());
    let found = trace(&mut session, &parts, &rays);
    let mut report = Report::default();
    for (ray, found) in rays.iter().zip(&found) {
        compare(&mut report, &placed, ray, found);
    }
    report.print();
    for (index, worst) in report.0.iter().enumerate() {
        assert!(worst.rays > count / 200, "{index}: {worst:?}");
        assert!(worst.band <= BAND && worst.edge <= BAND, "{index}: {worst:?}");
        assert!(worst.distance <= DISTANCE && worst.angle <= ANGLE, "{index}: {worst:?}");
        assert_eq!(worst.sides, 0, "{index}: {worst:?}");
    }
}
