//! A project file to a document: bring it to this version, import the prefabs, lay the edits over them.
//! In: a path. Out: [`Project`]. What is missing becomes a placeholder of the same ids, and a warning.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;
use serde_json::Value;

use super::fault::element;
use super::paths::{Refusal, from_relative, is_foreign, resolve};
use super::record::{
    CameraRecord, EnvironmentRecord, MaterialRecord, MeshRecord, NodeRecord, PrefabRecord, ShapeMeshRecord,
    ShapesRecord, missing_mesh, placeholder,
};
use super::unknown::ProjectFile;
use super::{
    Fingerprint, Project, ProjectMeta, ProjectProblem, SCHEMA_VERSION, fault, held, lists, migrate, sound,
};
use crate::assets::{Environment, EnvironmentFile, Material, Mesh, ShapeFile, ShapeSource};
use crate::document::Document;
use crate::edit::{Edit, EditError};
use crate::ids::{MaterialId, MeshId, Target};
use crate::import::{self, ImportError, ImportOptions, Imported, Warning, short};
use crate::node::{Node, NodeKind, Subtree};
use crate::package::{MaterialEntry, PrefabPackage, package_with_ids};

/// Reads a project.
pub(super) fn load(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Project, ProjectProblem> {
    let bytes = read_file(path)?;
    let loader = Loader::of_file(path, parse(&bytes)?, false, options, progress)?;
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    progress(&name, 1.0);
    Ok(loader.finish(&format!("opened {name}"), Fingerprint::of(&bytes)))
}

/// Refuses folders, devices and pipes: reading them could go on for ever.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, ProjectProblem> {
    match std::fs::metadata(path)?.is_file() {
        true => {
            let bytes = std::fs::read(path)?;
            let pointer = import::refuse_lfs_pointer(&bytes);
            pointer.map_or(Ok(bytes), |reason| Err(ProjectProblem::Broken(reason.to_owned())))
        }
        false => Err(ProjectProblem::Broken("is not a file".to_owned())),
    }
}

/// The text of a project file as this version has it.
pub(super) fn parse(bytes: &[u8]) -> Result<ProjectFile, ProjectProblem> {
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        let reason = "not a valid project: it begins with a byte order mark; save it without one";
        return Err(ProjectProblem::Broken(reason.to_owned()));
    }
    if import::is_utf16(bytes) {
        return Err(ProjectProblem::Broken(format!("not a valid project: it {}", import::UTF16)));
    }
    let value: Value = serde_json::from_slice(bytes)?;
    let version = value.get("caustica").ok_or(ProjectProblem::NotAProject)?;
    let is_none = || ProjectProblem::NoVersion(version.to_string().chars().take(40).collect());
    let found = version.as_u64().filter(|found| *found > 0).ok_or_else(is_none)?;
    if found > SCHEMA_VERSION {
        return Err(ProjectProblem::Newer { found });
    }
    let (value, record) = match found < SCHEMA_VERSION {
        true => {
            let value = migrate::to_newest(found, value);
            (value.clone(), serde_json::from_value(value))
        }
        // From the text again, so that errors name a line too.
        false => (value, serde_json::from_slice(bytes)),
    };
    let record = record.map_err(|error| fault::of_field(&value, bytes, error))?;
    lists::require_room(bytes.len(), &value, &record)?;
    Ok(ProjectFile::new(record, &value)?)
}

/// A document that comes into being, from a project and from what a journal adds to it.
pub(super) struct Loader<'a> {
    path: &'a Path,
    options: ImportOptions,
    pub document: Document,
    pub meta: ProjectMeta,
    pub warnings: Vec<Warning>,
    outside: Vec<PathBuf>,
    own_paths: bool,
    /// Sources that several prefabs have, as they were read.
    shared: HashMap<PathBuf, Option<Result<Imported, ImportError>>>,
}

