//! What mouse and keys do over the picture. Enters: egui's input over the view. Leaves: camera moves, gizmo drags as
//! edits, selections.

use caustica_scene::{Edit, Local, Target};
use egui::{CursorIcon, Key, PointerButton, Pos2, Response, Ui};
use glam::{DVec2, DVec3};

use super::Cx;
use crate::camera_control::{Pose, near_for};
use crate::gizmo::{self, Drag, Frame, Start, Tool};
use crate::projection::ViewProjection;
use crate::session::{Pick, ViewCamera};
use crate::ui_state::{GizmoDrag, Moved};

const ORBIT_RAD_PER_POINT: f64 = 0.006;
const LOOK_RAD_PER_POINT: f64 = 0.0035;
/// Share of the distance that one point of the wheel moves.
const WHEEL_PER_POINT: f64 = 0.0035;
const DOLLY_PER_POINT: f64 = 0.008;

/// Puts the session's camera at a pose; lens and near plane follow.
pub fn set_pose(cx: &mut Cx<'_>, pose: Pose) {
    let near_m = near_for(cx.state.view.distance_m);
    let projection = cx.session.camera().projection;
    cx.session.set_camera(ViewCamera { world_from_camera: pose.to_affine(), projection, near_m });
}

/// Orbit, pan, dolly, fly.
pub fn camera(cx: &mut Cx<'_>, ui: &Ui, response: &Response) {
    let start = Pose::from_affine(&cx.session.camera().world_from_camera);
    let mut pose = start;
    let (modifiers, delta) = ui.input(|input| (input.modifiers, input.pointer.delta()));
    let (dx, dy) = (f64::from(delta.x), f64::from(delta.y));
    let middle = response.dragged_by(PointerButton::Middle);
    let alt_left =
        modifiers.alt && response.dragged_by(PointerButton::Primary) && cx.state.view.drag.is_none();
    cx.state.view.navigating = middle || alt_left;
    if middle && modifiers.shift {
        let metres = super::view::projection(cx).metres_per_point(pose.pivot(cx.state.view.distance_m));
        pose = pose.pan(-dx * metres, dy * metres);
    } else if middle && modifiers.command {
        pose = dolly(cx, pose, (dy * DOLLY_PER_POINT).exp());
    } else if middle || alt_left {
        pose = pose.orbit(cx.state.view.distance_m, -dx * ORBIT_RAD_PER_POINT, -dy * ORBIT_RAD_PER_POINT);
    }
    pose = fly(cx, ui, response, pose, DVec2::new(dx, dy));
    if response.hovered() && !cx.state.view.flying {
        let wheel = f64::from(ui.input(|input| input.smooth_scroll_delta().y));
        let pinch = f64::from(ui.input(|input| input.zoom_delta()));
        let factor = (-wheel * WHEEL_PER_POINT).exp() / if modifiers.command { pinch } else { 1.0 };
        if factor.is_finite() && factor > 0.0 && (factor - 1.0).abs() > 1e-9 {
            pose = dolly(cx, pose, factor);
        }
    }
    if pose != start {
        set_pose(cx, pose);
    }
    if cx.state.view.navigating {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
    }
}

fn dolly(cx: &mut Cx<'_>, pose: Pose, factor: f64) -> Pose {
    let (pose, distance) = pose.dolly(cx.state.view.distance_m, factor);
    cx.state.view.distance_m = distance;
    if let caustica_scene::Projection::Orthographic { ymag_m } = cx.session.camera().projection {
        let ymag_m = (f64::from(ymag_m) * factor).clamp(1e-5, 1e7) as f32;
        let projection = caustica_scene::Projection::Orthographic { ymag_m };
        let camera = ViewCamera { projection, ..*cx.session.camera() };
        cx.session.set_camera(camera);
    }
    pose
}

