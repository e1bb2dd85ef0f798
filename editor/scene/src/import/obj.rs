//! OBJ through tobj, with its MTL: triangulated, one mesh an object, one primitive a material of a group; without objects
//! one mesh a group. In: a path. Out: [`Imported`]. Material libraries and images are read only from the model's folder.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};
use tobj::{LoadOptions, Model};

use super::geometry::{Attributes, MeshBuilder, PrimitiveInput};
use super::gltf::buffers::read_file;
use super::room::Room;
use super::{
    ImportError, ImportOptions, Imported, UTF16, Warning, counted, file_stem, is_utf16, read_model_file,
    short, uri,
};
use crate::assets::{Material, Mesh};
use crate::ids::{MaterialId, MeshId};
use crate::prefab::{PartNode, Prefab};
use lines::Tidy;
use mtl::Source;

mod bake;
mod lines;
mod maps;
mod material;
mod mtl;
mod polygons;

/// Largest material library that is read, bytes.
const MAX_MTL_BYTES: u64 = 64 << 20;

/// What a material becomes at the most, bytes, measured with a library of 200,000 that say nothing.
const MATERIAL_BYTES: usize = 3000;
/// What a byte of the model may become in materials.
const MATERIAL_TIMES: usize = 16;

/// Polygons stay whole: tobj makes fans of them all.
const OPTIONS: LoadOptions =
    LoadOptions { single_index: true, triangulate: false, ignore_points: true, ignore_lines: true };

/// What is said about the model and its libraries.
#[derive(Default)]
struct Warnings {
    list: RefCell<Vec<Warning>>,
}

impl Warnings {
    fn add(&self, file: &Path, place: impl Into<String>, message: impl Into<String>) {
        let warning = Warning { file: file.to_owned(), place: place.into(), message: message.into() };
        self.list.borrow_mut().push(warning);
    }
}

/// Reads an OBJ file.
pub(super) fn load(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Imported, ImportError> {
    let bytes = read_model_file(path)?;
    if is_utf16(&bytes) {
        return Err(ImportError::new(path, UTF16));
    }
    let Tidy { text, smooth, materials: used, short_faces, other_elements, calls } =
        lines::tidy(&lines::text_of(&bytes))
            .map_err(|(line, reason)| ImportError::new(path, reason).at(format!("line {line}")))?;
    let room = Room::new(bytes.len(), 0);
    let folder = path.parent().unwrap_or(Path::new(""));
    progress("reading faces", 0.1);
    let warnings = Warnings::default();
    for (count, one, many) in [
        (short_faces, "face of fewer than three corners was", "faces of fewer than three corners were"),
        (other_elements, "point, line, curve or surface was", "points, lines, curves or surfaces were"),
        (calls, "call of another file or program was", "calls of other files or programs were"),
    ] {
        if count > 0 {
            warnings.add(path, "", format!("{} left out", counted(count, one, many)));
        }
    }
    let libraries = Libraries { path, folder, warnings: &warnings, read: RefCell::default() };
    let (mut models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &OPTIONS, |name| Ok(libraries.open(name)))
        .map_err(|error| ImportError::new(path, error.to_string()))?;
    drop(text);
    let fans = models.iter_mut().map(|model| polygons::triangulate(&mut model.mesh)).sum();
    warn_of_fans(fans, path, &warnings);
    progress("building meshes", 0.4);
    let sources = libraries.read.into_inner().materials;
    room.require(sources.len().saturating_mul(MATERIAL_BYTES), MATERIAL_TIMES)
        .map_err(|no_room| ImportError::new(path, no_room.to_string()).at("newmtl"))?;
    warn_of_unknown(&used, &sources, path, &warnings);
    let mut imported = Imported::default();
    let mut maps = maps::Maps::new(folder, options, &warnings);
    imported.materials = sources.iter().map(|source| material::read(source, &mut maps, &warnings)).collect();
    imported.textures = maps.textures;
    let default_material = imported.materials.len();
    let without_material = |model: &Model| model.mesh.material_id.is_none_or(|id| id >= default_material);
    if models.iter().any(without_material) {
        imported.materials.push(material::default_material());
    }
    let mut parts = Vec::new();
    for object in models.chunk_by(|a, b| a.name == b.name) {
        let warn = |place: String, message: String| warnings.add(path, place, message);
        let mesh = read_object(object, &imported.materials, default_material, smooth, &room, &warn)
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
        return Err(nothing(path, &lines::text_of(&bytes), &warnings.list.into_inner()));
    }
    imported.prefab = Prefab::new(file_stem(path), path);
    imported.prefab.set_nodes(parts).map_err(|error| ImportError::new(path, error.to_string()))?;
    imported.warnings = warnings.list.into_inner();
    progress("done", 1.0);
    Ok(imported)
}

/// Why a file shows nothing.
fn nothing(path: &Path, text: &str, warnings: &[Warning]) -> ImportError {
    let reason = "the file holds no triangle that could be shown";
    if let Some(line) = lines::not_finite(text) {
        let place = format!("line {line}");
        return ImportError::new(path, format!("a position is not finite, and {reason}")).at(place);
    }
    let said: Vec<&str> = warnings.iter().map(|warning| warning.message.as_str()).collect();
    let why = if said.is_empty() { "it has no faces".to_owned() } else { said.join("; ") };
    ImportError::new(path, format!("{reason}: {why}"))
}

/// The material libraries that a model names, each read once.
struct Libraries<'a> {
    path: &'a Path,
    folder: &'a Path,
    warnings: &'a Warnings,
    read: RefCell<Read>,
}

