//! What the editor does with shaders besides showing them: saving, making a copy that can be edited. Enters: actions. Leaves: files
//! and sentences for the user.

use std::path::PathBuf;
use std::sync::Arc;

use super::editor::Editor;
use crate::ui_state::{Tab, write_built_in};

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
                self.state.toasts.info(format!("The shaders are in {}.", folder.display()));
            }
            Err(error) => self.state.toasts.error(error),
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
