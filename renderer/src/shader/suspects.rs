//! Shaders that came into use lately, should the device not come back from them. Enters: texts before and after. Leaves: which
//! files are to blame for a pass that did not finish, each with the text before.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// A shader that has been in use for so many frames, and for so long, is not to blame for a pass that it has no part in.
const PROVEN_FRAMES: u64 = 8;
const PROVEN_AFTER: Duration = Duration::from_secs(30);

/// A shader that did not finish. As long as its file holds that text, another one is used in its place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeldShader {
    /// File, relative to the shader folder.
    pub file: String,
    /// Label of the pass that did not finish.
    pub pass: String,
    /// The text that is not used any more.
    pub bad: String,
    /// The text that is used in its place: the one before it.
    pub good: String,
}

/// What became of a file.
#[derive(Clone, Debug)]
struct Change {
    before: String,
    now: String,
}

/// See the head of the file.
#[derive(Debug, Default)]
pub(super) struct Suspects {
    files: BTreeMap<String, Change>,
    /// The main files that were compiled anew for it.
    mains: BTreeSet<String>,
    since_frame: u64,
    since: Option<Instant>,
}

impl Suspects {
    /// A main file is used from the frame of this number on, whose texts are others than before. Older changes are forgotten
    /// once they have been in use for some frames.
    pub(super) fn note(
        &mut self,
        main: &str,
        before: &BTreeMap<String, String>,
        now: &BTreeMap<String, String>,
        frame: u64,
    ) {
        let changed: Vec<_> = before
            .iter()
            .filter_map(|(file, before)| Some((file, before, now.get(file)?)))
            .filter(|(_, before, now)| before != now)
            .collect();
        if changed.is_empty() {
            return;
        }
        if frame >= self.since_frame.saturating_add(PROVEN_FRAMES) {
            *self = Self::default();
        }
        for (file, before, now) in changed {
            let change = Change { before: before.clone(), now: now.clone() };
            self.files.entry(file.clone()).or_insert(change).now.clone_from(now);
        }
        self.files.retain(|_, change| change.before != change.now);
        self.mains.insert(main.to_owned());
        self.since_frame = frame;
        self.since = Some(Instant::now());
    }

    /// Whether there are any that have not proven themselves; `frame`: the one that comes next.
    pub(super) fn are_new(&self, frame: u64) -> bool {
        !self.files.is_empty() && frame < self.since_frame.saturating_add(PROVEN_FRAMES)
    }

    /// What is to blame for a pass that did not finish; `done`: the last frame that did, `waited`: for so long nothing happened.
    pub(super) fn blamed(&self, pass: &str, done: u64, waited: Duration) -> Vec<HeldShader> {
        let is_young = self.since.is_some_and(|since| since.elapsed() < PROVEN_AFTER + waited);
        let is_new = done < self.since_frame.saturating_add(PROVEN_FRAMES);
        let folder = pass.split('.').next().unwrap_or(pass);
        let has_part = |main: &String| {
            main.strip_prefix("passes/").and_then(|rest| rest.split('/').next()) == Some(folder)
        };
        if !(is_young || is_new || self.mains.iter().any(has_part)) {
            return Vec::new();
        }
        let held = |(file, change): (&String, &Change)| HeldShader {
            file: file.clone(),
            pass: pass.to_owned(),
            bad: change.now.clone(),
            good: change.before.clone(),
        };
        self.files.iter().map(held).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
        pairs.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect()
    }

    #[test]
    fn the_text_before_the_first_unproven_change_is_the_good_one() {
        let mut suspects = Suspects::default();
        let main = "passes/post/post.comp";
        suspects.note(
            main,
            &texts(&[(main, "a"), ("lib/x", "1")]),
            &texts(&[(main, "b"), ("lib/x", "1")]),
            10,
        );
        suspects.note(main, &texts(&[(main, "b")]), &texts(&[(main, "c")]), 12);
        let blamed = suspects.blamed("shadow", 11, Duration::ZERO);
        let held = |bad: &str, good: &str, pass: &str| HeldShader {
            file: main.to_owned(),
            pass: pass.to_owned(),
            bad: bad.to_owned(),
            good: good.to_owned(),
        };
        assert_eq!(blamed, [held("c", "a", "shadow")]);
        // It ran for long enough: the next change is measured against it.
        suspects.note(main, &texts(&[(main, "c")]), &texts(&[(main, "d")]), 12 + PROVEN_FRAMES);
        assert_eq!(suspects.blamed("post", 0, Duration::ZERO), [held("d", "c", "post")]);
        // Taken back: nothing is left to blame.
        suspects.note(main, &texts(&[(main, "d")]), &texts(&[(main, "c")]), 21);
        assert!(suspects.blamed("post", 0, Duration::ZERO).is_empty());
    }

    #[test]
    fn a_proven_shader_is_to_blame_for_its_own_pass_alone() {
        let mut suspects = Suspects::default();
        let main = "passes/shadow/shadow.rgen";
        suspects.note(main, &texts(&[(main, "a")]), &texts(&[(main, "b")]), 10);
        suspects.since = Instant::now().checked_sub(PROVEN_AFTER * 2);
        assert!(suspects.blamed("post", 10 + PROVEN_FRAMES, Duration::ZERO).is_empty());
        assert_eq!(suspects.blamed("shadow.trace", 10 + PROVEN_FRAMES, Duration::ZERO).len(), 1);
        assert_eq!(suspects.blamed("post", 9, Duration::ZERO).len(), 1, "it was hardly used");
    }
}
