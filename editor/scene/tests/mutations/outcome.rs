//! What came of a file: read, refused in words, or a fault of the importer.

use std::path::Path;

use caustica_scene::import::{
    ImportError, ImportOptions, Imported, Warning, load, load_environment, load_shapes,
};
use caustica_scene::{Document, Local, Project, ProjectProblem};

use crate::corpus::{Kind, Seed};

/// Reasons that are about a file as a whole and so have no place in it.
const WHOLE_FILE: [&str; 3] =
    ["cannot be opened", "the file holds no triangle", "there are no spheres and no boxes"];

/// Reads a seed from its folder: true when it loads, false when it is refused with file, place and reason; else what is at fault.
pub fn of(seed: &Seed, folder: &Path) -> Result<bool, String> {
    let path = folder.join(&seed.files[seed.entry].0);
    match seed.kind {
        Kind::Gltf | Kind::Obj | Kind::Image => match load(&path, &ImportOptions::default()) {
            Ok(imported) => {
                sound(&imported)?;
                warnings(&imported.warnings)?;
                used(imported)
            }
            Err(error) => refused(&error, &path),
        },
        Kind::Environment => match load_environment(&path) {
            Ok((map, list)) => {
                warnings(&list)?;
                let texels = map.width as usize * map.height as usize;
                let whole =
                    map.rgb.len() == texels && map.rgb.iter().flatten().all(|v| v.is_finite() && *v >= 0.0);
                whole.then_some(true).ok_or_else(|| "texels are missing or not finite".to_owned())
            }
            Err(error) => refused(&error, &path),
        },
        Kind::Shapes => match load_shapes(&path) {
            Ok(_) => Ok(true),
            Err(error) => refused(&error, &path),
        },
        Kind::Project => match Project::load(&path) {
            Ok(project) => warnings(&project.warnings).map(|()| true),
            Err(error) => {
                let text = error.to_string();
                // What is no JSON has a line, what is no project a pointer; the others are about the file.
                let placed = match error.problem {
                    ProjectProblem::Json(_) => text.contains("line "),
                    ProjectProblem::Broken(reason) => {
                        reason.contains('/') || reason.contains("byte order mark")
                    }
                    _ => true,
                };
                let named = error.file == path && text.contains(&*path.to_string_lossy());
                (placed && named)
                    .then_some(false)
                    .ok_or_else(|| format!("says neither file nor place: {text}"))
            }
        },
    }
}

fn refused(error: &ImportError, path: &Path) -> Result<bool, String> {
    let whole = WHOLE_FILE.iter().any(|reason| error.reason.contains(reason));
    let worded = error.file == path && !error.reason.is_empty() && (whole || !error.place.is_empty());
    worded.then_some(false).ok_or_else(|| format!("says neither file, place nor reason: {error}"))
}

fn warnings(list: &[Warning]) -> Result<(), String> {
    let bare = |warning: &&Warning| warning.message.is_empty() || warning.file.as_os_str().is_empty();
    list.iter().find(bare).map_or(Ok(()), |warning| Err(format!("a warning without words: {warning:?}")))
}

/// Whether everything is finite and every index inside its list.
fn sound(imported: &Imported) -> Result<(), String> {
    for mesh in &imported.meshes {
        let data = &mesh.data;
        let count = data.positions.len();
        let even = data.normals.len() == count
            && data.tangents.len() == count
            && data.tex_coords0.len() == count
            && [0, count].contains(&data.tex_coords1.len())
            && [0, count].contains(&data.colors.len());
        let inside = data.indices.iter().all(|&i| (i as usize) < count)
            && mesh.primitives.iter().all(|p| {
                p.index_count > 0
                    && p.first_index as usize + p.index_count as usize <= data.indices.len()
                    && (p.material.0 as usize) < imported.materials.len()
            });
        let finite = data.positions.iter().all(|p| p.is_finite())
            && data.normals.iter().all(|n| n.is_normalized())
            && data.tex_coords0.iter().chain(&data.tex_coords1).all(|t| t.is_finite())
            && data.colors.iter().all(|c| c.is_finite());
        if !(even && inside && finite) {
            return Err(format!("mesh {} is not sound: {even} {inside} {finite}", mesh.name));
        }
    }
    for material in &imported.materials {
        let inside = material.textures().all(|slot| (slot.texture.0 as usize) < imported.textures.len());
        if !(material.is_finite() && inside) {
            return Err(format!("material {} is not sound", material.name));
        }
    }
    let whole = |texture: &caustica_scene::Texture| {
        texture.rgba8.len() == texture.width as usize * texture.height as usize * 4
    };
    imported.textures.iter().all(whole).then_some(()).ok_or_else(|| "a texture is not whole".to_owned())
}

/// Puts it into a document, poses it and looks at it.
fn used(imported: Imported) -> Result<bool, String> {
    let words = |error: caustica_scene::EditError| format!("a document does not take it: {error}");
    let mut document = Document::new();
    let prefab = document.add_imported(imported).map_err(words)?;
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).map_err(words)?;
    document.set_time(Some(0.3));
    document.drain_changes();
    for placed in document.renderables() {
        if let Some(pose) = document.deform_pose(placed.target) {
            let finite = pose.weights.iter().all(|w| w.is_finite())
                && pose.joint_matrices.iter().all(|m| m.is_finite());
            if !finite {
                return Err("its pose is not finite".to_owned());
            }
        }
    }
    caustica_scene::audit(&document);
    Ok(true)
}
