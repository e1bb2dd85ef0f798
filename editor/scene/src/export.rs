//! From a document to a `.glb` or `.gltf` file that import reads back as the same scene, to the bit.
//! In: a document and a path. Out: files written whole or not at all, and warnings about what glTF has no word for.
//! The same document gives the same bytes. Knows no device; runs on any thread.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::assets::{Environment, MAX_RADIANCE, ShapeSource};
use crate::document::Document;
use crate::ids::{MaterialId, MeshId, NodeId};
use crate::import::{Warning, counted, plain, short};

mod animation;
mod buffer;
mod container;
mod foreign;
mod json;
mod material;
mod mesh;
mod node;
mod pointer;
mod scene;
mod shapes;
mod shear;
mod texture;
mod tree;

use buffer::Buffer;
use foreign::Sources;
use json::{Extensions, Object, Put};
use material::MaterialWriter;
use mesh::{MeshKey, MeshWriter, Meshes};
use node::{Carried, NodeWriter};
use pointer::Places;
use texture::Textures;
use tree::Tree;

/// How the file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// All in one binary file.
    Glb,
    /// JSON, with a `.bin` of the same name beside it that holds vertices, key frames and images.
    Gltf,
}

impl ExportFormat {
    /// The format that a file name asks for by its ending.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "glb" => Some(Self::Glb),
            "gltf" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exported {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Nodes in the file.
    pub nodes: usize,
    /// Meshes in the file; nodes share them.
    pub meshes: usize,
    /// Materials in the file.
    pub materials: usize,
    /// What was left out or said otherwise, as glTF has no word for it.
    pub warnings: Vec<Warning>,
}

/// Why a scene cannot be exported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportError {
    /// The file that was to be written.
    pub file: PathBuf,
    /// What is wrong, in words.
    pub reason: String,
}

impl ExportError {
    fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.to_owned(), reason: reason.into() }
    }
}

impl fmt::Display for ExportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&plain(&format!("{}: {}", self.file.display(), self.reason)))
    }
}

impl std::error::Error for ExportError {}

/// Writes the scene, overrides of instances included, at rest and in metres. A file that is there goes on as `<name>.bak`.
///
/// # Errors
/// With file and reason, when the name ends in neither `.glb` nor `.gltf`, is that of a source of the scene, or cannot be
/// written.
pub fn export(document: &Document, path: &Path) -> Result<Exported, ExportError> {
    export_with_progress(document, path, &|_, _| {})
}

/// Like [`export`]; `progress` is called from this thread with a word for the step and the share done, 0..1.
///
/// # Errors
/// As [`export`].
pub fn export_with_progress(
    document: &Document,
    path: &Path,
    progress: &dyn Fn(&str, f32),
) -> Result<Exported, ExportError> {
    let format = ExportFormat::of(path).ok_or_else(|| {
        ExportError::new(
            path,
            "the name ends in neither .glb nor .gltf, which are the formats that are written",
        )
    })?;
    refuse_sources(document, path)?;
    if format == ExportFormat::Gltf {
        let sources = document.prefabs().map(|(_, prefab)| prefab.source.as_path());
        container::refuse_foreign_bin(path, sources)?;
    }
    let mut writer = Writer::new(document, path);
    let (json, bytes) = writer.write(progress);
    progress("writing", 0.8);
    let mut exported = writer.exported;
    exported.files = container::write(path, format, json, bytes)?;
    progress("done", 1.0);
    Ok(exported)
}

/// A source that was replaced would change the scene that names it.
fn refuse_sources(document: &Document, path: &Path) -> Result<(), ExportError> {
    match document.is_source(path) {
        true => Err(ExportError::new(path, "is a source of this scene; choose another name")),
        false => Ok(()),
    }
}

impl Document {
    /// Whether a file is one of [`Self::sources`].
    pub fn is_source(&self, path: &Path) -> bool {
        let Ok(real) = path.canonicalize() else { return false };
        self.sources().any(|source| source.canonicalize().is_ok_and(|source| source == real))
    }

