//! The journal in one process: every kind of edit comes back, files are named and not written out, a torn end is dropped,
//! and what a project file has become meanwhile is noticed. `tests/tests/journal.rs` kills processes.

use std::path::{Path, PathBuf};

use crate::common::{LAMP, PLATE, scene, trs};
use crate::projects::{edited, meta};
use caustica_scene::import::{ImportOptions, load_environment, load_shapes};
use caustica_scene::{
    Document, Edit, Environment, EnvironmentFile, HeldJournal, Journal, LeftBehind, Material, MaterialEntry,
    MaterialId, MeshId, Node, NodeKind, OverrideField, Project, ProjectMeta, Recovered, ShapeSource,
};
use glam::Vec3;

/// A document whose edits are kept, as the editor has it.
struct Kept {
    document: Document,
    journal: Journal,
    folder: PathBuf,
}

impl Kept {
    /// A document without a file.
    fn unsaved(root: &Path, document: Document) -> Self {
        let folder = root.join("journals");
        Self { document, journal: Journal::new(&folder), folder }
    }

    /// A document that was saved.
    fn saved(root: &Path, document: Document) -> (Self, PathBuf) {
        let path = root.join("scene.caustica.json");
        let mut kept = Self::unsaved(root, document);
        kept.save(&path);
        (kept, path)
    }

    fn save(&mut self, path: &Path) {
        let file = Project::save(path, &self.document, &meta()).unwrap();
        self.journal.saved(path, file, &self.document);
    }

    /// Applies an edit; what undoes it.
    fn push(&mut self, edit: Edit) -> Edit {
        let inverse = self.document.apply_back(edit.clone()).unwrap();
        self.journal.append(&edit, &self.document, &meta()).unwrap();
        inverse
    }

    /// The process dies.
    fn die(self) -> (Document, PathBuf) {
        (self.document, self.folder)
    }
}

fn recover(folder: &Path) -> Recovered {
    let mut left = LeftBehind::find(folder);
    assert_eq!(left.len(), 1);
    left.remove(0).recover(&ImportOptions::default(), &|_, _| ()).unwrap()
}

/// One edit of every kind, each with what undoes it in turn, on a scene of [`edited`]. `whole`: also what only the whole scene
/// can say, a mesh with moved primitives that comes back.
fn all_kinds(root: &Path, kept: &mut Kept, scene: &crate::common::Scene, whole: bool) {
    let part = scene.part(PLATE);
    let shapes = root.join("dust.xyz");
    std::fs::write(&shapes, "0 0 0 1\n1 0 0 1 2 3\n").unwrap();
    let map = root.join("sky.exr");
    image::Rgb32FImage::from_pixel(4, 2, image::Rgb([0.5, 1.0, 2.0])).save(&map).unwrap();
    let sky = |rotation_rad| {
        let map_read = load_environment(&map).unwrap().0;
        let file =
            EnvironmentFile { path: map.clone(), rotation_rad, scale: 1.0, map: Some(map_read.into()) };
        Edit::SetEnvironment(Environment::File(file))
    };
    let document = &mut kept.document;
    let light = document.light_of(scene.part(LAMP)).unwrap();
    let camera = document.camera_of(part).unwrap();
    let own = MaterialId(document.allocate_id());
    let entry = Box::new(MaterialEntry::made_here(Material::default()));
    let first = document.materials().next().map(|(id, value)| (id, value.clone())).unwrap();
    let source = ShapeSource::File(load_shapes(&shapes).unwrap());
    let (dust, add_dust) = document.add_shapes_edit("Dust", source, &[], trs(0.0, 0.0, 1.0)).unwrap();
    let mesh = MeshId(dust.0 - 1);
    let group = document.add_edit(Node::new("New", NodeKind::Group), Some(scene.group)).1;
    let (_, copy) = document.duplicate_edit(scene.second).unwrap();
    let (again, import) = document.import_edit(crate::common::model(root));
    let reload = document.reload_edit(scene.prefab, crate::common::model(root)).unwrap();
    let unique = document.make_unique_edit(scene.first).unwrap().edit;
    let merged = document.merge_edit(&document.clone(), "again").unwrap().edit;
    let sphere = ShapeSource::Cloud(caustica_scene::Cloud { count: 5, ..Default::default() });
    let mut edits = vec![
        Edit::SetTransform { target: part, local: trs(0.1 + 0.2, 0.3, 1.0) },
        Edit::Rename { target: part, name: "line\nbreak \"ü\"".into() },
        Edit::SetVisible { target: part, visible: false },
        Edit::SetRayVisibility { target: part, camera_visible: false, casts_shadows: true },
        Edit::SetClip { node: scene.first, clip: caustica_scene::ClipChoice::All },
        Edit::SetVariant { node: scene.first, variant: Some("glowing".into()) },
        Edit::SetLocked { node: scene.group, locked: true },
        unique,
        merged,
        Edit::AddMaterial { material: own, entry },
        Edit::AssignMaterial { target: part, primitive: 0, material: own },
        Edit::ResetOverride { target: part, field: OverrideField::Material(0) },
        Edit::SetMaterial { material: first.0, value: Box::new(Material { roughness: 0.123, ..first.1 }) },
        Edit::RemoveMaterial { material: own },
        Edit::SetLight { target: scene.part(LAMP), light: caustica_scene::Light { intensity: 0.1, ..light } },
        Edit::SetCamera { target: part, camera: caustica_scene::Camera { near_m: 0.7, ..camera } },
        sky(0.1),
        sky(0.2),
        Edit::SetEnvironment(Environment::Constant(Vec3::splat(0.1))),
        Edit::SetDefaultCamera(Some(scene.camera.into())),
        group,
        copy,
        Edit::RemoveNode { node: scene.light },
        Edit::Reparent { node: scene.second, parent: Some(scene.group), index: 0, local: trs(1.0, 2.0, 3.0) },
        add_dust,
        Edit::SetPrimitiveTransform {
            mesh,
            primitive: 1,
            mesh_from_primitive: glam::DAffine3::from_rotation_x(0.3),
        },
        Edit::SetShapes { mesh, source: Box::new(sphere) },
        Edit::RemoveNode { node: dust },
        import,
        Edit::RemovePrefab { prefab: again },
        reload,
    ];
    edits.extend(whole.then_some(Edit::RemoveMesh { mesh }));
    let mut undo: Vec<Edit> = edits.into_iter().map(|edit| kept.push(edit)).collect();
    let mut redo = Vec::new();
    while let Some(edit) = undo.pop() {
        redo.push(kept.push(edit));
    }
    while let Some(edit) = redo.pop() {
        kept.push(edit);
    }
}

