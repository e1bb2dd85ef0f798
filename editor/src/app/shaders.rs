//! What the editor does with shaders besides showing them: saving, making a copy that can be edited, keeping what is not saved.
//! Enters: actions. Leaves: files and sentences for the user.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::Context;

use super::editor::Editor;
use crate::typed::{Keeper, LeftTyped, Typed, survey};
use crate::ui_state::{Tab, write_built_in};

/// How often, and for how long, texts are looked for that a process holds which may just be ending.
const LOOK_EVERY: Duration = Duration::from_millis(500);
const LOOK_FOR: Duration = Duration::from_secs(10);

/// Texts of shaders that are not saved: those of this process are kept, those of others offered.
#[derive(Default)]
pub(super) struct TypedTexts {
    folder: PathBuf,
    keeper: Option<Keeper>,
    /// When to look next for what others have left, and for the last time.
    looks: Option<[Instant; 2]>,
    /// It was told what was left behind for other folders.
    is_told: bool,
}

/// The folder for the user's own shaders.
fn user_folder() -> Option<PathBuf> {
    let journals = crate::recovery::folder()?;
    Some(journals.parent()?.join("shaders"))
}

impl Editor {
    pub(super) fn save_shader(&mut self) {
        let Some(folder) = self.session.shader_folder() else { return };
        if let Err(error) = self.state.shaders.save(&folder) {
            self.state.toasts.error(error);
        }
    }

    /// Writes the shaders of the program where they can be edited, and shows the picture with those from now on.
    pub(super) fn edit_shaders(&mut self) {
        let written = match user_folder() {
            Some(folder) => write_built_in(&folder).map(|()| folder),
            None => Err("There is no folder for it: neither XDG_DATA_HOME nor HOME is set.".to_owned()),
        };
        match written {
            Ok(folder) => {
                self.session.edit_shaders(&folder, Arc::clone(&self.wake));
                self.typed.begin_to_look();
                self.state.toasts.info(format!("The shaders are in {}.", folder.display()));
            }
            Err(error) => self.state.toasts.error(error),
        }
    }

    /// Keeps texts that are not saved in this folder, and looks there for those of processes that have died.
    pub(super) fn keep_typed_in(&mut self, folder: &Path) {
        self.typed.folder = folder.to_owned();
        self.typed.keeper = Keeper::start(folder)
            .inspect_err(|error| tracing::warn!("texts of shaders that are not saved are not kept: {error}"))
            .ok();
        self.typed.begin_to_look();
        self.take_left_typed();
    }

    /// Keeps what is typed by now.
    pub(super) fn keep_typed(&mut self) {
        let Some(keeper) = &mut self.typed.keeper else { return };
        let folder = self.session.shader_folder().unwrap_or_default();
        keeper.keep(Typed { folder, texts: self.state.shaders.unsaved() });
    }

    /// Looks again for texts of processes that were still ending.
    pub(super) fn look_for_typed(&mut self, context: &Context) {
        let Some([next, last]) = self.typed.looks else { return };
        if Instant::now() >= next {
            self.typed.looks = Instant::now().checked_add(LOOK_EVERY).map(|next| [next, last]);
            self.take_left_typed();
        }
        context.request_repaint_after(LOOK_EVERY);
    }

    fn take_left_typed(&mut self) {
        let (left, any_held) = survey(&self.typed.folder);
        left.into_iter().for_each(|left| self.put_back_typed(left));
        self.typed.is_told = true;
        if !any_held || self.typed.looks.is_some_and(|[_, last]| Instant::now() > last) {
            self.typed.looks = None;
        }
    }

    /// Opens texts again that were left behind, where nothing else was typed here; they are not saved.
    fn put_back_typed(&mut self, left: LeftTyped) {
        let files = left.typed.texts.keys().cloned().collect::<Vec<_>>().join(", ");
        let of = left.typed.folder.display().to_string();
        let Some(folder) = self.session.shader_folder().filter(|folder| *folder == left.typed.folder) else {
            if !self.typed.is_told {
                tracing::warn!(
                    "{files}: what was typed and not saved is kept until the shaders in {of} are edited again"
                );
            }
            return;
        };
        let shown = left.typed.texts.keys().next().cloned();
        let other = self.state.shaders.put_back(&folder, left.typed.texts.clone(), shown);
        let is_modified = left.typed.texts.keys().any(|file| self.state.shaders.is_modified(file));
        if is_modified {
            self.show_tab(Tab::Shaders);
            self.state.toasts.warning(format!(
                "{files}: what was typed and not saved when the program ended is back in the panel Shaders. Save or revert it."
            ));
        }
        self.keep_typed();
        match (&self.typed.keeper, other.is_empty()) {
            (Some(keeper), true) => keeper.remove(left),
            _ => tracing::warn!(
                "{}: another text is not saved here; the one that was left behind is kept",
                other.join(", ")
            ),
        }
    }

    /// False, with a word to the user: a shader was changed and not saved.
    pub(super) fn shaders_are_saved(&mut self) -> bool {
        let modified = self.state.shaders.modified().join(", ");
        if modified.is_empty() {
            return true;
        }
        self.state.toasts.error(format!("Not saved yet: {modified}. Save or revert it first."));
        self.show_tab(Tab::Shaders);
        false
    }
}

impl TypedTexts {
    fn begin_to_look(&mut self) {
        let now = Instant::now();
        self.looks = now.checked_add(LOOK_FOR).map(|last| [now, last]);
    }
}