    /// What the scene was read from: models, images beside them, an environment, lists of shapes. Some may not be there: which model
    /// an image came with is not kept.
    pub fn sources(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let models = self.prefabs().map(|(_, prefab)| prefab.source.clone());
        let folders: BTreeSet<&Path> =
            self.prefabs().filter_map(|(_, prefab)| prefab.source.parent()).collect();
        let beside = move |name: String| folders.clone().into_iter().map(move |folder| folder.join(&name));
        let images = self.textures().flat_map(move |(_, texture)| beside(texture.name.clone()));
        let shapes = self.meshes().filter_map(|(_, mesh)| match mesh.shapes()?.source() {
            ShapeSource::File(file) => Some(file.path.clone()),
            _ => None,
        });
        let environment = match self.environment() {
            Environment::File(file) => Some(file.path.clone()),
            _ => None,
        };
        models.chain(images).chain(shapes).chain(environment)
    }
}

struct Writer<'a> {
    document: &'a Document,
    path: &'a Path,
    buffer: Buffer,
    used: Extensions,
    exported: Exported,
}

impl<'a> Writer<'a> {
    fn new(document: &'a Document, path: &'a Path) -> Self {
        let (buffer, used, exported) = Default::default();
        Self { document, path, buffer, used, exported }
    }

    /// The JSON and the bytes.
    fn write(&mut self, progress: &dyn Fn(&str, f32)) -> (Object, Vec<u8>) {
        progress("walking the scene", 0.0);
        let meshes = Meshes::new(self.document);
        let tree = Tree::of(self.document, &meshes);
        let mut sources = Sources::new(self.document, &tree.prefabs());
        for reason in std::mem::take(&mut sources.warnings) {
            self.warn("", reason);
        }
        let unplaced = self.unplaced(&tree, &meshes);
        let placed = tree.entries.iter().filter_map(|entry| entry.mesh.as_ref());
        let keys: BTreeSet<&MeshKey> = placed.chain(&unplaced).collect();
        let materials: BTreeSet<MaterialId> =
            keys.iter().flat_map(|key| used_materials(key)).chain(sources.materials()).collect();
        let materials: BTreeMap<MaterialId, usize> = materials.into_iter().zip(0..).collect();
        progress("writing materials", 0.1);
        let (mut material_list, textures) = self.materials(&materials, &sources);
        progress("writing meshes", 0.3);
        let mesh_list = self.meshes(&keys, &meshes, &materials, &sources);
        progress("writing nodes", 0.6);
        let places: BTreeMap<MeshKey, usize> = keys.iter().map(|key| (*key).clone()).zip(0..).collect();
        let skin_places = animation::skin_places(self.document, &tree);
        let mut nodes = self.nodes(&tree, &sources, &places, &skin_places);
        let skins = animation::skins(
            &skin_places,
            &tree,
            &sources,
            (&mut self.buffer, &mut nodes.list),
            &mut self.used,
        );
        let mut of_mesh: BTreeMap<MeshId, Vec<usize>> = BTreeMap::new();
        for (key, place) in &places {
            of_mesh.entry(key.mesh).or_default().push(*place);
        }
        let (lights, cameras) = (&nodes.lights, &nodes.cameras);
        let everything = Places {
            tree: &tree,
            sources: &sources,
            lights,
            cameras,
            materials: &materials,
            meshes: &of_mesh,
        };
        let clips = animation::clips(&everything, &mut self.buffer, &mut self.used);
        pointer::complete(&clips.pointers, &mut nodes.list, &mut material_list, &mut self.used);
        progress("writing images", 0.7);
        let textures = textures.finish(&mut self.buffer);
        self.exported.nodes = nodes.list.len();
        (self.exported.meshes, self.exported.materials) = (mesh_list.len(), material_list.len());
        self.warn_about_the_rest(&tree, &meshes);
        self.warn_about_clips(&tree, clips.left_out);

        let mut cameras = nodes.cameras.pool.into_list();
        cameras.extend(sources.spare(|foreign| &foreign.spare_cameras, &mut self.used));
        let mut file = self.top(&tree, &sources, nodes.lights);
        let lists = std::mem::take(&mut self.buffer).finish();
        self.warn_about_lost(&sources);
        file.put_filled("extensionsUsed", self.used.names());
        for (name, list) in [
            ("nodes", nodes.list),
            ("cameras", cameras),
            ("meshes", mesh_list),
            ("materials", material_list),
            ("textures", textures.textures),
            ("images", textures.images),
            ("samplers", textures.samplers),
            ("skins", skins),
            ("animations", clips.list),
            ("accessors", lists.accessors),
            ("bufferViews", lists.views),
        ] {
            file.put_filled(name, list);
        }
        (file, lists.bytes)
    }

