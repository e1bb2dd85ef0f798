//! report.html: one file with tables, plots and images in it, for light and dark screens. Enters: figures, images. Leaves: text.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::picture::{Shown, gradient};
use super::plot::{COLORS, Line, Plot, svg};
use super::{Report, Row};
use crate::curve::Point;

/// What does not depend on the report.
const STYLE: &str = include_str!("page.css");
/// Errors whose times are compared, as far as somebody reaches them.
const ERRORS: [f64; 10] = [1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];
/// Shares of the time that all have, at which errors are compared.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 1.0];

/// The page.
pub(super) fn html(report: &Report, images: &[Shown]) -> String {
    let title = report.file.file_name().unwrap_or_default().to_string_lossy();
    let title = escaped(&title);
    let sections = [
        head(report),
        section("Results", &results(report)),
        section("Error against device time", &(plots(report) + &legend(report))),
        section("At equal time", &equal_time(report)),
        section("At equal error", &equal_error(report)),
        section("Noise and bias", &parts(report)),
        section("Images", &gallery(images)),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}: error against run time</title>\
         <style>{STYLE} .scale {{ background: {} }}</style></head>\n<body><h1>{title}</h1>\n{}</body></html>\n",
        gradient(),
        sections.concat()
    )
}

fn head(report: &Report) -> String {
    let [width, height] = report.size;
    let truth = &report.reference;
    let noise = truth.noise.map_or_else(|| String::from("not known, and counted as bias"), percent);
    format!(
        "<p>{width} x {height} pixels on {}, {}. caustica {}{}, seed {}, {} s for each.</p>\
         <p>Reference: {}; its own noise: {noise}. Error is sqrt(relMSE) of linear radiance, relMSE = mean((x - r)² / (r² + 0.01)).</p>\n",
        escaped(&report.device),
        escaped(&report.driver),
        report.version,
        report.commit.map_or_else(String::new, |commit| format!(", commit {}", escaped(commit))),
        report.seed,
        report.seconds,
        escaped(&truth.source),
    )
}

fn section(title: &str, content: &str) -> String {
    format!("<section><h2>{title}</h2>{content}</section>\n")
}

fn results(report: &Report) -> String {
    let rows = report.pipelines.iter().filter_map(|row| Some((row, row.curve.0.last()?)));
    let rows = rows.map(|(row, last)| {
        let bias = last.split.bias;
        vec![
            escaped(&row.name),
            milliseconds(row.ms_per_sample),
            format!("{:.2}", row.ratio),
            last.samples.to_string(),
            milliseconds(last.gpu_ms),
            percent(last.split.total),
            percent(last.split.noise),
            format!("{} ({} to {})", percent(bias.value), percent(bias.low), percent(bias.high)),
            format!("{:.4}", last.flip),
            format!("{:.4}", last.metrics.luminance_ratio),
            row.slope.map_or_else(|| String::from("-"), |slope| format!("{slope:.2}")),
        ]
    });
    let heads = [
        "",
        "ms a sample",
        "by the first",
        "samples",
        "ms in all",
        "error",
        "noise",
        "bias (95 %)",
        "FLIP",
        "luminance ratio",
        "slope of noise",
    ];
    table(&heads.map(String::from), rows)
}

/// Errors of all at the same times.
fn equal_time(report: &Report) -> String {
    let ends = report.pipelines.iter().filter_map(|row| row.curve.0.last());
    let shortest = ends.map(|last| last.gpu_ms).fold(f64::INFINITY, f64::min);
    if !shortest.is_finite() {
        return String::new();
    }
    let times = SHARES.map(|share| share * shortest);
    let heads: Vec<String> =
        [String::new()].into_iter().chain(times.map(|ms| format!("{} ms", milliseconds(ms)))).collect();
    let rows = report.pipelines.iter().map(|row| {
        let errors =
            times.map(|ms| row.curve.error_at(ms * (1.0 - 1e-12)).map_or_else(|| String::from("-"), percent));
        [escaped(&row.name)].into_iter().chain(errors).collect()
    });
    table(&heads, rows)
}

/// Times of all to the same errors.
fn equal_error(report: &Report) -> String {
    let time = |row: &Row, error: f64| row.curve.gpu_ms_to(error);
    let errors: Vec<f64> = ERRORS
        .into_iter()
        .filter(|error| report.pipelines.iter().any(|row| time(row, *error).is_some()))
        .collect();
    let heads: Vec<String> =
        [String::new()].into_iter().chain(errors.iter().map(|error| percent(*error))).collect();
    let rows = report.pipelines.iter().map(|row| {
        let times =
            errors.iter().map(|error| match (time(row, *error), row.curve.0.first(), row.curve.0.last()) {
                (Some(ms), ..) => format!("{} ms", milliseconds(ms)),
                (None, Some(first), _) if first.split.total < *error => {
                    format!("&lt; {} ms", milliseconds(first.gpu_ms))
                }
                (None, _, Some(last)) if last.split.bias.low > *error => String::from("never"),
                (None, _, Some(last)) => format!("&gt; {} ms", milliseconds(last.gpu_ms)),
                (None, _, None) => String::from("-"),
            });
        [escaped(&row.name)].into_iter().chain(times).collect()
    });
    table(&heads, rows)
}

