//! What the audit found: how bad it is, what it is about, and the words. In: a subject. Out: its kind and id, and text without
//! control characters.

use std::fmt;

use crate::ids::{MaterialId, MeshId, PrefabId, Target, TextureId};
use crate::import::{plain, short};

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Info,
    /// It will look wrong or cost precision.
    Warning,
    /// It cannot be rendered and is left out.
    Error,
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Subject {
    /// A node or part.
    Target(Target),
    /// A prefab.
    Prefab(PrefabId),
    /// A mesh.
    Mesh(MeshId),
    /// A material.
    Material(MaterialId),
    /// A texture.
    Texture(TextureId),
    /// The scene as a whole.
    Scene,
}

impl Subject {
    /// What kind of thing it is, and its id: of a part that of its instance, of the scene 0.
    pub fn kind_and_id(self) -> (&'static str, u64) {
        match self {
            Self::Target(target) => ("node", target.node.0),
            Self::Prefab(id) => ("prefab", id.0),
            Self::Mesh(id) => ("mesh", id.0),
            Self::Material(id) => ("material", id.0),
            Self::Texture(id) => ("texture", id.0),
            Self::Scene => ("scene", 0),
        }
    }
}

/// One result of the audit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// What it is about.
    pub subject: Subject,
    /// Name of the subject, to show.
    pub name: String,
    /// In words, with what to do where that is not plain.
    pub message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Info => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        f.write_str(&plain(&format!("{severity}: {}: {}", short(&self.name), self.message)))
    }
}

impl Finding {
    /// What it is about, by name or else by number, and the message: `node "Chair": ...`.
    pub fn about(&self) -> String {
        let (kind, id) = self.subject.kind_and_id();
        let bare = self.name == kind || self.name == format!("{kind} {id}");
        let subject = if bare { self.name.clone() } else { format!("{kind} \"{}\"", short(&self.name)) };
        plain(&format!("{subject}: {}", self.message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::NodeId;

    #[test]
    fn the_subject_is_named_or_numbered() {
        let about = |subject, name: &str| {
            let (name, message) = (name.to_owned(), "it is flat".to_owned());
            Finding { severity: Severity::Error, subject, name, message }.about()
        };
        let node = Subject::Target(Target::node(NodeId(7)));
        assert_eq!(about(node, "Chair\u{1b}[2J"), "node \"Chair\\u{1b}[2J\": it is flat");
        assert_eq!(about(node, "node 7"), "node 7: it is flat");
        assert!(about(node, &"x".repeat(100_000)).len() < 120, "a long name is cut");
        assert_eq!(about(Subject::Material(MaterialId(2)), "Red"), "material \"Red\": it is flat");
        assert_eq!(about(Subject::Scene, "scene"), "scene: it is flat");
    }
}
