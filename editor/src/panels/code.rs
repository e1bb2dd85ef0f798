//! A field for a program's text: line numbers, colours, and what is wrong behind the lines. Enters: text and faults.
//! Leaves: what is typed. It knows no file.

use std::sync::Arc;

use caustica_renderer::shader::ShaderFault;
use egui::text::{CCursor, CCursorRange, LayoutJob, TextFormat};
use egui::text_edit::TextEditState;
use egui::{
    Align, Align2, Color32, FontId, Galley, Id, Pos2, Rect, ScrollArea, TextBuffer, TextEdit, TextStyle, Ui,
    vec2,
};

/// Width of the line numbers, points.
const NUMBERS: f32 = 36.0;

/// Draws the field; `id`: of this text; `go_to`: put the cursor at this line and column. Returns whether it is being typed in.
pub fn field(
    ui: &mut Ui,
    id: Id,
    text: &mut String,
    faults: &[&ShaderFault],
    go_to: Option<[u32; 2]>,
) -> bool {
    if let Some(place) = go_to {
        put_cursor(ui, id, text, place);
    }
    let font = TextStyle::Monospace.resolve(ui.style());
    let colors = Colors::of(ui);
    let mut layouter = |ui: &Ui, text: &dyn TextBuffer, _: f32| -> Arc<Galley> {
        ui.fonts_mut(|fonts| fonts.layout_job(colored(text.as_str(), &font, colors)))
    };
    ScrollArea::both()
        .id_salt(id)
        .auto_shrink([false, false])
        .show(ui, |ui| {
            ui.horizontal_top(|ui| {
                ui.add_space(NUMBERS);
                let edit = TextEdit::multiline(text)
                    .id(id)
                    .code_editor()
                    .frame(egui::Frame::NONE)
                    .desired_width(f32::INFINITY)
                    .desired_rows(8)
                    .layouter(&mut layouter);
                let output = edit.show(ui);
                for (index, row) in output.galley.rows.iter().enumerate() {
                    let line = index as u32 + 1;
                    let top = output.galley_pos.y + row.pos.y;
                    let rect = Rect::from_min_size(
                        Pos2::new(output.galley_pos.x, top),
                        vec2(row.row.size.x, row.row.size.y),
                    );
                    let of_line = faults.iter().find(|fault| fault.line == Some(line));
                    mark_line(ui, &font, line, rect, of_line.copied(), colors);
                    if go_to.is_some_and(|[wanted, _]| wanted == line) {
                        ui.scroll_to_rect(rect.expand2(vec2(0.0, 60.0)), Some(Align::Center));
                    }
                }
                let response = output.response.response;
                if go_to.is_some() {
                    // Not before: the click that led here was outside of the text, which takes the keyboard from it.
                    response.request_focus();
                }
                response.has_focus()
            })
            .inner
        })
        .inner
}

/// Puts the cursor at a line and column.
fn put_cursor(ui: &Ui, id: Id, text: &str, [line, column]: [u32; 2]) {
    let before = text.split_inclusive('\n').take(line.saturating_sub(1) as usize);
    let at = before.map(|line| line.chars().count()).sum::<usize>() + column.saturating_sub(1) as usize;
    let mut state = TextEditState::load(ui.ctx(), id).unwrap_or_default();
    state.cursor.set_char_range(Some(CCursorRange::one(CCursor::new(at))));
    state.store(ui.ctx(), id);
}

/// The number of a line, and what is wrong with it.
fn mark_line(ui: &Ui, font: &FontId, line: u32, rect: Rect, fault: Option<&ShaderFault>, colors: Colors) {
    if !ui.is_rect_visible(Rect::from_min_max(Pos2::new(ui.clip_rect().left(), rect.top()), rect.max)) {
        return;
    }
    let painter = ui.painter();
    let color = if fault.is_some() { colors.error } else { colors.weak };
    let number = Pos2::new(rect.left() - 10.0, rect.top());
    painter.text(number, Align2::RIGHT_TOP, line.to_string(), font.clone(), color);
    let Some(fault) = fault else { return };
    let from = fault.column.map_or(rect.left(), |column| {
        rect.left() + rect.width() * (column - 1) as f32 / fault_width(fault).max(1) as f32
    });
    painter.hline(from..=rect.right().max(from + 8.0), rect.bottom(), (1.5, colors.error));
    let message = fault.message.lines().next().unwrap_or_default();
    let behind = Pos2::new(rect.right() + 24.0, rect.top());
    painter.text(behind, Align2::LEFT_TOP, message, font.clone(), colors.error);
}

fn fault_width(fault: &ShaderFault) -> usize {
    fault.source_line.as_ref().map_or(1, |line| line.chars().count())
}

#[derive(Clone, Copy)]
struct Colors {
    plain: Color32,
    weak: Color32,
    word: Color32,
    number: Color32,
    directive: Color32,
    error: Color32,
}