fn plots(report: &Report) -> String {
    let over_time = |y: &'static str, slope, value: fn(&Point) -> f64| {
        let lines = report.pipelines.iter().enumerate().map(|(color, row)| Line {
            color,
            dashes: "",
            points: points(row, |point| point.gpu_ms, value),
            band: Vec::new(),
        });
        svg(&Plot { x: "ms on the device", y, lines: lines.collect(), slope })
    };
    let plots = [
        over_time("relMSE", Some(-1.0), |point| point.split.total.powi(2)),
        over_time("FLIP", Some(-0.5), |point| point.flip),
    ];
    format!("<div class=\"plots\">{}</div>", plots.concat())
}

/// For each choice its total error, noise and bias by samples.
fn parts(report: &Report) -> String {
    let plots = report.pipelines.iter().enumerate().map(|(color, row)| {
        let of = |dashes, value: fn(&Point) -> f64| Line {
            color,
            dashes,
            points: points(row, |point| point.samples as f64, value),
            band: Vec::new(),
        };
        let band = row
            .curve
            .0
            .iter()
            .map(|point| (point.samples as f64, point.split.bias.low, point.split.bias.high));
        let bias = Line { band: band.collect(), ..of("2 3", |point| point.split.bias.value) };
        let lines = vec![of("", |point| point.split.total), of("7 4", |point| point.split.noise), bias];
        let plot = svg(&Plot { x: "samples", y: "error", lines, slope: Some(-0.5) });
        format!("<figure><figcaption>{}</figcaption>{plot}</figure>", escaped(&row.name))
    });
    format!(
        "<p>Solid: error, dashes: noise, dots: bias with the interval that holds it in 95 of 100 cases. Grey: what independent \
         samples do.</p><div class=\"plots\">{}</div>",
        plots.collect::<String>()
    )
}

fn points(row: &Row, x: impl Fn(&Point) -> f64, y: impl Fn(&Point) -> f64) -> Vec<(String, f64, f64)> {
    let tip = |point: &Point, value: f64| {
        format!(
            "{}: {} samples, {} ms: {value:.3e}",
            escaped(&row.name),
            point.samples,
            milliseconds(point.gpu_ms)
        )
    };
    row.curve.0.iter().map(|point| (tip(point, y(point)), x(point), y(point))).collect()
}

fn legend(report: &Report) -> String {
    let entries = report.pipelines.iter().enumerate().map(|(number, row)| {
        format!(
            "<span class=\"key\"><i class=\"swatch c{}\"></i>{}</span>",
            number % COLORS,
            escaped(&row.name)
        )
    });
    format!(
        "<p>{} <span class=\"key\">grey: slope -1 (relMSE), -1/2 (FLIP)</span></p>",
        entries.collect::<String>()
    )
}

fn gallery(images: &[Shown]) -> String {
    let figures = images.iter().map(|image| {
        format!(
            "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
            escaped(&image.title),
            BASE64.encode(&image.png)
        )
    });
    let (first, rest): (Vec<_>, Vec<_>) = figures.enumerate().partition(|(number, _)| *number == 0);
    let text =
        |figures: Vec<(usize, String)>| figures.into_iter().map(|(_, figure)| figure).collect::<String>();
    format!(
        "<p>As a screen shows them, clipped to 0 to 1 after exposure. Relative error: 0.1 % <i class=\"scale\"></i> 100 %, in \
         logarithms; FLIP: 0 <i class=\"scale\"></i> 1.</p><div class=\"images\">{}<span></span><span></span>{}</div>",
        text(first),
        text(rest)
    )
}

fn table(heads: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let cells = |cells: &[String], tag: &str| {
        cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect::<String>()
    };
    let body: String = rows.map(|row| format!("<tr>{}</tr>", cells(&row, "td"))).collect();
    format!(
        "<div class=\"wide\"><table><thead><tr>{}</tr></thead><tbody>{body}</tbody></table></div>",
        cells(heads, "th")
    )
}

fn percent(share: f64) -> String {
    let percent = share * 100.0;
    match percent {
        _ if !percent.is_finite() => String::from("-"),
        _ if percent >= 10.0 => format!("{percent:.1} %"),
        _ => format!("{percent:.2} %"),
    }
}

fn milliseconds(ms: f64) -> String {
    match ms {
        _ if ms >= 100.0 => format!("{ms:.0}"),
        _ if ms >= 1.0 => format!("{ms:.2}"),
        _ => format!("{ms:.3}"),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_names_are_no_markup() {
        assert_eq!([0.123, 0.0123, f64::NAN].map(percent), ["12.3 %", "1.23 %", "-"]);
        assert_eq!([1234.5, 12.345, 0.0123].map(milliseconds), ["1234", "12.35", "0.012"]);
        assert_eq!(escaped("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;");
    }
}
