//! Shaders edited while the renderer runs: every file in turn, harmlessly, with an error, with a binding that the host does not
//! give, and back. At every step there is a picture, and it is the one that the last good shaders make.
#![expect(clippy::expect_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod misfits;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use caustica_renderer::shader::{ShaderFault, ShaderSources, ShaderStatus};
use caustica_renderer::{NeedsMode, Pipeline, Primary, Show, ViewSettings};
use caustica_tests::desktop::wait_for;
use caustica_tests::models::cube;
use caustica_tests::picture::bits;
use caustica_tests::program::program;
use caustica_tests::scene::zoo;
use caustica_tests::shapes::{at, ball, mesh_of};
use caustica_tests::studio::Studio;
use caustica_tests::{scene, shader_folder};

/// So long a change may take before the test gives up; nothing is measured.
const PATIENCE: Duration = Duration::from_secs(120);
const EXTENT: [u32; 2] = [24, 16];

/// A copy of the shaders that a test may spoil.
struct Folder(tempfile::TempDir);

/// How a program saves a file.
#[derive(Clone, Copy)]
enum Save {
    InPlace,
    RenamedOver,
    InTwoSteps,
}

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        copy(&shader_folder(), folder.path());
        Self(folder)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.0.path().join(file)
    }

    fn text(&self, file: &str) -> String {
        fs::read_to_string(self.path(file)).expect("a shader")
    }

    fn save(&self, file: &str, text: &str, how: Save) {
        let path = self.path(file);
        match how {
            Save::InPlace => fs::write(&path, text),
            Save::RenamedOver => {
                let other = path.with_extension("new");
                fs::write(&other, text).and_then(|()| fs::rename(&other, &path))
            }
            Save::InTwoSteps => {
                let half = text.len() / 2;
                let half = (0..=half).rev().find(|at| text.is_char_boundary(*at)).unwrap_or_default();
                fs::write(&path, &text[..half]).and_then(|()| fs::write(&path, text))
            }
        }
        .expect("a saved shader");
    }
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            fs::create_dir(&target).expect("a folder");
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