#[derive(Default)]
struct Read {
    files: BTreeSet<PathBuf>,
    materials: Vec<Source>,
}

impl Libraries<'_> {
    /// What tobj wants to know: names with their places. The rest is kept here.
    fn open(&self, names: &Path) -> (Vec<tobj::Material>, HashMap<String, usize>) {
        let names = names.to_string_lossy();
        let names = maps::unquoted(&names);
        let beside = |name: &str| uri::beside(name, self.folder);
        let whole = beside(names).is_ok_and(|file| file.is_file());
        // One name with blanks, or several names.
        let list = if whole { vec![names] } else { names.split_whitespace().collect() };
        let mut read = self.read.borrow_mut();
        let start = read.materials.len();
        for name in list {
            let text = beside(name).and_then(|file| {
                let bytes = if read.files.insert(file.clone()) {
                    read_file(&file, MAX_MTL_BYTES)?
                } else {
                    Vec::new()
                };
                match is_utf16(&bytes) {
                    true => Err(format!("{}: {UTF16}", file.display())),
                    false => Ok((bytes, file)),
                }
            });
            match text {
                Ok((bytes, file)) => {
                    read.materials.extend(mtl::parse(&lines::text_of(&bytes), &file, self.warnings));
                }
                Err(reason) => {
                    let message = format!("{reason}; its materials are left out");
                    self.warnings.add(self.path, format!("mtllib {}", short(name)), message);
                }
            }
        }
        let named =
            |source: &Source| tobj::Material { name: source.name.clone(), ..tobj::Material::default() };
        let new: Vec<tobj::Material> = read.materials.iter().skip(start).map(named).collect();
        let places = new.iter().enumerate().map(|(place, material)| (material.name.clone(), place)).collect();
        (new, places)
    }
}

fn warn_of_fans(fans: polygons::Fans, path: &Path, warnings: &Warnings) {
    let polygons::Fans { crossed, large } = fans;
    if crossed > 0 {
        let faces = counted(
            crossed,
            "face crosses itself and became a fan",
            "faces cross themselves and became fans",
        );
        warnings.add(path, "", format!("{faces}, which may not cover what was meant"));
    }
    if large > 0 {
        let faces = counted(large, "face has", "faces have");
        let reason = format!("{faces} more than {} corners, too many to be clipped", polygons::MANY);
        warnings.add(path, "", format!("{reason}: a fan each, which may not cover what was meant"));
    }
}

fn warn_of_unknown(used: &BTreeSet<String>, sources: &[Source], path: &Path, warnings: &Warnings) {
    let known: BTreeSet<&str> = sources.iter().map(|source| source.name.as_str()).collect();
    for name in used.iter().filter(|name| !known.contains(name.as_str())) {
        warnings.add(
            path,
            format!("usemtl {}", short(name)),
            "there is no such material; a grey one stands in",
        );
    }
}

/// One mesh from the runs of one object; each run of a group has its material.
fn read_object(
    models: &[Model],
    materials: &[Material],
    default_material: usize,
    smooth: bool,
    room: &Room,
    warn: &dyn Fn(String, String),
) -> Result<Mesh, String> {
    let name = models.first().map_or("", |model| model.name.as_str());
    let mut builder = MeshBuilder::within(room);
    for Model { mesh, .. } in models {
        let attributes = read_attributes(mesh, smooth);
        let count = attributes.positions.len();
        if let Some(bad) = mesh.indices.iter().find(|&&i| i as usize >= count) {
            return Err(format!(
                "object {}: vertex index {bad} is out of range, there are {count}",
                short(name)
            ));
        }
        let material = mesh.material_id.filter(|&id| id < default_material).unwrap_or(default_material);
        let input = PrimitiveInput {
            attributes: &Arc::new(attributes),
            indices: mesh.indices.clone(),
            material: MaterialId(material as u64),
            normal_map_tex_coord: materials
                .get(material)
                .and_then(|material| material.normal_texture)
                .map(|texture| texture.tex_coord),
        };
        builder.add(input).map_err(|too_large| format!("object {}: {too_large}", short(name)))?;
    }
    let repairs = builder.repairs;
    let removed = repairs.degenerate_triangles + repairs.non_finite_triangles;
    if removed > 0 {
        warn(
            format!("object {}", short(name)),
            format!(
                "{} removed",
                counted(
                    removed,
                    "triangle without area or with positions that are not finite was",
                    "triangles without area or with positions that are not finite were"
                )
            ),
        );
    }
    builder.finish(name.to_owned()).map_err(|too_large| format!("object {}: {too_large}", short(name)))
}

fn read_attributes(mesh: &tobj::Mesh, smooth: bool) -> Attributes {
    let positions: Vec<Vec3> = triples(&mesh.positions).map(Vec3::from).collect();
    let count = positions.len();
    let full = |length: usize, width: usize| length > 0 && length / width == count;
    // All zero: stand-ins, because another run has normals.
    let any_normal = mesh.normals.iter().any(|&number| number != 0.0);
    let normals = if any_normal && full(mesh.normals.len(), 3) {
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
