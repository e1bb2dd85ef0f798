//! A plot in logarithms as SVG that takes its colours from the page. Enters: points. Leaves: text.
//! Crates for plots write colours into the picture, which then suits a light page or a dark one.

use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// Of the picture, and of its frame: left, top, right, bottom. Pixels.
const SIZE: [f64; 2] = [640.0, 400.0];
const FRAME: [f64; 4] = [74.0, 14.0, 626.0, 352.0];
/// Colours that the page has.
pub(super) const COLORS: usize = 8;

/// Points that are joined.
pub(super) struct Line {
    /// Which of the page's colours.
    pub(super) color: usize,
    /// How the line is drawn: "", or a list of lengths for `stroke-dasharray`.
    pub(super) dashes: &'static str,
    /// Text of the tool tip of each point, and where it is.
    pub(super) points: Vec<(String, f64, f64)>,
    /// Lowest and highest `y` at each `x`, as an area; empty: none.
    pub(super) band: Vec<(f64, f64, f64)>,
}

/// What is plotted.
pub(super) struct Plot {
    pub(super) x: &'static str,
    pub(super) y: &'static str,
    pub(super) lines: Vec<Line>,
    /// Exponent of a straight line for comparison.
    pub(super) slope: Option<f64>,
}

/// An axis: values, and where they are in the picture.
struct Axis {
    values: [f64; 2],
    pixels: [f64; 2],
}

impl Axis {
    /// Shows these values, which are above 0, and a little more.
    fn of(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let (low, high) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low > high { (0.1, 10.0) } else { (low, high) };
        Self { values: [low / 1.25, high * 1.25], pixels }
    }

    fn at(&self, value: f64) -> f64 {
        let [low, high] = self.values.map(f64::ln);
        let share = (value.max(f64::MIN_POSITIVE).ln() - low) / (high - low);
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    fn holds(&self) -> RangeInclusive<f64> {
        self.values[0]..=self.values[1]
    }

    /// 1, 2 and 5 times powers of ten; powers alone over many decades.
    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.values.map(|value| value.log10());
        let steps: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let powers = low.floor() as i32..=high.ceil() as i32;
        let all = powers.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
        all.filter(|tick| self.holds().contains(tick)).collect()
    }
}

/// Draws it.
pub(super) fn svg(plot: &Plot) -> String {
    let [left, top, right, bottom] = FRAME;
    let points = || plot.lines.iter().flat_map(|line| &line.points);
    let x = Axis::of(points().map(|point| point.1), [left, right]);
    let y = Axis::of(points().map(|point| point.2), [bottom, top]);
    let mut out = format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{} over {}\">",
        SIZE[0], SIZE[1], plot.y, plot.x
    );
    for tick in x.ticks() {
        let at = x.at(tick);
        put(&mut out, format_args!("<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/>"));
        put(
            &mut out,
            format_args!(
                "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                bottom + 16.0,
                label(tick)
            ),
        );
    }
    for tick in y.ticks() {
        let at = y.at(tick);
        put(&mut out, format_args!("<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>"));
        put(
            &mut out,
            format_args!(
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 6.0,
                at + 4.0,
                label(tick)
            ),
        );
    }
    put(
        &mut out,
        format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            (left + right) / 2.0,
            bottom + 38.0,
            plot.x
        ),
    );
    let middle = (top + bottom) / 2.0;
    put(
        &mut out,
        format_args!(
            "<text transform=\"translate(16 {middle}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            plot.y
        ),
    );
    if let Some(slope) = plot.slope {
        guide(&mut out, &x, &y, slope);
    }
    plot.lines.iter().for_each(|line| draw(&mut out, &x, &y, line));
    put(
        &mut out,
        format_args!(
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/></svg>",
            right - left,
            bottom - top
        ),
    );
    out
}

fn draw(out: &mut String, x: &Axis, y: &Axis, line: &Line) {
    let color = line.color % COLORS;
    let inside = |value: f64| value.clamp(y.values[0], y.values[1]);
    if !line.band.is_empty() {
        let upper = line.band.iter().map(|(at, _, high)| (*at, inside(*high)));
        let lower = line.band.iter().rev().map(|(at, low, _)| (*at, inside(*low)));
        put(out, format_args!("<path class=\"band c{color}\" d=\"{}Z\"/>", path(x, y, upper.chain(lower))));
    }
    let drawn = line.points.iter().filter(|(_, _, value)| *value > 0.0 && value.is_finite());
    let joined = path(x, y, drawn.clone().map(|(_, at, value)| (*at, *value)));
    put(
        out,
        format_args!("<path class=\"line c{color}\" stroke-dasharray=\"{}\" d=\"{joined}\"/>", line.dashes),
    );
    for (tip, at, value) in drawn {
        let (at, value) = (x.at(*at), y.at(*value));
        put(
            out,
            format_args!(
                "<circle class=\"dot c{color}\" cx=\"{at:.1}\" cy=\"{value:.1}\" r=\"3\"><title>{tip}</title></circle>"
            ),
        );
    }
}

/// A straight line of this exponent through the middle of the frame.
fn guide(out: &mut String, x: &Axis, y: &Axis, slope: f64) {
    let middle = |axis: &Axis| (axis.values[0] * axis.values[1]).sqrt();
    let (x0, y0) = (middle(x), middle(y));
    let ends = x.values.map(|value| (value, y0 * (value / x0).powf(slope)));
    put(
        out,
        format_args!(
            "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" viewBox=\"{} {} {} {}\"><path class=\"guide\" d=\"{}\"/></svg>",
            FRAME[0],
            FRAME[1],
            FRAME[2] - FRAME[0],
            FRAME[3] - FRAME[1],
            FRAME[0],
            FRAME[1],
            FRAME[2] - FRAME[0],
            FRAME[3] - FRAME[1],
            path(x, y, ends.into_iter())
        ),
    );
}

fn path(x: &Axis, y: &Axis, points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut text = String::new();
    for (number, (at, value)) in points.enumerate() {
        let command = if number == 0 { 'M' } else { 'L' };
        put(&mut text, format_args!("{command}{:.1} {:.1}", x.at(at), y.at(value)));
    }
    text
}

/// A tick's number, short.
fn label(value: f64) -> String {
    if (1e-3..1e6).contains(&value) {
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}")
    }
}

/// Adds to a text, which cannot fail.
fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = out.write_fmt(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_round_ticks_and_a_plot_all_of_its_points() {
        let axis = Axis::of([0.02, 4.0].into_iter(), [0.0, 100.0]);
        assert_eq!(axis.ticks().first().map(|tick| label(*tick)), Some("0.02".to_owned()));
        assert_eq!(
            axis.ticks().iter().filter(|tick| axis.holds().contains(tick)).count(),
            axis.ticks().len()
        );
        assert!((axis.at(0.02 / 1.25)).abs() < 1e-9 && (axis.at(5.0) - 100.0).abs() < 1e-9);
        assert_eq!(Axis::of([0.0, f64::NAN].into_iter(), [0.0, 1.0]).values, [0.1 / 1.25, 12.5]);
        let points =
            vec![("a".to_owned(), 1.0, 1.0), ("b".to_owned(), 10.0, 0.1), ("none".to_owned(), 20.0, 0.0)];
        let line = Line { color: 0, dashes: "", points, band: vec![(1.0, 0.5, 2.0), (10.0, 0.0, 0.2)] };
        let text = svg(&Plot { x: "ms", y: "error", lines: vec![line], slope: Some(-1.0) });
        assert_eq!(text.matches("<circle").count(), 2);
        assert!(text.contains("class=\"guide\"") && !text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
