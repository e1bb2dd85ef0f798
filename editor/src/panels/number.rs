//! Numbers in fields: with as many digits as they need, so that a tiny one is no zero, and never rounded by a mere click.
//! Enters: a value. Leaves: a field for it, its digits.

use std::ops::RangeInclusive;

use egui::DragValue;
use egui::emath::format_with_decimals_in_range;

/// Decimals of a number that is not small, at most.
const MOST_DECIMALS: usize = 4;
/// Significant digits of a small one.
const SIGNIFICANT: i32 = 4;
/// Below this size decimals are counted from the first digit.
const SMALL: f64 = 0.1;
/// Below this size a power of ten is written.
const TINY: f64 = 1e-3;

/// A field for a number of any size that shows at least `decimals` of one that is not small.
pub fn field(value: &mut f64, decimals: usize) -> DragValue<'_> {
    let (old, shown) = (*value, digits(*value, decimals));
    DragValue::new(value)
        .custom_formatter(move |value, _: RangeInclusive<usize>| digits(value, decimals))
        // Whoever clicks into a field and leaves it again has typed nothing: the digits that are not shown stay.
        .custom_parser(move |text| if text == shown { Some(old) } else { parse(text) })
}

fn parse(text: &str) -> Option<f64> {
    let plain = text.chars().filter(|c| !c.is_whitespace()).map(|c| if c == '\u{2212}' { '-' } else { c });
    plain.collect::<String>().parse().ok()
}

/// The digits of a number: "1.50", "0.01235", "1.235e-6".
pub fn digits(value: f64, decimals: usize) -> String {
    let size = value.abs();
    if size == 0.0 || size >= SMALL || !size.is_finite() {
        return format_with_decimals_in_range(value, decimals..=decimals.max(MOST_DECIMALS));
    }
    if size >= TINY {
        let leading_zeros = -(size.log10().floor() as i32) - 1;
        return without_zeros(&format!("{value:.*}", (leading_zeros + SIGNIFICANT) as usize)).to_owned();
    }
    let text = format!("{value:.*e}", SIGNIFICANT as usize - 1);
    match text.split_once('e') {
        Some((mantissa, exponent)) => format!("{}e{exponent}", without_zeros(mantissa)),
        None => text,
    }
}

/// Without zeros at the end of the decimals, and without a point that nothing follows.
fn without_zeros(decimal: &str) -> &str {
    decimal.trim_end_matches('0').trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    #![expect(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    fn small_numbers_keep_their_digits() {
        for (value, shown) in [
            (1.0, "1.00"),
            (-2.345_678, "-2.3457"),
            (0.0, "0.00"),
            (0.1, "0.10"),
            (0.05, "0.05"),
            (0.012_345_6, "0.01235"),
            (0.001, "0.001"),
            (0.000_999_99, "1e-3"),
            (1e-6, "1e-6"),
            (-1.234_56e-9, "-1.235e-9"),
            (5e-324, "4.941e-324"),
        ] {
            assert_eq!(digits(value, 2), shown, "{value}");
        }
    }

    #[test]
    fn what_is_shown_can_be_typed() {
        for value in [1e-6, -1.235e-9, 0.012_35, 123.25, 0.0] {
            let typed = parse(&digits(value, 2)).expect("a number");
            assert!((typed - value).abs() <= 1e-12 * value.abs(), "{value} became {typed}");
        }
        assert_eq!(parse(" \u{2212}1.5 "), Some(-1.5));
        assert_eq!(parse("x"), None);
    }

    /// Draws a field in a window of its own with these events; what has become of the value.
    fn after(value: f64, frames: &[Vec<egui::Event>]) -> f64 {
        let (context, mut value) = (egui::Context::default(), value);
        for events in frames {
            let input = egui::RawInput { events: events.clone(), ..egui::RawInput::default() };
            let _ = context.run_ui(input, |ui| {
                ui.add(field(&mut value, 2).update_while_editing(false));
            });
        }
        value
    }

    fn key(key: egui::Key) -> egui::Event {
        let modifiers = egui::Modifiers::NONE;
        egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers }
    }

    #[test]
    fn a_visit_changes_nothing_and_a_number_does() {
        let visit =
            |events| vec![vec![], vec![key(egui::Key::Tab)], events, vec![key(egui::Key::Enter)], vec![]];
        assert_eq!(after(1.234_567e-6, &visit(vec![])), 1.234_567e-6);
        let typed = vec![egui::Event::Text(String::from("2e-7"))];
        assert_eq!(after(1.234_567e-6, &visit(typed)), 2e-7);
    }
}
