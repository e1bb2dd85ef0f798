//! What a session opens and imports. Enters: a path. Leaves: a document, or an edit that brings a model in.
//! Loading touches no session and may run on a worker.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use caustica_renderer::ViewSettings;
use caustica_scene::import::{self, ImportOptions, Imported, Warning};
use caustica_scene::{
    Document, Edit, Environment, EnvironmentFile, Local, MAX_RADIANCE, Material, NodeId, Project,
    ProjectMeta, RadianceMap, ShapeFault, ShapeFile, ShapeSource,
};
use glam::Vec4;
use serde_json::{Map, Value};

use super::camera::ViewCamera;

/// Key of the camera in the project's view settings.
const CAMERA_KEY: &str = "camera";

/// What a file held.
#[derive(Clone, Debug)]
pub enum Loaded {
    /// A project.
    Project(Box<Project>),
    /// A model: glTF, GLB or OBJ.
    Model(Box<Imported>),
    /// Spheres and boxes of a text file.
    Shapes(ShapeFile),
    /// An environment map.
    Environment(PathBuf, Arc<RadianceMap>),
}

/// Reads a project, a model, spheres and boxes, or an environment, by the ending of its name. `outside`: also what a project
/// names outside of its folder. `progress`: step and share done.
///
/// # Errors
/// When the file cannot be read, with file, place and reason.
pub fn load(path: &Path, outside: bool, progress: &dyn Fn(&str, f32)) -> anyhow::Result<Loaded> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if Project::is_project_path(path) {
        let options = ImportOptions { outside_project: outside, ..ImportOptions::default() };
        let mut project = Project::load_with_progress(path, &options, progress)?;
        project.warnings.extend(view_faults(path, &project.meta));
        project.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        return Ok(Loaded::Project(Box::new(project)));
    }
    match ending.as_str() {
        "gltf" | "glb" | "obj" => {
            let imported = import::load_with_progress(path, &ImportOptions::default(), progress)?;
            imported.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
            Ok(Loaded::Model(Box::new(imported)))
        }
        "xyz" | "csv" | "txt" => Ok(Loaded::Shapes(import::load_shapes(path)?)),
        "hdr" | "exr" => {
            let (map, warnings) = import::load_environment(path)?;
            warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
            Ok(Loaded::Environment(path.to_owned(), Arc::new(map)))
        }
        _ => bail!(
            "{}: neither a project (.caustica.json) nor a model (.gltf, .glb, .obj) nor spheres and boxes (.xyz, .csv, .txt) \
             nor an environment (.hdr, .exr)",
            path.display()
        ),
    }
}

/// What was opened.
pub(super) enum Opened {
    /// A project, with its file.
    Project(PathBuf, Box<Project>),
    /// A scene without a file.
    Unsaved(Box<Document>),
}

/// Makes a document of what was loaded, all of it new.
pub(super) fn open(path: &Path, loaded: Loaded) -> anyhow::Result<Opened> {
    match loaded {
        Loaded::Project(project) => Ok(Opened::Project(absolute(path), project)),
        other => {
            let mut document = Document::new();
            let brought = import(&mut document, path, other)?;
            document.apply(brought.edit)?;
            document.mark_all_added("opened a file");
            Ok(Opened::Unsaved(Box::new(document)))
        }
    }
}

/// The path whatever the working folder becomes; as it was where the system gives no working folder.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Camera and settings that a project notes.
pub(super) fn noted_view(meta: &ProjectMeta) -> (Option<ViewCamera>, Option<ViewSettings>) {
    let camera = meta.view.get(CAMERA_KEY).and_then(|v| serde_json::from_value(v.clone()).ok());
    let readable = meta.render.iter().filter(|(key, value)| setting_fault(key, value).is_none());
    let readable: Map<String, Value> = readable.map(|(key, value)| (key.clone(), value.clone())).collect();
    let settings = (!readable.is_empty()).then(|| serde_json::from_value(Value::Object(readable)).ok());
    (camera, settings.flatten())
}

