//! `caustica render --watch`: renders again when shaders or the scene change. Enters: a session with its first picture, hints that
//! shaders changed. Leaves: pictures and what is wrong, until the program is ended.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};

use super::{RenderArgs, open};
use crate::session::Session;

/// How often the files of the scene are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// A program may write a file in several steps: so long must it have stayed as it is.
const QUIET: Duration = Duration::from_millis(100);

/// Follows shaders and scene. `woken`: there may be shaders to take over. Comes back only with an error that no edit can mend.
pub(super) fn follow(
    session: &mut Session,
    args: &RenderArgs,
    woken: &Receiver<()>,
    mut picture: impl FnMut(&mut Session, Duration) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let shaders = session.shader_folder();
    let shaders = shaders.map_or_else(|| String::from("no shaders"), |folder| folder.display().to_string());
    eprintln!("watching {} and {shaders} (end with Ctrl+C)", args.shot.file.display());
    let mut files = Files::of(session, &args.shot.file);
    let (mut had_faults, mut is_open) = (false, true);
    loop {
        match woken.recv_timeout(LOOK_EVERY) {
            Ok(()) | Err(RecvTimeoutError::Timeout) => {}
            // No shaders are followed.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK_EVERY),
        }
        let mut is_due = session.take_over_shaders();
        let has_faults = !session.shader_status().faults.is_empty();
        if has_faults && !had_faults {
            eprintln!("the last picture stays until the shaders are mended");
        } else if had_faults && !has_faults && !is_due {
            eprintln!("the shaders are mended; the picture is theirs");
        }
        had_faults = has_faults;
        let start = Instant::now();
        if files.have_changed() {
            let opened = args.shot.load(&|_, _| {}).and_then(|loaded| open(session, args, loaded));
            is_open = opened.is_ok();
            is_due |= is_open;
            if let Err(error) = opened {
                eprintln!("error: {error:#}; the last picture stays");
            }
            files = Files::of(session, &args.shot.file);
        }
        match (is_due, is_open) {
            (true, true) => picture(session, start.elapsed())?,
            (true, false) => eprintln!("the shaders are taken over; the picture waits for the scene"),
            (false, _) => {}
        }
    }
}

/// When a file was changed, and its length; `None`: it is not there.
type Stamp = Option<(SystemTime, u64)>;

/// The files of a scene as they were when it was read.
struct Files(BTreeMap<PathBuf, Stamp>);

impl Files {
    fn of(session: &Session, file: &Path) -> Self {
        let all = session.document().sources().chain([file.to_owned()]);
        Self(all.map(|file| (file.clone(), stamp(&file))).filter(|(_, stamp)| stamp.is_some()).collect())
    }

    /// Whether one is another one than it was, and complete.
    fn have_changed(&self) -> bool {
        // One that is gone comes back when its program has written it.
        let is_another = |(file, before): (&PathBuf, &Stamp)| {
            let now = stamp(file);
            now.is_some() && now != *before
        };
        self.0.iter().any(is_another) && self.are_quiet()
    }

    fn are_quiet(&self) -> bool {
        let all = || self.0.keys().map(|file| stamp(file)).collect::<Vec<_>>();
        let before = all();
        std::thread::sleep(QUIET);
        before == all()
    }
}

fn stamp(file: &Path) -> Stamp {
    let about = std::fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}
