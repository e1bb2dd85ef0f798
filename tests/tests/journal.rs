//! A process that is killed loses at most its last edit: it edits at random, it is killed at random, and what is recovered
//! is the scene that it had, or the one after its next edit. No device.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use caustica::open_scene::OpenScene;
use caustica_scene::{Document, Node, NodeKind, Project, ProjectMeta};
use caustica_tests::edits::{Steps, open};
use caustica_tests::models::cube;
use caustica_tests::numbers::Random;
use caustica_tests::program::caustica;

/// How often a process is killed.
const KILLS: u64 = 100;
/// Longest life, milliseconds: some end while the scene is recovered, some after thousands of edits.
const LONGEST_LIFE_MS: f64 = 120.0;

/// Starts a process that edits and kills it after a while; how many steps it has told of.
fn one_life(project: &Path, journals: &Path, model: &Path, seed: u64, life: Duration) -> usize {
    let mut process = Command::new(env!("CARGO_BIN_EXE_edit_until_killed"))
        .args([project, journals, model])
        .arg(seed.to_string())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the process starts");
    let mut output = process.stdout.take().expect("its output");
    let reader = std::thread::spawn(move || {
        let mut told = Vec::new();
        output.read_to_end(&mut told).map(|_| told.len())
    });
    std::thread::sleep(life);
    let ended = process.try_wait().expect("the process");
    assert!(ended.is_none(), "it ended by itself: {ended:?}");
    process.kill().expect("a signal that nothing can catch");
    process.wait().expect("the end");
    reader.join().expect("the reader").expect("what it told")
}

/// What a project file would say.
fn text_of(document: &Document, folder: &Path) -> String {
    let path = folder.join("compared.caustica.json");
    Project::save(&path, document, &ProjectMeta::default()).expect("a file");
    std::fs::read_to_string(path).expect("a file")
}

/// The scene as the journals say it; they are copied to `copy`, because the next process goes on with them.
fn recovered(project: &Path, journals: &Path, copy: &Path) -> (OpenScene, bool) {
    for file in std::fs::read_dir(journals).into_iter().flatten().flatten() {
        std::fs::copy(file.path(), copy.join(file.file_name())).expect("a copy");
    }
    open(project, copy)
}

#[test]
fn a_killed_process_loses_at_most_its_last_edit() {
    let root = tempfile::tempdir().expect("a folder");
    let root = root.path().canonicalize().expect("a folder");
    let (project, journals) = (root.join("scene.caustica.json"), root.join("journals"));
    let model = root.join("cube.gltf");
    std::fs::write(&model, cube(true)).expect("a model");
    let mut scene = OpenScene::new();
    scene.save(&project).expect("a project");
    let (mut random, mut copied) = (Random::new(12), None);
    let (mut told_of, mut unheard, mut from_journal) = (0, 0, 0);
    for seed in 0..KILLS {
        let life = Duration::from_secs_f64(random.between(0.0, LONGEST_LIFE_MS) / 1e3);
        let told = one_life(&project, &journals, &model, seed, life);
        let mut steps = Steps::new(seed, &model);
        (0..told).for_each(|_| steps.step(&mut scene, |_| ()));
        let copy = tempfile::tempdir().expect("a folder");
        let (found, has_journal) = recovered(&project, &journals, copy.path());
        let is_now = |scene: &OpenScene| {
            // Without a journal there is nothing to undo, and what only undo could bring back is gone.
            let same_file =
                || !has_journal && text_of(found.document(), &root) == text_of(scene.document(), &root);
            found.document() == scene.document() || same_file()
        };
        if !is_now(&scene) {
            steps.step(&mut scene, |_| ());
            unheard += 1;
            assert!(is_now(&scene), "life {seed} of {life:?}, after {told} steps");
        }
        told_of += told;
        from_journal += u64::from(has_journal);
        (scene, copied) = (found, Some(copy));
    }
    drop(copied);
    println!(
        "{told_of} steps told of, {unheard} kept but not told of, {from_journal} recovered from a journal"
    );
    assert!(told_of > 1000 && from_journal > KILLS / 2, "too few edits to mean anything");
}

