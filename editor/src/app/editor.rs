//! The editor without its window: session, memory, panels and what goes on besides. Enters: egui's frame. Leaves:
//! drawings and a changed session. It knows no winit and no swapchain, so that it can run in a test.

use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::time::Instant;

use caustica_scene::{Finding, LeftBehind, audit};
use egui::{CentralPanel, Context, Frame, Id, Margin, Modal, Panel, Ui, WidgetText};
use egui_dock::{DockArea, DockState, TabViewer};

use super::actions::{self, Action};
use super::after_hang::AfterHang;
use super::export::Exporting;
use super::files::Loading;
use super::recovery::{Recovering, Watch};
use super::shaders::TypedTexts;
use crate::dialogs::{Dialogs, Wish};
use crate::panels::{self, Cx, bars, overlays};
use crate::session::Session;
use crate::theme;
use crate::ui_state::{Config, Health, PaletteState, Tab, UiState, add_tab, default_layout};
use crate::worker::{Answer, Job, Wake};

/// What waits for an answer about unsaved changes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Then {
    /// An empty scene.
    New,
    /// Ask for a file and open it.
    AskAndOpen,
    /// Open this file.
    Open(PathBuf),
    /// Look for unsaved changes that were left behind.
    Recover,
    /// End the program.
    Quit,
}

/// Session, memory, panels.
pub struct Editor {
    /// The open document and its picture.
    pub session: Session,
    /// What the window remembers.
    pub state: UiState,
    pub(super) dock: DockState<Tab>,
    pub(super) dialogs: Dialogs,
    pub(super) loading: Option<Loading>,
    pub(super) exporting: Option<Exporting>,
    /// Unsaved changes of other runs that the user is asked about, newest first.
    pub(super) left_behind: Vec<LeftBehind>,
    /// Files of those that the user wants to hear of later.
    pub(super) later: BTreeSet<PathBuf>,
    pub(super) recovering: Option<Recovering>,
    /// Journals of processes that may just be ending.
    pub(super) watch: Watch,
    /// Keeps texts of shaders that are not saved.
    pub(super) typed: TypedTexts,
    /// The file that was opened; a model does not become the project's file.
    pub(super) opened: Option<PathBuf>,
    /// What selection and view are to be once the scene is back.
    pub(super) restoring: Option<Box<AfterHang>>,
    /// The project that was opened, and files that it names outside of its folder, while the user is asked about them.
    pub(super) outside: Option<(PathBuf, Vec<PathBuf>)>,
    /// A file that is there already and was not named in full, while the user is asked about it.
    pub(super) replacing: Option<(Wish, PathBuf)>,
    /// Files to import after the present one.
    pub(super) waiting: VecDeque<PathBuf>,
    /// The audit that is running, and the state of the document that it looks at.
    audit: Option<(u64, Job<Vec<Finding>>)>,
    /// The question about unsaved changes, while it is shown.
    pub(super) question: Option<Then>,
    /// Keys pressed in the frame in which a drag ended, for the next one.
    late_keys: Vec<Action>,
    /// To be done once a save has succeeded.
    pub(super) after_save: Option<Then>,
    pub(super) quit: bool,
    pub(super) wake: Wake,
    theme_set: Option<bool>,
    /// When the animation last went on; `None` while it does not play.
    played: Option<Instant>,
}

impl Editor {
    /// An editor on a session. `wake` wakes the event loop from any thread.
    pub fn new(session: Session, config: Config, wake: Wake) -> Self {
        let dock = config.layout.clone().unwrap_or_else(default_layout);
        let state = UiState { config, ..UiState::default() };
        Self {
            session,
            state,
            dock,
            dialogs: Dialogs::default(),
            loading: None,
            exporting: None,
            left_behind: Vec::new(),
            later: BTreeSet::new(),
            recovering: None,
            watch: Watch::default(),
            typed: TypedTexts::default(),
            opened: None,
            restoring: None,
            outside: None,
            replacing: None,
            waiting: VecDeque::new(),
            audit: None,
            question: None,
            late_keys: Vec::new(),
            after_save: None,
            quit: false,
            wake,
            theme_set: None,
            played: None,
        }
    }

