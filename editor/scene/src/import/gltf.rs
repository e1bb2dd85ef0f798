//! glTF 2.0, `.gltf` and `.glb`: container, checks, then meshes, materials, textures, the node tree, skins and clips.
//! In: a path. Out: [`Imported`]. The JSON is read by our own checked reader: node transforms stay in double
//! precision, errors name a JSON pointer, and nothing is indexed before it was checked.

use std::collections::{BTreeSet, HashSet};
use std::path::Path;
use std::sync::Arc;

use super::{ImportError, ImportOptions, Imported, Warning, file_stem, read_model_file, short};
use crate::assets::Material;
use crate::foreign::Foreign;
use crate::prefab::Prefab;

mod accessor;
mod animation;
mod attributes;
pub(super) mod buffers;
mod carried;
mod check;
mod compressed;
mod container;
mod extras;
mod foreign;
mod json;
mod lists;
mod loose;
mod material;
mod mesh;
mod node;
mod skin;
mod surroundings;
mod texture;

pub(crate) use carried::{DEFAULT_NEAR_M, LEAST_CONE_RAD};
pub(crate) use check::is_read;
pub(crate) use material::{INFINITE_IOR, is_smooth_glass};
pub(crate) use node::unit as unit_rotation;

use json::{Fault, Item};

/// Reads a glTF file.
pub(super) fn load(
    path: &Path,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Imported, ImportError> {
    let bytes = read_model_file(path)?;
    let is_glb = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb"));
    read(path, bytes, is_glb, options, progress)
        .map_err(|fault| ImportError::new(path, fault.reason).at(fault.place))
}

fn read(
    path: &Path,
    bytes: Vec<u8>,
    is_glb: bool,
    options: &ImportOptions,
    progress: &dyn Fn(&str, f32),
) -> Result<Imported, Fault> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let container = container::read(&bytes, is_glb)?;
    let root = Item::root(&container.json);
    check::version(&root)?;
    let left_out = check::extensions(&root)?;
    let counts = check::references(&root)?;
    progress("reading buffers", 0.1);
    let mut buffers = buffers::Buffers::read(&root, bytes, container.binary, folder)?;
    lists::require_room(&root, buffers.room())?;
    let views = accessor::views(&root, &mut buffers, &counts)?;
    let accessors = accessor::Accessors::read(&root, &mut buffers, &views)?;
    progress("reading meshes", 0.2);
    let mut textures = texture::TextureTable::read(&root)?;
    let (mut materials, material_warnings) = material::read_all(&root, &mut textures)?;
    let mut meshes = mesh::read_all(&root, &accessors, &materials, options.max_elements)?;
    if meshes.uses_default_material {
        materials.push(Material { name: "default".to_owned(), ..Material::default() });
    }
    let mut tree = node::read_scenes(&root, &accessors, &meshes)?;
    let surroundings = surroundings::read(&root, accessors.buffers(), &views, path, &mut tree.scenes)?;
    let (skins, skin_places) = skin::read_all(&root, &accessors, &meshes.list, &mut tree)?;
    let (animations, channels) = animation::read_all(&root, &accessors, &meshes.list, &materials, &mut tree)?;
    let mut foreign = foreign::read(&root, &mut meshes, &mut tree, &skin_places)?;
    foreign.channels = channels;
    progress("decoding images", 0.5);
    foreign.lost.extend(textures.unused());
    foreign.textures = textures.kept(&root)?;
    let images = texture::Images::read(&root, accessors.buffers(), &views, folder, options)?;
    let (textures, image_warnings) = textures.load(&root, images)?;
    let mut prefab = Prefab::new(file_stem(path), path);
    let shown = tree.scenes.get(tree.default_scene);
    prefab.environment = shown.and_then(|scene| scene.environment.clone());
    prefab.set_scenes(tree.scenes, tree.default_scene);
    prefab.animations = animations;
    prefab.set_skins(skins);
    prefab.set_nodes(tree.parts).map_err(|error| Fault::new("/nodes", error.to_string()))?;
    let faults = left_out_warnings(&left_out, &foreign)
        .into_iter()
        .chain(material_warnings)
        .chain(meshes.warnings)
        .chain(tree.warnings)
        .chain(surroundings)
        .chain(image_warnings);
    let mut said = HashSet::new();
    let warnings: Vec<Warning> = faults
        .filter(|fault| said.insert((fault.place.clone(), fault.reason.clone())))
        .map(|fault| Warning { file: path.to_owned(), place: fault.place, message: fault.reason })
        .collect();
    prefab.foreign = Arc::new(foreign);
    progress("done", 1.0);
    Ok(Imported { prefab, meshes: meshes.list, materials, textures, warnings })
}

/// What the file has and the program does not show.
fn left_out_warnings(extensions: &[String], foreign: &Foreign) -> Vec<Fault> {
    let kept: BTreeSet<&String> = foreign.all().flat_map(|object| object.extension_names()).collect();
    let warning = |name: &String| {
        let what = if kept.contains(name) { "is only kept for exports" } else { "is left out" };
        Fault::new("/extensionsUsed", format!("{} is not supported and {what}", short(name)))
    };
    extensions.iter().map(warning).collect()
}