impl Colors {
    fn of(ui: &Ui) -> Self {
        let visuals = ui.visuals();
        let (word, number, directive) = if visuals.dark_mode {
            (
                Color32::from_rgb(120, 180, 240),
                Color32::from_rgb(220, 180, 120),
                Color32::from_rgb(190, 150, 220),
            )
        } else {
            (Color32::from_rgb(20, 80, 170), Color32::from_rgb(140, 80, 0), Color32::from_rgb(110, 50, 150))
        };
        Self {
            plain: visuals.text_color(),
            weak: visuals.weak_text_color(),
            word,
            number,
            directive,
            error: visuals.error_fg_color,
        }
    }
}

/// Words of GLSL that are neither types nor functions.
const WORDS: [&str; 28] = [
    "break",
    "buffer",
    "case",
    "const",
    "continue",
    "default",
    "discard",
    "do",
    "else",
    "false",
    "flat",
    "for",
    "if",
    "in",
    "inout",
    "layout",
    "out",
    "readonly",
    "return",
    "shared",
    "struct",
    "switch",
    "true",
    "uniform",
    "void",
    "while",
    "writeonly",
    "precise",
];

/// Types begin like this.
const TYPES: [&str; 10] = ["vec", "ivec", "uvec", "bvec", "mat", "float", "int", "uint", "bool", "double"];

fn colored(text: &str, font: &FontId, colors: Colors) -> LayoutJob {
    let mut job = LayoutJob::default();
    job.wrap.max_width = f32::INFINITY;
    let mut rest = text;
    let mut line_begins = true;
    while let Some(first) = rest.chars().next() {
        let (length, color) = token(rest, first, line_begins, colors);
        let (taken, after) = rest.split_at(length);
        job.append(taken, 0.0, TextFormat::simple(font.clone(), color));
        line_begins = taken.ends_with('\n') || (line_begins && taken.trim().is_empty());
        rest = after;
    }
    job
}

/// Length in bytes and colour of what a text begins with.
fn token(text: &str, first: char, line_begins: bool, colors: Colors) -> (usize, Color32) {
    let while_of = |wanted: &dyn Fn(char) -> bool| text.find(|c| !wanted(c)).unwrap_or(text.len());
    let line = text.find('\n').unwrap_or(text.len());
    if text.starts_with("//") || (first == '#' && line_begins) {
        return (line, if first == '#' { colors.directive } else { colors.weak });
    }
    if text.starts_with("/*") {
        return (text.find("*/").map_or(text.len(), |at| at + 2), colors.weak);
    }
    if first.is_ascii_digit() {
        return (while_of(&|c| c.is_ascii_alphanumeric() || c == '.'), colors.number);
    }
    if first.is_alphabetic() || first == '_' {
        let length = while_of(&|c| c.is_alphanumeric() || c == '_');
        let word = &text[..length];
        let is_type = TYPES.iter().any(|ty| {
            word.strip_prefix(ty).is_some_and(|rest| {
                rest.chars().all(|c| c.is_ascii_digit() || c == 'x' || c == '_' || c == 't')
            })
        });
        return (length, if WORDS.contains(&word) || is_type { colors.word } else { colors.plain });
    }
    let plain = |c: char| !c.is_alphanumeric() && !matches!(c, '_' | '/' | '#' | '\n');
    (if first == '\n' { 1 } else { while_of(&plain).max(first.len_utf8()) }, colors.plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes above the field, such as a list of errors, must not take the keyboard from it: Ctrl+S and Ctrl+Z would be about
    /// the scene.
    #[test]
    fn a_text_keeps_the_keyboard_and_the_cursor_whatever_comes_above_it() {
        let context = egui::Context::default();
        let (id, mut text) = (Id::new("text"), String::from("one\ntwo\n"));
        let frame = |text: &mut String, labels: usize, go_to, events: Vec<egui::Event>| {
            let mut has_focus = false;
            let input = egui::RawInput { events, ..egui::RawInput::default() };
            let _ = context.run_ui(input, |ui| {
                for _ in 0..labels {
                    ui.label("an error");
                }
                has_focus = field(ui, id, text, &[], go_to);
            });
            has_focus
        };
        frame(&mut text, 0, Some([2, 2]), Vec::new());
        assert!(frame(&mut text, 0, None, vec![egui::Event::Text("X".into())]));
        assert_eq!(text, "one\ntXwo\n");
        assert!(frame(&mut text, 3, None, vec![egui::Event::Text("Y".into())]));
        assert_eq!(text, "one\ntXYwo\n");
        frame(&mut text, 0, Some([99, 1]), Vec::new());
        assert!(frame(&mut text, 0, None, vec![egui::Event::Text("end".into())]));
        assert_eq!(text, "one\ntXYwo\nend");
    }
}
