//! Undo and redo. Enters: edits that were applied, each with the edit that undoes it. Leaves: steps to apply in turn.
//! Edits of one gesture (a drag) become one step. It applies nothing itself and knows no document.

use std::collections::VecDeque;

use caustica_scene::Edit;

/// Most steps kept; the oldest are forgotten first.
const MOST_STEPS: usize = 1000;

/// One entry of a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What was done, in words, such as "moved Chair".
    pub label: String,
    /// Applying it undoes the step (undo stack) or does it again (redo stack).
    pub edit: Edit,
    /// Which state of the document lies above this step.
    state: u64,
}

/// Undo and redo stacks of one document.
#[derive(Debug, Default)]
pub struct History {
    undo: VecDeque<Step>,
    redo: Vec<Step>,
    /// The newest edit, while later edits of the same gesture may still join its step.
    gesture: Option<Edit>,
    next_state: u64,
    /// State below the oldest step.
    base_state: u64,
    saved_state: Option<u64>,
    structure_revision: u64,
}

impl History {
    /// A history without steps, of a document that was never saved.
    pub fn new() -> Self {
        Self { next_state: 1, saved_state: Some(0), ..Self::default() }
    }

    /// Forgets every step, as when another document is opened. The document counts as saved.
    pub fn clear(&mut self) {
        self.undo.clear();
        self.redo.clear();
        self.gesture = None;
        self.base_state = self.fresh_state();
        self.saved_state = Some(self.base_state);
        self.structure_revision += 1;
    }

    /// Takes in an edit that was applied, and its inverse. An edit that carries on the open gesture joins its step.
    pub fn record(&mut self, label: String, edit: Edit, inverse: Edit) {
        self.redo.clear();
        self.note(&edit);
        let state = self.fresh_state();
        let joins = self.gesture.as_ref().is_some_and(|open| open.same_gesture(&edit));
        match self.undo.back_mut() {
            Some(step) if joins => {
                step.label = label;
                step.state = state;
            }
            _ => self.push_undo(Step { label, edit: inverse, state }),
        }
        // Large edits (an import) never join, so they are not kept twice.
        self.gesture = edit.same_gesture(&edit).then_some(edit);
    }

    /// Ends the open gesture: the next edit starts a new step.
    pub fn end_gesture(&mut self) {
        self.gesture = None;
    }

    /// Whether edits of the same kind would still join the newest step.
    pub fn gesture_is_open(&self) -> bool {
        self.gesture.is_some()
    }

    /// Takes the step of the open gesture out without making it available for redo. The caller applies its edit.
    pub fn cancel_gesture(&mut self) -> Option<Step> {
        self.gesture.take()?;
        let step = self.undo.pop_back()?;
        self.note(&step.edit);
        Some(step)
    }

    /// Takes the newest step. The caller applies its edit and hands what undoes that to [`Self::put_redo`].
    pub fn take_undo(&mut self) -> Option<Step> {
        self.gesture = None;
        self.undo.pop_back()
    }

    /// Takes the step undone last. The caller applies its edit and hands what undoes that to [`Self::put_undo`].
    pub fn take_redo(&mut self) -> Option<Step> {
        self.gesture = None;
        self.redo.pop()
    }

    /// Keeps what does the undone `step` again.
    pub fn put_redo(&mut self, step: &Step, redo: Edit) {
        self.note(&redo);
        self.redo.push(Step { label: step.label.clone(), edit: redo, state: step.state });
    }

    /// Keeps what undoes the redone `step` again.
    pub fn put_undo(&mut self, step: &Step, undo: Edit) {
        self.note(&undo);
        self.push_undo(Step { label: step.label.clone(), edit: undo, state: step.state });
    }

    /// What [`Self::take_undo`] would undo, in words.
    pub fn undo_label(&self) -> Option<&str> {
        self.undo.back().map(|step| step.label.as_str())
    }

    /// What [`Self::take_redo`] would do again, in words.
    pub fn redo_label(&self) -> Option<&str> {
        self.redo.last().map(|step| step.label.as_str())
    }

    /// Number of steps that can be undone.
    pub fn undo_count(&self) -> usize {
        self.undo.len()
    }

    /// Number of steps that can be done again.
    pub fn redo_count(&self) -> usize {
        self.redo.len()
    }

    /// The present state is what the file holds.
    pub fn mark_saved(&mut self) {
        self.gesture = None;
        self.saved_state = Some(self.state());
    }

    /// No file holds the present state, nor any that can be undone to.
    pub fn mark_unsaved(&mut self) {
        self.saved_state = None;
    }

    /// Whether the present state is what the file holds; undoing back to it counts.
    pub fn is_saved(&self) -> bool {
        self.saved_state == Some(self.state())
    }

    /// Grows whenever names, order, parents or the set of nodes may have changed: lists made before are stale.
    pub fn structure_revision(&self) -> u64 {
        self.structure_revision
    }

    /// Names the present state of the document; equal numbers are equal states.
    pub fn state(&self) -> u64 {
        self.undo.back().map_or(self.base_state, |step| step.state)
    }

    fn fresh_state(&mut self) -> u64 {
        let state = self.next_state;
        self.next_state += 1;
        state
    }

    fn push_undo(&mut self, step: Step) {
        self.undo.push_back(step);
        while self.undo.len() > MOST_STEPS {
            if let Some(oldest) = self.undo.pop_front() {
                self.base_state = oldest.state;
            }
        }
    }

    fn note(&mut self, edit: &Edit) {
        if changes_structure(edit) {
            self.structure_revision += 1;
        }
    }
}

