//! A project file to a document: check the version, import the prefabs, lay the edits over them.
//! In: a path. Out: [`Project`]. What is missing becomes a placeholder of the same ids, and a warning.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;
use serde_json::Value;

use super::paths::from_relative;
use super::record::{
    CameraRecord, EnvironmentRecord, MaterialRecord, MeshRecord, NodeRecord, PrefabRecord, ProjectRecord,
    ShapesRecord,
};
use super::{Project, ProjectMeta, ProjectProblem, SCHEMA_VERSION};
use crate::assets::{Environment, EnvironmentFile, Material, Mesh, MeshData, ShapeFile, ShapeSource};
use crate::document::Document;
use crate::edit::{Edit, EditError};
use crate::ids::Target;
use crate::import::{self, ImportOptions, Warning};
use crate::node::{Node, NodeKind, Subtree};
use crate::package::{MaterialEntry, PrefabPackage, package_with_ids};
use crate::prefab::Prefab;

/// Reads a project.
pub(super) fn load(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Project, ProjectProblem> {
    let record = parse(&std::fs::read(path)?)?;
    let last_id = record.next_id.saturating_sub(1).max(record.largest_id());
    let mut loader = Loader {
        path,
        document: Document::new(),
        meta: ProjectMeta { view: record.view, render: record.render, ..ProjectMeta::default() },
        warnings: Vec::new(),
    };
    loader.meta.kept.top = record.other;
    // Before anything new gets an id, so that none in the file is taken.
    loader.document.reserve_ids_up_to(last_id);
    let count = record.prefabs.len().max(1) as f32;
    for (index, prefab) in record.prefabs.into_iter().enumerate() {
        progress(&prefab.name, index as f32 / count);
        loader.add_prefab(prefab, options)?;
    }
    for material in record.materials {
        loader.add_material(material)?;
    }
    for shapes in record.shapes {
        loader.add_shapes(shapes)?;
    }
    for mesh in record.meshes {
        loader.move_primitives(mesh);
    }
    for node in record.nodes {
        loader.add_node(node)?;
    }
    loader.set_environment(record.environment)?;
    if let Some(camera) = record.camera {
        loader.choose_camera(camera)?;
    }
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    loader.document.mark_all_added(&format!("opened {name}"));
    progress(&name, 1.0);
    Ok(Project { document: loader.document, meta: loader.meta, warnings: loader.warnings })
}

fn parse(bytes: &[u8]) -> Result<ProjectRecord, ProjectProblem> {
    let value: Value = serde_json::from_slice(bytes)?;
    let found = value.get("caustica").and_then(Value::as_u64).ok_or(ProjectProblem::NotAProject)?;
    if found > SCHEMA_VERSION {
        return Err(ProjectProblem::Newer { found });
    }
    // Read from the text again, because errors then name a line.
    Ok(serde_json::from_slice(bytes)?)
}

struct Loader<'a> {
    path: &'a Path,
    document: Document,
    meta: ProjectMeta,
    warnings: Vec<Warning>,
}

fn broken(error: EditError) -> ProjectProblem {
    ProjectProblem::Broken(error.to_string())
}

