//! Tests of the package through its public interface, one file a subject.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

mod animation;
mod animation_pointer;
mod bad_values;
mod changes;
mod common;
mod compressed;
mod compressed_images;
mod copies;
mod core_features;
mod edits;
mod export;
mod export_edits;
mod export_materials;
mod forbidden;
mod gltf_file;
mod hierarchy;
mod import;
mod journal;
mod kept;
mod limits;
mod lobes;
mod locks;
mod obj;
mod odd_files;
mod oracle;
mod projects;
mod projects_moved;
mod projects_sources;
mod projects_values;
mod rig_damage;
mod rig_import;
mod scenes;
mod shapes;
mod speed;
mod transforms;
mod variants;