    /// What stands above the lists.
    fn top(&mut self, tree: &Tree, sources: &Sources<'_>, lights: Carried) -> Object {
        let mut file = Object::new();
        file.put("asset", self.asset(sources));
        let (shown, scenes) = self.scenes(tree, sources);
        file.put("scene", shown);
        file.put("scenes", scenes);
        let mut lights = lights.pool.into_list();
        lights.extend(sources.spare(|foreign| &foreign.spare_lights, &mut self.used));
        if !lights.is_empty() {
            let mut object = Object::new();
            object.put("lights", lights);
            self.used.put(&mut file, "KHR_lights_punctual", object);
        }
        sources.put_file(&mut file, &mut self.used);
        file
    }

    fn materials(
        &mut self,
        places: &BTreeMap<MaterialId, usize>,
        sources: &Sources<'_>,
    ) -> (Vec<Value>, Textures<'a>) {
        let mut textures = Textures::new(self.document);
        let mut list = Vec::with_capacity(places.len());
        for &id in places.keys() {
            let Some(material) = self.document.material(id) else { continue };
            let mut writer = MaterialWriter { textures: &mut textures, used: &mut self.used, sources };
            let (mut object, extras) = writer.write(material);
            sources.put(&mut object, sources.material(id), extras, &mut self.used);
            list.push(Value::Object(object));
            let color = material.base_color;
            if color.max_element() > 1.0 || color.min_element() < 0.0 {
                let reason = format!("its base colour {color} is held to 0 to 1, as glTF wants it");
                self.warn(&format!("material \"{}\"", short(&material.name)), reason);
            }
            let brightest = material.emissive.max_element().max(1.0) * material.emissive_strength;
            if brightest > MAX_RADIANCE {
                let reason =
                    format!("its emission of {brightest} is held to {MAX_RADIANCE}, which is read again");
                self.warn(&format!("material \"{}\"", short(&material.name)), reason);
            }
        }
        for name in std::mem::take(&mut textures.missing) {
            self.warn(&format!("texture \"{}\"", short(&name)), "its image is missing and is left out");
        }
        (list, textures)
    }

    fn meshes(
        &mut self,
        keys: &BTreeSet<&MeshKey>,
        meshes: &Meshes<'_>,
        materials: &BTreeMap<MaterialId, usize>,
        sources: &Sources<'_>,
    ) -> Vec<Value> {
        let mut list = Vec::with_capacity(keys.len());
        for key in keys {
            let Some(mesh) = meshes.get(key.mesh) else { continue };
            let (buffer, used) = (&mut self.buffer, &mut self.used);
            let document = self.document;
            let mut writer = MeshWriter { document, buffer, materials, sources, used, colors_held: false };
            let (mut object, extras) = writer.write(key, mesh);
            let colors_held = writer.colors_held;
            sources.put(&mut object, sources.mesh(key.mesh), extras, &mut self.used);
            list.push(Value::Object(object));
            if colors_held {
                let reason = "colours of its vertices are held to 0 to 1, as glTF wants it";
                self.warn(&format!("mesh \"{}\"", short(&mesh.name)), reason);
            }
        }
        list
    }

    fn nodes(
        &mut self,
        tree: &Tree,
        sources: &Sources<'_>,
        meshes: &BTreeMap<MeshKey, usize>,
        skins: &BTreeMap<(NodeId, u32), usize>,
    ) -> Nodes {
        let mut writer = NodeWriter {
            document: self.document,
            sources,
            buffer: &mut self.buffer,
            used: &mut self.used,
            meshes,
            skins,
            moving: &tree.moving,
            lights: Carried::default(),
            cameras: Carried::default(),
            warnings: Vec::new(),
        };
        let list = writer.write(tree);
        let (lights, cameras) = (writer.lights, writer.cameras);
        for (name, reason) in writer.warnings {
            self.warn(&format!("node \"{}\"", short(&name)), reason);
        }
        Nodes { list, lights, cameras }
    }