impl Loader<'_> {
    fn warn(&mut self, place: String, message: String) {
        self.warnings.push(Warning { file: self.path.to_owned(), place, message });
    }

    fn apply(&mut self, edit: Edit) -> Result<(), ProjectProblem> {
        self.document.apply(edit).map(|_| ()).map_err(broken)
    }

    fn add_prefab(&mut self, record: PrefabRecord, options: &ImportOptions) -> Result<(), ProjectProblem> {
        let source = from_relative(self.path, &record.source);
        if !record.other.is_empty() {
            let kept = &mut self.meta.kept.prefabs;
            kept.insert(record.id.0, record.other.clone());
        }
        let mut package = match import::load(&source, options) {
            Ok(mut imported) => {
                self.warnings.append(&mut imported.warnings);
                let ids = (&record.meshes[..], &record.materials[..], &record.textures[..]);
                package_with_ids(&mut self.document, record.id, imported, ids)
            }
            Err(error) => {
                self.warn(
                    format!("prefab {}", record.name),
                    format!("{error}; a placeholder stands in and is kept on save"),
                );
                placeholder(&record, source)
            }
        };
        package.prefab.name = record.name;
        self.apply(Edit::AddPrefab(Box::new(package)))
    }

    /// An edited material of a prefab, or one made in the program.
    fn add_material(&mut self, record: MaterialRecord) -> Result<(), ProjectProblem> {
        let MaterialRecord { id, value, other } = record;
        if !other.is_empty() {
            self.meta.kept.materials.insert(id.0, other);
        }
        let value = self.without_lost_textures(value);
        let edit = if self.document.material(id).is_some() {
            Edit::SetMaterial { material: id, value: Box::new(value) }
        } else {
            let entry = MaterialEntry { value, original: None };
            Edit::AddMaterial { material: id, entry: Box::new(entry) }
        };
        self.apply(edit)
    }

    /// Spheres and boxes are made anew from their description. A file that is missing is kept on save.
    fn add_shapes(&mut self, record: ShapesRecord) -> Result<(), ProjectProblem> {
        let ShapesRecord { id, name, source, materials, other } = record;
        if !other.is_empty() {
            self.meta.kept.shapes.insert(id.0, other);
        }
        let source = match source {
            ShapeSource::File(file) => {
                let path = from_relative(self.path, &file.path.to_string_lossy());
                let read = import::load_shapes(&path).or_else(|error| {
                    self.warn(format!("shapes {name}"), format!("{error}; nothing stands in its place"));
                    Ok::<_, ProjectProblem>(ShapeFile { path, shapes: None })
                });
                ShapeSource::File(read?)
            }
            other => other,
        };
        let problem = |reason: String| ProjectProblem::Broken(format!("shapes {}: {reason}", id.0));
        let value = Mesh::of_shapes(name, source, &materials).map_err(|fault| problem(fault.to_string()))?;
        let edit = Edit::AddMesh { mesh: id, value: Box::new(value) };
        self.document.apply(edit).map(|_| ()).map_err(|error| problem(error.to_string()))
    }

    fn without_lost_textures(&mut self, mut material: Material) -> Material {
        let mut lost = Vec::new();
        for slot in material.texture_slots_mut() {
            let gone = slot.filter(|u| self.document.texture(u.texture).is_none());
            if let Some(gone) = gone {
                lost.push(gone.texture.0.to_string());
                *slot = None;
            }
        }
        if !lost.is_empty() {
            let message =
                format!("its textures {} are no longer in the source and were taken off", lost.join(", "));
            self.warn(format!("material {}", material.name), message);
        }
        material
    }

    /// Moves that no longer fit the source are kept for the next save.
    fn move_primitives(&mut self, record: MeshRecord) {
        for (&primitive, columns) in &record.primitives {
            let edit = Edit::SetPrimitiveTransform {
                mesh: record.id,
                primitive,
                mesh_from_primitive: DAffine3::from_cols_array(columns),
            };
            if let Err(error) = self.document.apply(edit) {
                self.warn(
                    format!("mesh {}", record.id.0),
                    format!("primitive {primitive} was moved, but {error}; the move is kept on save"),
                );
                self.meta.kept.meshes.push(record);
                return;
            }
        }
    }

    fn add_node(&mut self, record: NodeRecord) -> Result<(), ProjectProblem> {
        let id = record.id;
        if !record.other.is_empty() {
            self.meta.kept.nodes.insert(id.0, record.other);
        }
        let kind = match record {
            NodeRecord { prefab: Some(prefab), overrides, clip, variant, .. } => NodeKind::Prefab {
                prefab,
                clip,
                variant,
                overrides: overrides.into_iter().map(|(path, value)| (path, value.into())).collect(),
            },
            NodeRecord { mesh: Some(mesh), materials, weights, .. } => {
                NodeKind::Mesh { mesh, materials, weights }
            }
            NodeRecord { light: Some(light), .. } => NodeKind::Light(light),
            NodeRecord { camera: Some(camera), .. } => NodeKind::Camera(camera),
            _ => NodeKind::Group,
        };
        let node = Node {
            visible: record.visible,
            locked: record.locked,
            ray_visibility: record.ray_visibility,
            local: record.local.into(),
            ..Node::new(record.name, kind)
        };
        let edit =
            Edit::AddNode { parent: record.parent, index: usize::MAX, subtree: Subtree::single(id, node) };
        self.document
            .apply(edit)
            .map(|_| ())
            .map_err(|error| ProjectProblem::Broken(format!("node {}: {error}", id.0)))
    }

    fn set_environment(&mut self, record: EnvironmentRecord) -> Result<(), ProjectProblem> {
        let environment = match record {
            EnvironmentRecord::Auto => Environment::Auto,
            EnvironmentRecord::Sky => Environment::DefaultSky,
            EnvironmentRecord::Constant { radiance } => Environment::Constant(radiance),
            EnvironmentRecord::File { path, rotation_rad, scale } => {
                let path = from_relative(self.path, &path);
                let map = match import::load_environment(&path) {
                    Ok((map, mut warnings)) => {
                        self.warnings.append(&mut warnings);
                        Some(Arc::new(map))
                    }
                    Err(error) => {
                        let message = format!("{error}; the surroundings are black");
                        self.warn("environment".to_owned(), message);
                        None
                    }
                };
                Environment::File(EnvironmentFile { path, rotation_rad, scale, map })
            }
        };
        self.apply(Edit::SetEnvironment(environment))
    }

    fn choose_camera(&mut self, record: CameraRecord) -> Result<(), ProjectProblem> {
        let target = match &record.part {
            None => Some(Target::node(record.node)),
            Some(path) => self
                .document
                .node(record.node)
                .and_then(Node::prefab)
                .and_then(|id| self.document.prefab(id))
                .and_then(|prefab| prefab.part_at(path))
                .map(|part| Target::part(record.node, part)),
        };
        match target {
            Some(target) => self.apply(Edit::SetDefaultCamera(Some(target))),
            None => {
                let message = "the chosen camera is no longer in the source".to_owned();
                self.warn("camera".to_owned(), message);
                self.meta.kept.camera = Some(record);
                Ok(())
            }
        }
    }
}

/// A prefab without parts, with an empty asset behind every id that the project knows.
fn placeholder(record: &PrefabRecord, source: std::path::PathBuf) -> PrefabPackage {
    let mut prefab = Prefab::new(record.name.clone(), source);
    prefab.missing = true;
    prefab.meshes.clone_from(&record.meshes);
    prefab.materials.clone_from(&record.materials);
    prefab.textures.clone_from(&record.textures);
    let named = |id: u64| format!("missing {id}");
    let empty = Arc::new(MeshData::default());
    let mesh = |id: u64| Mesh::new(named(id), Arc::clone(&empty), Vec::new());
    let material = |id: u64| {
        let value = Material { name: named(id), ..Material::default() };
        MaterialEntry { original: Some(value.clone()), value }
    };
    PrefabPackage {
        id: record.id,
        meshes: record.meshes.iter().map(|&id| (id, mesh(id.0))).collect(),
        materials: record.materials.iter().map(|&id| (id, material(id.0))).collect(),
        textures: record.textures.iter().map(|&id| (id, import::placeholder_texture(named(id.0)))).collect(),
        prefab,
    }
}
