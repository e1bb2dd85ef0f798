//! From a file to an [`Imported`]: plain data whose ids are places in its own lists.
//! In: a path. Out: nodes, meshes, materials, textures and warnings, or an [`ImportError`] that names file,
//! place and reason. Knows no document; runs on any thread.

use std::path::Path;

use crate::assets::{Material, Mesh, Texture};
use crate::prefab::Prefab;

mod basis;
mod environment;
mod error;
pub(crate) mod geometry;
pub(crate) mod gltf;
mod image;
mod image_guard;
mod memory;
mod meshopt;
mod obj;
mod room;
mod shapes;
pub(crate) mod tangents;
mod uri;
mod watched;

pub use environment::load_environment;
pub use error::{ImportError, Warning, counted};
pub(crate) use error::{UTF16, is_utf16, plain, refuse_lfs_pointer, short, summed};
pub(crate) use room::Room;
pub use shapes::load_shapes;
pub(crate) use uri::{Location, is_address, leads_out, resolve};

/// What an import may be told.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Widest and highest image in texels that is decoded.
    pub max_image_extent_px: u32,
    /// Most vertices and triangles that one file may bring.
    pub max_elements: usize,
    /// Most bytes that the decoded images of one file may take.
    pub max_image_bytes: u64,
    /// Reads what a project names outside of its own folder, which is left out otherwise.
    pub outside_project: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            max_image_extent_px: 16_384,
            max_elements: 400_000_000,
            max_image_bytes: memory::half_of_machine(),
            outside_project: false,
        }
    }
}

/// A file that was read. The ids in it are indices of its own lists until a document takes it in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// The node tree, the file's name and path, and the environment that it asks for.
    pub prefab: Prefab,
    /// Meshes in the order of the file.
    pub meshes: Vec<Mesh>,
    /// Materials in the order of the file; a default material may follow.
    pub materials: Vec<Material>,
    /// Textures: one for each image, sampler and colour space in use.
    pub textures: Vec<Texture>,
    /// What was left out or repaired.
    pub warnings: Vec<Warning>,
}

/// Reads a `.gltf`, `.glb` or `.obj` file.
///
/// # Errors
/// With file, place and reason when the file cannot be read as what it claims to be.
pub fn load(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    load_with_progress(path, options, &|_, _| {})
}

/// Like [`load`]; `progress` is called from this thread with a word for the step and the share done, 0..1.
///
/// # Errors
/// As [`load`].
pub fn load_with_progress(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Imported, ImportError> {
    progress("opening", 0.0);
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let mut imported = match extension.as_deref() {
        Some("gltf" | "glb") => gltf::load(path, options, progress),
        Some("obj") => obj::load(path, options, progress),
        _ => Err(ImportError::new(
            path,
            "the name does not end in .gltf, .glb or .obj, which are the formats that are read",
        )),
    }?;
    imported.warnings = summed(imported.warnings);
    tracing::debug!(
        file = %path.display(),
        nodes = imported.prefab.nodes().len(),
        meshes = imported.meshes.len(),
        warnings = imported.warnings.len(),
        "imported"
    );
    Ok(imported)
}

/// Refuses folders, devices and pipes: reading them could go on for ever.
fn require_regular_file(path: &Path) -> Result<(), ImportError> {
    let metadata = std::fs::metadata(path)
        .map_err(|error| ImportError::new(path, format!("cannot be opened: {error}")))?;
    match metadata.is_file() {
        true => Ok(()),
        false => Err(ImportError::new(path, "is not a file")),
    }
}

fn read_model_file(path: &Path) -> Result<Vec<u8>, ImportError> {
    require_regular_file(path)?;
    let bytes =
        std::fs::read(path).map_err(|error| ImportError::new(path, format!("cannot be read: {error}")))?;
    refuse_lfs_pointer(&bytes).map_or(Ok(bytes), |reason| Err(ImportError::new(path, reason)))
}

/// A texture that stands in for one that is missing.
pub(crate) fn placeholder_texture(name: String) -> Texture {
    let pixels = image::placeholder();
    Texture {
        name,
        width: pixels.width,
        height: pixels.height,
        rgba8: pixels.rgba8,
        srgb: true,
        sampler: Default::default(),
        placeholder: true,
        encoded: None,
    }
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}