#[test]
fn every_kind_of_edit_comes_back() {
    for (saved, whole) in [(true, false), (true, true), (false, false)] {
        let root = tempfile::tempdir().unwrap();
        let scene = edited(root.path());
        let mut kept = match saved {
            true => Kept::saved(root.path(), scene.document.clone()).0,
            false => Kept::unsaved(root.path(), scene.document.clone()),
        };
        all_kinds(root.path(), &mut kept, &scene, whole);
        let next_id = kept.document.next_id();
        let (document, folder) = kept.die();
        let recovered = recover(&folder);
        let warnings = &recovered.project.warnings;
        assert!(warnings.is_empty(), "{warnings:?}");
        assert!(recovered.project.document == document);
        assert_eq!(recovered.project.document.next_id(), next_id);
        assert_eq!((recovered.path.is_some(), recovered.base_is_saved), (saved, saved && !whole));
        assert_eq!(recovered.project.meta, meta());
        if recovered.base_is_saved {
            // Back to the file, step by step.
            let mut document = recovered.project.document;
            for step in recovered.steps.into_iter().rev() {
                document.apply_back(step.inverse).unwrap();
            }
            assert!(document == scene.document);
        }
    }
}

#[test]
fn wherever_the_end_is_torn_the_edits_before_it_come_back() {
    let root = tempfile::tempdir().unwrap();
    let scene = scene(root.path());
    let (mut kept, _) = Kept::saved(root.path(), scene.document.clone());
    let mut states = Vec::new();
    for x in 0..3 {
        kept.push(Edit::SetTransform { target: scene.second.into(), local: trs(f64::from(x), 0.0, 1.0) });
        let length = std::fs::metadata(kept.journal.path().unwrap()).unwrap().len();
        states.push((length as usize, kept.document.clone()));
    }
    let name = kept.journal.path().unwrap().to_owned();
    let (_, folder) = kept.die();
    let whole = std::fs::read(&name).unwrap();
    for cut in 0..=whole.len() {
        std::fs::write(&name, &whole[..cut]).unwrap();
        let expected = states.iter().rfind(|(length, _)| *length <= cut);
        let mut left = LeftBehind::find(&folder);
        match (expected, left.pop()) {
            (Some((length, document)), Some(left)) => {
                let recovered = left.recover(&ImportOptions::default(), &|_, _| ()).unwrap();
                assert!(recovered.project.document == *document, "cut at {cut}");
                assert_eq!(
                    std::fs::metadata(&name).unwrap().len() as usize,
                    *length,
                    "goes on after {length}"
                );
            }
            (None, None) => {}
            (expected, left) => panic!("cut at {cut}: {} {left:?}", expected.is_some()),
        }
    }
}

