//! What is exported comes back: every shared model to the bit, by our own reader and by the rules of the Khronos validator.

use std::path::{Path, PathBuf};
use std::process::Command;

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{Document, Exported, Local, Mesh, Target, export};
use serde_json::Value;

use crate::common::{assert_sound, assets};
use crate::export_edits::samples;

/// A document that places a file as it is.
pub fn placed(imported: Imported) -> Document {
    let mut document = Document::new();
    let prefab = document.add_imported(imported).unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    document
}

pub fn read(path: &Path) -> Imported {
    load(path, &ImportOptions::default()).unwrap()
}

/// Exports into a folder.
pub fn exported(document: &Document, folder: &Path, name: &str) -> (PathBuf, Exported) {
    let path = folder.join(name);
    let exported = export(document, &path).unwrap();
    assert_eq!(exported.files[0], path);
    (path, exported)
}

/// The JSON of a file.
pub fn json_of(path: &Path) -> Value {
    let bytes = std::fs::read(path).unwrap();
    match bytes.starts_with(b"glTF") {
        true => {
            let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            serde_json::from_slice(&bytes[20..20 + length]).unwrap()
        }
        false => serde_json::from_slice(&bytes).unwrap(),
    }
}

/// Names and world transforms of everything, from the top.
pub fn worlds(document: &Document) -> Vec<(String, [f64; 12])> {
    let mut stack: Vec<Target> = document.roots().iter().rev().copied().map(Target::node).collect();
    let mut worlds = Vec::new();
    while let Some(target) = stack.pop() {
        let name = document.name(target).unwrap().to_owned();
        worlds.push((name, document.world_from(target).unwrap().to_cols_array()));
        stack.extend(document.children_of(target).into_iter().rev());
    }
    worlds
}

/// Every model of the shared assets that can be read.
fn models() -> Option<Vec<PathBuf>> {
    let mut folders = vec![assets("gltf")?];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if ["gltf", "glb"].contains(&ending.as_str()) {
                found.push(path);
            }
        }
    }
    found.sort();
    found.retain(|path| load(path, &ImportOptions::default()).is_ok());
    Some(found)
}

/// The name of an export: that of the model, so that the name of the prefab stays, in both formats by turns.
fn name_of(number: usize, model: &Path) -> String {
    let stem = model.file_stem().unwrap().to_string_lossy();
    format!("{stem}.{}", if number.is_multiple_of(2) { "glb" } else { "gltf" })
}

/// Everything but the path and the warnings is the same, to the bit.
fn assert_same(mut a: Imported, mut b: Imported, name: &str) {
    (a.prefab.source, b.prefab.source) = Default::default();
    assert_eq!(a.prefab.nodes(), b.prefab.nodes(), "{name}");
    assert_eq!(a.prefab.skins(), b.prefab.skins(), "{name}");
    assert_eq!(a.prefab.animations, b.prefab.animations, "{name}");
    assert_eq!(a.materials, b.materials, "{name}");
    assert_eq!((a.meshes.len(), a.textures.len()), (b.meshes.len(), b.textures.len()), "{name}");
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert!(a == b, "{name}: mesh {:?} differs in {:?}", a.name, differing(a, b));
    }
    for (a, b) in a.textures.iter().zip(&mut b.textures) {
        // What was neither PNG nor JPEG is now a PNG of the same texels.
        if a.encoded.is_none() {
            b.encoded = None;
        }
        assert!(a == b, "{name}: texture {:?} is another", a.name);
    }
    assert!(a.prefab == b.prefab, "{name}: environment or what is not known is another");
}

fn differing(a: &Mesh, b: &Mesh) -> Vec<&'static str> {
    let (x, y) = (&a.data, &b.data);
    let lists = [
        ("positions", x.positions == y.positions),
        ("normals", x.normals == y.normals),
        ("tangents", x.tangents == y.tangents),
        ("texture coordinates", x.tex_coords0 == y.tex_coords0 && x.tex_coords1 == y.tex_coords1),
        ("colours", x.colors == y.colors),
        ("indices", x.indices == y.indices),
        ("skin", x.skin == y.skin),
        ("morph targets", x.morph == y.morph),
        ("primitives", a.primitives == b.primitives),
    ];
    lists.into_iter().filter(|(_, same)| !same).map(|(name, _)| name).collect()
}

#[test]
fn shared_models_come_back_the_same() {
    let Some(models) = models() else { return };
    let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut compared = 0;
    for (number, model) in models.iter().enumerate() {
        let (first, name) = (read(model), name_of(number, model));
        let document = placed(first.clone());
        let (written, _) = exported(&document, folder.path(), &name);
        let second = read(&written);
        assert_sound(&written, &second);
        let document_again = placed(second.clone());
        assert!(worlds(&document) == worlds(&document_again), "{name}: something stands elsewhere");

        let (again, files) = exported(&document_again, other.path(), &name);
        for file in &files.files {
            let before = folder.path().join(file.file_name().unwrap());
            assert!(std::fs::read(before).unwrap() == std::fs::read(file).unwrap(), "{}", again.display());
        }
        assert_same(first, second, &name);
        compared += 1;
    }
    assert!(compared > 40, "{compared} models were compared");
}

/// What the Khronos validator says about files, or `None` with a note. Needs node and the validator:
/// `npm install --prefix FOLDER gltf-validator`, then `NODE_PATH=FOLDER/node_modules`.
pub fn validated(files: &[PathBuf]) -> Option<String> {
    let there = Command::new("node").args(["-e", "require('gltf-validator')"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        println!("skipped: node does not find the package gltf-validator");
        return None;
    }
    let output =
        Command::new("node").args(["-e", include_str!("validate.js"), "--"]).args(files).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{text}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(text.lines().filter(|line| line.starts_with("looked at: ")).count(), files.len());
    Some(text)
}

#[test]
fn the_khronos_validator_finds_no_error() {
    let Some(models) = models() else { return };
    let folder = tempfile::tempdir().unwrap();
    let export_one = |(number, model): (usize, &PathBuf)| {
        let name = format!("{number}-{}", name_of(number, model));
        exported(&placed(read(model)), folder.path(), &name).0
    };
    let mut files: Vec<PathBuf> = models.iter().enumerate().map(export_one).collect();
    for (number, document) in samples(folder.path()).iter().enumerate() {
        files.push(exported(document, folder.path(), &format!("sample-{number}.glb")).0);
    }
    let Some(text) = validated(&files) else { return };
    assert!(!text.contains("error: "), "{text}");
}
