//! Texts of shaders that are open in the window: what was typed, what is on the disk. Enters: a folder. Leaves: saved files.
//! A text that was not saved stays until it is saved or taken back, whatever else is opened.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use caustica_renderer::shader::ShaderSources;

use crate::whole_file::{self, beside};

/// How often the files are looked at whose texts are open.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// One text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Text {
    now: String,
    saved: String,
}

/// The open texts.
#[derive(Clone, Debug, Default)]
pub struct ShaderTexts {
    open: BTreeMap<String, Text>,
    /// The one that is shown.
    pub shown: Option<String>,
    /// Put the cursor here next: line and column, from 1.
    pub go_to: Option<[u32; 2]>,
    /// Whether the text was typed in in the last frame: Ctrl+S is about it.
    pub has_focus: bool,
    /// The text gets the keyboard, as after a button above it, so that Ctrl+Z is about the text.
    pub wants_focus: bool,
    /// When the files were looked at last.
    looked: Option<Instant>,
}

impl ShaderTexts {
    /// Shows a file, with the cursor at a line and column.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn show(&mut self, folder: &Path, file: &str, place: Option<[u32; 2]>) -> Result<(), String> {
        if !self.open.contains_key(file) {
            let saved = read(folder, file)?;
            self.open.insert(file.to_owned(), Text { now: saved.clone(), saved });
        }
        self.shown = Some(file.to_owned());
        self.go_to = place;
        Ok(())
    }

    /// The text that is shown, to be typed in.
    pub fn text_mut(&mut self) -> Option<&mut String> {
        self.open.get_mut(self.shown.as_deref()?).map(|text| &mut text.now)
    }

    /// Whether a file was changed here and not saved.
    pub fn is_modified(&self, file: &str) -> bool {
        self.open.get(file).is_some_and(|text| text.now != text.saved)
    }

    /// Files that were changed here and not saved.
    pub fn modified(&self) -> Vec<&str> {
        self.open.keys().map(String::as_str).filter(|file| self.is_modified(file)).collect()
    }

    /// Texts that were changed here and not saved, by file.
    pub fn unsaved(&self) -> BTreeMap<String, String> {
        let modified = self.open.iter().filter(|(_, text)| text.now != text.saved);
        modified.map(|(file, text)| (file.clone(), text.now.clone())).collect()
    }

    /// Opens the texts again that another process had not saved, and the file that it showed. Gives the files that stay as they
    /// are, as another text was typed in them here.
    pub fn put_back(
        &mut self,
        folder: &Path,
        unsaved: BTreeMap<String, String>,
        shown: Option<String>,
    ) -> Vec<String> {
        let mut other = Vec::new();
        for (file, now) in unsaved {
            if self.open.get(&file).is_some_and(|text| text.now != text.saved && text.now != now) {
                other.push(file);
                continue;
            }
            let saved = read(folder, &file).unwrap_or_default();
            self.open.insert(file, Text { now, saved });
        }
        if let Some(Err(error)) = shown.map(|file| self.show(folder, &file, None)) {
            tracing::debug!("{error}");
        }
        other
    }

    /// Saves the text that is shown. What another program has saved meanwhile is kept beside it, and the log says where.
    ///
    /// # Errors
    /// When the file cannot be written, or is write-protected; the text stays here.
    pub fn save(&mut self, folder: &Path) -> Result<(), String> {
        let Some((file, text)) = self.shown.as_ref().and_then(|file| Some((file, self.open.get_mut(file)?)))
        else {
            return Ok(());
        };
        let path = folder.join(file);
        let cannot = |error: std::io::Error| format!("{} cannot be saved: {error}", path.display());
        if let Ok(theirs) = read(folder, file)
            && theirs != text.saved
            && theirs != text.now
        {
            let kept = keep_beside(&path, &theirs).map_err(cannot)?;
            tracing::warn!(
                "another program has saved {file} since it was shown here; what it saved is kept as {}",
                kept.display()
            );
        }
        replace(&path, &text.now).map_err(cannot)?;
        text.saved.clone_from(&text.now);
        Ok(())
    }

    /// Goes back to what is on the disk.
    pub fn revert(&mut self) {
        if let Some(text) = self.shown.as_ref().and_then(|file| self.open.get_mut(file)) {
            text.now.clone_from(&text.saved);
        }
    }

    /// Whether the text that is shown differs from the one in the binary, which is there.
    pub fn differs_from_built_in(&self) -> bool {
        let shown = self.shown.as_ref().and_then(|file| Some((self.open.get(file)?, built_in(file)?)));
        shown.is_some_and(|(text, built_in)| text.now != built_in)
    }

    /// Puts the text of the binary in the place of the one that is shown, and saves it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn restore_built_in(&mut self, folder: &Path) -> Result<(), String> {
        let Some(text) = self.shown.as_deref().and_then(built_in) else { return Ok(()) };
        if let Some(now) = self.text_mut() {
            *now = text;
        }
        self.save(folder)
    }

    /// Takes over what other programs have saved, where nothing was typed here; looks twice a second.
    pub fn follow(&mut self, folder: &Path) {
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK_EVERY) {
            return;
        }
        self.looked = Some(Instant::now());
        for (file, text) in self.open.iter_mut().filter(|(_, text)| text.now == text.saved) {
            let Ok(saved) = read(folder, file) else { continue };
            text.now.clone_from(&saved);
            text.saved = saved;
        }
    }
}

