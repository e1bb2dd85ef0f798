//! Colours, sizes and fonts of the window: one theme, dark or light, on a grid of 8 points.
//! Enters: which of the two. Leaves: egui styles. It knows no panel.

use egui::{
    Color32, Context, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Shadow, Stroke,
    Style, TextStyle, Theme, Vec2, Visuals,
};

/// Half a step of the grid, points.
pub const HALF: f32 = 4.0;
/// One step of the grid, points.
pub const STEP: f32 = 8.0;
/// Height of a row in lists, points.
pub const ROW: f32 = 24.0;

/// The few colours everything is made of.
#[derive(Clone, Copy, Debug)]
struct Palette {
    sunken: Color32,
    window: Color32,
    panel: Color32,
    raised: Color32,
    hovered: Color32,
    pressed: Color32,
    line: Color32,
    text: Color32,
    weak: Color32,
    strong: Color32,
    accent: Color32,
    accent_fill: Color32,
    warn: Color32,
    error: Color32,
}

const DARK: Palette = Palette {
    sunken: Color32::from_rgb(16, 18, 22),
    window: Color32::from_rgb(22, 24, 29),
    panel: Color32::from_rgb(28, 31, 37),
    raised: Color32::from_rgb(44, 48, 57),
    hovered: Color32::from_rgb(56, 62, 73),
    pressed: Color32::from_rgb(66, 73, 86),
    line: Color32::from_rgb(50, 54, 63),
    text: Color32::from_rgb(206, 211, 220),
    weak: Color32::from_rgb(136, 143, 156),
    strong: Color32::from_rgb(242, 244, 248),
    accent: Color32::from_rgb(92, 184, 216),
    accent_fill: Color32::from_rgb(32, 84, 108),
    warn: Color32::from_rgb(240, 178, 82),
    error: Color32::from_rgb(240, 104, 98),
};

const LIGHT: Palette = Palette {
    sunken: Color32::from_rgb(255, 255, 255),
    window: Color32::from_rgb(212, 217, 225),
    panel: Color32::from_rgb(237, 240, 244),
    raised: Color32::from_rgb(251, 252, 254),
    hovered: Color32::from_rgb(222, 229, 238),
    pressed: Color32::from_rgb(200, 209, 221),
    line: Color32::from_rgb(198, 204, 213),
    text: Color32::from_rgb(46, 52, 62),
    weak: Color32::from_rgb(104, 112, 125),
    strong: Color32::from_rgb(14, 18, 24),
    accent: Color32::from_rgb(12, 104, 140),
    accent_fill: Color32::from_rgb(176, 220, 236),
    warn: Color32::from_rgb(158, 94, 0),
    error: Color32::from_rgb(190, 36, 36),
};

/// Sets fonts and both styles; `dark` chooses one.
pub fn install(context: &Context, dark: bool) {
    context.set_fonts(fonts());
    for theme in [Theme::Dark, Theme::Light] {
        context.set_style_of(theme, style(theme));
    }
    set_dark(context, dark);
}

/// Chooses between dark and light.
pub fn set_dark(context: &Context, dark: bool) {
    context.set_theme(if dark { Theme::Dark } else { Theme::Light });
}

/// Background behind and between panels, encoded values for the window's clear.
pub fn window_color(dark: bool) -> Color32 {
    palette(dark).window
}

/// The accent colour for marks and bars.
pub fn accent(visuals: &Visuals) -> Color32 {
    palette(visuals.dark_mode).accent
}

/// Background of sunken areas such as bars.
pub fn sunken(visuals: &Visuals) -> Color32 {
    palette(visuals.dark_mode).sunken
}

/// Style of the docking area.
pub fn dock_style(style: &Style) -> egui_dock::Style {
    let colors = palette(style.visuals.dark_mode);
    let mut dock = egui_dock::Style::from_egui(style);
    dock.dock_area_padding = Some(Margin::same(0));
    dock.main_surface_border_stroke = Stroke::NONE;
    dock.separator.width = 4.0;
    dock.separator.color_idle = colors.window;
    dock.separator.color_hovered = colors.accent;
    dock.separator.color_dragged = colors.accent;
    dock.tab_bar.bg_fill = colors.window;
    dock.tab_bar.height = 28.0;
    dock.tab_bar.hline_color = colors.window;
    dock.tab_bar.corner_radius = CornerRadius::ZERO;
    dock.buttons.close_tab_color = colors.line;
    dock.buttons.close_tab_active_color = colors.text;
    dock.buttons.close_tab_bg_fill = Color32::TRANSPARENT;
    dock.tab.tab_body.inner_margin = Margin::same(8);
    dock.tab.tab_body.bg_fill = colors.panel;
    dock.tab.tab_body.stroke = Stroke::NONE;
    dock.tab.tab_body.corner_radius = CornerRadius::ZERO;
    let states = [
        (&mut dock.tab.active, colors.panel, colors.strong),
        (&mut dock.tab.focused, colors.panel, colors.strong),
        (&mut dock.tab.inactive, colors.window, colors.weak),
        (&mut dock.tab.hovered, colors.raised, colors.strong),
        (&mut dock.tab.active_with_kb_focus, colors.panel, colors.strong),
        (&mut dock.tab.focused_with_kb_focus, colors.panel, colors.strong),
        (&mut dock.tab.inactive_with_kb_focus, colors.window, colors.text),
    ];
    for (state, fill, text) in states {
        state.bg_fill = fill;
        state.text_color = text;
        state.outline_color = Color32::TRANSPARENT;
        state.corner_radius = CornerRadius { nw: 4, ne: 4, sw: 0, se: 0 };
    }
    dock
}

