//! Notices that something below a folder was saved. Enters: a folder. Leaves: calls, from another thread, with the files that may
//! have changed; none: any may have.
//! Where the system's watcher cannot start, the folder is looked at again and again.

use std::path::{Path, PathBuf};
use std::time::Duration;

use notify::{Config, EventKind, PollWatcher, RecommendedWatcher, RecursiveMode, Watcher};

/// How often a folder is looked at where the system does not tell of changes.
const POLL: Duration = Duration::from_millis(500);

/// How changes are noticed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Watching {
    /// The system tells of them.
    Told,
    /// The files are looked at twice a second, for this reason.
    Polled(String),
    /// Not at all, for this reason.
    Off(String),
}

/// Watches until it is dropped.
pub(super) struct Watch {
    how: Watching,
    _watcher: Option<Box<dyn Watcher + Send + Sync>>,
}

impl Watch {
    pub(super) fn start(folder: &Path, changed: impl Fn(Vec<PathBuf>) + Clone + Send + 'static) -> Self {
        let told = || -> notify::Result<Box<dyn Watcher + Send + Sync>> {
            let mut watcher = RecommendedWatcher::new(handler(changed.clone()), Config::default())?;
            watcher.watch(folder, RecursiveMode::Recursive)?;
            Ok(Box::new(watcher))
        };
        match told() {
            Ok(watcher) => Self { how: Watching::Told, _watcher: Some(watcher) },
            Err(error) => Self::polled(folder, changed, error.to_string()),
        }
    }

    /// `reason`: why the system does not tell.
    fn polled(folder: &Path, changed: impl Fn(Vec<PathBuf>) + Send + 'static, reason: String) -> Self {
        let polled = || -> notify::Result<PollWatcher> {
            let config = Config::default().with_poll_interval(POLL).with_compare_contents(true);
            let mut watcher = PollWatcher::new(handler(changed), config)?;
            watcher.watch(folder, RecursiveMode::Recursive)?;
            Ok(watcher)
        };
        match polled() {
            Ok(watcher) => {
                tracing::warn!("{}: looked at twice a second for changes: {reason}", folder.display());
                Self { how: Watching::Polled(reason), _watcher: Some(Box::new(watcher)) }
            }
            Err(error) => {
                tracing::warn!("{}: changes are not noticed: {error}", folder.display());
                Self { how: Watching::Off(error.to_string()), _watcher: None }
            }
        }
    }

    pub(super) fn how(&self) -> &Watching {
        &self.how
    }
}

/// Passes on what may have changed a file; that a file was read does not.
fn handler(
    changed: impl Fn(Vec<PathBuf>) + Send + 'static,
) -> impl Fn(notify::Result<notify::Event>) + Send + 'static {
    move |event| match event {
        Ok(event) if matches!(event.kind, EventKind::Access(kind) if !writes(kind)) => {}
        Ok(event) => changed(event.paths),
        Err(error) => {
            tracing::warn!("watching the shaders: {error}");
            changed(Vec::new());
        }
    }
}

fn writes(kind: notify::event::AccessKind) -> bool {
    use notify::event::{AccessKind, AccessMode};
    matches!(kind, AccessKind::Close(AccessMode::Write))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn changes_are_noticed_told_or_polled_and_reading_is_none() {
        let patience = Duration::from_secs(60);
        for polled in [false, true] {
            let folder = std::env::temp_dir().join(format!("caustica-watch-{}-{polled}", std::process::id()));
            std::fs::create_dir_all(folder.join("lib")).unwrap();
            let file = folder.join("lib/a.glsl");
            std::fs::write(&file, "1").unwrap();
            let (sender, changes) = channel();
            let changed = move |_| {
                let _ = sender.send(());
            };
            let watch = match polled {
                true => Watch::polled(&folder, changed, "no more of them".to_owned()),
                false => Watch::start(&folder, changed),
            };
            assert_eq!(matches!(watch.how(), Watching::Polled(_)), polled);
            std::fs::read(&file).unwrap();
            assert!(changes.recv_timeout(POLL * 2).is_err(), "nothing was written");
            std::fs::write(&file, "2").unwrap();
            changes.recv_timeout(patience).unwrap();
            std::fs::remove_dir_all(&folder).unwrap();
        }
    }
}
