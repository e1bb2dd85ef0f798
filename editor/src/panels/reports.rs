//! The panels of figures: passes, what was left out, health, log. Enters: statistics, findings, log lines.
//! Leaves: a selection when a finding is clicked. It measures nothing itself.

use caustica_scene::{Severity, Subject, Target};
use egui::{Align, Color32, CornerRadius, Layout, Rect, RichText, ScrollArea, Sense, Ui, vec2};
use egui_phosphor::regular as icon;

use super::Cx;
use crate::theme;

/// Share of a new measurement in the smoothed figure.
const SMOOTHING: f64 = 0.12;

/// Milliseconds of each pass on the device.
pub fn passes(cx: &mut Cx<'_>, ui: &mut Ui) {
    let passes = &cx.session.statistics().passes;
    if passes.is_empty() {
        super::empty_note(ui, "No frame has been measured yet.");
        return;
    }
    let smoothed = &mut cx.state.pass_ms;
    smoothed.retain(|label, _| passes.iter().any(|(name, _)| name == label));
    for (label, ms) in passes {
        let entry = smoothed.entry(label.clone()).or_insert(*ms);
        *entry += (ms - *entry) * SMOOTHING;
    }
    let rows: Vec<(String, f64)> = passes
        .iter()
        .map(|(label, ms)| (label.clone(), smoothed.get(label).copied().unwrap_or(*ms)))
        .collect();
    let total: f64 = rows.iter().map(|(_, ms)| ms).sum();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.spacing_mut().interact_size.y = 16.0;
        for (label, ms) in &rows {
            pass_row(ui, label, *ms, total, false);
        }
        ui.separator();
        pass_row(ui, "all passes", total, total, true);
    });
}

fn pass_row(ui: &mut Ui, label: &str, ms: f64, total: f64, strong: bool) {
    let share = if total > 0.0 { (ms / total).clamp(0.0, 1.0) } else { 0.0 };
    let text = |text: String| {
        let text = RichText::new(text).monospace();
        if strong { text.strong() } else { text }
    };
    ui.horizontal(|ui| {
        let label_width = 176.0;
        let size = vec2(label_width, 16.0);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(label_width);
            ui.add(egui::Label::new(text(label.to_owned())).truncate());
        });
        ui.label(text(format!("{ms:8.3} ms"))).on_hover_text("Time on the device, smoothed over frames");
        let percent = if strong { String::from("     ") } else { format!("{:4.0} %", share * 100.0) };
        ui.label(text(percent)).on_hover_text("Share of all passes");
        if !strong {
            let width = (ui.available_width() - 8.0).max(0.0);
            let (rect, _) = ui.allocate_exact_size(vec2(width, 8.0), Sense::hover());
            ui.painter().rect_filled(rect, CornerRadius::same(3), theme::sunken(ui.visuals()));
            let filled = Rect::from_min_size(rect.min, vec2(rect.width() * share as f32, rect.height()));
            ui.painter().rect_filled(filled, CornerRadius::same(3), theme::accent(ui.visuals()));
        }
    });
}

/// What the renderer does not run because this scene does not need it.
pub fn left_out(cx: &mut Cx<'_>, ui: &mut Ui) {
    let left_out = &cx.session.statistics().left_out;
    if left_out.is_empty() {
        super::empty_note(
            ui,
            "Nothing is left out: this scene needs everything, or leaving out is switched off (Render panel).",
        );
        return;
    }
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        egui::Grid::new("left out").num_columns(2).spacing([24.0, 4.0]).striped(true).show(ui, |ui| {
            for item in left_out {
                ui.label(RichText::new(item.what.to_string()).monospace());
                ui.label(item.why.to_string());
                ui.end_row();
            }
        });
    });
}

/// Findings of the latest audit.
pub fn health(cx: &mut Cx<'_>, ui: &mut Ui) {
    let non_finite = cx.session.statistics().non_finite;
    if non_finite > 0 {
        let text = format!("{}  {non_finite} samples were no finite numbers and were dropped", icon::WARNING);
        ui.colored_label(ui.visuals().warn_fg_color, text);
    }
    let Some(health) = &cx.state.health else {
        super::empty_note(ui, "The scene is being looked at.");
        return;
    };
    if health.findings.is_empty() {
        super::empty_note(ui, "The audit found nothing.");
        return;
    }
    let mut clicked = None;
    ScrollArea::vertical().auto_shrink([false, false]).show_rows(
        ui,
        20.0,
        health.findings.len(),
        |ui, range| {
            for finding in &health.findings[range] {
                ui.horizontal(|ui| {
                    let (mark, color) = severity_mark(ui, finding.severity);
                    ui.colored_label(color, mark);
                    let name = RichText::new(&finding.name).strong();
                    if let Some(target) = target_of(&finding.subject) {
                        if ui.link(name).on_hover_text("Select it").clicked() {
                            clicked = Some(target);
                        }
                    } else {
                        ui.label(name);
                    }
                    ui.add(egui::Label::new(&finding.message).truncate());
                });
            }
        },
    );
    if let Some(target) = clicked {
        cx.state.selection.set(target);
        cx.state.outliner.reveal(cx.session.document(), target);
    }
}

fn severity_mark(ui: &Ui, severity: Severity) -> (&'static str, Color32) {
    match severity {
        Severity::Info => (icon::INFO, ui.visuals().weak_text_color()),
        Severity::Warning => (icon::WARNING, ui.visuals().warn_fg_color),
        Severity::Error => (icon::X_CIRCLE, ui.visuals().error_fg_color),
    }
}

fn target_of(subject: &Subject) -> Option<Target> {
    match subject {
        Subject::Target(target) => Some(*target),
        _ => None,
    }
}

/// The newest log lines.
pub fn log(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let count = cx.state.log.read(|lines| lines.len());
        ui.weak(format!("{count} lines"));
        if ui.small_button("Clear").clicked() {
            cx.state.log.clear();
        }
        if ui.small_button("Copy").on_hover_text("Puts all lines on the clipboard").clicked() {
            let text = cx.state.log.read(|lines| {
                lines
                    .iter()
                    .map(|line| format!("{:9.3} {:5} {}\n", line.seconds, line.level, line.text))
                    .collect::<String>()
            });
            ui.ctx().copy_text(text);
        }
    });
    let count = cx.state.log.read(|lines| lines.len());
    ScrollArea::both().auto_shrink([false, false]).stick_to_bottom(true).show_rows(
        ui,
        15.0,
        count,
        |ui, range| {
            cx.state.log.read(|lines| {
                for line in lines.range(range.start.min(lines.len())..range.end.min(lines.len())) {
                    let color = match line.level {
                        tracing::Level::ERROR => ui.visuals().error_fg_color,
                        tracing::Level::WARN => ui.visuals().warn_fg_color,
                        tracing::Level::INFO => ui.visuals().text_color(),
                        _ => ui.visuals().weak_text_color(),
                    };
                    let text = format!("{:9.3}  {}", line.seconds, line.text);
                    let label = egui::Label::new(RichText::new(text).monospace().color(color)).extend();
                    ui.add(label).on_hover_text(&line.target);
                }
            });
        },
    );
}
