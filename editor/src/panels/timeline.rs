//! The time line: play, step, scrub, speed, and which clips the instances play. Enters: the session's time, the player.
//! Leaves: actions, another time, `SetClip` edits. Time is no part of the document: nothing here can be undone but a clip.

use caustica_scene::{ClipChoice, Edit, NodeId, Target};
use egui::{
    Align2, Button, ComboBox, CornerRadius, CursorIcon, DragValue, FontId, Pos2, Rect, RichText, ScrollArea,
    Sense, Shape, Stroke, Ui, vec2,
};
use egui_phosphor::regular as icon;

use super::{Cx, target_icon};
use crate::app::actions::{Action, Command, Menu, commands};
use crate::playback::FRAMES_PER_SECOND;
use crate::theme;

/// Slowest and fastest play, either way.
const SPEEDS: (f64, f64) = (0.05, 4.0);
/// Least distance of two labels of the ruler, points.
const LABEL_POINTS: f64 = 72.0;
/// Least distance of two frames that get a tick, points.
const FRAME_POINTS: f64 = 5.0;
/// Height of a line of the list of clips, points.
const ROW: f32 = 26.0;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let instances = animated(cx);
    let duration_s = cx.session.duration();
    // A time at which no clip acts is no place on the scale.
    let time_s = cx.session.time().filter(|_| duration_s.is_some());
    ui.add_enabled_ui(duration_s.is_some(), |ui| {
        transport(cx, ui, time_s, duration_s.unwrap_or(0.0));
        ui.add_space(4.0);
        if let Some(time_s) = ruler(ui, time_s, duration_s.unwrap_or(0.0)) {
            cx.state.playback.playing = false;
            cx.session.set_time(Some(time_s));
        }
    });
    ui.add_space(6.0);
    if instances.is_empty() {
        let note = "Nothing in this scene is animated. A glTF file with animations brings its clips along.";
        super::empty_note(ui, note);
        return;
    }
    if duration_s.is_none() {
        ui.weak("No clip is chosen, so that nothing moves: choose one here.");
    }
    clips(cx, ui, &instances);
}

/// Instances that have clips, collected anew only when nodes came or went.
fn animated(cx: &mut Cx<'_>) -> Vec<NodeId> {
    let revision = cx.session.history().structure_revision();
    if let Some((at, instances)) = &cx.state.animated
        && *at == revision
    {
        return instances.clone();
    }
    let document = cx.session.document();
    let instances: Vec<NodeId> =
        document.nodes().map(|(id, _)| id).filter(|id| !document.clips_of(*id).is_empty()).collect();
    cx.state.animated = Some((revision, instances.clone()));
    instances
}

/// Buttons, figures, speed.
fn transport(cx: &mut Cx<'_>, ui: &mut Ui, time_s: Option<f64>, duration_s: f64) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for command in commands().iter().filter(|command| command.menu == Menu::Animation) {
            button(cx, ui, command, time_s);
        }
        ui.add_space(8.0);
        ui.label(RichText::new(figures(time_s, duration_s)).monospace())
            .on_hover_text(format!("Time and frame, of all; {FRAMES_PER_SECOND} frames a second"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let old = cx.state.playback.speed;
            let mut speed = old;
            let drag = DragValue::new(&mut speed)
                .range(-SPEEDS.1..=SPEEDS.1)
                .speed(0.01)
                .fixed_decimals(2)
                .prefix("\u{d7} ");
            if ui.add(drag).on_hover_text("Speed; negative plays backwards").changed() {
                cx.state.playback.speed = speed_after(old, speed);
            }
            ui.label(RichText::new(icon::GAUGE).weak());
        });
    });
}

