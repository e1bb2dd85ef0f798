//! The picture with what lies over it: gizmo, marks of lights and cameras, axis cross, figures. Enters: the session's
//! image, the camera. Leaves: clicks as selections, drags as edits and camera moves.

use caustica_scene::{Document, Driven, Target};
use egui::{Align2, Color32, CornerRadius, FontId, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, vec2};
use egui_phosphor::regular as icon;
use glam::{DVec2, DVec3};

use super::{Cx, view_input};
use crate::app::actions::Action;
use crate::camera_control::AxisView;
use crate::gizmo::paint::{GizmoPicture, axis_color, describe};
use crate::gizmo::{Frame, Handle, Space, Tool};
use crate::projection::ViewProjection;
use crate::ui_renderer::VIEW_TEXTURE;
use crate::ui_state::{Selection, ViewState};

/// Most marks of lights and cameras that are drawn.
const MOST_MARKS: usize = 256;
/// Half the size of a mark, points.
const MARK_POINTS: f32 = 11.0;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let rect = snapped(ui.available_rect_before_wrap(), ui.pixels_per_point());
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    remember_size(cx, rect, ui.pixels_per_point());
    if cx.state.view.extent_px.is_none() {
        return;
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, CornerRadius::ZERO, Color32::BLACK);
    painter.image(VIEW_TEXTURE, rect, Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0)), Color32::WHITE);

    view_input::camera(cx, ui, &response);
    let view = projection(cx);
    let mark = marks(cx, ui, &view, rect);
    let frame = gizmo_frame(cx, &view);
    view_input::gizmo(cx, ui, &response, &view, frame.as_ref());
    paint_gizmo(cx, ui, &view, rect, frame);
    match axis_cross(cx, ui, &view, rect, &response) {
        Some(axis) => cx.act(Action::AxisView(axis)),
        None => view_input::click(cx, ui, &response, mark),
    }
    figures(cx, ui, rect);
    note(cx, ui, rect);
    response.context_menu(|ui| context_menu(cx, ui));
}

/// Corners on whole device pixels, so that one texel is one pixel.
fn snapped(rect: Rect, pixels_per_point: f32) -> Rect {
    let snap = |p: Pos2| {
        Pos2::new((p.x * pixels_per_point).round(), (p.y * pixels_per_point).round()) / pixels_per_point
    };
    Rect::from_min_max(snap(rect.min), snap(rect.max))
}

fn remember_size(cx: &mut Cx<'_>, rect: Rect, pixels_per_point: f32) {
    let pixels = |points: f32| (points * pixels_per_point).round().max(0.0) as u32;
    let extent = [pixels(rect.width()), pixels(rect.height())];
    let view = &mut cx.state.view;
    view.rect = rect;
    view.extent_px = (extent[0] >= 8 && extent[1] >= 8).then_some(extent);
}

/// The camera of the session on the panel, in points.
pub fn projection(cx: &Cx<'_>) -> ViewProjection {
    let camera = cx.session.camera();
    let size = cx.state.view.rect.size();
    ViewProjection::new(camera.world_from_camera, camera.projection, DVec2::new(size.x.into(), size.y.into()))
}

/// Where the gizmo stands: in the middle of what is selected, objects or a primitive.
fn gizmo_frame(cx: &Cx<'_>, view: &ViewProjection) -> Option<Frame> {
    if let Some(drag) = &cx.state.view.drag {
        let start = drag.drag.frame();
        let moved = match drag.motion {
            Some(crate::gizmo::Motion::Translate(by)) => by,
            _ => DVec3::ZERO,
        };
        return Some(Frame::new(start.origin + moved, start.axes, view));
    }
    let document = cx.session.document();
    if cx.state.selection.targets().iter().any(|target| document.locked_by(*target).is_some()) {
        return None;
    }
    let primitive = cx.state.selection.primitive(document);
    let world_from_primitive = primitive.and_then(|primitive| {
        let world = document.world_from_mesh(primitive.target)? * primitive.mesh_from_primitive;
        Some((world, world.transform_point3(primitive.middle)))
    });
    let places: Vec<DVec3> = match world_from_primitive {
        Some((_, middle)) => vec![middle],
        None => {
            let tops = cx.state.selection.tops(document);
            tops.iter().filter_map(|target| Some(document.world_from(*target)?.translation)).collect()
        }
    };
    let origin = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    let local = cx.state.space == Space::Local || cx.state.tool == Tool::Scale;
    let active = || cx.state.selection.active().and_then(|active| document.world_from(active));
    let axes = match world_from_primitive.map(|(world, _)| world).or_else(active) {
        Some(world) if local => {
            let m = world.matrix3;
            [
                m.x_axis.normalize_or(DVec3::X),
                m.y_axis.normalize_or(DVec3::Y),
                m.z_axis.normalize_or(DVec3::Z),
            ]
        }
        _ => [DVec3::X, DVec3::Y, DVec3::Z],
    };
    (!places.is_empty() && origin.is_finite()).then(|| Frame::new(origin, axes, view))
}