/// Beyond it a file leaves no room for ids that the document gives out; twice what merging leads to at most.
const MOST_ID: u64 = 2 * crate::document::MOST_MERGED_ID;

impl<'a> Loader<'a> {
    /// The document of a project that stands at `path`. `own_paths`: they are absolute because the program wrote them so.
    pub fn of_file(
        path: &'a Path,
        file: ProjectFile,
        own_paths: bool,
        options: &ImportOptions,
        progress: &dyn Fn(&str, f32),
    ) -> Result<Self, ProjectProblem> {
        let ProjectFile { record, unknown } = file;
        let (last_id, place) = record.largest_id();
        if last_id > MOST_ID {
            return Err(ProjectProblem::Broken(format!("{place}: id {last_id} leaves no room for others")));
        }
        let mut loader = Loader {
            path,
            options: options.clone(),
            document: Document::new(),
            meta: ProjectMeta { view: record.view, render: record.render, ..ProjectMeta::default() },
            warnings: Vec::new(),
            outside: Vec::new(),
            own_paths,
            shared: HashMap::new(),
        };
        loader.meta.kept.unknown = unknown;
        // Before anything new gets an id, so that none in the file is taken.
        loader.document.reserve_ids_up_to(last_id);
        loader.shared = shared_sources(path, &record.prefabs);
        let count = record.prefabs.len().max(1) as f32;
        for (index, prefab) in record.prefabs.into_iter().enumerate() {
            progress(&prefab.name, index as f32 / count);
            loader.add_prefab(&element("prefabs", index, prefab.id.0, &prefab.name), prefab)?;
        }
        loader.shared.clear();
        for (index, mut material) in record.materials.into_iter().enumerate() {
            let place = element("materials", index, material.id.0, &material.value.name);
            loader.warn_all(held::material(&mut material.value, &format!("/materials/{index}/value")));
            loader.add_material(&place, material)?;
        }
        for (index, shapes) in record.shapes.into_iter().enumerate() {
            loader.add_shapes(&element("shapes", index, shapes.id.0, &shapes.mesh.name), shapes)?;
        }
        for (index, mesh) in record.meshes.into_iter().enumerate() {
            loader.move_primitives(&element("meshes", index, mesh.id.0, ""), mesh);
        }
        loader.require_room(&record.nodes)?;
        for (index, mut node) in record.nodes.into_iter().enumerate() {
            loader.warn_all(held::node(&mut node, &format!("/nodes/{index}")));
            loader.add_node(&element("nodes", index, node.id.0, &node.name), node)?;
        }
        loader.set_environment(record.environment)?;
        if let Some(camera) = record.camera {
            loader.choose_camera(camera)?;
        }
        Ok(loader)
    }

    /// What has come into being; `reason` is why all of it is new.
    pub fn finish(mut self, reason: &str, file: Fingerprint) -> Project {
        self.document.mark_all_added(reason);
        let Self { document, meta, warnings, outside, .. } = self;
        Project { document, meta, warnings: import::summed(warnings), outside, file }
    }
}

/// The sources that more than one prefab has.
fn shared_sources(
    path: &Path,
    prefabs: &[PrefabRecord],
) -> HashMap<PathBuf, Option<Result<Imported, ImportError>>> {
    let source = |prefab: &PrefabRecord| match resolve(path, &prefab.source) {
        Ok(source) | Err(Refusal::Outside(source)) => Some(source),
        Err(Refusal::Never(_)) => None,
    };
    let mut seen = HashSet::new();
    let again = prefabs.iter().filter_map(source).filter(|source| !seen.insert(source.clone()));
    again.map(|source| (source, None)).collect()
}

