//! Spheres and boxes in double precision: what a ray meets, and how far its line is from touching. Enters: shapes and rays as
//! the device gets them, single precision, taken for exact. Leaves: hits in double precision.

use glam::{DAffine3, DMat3, DVec3};

/// A shape that stands somewhere.
#[derive(Clone, Debug)]
pub struct Placed {
    pub sphere: bool,
    /// It was moved inside its mesh.
    pub moved: bool,
    /// Unit space, where it has radius or half extents 1, to world space.
    pub world_from_unit: DAffine3,
    unit_from_world: DAffine3,
    centre: DVec3,
    half_extent: DVec3,
}

/// The line of a ray against one shape.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Where it enters and leaves; `None`: it passes by.
    pub met: Option<[f64; 2]>,
    /// By which share the shape had to grow or shrink for the line to touch it: 0 at the outline.
    pub margin: f64,
    /// Unit space.
    pub origin: DVec3,
    /// How much a rounding of the ray grows on its way to the shape: the distance of its origin in half sizes, at least 1. A
    /// moved shape takes the ray to primitive space first, where distances count from the origin and all axes are mixed.
    pub reach: f64,
    /// How far from the primitive's origin the ray and the shape are, metres; 0 for a shape that was not moved.
    pub detour_m: f64,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub t: f64,
    pub shape: usize,
    pub leaving: bool,
}

impl Placed {
    pub fn new(
        sphere: bool,
        mesh_from_primitive: Option<DAffine3>,
        centre: DVec3,
        half_extent: DVec3,
    ) -> Self {
        let own = DAffine3 { matrix3: DMat3::from_diagonal(half_extent), translation: centre };
        let world_from_unit = mesh_from_primitive.unwrap_or(DAffine3::IDENTITY) * own;
        let (moved, unit_from_world) = (mesh_from_primitive.is_some(), world_from_unit.inverse());
        Self { sphere, moved, world_from_unit, unit_from_world, centre, half_extent }
    }

    pub fn line(&self, origin: DVec3, direction: DVec3) -> Line {
        let o = self.unit_from_world.transform_point3(origin);
        let d = self.unit_from_world.transform_vector3(direction);
        let (met, reach) = if self.sphere { sphere(o, d) } else { cube(o, d) };
        Line { met, margin: (reach - 1.0).abs(), origin: o, reach: self.reach(o), detour_m: self.detour_m(o) }
    }

    fn reach(&self, origin: DVec3) -> f64 {
        let way = if self.moved {
            self.detour_m(origin) * self.half_extent.recip().length()
        } else {
            origin.length()
        };
        way.max(1.0)
    }

    fn detour_m(&self, origin: DVec3) -> f64 {
        let place = origin * self.half_extent + self.centre;
        if self.moved { place.length() + self.centre.length() } else { 0.0 }
    }

    /// How far outside a point of unit space lies: 0 on the surface, below 0 inside.
    pub fn outside(&self, unit: DVec3) -> f64 {
        if self.sphere { unit.length() - 1.0 } else { unit.abs().max_element() - 1.0 }
    }

    /// The outward normal at a point of the surface, world space, and how near the next face of a box is, as a share of its
    /// half extent.
    pub fn normal(&self, point: DVec3) -> (DVec3, f64) {
        let p = self.unit_from_world.transform_point3(point);
        let (normal, edge) = if self.sphere {
            (p, 1.0)
        } else {
            let a = p.abs();
            let axis = (0..3).max_by(|i, j| a[*i].total_cmp(&a[*j])).unwrap_or(0);
            let mut normal = DVec3::ZERO;
            normal[axis] = p[axis].signum();
            (normal, a[axis] - a[(axis + 1) % 3].max(a[(axis + 2) % 3]))
        };
        ((self.unit_from_world.matrix3.transpose() * normal).normalize(), edge)
    }

    /// The longest way from its centre, world space.
    pub fn size(&self) -> f64 {
        let DMat3 { x_axis, y_axis, z_axis } = self.world_from_unit.matrix3;
        x_axis.length().max(y_axis.length()).max(z_axis.length())
    }
}

/// Roots, and the distance of the line from the centre.
fn sphere(o: DVec3, d: DVec3) -> (Option<[f64; 2]>, f64) {
    let a = d.length_squared();
    let middle = -o.dot(d) / a;
    let nearest = o + middle * d;
    let reach = nearest.length();
    let half = ((1.0 - reach) * (1.0 + reach) / a).sqrt();
    ((reach <= 1.0).then_some([middle - half, middle + half]), reach)
}

/// Slabs, and the half extent of the cube that the line touches: by the separating axes of a line and a box, which are the
/// cross products of the line with the edges (Gottschalk, Lin and Manocha, SIGGRAPH 1996).
fn cube(o: DVec3, d: DVec3) -> (Option<[f64; 2]>, f64) {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut reach = 0.0_f64;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let across = d[i].abs() + d[j].abs();
        if across > 0.0 {
            reach = reach.max((o[i] * d[j] - o[j] * d[i]).abs() / across);
        }
        if d[i] == 0.0 {
            reach = reach.max(o[i].abs());
        } else {
            let (first, second) = ((-1.0 - o[i]) / d[i], (1.0 - o[i]) / d[i]);
            (low, high) = (low.max(first.min(second)), high.min(first.max(second)));
        }
    }
    ((reach <= 1.0).then_some([low, high]), reach)
}

/// What a ray meets first, from the lines of all shapes.
pub fn first(lines: &[Line]) -> Option<Hit> {
    let hit = |(shape, line): (usize, &Line)| {
        let [t_in, t_out] = line.met?;
        let leaving = t_in < 0.0;
        let t = if leaving { t_out } else { t_in };
        (t >= 0.0).then_some(Hit { t, shape, leaving })
    };
    lines.iter().enumerate().filter_map(hit).min_by(|a, b| a.t.total_cmp(&b.t))
}