    fn asset(&mut self, sources: &Sources<'_>) -> Object {
        let mut asset = Object::new();
        asset.put("version", "2.0");
        asset.put("generator", concat!("Caustica ", env!("CARGO_PKG_VERSION")));
        sources.put_asset(&mut asset, &mut self.used);
        asset
    }

    /// What the file cannot say as a whole.
    fn warn_about_the_rest(&mut self, tree: &Tree, meshes: &Meshes<'_>) {
        let mut seen: BTreeSet<MeshId> = BTreeSet::new();
        for &target in tree.places.keys() {
            let Some(id) = self.document.mesh_of(target).filter(|id| seen.insert(*id)) else { continue };
            let Some(shapes) = self.document.mesh(id).and_then(|mesh| mesh.shapes()) else { continue };
            let (count, most) = (shapes.list().len(), shapes::MOST_TESSELLATED);
            let what = match meshes.get(id) {
                Some(_) => format!(
                    "{} written as triangles",
                    counted(count, "sphere or box is", "spheres and boxes are")
                ),
                None => format!(
                    "{} left out, up to {most} become triangles",
                    counted(count, "sphere or box is", "spheres and boxes are")
                ),
            };
            self.warn(&format!("node \"{}\"", self.document.display_name(target)), what);
        }
        for prefab in tree.prefabs().into_iter().filter_map(|id| self.document.prefab(id)) {
            if prefab.missing {
                let place = format!("source \"{}\"", prefab.source.display());
                self.warn(&place, "it is missing, so that its instances are empty nodes");
            }
        }
        let first = self.document.cameras().map(|camera| camera.target).min_by_key(|t| tree.places.get(t));
        if self.document.default_camera().is_some_and(|chosen| Some(chosen) != first) {
            self.warn("cameras", "which of them renders is left out: a reader takes the first");
        }
    }

    fn warn_about_clips(&mut self, tree: &Tree, left_out: usize) {
        if animation::plays_otherwise(self.document, tree) {
            self.warn("animations", "which clips are played is left out: all are written, in order");
        }
        if left_out > 0 {
            let what = counted(
                left_out,
                "channel is left out, as it changes",
                "channels are left out, as they change",
            );
            let reason = format!("{what} nothing that is in the file");
            self.warn("animations", reason);
        }
    }

    /// What the sources say that has no place in the file.
    fn warn_about_lost(&mut self, sources: &Sources<'_>) {
        for (prefab, what, count) in sources.lost() {
            let times = if count == 1 { String::new() } else { format!(" ({count} times)") };
            self.warn(
                &format!("source \"{}\"", prefab.source.display()),
                format!("{what} is left out{times}"),
            );
        }
        if self.used.homeless > 0 {
            let count = self.used.homeless;
            let reason = counted(
                count,
                "extras or extension is left out with the object that has it",
                "extras or extensions are left out with the objects that have them",
            );
            self.warn("sources", reason);
        }
    }

    /// Meshes of placed sources that none of their parts places.
    fn unplaced(&self, tree: &Tree, meshes: &Meshes<'_>) -> Vec<MeshKey> {
        let mut keys = Vec::new();
        for prefab in tree.prefabs().into_iter().filter_map(|id| self.document.prefab(id)) {
            let mut placed: BTreeSet<MeshId> = prefab.nodes().iter().filter_map(|node| node.mesh).collect();
            let loose = prefab.foreign.loose_parts.values();
            placed.extend(loose.filter_map(|place| prefab.meshes.get(*place)));
            let rest = prefab.meshes.iter().filter(|mesh| !placed.contains(mesh));
            keys.extend(rest.filter_map(|mesh| tree::unplaced(meshes, *mesh)));
        }
        keys
    }

    fn warn(&mut self, place: &str, message: impl Into<String>) {
        let file = self.path.to_owned();
        self.exported.warnings.push(Warning { file, place: place.to_owned(), message: message.into() });
    }
}

/// Lists that come from walking the nodes.
struct Nodes {
    list: Vec<Value>,
    lights: Carried,
    cameras: Carried,
}

/// The materials of the primitives that a mesh of the file has.
fn used_materials(key: &MeshKey) -> impl Iterator<Item = MaterialId> + '_ {
    key.primitives.iter().filter_map(|&primitive| key.materials.get(primitive as usize).copied())
}