/// While the right button is held: the mouse looks, W A S D Q E move.
fn fly(cx: &mut Cx<'_>, ui: &Ui, response: &Response, pose: Pose, delta: DVec2) -> Pose {
    let held = response.is_pointer_button_down_on() && ui.input(|input| input.pointer.secondary_down());
    let dragged = response.dragged_by(PointerButton::Secondary);
    let (keys, fast, seconds, wheel) = ui.input(|input| {
        let down = |key: Key, other: Key| {
            f64::from(u8::from(input.key_down(key))) - f64::from(u8::from(input.key_down(other)))
        };
        let along = DVec3::new(down(Key::D, Key::A), down(Key::E, Key::Q), down(Key::W, Key::S));
        (
            along,
            input.modifiers.shift,
            f64::from(input.stable_dt).min(0.1),
            f64::from(input.smooth_scroll_delta().y),
        )
    });
    let moving = held && keys != DVec3::ZERO;
    // A right click without a move opens the menu: flying begins with the first move or key.
    cx.state.view.flying = held && (dragged || moving || cx.state.view.flying);
    if !cx.state.view.flying {
        return pose;
    }
    let speed = &mut cx.state.view.fly_speed_m_s;
    *speed = (*speed * (wheel * 0.004).exp()).clamp(1e-4, 1e6);
    let pose =
        if dragged { pose.look(-delta.x * LOOK_RAD_PER_POINT, -delta.y * LOOK_RAD_PER_POINT) } else { pose };
    if !moving {
        return pose;
    }
    ui.ctx().request_repaint();
    let metres = *speed * seconds * if fast { 4.0 } else { 1.0 };
    pose.fly(keys.normalize_or_zero() * metres)
}

/// Hovers, starts, carries on, ends or cancels a drag of the gizmo.
pub fn gizmo(cx: &mut Cx<'_>, ui: &Ui, response: &Response, view: &ViewProjection, frame: Option<&Frame>) {
    let origin = cx.state.view.rect.min;
    if cx.state.view.drag.is_some() {
        carry_on(cx, ui, response, view, origin);
        return;
    }
    cx.state.view.hovered = None;
    let busy = cx.state.view.navigating || cx.state.view.flying || ui.input(|input| input.modifiers.alt);
    let Some(frame) = frame.filter(|_| !busy && cx.state.tool != Tool::Select) else { return };
    if response.hovered()
        && let Some(pointer) = ui.ctx().pointer_hover_pos()
    {
        cx.state.view.hovered = gizmo::hit(cx.state.tool, frame, view, local(pointer, origin));
        if cx.state.view.hovered.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
    }
    if response.drag_started_by(PointerButton::Primary)
        // egui tells of a drag only after some points: where the button went down counts.
        && let Some(press) = ui.input(|input| input.pointer.press_origin())
        && let Some(handle) = gizmo::hit(cx.state.tool, frame, view, local(press, origin))
    {
        let starts = starts(cx);
        if !starts.is_empty() {
            let drag = Drag::new(cx.state.tool, handle, *frame, local(press, origin));
            cx.session.end_gesture();
            cx.state.view.drag = Some(GizmoDrag { drag, starts, motion: None });
            carry_on(cx, ui, response, view, origin);
        }
    }
}

fn local(pointer: Pos2, origin: Pos2) -> DVec2 {
    DVec2::new((pointer.x - origin.x).into(), (pointer.y - origin.y).into())
}

/// What a drag moves: the selected primitive, else the selected objects.
fn starts(cx: &Cx<'_>) -> Vec<(Moved, Start)> {
    let document = cx.session.document();
    if let Some(primitive) = cx.state.selection.primitive(document) {
        let start = |world_from_mesh| Start {
            local: Local::from_affine(primitive.mesh_from_primitive),
            world_from_parent: world_from_mesh,
            middle: primitive.middle,
        };
        let moved = Moved::Primitive(primitive.mesh, primitive.index);
        return document
            .world_from_mesh(primitive.target)
            .map(start)
            .map(|s| (moved, s))
            .into_iter()
            .collect();
    }
    let start = |target: Target| {
        let (local, world_from_parent) = (document.local(target)?, document.world_from_parent(target)?);
        Some((Moved::Object(target), Start { local, world_from_parent, middle: DVec3::ZERO }))
    };
    cx.state.selection.tops(document).into_iter().filter_map(start).collect()
}

