//! The figures of the acceleration structures: this frame, the last frame with work, since the start. Enters: statistics.
//! Leaves: drawings. It measures nothing itself.

use caustica_renderer::{AccelStatistics, TlasWork};
use egui::{Color32, Pos2, RichText, ScrollArea, Sense, Stroke, Ui, vec2};

use super::Cx;

/// How often the mark of pending work turns on, seconds.
const TURN_S: f64 = 0.1;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let statistics = cx.session.statistics();
    let tally = cx.session.tally();
    if tally.frames == 0 {
        super::empty_note(ui, "No frame has been rendered yet.");
        return;
    }
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().interact_size.y = 16.0;
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| counters(cx, ui));
            ui.add_space(24.0);
            ui.vertical(|ui| state(ui, &statistics.acceleration));
            ui.add_space(24.0);
            ui.vertical(|ui| reasons(cx, ui));
        });
    });
}

/// A line of the table: name, what it means, a figure for this frame, for the last one with work, and since the start.
type Line = (&'static str, &'static str, [String; 3]);

fn counters(cx: &Cx<'_>, ui: &mut Ui) {
    let statistics = cx.session.statistics();
    let tally = cx.session.tally();
    let nothing = AccelStatistics::default();
    let (now, last) = (&statistics.acceleration, tally.last_work.as_ref().unwrap_or(&nothing));
    let line = |name, tip, of: fn(&AccelStatistics) -> u64, total: u64| -> Line {
        (name, tip, [of(now), of(last), total].map(|n| n.to_string()))
    };
    let tlas = |name, tip, work: TlasWork, total: u64| -> Line {
        let did = |frame: &AccelStatistics| u64::from(frame.tlas == work).to_string();
        (name, tip, [did(now), did(last), total.to_string()])
    };
    let lines = [
        line(
            "BLAS built",
            "Trees over the triangles of a mesh, made anew",
            |s| s.blas_built,
            now.total_blas_built,
        ),
        line(
            "BLAS refitted",
            "Trees kept with new boxes, because vertices or primitives moved",
            |s| s.blas_refit,
            now.total_blas_refit,
        ),
        line(
            "BLAS swapped",
            "Built or copied in the background, and taken into use",
            |s| s.blas_swapped,
            now.total_blas_swapped,
        ),
        line(
            "BLAS compacted",
            "Of those, copied into less memory",
            |s| s.blas_compacted,
            now.total_blas_compacted,
        ),
        tlas("TLAS built", "The tree over all instances, made anew", TlasWork::Built, now.total_tlas_built),
        tlas(
            "TLAS refitted",
            "The tree over all instances, kept with new boxes, because instances moved",
            TlasWork::Refit,
            now.total_tlas_refit,
        ),
        (
            "Uploaded",
            "Bytes sent to the device, constants included",
            [statistics.uploaded_bytes, tally.last_work_bytes, tally.uploaded_bytes].map(bytes),
        ),
    ];
    egui::Grid::new("acceleration").num_columns(4).spacing([20.0, 2.0]).striped(true).show(ui, |ui| {
        ui.label("");
        head(ui, "this frame", "Of the picture that is shown");
        head(ui, "last change", "Of the last frame that built, refitted or swapped anything");
        head(ui, "since start", "Since the program began");
        ui.end_row();
        for (name, tip, figures) in lines {
            ui.label(name).on_hover_text(tip);
            for figure in figures {
                ui.monospace(format!("{figure:>11}"));
            }
            ui.end_row();
        }
    });
}

fn head(ui: &mut Ui, name: &str, tip: &str) {
    ui.label(RichText::new(format!("{name:>11}")).monospace().weak()).on_hover_text(tip);
}