/// Whether an edit can change names, order, parents, visibility or the set of nodes.
fn changes_structure(edit: &Edit) -> bool {
    match edit {
        Edit::SetTransform { .. }
        | Edit::SetMaterial { .. }
        | Edit::SetLight { .. }
        | Edit::SetCamera { .. }
        | Edit::SetEnvironment(_)
        | Edit::SetMorphWeights { .. }
        | Edit::SetClip { .. }
        | Edit::SetRayVisibility { .. }
        | Edit::SetPrimitiveTransform { .. }
        | Edit::SetShapes { .. } => false,
        Edit::Batch { edits, .. } => edits.iter().any(changes_structure),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use caustica_scene::{Document, Local, Node, NodeKind, Target, Trs};
    use glam::DVec3;

    use super::*;

    struct Bench {
        document: Document,
        history: History,
        target: Target,
    }

    impl Bench {
        fn new() -> Self {
            let mut document = Document::new();
            let (id, edit) = document.add_edit(Node::new("Chair", NodeKind::Group), None);
            document.apply(edit).unwrap();
            Self { document, history: History::new(), target: Target::node(id) }
        }

        fn push(&mut self, edit: Edit) {
            let label = edit.describe(&self.document);
            let inverse = self.document.apply(edit.clone()).unwrap();
            self.history.record(label, edit, inverse);
        }

        fn move_to(&mut self, x: f64) {
            let local = Local::Trs(Trs::from_translation(DVec3::new(x, 0.0, 0.0)));
            self.push(Edit::SetTransform { target: self.target, local });
        }

        fn x(&self) -> f64 {
            self.document.local(self.target).unwrap().translation().x
        }

        fn undo(&mut self) {
            let step = self.history.take_undo().unwrap();
            let redo = self.document.apply(step.edit.clone()).unwrap();
            self.history.put_redo(&step, redo);
        }

        fn redo(&mut self) {
            let step = self.history.take_redo().unwrap();
            let undo = self.document.apply(step.edit.clone()).unwrap();
            self.history.put_undo(&step, undo);
        }
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut bench = Bench::new();
        for x in 1..=20 {
            bench.move_to(f64::from(x));
        }
        assert_eq!(bench.history.undo_count(), 1);
        assert_eq!(bench.history.undo_label(), Some("moved Chair"));
        bench.undo();
        assert_eq!(bench.x(), 0.0);
        bench.redo();
        assert_eq!(bench.x(), 20.0);
    }

    #[test]
    fn a_new_gesture_and_another_kind_of_edit_start_a_step() {
        let mut bench = Bench::new();
        bench.move_to(1.0);
        bench.history.end_gesture();
        bench.move_to(2.0);
        let target = bench.target;
        bench.push(Edit::SetVisible { target, visible: false });
        bench.move_to(3.0);
        assert_eq!(bench.history.undo_count(), 4);
        bench.undo();
        assert_eq!(bench.x(), 2.0);
    }

    #[test]
    fn an_edit_after_undo_drops_what_was_undone() {
        let mut bench = Bench::new();
        bench.move_to(1.0);
        bench.history.end_gesture();
        bench.move_to(2.0);
        bench.undo();
        bench.move_to(5.0);
        assert_eq!(bench.history.redo_count(), 0);
        assert_eq!(bench.history.undo_count(), 2, "an edit after an undo never joins an older gesture");
        bench.undo();
        assert_eq!(bench.x(), 1.0);
    }

    #[test]
    fn a_cancelled_gesture_leaves_nothing() {
        let mut bench = Bench::new();
        bench.move_to(1.0);
        bench.history.end_gesture();
        bench.move_to(2.0);
        bench.move_to(3.0);
        let step = bench.history.cancel_gesture().unwrap();
        bench.document.apply(step.edit).unwrap();
        assert_eq!(bench.x(), 1.0);
        assert_eq!((bench.history.undo_count(), bench.history.redo_count()), (1, 0));
        assert!(bench.history.cancel_gesture().is_none(), "only an open gesture can be cancelled");
    }

    #[test]
    fn undoing_back_to_the_saved_state_counts_as_saved() {
        let mut bench = Bench::new();
        assert!(bench.history.is_saved());
        bench.move_to(1.0);
        bench.history.mark_saved();
        bench.move_to(2.0);
        assert!(!bench.history.is_saved());
        bench.undo();
        assert!(bench.history.is_saved());
        bench.undo();
        assert!(!bench.history.is_saved());
        bench.redo();
        assert!(bench.history.is_saved());
        bench.move_to(9.0);
        bench.undo();
        assert!(bench.history.is_saved());
    }

    #[test]
    fn the_stack_is_bounded() {
        let mut bench = Bench::new();
        for x in 0..MOST_STEPS + 50 {
            bench.move_to(x as f64 + 1.0);
            bench.history.end_gesture();
        }
        assert_eq!(bench.history.undo_count(), MOST_STEPS);
        for _ in 0..MOST_STEPS {
            bench.undo();
        }
        assert_eq!(bench.x(), 50.0);
        assert!(bench.history.take_undo().is_none());
    }

    #[test]
    fn moving_does_not_make_lists_stale() {
        let mut bench = Bench::new();
        let before = bench.history.structure_revision();
        bench.move_to(1.0);
        assert_eq!(bench.history.structure_revision(), before);
        let target = bench.target;
        bench.push(Edit::Rename { target, name: "Stool".into() });
        assert_ne!(bench.history.structure_revision(), before);
    }
}