    /// Whether the user wants to end the program and nothing is in the way.
    pub fn should_quit(&self) -> bool {
        self.quit
    }

    /// Carries out an action after the next frame's panels, such as one asked for by the window system.
    pub fn request(&mut self, action: Action) {
        self.state.actions.push(action);
    }

    /// What to keep for the next run.
    pub fn config(&self) -> Config {
        Config { layout: Some(self.dock.clone()), ..self.state.config.clone() }
    }

    /// Text for the window's title bar.
    pub fn title(&self) -> String {
        let name =
            self.session.path().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
        let mark = if self.session.is_modified() { "\u{2022} " } else { "" };
        format!("{mark}{} \u{2013} Caustica", name.as_deref().unwrap_or("unsaved scene"))
    }

    /// Draws everything and carries out what was asked for.
    pub fn ui(&mut self, ui: &mut Ui) {
        let context = ui.ctx().clone();
        self.apply_theme(&context);
        self.poll_loading();
        self.poll_exporting();
        self.poll_recovering();
        self.look_again(&context);
        self.look_for_typed(&context);
        if let Some(fault) = self.session.scene_mut().take_journal_fault() {
            self.state.toasts.error(fault);
        }
        self.play(Instant::now());
        self.state.error.look(&mut self.session);
        self.keep_audited();
        self.take_keys(&context);
        self.take_dropped_files(&context);
        self.bars_and_panels(ui);
        self.overlays(&context);
        for action in std::mem::take(&mut self.state.actions) {
            self.perform(action);
        }
        self.keep_typed();
        // A gesture lasts for as long as a button is held.
        if !context.input(|input| input.pointer.any_down()) && self.state.view.drag.is_none() {
            self.session.end_gesture();
        }
        self.state.selection.retain_in(self.session.document());
        self.session.set_selection(self.state.selection.targets());
    }

    /// Moves the time on while the animation plays. Neither history nor file know of it.
    fn play(&mut self, now: Instant) {
        let playback = &mut self.state.playback;
        let duration_s = self.session.duration();
        playback.playing &= duration_s.is_some();
        let Some(duration_s) = duration_s.filter(|_| playback.playing) else {
            self.played = None;
            return;
        };
        let dt_s = self.played.replace(now).map_or(0.0, |before| (now - before).as_secs_f64());
        let time_s = playback.advance(self.session.time().unwrap_or(0.0), duration_s, dt_s);
        self.session.set_time(Some(time_s));
    }

    fn apply_theme(&mut self, context: &Context) {
        let dark = self.state.config.dark;
        if self.theme_set != Some(dark) {
            theme::set_dark(context, dark);
            self.theme_set = Some(dark);
        }
    }

    /// Audits the document on a worker whenever it has changed and no drag is going on.
    fn keep_audited(&mut self) {
        if let Some((state, job)) = self.audit.take() {
            match job.poll() {
                Answer::Running => self.audit = Some((state, job)),
                Answer::Done(findings) => self.state.health = Some(Health { state, findings }),
                Answer::Died => {
                    tracing::error!("the audit failed in a way that was not foreseen");
                    self.state.health = Some(Health { state, findings: Vec::new() });
                }
            }
        }
        let history = self.session.history();
        let state = history.state();
        let stale = self.state.health.as_ref().is_none_or(|health| health.state != state);
        if !stale || self.audit.is_some() || history.gesture_is_open() {
            return;
        }
        let document = self.session.shared_document();
        // The frame that is about to be drawn takes the changes in first.
        if document.has_changes() && self.state.view.extent_px.is_some() {
            return;
        }
        match Job::start("audit", self.wake.clone(), move |_| audit(&document)) {
            Ok(job) => self.audit = Some((state, job)),
            Err(error) => tracing::warn!("the audit cannot be started: {error}"),
        }
    }

