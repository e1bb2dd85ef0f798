//! OBJ with its MTL, through tobj: triangulated, one mesh an object or group, one primitive a material.
//! In: a path. Out: [`Imported`]. Material libraries and images are read only from the model's folder.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};
use tobj::{LoadError, LoadOptions, Model};

use super::geometry::{Attributes, MeshBuilder, PrimitiveInput};
use super::gltf::buffers::read_file;
use super::{ImportError, ImportOptions, Imported, Warning, file_stem, read_model_file, uri};
use crate::assets::Mesh;
use crate::ids::{MaterialId, MeshId};
use crate::prefab::{PartNode, Prefab};

mod lines;
mod mtl;

/// Largest material library that is read, bytes.
const MAX_MTL_BYTES: u64 = 64 << 20;

const OPTIONS: LoadOptions =
    LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };

/// Reads an OBJ file.
pub(super) fn load(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Imported, ImportError> {
    let bytes = read_model_file(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let facts = lines::check(&text)
        .map_err(|(line, reason)| ImportError::new(path, reason).at(format!("line {line}")))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    progress("reading faces", 0.1);
    let warnings = RefCell::new(Vec::new());
    let warn = |place: String, message: String| {
        warnings.borrow_mut().push(Warning { file: path.to_owned(), place, message });
    };
    let material_loader = |library: &Path| {
        let name = library.to_string_lossy();
        let read = uri::beside(&name, folder).and_then(|file| read_file(&file, MAX_MTL_BYTES));
        match read {
            Ok(bytes) => tobj::load_mtl_buf(&mut String::from_utf8_lossy(&bytes).as_bytes()),
            Err(reason) => {
                let text = format!("{reason}; its materials are left out");
                warn(format!("mtllib {name}"), text);
                Err(LoadError::OpenFileFailed)
            }
        }
    };
    let (models, materials) = tobj::load_obj_buf(&mut text.as_bytes(), &OPTIONS, material_loader)
        .map_err(|error| ImportError::new(path, error.to_string()))?;
    let mtl = materials.unwrap_or_else(|error| {
        if error != LoadError::OpenFileFailed {
            warn("mtllib".to_owned(), format!("{error}; its materials are left out"));
        }
        Vec::new()
    });
    progress("building meshes", 0.4);
    let mut imported = Imported::default();
    let (materials, textures) = mtl::read_all(&mtl, folder, options, &warn);
    imported.materials = materials;
    imported.textures = textures;
    let default_material = imported.materials.len();
    let without_material = |model: &Model| model.mesh.material_id.is_none_or(|id| id >= default_material);
    if models.iter().any(without_material) {
        imported.materials.push(mtl::default_material());
    }
    let mut parts = Vec::new();
    for group in models.chunk_by(|a, b| a.name == b.name) {
        let mesh = read_group(group, default_material, facts.smooth, &warn)
            .map_err(|reason| ImportError::new(path, reason))?;
        if mesh.primitives.is_empty() {
            continue;
        }
        parts.push(PartNode {
            name: mesh.name.clone(),
            visible: true,
            mesh: Some(MeshId(imported.meshes.len() as u64)),
            ..PartNode::default()
        });
        imported.meshes.push(mesh);
    }
    if imported.meshes.is_empty() {
        let reason = "the file holds no triangle that could be shown";
        return Err(ImportError::new(path, reason));
    }
    imported.prefab = Prefab::new(file_stem(path), path);
    imported.prefab.set_nodes(parts).map_err(|error| ImportError::new(path, error.to_string()))?;
    imported.warnings = warnings.into_inner();
    progress("done", 1.0);
    Ok(imported)
}

/// One mesh from the runs of one object or group; each run has its material.
fn read_group(
    models: &[Model],
    default_material: usize,
    smooth: bool,
    warn: &dyn Fn(String, String),
) -> Result<Mesh, String> {
    let name = models.first().map_or("", |model| model.name.as_str());
    let mut builder = MeshBuilder::default();
    for Model { mesh, .. } in models {
        let attributes = read_attributes(mesh, smooth);
        let count = attributes.positions.len();
        if let Some(bad) = mesh.indices.iter().find(|&&i| i as usize >= count) {
            return Err(format!("object {name}: vertex index {bad} is out of range, there are {count}"));
        }
        let material = mesh.material_id.filter(|&id| id < default_material).unwrap_or(default_material);
        let input = PrimitiveInput {
            attributes: &Arc::new(attributes),
            indices: mesh.indices.clone(),
            material: MaterialId(material as u64),
            normal_map_tex_coord: None,
        };
        builder.add(input).map_err(|_| format!("object {name} has more vertices than 32 bits can count"))?;
    }
    let repairs = builder.repairs;
    let removed = repairs.degenerate_triangles + repairs.non_finite_triangles;
    if removed > 0 {
        warn(
            format!("object {name}"),
            format!("{removed} triangles without area or with positions that are not finite were removed"),
        );
    }
    Ok(builder.finish(name.to_owned()))
}

fn read_attributes(mesh: &tobj::Mesh, smooth: bool) -> Attributes {
    let positions: Vec<Vec3> = triples(&mesh.positions).map(Vec3::from).collect();
    let count = positions.len();
    let full = |length: usize, width: usize| length > 0 && length / width == count;
    let normals = if full(mesh.normals.len(), 3) {
        Some(triples(&mesh.normals).map(Vec3::from).collect())
    } else {
        smooth.then(|| smooth_normals(&positions, &mesh.indices))
    };
    let (pairs, _) = mesh.texcoords.as_chunks::<2>();
    // v points up in OBJ and down in glTF.
    let tex_coords = pairs.iter().map(|&[u, v]| Vec2::new(u, 1.0 - v)).collect();
    let colors = triples(&mesh.vertex_color).map(|c| Vec3::from(c).extend(1.0));
    Attributes {
        normals,
        tex_coords0: full(mesh.texcoords.len(), 2).then_some(tex_coords),
        colors: full(mesh.vertex_color.len(), 3).then(|| colors.collect::<Vec<Vec4>>()),
        positions,
        ..Attributes::default()
    }
}

fn triples(numbers: &[f32]) -> impl Iterator<Item = [f32; 3]> {
    numbers.as_chunks::<3>().0.iter().copied()
}

/// Normals weighted by area, one for each position, whatever vertices it was split into.
fn smooth_normals(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let key = |p: &Vec3| p.to_array().map(f32::to_bits);
    let mut sums: HashMap<[u32; 3], DVec3> = HashMap::new();
    let (triangles, _) = indices.as_chunks::<3>();
    for triangle in triangles {
        let corners = triangle.map(|i| positions.get(i as usize));
        let [Some(p), Some(q), Some(r)] = corners else {
            continue;
        };
        let normal = (*q - *p).as_dvec3().cross((*r - *p).as_dvec3());
        if normal.is_finite() {
            for corner in [p, q, r] {
                *sums.entry(key(corner)).or_default() += normal;
            }
        }
    }
    let normal = |p| sums.get(&key(p)).copied().unwrap_or_default();
    positions.iter().map(|p| normal(p).normalize_or_zero().as_vec3()).collect()
}
