//! The handles that move, turn and scale what is selected. Enters: a frame, a view, the pointer. Leaves: which handle
//! the pointer is on, and the motion a drag means. Double precision; it knows neither egui nor the document's tree.

use std::f64::consts::{PI, TAU};

use caustica_scene::{Local, Trs};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use crate::projection::{Ray, ViewProjection};

pub mod paint;

/// Length of an axis handle, points.
const AXIS_POINTS: f64 = 88.0;
/// Start of an axis handle, as a share of its length: the middle stays free.
const AXIS_START: f64 = 0.18;
/// The square between two axes, as shares of their length.
const PLANE_RANGE: (f64, f64) = (0.34, 0.54);
/// Radius of the outer ring that turns about the viewing direction, as a share.
const VIEW_RING: f64 = 1.22;
/// How near the pointer must come, points.
const GRAB_POINTS: f64 = 9.0;
/// An axis that points at the eye by more than this cosine cannot be dragged along.
const AXIS_END_ON: f64 = 0.985;
/// A plane seen at less than this sine cannot be dragged in.
const PLANE_EDGE_ON: f64 = 0.12;
/// A ring seen at less than this sine is turned along its tangent on the screen.
const RING_EDGE_ON: f64 = 0.2;
/// Step of snapped rotations.
const SNAP_RAD: f64 = PI / 12.0;
/// Step of snapped scales.
const SNAP_SCALE: f64 = 0.1;

/// What a drag in the view does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Tool {
    /// Only selects.
    Select,
    /// Moves.
    #[default]
    Move,
    /// Turns.
    Rotate,
    /// Scales, always along the object's own axes, so that no shear arises.
    Scale,
}

/// Whose axes the handles follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Space {
    /// The world's.
    #[default]
    World,
    /// Those of the object selected last.
    Local,
}

/// A part of the gizmo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handle {
    /// Along axis 0..3.
    Axis(usize),
    /// In the plane across axis 0..3.
    Plane(usize),
    /// Around axis 0..3.
    Ring(usize),
    /// Around the viewing direction.
    ViewRing,
    /// The middle: in the plane of the picture, or all axes alike.
    Center,
}

/// Where the gizmo is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Middle, metres, world space.
    pub origin: DVec3,
    /// Unit axes, world space.
    pub axes: [DVec3; 3],
    /// Length of an axis handle, metres.
    pub size_m: f64,
}

impl Frame {
    /// A gizmo of constant size on the screen.
    pub fn new(origin: DVec3, axes: [DVec3; 3], view: &ViewProjection) -> Self {
        Self { origin, axes, size_m: view.metres_per_point(origin) * AXIS_POINTS }
    }

    fn at(&self, axis: usize, share: f64) -> DVec3 {
        self.origin + self.axes[axis] * (self.size_m * share)
    }

    /// Corners of the square handle across `axis`.
    fn plane_corners(&self, axis: usize) -> [DVec3; 4] {
        let (u, v) = (self.axes[(axis + 1) % 3] * self.size_m, self.axes[(axis + 2) % 3] * self.size_m);
        let (low, high) = PLANE_RANGE;
        [(low, low), (high, low), (high, high), (low, high)].map(|(a, b)| self.origin + u * a + v * b)
    }

    /// A closed line of `count` places around `normal`.
    fn circle(&self, normal: DVec3, share: f64, count: usize) -> Vec<DVec3> {
        let (u, v) = normal.any_orthonormal_pair();
        let radius = self.size_m * share;
        let place = |i: usize| {
            let (sin, cos) = (TAU * i as f64 / count as f64).sin_cos();
            self.origin + (u * cos + v * sin) * radius
        };
        (0..=count).map(place).collect()
    }
}

fn axis_is_usable(frame: &Frame, view: &ViewProjection, axis: usize) -> bool {
    frame.axes[axis].dot(view.towards_eye(frame.origin)).abs() < AXIS_END_ON
}

fn plane_is_usable(frame: &Frame, view: &ViewProjection, axis: usize) -> bool {
    frame.axes[axis].dot(view.towards_eye(frame.origin)).abs() > PLANE_EDGE_ON
}