    fn take_keys(&mut self, context: &Context) {
        // Its panel says so again when it is drawn.
        let types_shader = std::mem::take(&mut self.state.shaders.has_focus);
        // A drag that ends in this frame is still open: its keys wait for the next one, or a slow device would lose them.
        let released = context.input(|input| !input.pointer.primary_down());
        if self.state.view.drag.is_some() && released {
            self.late_keys.extend(actions::pressed(context, context.text_edit_focused()));
            return;
        }
        self.state.actions.append(&mut self.late_keys);
        let busy = self.state.view.flying
            || self.state.view.drag.is_some()
            || self.state.palette.is_some()
            || self.asks()
            || self.dialogs.is_open();
        if !busy {
            let typing = context.text_edit_focused();
            let pressed = actions::pressed(context, typing);
            if pressed.contains(&Action::Palette) {
                // What follows that key is the command's name and no key of its own.
                let text = actions::typed_after_palette_key(context);
                self.state.palette = Some(PaletteState { text, ..PaletteState::default() });
                return;
            }
            // While a shader is typed in, it is what is saved.
            let of_shader =
                |action| if types_shader && action == Action::Save { Action::SaveShader } else { action };
            self.state.actions.extend(pressed.into_iter().map(of_shader));
        }
    }

    fn take_dropped_files(&mut self, context: &Context) {
        let dropped: Vec<PathBuf> = context
            .input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect());
        for path in dropped {
            self.drop_file(path);
        }
    }

    fn bars_and_panels(&mut self, ui: &mut Ui) {
        // Set again by the view's panel when it is drawn.
        self.state.view.extent_px = None;
        let shown_tabs: Vec<Tab> = self.dock.iter_all_tabs().map(|(_, tab)| *tab).collect();
        let fill = theme::window_color(ui.visuals().dark_mode);
        let bar = |margin| Frame::new().fill(fill).inner_margin(margin);
        let mut cx = Cx { session: &mut self.session, state: &mut self.state };
        Panel::top("menu")
            .frame(bar(Margin::symmetric(8, 4)))
            .show_separator_line(false)
            .show(ui, |ui| bars::menu(&mut cx, ui, &shown_tabs));
        Panel::top("tools")
            .exact_size(38.0)
            .frame(bar(Margin::symmetric(8, 4)))
            .show_separator_line(false)
            .show(ui, |ui| bars::tools(&mut cx, ui));
        Panel::bottom("status")
            .exact_size(26.0)
            .frame(bar(Margin::symmetric(8, 2)))
            .show_separator_line(false)
            .show(ui, |ui| bars::status(&mut cx, ui));
        let dock = &mut self.dock;
        CentralPanel::no_frame().show(ui, |ui| {
            let style = theme::dock_style(ui.style());
            let mut tabs = Tabs { cx };
            DockArea::new(dock)
                .style(style)
                .show_leaf_collapse_buttons(false)
                .show_leaf_close_all_buttons(false)
                .show_inside(ui, &mut tabs);
        });
    }

    fn overlays(&mut self, context: &Context) {
        match self.dialogs.update(context) {
            Some(chosen) if chosen.replaces_unasked => self.replacing = Some((chosen.wish, chosen.path)),
            Some(chosen) => self.chosen(chosen.wish, chosen.path),
            None => {}
        }
        let progress = self.loading.as_ref().map(|loading| (loading.label(), loading.progress()));
        if let Some((label, progress)) = progress
            && overlays::progress(context, &self.state, &label, &progress, true)
        {
            self.loading = None;
            self.waiting.clear();
            self.state.toasts.info("Cancelled.");
        }
        if self.loading.is_none()
            && let Some((label, progress)) = (self.recovering.as_ref().map(Recovering::progress))
                .or_else(|| self.exporting.as_ref().map(Exporting::progress))
        {
            overlays::progress(context, &self.state, &label, &progress, false);
        }
        overlays::palette(&mut self.state, context);
        overlays::help(&mut self.state, &self.session, context);
        overlays::toasts(&mut self.state, context);
        overlays::drop_hint(context);
        if self.question.is_some() {
            self.ask_about_changes(context);
        } else if self.replacing.is_some() {
            self.ask_to_replace(context);
        } else if !self.left_behind.is_empty() {
            self.ask_to_recover(context);
        } else {
            self.ask_about_outside(context);
        }
    }

    /// Whether a question waits for its answer.
    fn asks(&self) -> bool {
        self.question.is_some()
            || self.replacing.is_some()
            || !self.left_behind.is_empty()
            || self.outside.is_some()
    }

    fn ask_about_changes(&mut self, context: &Context) {
        let Some(then) = self.question.clone() else { return };
        let mut answer = None;
        let modal = Modal::new(Id::new("unsaved")).show(context, |ui| {
            ui.set_width(360.0);
            ui.heading("Save the changes?");
            ui.add_space(8.0);
            ui.label("The scene has changes that are not saved. Without saving they are lost.");
            ui.add_space(16.0);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let save = ui.button("Save").on_hover_text("Save, then go on");
                if self.state.view.extent_px.is_some() && context.memory(|memory| memory.focused().is_none())
                {
                    save.request_focus();
                }
                if save.clicked() {
                    answer = Some(true);
                }
                if ui.button("Don't save").clicked() {
                    answer = Some(false);
                }
                if ui.button("Cancel").clicked() {
                    ui.close();
                }
            });
        });
        match answer {
            Some(true) => {
                self.question = None;
                self.after_save = Some(then);
                self.perform(Action::Save);
            }
            Some(false) => {
                self.question = None;
                self.go_on(then);
            }
            None if modal.should_close() => self.question = None,
            None => {}
        }
    }

    /// Does it at once, or asks first when there are unsaved changes.
    pub(super) fn guarded(&mut self, then: Then) {
        if self.session.is_modified() {
            self.question = Some(then);
        } else {
            self.go_on(then);
        }
    }

    /// Shows a panel: brings its tab to the front, or puts it back.
    pub(super) fn show_tab(&mut self, tab: Tab) {
        add_tab(&mut self.dock, tab);
        if let Some(path) = self.dock.find_tab(&tab)
            && self.dock.set_active_tab(path).is_err()
        {
            tracing::debug!("the tab {} cannot be brought to the front", tab.name());
        }
    }

    /// Puts all panels back to their places.
    pub(super) fn reset_layout(&mut self) {
        self.dock = default_layout();
    }
}

