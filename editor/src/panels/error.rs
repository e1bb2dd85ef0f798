//! The Error panel: how far the picture is from what it becomes and from a reference, and what a millisecond buys. Enters: what
//! `ErrorWatch` has gathered. Leaves: a wish for a reference, an error to stop at.

use caustica_renderer::{Estimate, Show};
use egui::{Color32, DragValue, ProgressBar, RichText, Ui};
use egui_phosphor::regular as icon;
use egui_plot::{HoverPosition, Legend, Line, LineStyle, Plot, PlotPoint, PlotPoints, Points, Text};

use super::Cx;
use crate::app::actions::Action;
use crate::error_watch::LiveCurve;

/// Colours of the curves, to be told apart on dark and on light.
const COLORS: [Color32; 6] = [
    Color32::from_rgb(0x4c, 0x9b, 0xe8),
    Color32::from_rgb(0xe8, 0x82, 0x3a),
    Color32::from_rgb(0x4f, 0xb0, 0x66),
    Color32::from_rgb(0xb6, 0x6c, 0xd6),
    Color32::from_rgb(0xdc, 0x54, 0x54),
    Color32::from_rgb(0x3a, 0xa9, 0xb8),
];
const FIGURES_WIDTH: f32 = 330.0;
const CONTROLS_WIDTH: f32 = 300.0;
/// A plot that is narrower shows nothing.
const LEAST_PLOT_WIDTH: f32 = 260.0;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let is_wide = ui.available_width() > FIGURES_WIDTH + CONTROLS_WIDTH + LEAST_PLOT_WIDTH;
    ui.horizontal_top(|ui| {
        column(ui, "figures", FIGURES_WIDTH, |ui| {
            figures(cx, ui);
            if !is_wide {
                ui.add_space(4.0);
                controls(cx, ui);
            }
        });
        if is_wide {
            column(ui, "controls", CONTROLS_WIDTH, |ui| controls(cx, ui));
        }
        plot(cx, ui);
    });
}

fn column(ui: &mut Ui, name: &str, width: f32, content: impl FnOnce(&mut Ui)) {
    let size = egui::vec2(width, ui.available_height());
    ui.allocate_ui_with_layout(size, egui::Layout::top_down(egui::Align::Min), |ui| {
        egui::ScrollArea::vertical().id_salt(name).auto_shrink([false, false]).show(ui, content);
    });
}