/// The handle under the pointer.
pub fn hit(tool: Tool, frame: &Frame, view: &ViewProjection, pointer: DVec2) -> Option<Handle> {
    let center = view.project(frame.origin)?;
    match tool {
        Tool::Select => None,
        Tool::Move | Tool::Scale => {
            if pointer.distance(center) < GRAB_POINTS {
                return Some(Handle::Center);
            }
            let plane = (0..3)
                .find(|&axis| plane_is_usable(frame, view, axis) && in_plane(frame, view, axis, pointer));
            if tool == Tool::Move && plane.is_some() {
                return plane.map(Handle::Plane);
            }
            nearest((0..3).filter(|&axis| axis_is_usable(frame, view, axis)).filter_map(|axis| {
                let (a, b) = (view.project(frame.at(axis, AXIS_START))?, view.project(frame.at(axis, 1.08))?);
                Some((Handle::Axis(axis), distance_to_segment(pointer, a, b)))
            }))
        }
        Tool::Rotate => {
            let rings = (0..3).map(|axis| {
                let line = frame.circle(frame.axes[axis], 1.0, 64);
                (Handle::Ring(axis), distance_to_front(frame, view, &line, pointer))
            });
            let outer = frame.circle(view.towards_eye(frame.origin), VIEW_RING, 64);
            let outer = (Handle::ViewRing, distance_to_line(view, &outer, pointer));
            nearest(rings.chain([outer]))
        }
    }
}

fn nearest(candidates: impl Iterator<Item = (Handle, f64)>) -> Option<Handle> {
    candidates.filter(|(_, d)| *d < GRAB_POINTS).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(handle, _)| handle)
}

fn in_plane(frame: &Frame, view: &ViewProjection, axis: usize, pointer: DVec2) -> bool {
    let corners = frame.plane_corners(axis).map(|corner| view.project(corner));
    let mut sides = [0.0; 4];
    for (i, side) in sides.iter_mut().enumerate() {
        let (Some(a), Some(b)) = (corners[i], corners[(i + 1) % 4]) else { return false };
        *side = (b - a).perp_dot(pointer - a);
    }
    sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
}

fn distance_to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = ((point - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
    point.distance(a + (b - a) * along)
}

fn distance_to_line(view: &ViewProjection, line: &[DVec3], pointer: DVec2) -> f64 {
    let points: Vec<_> = line.iter().map(|&place| view.project(place)).collect();
    let pairs = points.windows(2).filter_map(|pair| Some((pair[0]?, pair[1]?)));
    pairs.map(|(a, b)| distance_to_segment(pointer, a, b)).fold(f64::INFINITY, f64::min)
}

/// Like [`distance_to_line`], for the half that faces the eye.
fn distance_to_front(frame: &Frame, view: &ViewProjection, line: &[DVec3], pointer: DVec2) -> f64 {
    let front: Vec<_> = line.iter().copied().map(|p| is_front(frame, view, p).then_some(p)).collect();
    let pairs = front.windows(2).filter_map(|pair| Some([pair[0]?, pair[1]?]));
    pairs.map(|pair| distance_to_line(view, &pair, pointer)).fold(f64::INFINITY, f64::min)
}

fn is_front(frame: &Frame, view: &ViewProjection, place: DVec3) -> bool {
    (place - frame.origin).dot(view.towards_eye(frame.origin)) > -0.05 * frame.size_m
}

/// What a drag does to every selected object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Moved by metres, world space.
    Translate(DVec3),
    /// Turned about a unit axis through the gizmo's middle.
    Rotate {
        /// World space.
        axis: DVec3,
        /// Counter-clockwise seen against the axis.
        angle_rad: f64,
    },
    /// Scaled along the object's own axes.
    Scale(DVec3),
}

/// A drag of a handle, from press to release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// What is dragged.
    pub handle: Handle,
    tool: Tool,
    frame: Frame,
    start: DVec2,
    /// Last angle about the ring, so that more than half a turn can be made.
    last_angle: f64,
    turned: f64,
}