fn button(cx: &mut Cx<'_>, ui: &mut Ui, command: &Command, time_s: Option<f64>) {
    let playback = &cx.state.playback;
    let (mark, name, on) = match command.action {
        Action::PlayPause if playback.playing => (icon::PAUSE, "Pause", true),
        Action::PlayPause => (command.icon, "Play", false),
        Action::ToggleLoop => (command.icon, "Begin again at the end", playback.looping),
        Action::RestPose => (command.icon, "Rest pose: no clip acts", time_s.is_none()),
        _ => (command.icon, command.name.as_str(), false),
    };
    let key = command.shortcut.map(|shortcut| format!(" ({})", ui.ctx().format_shortcut(&shortcut)));
    let wide = if command.action == Action::PlayPause { 44.0 } else { 30.0 };
    let button = Button::new(RichText::new(mark).size(16.0)).selected(on).min_size(vec2(wide, 26.0));
    if ui.add(button).on_hover_text(format!("{name}{}", key.unwrap_or_default())).clicked() {
        cx.act(command.action.clone());
    }
}

/// "  1.042 / 3.333 s   frame 25 / 80".
fn figures(time_s: Option<f64>, duration_s: f64) -> String {
    let frame = |time_s: f64| (time_s * FRAMES_PER_SECOND + 1e-6).floor();
    // As wide as the last ones, so that they do not jump.
    let (end, last) = (format!("{duration_s:.3}"), frame(duration_s).to_string());
    let (wide, broad) = (end.len().max("at rest".len()), last.len());
    match time_s {
        Some(time_s) => {
            format!("{time_s:wide$.3} / {end} s   frame {:broad$} / {last}", frame(time_s))
        }
        None => format!("{:>wide$} / {end} s   frame {:>broad$} / {last}", "at rest", "\u{2014}"),
    }
}

/// A speed stops short of the standstill; dragged on from there it continues at the other side.
fn speed_after(old: f64, new: f64) -> f64 {
    match new.abs() >= SPEEDS.0 {
        true => new.clamp(-SPEEDS.1, SPEEDS.1),
        false if old.abs() > SPEEDS.0 => SPEEDS.0.copysign(old),
        false => SPEEDS.0.copysign(-old),
    }
}

/// The scale of seconds and frames with the play head; gives the time where the pointer holds it.
fn ruler(ui: &mut Ui, time_s: Option<f64>, duration_s: f64) -> Option<f64> {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 36.0), Sense::click_and_drag());
    let track = rect.shrink2(vec2(10.0, 0.0));
    let painter = ui.painter_at(rect);
    let enabled = ui.is_enabled() && duration_s > 0.0;
    painter.rect_filled(rect, CornerRadius::same(4), theme::sunken(ui.visuals()));
    if enabled {
        ticks(ui, track, duration_s);
    }
    let x_of =
        |time_s: f64| track.left() + (time_s / duration_s.max(1e-9)).clamp(0.0, 1.0) as f32 * track.width();
    if let Some(time_s) = time_s {
        play_head(ui, track, x_of(time_s));
    }
    if !enabled {
        return None;
    }
    let response = response
        .on_hover_cursor(CursorIcon::ResizeHorizontal)
        .on_hover_text_at_pointer("Drag to another time; Ctrl from frame to frame");
    let held = response.is_pointer_button_down_on() && ui.input(|input| input.pointer.primary_down());
    // On a slow device the button may be down and up again within one frame.
    let pointer = response.interact_pointer_pos().filter(|_| held || response.clicked())?;
    let share = f64::from((pointer.x - track.left()) / track.width()).clamp(0.0, 1.0);
    let chosen_s = share * duration_s;
    let snap = ui.input(|input| input.modifiers.command);
    let snapped_s = (chosen_s * FRAMES_PER_SECOND).round() / FRAMES_PER_SECOND;
    Some(if snap { snapped_s.min(duration_s) } else { chosen_s })
}