/// Draws the panel of a tab.
struct Tabs<'a> {
    cx: Cx<'a>,
}

impl TabViewer for Tabs<'_> {
    type Tab = Tab;

    fn id(&mut self, tab: &mut Tab) -> Id {
        Id::new(("panel", *tab))
    }

    fn title(&mut self, tab: &mut Tab) -> WidgetText {
        tab.name().into()
    }

    fn ui(&mut self, ui: &mut Ui, tab: &mut Tab) {
        match tab {
            Tab::View => panels::view::ui(&mut self.cx, ui),
            Tab::Outliner => panels::outliner::ui(&mut self.cx, ui),
            Tab::Inspector => panels::inspector::ui(&mut self.cx, ui),
            Tab::Render => panels::render::ui(&mut self.cx, ui),
            Tab::Error => panels::error::ui(&mut self.cx, ui),
            Tab::Passes => panels::reports::passes(&mut self.cx, ui),
            Tab::Acceleration => panels::acceleration::ui(&mut self.cx, ui),
            Tab::Animation => panels::timeline::ui(&mut self.cx, ui),
            Tab::LeftOut => panels::reports::left_out(&mut self.cx, ui),
            Tab::Health => panels::reports::health(&mut self.cx, ui),
            Tab::Shaders => panels::shaders::ui(&mut self.cx, ui),
            Tab::Log => panels::reports::log(&mut self.cx, ui),
        }
    }

    fn is_closeable(&self, tab: &Tab) -> bool {
        *tab != Tab::View
    }

    fn allowed_in_windows(&self, tab: &mut Tab) -> bool {
        *tab != Tab::View
    }

    fn scroll_bars(&self, tab: &Tab) -> [bool; 2] {
        // The others scroll their own lists.
        [false, matches!(tab, Tab::Inspector | Tab::Render)]
    }

    fn tab_style_override(&self, tab: &Tab, global: &egui_dock::TabStyle) -> Option<egui_dock::TabStyle> {
        (*tab == Tab::View).then(|| {
            let mut style = global.clone();
            style.tab_body.inner_margin = Margin::same(0);
            style
        })
    }
}