fn paint_gizmo(cx: &Cx<'_>, ui: &Ui, view: &ViewProjection, rect: Rect, frame: Option<Frame>) {
    let Some(frame) = frame else { return };
    let drag = cx.state.view.drag.as_ref();
    let active: Option<Handle> = drag.map(|drag| drag.drag.handle).or(cx.state.view.hovered);
    let painter = ui.painter_at(rect);
    let picture = GizmoPicture {
        tool: cx.state.tool,
        frame: &frame,
        view,
        origin: rect.min,
        active,
        dragging: drag.is_some(),
    };
    picture.paint(&painter);
    if let Some(motion) = drag.and_then(|drag| drag.motion)
        && let Some(pointer) = ui.ctx().pointer_latest_pos()
    {
        caption(&painter, pointer + vec2(18.0, 18.0), Align2::LEFT_TOP, &describe(motion));
    }
}

/// Lights and cameras of the document, collected anew only when nodes came or went.
fn marked(cx: &mut Cx<'_>) -> Vec<Target> {
    let revision = cx.session.history().structure_revision();
    if let Some((at, targets)) = &cx.state.view.marked
        && *at == revision
    {
        return targets.clone();
    }
    let document = cx.session.document();
    let lights = document.lights().map(|light| light.target);
    let cameras = document.cameras().map(|camera| camera.target);
    let targets: Vec<Target> = lights.chain(cameras).take(MOST_MARKS).collect();
    cx.state.view.marked = Some((revision, targets.clone()));
    targets
}

/// Draws a mark for each light and camera; gives the one under the pointer.
fn marks(cx: &mut Cx<'_>, ui: &Ui, view: &ViewProjection, rect: Rect) -> Option<Target> {
    let targets = marked(cx);
    let document = cx.session.document();
    let pointer = ui.ctx().pointer_hover_pos();
    let painter = ui.painter_at(rect);
    let mut under_pointer = None;
    for target in targets {
        let Some(place) = document.world_from(target).map(|world| world.translation) else { continue };
        let visible = document.effectively_visible(target);
        let Some(point) = view.project(place) else { continue };
        let at = rect.min + vec2(point.x as f32, point.y as f32);
        if !rect.contains(at) || place.distance(view.eye()) < 1e-3 {
            continue;
        }
        let hovered = pointer.is_some_and(|pointer| pointer.distance(at) < MARK_POINTS);
        let selected = cx.state.selection.contains(target);
        let ink = if selected {
            crate::theme::accent(ui.visuals())
        } else if hovered {
            Color32::WHITE
        } else {
            Color32::from_gray(210)
        };
        let faded = if visible { 1.0 } else { 0.4 };
        painter.circle(
            at,
            MARK_POINTS,
            Color32::from_black_alpha(if hovered { 190 } else { 130 }).gamma_multiply(faded),
            Stroke::new(if selected { 1.5 } else { 0.0 }, ink),
        );
        let icon = super::target_icon(cx, target);
        painter.text(at, Align2::CENTER_CENTER, icon, FontId::proportional(14.0), ink.gamma_multiply(faded));
        if hovered {
            under_pointer = Some(target);
        }
    }
    under_pointer
}

/// The small cross in the corner that shows the world's axes; gives the view whose end was clicked.
fn axis_cross(
    cx: &Cx<'_>,
    ui: &Ui,
    view: &ViewProjection,
    rect: Rect,
    response: &Response,
) -> Option<AxisView> {
    const ARM: f32 = 26.0;
    if rect.width() < 220.0 || rect.height() < 160.0 {
        return None;
    }
    let center = Pos2::new(rect.right() - ARM - 18.0, rect.top() + ARM + 18.0);
    let painter = ui.painter_at(rect);
    let ends = [
        (DVec3::X, 0, "X", AxisView::Right),
        (DVec3::NEG_X, 0, "", AxisView::Left),
        (DVec3::Y, 1, "Y", AxisView::Top),
        (DVec3::NEG_Y, 1, "", AxisView::Bottom),
        (DVec3::Z, 2, "Z", AxisView::Front),
        (DVec3::NEG_Z, 2, "", AxisView::Back),
    ];
    let mut placed = ends.map(|(direction, axis, name, looks)| {
        let offset = vec2(direction.dot(view.right()) as f32, -direction.dot(view.up()) as f32) * ARM;
        (direction.dot(view.forward()), center + offset, axis, name, looks)
    });
    placed.sort_by(|a, b| b.0.total_cmp(&a.0));
    let pointer = ui.ctx().pointer_hover_pos().filter(|_| response.hovered() && cx.state.view.drag.is_none());
    let mut hovered = None;
    for (depth, at, axis, name, looks) in placed {
        let fade = if depth > 0.2 { 0.45 } else { 1.0 };
        let color = axis_color(axis).gamma_multiply(fade);
        let is_hovered = pointer.is_some_and(|pointer| pointer.distance(at) < 9.0);
        if is_hovered {
            hovered = Some(looks);
        }
        if name.is_empty() {
            painter.circle_filled(at, if is_hovered { 7.0 } else { 4.0 }, color.gamma_multiply(0.6));
        } else {
            painter.line_segment([center, at], Stroke::new(2.0, color));
            painter.circle_filled(at, if is_hovered { 10.0 } else { 8.0 }, color);
            painter.text(at, Align2::CENTER_CENTER, name, FontId::proportional(10.5), Color32::from_gray(20));
        }
    }
    hovered.filter(|_| response.clicked())
}

