//! From a document to a `.glb` or `.gltf` file that import reads back as the same scene, to the bit.
//! In: a document and a path. Out: files written whole or not at all, and warnings about what glTF has no word for.
//! The same document gives the same bytes. Knows no device; runs on any thread.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::assets::{Environment, ShapeSource};
use crate::document::Document;
use crate::ids::{MaterialId, MeshId};
use crate::import::Warning;

mod animation;
mod buffer;
mod container;
mod foreign;
mod json;
mod material;
mod mesh;
mod node;
mod shapes;
mod texture;
mod tree;

use buffer::Buffer;
use foreign::Sources;
use json::{Extensions, Object, Pool, Put};
use material::MaterialWriter;
use mesh::{MeshKey, MeshWriter, Meshes};
use node::NodeWriter;
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
        write!(f, "{}: {}", self.file.display(), self.reason)
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
        container::refuse_foreign_bin(path)?;
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
    /// Whether a file is what the scene was read from: a model, an image beside it, an environment, a list of shapes.
    pub fn is_source(&self, path: &Path) -> bool {
        let Ok(real) = path.canonicalize() else { return false };
        let is_same = |source: &Path| source.canonicalize().is_ok_and(|source| source == real);
        let images = |folder: &Path| self.textures().any(|(_, texture)| is_same(&folder.join(&texture.name)));
        let models = self
            .prefabs()
            .any(|(_, prefab)| is_same(&prefab.source) || prefab.source.parent().is_some_and(images));
        let shapes =
            self.meshes().filter_map(|(_, mesh)| mesh.shapes()).any(|shapes| match shapes.source() {
                ShapeSource::File(file) => is_same(&file.path),
                _ => false,
            });
        models || shapes || matches!(self.environment(), Environment::File(file) if is_same(&file.path))
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
        let keys: BTreeSet<&MeshKey> = tree.entries.iter().filter_map(|entry| entry.mesh.as_ref()).collect();
        let materials: BTreeSet<MaterialId> =
            keys.iter().flat_map(|key| used_materials(key)).chain(sources.materials()).collect();
        let materials: BTreeMap<MaterialId, usize> = materials.into_iter().zip(0..).collect();
        progress("writing materials", 0.1);
        let (material_list, textures) = self.materials(&materials, &sources);
        progress("writing meshes", 0.3);
        let mesh_list = self.meshes(&keys, &meshes, &materials, &sources);
        progress("writing nodes", 0.6);
        let places: BTreeMap<MeshKey, usize> = keys.iter().map(|key| (*key).clone()).zip(0..).collect();
        let nodes = self.nodes(&tree, &sources, &places);
        let skins = animation::skins(self.document, &tree, &mut self.buffer);
        let clips = animation::clips(self.document, &tree, &mut self.buffer);
        progress("writing images", 0.7);
        let textures = textures.finish(&mut self.buffer);
        self.exported.nodes = nodes.list.len();
        (self.exported.meshes, self.exported.materials) = (mesh_list.len(), material_list.len());
        self.warn_about_the_rest(&tree, &meshes);

        let lists = std::mem::take(&mut self.buffer).finish();
        let mut file = Object::new();
        file.put("asset", self.asset(&sources));
        file.put("scene", 0);
        file.put("scenes", vec![Value::Object(self.scene(&tree, &sources))]);
        sources.put_file(&mut file, &mut self.used);
        if !nodes.lights.is_empty() {
            let mut lights = Object::new();
            lights.put("lights", nodes.lights);
            self.used.put(&mut file, "KHR_lights_punctual", lights);
        }
        file.put_filled("extensionsUsed", self.used.names());
        for (name, list) in [
            ("nodes", nodes.list),
            ("cameras", nodes.cameras),
            ("meshes", mesh_list),
            ("materials", material_list),
            ("textures", textures.textures),
            ("images", textures.images),
            ("samplers", textures.samplers),
            ("skins", skins),
            ("animations", clips),
            ("accessors", lists.accessors),
            ("bufferViews", lists.views),
        ] {
            file.put_filled(name, list);
        }
        (file, lists.bytes)
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
            let mut writer = MaterialWriter { textures: &mut textures, used: &mut self.used };
            let (mut object, extras) = writer.write(material);
            sources.put(&mut object, sources.material(id), extras, &mut self.used);
            list.push(Value::Object(object));
        }
        for name in std::mem::take(&mut textures.missing) {
            self.warn(&format!("texture \"{name}\""), "its image is missing and is left out");
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
            let mut writer = MeshWriter { document: self.document, buffer, materials, sources, used };
            let (mut object, extras) = writer.write(key, mesh);
            sources.put(&mut object, sources.mesh(key.mesh), extras, &mut self.used);
            list.push(Value::Object(object));
        }
        list
    }

    fn nodes(&mut self, tree: &Tree, sources: &Sources<'_>, meshes: &BTreeMap<MeshKey, usize>) -> Nodes {
        let skins = animation::first_skins(self.document, tree);
        let moving = animation::moving(self.document, tree);
        let mut writer = NodeWriter {
            document: self.document,
            sources,
            buffer: &mut self.buffer,
            used: &mut self.used,
            meshes,
            skins: &skins,
            moving: &moving,
            lights: Pool::default(),
            cameras: Pool::default(),
            warnings: Vec::new(),
        };
        let list = writer.write(tree);
        let (lights, cameras) = (writer.lights.into_list(), writer.cameras.into_list());
        for (name, reason) in writer.warnings {
            self.warn(&format!("node \"{name}\""), reason);
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

    fn scene(&mut self, tree: &Tree, sources: &Sources<'_>) -> Object {
        let mut scene = Object::new();
        scene.put_filled("nodes", tree.roots.clone());
        let mut extras = Object::new();
        let asked =
            tree.prefabs().into_iter().filter_map(|id| self.document.prefab(id)?.environment.as_ref());
        let environment = match self.document.environment() {
            Environment::Auto => asked.into_iter().next(),
            set => Some(set),
        };
        match environment {
            Some(Environment::Constant(radiance)) => {
                let mut environment = Object::new();
                environment.put("constantRadiance", json::numbers(&radiance.to_array()));
                extras.put("environment", environment);
            }
            Some(Environment::DefaultSky | Environment::File(_)) => {
                self.warn("environment", "only a constant one is written, glTF has no word for others");
            }
            Some(Environment::Auto) | None => {}
        }
        sources.put_scene(&mut scene, extras, &mut self.used);
        scene
    }

    /// What the file cannot say as a whole.
    fn warn_about_the_rest(&mut self, tree: &Tree, meshes: &Meshes<'_>) {
        let mut seen: BTreeSet<MeshId> = BTreeSet::new();
        for &target in tree.places.keys() {
            let Some(id) = self.document.mesh_of(target).filter(|id| seen.insert(*id)) else { continue };
            let Some(shapes) = self.document.mesh(id).and_then(|mesh| mesh.shapes()) else { continue };
            let (count, most) = (shapes.list().len(), shapes::MOST_TESSELLATED);
            let what = match meshes.get(id) {
                Some(_) => format!("{count} spheres and boxes are written as triangles"),
                None => format!("{count} spheres and boxes are left out, up to {most} become triangles"),
            };
            self.warn(&format!("node \"{}\"", self.document.display_name(target)), what);
        }
        for prefab in tree.prefabs().into_iter().filter_map(|id| self.document.prefab(id)) {
            if prefab.missing {
                let place = format!("source \"{}\"", prefab.source.display());
                self.warn(&place, "it is missing, so that its instances are empty nodes");
            }
        }
        if animation::plays_otherwise(self.document, tree) {
            self.warn("animations", "which clips are played is left out: all are written, in order");
        }
        match animation::left_out(self.document, tree) {
            0 => {}
            count => self.warn(
                "animations",
                format!("{count} channels of visibility, lights, cameras and materials are left out"),
            ),
        }
        let first = self.document.cameras().map(|camera| camera.target).min_by_key(|t| tree.places.get(t));
        if self.document.default_camera().is_some_and(|chosen| Some(chosen) != first) {
            self.warn("cameras", "which of them renders is left out: a reader takes the first");
        }
    }

    fn warn(&mut self, place: &str, message: impl Into<String>) {
        let file = self.path.to_owned();
        self.exported.warnings.push(Warning { file, place: place.to_owned(), message: message.into() });
    }
}

/// Lists that come from walking the nodes.
struct Nodes {
    list: Vec<Value>,
    lights: Vec<Value>,
    cameras: Vec<Value>,
}

/// The materials of the primitives that a mesh of the file has.
fn used_materials(key: &MeshKey) -> impl Iterator<Item = MaterialId> + '_ {
    key.primitives.iter().filter_map(|&primitive| key.materials.get(primitive as usize).copied())
}
