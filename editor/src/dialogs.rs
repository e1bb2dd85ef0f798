//! Asking for a file name: the desktop's own dialog by its portal, on a worker, or an own dialog where no portal
//! answers. Enters: what is wanted. Leaves: a path, once. It opens and writes no file.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use caustica_scene::PrefabId;
use egui_file_dialog::{DialogState, FileDialog};

use crate::worker::{Answer, Job, Wake};

/// A portal that answers "nothing chosen" faster than this was never shown to the user.
const NOT_SHOWN: Duration = Duration::from_millis(500);

/// Endings of models.
pub const MODEL_ENDINGS: [&str; 3] = ["gltf", "glb", "obj"];
/// Endings of text files of spheres and boxes.
pub const SHAPE_ENDINGS: [&str; 3] = ["xyz", "csv", "txt"];
/// Endings of environment images.
pub const ENVIRONMENT_ENDINGS: [&str; 2] = ["hdr", "exr"];
/// Endings of what can be exported; the first where none was typed.
pub const EXPORT_ENDINGS: [&str; 2] = ["glb", "gltf"];
/// Ending of projects.
pub const PROJECT_ENDING: &str = "caustica.json";

/// What a file name is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// A project or model to open as a new scene.
    Open,
    /// A model, a project, or spheres and boxes, to add to the scene.
    Import,
    /// A model in the place of a prefab's source.
    Source(PrefabId),
    /// An image to surround the scene.
    Environment,
    /// A picture to compare with.
    Reference,
    /// Where to write the project.
    SaveAs,
    /// Where to write the scene as glTF.
    Export,
}

impl Wish {
    fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a scene",
            Self::Import => "Import into the scene",
            Self::Source(_) => "Choose another source",
            Self::Environment => "Choose an environment image",
            Self::Reference => "Choose a picture to compare with",
            Self::SaveAs => "Save the project as",
            Self::Export => "Export the scene as glTF",
        }
    }

    fn filter(self) -> (&'static str, Vec<&'static str>) {
        match self {
            Self::Open => ("Scenes", [&["json"][..], &MODEL_ENDINGS, &SHAPE_ENDINGS].concat()),
            Self::Import => ("Models", [&MODEL_ENDINGS[..], &SHAPE_ENDINGS, &["json"]].concat()),
            Self::Source(_) => ("Models", MODEL_ENDINGS.to_vec()),
            Self::Environment => ("Environments", ENVIRONMENT_ENDINGS.to_vec()),
            Self::Reference => ("Pictures", vec!["exr"]),
            Self::SaveAs => ("Caustica projects", vec!["json"]),
            Self::Export => ("glTF", EXPORT_ENDINGS.to_vec()),
        }
    }
}

enum Shown {
    Portal {
        wish: Wish,
        since: Instant,
        job: Job<Option<PathBuf>>,
        folder: Option<PathBuf>,
        file_name: String,
    },
    Own {
        wish: Wish,
        dialog: Box<FileDialog>,
    },
}

/// What was chosen in a dialog.
pub struct Chosen {
    /// What for.
    pub wish: Wish,
    /// The file.
    pub path: PathBuf,
    /// It has another name than was typed and confirmed, and is there already.
    pub replaces_unasked: bool,
}

impl Chosen {
    fn new(wish: Wish, typed: PathBuf) -> Self {
        let path = with_ending(wish, typed.clone());
        let replaces_unasked = path != typed && path.exists();
        Self { wish, path, replaces_unasked }
    }
}

/// The one file dialog that may be open.
#[derive(Default)]
pub struct Dialogs {
    shown: Option<Shown>,
    /// The portal did not answer before: it is not asked again.
    no_portal: bool,
}

impl Dialogs {
    /// Whether a dialog is open.
    pub fn is_open(&self) -> bool {
        self.shown.is_some()
    }

    /// Opens a dialog in `folder`, with `file_name` filled in when saving. Nothing happens while one is open.
    pub fn ask(&mut self, wish: Wish, folder: Option<&Path>, file_name: &str, wake: &Wake) {
        if self.is_open() {
            return;
        }
        let folder = folder.map(Path::to_path_buf).or_else(|| std::env::current_dir().ok());
        if !self.no_portal {
            let (asked_folder, asked_name) = (folder.clone(), file_name.to_owned());
            let started = Job::start("file dialog", wake.clone(), move |_| {
                ask_portal(wish, asked_folder.as_deref(), &asked_name)
            });
            if let Ok(job) = started {
                let (since, file_name) = (Instant::now(), file_name.to_owned());
                self.shown = Some(Shown::Portal { wish, since, job, folder, file_name });
                return;
            }
        }
        self.shown =
            Some(Shown::Own { wish, dialog: Box::new(own_dialog(wish, folder.as_deref(), file_name)) });
    }

