//! Draws the gizmo with egui's painter. Enters: frame, view, which handle is hovered or dragged. Leaves: shapes.

use egui::{Color32, Painter, Pos2, Shape, Stroke, Vec2};
use glam::{DVec2, DVec3};

use super::{AXIS_START, Frame, Handle, Motion, Tool, VIEW_RING, axis_is_usable, is_front, plane_is_usable};
use crate::projection::ViewProjection;

const AXIS_COLORS: [Color32; 3] =
    [Color32::from_rgb(236, 86, 92), Color32::from_rgb(124, 196, 74), Color32::from_rgb(74, 142, 240)];
const ACTIVE: Color32 = Color32::from_rgb(255, 205, 72);
const NEUTRAL: Color32 = Color32::from_rgb(230, 232, 236);

/// Colour of a world axis, as in the gizmo.
pub fn axis_color(axis: usize) -> Color32 {
    AXIS_COLORS[axis % 3]
}

/// What is drawn.
pub struct GizmoPicture<'a> {
    /// Which tool.
    pub tool: Tool,
    /// Where.
    pub frame: &'a Frame,
    /// The view.
    pub view: &'a ViewProjection,
    /// Upper left corner of the view, points of the window.
    pub origin: Pos2,
    /// The handle under the pointer or in the hand.
    pub active: Option<Handle>,
    /// True: only the handle in the hand is drawn.
    pub dragging: bool,
}

impl GizmoPicture<'_> {
    /// Draws it.
    pub fn paint(&self, painter: &Painter) {
        match self.tool {
            Tool::Select => {}
            Tool::Move | Tool::Scale => self.paint_axes(painter),
            Tool::Rotate => self.paint_rings(painter),
        }
    }

    fn point(&self, place: DVec3) -> Option<Pos2> {
        self.view.project(place).map(|p| to_pos(self.origin, p))
    }

    fn shown(&self, handle: Handle) -> bool {
        !self.dragging || self.active == Some(handle)
    }

    fn color(&self, handle: Handle, rest: Color32) -> Color32 {
        if self.active == Some(handle) { ACTIVE } else { rest }
    }

    fn paint_axes(&self, painter: &Painter) {
        let towards = self.view.towards_eye(self.frame.origin);
        let mut order = [0, 1, 2];
        // What points away is drawn first.
        order.sort_by(|a, b| self.frame.axes[*a].dot(towards).total_cmp(&self.frame.axes[*b].dot(towards)));
        if self.tool == Tool::Move {
            for axis in order.into_iter().filter(|&axis| plane_is_usable(self.frame, self.view, axis)) {
                self.paint_plane(painter, axis);
            }
        }
        for axis in order.into_iter().filter(|&axis| axis_is_usable(self.frame, self.view, axis)) {
            self.paint_axis(painter, axis);
        }
        if self.shown(Handle::Center)
            && let Some(center) = self.point(self.frame.origin)
        {
            let color = self.color(Handle::Center, NEUTRAL);
            painter.circle(center, 6.0, color.gamma_multiply(0.35), Stroke::new(1.5, color));
        }
    }

    fn paint_axis(&self, painter: &Painter, axis: usize) {
        let handle = Handle::Axis(axis);
        if !self.shown(handle) {
            return;
        }
        let (Some(start), Some(end)) =
            (self.point(self.frame.at(axis, AXIS_START)), self.point(self.frame.at(axis, 1.0)))
        else {
            return;
        };
        let color = self.color(handle, AXIS_COLORS[axis]);
        let direction = (end - start).normalized();
        if self.dragging {
            let far = direction * 4000.0;
            painter.line_segment([start - far, start + far], Stroke::new(1.0, color.gamma_multiply(0.5)));
        }
        painter.line_segment([start, end], Stroke::new(2.5, color));
        if self.tool == Tool::Scale {
            painter.rect_filled(egui::Rect::from_center_size(end, Vec2::splat(11.0)), 2.0, color);
        } else {
            let side = direction.rot90() * 6.0;
            let tip = end + direction * 15.0;
            painter.add(Shape::convex_polygon(vec![tip, end + side, end - side], color, Stroke::NONE));
        }
    }

    fn paint_plane(&self, painter: &Painter, axis: usize) {
        let handle = Handle::Plane(axis);
        if !self.shown(handle) {
            return;
        }
        let corners: Vec<_> =
            self.frame.plane_corners(axis).into_iter().filter_map(|c| self.point(c)).collect();
        if corners.len() == 4 {
            let color = self.color(handle, AXIS_COLORS[axis]);
            painter.add(Shape::convex_polygon(corners, color.gamma_multiply(0.35), Stroke::new(1.2, color)));
        }
    }

    fn paint_rings(&self, painter: &Painter) {
        for (axis, rest) in AXIS_COLORS.into_iter().enumerate() {
            let handle = Handle::Ring(axis);
            if !self.shown(handle) {
                continue;
            }
            let color = self.color(handle, rest);
            let line = self.frame.circle(self.frame.axes[axis], 1.0, 96);
            for pair in line.windows(2) {
                let front = is_front(self.frame, self.view, pair[0]);
                if !front && !self.dragging {
                    continue;
                }
                if let (Some(a), Some(b)) = (self.point(pair[0]), self.point(pair[1])) {
                    let faded = if front { color } else { color.gamma_multiply(0.25) };
                    painter.line_segment([a, b], Stroke::new(2.5, faded));
                }
            }
        }
        if self.shown(Handle::ViewRing) {
            let ring = self.frame.circle(self.view.towards_eye(self.frame.origin), VIEW_RING, 96);
            let points: Vec<_> = ring.into_iter().filter_map(|place| self.point(place)).collect();
            let color = self.color(Handle::ViewRing, NEUTRAL.gamma_multiply(0.7));
            painter.add(Shape::line(points, Stroke::new(1.5, color)));
        }
    }
}

/// What a motion does, in figures, for the caption beside the pointer.
pub fn describe(motion: Motion) -> String {
    match motion {
        Motion::Translate(by) => format!("{:+.3}  {:+.3}  {:+.3} m", by.x, by.y, by.z),
        Motion::Rotate { angle_rad, .. } => format!("{:+.1}\u{b0}", angle_rad.to_degrees()),
        Motion::Scale(factors) => format!("\u{d7} {:.3}  {:.3}  {:.3}", factors.x, factors.y, factors.z),
    }
}

fn to_pos(origin: Pos2, point: DVec2) -> Pos2 {
    origin + Vec2::new(point.x as f32, point.y as f32)
}
