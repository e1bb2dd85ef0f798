//! What a process whose device did not come back hands to the one that takes its place, and how that one makes use of it.
//! Enters: the editor as it is. Leaves: a file of the user's own folder, read once; the editor as it was.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use caustica_renderer::ViewSettings;
use caustica_renderer::shader::HeldShader;
use caustica_scene::Target;
use serde::{Deserialize, Deserializer, Serialize};

use super::editor::Editor;
use super::files::Purpose;
use crate::recovery;
use crate::session::ViewCamera;
use crate::ui_state::Config;

/// See the head of the file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct AfterHang {
    /// What happened, for the user.
    pub told: String,
    /// The file that is open; `None`: a scene that was never in one.
    pub opened: Option<PathBuf>,
    /// Unsaved changes, which say what is open, too.
    pub journal: Option<PathBuf>,
    /// The folder of the shaders; `None`: those of the binary.
    pub shaders: Option<PathBuf>,
    /// Shaders that did not finish.
    pub held: Vec<HeldShader>,
    /// Layout and all else that is kept between runs.
    #[serde(deserialize_with = "mended")]
    pub config: Config,
    /// The active one last.
    pub selection: Vec<Target>,
    /// The primitive of the active one's mesh.
    pub primitive: Option<u32>,
    /// Camera of the view.
    pub camera: ViewCamera,
    /// Distance from the eye to what it orbits.
    pub distance_m: f64,
    /// Settings of the view.
    pub settings: ViewSettings,
    /// Time of the animation.
    pub time_s: Option<f64>,
    /// Texts of shaders that were typed and not saved, by file.
    pub typed: BTreeMap<String, String>,
    /// The shader that is open.
    pub shown_shader: Option<String>,
}

fn mended<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Config, D::Error> {
    Config::of_json(serde_json::Value::deserialize(deserializer)?).map_err(serde::de::Error::custom)
}

impl AfterHang {
    /// Writes it beside the journals; gives the file.
    ///
    /// # Errors
    /// With the file's name when it cannot be written.
    pub(super) fn write(&self) -> anyhow::Result<PathBuf> {
        let folder = recovery::folder().context("neither XDG_DATA_HOME nor HOME is set")?;
        let folder = folder.parent().unwrap_or(&folder);
        let path = folder.join(format!("after-hang-{}.json", std::process::id()));
        let text = serde_json::to_string(self).context("writing down the state of the editor")?;
        let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, text));
        written.with_context(|| format!("writing {}", path.display()))?;
        Ok(path)
    }

    /// Reads a file, which is removed: what it says is about this start only.
    pub(super) fn take(path: &Path) -> Option<Self> {
        let read = std::fs::read_to_string(path).context("reading it").and_then(|text| {
            std::fs::remove_file(path).context("removing it")?;
            serde_json::from_str(&text).context("what it says")
        });
        read.inspect_err(|error| tracing::warn!("{}: {error:#}", path.display())).ok()
    }
}

impl Editor {
    /// What another process needs to go on as this one.
    pub(super) fn to_keep(&self) -> AfterHang {
        let (session, state) = (&self.session, &self.state);
        let scene = session.scene();
        let opened = session.path().map(Path::to_owned).or_else(|| self.opened.clone());
        let needs_journal = scene.keeps_changes() || opened.is_none();
        let active = state.selection.active();
        let others = state.selection.targets().iter().copied().filter(|target| Some(*target) != active);
        AfterHang {
            told: String::new(),
            journal: scene.journal_path().filter(|_| needs_journal).map(Path::to_owned),
            opened,
            shaders: session.shader_folder(),
            held: Vec::new(),
            config: self.config(),
            selection: others.chain(active).collect(),
            primitive: state.selection.primitive(session.document()).map(|primitive| primitive.index),
            camera: *session.camera(),
            distance_m: state.view.distance_m,
            settings: session.settings().clone(),
            time_s: session.time(),
            typed: state.shaders.unsaved(),
            shown_shader: state.shaders.shown.clone(),
        }
    }

    /// Goes on as the process before, and says what happened.
    pub(super) fn go_on_after_hang(&mut self, mut after: AfterHang) {
        let told = std::mem::take(&mut after.told);
        tracing::error!("{told}");
        self.state.toasts.error(told);
        if let Some(folder) = self.session.shader_folder() {
            let shown = after.shown_shader.take().or_else(|| Some(after.held.first()?.file.clone()));
            // What stays as it is was put back already, from a file that is newer.
            self.state.shaders.put_back(&folder, std::mem::take(&mut after.typed), shown);
        }
        let (journal, opened) = (after.journal.take(), after.opened.take());
        self.opened.clone_from(&opened);
        self.restoring = Some(Box::new(after));
        let left = journal.map(|journal| {
            let (left_behind, _) = recovery::survey();
            left_behind.into_iter().find(|left| left.path() == journal)
        });
        match (left, opened) {
            (Some(Some(left)), _) => self.start_recovering(left),
            // The journal of a process that is still ending: asked about as soon as that is over.
            (Some(None), _) => self.ask_about_left_behind(),
            (None, Some(path)) => self.load(Purpose::Open, path),
            (None, None) => {
                self.restore();
            }
        }
    }

    /// The scene is back: so are selection and view. False: none of it was asked for.
    pub(super) fn restore(&mut self) -> bool {
        let Some(after) = self.restoring.take() else { return false };
        self.session.set_settings(after.settings);
        self.session.set_time(after.time_s);
        self.session.set_camera(after.camera);
        self.measure_scene();
        self.state.view.distance_m = after.distance_m;
        let document = self.session.document();
        let selection = &mut self.state.selection;
        selection.set_all(after.selection);
        selection.retain_in(document);
        selection.set_primitive(document, after.primitive);
        if let Some(active) = selection.active() {
            self.state.outliner.reveal(document, active);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;
    use crate::ui_state::{Tab, default_layout};

    #[test]
    fn it_is_read_once_with_panels_that_were_never_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("after-hang.json");
        let mut layout = default_layout();
        layout.retain_tabs(|tab| *tab != Tab::Log);
        let config = Config { layout: Some(layout), dark: false, ..Config::default() };
        let selection =
            vec![Target::part(caustica_scene::NodeId(3), 1), Target::node(caustica_scene::NodeId(2))];
        let after =
            AfterHang { config, selection: selection.clone(), time_s: Some(0.5), ..AfterHang::default() };
        std::fs::write(&path, serde_json::to_string(&after).unwrap()).unwrap();
        let again = AfterHang::take(&path).unwrap();
        assert_eq!((again.selection, again.time_s, again.camera), (selection, Some(0.5), after.camera));
        let layout = again.config.layout.unwrap();
        assert!(!again.config.dark && layout.find_tab(&Tab::Log).is_none());
        assert!(AfterHang::take(&path).is_none());
    }
}