/// Why one of the settings cannot be read.
fn setting_fault(key: &str, value: &Value) -> Option<serde_json::Error> {
    let alone: Map<String, Value> = [(key.to_owned(), value.clone())].into_iter().collect();
    serde_json::from_value::<ViewSettings>(Value::Object(alone)).err()
}

/// What of the noted camera and settings cannot be read; the rest counts.
fn view_faults(path: &Path, meta: &ProjectMeta) -> Vec<Warning> {
    let warning = |place: String, message: String| Warning { file: path.to_owned(), place, message };
    let settings = meta.render.iter().filter_map(|(key, value)| {
        let error = setting_fault(key, value)?;
        Some(warning(format!("/render/{key}"), format!("{error}; the default is taken")))
    });
    let camera = meta.view.iter().filter_map(|(key, value)| match key.as_str() {
        CAMERA_KEY => {
            let error = serde_json::from_value::<ViewCamera>(value.clone()).err()?;
            Some(warning(format!("/view/{key}"), format!("{error}; a camera of the scene is taken")))
        }
        _ => Some(warning(format!("/view/{key}"), String::from("it is not known, and only kept on save"))),
    });
    settings.chain(camera).collect()
}

/// What an import brought.
#[derive(Clone, Copy, Debug)]
pub struct Arrived {
    /// The new node; `None` for an environment.
    pub node: Option<NodeId>,
    /// The file has changed since the scene got it the first time: it has both readings now.
    pub changed: bool,
}

/// An edit that brings something in, and the node that it makes.
pub(super) struct Brought {
    pub(super) edit: Edit,
    pub(super) node: Option<NodeId>,
    /// What the project keeps that it comes from.
    pub(super) kept: ProjectMeta,
    /// The document has an older reading of the file, which stays as it is.
    pub(super) changed: bool,
}

/// Makes the edit that brings a project, a model or an environment into a document.
pub(super) fn import(document: &mut Document, path: &Path, loaded: Loaded) -> anyhow::Result<Brought> {
    match loaded {
        Loaded::Project(project) => {
            let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
            let (name, _) = name.split_once('.').unwrap_or((&name, ""));
            let copies = document.merge_edit(&project.document, name)?;
            let mut kept = ProjectMeta::default();
            kept.keep_of(&project.meta, |id| copies.id_of(id));
            Ok(Brought { edit: copies.edit, node: Some(copies.node), kept, changed: false })
        }
        Loaded::Model(imported) => Ok(model(document, *imported)),
        Loaded::Shapes(file) => {
            let name =
                file.path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let source = ShapeSource::File(ShapeFile { path: absolute(&file.path), ..file });
            let (node, edit) = shapes_edit(document, &name, source, Local::default())?;
            Ok(Brought { edit, node: Some(node), kept: ProjectMeta::default(), changed: false })
        }
        Loaded::Environment(path, map) => {
            let path = absolute(&path);
            let file = EnvironmentFile { path, rotation_rad: 0.0, scale: 1.0, map: Some(map) };
            let edit = Edit::SetEnvironment(Environment::File(file));
            Ok(Brought { edit, node: None, kept: ProjectMeta::default(), changed: false })
        }
    }
}

/// An instance of a model: of the prefab that the document has of it, unless the file is another now.
fn model(document: &mut Document, imported: Imported) -> Brought {
    let name = imported.prefab.name.clone();
    let known = document.prefabs_of(&imported);
    let same = known.iter().find_map(|&(prefab, is_same)| is_same.then_some(prefab));
    let changed = same.is_none() && !known.is_empty();
    let (prefab, add) = match same {
        Some(prefab) => (prefab, None),
        None => {
            let (prefab, add) = document.import_edit(imported);
            (prefab, Some(add))
        }
    };
    let (node, mut place) = document.instantiate_edit(prefab, None, Local::default());
    // A new prefab is not in the document yet, so that its name is not known there.
    if let Edit::AddNode { subtree, .. } = &mut place
        && let Some((_, top)) = subtree.nodes.first_mut()
    {
        top.name.clone_from(&name);
    }
    let edit = Edit::batch(format!("imported {name}"), add.into_iter().chain([place]).collect());
    Brought { edit, node: Some(node), kept: ProjectMeta::default(), changed }
}

