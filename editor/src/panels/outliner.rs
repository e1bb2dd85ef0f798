//! The tree of the scene. Enters: the document. Leaves: selection, names, visibility and parents, as edits.
//! Only the rows on the screen are drawn.

use caustica_scene::{Edit, Target, is_degenerate};
use egui::{
    Align2, Color32, CornerRadius, FontId, Key, Pos2, Rect, Response, ScrollArea, Sense, TextEdit, Ui, vec2,
};
use egui_phosphor::regular as icon;

use super::{Cx, target_icon};
use crate::app::actions::Action;
use crate::theme::ROW;
use crate::ui_state::Row;

const INDENT: f32 = 16.0;

/// How far the name of a row stands from the left: deep down in a tree it stays in the panel.
fn indent(row: Row, rect: Rect) -> f32 {
    (f32::from(row.depth) * INDENT).min((rect.width() * 0.5).max(0.0))
}

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    search_box(cx, ui);
    ui.add_space(4.0);
    let revision = cx.session.history().structure_revision();
    cx.state.outliner.update(cx.session.document(), revision);
    let count = cx.state.outliner.rows().len();
    if count == 0 {
        let searching = !cx.state.outliner.search.trim().is_empty();
        let note = if searching {
            "Nothing has this name."
        } else {
            "The scene is empty. Drop a model here, or File > Import."
        };
        super::empty_note(ui, note);
        return;
    }
    ui.spacing_mut().item_spacing.y = 0.0;
    let mut area = ScrollArea::vertical().auto_shrink([false, false]);
    if let Some(target) = cx.state.outliner.reveal.take()
        && let Some(index) = cx.state.outliner.rows().iter().position(|row| row.target == target)
    {
        let offset = index as f32 * ROW - ui.available_height() * 0.4;
        area = area
            .vertical_scroll_offset(offset.clamp(0.0, (count as f32 * ROW - ui.available_height()).max(0.0)));
    }
    area.show_rows(ui, ROW, count, |ui, range| {
        for index in range {
            if let Some(row) = cx.state.outliner.rows().get(index).copied() {
                row_ui(cx, ui, row, index);
            }
        }
        drop_on_empty(cx, ui);
    });
    arrow_keys(cx, ui);
}

fn search_box(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let clear_width = 24.0;
        let edit = TextEdit::singleline(&mut cx.state.outliner.search)
            .hint_text(format!("{}  Search", icon::MAGNIFYING_GLASS))
            .desired_width(ui.available_width() - clear_width - ui.spacing().item_spacing.x);
        ui.add(edit).on_hover_text("Shows objects whose name contains this, with everything above them");
        let clear = egui::Button::new(icon::X).frame(false);
        if ui
            .add_enabled(!cx.state.outliner.search.is_empty(), clear)
            .on_hover_text("Clear the search")
            .clicked()
        {
            cx.state.outliner.search.clear();
        }
    });
}

fn row_ui(cx: &mut Cx<'_>, ui: &mut Ui, row: Row, index: usize) {
    let target = row.target;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let id = ui.id().with(("row", target));
    if cx.state.outliner.renaming.as_ref().is_some_and(|(whose, _)| *whose == target) {
        rename_ui(cx, ui, rect, row);
        return;
    }
    let response = ui.interact(rect, id, Sense::click_and_drag());
    let eye_rect = Rect::from_min_max(Pos2::new(rect.right() - ROW, rect.top()), rect.max);
    let eye = ui.interact(eye_rect, id.with("eye"), Sense::click());
    let lock_rect = eye_rect.translate(vec2(-ROW, 0.0));
    let lock = target.part.is_none().then(|| ui.interact(lock_rect, id.with("lock"), Sense::click()));
    let caret_rect = Rect::from_min_size(rect.min + vec2(indent(row, rect), 0.0), vec2(INDENT + 4.0, ROW));
    let caret = row.has_children.then(|| ui.interact(caret_rect, id.with("caret"), Sense::click()));
    let hovered = response.hovered() || eye.hovered() || lock.as_ref().is_some_and(Response::hovered);
    paint_row(cx, ui, row, rect, &response, hovered);

    if caret.is_some_and(|caret| caret.clicked()) {
        let open = !cx.state.outliner.is_open(target);
        cx.state.outliner.set_open(target, open);
    } else if eye.on_hover_text("Show or hide this and everything below it").clicked() {
        let visible = !cx.session.document().visible(target).unwrap_or(true);
        cx.push(Edit::SetVisible { target, visible });
    } else if lock
        .is_some_and(|lock| lock.on_hover_text("Lock or unlock this and everything below it").clicked())
    {
        let locked = !cx.session.document().node(target.node).is_some_and(|node| node.locked);
        cx.push(Edit::SetLocked { node: target.node, locked });
    } else if response.double_clicked() {
        start_renaming(cx, target);
    } else if response.clicked() {
        click(cx, ui, target, index);
    }
    drag_and_drop(cx, &response, target, rect, ui);
    response.context_menu(|ui| context_menu(cx, ui, target));
}

