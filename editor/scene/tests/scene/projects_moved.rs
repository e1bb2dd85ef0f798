//! Projects that come from elsewhere: written by an older version, with files missing, or naming files that are none of
//! their business.

use std::path::{Path, PathBuf};

use crate::common::trs;
use crate::projects::{edited, meta};
use caustica_scene::import::ImportOptions;
use caustica_scene::{
    Cloud, Document, Edit, Environment, EnvironmentFile, NodeKind, Project, SCHEMA_VERSION, ShapeFile,
    ShapeSource, Target, import::load_environment, import::load_shapes,
};
use serde_json::Value;

/// The scene that the stored files hold: what version 1 knew, and of version 2 its shapes.
fn stored_scene(folder: &Path, version: u64) -> Document {
    let scene = edited(folder);
    let mut document = scene.document;
    // They came after the files were written; what a file does not say is as it always was.
    for edit in [
        Edit::SetVariant { node: scene.second, variant: None },
        Edit::SetLocked { node: scene.second, locked: false },
    ] {
        document.apply(edit).unwrap();
    }
    if version >= 2 {
        let cloud = ShapeSource::Cloud(Cloud { seed: 7, count: 50, ..Cloud::default() });
        let (_, edit) = document.add_shapes_edit("Dust", cloud, &[], trs(1.0, 0.2, 1.0)).unwrap();
        document.apply(edit).unwrap();
    }
    document
}

#[test]
fn files_of_every_version_are_read() {
    let stored = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/projects");
    for version in 1..=SCHEMA_VERSION {
        let folder = tempfile::tempdir().unwrap();
        let file = format!("version-{version}.caustica.json");
        for name in ["model.gltf", &file] {
            std::fs::copy(stored.join(name), folder.path().join(name)).unwrap();
        }
        let path = folder.path().join(&file);
        let project = Project::load(&path).unwrap();
        assert!(project.warnings.is_empty(), "{:?}", project.warnings);
        assert_eq!(project.meta, meta(), "{file}");
        assert!(project.document == stored_scene(folder.path(), version), "{file}");
        // What is saved is of the newest version, and says nothing else.
        let mut before: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(before["caustica"], version);
        before["caustica"] = SCHEMA_VERSION.into();
        Project::save(&path, &project.document, &project.meta).unwrap();
        let mut after: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        // What came without a new version.
        assert!(after["prefabs"][0].as_object_mut().unwrap().remove("assetNames").is_some());
        assert_eq!(before, after, "{file}");
    }
}

#[test]
fn a_migration_keeps_what_an_old_file_holds_besides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.caustica.json");
    std::fs::write(&path, "{\"caustica\": 1, \"shapes\": \"mine\", \"note\": 5}").unwrap();
    let project = Project::load(&path).unwrap();
    Project::save(&path, &project.document, &project.meta).unwrap();
    let saved: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!((&saved["shapesOfVersion1"], &saved["note"]), (&"mine".into(), &5.into()));
    std::fs::write(&path, "{\"caustica\": 1,\n\"nodes\": 5}").unwrap();
    assert!(Project::load(&path).unwrap_err().to_string().contains("line 2"));
}

/// Lines of the second text that are not in the first, and the other way round.
fn changed_lines(a: &str, b: &str) -> usize {
    let only_in = |a: &str, b: &str| {
        let known: std::collections::BTreeSet<&str> = b.lines().collect();
        a.lines().filter(|line| !known.contains(line)).count()
    };
    only_in(a, b) + only_in(b, a)
}

#[test]
fn an_edit_changes_few_lines() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let mut scene = edited(folder.path());
    let text_of = |document: &Document| {
        Project::save(&path, document, &meta()).unwrap();
        std::fs::read_to_string(&path).unwrap()
    };
    let mut before = text_of(&scene.document);
    let rename = Edit::Rename { target: scene.light.into(), name: "Moon".into() };
    let move_it = Edit::SetTransform { target: scene.camera.into(), local: trs(7.0, 0.5, 1.0) };
    for (edit, most) in [(rename, 2), (move_it, 40), (Edit::RemoveNode { node: scene.light }, 40)] {
        scene.document.apply(edit.clone()).unwrap();
        let after = text_of(&scene.document);
        let changed = changed_lines(&before, &after);
        assert!((1..=most).contains(&changed), "{edit:?}: {changed} lines");
        before = after;
    }
}

/// A scene that names a model, a text file of shapes and an environment, all in `folder`.
fn with_files(folder: &Path) -> Document {
    let mut document = edited(folder).document;
    let shapes = folder.join("dust.xyz");
    std::fs::write(&shapes, "0 0 0 1\n1 0 0 1 2 3\n").unwrap();
    let map = folder.join("sky.exr");
    image::Rgb32FImage::from_pixel(4, 2, image::Rgb([0.5, 1.0, 2.0])).save(&map).unwrap();
    let source = ShapeSource::File(load_shapes(&shapes).unwrap());
    let (_, add) = document.add_shapes_edit("Dust", source, &[], trs(0.0, 0.0, 1.0)).unwrap();
    let (read, _) = load_environment(&map).unwrap();
    let file = EnvironmentFile { path: map, rotation_rad: 0.25, scale: 2.0, map: Some(read.into()) };
    document.apply(add).unwrap();
    document.apply(Edit::SetEnvironment(Environment::File(file))).unwrap();
    document
}