/// Renders on until the status is as wanted.
fn until(studio: &mut Studio, what: &str, wanted: impl Fn(&ShaderStatus) -> bool) -> ShaderStatus {
    let start = Instant::now();
    loop {
        studio.frames(1);
        let status = studio.renderer.shader_status();
        if wanted(&status) {
            return status;
        }
        assert!(start.elapsed() < PATIENCE, "{what}: {status:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn studio(folder: &Folder, settings: ViewSettings) -> Studio {
    let (mut scene, camera) = zoo();
    scene.put(mesh_of(&[ball(0.3)]), scene::lambert(0.6), at(0.2, 0.3, 0.8));
    let mut studio = Studio::editing(folder.0.path(), EXTENT, settings);
    studio.view_mut().set_camera(camera);
    studio.apply(&scene.delta);
    studio.view_mut().measure();
    studio.frames(2);
    studio
}

/// The picture after two samples from the start.
fn picture(studio: &mut Studio) -> Vec<[u32; 3]> {
    // Any change of the settings begins anew.
    studio.set(|settings| settings.seed ^= 1);
    studio.set(|settings| settings.seed ^= 1);
    bits(&studio.mean(2))
}

/// What together uses every shader.
fn ways() -> Vec<ViewSettings> {
    let settings = |pipeline, primary, show, temporal| ViewSettings {
        pipeline,
        primary,
        show,
        temporal,
        needs: NeedsMode::All,
        ..ViewSettings::default()
    };
    vec![
        settings(Pipeline::Hybrid, Primary::Raster, Show::Image, true),
        settings(Pipeline::Hybrid, Primary::Rays, Show::Shadow, false),
        settings(Pipeline::Raster, Primary::Raster, Show::NonFinite, false),
        settings(Pipeline::Raster, Primary::Raster, Show::Wireframe, false),
        settings(Pipeline::Raster, Primary::Raster, Show::Normal, false),
        settings(Pipeline::Raster, Primary::Raster, Show::Error, false),
        settings(Pipeline::Path, Primary::Rays, Show::Image, false),
    ]
}

fn names(faults: &[ShaderFault]) -> BTreeSet<&str> {
    faults.iter().map(|fault| fault.file.as_str()).collect()
}

fn edit_in_turn(folder: &Folder, studio: &mut Studio, file: &str, how: Save) {
    let good = picture(studio);
    let text = folder.text(file);
    let main = studio.renderer.shader_files().contains_key(file);
    let edit = |studio: &mut Studio, text: &str, what: &str, wanted: &dyn Fn(&ShaderStatus) -> bool| {
        folder.save(file, text, how);
        let status = until(studio, &format!("{file}, {what}"), wanted);
        assert!(picture(studio) == good, "{file}, {what}: another picture");
        status
    };
    let before = studio.renderer.shader_status().reloads;
    let harmless = format!("{text}\n// harmless\n");
    let status =
        edit(studio, &harmless, "harmless", &|status| status.reloads > before && status.faults.is_empty());
    let last = status.last.expect("a reload");
    assert_eq!((last.files, status.faults.len()), (vec![file.to_owned()], 0));

    let line = text.lines().count() as u32 + 2;
    let wrong =
        format!("{text}\nfloat wrong() {{ return unheard_of; }}\nfloat also() {{ return nor_this; }}\n");
    let is_whole =
        |status: &ShaderStatus| status.faults.iter().any(|fault| fault.message.contains("nor_this"));
    let status = edit(studio, &wrong, "an error", &is_whole);
    for (word, line, column) in [("unheard_of", line, 24), ("nor_this", line + 1, 23)] {
        let of_word = |fault: &&ShaderFault| fault.message.contains(word);
        let fault = status.faults.iter().find(of_word).unwrap_or_else(|| panic!("{:?}", status.faults));
        assert_eq!((fault.file.as_str(), fault.line, fault.column), (file, Some(line), Some(column)));
        assert!(fault.source_line.as_ref().is_some_and(|line| line.contains(word)), "{fault}");
    }

    if main && text.contains("void main() {") {
        let binding = "layout(set = 1, binding = 30, rgba16f) uniform writeonly image2D not_given;\nvoid main() {\n\
                       imageStore(not_given, ivec2(0), vec4(0.0));\n";
        let wrong = text.replacen("void main() {", binding, 1);
        let is_refused =
            |status: &ShaderStatus| status.faults.iter().any(|fault| fault.message.contains("not_given"));
        let status = edit(studio, &wrong, "a binding", &is_refused);
        assert_eq!(names(&status.faults), BTreeSet::from([file]));
    }
    let status = edit(studio, &text, "back", &|status| status.faults.is_empty() && !status.compiling);
    assert!(status.reloads > before, "{file}");
}

/// All takes ten minutes on a busy processor: by default the stages of `hybrid`, and a few files that are included.
#[test]
fn every_shader_is_edited_in_turn_and_there_is_always_a_picture() {
    let all = std::env::var_os("CAUSTICA_RELOAD_ALL").is_some();
    let folder = Folder::new();
    let included = ["lib/brdf.glsl", "shared/scene.glsl", "passes/rays/shape_hit.glsl"];
    let mut seen: BTreeSet<String> = BTreeSet::new();
    let saves = [Save::InPlace, Save::RenamedOver, Save::InTwoSteps];
    for (number, (way, how)) in ways().into_iter().zip(saves.into_iter().cycle()).enumerate() {
        let is_first = number == 0;
        let mut studio = studio(&folder, way);
        let files = studio.renderer.shader_files();
        let every: BTreeSet<String> =
            files.iter().flat_map(|(main, others)| others.iter().chain([main])).cloned().collect();
        for file in every {
            let wanted = all || files.contains_key(&file) || included.contains(&file.as_str());
            if seen.insert(file.clone()) && wanted && (all || is_first) {
                edit_in_turn(&folder, &mut studio, &file, how);
            }
        }
    }
    let unused: Vec<String> =
        ShaderSources::built_in_files().into_iter().filter(|file| !seen.contains(file)).collect();
    assert!(unused.iter().all(|file| file.ends_with(".md")), "no way uses {unused:?}");
}

/// What version control, links and build systems do, and what is no file.
#[cfg(unix)]
#[test]
fn folders_are_followed_wherever_they_go_and_what_is_no_file_is_not_waited_for() {
    let folder = Folder::new();
    let mut studio = studio(&folder, ViewSettings { pipeline: Pipeline::Raster, ..ViewSettings::default() });
    let (file, good) = ("passes/post/post.comp", picture(&mut studio));
    let text = folder.text(file);
    let is_good = |status: &ShaderStatus| status.faults.is_empty() && !status.compiling;
    let says = |words: &'static str| {
        move |status: &ShaderStatus| status.faults.iter().any(|fault| fault.to_string().contains(words))
    };
    until(&mut studio, "the start", is_good);
    fs::rename(folder.path("lib"), folder.path("other")).expect("a renamed folder");
    let status = until(&mut studio, "renamed away", says("there is no such file"));
    assert!(status.faults[0].line.is_some(), "{:?}", status.faults);
    fs::rename(folder.path("other"), folder.path("lib")).expect("a renamed folder");
    until(&mut studio, "renamed in", is_good);

    fs::remove_dir_all(folder.0.path()).expect("a removed folder");
    until(&mut studio, "removed", says("the folder of the shaders is not there"));
    assert!(picture(&mut studio) == good);
    fs::create_dir(folder.0.path()).expect("a folder");
    copy(&shader_folder(), folder.0.path());
    until(&mut studio, "made anew", is_good);
    let before = studio.renderer.shader_status().reloads;
    folder.save(file, &format!("{text}// anew\n"), Save::InPlace);
    until(&mut studio, "the new folder", |status| status.reloads > before);

    fs::remove_file(folder.path(file)).expect("a removed file");
    let made = Command::new("mkfifo").arg(folder.path(file)).status();
    assert!(made.expect("a pipe").success());
    until(&mut studio, "a pipe", says("post.comp: this is a pipe, a socket or a device, and no file"));
    folder.save(file, &text, Save::RenamedOver);
    until(&mut studio, "no pipe", is_good);
    assert!(picture(&mut studio) == good);
}

#[test]
fn includes_come_and_go_and_many_edits_leave_nothing_behind() {
    let folder = Folder::new();
    let mut studio = studio(&folder, ViewSettings { pipeline: Pipeline::Raster, ..ViewSettings::default() });
    let (file, own) = ("passes/post/post.comp", "lib/own.glsl");
    let text = folder.text(file);
    let good = picture(&mut studio);
    let reloads = |studio: &mut Studio, count: u64| until(studio, "own", |status| status.reloads == count);
    // An include that is not there yet, then there, then another one, then none.
    let end = text.find("void main").expect("a main function");
    let (head, body) = text.split_at(end);
    folder.save(file, &format!("{head}#include \"{own}\"\n{body}"), Save::RenamedOver);
    let status = until(&mut studio, "an include", |status| !status.faults.is_empty());
    assert!(status.faults[0].to_string().contains(own), "{:?}", status.faults);
    folder.save(own, "float own() { return 1.0; }\n", Save::InPlace);
    reloads(&mut studio, 1);
    folder.save(own, "float own() { return 2.0; }\n", Save::RenamedOver);
    let status = reloads(&mut studio, 2);
    assert_eq!(status.last.map(|last| last.files), Some(vec![own.to_owned()]));
    folder.save(file, &text, Save::InTwoSteps);
    until(&mut studio, "back", |status| status.reloads >= 3 && !status.compiling && status.faults.is_empty());
    fs::remove_file(folder.path(own)).expect("it is there");
    assert!(picture(&mut studio) == good);

    let edits: u64 = std::env::var("CAUSTICA_RELOADS").ok().and_then(|text| text.parse().ok()).unwrap_or(30);
    let settled = |studio: &mut Studio| {
        studio.frames(4);
        studio.session.device.wait_idle().expect("the device");
        (studio.session.device.memory_by_use(), resident_kib())
    };
    let mut before = settled(&mut studio);
    for edit in 0..edits {
        let start = studio.renderer.shader_status().reloads;
        folder.save(file, &format!("{text}// {edit}\n"), Save::InPlace);
        until(&mut studio, "one of many", |status| status.reloads > start);
        if edit == edits / 2 {
            before = settled(&mut studio);
        }
    }
    let after = settled(&mut studio);
    assert_eq!(after.0, before.0, "device memory");
    assert_eq!(studio.session.device.retired_objects(), 0);
    let grown = after.1.saturating_sub(before.1);
    eprintln!("{grown} KiB more on the host after {} edits", edits / 2);
}

/// Memory of this process, KiB.
fn resident_kib() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or_default()
}