fn palette(dark: bool) -> &'static Palette {
    if dark { &DARK } else { &LIGHT }
}

fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    egui_phosphor::add_to_fonts(&mut fonts, egui_phosphor::Variant::Regular);
    // Icons also stand beside figures, which are monospaced.
    if let Some(names) = fonts.families.get_mut(&FontFamily::Monospace) {
        names.push("phosphor".to_owned());
    }
    fonts.font_data.entry("phosphor".to_owned()).and_modify(|data| {
        let mut icons = FontData::clone(data);
        icons.tweak.y_offset_factor = 0.06;
        *data = icons.into();
    });
    fonts
}

fn style(theme: Theme) -> Style {
    let colors = palette(theme == Theme::Dark);
    let mut style = Style { visuals: visuals(theme, colors), ..Style::default() };
    style.text_styles = [
        (TextStyle::Small, FontId::new(11.0, FontFamily::Proportional)),
        (TextStyle::Body, FontId::new(13.5, FontFamily::Proportional)),
        (TextStyle::Button, FontId::new(13.5, FontFamily::Proportional)),
        (TextStyle::Heading, FontId::new(16.0, FontFamily::Proportional)),
        (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
    ]
    .into();
    style.drag_value_text_style = TextStyle::Monospace;
    let spacing = &mut style.spacing;
    spacing.item_spacing = Vec2::new(STEP, HALF);
    spacing.button_padding = Vec2::new(STEP, 3.0);
    spacing.interact_size = Vec2::new(40.0, ROW);
    spacing.menu_margin = Margin::same(6);
    spacing.window_margin = Margin::same(12);
    spacing.indent = 16.0;
    spacing.icon_width = 16.0;
    spacing.combo_width = 96.0;
    spacing.slider_width = 120.0;
    spacing.tooltip_width = 360.0;
    spacing.scroll.bar_width = 8.0;
    style.interaction.tooltip_delay = 0.4;
    style.animation_time = 0.08;
    style
}

fn visuals(theme: Theme, colors: &Palette) -> Visuals {
    let mut visuals = theme.default_visuals();
    visuals.panel_fill = colors.panel;
    visuals.window_fill = colors.panel;
    visuals.window_stroke = Stroke::new(1.0, colors.line);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.extreme_bg_color = colors.sunken;
    visuals.faint_bg_color = colors.raised.gamma_multiply(0.35);
    visuals.code_bg_color = colors.sunken;
    visuals.warn_fg_color = colors.warn;
    visuals.error_fg_color = colors.error;
    visuals.hyperlink_color = colors.accent;
    visuals.weak_text_color = Some(colors.weak);
    visuals.selection.bg_fill = colors.accent_fill;
    visuals.selection.stroke = Stroke::new(1.0, colors.strong);
    visuals.slider_trailing_fill = true;
    visuals.indent_has_left_vline = false;
    visuals.window_shadow =
        Shadow { offset: [0, 8], blur: 24, spread: 0, color: Color32::from_black_alpha(96) };
    visuals.popup_shadow =
        Shadow { offset: [0, 4], blur: 12, spread: 0, color: Color32::from_black_alpha(80) };
    let widgets = &mut visuals.widgets;
    let states = [
        (&mut widgets.noninteractive, colors.panel, colors.text, colors.line),
        (&mut widgets.inactive, colors.raised, colors.text, colors.raised),
        (&mut widgets.hovered, colors.hovered, colors.strong, colors.pressed),
        (&mut widgets.active, colors.pressed, colors.strong, colors.accent),
        (&mut widgets.open, colors.hovered, colors.strong, colors.hovered),
    ];
    for (state, fill, text, line) in states {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.fg_stroke = Stroke::new(1.0, text);
        state.bg_stroke = Stroke::new(1.0, line);
        state.corner_radius = CornerRadius::same(4);
        state.expansion = 0.0;
    }
    visuals
}