fn paint_row(cx: &Cx<'_>, ui: &Ui, row: Row, rect: Rect, response: &Response, hovered: bool) {
    let document = cx.session.document();
    let (painter, visuals) = (ui.painter(), ui.visuals());
    let selected = cx.state.selection.contains(row.target);
    if selected || hovered {
        let fill = if selected {
            visuals.selection.bg_fill
        } else {
            visuals.widgets.hovered.weak_bg_fill.gamma_multiply(0.5)
        };
        painter.rect_filled(rect, CornerRadius::same(4), fill);
    }
    let own = document.visible(row.target).unwrap_or(true);
    let shown = own && document.effectively_visible(row.target);
    let color = match (selected, shown) {
        (true, _) => visuals.selection.stroke.color,
        (_, true) => visuals.text_color(),
        (_, false) => visuals.weak_text_color().gamma_multiply(0.7),
    };
    let middle = rect.center().y;
    let mut x = rect.left() + indent(row, rect) + 3.0;
    let font = FontId::proportional(13.5);
    let put = |x: f32, text: &str, color: Color32| {
        painter.text(Pos2::new(x, middle), Align2::LEFT_CENTER, text, font.clone(), color);
    };
    if row.has_children {
        let searching = !cx.state.outliner.search.trim().is_empty();
        let open = searching || cx.state.outliner.is_open(row.target);
        put(x, if open { icon::CARET_DOWN } else { icon::CARET_RIGHT }, visuals.weak_text_color());
    }
    x += INDENT;
    put(x, target_icon(cx, row.target), if selected { color } else { visuals.weak_text_color() });
    x += 20.0;
    let broken = document.world_from(row.target).is_some_and(|world| is_degenerate(&world));
    let locked = document.node(row.target.node).is_some_and(|node| node.locked) && row.target.part.is_none();
    let buttons = if locked || hovered { 2.0 * ROW } else { ROW };
    let right = rect.right() - buttons - if broken { 20.0 } else { 0.0 };
    let name_rect = Rect::from_min_max(Pos2::new(x, rect.top()), Pos2::new(right.max(x), rect.bottom()));
    let job =
        egui::text::LayoutJob::simple_singleline(document.display_name(row.target), font.clone(), color);
    let galley = egui::WidgetText::from(job).into_galley(
        ui,
        Some(egui::TextWrapMode::Truncate),
        name_rect.width(),
        egui::TextStyle::Body,
    );
    painter.galley(Pos2::new(x, middle - galley.size().y * 0.5), galley, color);
    if broken {
        put(right, icon::WARNING, visuals.warn_fg_color);
    }
    if !own || hovered {
        put(
            rect.right() - ROW + 5.0,
            if own { icon::EYE } else { icon::EYE_SLASH },
            visuals.weak_text_color(),
        );
    }
    if locked || (hovered && row.target.part.is_none()) {
        put(
            rect.right() - 2.0 * ROW + 5.0,
            if locked { icon::LOCK_SIMPLE } else { icon::LOCK_SIMPLE_OPEN },
            visuals.weak_text_color(),
        );
    }
    if broken && response.hovered() {
        response.show_tooltip_text(
            "Left out of the picture: its scale is zero, or its place is no finite number",
        );
    }
}

fn rename_ui(cx: &mut Cx<'_>, ui: &mut Ui, rect: Rect, row: Row) {
    let left = rect.left() + indent(row, rect) + INDENT + 18.0;
    let field = Rect::from_min_max(
        Pos2::new(left, rect.top() + 1.0),
        Pos2::new(rect.right() - 4.0, rect.bottom() - 1.0),
    );
    let Some((_, text)) = &mut cx.state.outliner.renaming else { return };
    let length = text.chars().count();
    let edit = TextEdit::singleline(text).id(ui.id().with("rename")).margin(vec2(4.0, 2.0));
    let response = ui.put(field, edit);
    if !response.has_focus() && !response.lost_focus() {
        // The first frame: what is typed replaces the old name.
        select_all(ui, response.id, length);
    }
    if response.lost_focus() {
        let escaped = ui.input(|input| input.key_pressed(Key::Escape));
        if let Some((target, name)) = cx.state.outliner.renaming.take()
            && !escaped
            && cx.session.document().name(target) != Some(name.as_str())
        {
            cx.push(Edit::Rename { target, name });
        }
    } else {
        response.request_focus();
    }
}

/// Selects the whole text of a field.
fn select_all(ui: &Ui, field: egui::Id, length: usize) {
    use egui::text::{CCursor, CCursorRange};
    let mut state = egui::text_edit::TextEditState::load(ui.ctx(), field).unwrap_or_default();
    state.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), CCursor::new(length))));
    state.store(ui.ctx(), field);
}

/// Starts to type a new name in the row of a target.
pub fn start_renaming(cx: &mut Cx<'_>, target: Target) {
    let name = cx.session.document().display_name(target);
    cx.state.outliner.reveal(cx.session.document(), target);
    cx.state.outliner.renaming = Some((target, name));
}