fn controls(cx: &mut Cx<'_>, ui: &mut Ui) {
    reference(cx, ui);
    flip(cx, ui);
    stop(cx, ui);
    maps(cx, ui);
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

fn interval(estimate: Estimate) -> String {
    format!("{} ({:.2} to {:.2})", percent(estimate.value), estimate.low * 100.0, estimate.high * 100.0)
}

fn figures(cx: &Cx<'_>, ui: &mut Ui) {
    let settings = cx.session.settings();
    let Some(found) = cx.session.live_error() else {
        ui.weak("Nothing is measured while the picture moves.");
        return;
    };
    let row = |ui: &mut Ui, name: &str, value: String, tip: &str| {
        ui.horizontal(|ui| {
            ui.add_sized(
                [52.0, 16.0],
                egui::Label::new(RichText::new(name).weak()).halign(egui::Align::LEFT),
            );
            ui.label(RichText::new(value).monospace());
        })
        .response
        .on_hover_text(tip);
    };
    let noise = match found.noise {
        _ if settings.denoise_stills => String::from("unknown, frames are denoised"),
        Some(noise) => interval(noise.error()),
        None => String::from("\u{2014}"),
    };
    let tip = "What more samples take away, with the interval that holds it in 95 of 100 cases: sqrt(relMSE) of linear radiance";
    row(ui, "Noise", noise, tip);
    match found.against {
        // Frames that share their past err alike, and this would be told as bias.
        Some(against) if settings.denoise_stills => {
            row(ui, "Error", percent(against.split.total), "Noise and bias together");
        }
        Some(against) => {
            row(
                ui,
                "Bias",
                interval(against.split.bias),
                "What stays, however many samples are taken, against the reference",
            );
            row(ui, "Error", percent(against.split.total), "Noise and bias together");
            let rest = format!(
                "trimmed {}, RMSE {:.4}, blocks {}, luminance x {:.4}",
                percent(against.rel_mse_trimmed.sqrt()),
                against.rmse,
                percent(against.block_rel_mse.sqrt()),
                against.luminance_ratio
            );
            ui.label(RichText::new(rest).monospace().weak()).on_hover_text(
                "Error without the 0.1 % of pixels where it is largest; root of the mean squared difference; error of the means of blocks of 8 x 8 pixels; mean luminance by that of the reference",
            );
        }
        None => {
            let words = if settings.is_unbiased() {
                "none: path is the truth"
            } else {
                "unknown without a reference"
            };
            row(ui, "Bias", String::from(words), "What stays, however many samples are taken");
        }
    }
    let noise = found.noise.filter(|_| !settings.denoise_stills);
    let (Some(noise), Some(ms)) = (noise, cx.state.error.gpu_ms_of(found.samples)) else { return };
    let seconds = ms * 1e-3;
    let of = |estimate: Estimate, digits: usize| {
        let Estimate { value, low, high } = estimate;
        format!("{value:.digits$} ({low:.digits$} to {high:.digits$})")
    };
    let tip = "1 / (relMSE x seconds on the device), with the interval that holds it in 95 of 100 cases: how much a second buys";
    row(ui, "Buys", of(noise.efficiency(seconds), 1), tip);
    // Half of the noise takes four times as long, whatever is asked for.
    let target = cx.state.error.stop_at.unwrap_or(noise.error().value / 2.0);
    let words = format!("{} s to {}", of(noise.seconds_to(target, seconds), 1), percent(target));
    let tip = "More seconds on the device until the noise is so small (what is stopped at, else half of it), as it falls with the samples";
    row(ui, "Time", words, tip);
}

fn flip(cx: &mut Cx<'_>, ui: &mut Ui) {
    if !cx.session.has_reference() || cx.state.error.progress(cx.session).is_some() {
        return;
    }
    ui.horizontal(|ui| {
        let flip = &cx.state.error.flip;
        let button = egui::Button::new("FLIP");
        let tip = "How differently the picture looks from the reference, 0 to 1, as it is now (Andersson et al. 2020)";
        let clicked = ui.add_enabled(!flip.is_running(), button).on_hover_text(tip).clicked();
        match flip.found() {
            Some((Ok(mean), samples)) => {
                ui.label(RichText::new(format!("{mean:.4} at {samples} samples")).monospace());
            }
            Some((Err(error), _)) => {
                ui.label(error);
            }
            None if flip.is_running() => {
                ui.spinner();
            }
            None => {
                ui.weak("not measured");
            }
        }
        if clicked {
            cx.act(Action::MeasureFlip);
        }
    });
}

fn reference(cx: &mut Cx<'_>, ui: &mut Ui) {
    if let Some((done, all)) = cx.state.error.progress(cx.session) {
        ui.horizontal(|ui| {
            let bar = ProgressBar::new(done as f32 / all as f32).text(format!("{done} of {all} samples"));
            ui.add(bar.desired_width(200.0));
            if ui.button("Cancel").on_hover_text("Back to the settings before").clicked() {
                cx.state.error.cancel_reference(cx.session);
            }
        });
        return;
    }
    ui.horizontal(|ui| {
        let has_one = cx.session.has_reference();
        let words = if has_one { "Again" } else { "Render a reference" };
        let tip =
            "Shows the path tracer's picture until it has so many samples, and compares with it from then on";
        let samples = &mut cx.state.error.reference_samples;
        let value = DragValue::new(samples).range(2..=4096).suffix(" samples");
        let wanted = ui.button(format!("{}  {words}", icon::TARGET)).on_hover_text(tip).clicked();
        ui.add(value).on_hover_text("Samples of the reference");
        if wanted {
            let samples = *samples;
            cx.state.error.render_reference(cx.session, samples);
        }
        if ui.button("Open\u{2026}").on_hover_text("Compare with an EXR of this size").clicked() {
            cx.act(Action::OpenReference);
        }
        if has_one && ui.button(icon::X).on_hover_text("Compare with nothing").clicked() {
            cx.state.error.set_reference(cx.session, None);
        }
    });
    if !cx.state.error.note.is_empty() {
        ui.weak(&cx.state.error.note);
    }
}

fn stop(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let stop_at = &mut cx.state.error.stop_at;
        let mut on = stop_at.is_some();
        let mut percent = stop_at.unwrap_or(0.01) * 100.0;
        let tip =
            "Takes no more samples once the noise, or the error where there is a reference, is so small";
        ui.checkbox(&mut on, "Stop at").on_hover_text(tip);
        let value = DragValue::new(&mut percent).range(0.01..=100.0).speed(0.02).max_decimals(2).suffix(" %");
        ui.add_enabled(on, value);
        *stop_at = on.then_some(percent / 100.0);
    });
}