/// "412 samples | 2.1 ms | 1280x720" in the lower left corner.
fn figures(cx: &Cx<'_>, ui: &Ui, rect: Rect) {
    let Some([width, height]) = cx.state.view.extent_px else { return };
    let view: &ViewState = &cx.state.view;
    let statistics = cx.session.statistics();
    let ms = super::milliseconds(cx.session.device_ms(), 1);
    let mut text = format!("{} samples | {ms} ms | {width}x{height}", statistics.samples);
    if view.divisor > 1 {
        text += &format!(" at 1/{}", view.divisor);
    }
    if cx.session.is_converged() {
        text += " | done";
    }
    let painter = ui.painter_at(rect);
    caption(&painter, rect.left_bottom() + vec2(10.0, -10.0), Align2::LEFT_BOTTOM, &text);
    if view.flying {
        let text = format!("fly: W A S D Q E, Shift faster | {:.2} m/s (wheel)", view.fly_speed_m_s);
        caption(&painter, rect.center_bottom() + vec2(0.0, -10.0), Align2::CENTER_BOTTOM, &text);
    }
}

/// Says what the gizmo moves when that is not what is seen: a primitive, or a pose that a clip hides.
fn note(cx: &Cx<'_>, ui: &Ui, rect: Rect) {
    let document = cx.session.document();
    let text = match cx.state.selection.primitive(document) {
        Some(selected) => {
            let name = super::mesh::primitive_name(document, &selected);
            Some(format!("{name}: moves wherever the mesh is placed"))
        }
        None => clip_note(document, &cx.state.selection, cx.state.tool),
    };
    if let Some(text) = text {
        caption(&ui.painter_at(rect), rect.center_top() + vec2(0.0, 10.0), Align2::CENTER_TOP, &text);
    }
}

/// Warns that a clip hides what the handles do; `None`: they are seen to do it.
fn clip_note(document: &Document, selection: &Selection, tool: Tool) -> Option<String> {
    let tops = selection.tops(document);
    let hidden: Vec<Target> =
        tops.iter().copied().filter(|target| hides(document.driven(*target), tool)).collect();
    let who = match hidden.as_slice() {
        [] => return None,
        [one] => document.display_name(*one),
        more => format!("{} objects", more.len()),
    };
    let warning = icon::WARNING;
    Some(format!("{warning} a clip moves {who}: the handles change the rest pose (Shift+Space shows it)"))
}

/// Whether what a tool does is hidden by a clip that sets the same.
fn hides(driven: Driven, tool: Tool) -> bool {
    match tool {
        Tool::Select => false,
        Tool::Move => driven.translation,
        Tool::Rotate => driven.rotation,
        Tool::Scale => driven.scale,
    }
}

fn caption(painter: &egui::Painter, at: Pos2, align: Align2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::monospace(12.0), Color32::from_gray(232));
    let padding = Vec2::new(8.0, 4.0);
    let area = align.anchor_size(at, galley.size() + padding * 2.0);
    painter.rect_filled(area, CornerRadius::same(4), Color32::from_black_alpha(150));
    painter.galley(area.min + padding, galley, Color32::WHITE);
}

fn context_menu(cx: &mut Cx<'_>, ui: &mut Ui) {
    let anything = !cx.state.selection.is_empty();
    let entries = [
        ("Frame selection", Action::FrameSelection, anything),
        ("Frame everything", Action::FrameAll, true),
        ("Look through the camera", Action::SceneCamera, true),
        ("Show or hide", Action::ToggleVisible, anything),
        ("Duplicate", Action::Duplicate, anything),
        ("Delete", Action::Delete, anything),
    ];
    for (name, action, enabled) in entries {
        if ui.add_enabled(enabled, egui::Button::new(name)).clicked() {
            cx.act(action);
            ui.close();
        }
    }
}
