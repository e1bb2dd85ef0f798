//! The scene model of Caustica: documents, edits, import, projects.
//! In: files and edits. Out: a [`Document`] with double-precision transforms and a [`ChangeSet`] of what changed.
//! It knows no window and no device, and it does not know the renderer.

mod alike;
mod animation;
mod assets;
mod audit;
mod changes;
mod deep;
mod document;
mod edit;
mod export;
mod foreign;
mod ids;
pub mod import;
mod node;
mod package;
mod prefab;
mod project;
mod transform;

pub use animation::{Animation, Channel, ChannelPath, ClipChoice, Interpolation, Property, Sample};
pub use assets::{
    AlphaMode, Anisotropy, Camera, Clearcoat, Cloud, DeformPose, DiffuseTransmission, Distribution,
    Environment, EnvironmentFile, Iridescence, Light, LightKind, MAX_RADIANCE, MOST_SHAPES, Material, Mesh,
    MeshData, MorphTarget, Primitive, Projection, RadianceMap, Sampler, ShadingMode, Shape, ShapeFault,
    ShapeFile, ShapeKind, ShapeSource, Shapes, Sheen, SkinData, SpecularGlossiness, Texture, TextureUse,
    Wrap,
};
pub use audit::{Finding, Severity, Subject, audit};
pub use changes::{ChangeSet, Content};
pub use document::{Copies, Document, Driven, Placed, Renderable};
pub use edit::{Edit, EditError, OverrideField};
pub use export::{ExportError, ExportFormat, Exported, export, export_with_progress};
pub use ids::{MaterialId, MeshId, NodeId, PrefabId, Target, TextureId};
pub use node::{Node, NodeKind, RayVisibility, Subtree};
pub use package::{MaterialEntry, PrefabPackage};
pub use prefab::{PartNode, PartOrderError, PartOverride, PartPath, Prefab, Skin, SourceScene};
pub use project::{
    Fingerprint, HeldJournal, Journal, JournalError, LeftBehind, Project, ProjectError, ProjectMeta,
    ProjectProblem, Recovered, RecoveredStep, SCHEMA_VERSION, keep_if_changed,
};
pub use transform::{Local, Trs, drawable, is_degenerate, is_flat, rigid};