fn ticks(ui: &Ui, track: Rect, duration_s: f64) {
    let painter = ui.painter();
    let weak = ui.visuals().weak_text_color();
    let points_a_second = f64::from(track.width()) / duration_s;
    let x_of = |time_s: f64| track.left() + (time_s * points_a_second) as f32;
    let tick = |time_s: f64, height: f32, strength: f32| {
        let x = x_of(time_s);
        let stroke = Stroke::new(1.0, weak.gamma_multiply(strength));
        painter.line_segment([Pos2::new(x, track.bottom() - height), Pos2::new(x, track.bottom())], stroke);
    };
    if points_a_second / FRAMES_PER_SECOND >= FRAME_POINTS {
        let frames = (duration_s * FRAMES_PER_SECOND + 1e-6).floor() as u32;
        (0..=frames).for_each(|frame| tick(f64::from(frame) / FRAMES_PER_SECOND, 5.0, 0.45));
    }
    let step_s = label_step(points_a_second);
    let labels = (duration_s / step_s + 1e-6).floor() as u32;
    for label in 0..=labels {
        let time_s = f64::from(label) * step_s;
        tick(time_s, 10.0, 0.9);
        let decimals = if step_s < 1.0 { 1 } else { 0 };
        let text = format!("{time_s:.decimals$} s");
        let at = Pos2::new(x_of(time_s), track.top() + 4.0);
        // The first and the last one stay inside.
        let (align, at) = match at.x {
            x if x < track.left() + 12.0 => (Align2::LEFT_TOP, Pos2::new(track.left() - 4.0, at.y)),
            x if x > track.right() - 12.0 => (Align2::RIGHT_TOP, Pos2::new(track.right() + 4.0, at.y)),
            _ => (Align2::CENTER_TOP, at),
        };
        painter.text(at, align, text, FontId::monospace(10.5), weak);
    }
}

/// Seconds from one label to the next: 1, 2 or 5 times a power of ten, at least 0.1.
fn label_step(points_a_second: f64) -> f64 {
    let least_s = LABEL_POINTS / points_a_second.max(1e-9);
    let power = 10f64.powf(least_s.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    steps.into_iter().find(|step_s| *step_s >= least_s * (1.0 - 1e-9)).unwrap_or(least_s).max(0.1)
}

fn play_head(ui: &Ui, track: Rect, x: f32) {
    let accent = theme::accent(ui.visuals());
    let painter = ui.painter();
    painter.line_segment([Pos2::new(x, track.top()), Pos2::new(x, track.bottom())], Stroke::new(2.0, accent));
    let corner = |dx: f32, dy: f32| Pos2::new(x + dx, track.top() + dy);
    let head =
        vec![corner(-6.0, 0.0), corner(6.0, 0.0), corner(6.0, 5.0), corner(0.0, 11.0), corner(-6.0, 5.0)];
    painter.add(Shape::convex_polygon(head, accent, Stroke::NONE));
}

/// The clip of each selected instance, or of all when none is selected.
fn clips(cx: &mut Cx<'_>, ui: &mut Ui, instances: &[NodeId]) {
    let selected: Vec<NodeId> = instances
        .iter()
        .copied()
        .filter(|id| cx.state.selection.targets().iter().any(|target| target.node == *id))
        .collect();
    let shown = if selected.is_empty() { instances } else { &selected };
    ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, ROW, shown.len(), |ui, range| {
        for node in shown.get(range).unwrap_or_default() {
            ui.push_id(node.0, |ui| clip_row(cx, ui, *node));
        }
    });
}