/// Writes a text under a name that nothing has yet.
fn keep_beside(path: &Path, text: &str) -> std::io::Result<PathBuf> {
    let free = (1..).map(|number| beside(path, &format!(".other-{number}"))).find(|path| !path.exists());
    let free = free.unwrap_or_else(|| beside(path, ".other"));
    std::fs::write(&free, text)?;
    Ok(free)
}

/// Puts a text in the place of a file; who watches the folder never sees half of it.
fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    let permissions = std::fs::metadata(path).ok().map(|before| before.permissions());
    if permissions.as_ref().is_some_and(std::fs::Permissions::readonly) {
        return Err(std::io::Error::new(std::io::ErrorKind::PermissionDenied, "it is write-protected"));
    }
    whole_file::replace(path, |new| {
        std::fs::write(new, text)?;
        permissions.map_or(Ok(()), |permissions| std::fs::set_permissions(new, permissions))
    })
}

fn read(folder: &Path, file: &str) -> Result<String, String> {
    ShaderSources::new(Some(folder.to_owned())).read(file).map_err(|error| error.to_string())
}

fn built_in(file: &str) -> Option<String> {
    ShaderSources::default().read(file).ok()
}

/// Writes every shader of the binary into a folder; files that are there stay.
///
/// # Errors
/// When a file cannot be written.
pub fn write_built_in(folder: &Path) -> Result<(), String> {
    for file in ShaderSources::built_in_files() {
        let path = folder.join(&file);
        let Some(text) = built_in(&file).filter(|_| !path.exists()) else { continue };
        let written = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        let written = written.and_then(|()| std::fs::write(&path, text));
        written.map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_kept_until_it_is_saved() {
        let folder = tempfile::tempdir().unwrap();
        write_built_in(folder.path()).unwrap();
        let (file, other) = ("lib/fresnel.glsl", "passes/post/post.comp");
        let mut texts = ShaderTexts::default();
        texts.show(folder.path(), file, Some([3, 1])).unwrap();
        assert!(!texts.differs_from_built_in() && texts.modified().is_empty());
        texts.text_mut().unwrap().push_str("// mine\n");
        texts.show(folder.path(), other, None).unwrap();
        assert_eq!(texts.modified(), [file]);
        // Somebody else saves: what was typed here stays, what was not touched follows.
        let change = |file: &str| std::fs::write(folder.path().join(file), "// theirs\n").unwrap();
        change(file);
        change(other);
        texts.follow(folder.path());
        assert_eq!(texts.text_mut().unwrap(), "// theirs\n");
        texts.show(folder.path(), file, None).unwrap();
        assert!(texts.text_mut().unwrap().ends_with("// mine\n"));
        let mut again = ShaderTexts::default();
        texts.show(folder.path(), file, None).unwrap();
        assert!(again.put_back(folder.path(), texts.unsaved(), Some(file.to_owned())).is_empty());
        let other = BTreeMap::from([(file.to_owned(), "of a third one".to_owned())]);
        assert_eq!(again.put_back(folder.path(), other, None), [file], "what was typed stays");
        assert_eq!(again.modified(), [file]);
        assert_eq!(again.text_mut(), texts.text_mut());
        texts.save(folder.path()).unwrap();
        assert!(texts.modified().is_empty() && texts.differs_from_built_in());
        assert!(read(folder.path(), file).unwrap().ends_with("// mine\n"));
        let kept = std::fs::read_to_string(folder.path().join("lib/fresnel.glsl.other-1")).unwrap();
        assert_eq!(kept, "// theirs\n", "nothing of another program is lost");
        texts.restore_built_in(folder.path()).unwrap();
        assert_eq!(read(folder.path(), file).unwrap(), built_in(file).unwrap());
        assert!(texts.show(folder.path(), "no/such.glsl", None).is_err());
    }
}