#[test]
fn what_another_editor_has_saved_is_kept() {
    let root = tempfile::tempdir().expect("a folder");
    let project = root.path().join("scene.caustica.json");
    OpenScene::new().save(&project).expect("a project");
    let [mut ours, mut theirs] = ["ours", "theirs"].map(|name| open(&project, &root.path().join(name)).0);
    let add = |scene: &mut OpenScene, name: &str| {
        let node = Node::new(name, NodeKind::Group);
        scene.edit_with(|document| document.add_edit(node, None)).expect("an edit");
        scene.save(&project).expect("it is saved");
        scene.take_set_aside()
    };
    assert_eq!(add(&mut theirs, "their group"), None);
    let kept = add(&mut ours, "our group").expect("their file is kept");
    assert!(std::fs::read_to_string(kept).expect("a file").contains("their group"));
    assert!(std::fs::read_to_string(&project).expect("a file").contains("our group"));
    assert_eq!(add(&mut ours, "another"), None, "now it is ours");
}

#[test]
fn the_command_line_tells_of_unsaved_changes() {
    let root = tempfile::tempdir().expect("a folder");
    let root = root.path().canonicalize().expect("a folder");
    let project = root.join("scene.caustica.json");
    // Where `caustica` has its data in tests.
    let journals = root.join("data/caustica/journals");
    std::fs::write(root.join("cube.gltf"), cube(false)).expect("a model");
    OpenScene::new().save(&project).expect("a project");
    let quiet = caustica(&root, &["check", "scene.caustica.json"]);
    assert_eq!((quiet.code, quiet.stderr.as_str()), (Some(0), ""));
    let (mut scene, _) = open(&project, &journals);
    let (light, group) = (Node::new("a", NodeKind::Group), Node::new("b", NodeKind::Group));
    for node in [light, group] {
        scene.edit_with(|document| document.add_edit(node, None)).expect("an edit");
    }
    let living = caustica(&root, &["check", "scene.caustica.json"]);
    assert!(living.stderr.contains("scene.caustica.json: is being edited"), "{}", living.stderr);
    assert_eq!(living.code, Some(0));
    // As if it belonged to a process that was killed, and that nobody has taken leave of.
    let mut dead = std::process::Command::new("sleep").arg("600").spawn().expect("a process");
    dead.kill().expect("a signal that nothing can catch");
    let journal = std::fs::read_dir(&journals).expect("a folder").next().expect("a journal").expect("a file");
    std::fs::rename(journal.path(), journals.join(format!("1-{}.journal", dead.id()))).expect("another name");
    let ending = caustica(&root, &["check", "scene.caustica.json"]);
    assert!(ending.stderr.contains("its editor is just ending"), "{}", ending.stderr);
    dead.wait().expect("the end");
    drop(scene);
    for arguments in
        [["check", "scene.caustica.json"].as_slice(), &["export", "scene.caustica.json", "-o", "a.glb"]]
    {
        let run = caustica(&root, arguments);
        let told = ["scene.caustica.json", "2 unsaved edits", "recover"];
        assert!(told.iter().all(|words| run.stderr.contains(words)), "{arguments:?}: {}", run.stderr);
    }
}

#[test]
fn a_project_reads_outside_of_its_folder_when_it_may() {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("project");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::write(root.path().join("cube.gltf"), cube(false)).expect("a model");
    let text = r#"{"caustica": 2, "prefabs": [{"id": 1, "name": "cube", "source": "../cube.gltf"}],
        "nodes": [{"id": 2, "name": "cube", "prefab": 1}]}"#;
    std::fs::write(folder.join("a.caustica.json"), text).expect("a project");
    let refused = caustica(&folder, &["check", "a.caustica.json"]);
    assert!(refused.stderr.contains("outside of the folder"), "{}", refused.stderr);
    let allowed = caustica(&folder, &["check", "a.caustica.json", "--outside"]);
    assert_eq!((allowed.code, allowed.stderr.as_str()), (Some(0), ""));
    assert!(allowed.stdout.contains("12 triangles"), "{}", allowed.stdout);
}