#[test]
fn every_missing_file_has_a_stand_in_that_is_kept_on_save() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let whole = with_files(folder.path());
    Project::save(&path, &whole, &meta()).unwrap();
    let before = std::fs::read_to_string(&path).unwrap();
    let files = ["model.gltf", "dust.xyz", "sky.exr"];
    let hidden = folder.path().join("hidden");
    std::fs::create_dir(&hidden).unwrap();
    for file in files {
        std::fs::rename(folder.path().join(file), hidden.join(file)).unwrap();
    }
    let project = Project::load(&path).unwrap();
    for file in files {
        let told = project.warnings.iter().any(|warning| warning.message.contains(file));
        assert!(told, "{file}: {:?}", project.warnings);
    }
    Project::save(&path, &project.document, &project.meta).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
    for file in files {
        std::fs::rename(hidden.join(file), folder.path().join(file)).unwrap();
    }
    let again = Project::load(&path).unwrap();
    assert!(again.warnings.is_empty() && again.document == whole);
}

#[test]
fn files_outside_of_the_folder_are_read_by_permission_only() {
    let root = tempfile::tempdir().unwrap();
    let (inside, outside) = (root.path().join("project"), root.path().join("elsewhere"));
    std::fs::create_dir(&inside).unwrap();
    std::fs::create_dir(&outside).unwrap();
    let path = inside.join("scene.caustica.json");
    let whole = with_files(&outside);
    Project::save(&path, &whole, &meta()).unwrap();
    let before = std::fs::read_to_string(&path).unwrap();
    let refused = Project::load(&path).unwrap();
    let named = ["model.gltf", "dust.xyz", "sky.exr"].map(|file| outside.join(file));
    assert_eq!(refused.outside, named);
    assert!(refused.document.prefabs().all(|(_, prefab)| prefab.missing));
    Project::save(&path, &refused.document, &refused.meta).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), before, "what was not read is kept");
    let allowed = ImportOptions { outside_project: true, ..ImportOptions::default() };
    let read = Project::load_with_progress(&path, &allowed, &|_, _| ()).unwrap();
    assert!(read.outside.is_empty() && read.document == whole);
}

#[test]
fn what_a_project_may_not_name_is_never_read() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("project");
    std::fs::create_dir(&folder).unwrap();
    let path = folder.join("scene.caustica.json");
    let outside = root.path().join("model.gltf");
    crate::common::model(root.path());
    let absolute = outside.display().to_string();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&outside, folder.join("link.gltf")).unwrap();
    let allowed = ImportOptions { outside_project: true, ..ImportOptions::default() };
    for (source, by_permission) in [
        ("../model.gltf", true),
        (absolute.as_str(), true),
        ("x/../../model.gltf", true),
        ("link.gltf", cfg!(unix)),
        ("%2e%2e/model.gltf", false),
        ("..%2fmodel.gltf", false),
        ("..\\model.gltf", cfg!(windows)),
        ("C:\\model.gltf", false),
        ("//host/model.gltf", false),
        ("\\\\host\\model.gltf", false),
        ("http://host/model.gltf", false),
        ("file:///model.gltf", false),
        ("", false),
        ("a\0b", false),
        (".", false),
    ] {
        let prefab = serde_json::json!({"id": 1, "name": "m", "source": source});
        let text = serde_json::json!({"caustica": 2, "prefabs": [prefab]}).to_string();
        std::fs::write(&path, text).unwrap();
        let is_read = |options: &ImportOptions| {
            let project = Project::load_with_progress(&path, options, &|_, _| ()).unwrap();
            let read = project.document.prefabs().all(|(_, prefab)| !prefab.missing);
            assert_eq!(read, project.warnings.is_empty(), "{source}: {:?}", project.warnings);
            read
        };
        assert!(!is_read(&ImportOptions::default()), "{source}");
        assert_eq!(is_read(&allowed), by_permission, "{source}");
    }
}

#[test]
fn unplaced_shapes_are_no_part_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let mut document = Document::new();
    let source = ShapeSource::File(ShapeFile { path: folder.path().join("absent.xyz"), shapes: None });
    let (node, add) = document.add_shapes_edit("Dust", source, &[], trs(0.0, 0.0, 1.0)).unwrap();
    document.apply(add).unwrap();
    let mesh = document.mesh_of(Target::node(node)).unwrap();
    let mesh_from_primitive = glam::DAffine3::from_translation(glam::DVec3::X);
    document.apply(Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive }).unwrap();
    document.apply(Edit::RemoveNode { node }).unwrap();
    Project::save(&path, &document, &meta()).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "a move of what is not there: {:?}", project.warnings);
    assert!(project.document.nodes().all(|(_, node)| !matches!(node.kind, NodeKind::Mesh { .. })));
}