impl Loader<'_> {
    pub fn warn(&mut self, place: String, message: String) {
        self.warnings.push(Warning { file: self.path.to_owned(), place, message });
    }

    fn warn_all(&mut self, said: Vec<(String, String)>) {
        said.into_iter().for_each(|(place, message)| self.warn(place, message));
    }

    /// `place` is what of the file the edit stands for.
    fn apply(&mut self, place: &str, edit: Edit) -> Result<(), ProjectProblem> {
        let broken = |error: EditError| ProjectProblem::Broken(format!("{place}: {error}"));
        self.document.apply(edit).map(|_| ()).map_err(broken)
    }

    /// Asked before the first of the nodes takes memory.
    fn require_room(&self, nodes: &[NodeRecord]) -> Result<(), ProjectProblem> {
        let parts = nodes.iter().map(|node| self.document.parts_of(node.prefab));
        let room = self.document.require_room(nodes.len(), parts.fold(0, usize::saturating_add), 0);
        room.map_err(|error| ProjectProblem::Broken(format!("nodes: {error}")))
    }

    /// Where a path of the project leads, or why it is not followed. Noted when permission could be given.
    fn locate(&mut self, text: &str) -> (PathBuf, Result<(), String>) {
        if is_foreign(text) || (Path::new(text).is_absolute() && !self.own_paths) {
            let kept = &mut self.meta.kept.paths;
            kept.insert(from_relative(self.path, text), text.to_owned());
        }
        match resolve(self.path, text) {
            Ok(path) => (path, Ok(())),
            Err(Refusal::Outside(path)) if self.options.outside_project => (path, Ok(())),
            Err(Refusal::Outside(path)) => {
                let reason = format!(
                    "\"{}\" lies outside of the folder of the project and is not read unasked",
                    short(text)
                );
                self.outside.push(path.clone());
                (path, Err(reason))
            }
            Err(Refusal::Never(reason)) => (from_relative(self.path, text), Err(reason)),
        }
    }

    fn add_prefab(&mut self, place: &str, record: PrefabRecord) -> Result<(), ProjectProblem> {
        let (source, allowed) = self.locate(&record.source);
        let package = match allowed {
            Ok(()) => self.import(placeholder(&record, source)),
            Err(reason) => self.without_source(placeholder(&record, source), reason),
        };
        self.apply(place, Edit::AddPrefab(Box::new(package)))
    }

    /// Imports the source of a placeholder, which stays in its place when the source cannot be read.
    pub fn import(&mut self, placeholder: PrefabPackage) -> PrefabPackage {
        let PrefabPackage { id, prefab, .. } = &placeholder;
        match self.read_source(&prefab.source) {
            Ok(imported) => {
                let mut package = package_with_ids(&mut self.document, *id, imported, Some(prefab));
                package.prefab.name.clone_from(&prefab.name);
                package
            }
            Err(error) => self.without_source(placeholder, error.to_string()),
        }
    }

    /// A source that several prefabs have is read once, and what is wrong with it said once.
    fn read_source(&mut self, source: &Path) -> Result<Imported, ImportError> {
        if let Some(Some(known)) = self.shared.get(source) {
            return known.clone();
        }
        let mut read = import::load(source, &self.options);
        if let Ok(imported) = &mut read {
            self.warnings.append(&mut imported.warnings);
        }
        if let Some(shared) = self.shared.get_mut(source) {
            *shared = Some(read.clone());
        }
        read
    }

    fn without_source(&mut self, placeholder: PrefabPackage, reason: String) -> PrefabPackage {
        let message = format!("{reason}; a placeholder stands in and is kept on save");
        self.warn(format!("prefab {}", placeholder.prefab.name), message);
        placeholder
    }

    /// An edited material of a prefab, or one made in the program.
    fn add_material(&mut self, place: &str, record: MaterialRecord) -> Result<(), ProjectProblem> {
        let MaterialRecord { id, value } = record;
        let value = self.without_lost_textures(place, id, value);
        let edit = if self.document.material(id).is_some() {
            Edit::SetMaterial { material: id, value: Box::new(value) }
        } else {
            if self.document.prefabs().any(|(_, prefab)| prefab.asset_names.gone().any(|gone| gone == id.0)) {
                let message = "was edited, but is not in its source any more; the edit is kept on save";
                self.warn(place.to_owned(), message.to_owned());
            }
            let entry = MaterialEntry::made_here(value);
            Edit::AddMaterial { material: id, entry: Box::new(entry) }
        };
        self.apply(place, edit)
    }

    /// Spheres and boxes are made anew from their description. A file that is missing is kept on save.
    fn add_shapes(&mut self, place: &str, record: ShapesRecord) -> Result<(), ProjectProblem> {
        let ShapesRecord { id, mesh: ShapeMeshRecord { name, source, materials } } = record;
        let source = match source {
            ShapeSource::File(file) => {
                let (path, allowed) = self.locate(&file.path.to_string_lossy());
                ShapeSource::File(self.read_shapes(place, path, allowed))
            }
            other => other,
        };
        let value = Mesh::of_shapes(name, source, &materials)
            .map_err(|fault| ProjectProblem::Broken(format!("{place}: {fault}")))?;
        self.apply(place, Edit::AddMesh { mesh: id, value: Box::new(value) })
    }

    /// The shapes of a file, or none with a warning.
    pub fn read_shapes(&mut self, place: &str, path: PathBuf, allowed: Result<(), String>) -> ShapeFile {
        let read = allowed.and_then(|()| import::load_shapes(&path).map_err(|error| error.to_string()));
        read.unwrap_or_else(|reason| {
            let message = format!("{reason}; nothing stands in its place, and it is kept on save");
            self.warn(place.to_owned(), message);
            ShapeFile { path, shapes: None }
        })
    }

    /// Textures that the source does not have now are kept for the next save, in the slots where they were.
    fn without_lost_textures(&mut self, place: &str, id: MaterialId, mut material: Material) -> Material {
        let mut lost = BTreeMap::new();
        for (slot, used) in material.texture_slots_mut().enumerate() {
            if let Some(gone) = used.filter(|used| self.document.texture(used.texture).is_none()) {
                lost.insert(slot, gone);
                *used = None;
            }
        }
        if !lost.is_empty() {
            let ids: BTreeSet<String> = lost.values().map(|gone| gone.texture.0.to_string()).collect();
            let ids = ids.into_iter().collect::<Vec<_>>().join(", ");
            let message = format!(
                "its textures {ids} are not in the source; it is shown without, and they are kept on save"
            );
            self.warn(place.to_owned(), message);
            self.meta.kept.textures.insert(id, lost);
        }
        material
    }

    /// Moves that do not fit the source are kept for the next save.
    fn move_primitives(&mut self, place: &str, record: MeshRecord) {
        let mut left = BTreeMap::new();
        for (&primitive, columns) in &record.primitives {
            let edit = Edit::SetPrimitiveTransform {
                mesh: record.id,
                primitive,
                mesh_from_primitive: DAffine3::from_cols_array(columns),
            };
            if let Err(error) = self.document.apply(edit) {
                let message =
                    format!("primitive {primitive} was moved, but {error}; the move is kept on save");
                self.warn(place.to_owned(), message);
                left.insert(primitive, *columns);
            }
        }
        if !left.is_empty() {
            self.meta.kept.meshes.insert(record.id, MeshRecord { primitives: left, ..record });
        }
    }

    fn add_node(&mut self, place: &str, mut record: NodeRecord) -> Result<(), ProjectProblem> {
        let broken = |reason: String| Err(ProjectProblem::Broken(format!("{place}: {reason}")));
        if let Some(reason) = sound::refusal(&record) {
            return broken(format!("it {reason}"));
        }
        for repaired in sound::repair_rotations(&mut record) {
            self.warn(place.to_owned(), repaired);
        }
        let (id, node) = record.into_node();
        let parent = node.parent;
        if let Some(parent) = parent.filter(|parent| self.document.node(*parent).is_none()) {
            return broken(format!(
                "its parent, node {}, does not stand before it in the file; parents come first, and no node is below itself",
                parent.0
            ));
        }
        self.stand_in_for_missing(place, &node)?;
        self.apply(place, Edit::AddNode { parent, index: usize::MAX, subtree: Subtree::single(id, node) })
    }

    /// What a node names and the file does not have stays named; nothing stands in its place.
    fn stand_in_for_missing(&mut self, place: &str, node: &Node) -> Result<(), ProjectProblem> {
        let (mesh, materials): (Option<MeshId>, Vec<MaterialId>) = match &node.kind {
            NodeKind::Mesh { mesh, materials, .. } => (Some(*mesh), materials.clone()),
            NodeKind::Prefab { overrides, .. } => {
                (None, overrides.values().flat_map(|own| own.materials.values()).copied().collect())
            }
            NodeKind::Group | NodeKind::Light(_) | NodeKind::Camera(_) => return Ok(()),
        };
        let document = &self.document;
        let mesh = mesh.filter(|mesh| document.mesh(*mesh).is_none());
        let materials = materials.into_iter().filter(|material| document.material(*material).is_none());
        let materials = materials.map(|material| format!("material {}", material.0));
        let missing: Vec<String> =
            mesh.iter().map(|mesh| format!("mesh {}", mesh.0)).chain(materials).collect();
        if !missing.is_empty() {
            let message = format!("{} is not in the file; it stays named on save", missing.join(", "));
            self.warn(place.to_owned(), message);
        }
        match mesh {
            Some(mesh) => self.apply(place, Edit::AddMesh { mesh, value: Box::new(missing_mesh(mesh)) }),
            None => Ok(()),
        }
    }

    fn set_environment(&mut self, record: EnvironmentRecord) -> Result<(), ProjectProblem> {
        let environment = match record {
            EnvironmentRecord::File { path, rotation_rad, scale } => {
                let (path, allowed) = self.locate(&path);
                Environment::File(
                    self.read_map(EnvironmentFile { path, rotation_rad, scale, map: None }, allowed),
                )
            }
            other => other.into(),
        };
        if let Some(reason) = sound::refusal_of_environment(&environment) {
            return Err(ProjectProblem::Broken(reason));
        }
        self.apply("/environment", Edit::SetEnvironment(environment))
    }

    /// Reads the map of an environment, or leaves it without, with a warning.
    pub fn read_map(&mut self, file: EnvironmentFile, allowed: Result<(), String>) -> EnvironmentFile {
        let read =
            allowed.and_then(|()| import::load_environment(&file.path).map_err(|error| error.to_string()));
        match read {
            Ok((map, mut warnings)) => {
                self.warnings.append(&mut warnings);
                EnvironmentFile { map: Some(Arc::new(map)), ..file }
            }
            Err(reason) => {
                let message = format!("{reason}; the surroundings are black, and it is kept on save");
                self.warn("/environment".to_owned(), message);
                file
            }
        }
    }

    fn choose_camera(&mut self, record: CameraRecord) -> Result<(), ProjectProblem> {
        let target = match &record.part {
            None => {
                Some(Target::node(record.node)).filter(|target| self.document.camera_of(*target).is_some())
            }
            Some(path) => self
                .document
                .node(record.node)
                .and_then(Node::prefab)
                .and_then(|id| self.document.prefab(id))
                .and_then(|prefab| prefab.part_at(path))
                .map(|part| Target::part(record.node, part)),
        };
        match target {
            Some(target) => self.apply("/camera", Edit::SetDefaultCamera(Some(target))),
            None => {
                let message = format!(
                    "the chosen camera, of node {}, is not there; it stays chosen on save",
                    record.node.0
                );
                self.warn("/camera".to_owned(), message);
                self.meta.kept.camera = Some(record);
                Ok(())
            }
        }
    }
}