/// The edit that adds spheres and boxes in two plain colours, blue and orange, and the new node's id.
pub(super) fn shapes_edit(
    document: &mut Document,
    name: &str,
    source: ShapeSource,
    local: Local,
) -> Result<(NodeId, Edit), ShapeFault> {
    let colours = [Vec4::new(0.12, 0.3, 0.62, 1.0), Vec4::new(0.8, 0.35, 0.08, 1.0)];
    let material = |(number, base_color): (usize, &Vec4)| Material {
        name: format!("{name} {}", number + 1),
        base_color: *base_color,
        metallic: 0.0,
        roughness: 0.5,
        ..Material::default()
    };
    let materials: Vec<Material> = colours.iter().enumerate().map(material).collect();
    document.add_shapes_edit(name, source, &materials, local)
}

/// Writes camera and settings into what is saved.
pub(super) fn note_view(meta: &mut ProjectMeta, camera: &ViewCamera, settings: &ViewSettings) {
    if let Ok(value) = serde_json::to_value(camera) {
        meta.view.insert(String::from(CAMERA_KEY), value);
    }
    if let Ok(Value::Object(map)) = serde_json::to_value(settings) {
        for (key, value) in map {
            meta.render.insert(key, value);
        }
    }
}

/// Sets an environment from the command line: a file, or three numbers.
///
/// # Errors
/// When it is neither.
pub fn environment_argument(text: &str) -> anyhow::Result<Environment> {
    let numbers: Vec<f32> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    if let [r, g, b] = numbers[..]
        && text.split(',').count() == 3
    {
        if [r, g, b].iter().any(|v| !(0.0..=MAX_RADIANCE).contains(v)) {
            bail!("--environment {text}: radiance must be from 0 to {MAX_RADIANCE:e}");
        }
        return Ok(Environment::Constant(glam::Vec3::new(r, g, b)));
    }
    let path = Path::new(text);
    let (map, _) = import::load_environment(path).with_context(|| {
        format!("--environment {text}: neither three numbers R,G,B nor a file that can be read")
    })?;
    let map = Some(Arc::new(map));
    Ok(Environment::File(EnvironmentFile { path: path.to_owned(), rotation_rad: 0.0, scale: 1.0, map }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle in a material of this name.
    fn write(path: &Path, material: &str) -> std::io::Result<()> {
        let buffer = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
        let file = serde_json::json!({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "materials": [{"name": material}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": buffer}]});
        std::fs::write(path, file.to_string())
    }

    #[test]
    fn a_file_that_the_scene_has_is_placed_again_and_one_that_changed_comes_beside_it() -> anyhow::Result<()>
    {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.gltf");
        let mut document = Document::new();
        let mut undo = Vec::new();
        let mut seen = Vec::new();
        for material in ["red", "red", "blue", "blue"] {
            write(&path, material)?;
            let brought = import(&mut document, &path, load(&path, false, &|_, _| {})?)?;
            undo.push(document.apply(brought.edit)?);
            let name = brought.node.and_then(|node| document.node(node)).map(|node| node.name.as_str());
            assert_eq!(name, Some("a"));
            seen.push((document.prefabs().count(), document.meshes().count(), brought.changed));
        }
        assert_eq!(seen, [(1, 1, false), (1, 1, false), (2, 2, true), (2, 2, false)]);
        let mut left = Vec::new();
        for edit in undo.into_iter().rev() {
            document.apply_back(edit)?;
            left.push((document.node_count(), document.prefabs().count()));
        }
        assert_eq!(left, [(3, 2), (2, 1), (1, 1), (0, 0)]);
        Ok(())
    }
}