fn click(cx: &mut Cx<'_>, ui: &Ui, target: Target, index: usize) {
    let modifiers = ui.input(|input| input.modifiers);
    let rows = cx.state.outliner.rows();
    let anchor = cx.state.outliner.anchor.and_then(|anchor| rows.iter().position(|row| row.target == anchor));
    match anchor {
        Some(anchor) if modifiers.shift => {
            let (low, high) = (anchor.min(index), anchor.max(index));
            let range: Vec<_> = rows[low..=high].iter().map(|row| row.target).collect();
            if !modifiers.command {
                cx.state.selection.clear();
            }
            range.into_iter().for_each(|target| cx.state.selection.add(target));
            cx.state.selection.add(target);
        }
        _ if modifiers.command => {
            cx.state.selection.toggle(target);
            cx.state.outliner.anchor = Some(target);
        }
        _ => {
            cx.state.selection.set(target);
            cx.state.outliner.anchor = Some(target);
        }
    }
}

fn drag_and_drop(cx: &mut Cx<'_>, response: &Response, target: Target, rect: Rect, ui: &Ui) {
    if target.part.is_none() {
        response.dnd_set_drag_payload(target);
    }
    // Something can hang below every node that is not a part inside an instance.
    let below = target.part.is_none().then_some(target);
    let (Some(below), Some(dragged)) = (below, response.dnd_hover_payload::<Target>()) else { return };
    if cx.session.document().is_within(below, *dragged) {
        return;
    }
    let stroke = egui::Stroke::new(1.5, crate::theme::accent(ui.visuals()));
    ui.painter().rect_stroke(rect.shrink(1.0), CornerRadius::same(4), stroke, egui::StrokeKind::Inside);
    if let Some(dragged) = response.dnd_release_payload::<Target>() {
        reparent(cx, *dragged, Some(below));
    }
}

fn drop_on_empty(cx: &mut Cx<'_>, ui: &mut Ui) {
    let rest = ui.available_rect_before_wrap();
    if rest.height() < 4.0 {
        return;
    }
    let response = ui.interact(rest, ui.id().with("below the rows"), Sense::click());
    if response.clicked() {
        cx.state.selection.clear();
    }
    if let Some(dragged) = response.dnd_release_payload::<Target>() {
        reparent(cx, *dragged, None);
    }
}

fn reparent(cx: &mut Cx<'_>, dragged: Target, below: Option<Target>) {
    let parent = below.map(|target| target.node);
    if dragged.part.is_some() || cx.session.document().parent_of(dragged).map(|t| t.node) == parent {
        return;
    }
    match cx.session.document().reparent_edit(dragged.node, parent, usize::MAX) {
        Ok(edit) => {
            cx.push(edit);
            if let Some(below) = below {
                cx.state.outliner.set_open(below, true);
            }
        }
        Err(error) => cx.state.toasts.error(format!("That cannot be moved there: {error}.")),
    }
}

fn context_menu(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    if !cx.state.selection.contains(target) {
        cx.state.selection.set(target);
    }
    let node = target.part.is_none();
    let entries = [
        (icon::CROSSHAIR, "Frame", Action::FrameSelection, true),
        (icon::PENCIL_SIMPLE, "Rename", Action::Rename, true),
        (icon::EYE, "Show or hide", Action::ToggleVisible, true),
        (icon::LOCK_SIMPLE, "Lock or unlock", Action::ToggleLock, node),
        (icon::COPY, "Duplicate", Action::Duplicate, node),
        (icon::FOLDER_SIMPLE_PLUS, "Group", Action::Group, node),
        (icon::TRASH, "Delete", Action::Delete, node),
    ];
    for (icon, name, action, enabled) in entries {
        let button = egui::Button::new(format!("{icon}  {name}"));
        let response =
            ui.add_enabled(enabled, button).on_disabled_hover_text("Not for a part inside an instance");
        if response.clicked() {
            cx.act(action);
            ui.close();
        }
    }
}

/// Up and down move the selection, left and right close and open, while the pointer is over the panel.
fn arrow_keys(cx: &mut Cx<'_>, ui: &Ui) {
    if !ui.ui_contains_pointer() || ui.ctx().text_edit_focused() {
        return;
    }
    let Some(active) = cx.state.selection.active() else { return };
    let rows = cx.state.outliner.rows();
    let Some(index) = rows.iter().position(|row| row.target == active) else { return };
    // With Alt they step through time.
    let pressed = |key| ui.input(|input| input.key_pressed(key) && input.modifiers.is_none());
    let step = match (pressed(Key::ArrowDown), pressed(Key::ArrowUp)) {
        (true, _) => index.saturating_add(1),
        (_, true) => index.saturating_sub(1),
        _ => index,
    };
    if step != index
        && let Some(row) = rows.get(step).copied()
    {
        cx.state.selection.set(row.target);
        cx.state.outliner.anchor = Some(row.target);
    }
    if pressed(Key::ArrowRight) {
        cx.state.outliner.set_open(active, true);
    } else if pressed(Key::ArrowLeft) {
        cx.state.outliner.set_open(active, false);
    }
}