impl Drag {
    /// Starts at the pointer.
    pub fn new(tool: Tool, handle: Handle, frame: Frame, pointer: DVec2) -> Self {
        Self { handle, tool, frame, start: pointer, last_angle: 0.0, turned: 0.0 }
    }

    /// The frame at the start.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// What moving the pointer here means; `None` where it means nothing (a ray along the plane).
    pub fn motion(&mut self, view: &ViewProjection, pointer: DVec2, snap: bool) -> Option<Motion> {
        match self.tool {
            Tool::Select => None,
            Tool::Move => self.translation(view, pointer, snap).map(Motion::Translate),
            Tool::Rotate => self.rotation(view, pointer, snap),
            Tool::Scale => self.factors(view, pointer, snap).map(Motion::Scale),
        }
    }

    fn translation(&self, view: &ViewProjection, pointer: DVec2, snap: bool) -> Option<DVec3> {
        let (from, to) = (view.ray(self.start), view.ray(pointer));
        let frame = &self.frame;
        let moved = match self.handle {
            Handle::Axis(axis) => {
                let along = |ray: &Ray| ray.nearest_on_line(frame.origin, frame.axes[axis]);
                frame.axes[axis] * (along(&to)? - along(&from)?)
            }
            Handle::Plane(axis) => plane_motion(&from, &to, frame.origin, frame.axes[axis])?,
            _ => plane_motion(&from, &to, frame.origin, view.forward())?,
        };
        if !snap {
            return Some(moved);
        }
        let step = snap_step_m(frame.size_m);
        Some(frame.axes.iter().map(|axis| *axis * ((moved.dot(*axis) / step).round() * step)).sum())
    }

    fn rotation(&mut self, view: &ViewProjection, pointer: DVec2, snap: bool) -> Option<Motion> {
        let towards = view.towards_eye(self.frame.origin);
        let axis = match self.handle {
            Handle::Ring(axis) => self.frame.axes[axis],
            _ => towards,
        };
        let angle = if axis.dot(towards).abs() > RING_EDGE_ON {
            let now = ring_angle(view, self.frame.origin, axis, self.start, pointer)?;
            self.turned += wrap(now - self.last_angle);
            self.last_angle = now;
            self.turned
        } else {
            self.tangent_angle(view, axis, pointer)?
        };
        let angle_rad = if snap { (angle / SNAP_RAD).round() * SNAP_RAD } else { angle };
        Some(Motion::Rotate { axis, angle_rad })
    }

    /// Angle of a ring seen edge-on: how far the pointer went along the ring's line on the screen.
    fn tangent_angle(&self, view: &ViewProjection, axis: DVec3, pointer: DVec2) -> Option<f64> {
        let outwards = view.towards_eye(self.frame.origin);
        let outwards = (outwards - axis * axis.dot(outwards)).try_normalize()?;
        let near = self.frame.origin + outwards * self.frame.size_m;
        let tangent = axis.cross(outwards) * (self.frame.size_m * 0.1);
        let on_screen = view.project(near + tangent)? - view.project(near - tangent)?;
        let points_per_rad = on_screen.length() / 0.2;
        Some((pointer - self.start).dot(on_screen.try_normalize()?) / points_per_rad.max(1e-6))
    }

    fn factors(&self, view: &ViewProjection, pointer: DVec2, snap: bool) -> Option<DVec3> {
        let snapped = |factor: f64| if snap { (factor / SNAP_SCALE).round() * SNAP_SCALE } else { factor };
        let keep_off_zero = |factor: f64| if factor.abs() < 1e-3 { 1e-3 } else { factor };
        match self.handle {
            Handle::Axis(axis) => {
                let along = |p: DVec2| view.ray(p).nearest_on_line(self.frame.origin, self.frame.axes[axis]);
                let start = along(self.start)?;
                let factor = along(pointer)? / if start.abs() < 1e-12 { return None } else { start };
                let mut factors = DVec3::ONE;
                factors[axis] = keep_off_zero(snapped(factor));
                Some(factors)
            }
            _ => {
                let moved = pointer - self.start;
                Some(DVec3::splat(keep_off_zero(snapped(((moved.x - moved.y) / AXIS_POINTS).exp2()))))
            }
        }
    }
}