/// Buttons that show where the error is.
fn maps(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let shown = cx.session.settings().show;
        let has_reference = cx.session.has_reference();
        for (show, name, enabled) in
            [(Show::Noise, "Noise map", true), (Show::Error, "Error map", has_reference)]
        {
            let button = egui::Button::selectable(shown == show, name);
            if ui.add_enabled(enabled, button).on_hover_text(show.meaning()).clicked() {
                cx.act(Action::Show(if shown == show { Show::Image } else { show }));
            }
        }
    });
}

fn plot(cx: &Cx<'_>, ui: &mut Ui) {
    let curves = &cx.state.error.curves;
    let faint = ui.visuals().weak_text_color();
    Plot::new("error over time")
        .legend(Legend::default().follow_insertion_order(true))
        .x_axis_label("ms on the device")
        .x_axis_formatter(|mark, _| power(mark.value))
        .y_axis_formatter(|mark, _| power(mark.value))
        .label_formatter(|at| {
            let (name, at) = match at {
                HoverPosition::NearDataPoint { plot_name, position, .. } => (*plot_name, *position),
                HoverPosition::Elsewhere { position } => ("", *position),
            };
            Some(format!("{name}\n{:.3} ms\n{}", 10f64.powf(at.x), percent(10f64.powf(at.y / 2.0))))
        })
        .show(ui, |plot| {
            let mut colors = COLORS.iter().cycle();
            // What is of another scene lies behind.
            for curve in curves.iter().filter(|curve| !curve.is_present && !curve.points.is_empty()) {
                plot.line(Line::new("", points(curve)).color(faint.gamma_multiply(0.5)).allow_hover(false));
                if let Some(end) = curve.points.last() {
                    let at = PlotPoint::from(logs(end));
                    plot.points(Points::new("", vec![logs(end)]).color(faint).radius(3.0).allow_hover(false));
                    plot.text(Text::new("", at, RichText::new(&curve.ended_by).small()).color(faint));
                }
            }
            for curve in curves.iter().filter(|curve| curve.is_present && !curve.points.is_empty()) {
                let color = *colors.next().unwrap_or(&Color32::GRAY);
                let what = if curve.against_reference { "error" } else { "noise" };
                let name = format!("{}: {what}", curve.name);
                plot.line(Line::new(name.clone(), points(curve)).color(color).width(2.0));
                plot.points(Points::new(name, points(curve)).color(color).radius(2.5));
            }
            if let Some(end) = curves.last().and_then(|curve| curve.points.last()) {
                let [x, y] = logs(end);
                let guide = vec![[x - 2.0, y + 2.0], [x + 1.0, y - 1.0]];
                let line = Line::new("slope -1", guide).color(faint).style(LineStyle::dashed_loose());
                plot.line(line.allow_hover(false));
            }
        });
}

fn points(curve: &LiveCurve) -> PlotPoints<'static> {
    curve.points.iter().map(logs).collect()
}

/// Time and relMSE in decades.
fn logs(point: &crate::error_watch::LivePoint) -> [f64; 2] {
    [point.gpu_ms.max(1e-6).log10(), 2.0 * point.error.log10()]
}

/// The number of an axis in decades.
fn power(decades: f64) -> String {
    let value = 10f64.powf(decades);
    match decades {
        _ if (-3.0..5.0).contains(&decades) => {
            let digits = (1.0 - decades).ceil().clamp(0.0, 5.0) as usize;
            let text = format!("{value:.digits$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_short_numbers() {
        assert_eq!([0.0, 2.0, -2.0, 3.0].map(power), ["1", "100", "0.01", "1000"]);
        assert_eq!([6.0, -4.0].map(power), ["1e6", "1e-4"]);
    }
}