    /// Draws the own dialog and asks the portal; gives the chosen path once.
    pub fn update(&mut self, context: &egui::Context) -> Option<Chosen> {
        match self.shown.take()? {
            Shown::Portal { wish, since, job, folder, file_name } => match job.poll() {
                Answer::Running => {
                    self.shown = Some(Shown::Portal { wish, since, job, folder, file_name });
                    None
                }
                Answer::Done(Some(path)) => Some(Chosen::new(wish, path)),
                Answer::Done(None) if since.elapsed() > NOT_SHOWN => None,
                Answer::Done(None) | Answer::Died => {
                    self.no_portal = true;
                    let dialog = Box::new(own_dialog(wish, folder.as_deref(), &file_name));
                    self.shown = Some(Shown::Own { wish, dialog });
                    context.request_repaint();
                    None
                }
            },
            Shown::Own { wish, mut dialog } => {
                dialog.update(context);
                match dialog.state() {
                    DialogState::Open => {
                        self.shown = Some(Shown::Own { wish, dialog });
                        None
                    }
                    DialogState::Picked(path) => Some(Chosen::new(wish, path.clone())),
                    _ => None,
                }
            }
        }
    }
}

fn ask_portal(wish: Wish, folder: Option<&Path>, file_name: &str) -> Option<PathBuf> {
    let (name, endings) = wish.filter();
    let mut dialog = rfd::FileDialog::new().set_title(wish.title()).add_filter(name, &endings);
    if let Some(folder) = folder {
        dialog = dialog.set_directory(folder);
    }
    match wish {
        Wish::SaveAs | Wish::Export => dialog.set_file_name(file_name).save_file(),
        _ => dialog.pick_file(),
    }
}

fn own_dialog(wish: Wish, folder: Option<&Path>, file_name: &str) -> FileDialog {
    let (name, endings) = wish.filter();
    let mut dialog = FileDialog::new()
        .title(wish.title())
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .default_size([760.0, 460.0])
        .add_file_filter_extensions(name, endings)
        .default_file_filter(name)
        .default_file_name(file_name);
    if let Some(folder) = folder {
        dialog = dialog.initial_directory(folder.to_path_buf());
    }
    match wish {
        Wish::SaveAs | Wish::Export => dialog.save_file(),
        _ => dialog.pick_file(),
    }
    dialog
}

/// What is written has a name that ends as its kind does, whatever was typed.
fn with_ending(wish: Wish, path: PathBuf) -> PathBuf {
    if wish == Wish::Export && caustica_scene::ExportFormat::of(&path).is_none() {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}", EXPORT_ENDINGS[0]));
        return path.with_file_name(name);
    }
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if wish != Wish::SaveAs || name.to_lowercase().ends_with(".caustica.json") {
        return path;
    }
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    path.with_file_name(format!("{stem}.{PROJECT_ENDING}"))
}

#[cfg(test)]
#[expect(clippy::expect_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn projects_get_their_ending_and_models_keep_theirs() {
        let named = |wish, name: &str| with_ending(wish, PathBuf::from("/a").join(name));
        assert_eq!(named(Wish::SaveAs, "room"), PathBuf::from("/a/room.caustica.json"));
        assert_eq!(named(Wish::SaveAs, "room.json"), PathBuf::from("/a/room.caustica.json"));
        assert_eq!(named(Wish::SaveAs, "room.caustica.json"), PathBuf::from("/a/room.caustica.json"));
        assert_eq!(named(Wish::Export, "room.v2"), PathBuf::from("/a/room.v2.glb"));
        assert_eq!(named(Wish::Export, "room.GLTF"), PathBuf::from("/a/room.GLTF"));
        assert_eq!(named(Wish::Open, "room.glb"), PathBuf::from("/a/room.glb"));
    }

    #[test]
    fn a_name_that_was_completed_does_not_replace_a_file_unasked() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("room.caustica.json"), "").expect("a file");
        let replaces = |name: &str| Chosen::new(Wish::SaveAs, folder.path().join(name)).replaces_unasked;
        let found = ["room", "room.json", "hall", "room.caustica.json"].map(replaces);
        // The dialog asks about the last one by itself.
        assert_eq!(found, [true, true, false, false]);
    }
}