fn plane_motion(from: &Ray, to: &Ray, point: DVec3, normal: DVec3) -> Option<DVec3> {
    Some(to.meet_plane(point, normal)? - from.meet_plane(point, normal)?)
}

/// Angle about `axis` from one pointer position to another, in -pi..pi.
fn ring_angle(view: &ViewProjection, origin: DVec3, axis: DVec3, from: DVec2, to: DVec2) -> Option<f64> {
    let arm = |p: DVec2| Some(view.ray(p).meet_plane(origin, axis)? - origin);
    let (a, b) = (arm(from)?, arm(to)?);
    Some(axis.dot(a.cross(b)).atan2(a.dot(b)))
}

fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// A round step for snapped moves: a power of ten near a tenth of the handle's length.
pub fn snap_step_m(size_m: f64) -> f64 {
    10.0_f64.powf((size_m.max(1e-9) * 0.2).log10().floor())
}

/// An object as it was when the drag began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Its transform against its parent.
    pub local: Local,
    /// Its parent's space to world space.
    pub world_from_parent: DAffine3,
    /// The point of its own space that stays where it is when it is scaled.
    pub middle: DVec3,
}

impl Start {
    /// The local transform after a motion about `pivot` (metres, world space). Translation, rotation and scale stay
    /// apart, so that no shear arises; `None` when the parent cannot be inverted.
    pub fn moved(&self, motion: Motion, pivot: DVec3) -> Option<Local> {
        let parent_from_world = self.world_from_parent.inverse();
        if !parent_from_world.is_finite() {
            return None;
        }
        let position = self.world_from_parent.transform_point3(self.local.translation());
        let moved = match motion {
            Motion::Translate(by) => {
                with_translation(self.local, parent_from_world.transform_point3(position + by))
            }
            Motion::Rotate { axis, angle_rad } => {
                let turn = DQuat::from_axis_angle(axis, angle_rad);
                let place = parent_from_world.transform_point3(pivot + turn * (position - pivot));
                // A mirrored parent turns the other way round.
                let sign = self.world_from_parent.matrix3.determinant().signum();
                let axis = parent_from_world.transform_vector3(axis).try_normalize()?;
                with_rotation(
                    with_translation(self.local, place),
                    DQuat::from_axis_angle(axis, angle_rad * sign),
                )
            }
            Motion::Scale(factors) => {
                let scaled = with_scale(self.local, factors);
                let stays = |local: Local| local.to_affine().transform_point3(self.middle);
                with_translation(scaled, scaled.translation() + stays(self.local) - stays(scaled))
            }
        };
        moved.is_finite().then_some(moved)
    }
}

fn with_translation(local: Local, translation: DVec3) -> Local {
    match local {
        Local::Trs(trs) => Local::Trs(Trs { translation, ..trs }),
        Local::Matrix(matrix) => Local::Matrix(DAffine3 { translation, ..matrix }),
    }
}

fn with_rotation(local: Local, turn: DQuat) -> Local {
    match local {
        Local::Trs(trs) => Local::Trs(Trs { rotation: (turn * trs.rotation).normalize(), ..trs }),
        Local::Matrix(matrix) => {
            Local::Matrix(DAffine3 { matrix3: DMat3::from_quat(turn) * matrix.matrix3, ..matrix })
        }
    }
}

fn with_scale(local: Local, factors: DVec3) -> Local {
    match local {
        Local::Trs(trs) => Local::Trs(Trs { scale: trs.scale * factors, ..trs }),
        Local::Matrix(matrix) => {
            Local::Matrix(DAffine3 { matrix3: matrix.matrix3 * DMat3::from_diagonal(factors), ..matrix })
        }
    }
}

#[cfg(test)]
#[path = "gizmo/tests.rs"]
mod tests;