fn state(ui: &mut Ui, now: &AccelStatistics) {
    let lines = [
        ("BLASes", now.blas_count.to_string()),
        ("Their memory", bytes(now.blas_bytes)),
        ("Instances", now.instance_count.to_string()),
        ("Triangles", now.triangle_count.to_string()),
        ("Not built yet", now.blas_pending.to_string()),
        ("In the background", now.blas_background.to_string()),
    ];
    egui::Grid::new("acceleration now").num_columns(2).spacing([16.0, 2.0]).show(ui, |ui| {
        for (name, figure) in lines {
            ui.weak(name);
            ui.monospace(format!("{figure:>11}"));
            ui.end_row();
        }
    });
}

fn reasons(cx: &Cx<'_>, ui: &mut Ui) {
    ui.label(format!("Begun anew {} times, the last ones for:", cx.session.statistics().resets))
        .on_hover_text("Each time the picture starts at its first sample");
    for (reason, times) in &cx.session.tally().reasons {
        let reason = if reason.is_empty() { "\u{2014}" } else { reason };
        let text = if *times > 1 { format!("{reason} ({times} times)") } else { reason.to_owned() };
        ui.label(RichText::new(text).monospace().weak());
    }
}

fn bytes(count: u64) -> String {
    match count {
        0..10_000 => format!("{count} B"),
        10_000..10_000_000 => format!("{:.1} KiB", count as f64 / 1024.0),
        _ => format!("{:.1} MiB", count as f64 / (1024.0 * 1024.0)),
    }
}

/// A turning mark with what is still being built; nothing when all is done. Its tool tip says what the picture lacks.
pub fn pending(cx: &Cx<'_>, ui: &mut Ui) {
    let now = &cx.session.statistics().acceleration;
    let Some((text, tip)) = pending_words(now) else { return };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let color = ui.visuals().warn_fg_color;
        turning(ui, color);
        ui.label(RichText::new(text).size(12.0).color(color));
    })
    .response
    .on_hover_text(tip);
    // Not at every frame of the screen: on a slow device the picture would have to wait for the mark.
    ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(TURN_S));
}

fn pending_words(now: &AccelStatistics) -> Option<(String, String)> {
    let meshes = |count: u64| if count == 1 { String::from("1 mesh") } else { format!("{count} meshes") };
    if now.blas_pending > 0 {
        let count = now.blas_pending;
        let lacks = if count == 1 { "It is" } else { "They are" };
        let tip = format!(
            "{lacks} built in the background, so that the window stays alive. \
             Until then rays do not meet {}: no shadows, no mirror images, and nothing to be seen where the camera casts rays too.",
            if count == 1 { "it" } else { "them" }
        );
        return Some((format!("building {}", meshes(count)), tip));
    }
    let tip = "They are built anew or copied into less memory in the background, so that rays find their way faster. \
               The picture is complete and stays the same.";
    (now.blas_background > 0).then(|| (format!("improving {}", meshes(now.blas_background)), tip.to_owned()))
}

/// Three quarters of a circle that turn with the clock.
fn turning(ui: &mut Ui, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
    let start = (ui.input(|input| input.time) / TURN_S).floor() * std::f64::consts::TAU / 8.0;
    let at = |i: u32| {
        let angle = (start + f64::from(i) * std::f64::consts::TAU * 0.75 / 16.0) as f32;
        Pos2::new(rect.center().x + angle.cos() * 4.5, rect.center().y + angle.sin() * 4.5)
    };
    ui.painter().line((0..=16).map(at).collect(), Stroke::new(1.8, color));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_comes_before_what_gets_better() {
        let words = |blas_pending, blas_background| {
            let now = AccelStatistics { blas_pending, blas_background, ..AccelStatistics::default() };
            pending_words(&now).map(|(text, _)| text)
        };
        assert_eq!(words(0, 0), None);
        assert_eq!(words(3, 3).as_deref(), Some("building 3 meshes"));
        assert_eq!(words(1, 0).as_deref(), Some("building 1 mesh"));
        assert_eq!(words(0, 2).as_deref(), Some("improving 2 meshes"));
    }

    #[test]
    fn bytes_keep_a_few_figures() {
        assert_eq!([0, 9_999, 20_480, 20 << 20].map(bytes), ["0 B", "9999 B", "20.0 KiB", "20.0 MiB"]);
    }
}