/// `caustica render --watch`, ended at the end of the test.
struct Watching {
    process: Child,
    folder: tempfile::TempDir,
}

impl Watching {
    /// Starts it on a cube, with a folder of shaders, and waits for its first picture.
    fn start(shaders: &Folder) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("cube.gltf"), cube(false)).expect("a model");
        let said = fs::File::create(folder.path().join("said.txt")).expect("a file");
        let process = Command::new(program())
            .args(["render", "cube.gltf", "-o", "out.png", "--size", "24x16", "--samples", "2"])
            .args(["--pipeline", "raster", "--watch", "--shaders"])
            .arg(shaders.0.path())
            .current_dir(folder.path())
            .env("XDG_CONFIG_HOME", folder.path().join("config"))
            .env("XDG_DATA_HOME", folder.path().join("data"))
            .stdout(Stdio::null())
            .stderr(said)
            .spawn()
            .expect("the program starts");
        let watching = Self { process, folder };
        watching.wait_for_words("watching cube.gltf and");
        watching
    }

    fn wait_for_words(&self, words: &str) {
        let said = || fs::read_to_string(self.folder.path().join("said.txt")).unwrap_or_default();
        wait_for(words, PATIENCE.as_secs(), || said().contains(words).then_some(()));
    }

    /// The picture; it is whole at every moment.
    fn picture(&self) -> Vec<u8> {
        image::open(self.folder.path().join("out.png")).expect("a whole picture").to_rgb8().into_raw()
    }

    fn wait_for_picture(&self, what: &str, is_it: impl Fn(&[u8]) -> bool) {
        wait_for(what, PATIENCE.as_secs(), || is_it(&self.picture()).then_some(()));
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn render_watches_shaders_and_the_scene() {
    let shaders = Folder::new();
    let watching = Watching::start(&shaders);
    let first = watching.picture();
    let (file, what) = ("passes/post/post.comp", "vec4(display_color(frame, pixel), 1.0)");
    let text = shaders.text(file);
    assert!(text.contains(what), "{file} has no {what}");
    shaders.save(file, &text.replace(what, "vec4(1.0, 0.0, 0.0, 1.0)"), Save::InPlace);
    let is_red = |picture: &[u8]| picture.chunks_exact(3).all(|pixel| pixel == [255, 0, 0]);
    watching.wait_for_picture("a red picture", is_red);
    // A mistake of grammar, of which the compiler names no word.
    shaders.save(file, &text.replace(what, &format!("uvec2(pixel) {what}")), Save::InTwoSteps);
    let line = text.lines().position(|line| line.contains(what)).expect("a line") + 1;
    let column = text.lines().find_map(|line| line.find(what)).expect("a column") + "uvec2(pixel) ".len() + 1;
    watching.wait_for_words(&format!("{file}:{line}:{column}: "));
    watching.wait_for_words("the last picture stays until the shaders are mended");
    assert!(is_red(&watching.picture()));
    fs::remove_dir_all(shaders.0.path()).expect("a removed folder");
    watching.wait_for_words("the folder is not there any more");
    fs::create_dir(shaders.0.path()).expect("a folder");
    copy(&shader_folder(), shaders.0.path());
    watching.wait_for_picture("the first picture", |picture| picture == first);

    let model = watching.folder.path().join("cube.gltf");
    fs::write(&model, &cube(false)[..100]).expect("half a model");
    watching.wait_for_words("the last picture stays\n");
    assert_eq!(watching.picture(), first);
    let flat = cube(false).replace("\"mesh\":0", "\"mesh\":0,\"scale\":[1.0,0.1,1.0]");
    assert_ne!(flat, cube(false));
    fs::write(&model, flat).expect("another model");
    watching.wait_for_picture("another scene", |picture| picture != first);
    let beside = fs::read_dir(watching.folder.path()).expect("a folder").flatten();
    let names: Vec<String> = beside.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    assert!(names.iter().all(|name| !name.ends_with(".new")), "{names:?}");
}
