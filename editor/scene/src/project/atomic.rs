//! Replaces a file in one step: a reader sees the old or the new one, never a part.
//! In: a path and bytes. Out: the file, and the one before as `<name>.bak`.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::import::leads_out;

/// Writes to a temporary file in the same folder, makes it durable and renames it into place.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = behind_links(path)?;
    let before = fs::metadata(&path).ok();
    if let Some(reason) = before.as_ref().and_then(refusal) {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
    }
    let permissions = before.map(|before| before.permissions());
    let temporary = beside(&path, &format!(".{}.tmp", std::process::id()));
    let written = write_durably(&temporary, bytes, permissions.as_ref())
        .and_then(|()| keep_backup(&path))
        .and_then(|()| fs::rename(&temporary, &path))
        .and_then(|()| sync_folder(&path));
    if written.is_err() {
        // Best effort: the error that counts is the first one.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// A link stays a link: what it points to is replaced. One that leads out of its folder is not followed, since a project
/// from elsewhere may have brought it; nor is it replaced, since its owner may have made it.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if leads_out(path, folder) {
        let reason =
            "is a link that leads out of its folder; open the file itself, or save under another name";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
    }
    Ok(fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()))
}

/// A new file in the place of what a run that was cut off has left there. A link in its place is not followed.
fn create(path: &Path) -> io::Result<File> {
    if let Err(error) = fs::remove_file(path)
        && error.kind() != io::ErrorKind::NotFound
    {
        return Err(error);
    }
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Why a file that is there must not be replaced.
fn refusal(before: &fs::Metadata) -> Option<&'static str> {
    match (before.is_file(), before.permissions().readonly()) {
        (false, _) => Some("is not a file; choose another name"),
        (true, true) => Some("is write-protected; make it writable, or choose another name"),
        (true, false) => None,
    }
}

/// Who may read the file before may read the one in its place, and nobody else.
fn write_durably(path: &Path, bytes: &[u8], permissions: Option<&fs::Permissions>) -> io::Result<()> {
    let mut file = create(path)?;
    if let Some(permissions) = permissions {
        file.set_permissions(permissions.clone())?;
    }
    file.write_all(bytes)?;
    file.sync_all()
}

/// Copies rather than renames, so that at no moment the project is absent.
fn keep_backup(path: &Path) -> io::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let temporary = beside(path, ".bak.tmp");
    let copied = copy_durably(path, &temporary).and_then(|()| fs::rename(&temporary, backup_of(path)));
    if copied.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    copied
}

fn copy_durably(from: &Path, to: &Path) -> io::Result<()> {
    let (mut file, mut copy) = (File::open(from)?, create(to)?);
    copy.set_permissions(file.metadata()?.permissions())?;
    io::copy(&mut file, &mut copy)?;
    copy.sync_all()
}

/// Where the file before the last save is.
pub(super) fn backup_of(path: &Path) -> PathBuf {
    beside(path, ".bak")
}

fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    // Some file systems cannot sync a folder; the rename is done all the same.
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        let _ = folder.sync_all();
    }
    Ok(())
}

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, ToOwned::to_owned);
    name.push(suffix);
    path.with_file_name(name)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn replaces_with_one_backup_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.caustica");
        for text in ["one", "two", "three"] {
            write(&path, text.as_bytes()).unwrap();
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "three");
        let backup = folder.path().join("a.caustica.bak");
        assert_eq!(fs::read_to_string(backup).unwrap(), "two");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_that_were_planted_are_not_followed() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("project");
        fs::create_dir(&folder).unwrap();
        let precious = root.path().join("precious");
        fs::write(&precious, "mine").unwrap();
        let path = folder.join("a.caustica");
        fs::write(&path, "one").unwrap();
        let temporary = format!("a.caustica.{}.tmp", std::process::id());
        for name in [temporary.as_str(), "a.caustica.bak", "a.caustica.bak.tmp"] {
            std::os::unix::fs::symlink(&precious, folder.join(name)).unwrap();
        }
        write(&path, b"two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_to_string(folder.join("a.caustica.bak")).unwrap(), "one");
        std::os::unix::fs::symlink(&precious, folder.join("link.caustica")).unwrap();
        assert!(write(&folder.join("link.caustica"), b"three").unwrap_err().to_string().contains("link"));
        std::os::unix::fs::symlink("a.caustica", folder.join("near.caustica")).unwrap();
        write(&folder.join("near.caustica"), b"four").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "four");
        assert_eq!(fs::read_to_string(&precious).unwrap(), "mine");
    }

    #[cfg(unix)]
    #[test]
    fn who_may_read_and_write_a_file_stays_as_it_was() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.caustica");
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let set_mode = |mode| fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        fs::write(&path, "one").unwrap();
        set_mode(0o600);
        write(&path, b"two").unwrap();
        assert_eq!((mode(&path), mode(&backup_of(&path))), (0o600, 0o600));
        set_mode(0o444);
        assert!(write(&path, b"three").unwrap_err().to_string().contains("write-protected"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(write(&taken, b"x").unwrap_err().to_string().contains("not a file"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("a.caustica");
        assert!(write(&path, b"x").is_err());
        assert!(!path.exists());
    }
}