#[test]
fn a_damaged_line_in_the_middle_is_told_of_and_a_copy_is_kept() {
    let root = tempfile::tempdir().unwrap();
    let scene = scene(root.path());
    let (mut kept, _) = Kept::saved(root.path(), scene.document.clone());
    for x in 0..3 {
        kept.push(Edit::SetTransform { target: scene.second.into(), local: trs(f64::from(x), 0.0, 1.0) });
    }
    let name = kept.journal.path().unwrap().to_owned();
    let (_, folder) = kept.die();
    let mut bytes = std::fs::read(&name).unwrap();
    let place = bytes.len() - 250;
    bytes[place] ^= 4;
    std::fs::write(&name, &bytes).unwrap();
    assert!(recover(&folder).steps.len() < 3);
    assert_eq!(std::fs::read(name.with_extension("damaged")).unwrap(), bytes);
}

#[test]
fn a_living_process_keeps_its_journal_and_saving_ends_it() {
    let root = tempfile::tempdir().unwrap();
    let scene = scene(root.path());
    let (mut kept, path) = Kept::saved(root.path(), scene.document.clone());
    let rename = |name: &str| Edit::Rename { target: scene.first.into(), name: name.into() };
    assert!(kept.journal.path().is_none(), "nothing is unsaved");
    kept.push(rename("a"));
    let (left, mut held) = LeftBehind::survey(&kept.folder);
    assert!(left.is_empty(), "its process lives");
    assert_eq!((held.len(), held[0].project(), held[0].is_ending()), (1, Some(path.as_path()), false));
    assert!(HeldJournal::look_again(&mut held).is_empty() && held.len() == 1, "it still lives");
    kept.save(&path);
    assert!(HeldJournal::look_again(&mut held).is_empty() && held.is_empty(), "it has saved");
    assert_eq!(std::fs::read_dir(&kept.folder).unwrap().count(), 0);
    kept.push(rename("b"));
    let (_, mut held) = LeftBehind::survey(&kept.folder);
    let (document, folder) = kept.die();
    let left = HeldJournal::look_again(&mut held);
    assert!(held.is_empty(), "it has died since");
    assert_eq!((left.len(), left[0].edits, left[0].project()), (1, 1, Some(path.as_path())));
    assert!(LeftBehind::find(&folder).is_empty(), "who found it first has it");
    drop(left);
    // It goes on after it was recovered, and is found again.
    let Recovered { project, mut journal, .. } = recover(&folder);
    assert!(project.document == document);
    let mut document = project.document;
    document.apply(rename("c")).unwrap();
    journal.append(&rename("c"), &document, &project.meta).unwrap();
    drop(journal);
    assert!(recover(&folder).project.document == document);
    LeftBehind::find(&folder).remove(0).discard();
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn a_project_that_has_changed_since_is_noticed() {
    for saves in [1, 2] {
        let root = tempfile::tempdir().unwrap();
        let scene = scene(root.path());
        let (mut kept, path) = Kept::saved(root.path(), scene.document.clone());
        let rename = |target, name: &str| Edit::Rename { target, name: name.into() };
        kept.push(rename(scene.first.into(), "mine"));
        kept.push(rename(scene.second.into(), "mine too"));
        let (mut expected, folder) = kept.die();
        // Another process saves: once, and the backup is what the edits follow.
        let mut other = scene.document.clone();
        other.apply(Edit::RemoveNode { node: scene.second }).unwrap();
        for _ in 0..saves {
            Project::save(&path, &other, &ProjectMeta::default()).unwrap();
        }
        let recovered = recover(&folder);
        let texts: Vec<String> = recovered.project.warnings.iter().map(ToString::to_string).collect();
        assert!(texts.iter().any(|text| text.contains("has changed since")), "{texts:?}");
        // Twice, and what fits is applied to what is there.
        assert_eq!(texts.iter().any(|text| text.contains("does not fit")), saves == 2, "{texts:?}");
        if saves == 2 {
            expected = other;
            expected.apply(rename(scene.first.into(), "mine")).unwrap();
        }
        assert!(recovered.project.document == expected);
        let asks = recovered.path.is_none() && !recovered.base_is_saved;
        assert!(asks, "saving must not replace the other's work unasked");
        drop(recovered);
        // From now on the file does not matter.
        std::fs::remove_file(&path).unwrap();
        assert!(recover(&folder).project.document == expected);
    }
}

#[test]
fn unsaved_changes_stay_when_their_project_is_gone() {
    let root = tempfile::tempdir().unwrap();
    let scene = scene(root.path());
    let (mut kept, path) = Kept::saved(root.path(), scene.document.clone());
    kept.push(Edit::Rename { target: scene.first.into(), name: "mine".into() });
    let (document, folder) = kept.die();
    let hidden = root.path().join("hidden");
    std::fs::rename(&path, &hidden).unwrap();
    let left = LeftBehind::find(&folder).remove(0);
    let error = left.recover(&ImportOptions::default(), &|_, _| ()).unwrap_err();
    assert_eq!(error.file, path);
    std::fs::rename(&hidden, &path).unwrap();
    assert!(recover(&folder).project.document == document);
}

#[test]
fn a_journal_that_cannot_be_written_goes_on_with_the_whole_scene() {
    let root = tempfile::tempdir().unwrap();
    let scene = scene(root.path());
    let (mut kept, _) = Kept::saved(root.path(), scene.document.clone());
    let rename = |name: &str| Edit::Rename { target: scene.first.into(), name: name.into() };
    // A file where the folder should be.
    std::fs::write(&kept.folder, "").unwrap();
    kept.document.apply(rename("lost")).unwrap();
    assert!(kept.journal.append(&rename("lost"), &kept.document, &meta()).is_err());
    std::fs::remove_file(&kept.folder).unwrap();
    kept.push(Edit::SetVisible { target: scene.second.into(), visible: false });
    kept.push(Edit::SetVisible { target: scene.second.into(), visible: true });
    let (document, folder) = kept.die();
    assert!(recover(&folder).project.document == document);
}

/// Edits of which the time is printed.
const TIMED: usize = 1000;

/// Times are printed and never judged: a shared machine is no clock.
#[test]
fn an_edit_costs_the_same_bytes_in_any_scene() {
    let root = tempfile::tempdir().unwrap();
    let mut lengths = Vec::new();
    for nodes in [10_u64, 100_000] {
        let mut document = Document::new();
        let mut last = None;
        for _ in 0..nodes {
            let (id, edit) = document.add_edit(Node::new("n", NodeKind::Group), None);
            document.apply(edit).unwrap();
            last = Some(id);
        }
        let (mut kept, _) = Kept::saved(root.path(), document);
        let move_to = |x: f64| Edit::SetTransform { target: last.unwrap().into(), local: trs(x, 0.0, 1.0) };
        let mut length = 0;
        for x in 0..3 {
            kept.push(move_to(f64::from(x)));
            let now = std::fs::metadata(kept.journal.path().unwrap()).unwrap().len();
            lengths.push(now - length);
            length = now;
        }
        let mut times = Vec::new();
        for x in 0..TIMED {
            let start = std::time::Instant::now();
            kept.journal.append(&move_to(x as f64), &kept.document, &meta()).unwrap();
            times.push(start.elapsed());
        }
        times.sort();
        let (median, slow) = (times[TIMED / 2], times[TIMED * 99 / 100]);
        println!(
            "{nodes} nodes: an edit is {length} bytes, kept in {median:?}, 99 of 100 in {slow:?}",
            length = lengths[lengths.len() - 1]
        );
    }
    // The first of each comes with the head; ids and numbers of the large scene have some digits more.
    assert!(lengths[4] < lengths[1] + 16 && lengths[3] < lengths[0] + 64, "{lengths:?}");
}

#[test]
fn what_a_project_keeps_besides_comes_back_once_the_journal_has_the_scene() {
    let root = tempfile::tempdir().unwrap();
    let scene = edited(root.path());
    let (mut kept, path) = Kept::saved(root.path(), scene.document.clone());
    let mut file: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    file["nodes"][0]["colour"] = "red".into();
    let other = root.path().join("other.caustica.json");
    std::fs::write(&other, file.to_string()).unwrap();
    let other = Project::load(&other).unwrap();
    kept.push(Edit::Rename { target: scene.light.into(), name: "Moon".into() });
    let mut with_it = meta();
    with_it.keep_of(&other.meta, Some);
    assert_ne!(with_it, meta());
    kept.journal.append_scene(&kept.document, &with_it).unwrap();
    kept.push(Edit::Rename { target: scene.light.into(), name: "Star".into() });
    let (document, folder) = kept.die();
    let recovered = recover(&folder);
    assert!(recovered.project.document == document);
    assert_eq!((recovered.project.meta, recovered.path.as_deref()), (with_it, Some(path.as_path())));
    assert_eq!(recovered.steps.len(), 1, "what came after the scene");
}
