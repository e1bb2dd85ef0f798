//! The rows of the outliner: the tree laid flat, remade only when names, order or open rows changed.
//! Enters: a document, which rows are open, what is searched for. Leaves: a list of which any part can be drawn.

use std::collections::BTreeSet;

use caustica_scene::{Document, Target};

/// One line of the outliner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What it shows.
    pub target: Target,
    /// How far it is indented.
    pub depth: u16,
    /// Whether it can be opened.
    pub has_children: bool,
}

/// What the outliner remembers.
#[derive(Debug, Default)]
pub struct OutlinerState {
    /// What is searched for; empty: everything is shown.
    pub search: String,
    /// A name that is being typed, and whose.
    pub renaming: Option<(Target, String)>,
    /// Scroll to this row.
    pub reveal: Option<Target>,
    /// Where a range selected with Shift begins.
    pub anchor: Option<Target>,
    open: BTreeSet<Target>,
    rows: Vec<Row>,
    /// What the rows were made from.
    made_from: Option<(u64, String)>,
}

impl OutlinerState {
    /// Whether a row is open.
    pub fn is_open(&self, target: Target) -> bool {
        self.open.contains(&target)
    }

    /// Opens or closes a row.
    pub fn set_open(&mut self, target: Target, open: bool) {
        let changed = if open { self.open.insert(target) } else { self.open.remove(&target) };
        if changed {
            self.made_from = None;
        }
    }

    /// Forgets which rows are open, as when another document is opened.
    pub fn reset(&mut self) {
        *self = Self { search: std::mem::take(&mut self.search), ..Self::default() };
    }

    /// Opens everything above a target and scrolls to it.
    pub fn reveal(&mut self, document: &Document, target: Target) {
        let above: Vec<_> =
            std::iter::successors(document.parent_of(target), |&t| document.parent_of(t)).collect();
        for target in above {
            self.set_open(target, true);
        }
        self.reveal = Some(target);
    }

    /// The rows as last made.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Remakes the rows when `revision` (of the document's structure), the search or the open rows changed.
    pub fn update(&mut self, document: &Document, revision: u64) {
        let search = self.search.trim().to_lowercase();
        let key = (revision, search.clone());
        if self.made_from.as_ref() == Some(&key) {
            return;
        }
        self.rows = if search.is_empty() {
            flatten(document, |target| self.open.contains(&target))
        } else {
            let all = flatten(document, |_| true);
            filter(all, |target| document.display_name(target).to_lowercase().contains(&search))
        };
        self.made_from = Some(key);
    }
}

/// The tree in order, without what lies below closed rows. Iterative: a deep tree does not end the program.
fn flatten(document: &Document, is_open: impl Fn(Target) -> bool) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut stack: Vec<(Target, u16)> =
        document.roots().iter().rev().map(|id| (Target::node(*id), 0)).collect();
    while let Some((target, depth)) = stack.pop() {
        let children = document.children_of(target);
        rows.push(Row { target, depth, has_children: !children.is_empty() });
        if is_open(target) {
            stack.extend(children.into_iter().rev().map(|child| (child, depth.saturating_add(1))));
        }
    }
    rows
}

/// Keeps the rows that fit and everything above them.
fn filter(rows: Vec<Row>, fits: impl Fn(Target) -> bool) -> Vec<Row> {
    let mut kept = Vec::new();
    // In reverse order the next row with a smaller depth is the parent.
    let mut parents_below = 0;
    for row in rows.into_iter().rev() {
        if row.depth < parents_below || fits(row.target) {
            parents_below = row.depth;
            kept.push(row);
        }
    }
    kept.reverse();
    kept
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use caustica_scene::{Node, NodeId, NodeKind};

    use super::*;

    fn tree() -> (Document, [NodeId; 5]) {
        let mut document = Document::new();
        let mut add = |name: &str, parent| {
            let (id, edit) = document.add_edit(Node::new(name, NodeKind::Group), parent);
            document.apply(edit).unwrap();
            id
        };
        let room = add("Room", None);
        let table = add("Table", Some(room));
        let cup = add("Cup", Some(table));
        let chair = add("Chair", Some(room));
        let sun = add("Sun", None);
        (document, [room, table, cup, chair, sun])
    }

    fn shown(state: &OutlinerState) -> Vec<(u64, u16)> {
        state.rows().iter().map(|row| (row.target.node.0, row.depth)).collect()
    }

    #[test]
    fn closed_rows_hide_what_is_below() {
        let (document, [room, table, cup, chair, sun]) = tree();
        let mut state = OutlinerState::default();
        state.update(&document, 1);
        assert_eq!(shown(&state), [(room.0, 0), (sun.0, 0)]);
        state.set_open(room.into(), true);
        state.update(&document, 1);
        assert_eq!(shown(&state), [(room.0, 0), (table.0, 1), (chair.0, 1), (sun.0, 0)]);
        state.reveal(&document, cup.into());
        state.update(&document, 1);
        assert_eq!(shown(&state)[2], (cup.0, 2));
    }

    #[test]
    fn a_search_keeps_hits_and_what_is_above_them() {
        let (document, [room, table, cup, ..]) = tree();
        let mut state = OutlinerState { search: " cUp ".into(), ..OutlinerState::default() };
        state.update(&document, 1);
        assert_eq!(shown(&state), [(room.0, 0), (table.0, 1), (cup.0, 2)]);
        state.search = "nothing like it".into();
        state.update(&document, 1);
        assert!(state.rows().is_empty());
    }

    #[test]
    fn rows_are_remade_only_when_something_changed() {
        let (mut document, [room, ..]) = tree();
        let mut state = OutlinerState::default();
        state.update(&document, 1);
        document.apply(caustica_scene::Edit::RemoveNode { node: room }).unwrap();
        state.update(&document, 1);
        assert_eq!(state.rows().len(), 2, "same revision: the old rows stand");
        state.update(&document, 2);
        assert_eq!(state.rows().len(), 1);
    }

    #[test]
    fn a_chain_of_a_hundred_thousand_nodes_is_laid_flat() {
        let mut document = Document::new();
        let mut parent = None;
        let count = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
        for _ in 0..count {
            let (id, edit) = document.add_edit(Node::new("n", NodeKind::Group), parent);
            document.apply(edit).unwrap();
            parent = Some(id);
        }
        assert_eq!(flatten(&document, |_| true).len(), count);
    }
}