fn clip_row(cx: &mut Cx<'_>, ui: &mut Ui, node: NodeId) {
    let target = Target::node(node);
    let document = cx.session.document();
    let (name, old) = (document.display_name(target), document.clip_of(node));
    let clips: Vec<(String, f64)> = document
        .clips_of(node)
        .iter()
        .enumerate()
        .map(|(index, clip)| (clip_name(&clip.name, index), clip.duration_s))
        .collect();
    let mut new = old;
    ui.horizontal(|ui| {
        ui.set_min_height(ROW - ui.spacing().item_spacing.y);
        ui.label(RichText::new(target_icon(cx, target)).weak());
        let size = vec2((ui.available_width() * 0.3).clamp(80.0, 220.0), ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_width(size.x);
            let button = Button::new(&name).frame(false).truncate();
            if ui.add(button).on_hover_text("Select it").clicked() {
                cx.state.selection.set(target);
                cx.state.outliner.reveal(cx.session.document(), target);
            }
        });
        let choose = ComboBox::from_id_salt("clip").width(220.0).selected_text(choice_name(old, &clips));
        let response = choose.show_ui(ui, |ui| {
            let first = format!("First clip ({})", clips.first().map_or("", |(name, _)| name));
            ui.selectable_value(&mut new, ClipChoice::First, first);
            ui.selectable_value(&mut new, ClipChoice::All, "All clips at once")
                .on_hover_text("Each at its own length; where two move the same thing, the first does");
            ui.selectable_value(&mut new, ClipChoice::None, "None: it stands still");
            ui.separator();
            for (index, (name, duration_s)) in (0..).zip(&clips) {
                let text = format!("{name}  \u{2013}  {duration_s:.2} s");
                ui.selectable_value(&mut new, ClipChoice::Clip(index), text);
            }
        });
        response.response.on_hover_text("What this object plays; the choice is part of the scene");
        let playing: Vec<f64> = old.of(&clips).iter().map(|(_, duration_s)| *duration_s).collect();
        if let Some(longest_s) = playing.into_iter().reduce(f64::max) {
            ui.label(RichText::new(format!("{longest_s:.2} s")).monospace().weak())
                .on_hover_text("Length; a clip that has ended begins again while longer ones go on");
        }
    });
    if new != old {
        cx.push(Edit::SetClip { node, clip: new });
    }
}

fn clip_name(name: &str, index: usize) -> String {
    if name.is_empty() { format!("clip {}", index + 1) } else { name.to_owned() }
}

fn choice_name(choice: ClipChoice, clips: &[(String, f64)]) -> String {
    match (choice, choice.of(clips)) {
        (ClipChoice::All, all) => format!("All {} clips", all.len()),
        (_, [(name, _), ..]) => name.clone(),
        (_, []) => String::from("None"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_told_in_seconds_and_frames() {
        assert_eq!(figures(Some(1.0), 2.5), "  1.000 / 2.500 s   frame 24 / 60");
        // A time on a frame is that frame, whatever its last digits.
        assert_eq!(figures(Some(0.1 + 0.2 - 0.05), 2.5), "  0.250 / 2.500 s   frame  6 / 60");
        assert_eq!(figures(None, 2.5), "at rest / 2.500 s   frame  \u{2014} / 60");
    }

    #[test]
    fn speed_skips_the_standstill() {
        assert_eq!(speed_after(1.0, 0.99), 0.99);
        assert_eq!(speed_after(0.05, 0.04), -0.05);
        assert_eq!(speed_after(-0.05, -0.04), 0.05);
        assert_eq!(speed_after(1.0, 0.0), 0.05);
        assert_eq!(speed_after(1.0, 9.0), 4.0);
    }

    #[test]
    fn labels_are_round_and_do_not_touch() {
        for (points_a_second, step_s) in
            [(800.0, 0.1), (400.0, 0.2), (100.0, 1.0), (72.0, 1.0), (71.0, 2.0), (20.0, 5.0), (1.0, 100.0)]
        {
            let found = label_step(points_a_second);
            assert!((found - step_s).abs() < 1e-9, "{points_a_second}: {found}");
        }
    }

    #[test]
    fn a_choice_shows_the_clip_that_it_comes_to() {
        let clips = vec![(String::from("walk"), 1.0), (String::from("run"), 2.0)];
        let name = |choice| choice_name(choice, &clips);
        assert_eq!(name(ClipChoice::First), "walk");
        assert_eq!(name(ClipChoice::Clip(1)), "run");
        assert_eq!(name(ClipChoice::Clip(7)), "None");
        assert_eq!(name(ClipChoice::All), "All 2 clips");
    }
}