fn carry_on(cx: &mut Cx<'_>, ui: &Ui, response: &Response, view: &ViewProjection, origin: Pos2) {
    if ui.input(|input| input.key_pressed(Key::Escape)) {
        cx.state.view.drag = None;
        cx.session.cancel_gesture();
        ui.ctx().stop_dragging();
        return;
    }
    if !response.dragged_by(PointerButton::Primary) {
        cx.state.view.drag = None;
        cx.session.end_gesture();
        return;
    }
    ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
    let snap = cx.state.snap != ui.input(|input| input.modifiers.command);
    let Some(pointer) = ui.ctx().pointer_latest_pos() else { return };
    let Some(drag) = &mut cx.state.view.drag else { return };
    let Some(motion) = drag.drag.motion(view, local(pointer, origin), snap) else { return };
    if drag.motion == Some(motion) {
        return;
    }
    drag.motion = Some(motion);
    let pivot = drag.drag.frame().origin;
    let edits: Vec<Edit> = drag
        .starts
        .iter()
        .filter_map(|(moved, start)| {
            let local = start.moved(motion, pivot)?;
            Some(match *moved {
                Moved::Object(target) => Edit::SetTransform { target, local },
                Moved::Primitive(mesh, primitive) => {
                    Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive: local.to_affine() }
                }
            })
        })
        .collect();
    let count = edits.len();
    let mut edits = edits.into_iter();
    match (edits.next(), count) {
        (None, _) => {}
        (Some(edit), 1) => cx.push(edit),
        (Some(first), _) => {
            let edits = std::iter::once(first).chain(edits).collect();
            cx.push(Edit::batch(format!("moved {count} objects"), edits));
        }
    }
}

/// A click selects the object under the pointer, with Ctrl or Shift it is added or taken away; a double click selects
/// the primitive.
pub fn click(cx: &mut Cx<'_>, ui: &Ui, response: &Response, mark: Option<Target>) {
    let modifiers = ui.input(|input| input.modifiers);
    if !response.clicked() || modifiers.alt || cx.state.view.hovered.is_some() {
        return;
    }
    let Some(pointer) = response.interact_pointer_pos() else { return };
    let (target, primitive) = match mark {
        Some(target) => (Some(target), None),
        None => match pick(cx, ui, pointer) {
            Ok(hit) => (hit.map(|hit| hit.target), hit.map(|hit| hit.primitive)),
            Err(error) => {
                cx.state.toasts.error(format!("The object under the pointer cannot be found: {error:#}."));
                return;
            }
        },
    };
    // What is locked is background, as in other editors; the outliner selects it.
    let target = target.filter(|target| cx.session.document().locked_by(*target).is_none());
    let further = modifiers.command || modifiers.shift;
    match target {
        Some(target) if further => cx.state.selection.toggle(target),
        Some(target) => cx.state.selection.set(target),
        None if !further => cx.state.selection.clear(),
        None => {}
    }
    if response.double_clicked() && !further {
        cx.state.selection.set_primitive(cx.session.document(), primitive);
    }
    if let Some(target) = target {
        cx.state.outliner.reveal(cx.session.document(), target);
    }
}

fn pick(cx: &mut Cx<'_>, ui: &Ui, pointer: Pos2) -> anyhow::Result<Option<Pick>> {
    let Some([width, height]) = cx.state.view.extent_px else { return Ok(None) };
    let scale = ui.pixels_per_point() / cx.state.view.divisor.max(1) as f32;
    let at = (pointer - cx.state.view.rect.min) * scale;
    let limit = |size: u32| (size / cx.state.view.divisor.max(1)).saturating_sub(1);
    let pixel = [(at.x.max(0.0) as u32).min(limit(width)), (at.y.max(0.0) as u32).min(limit(height))];
    cx.session.pick(pixel)
}
