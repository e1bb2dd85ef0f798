//! A shader that never ends: the editor comes back by itself, with everything as it was and the shader before; `render` says which pass
//! it was and ends.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use caustica_tests::desktop::{Desktop, wait_for};
use caustica_tests::models::cube;
use caustica_tests::program::program;
use caustica_tests::shader_folder;
use image::RgbImage;

/// The window: small, for slow devices.
const WINDOW: [u32; 2] = [1000, 700];
/// Where the cube is in it.
const MIDDLE: [u32; 2] = [WINDOW[0] * 48 / 100, WINDOW[1] * 43 / 100];
/// Where the part of the view begins that is looked at.
const VIEW: [u32; 2] = [WINDOW[0] * 32 / 100, WINDOW[1] * 20 / 100];
/// The cube's row in the outliner.
const ROW: [u32; 2] = [60, 150];
/// A device that takes longer counts as hung. On a processor the first pictures take several seconds.
const HUNG_AFTER_S: &str = "25";
/// So long anything may take before the test gives up.
const PATIENCE_S: u64 = 150;
/// The shader that is spoilt.
const POST: &str = "passes/post/post.comp";

/// A project with a cube, and shaders of its own.
fn write_project(folder: &Path) -> PathBuf {
    fs::write(folder.join("cube.gltf"), cube(false)).expect("a model on disk");
    let project = folder.join("cube.caustica.json");
    let text = r#"{"caustica": 1, "nextId": 5, "nodes": [{"id": 4, "name": "Cube", "prefab": 1}], "view": {}, "render": {}, "prefabs":
        [{"id": 1, "name": "cube", "source": "cube.gltf", "meshes": [2], "materials": [3], "textures": []}]}"#;
    fs::write(&project, text).expect("a project on disk");
    copy(&shader_folder(), &folder.join("shaders"));
    project
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

/// The shader with a statement before the one that stores the picture; `imageStore` is an effect that no compiler leaves out.
fn post_with(statement: &str) -> String {
    let text = fs::read_to_string(shader_folder().join(POST)).expect("a shader");
    let store = "    imageStore(display,";
    assert!(text.contains(store), "{text}");
    text.replacen(store, &format!("    {statement}\n{store}"), 1)
}

fn endless() -> String {
    post_with("for (uint n = 0u; n < 2u; n &= 1u) { imageStore(display, ivec2(pixel), vec4(n)); }")
}

struct Editor<'a> {
    process: Child,
    desktop: &'a Desktop,
    log: PathBuf,
}

impl<'a> Editor<'a> {
    fn start(desktop: &'a Desktop, folder: &Path, project: &Path) -> Self {
        let log_path = folder.join("log.txt");
        let log = fs::File::create(&log_path).expect("a log");
        let mut command = desktop.command(program());
        command.arg("--validation").arg("--shaders").arg(folder.join("shaders")).arg(project);
        command.envs([("CAUSTICA_LOG", "info"), ("NO_COLOR", "1"), ("CAUSTICA_HUNG_AFTER_S", HUNG_AFTER_S)]);
        command.current_dir(folder).stdin(Stdio::null());
        command.stdout(log.try_clone().expect("a log")).stderr(log);
        let mut editor =
            Self { process: command.spawn().expect("the editor starts"), desktop, log: log_path };
        let window = editor.focus();
        desktop.xdotool(&format!("windowsize {window} {} {}", WINDOW[0], WINDOW[1]));
        editor
    }

    /// Keys go to the window, which there is no window manager to see to.
    fn focus(&mut self) -> String {
        let window = self.wait_for("the window", |desktop| desktop.window("Caustica"));
        self.desktop.xdotool(&format!("windowfocus {window}"));
        window
    }

    fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Waits for something to be seen, as long as the process lives.
    fn wait_for<T>(&mut self, what: &str, mut found: impl FnMut(&Desktop) -> Option<T>) -> T {
        wait_for(what, PATIENCE_S, || {
            let ended = self.process.try_wait().expect("the process");
            assert!(ended.is_none(), "the editor ended: {ended:?}");
            found(self.desktop)
        })
    }

    fn wait_for_log(&mut self, words: &str) {
        let log = self.log.clone();
        self.wait_for(words, |_| fs::read_to_string(&log).unwrap_or_default().contains(words).then_some(()));
    }

    /// Waits until there is something unsaved, or nothing.
    fn wait_for_modified(&mut self, modified: bool) {
        self.wait_for("the mark in the title", |desktop| {
            let window = desktop.window("Caustica")?;
            let title = desktop.xdotool(&format!("getwindowname {window}"));
            (title.contains('\u{2022}') == modified && title.contains("cube")).then_some(())
        });
    }

    /// The view once it has come to rest.
    fn settled(&mut self) -> RgbImage {
        let mut last = view(self.desktop);
        self.wait_for("the picture to come to rest", |desktop| {
            std::thread::sleep(Duration::from_millis(700));
            let before = std::mem::replace(&mut last, view(desktop));
            (differing(&before, &last) == 0).then_some(())
        });
        last
    }
}

impl Drop for Editor<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the screen: {}\nthe log:\n{}", self.desktop.keep_screen().display(), self.log());
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The middle of the view, with the cube, its outline and the gizmo.
fn view(desktop: &Desktop) -> RgbImage {
    let [width, height] = [WINDOW[0] * 32 / 100, WINDOW[1] * 40 / 100];
    image::imageops::crop_imm(&desktop.screenshot(), VIEW[0], VIEW[1], width, height).to_image()
}

/// Squares of 16 pixels whose mean brightness differs visibly: noise evens out.
fn differing(a: &RgbImage, b: &RgbImage) -> usize {
    let mean = |image: &RgbImage, x: u32, y: u32| {
        let square = image::imageops::crop_imm(image, x, y, 16, 16).to_image();
        square.pixels().map(|pixel| f64::from(pixel.0[1])).sum::<f64>() / 256.0
    };
    let corners =
        (0..a.height() - 16).step_by(16).flat_map(|y| (0..a.width() - 16).step_by(16).map(move |x| (x, y)));
    corners.filter(|&(x, y)| (mean(a, x, y) - mean(b, x, y)).abs() > 12.0).count()
}

/// A point of the red handle of the gizmo, away from its ends.
fn red_handle(desktop: &Desktop) -> Option<[u32; 2]> {
    let view = view(desktop);
    let red = view.enumerate_pixels().filter(|(_, _, p)| p.0[0] > 200 && p.0[1] < 100 && p.0[2] < 110);
    let mut points: Vec<[u32; 2]> = red.map(|(x, y, _)| [x + VIEW[0], y + VIEW[1]]).collect();
    points.sort_unstable();
    // The head of the arrow holds most of the red: three quarters of the way is on it or close before it.
    (points.len() > 30).then(|| points[points.len() * 3 / 4])
}

/// Pixels of the orange outline of what is selected.
fn outline(view: &RgbImage) -> usize {
    view.pixels().filter(|p| p.0[0] > 230 && (115..165).contains(&p.0[1]) && p.0[2] < 70).count()
}

/// Red pixels in the panel below the view.
fn errors(desktop: &Desktop) -> usize {
    let screen = desktop.screenshot();
    let panel = image::imageops::crop_imm(&screen, 180, 530, 590, 130).to_image();
    panel.pixels().filter(|p| p.0[0] > 180 && p.0[1] < 130 && p.0[2] < 130).count()
}

fn shows_cube(desktop: &Desktop) -> Option<()> {
    let screen = desktop.screenshot();
    let outside = screen.get_pixel(WINDOW[0] + 50, WINDOW[1] / 2).0;
    let middle = screen.get_pixel(MIDDLE[0], MIDDLE[1]).0;
    (middle.iter().all(|c| *c > 60) && outside == [0, 0, 0]).then_some(())
}

#[test]
fn the_editor_comes_back_as_it_was_without_the_shader_that_never_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let project = write_project(folder.path());
    let desktop = Desktop::start([1600, 960]);
    let mut editor = Editor::start(&desktop, folder.path(), &project);
    editor.wait_for("the cube", shows_cube);
    // A selection, an edit that is not saved, a camera that was moved, another panel in front.
    desktop.xdotool(&format!("mousemove {} {} sleep 0.3 click 1", ROW[0], ROW[1]));
    editor.wait_for("the outline of the cube", |desktop| (outline(&view(desktop)) > 200).then_some(()));
    let handle = editor.wait_for("the gizmo", red_handle);
    desktop.drag(handle, [60, 0]);
    editor.wait_for_modified(true);
    desktop.xdotool(&format!("mousemove {} {} sleep 0.3 click 5 sleep 0.3 click 5", MIDDLE[0], MIDDLE[1]));
    // By its name: where its tab is depends on how many there are.
    desktop.xdotool("sleep 1 key ctrl+p sleep 1 type shaders");
    desktop.xdotool(&format!("sleep 1 key Return sleep 1 mousemove {} 12", MIDDLE[0]));
    let before = editor.settled();
    assert!(errors(&desktop) == 0, "nothing is wrong yet");

    let (bad, file) = (endless(), folder.path().join("shaders").join(POST));
    fs::write(&file, &bad).expect("a saved shader");
    editor.wait_for_log("the program is started again");
    editor.wait_for_log(&format!("{POST} did not finish (pass post)"));
    editor.wait_for("the cube again", shows_cube);
    editor.focus();
    editor.wait_for_modified(true);
    // As soon as it has as many samples.
    let after = editor.wait_for("the view to be as it was", |desktop| {
        let view = view(desktop);
        (differing(&before, &view) <= 4).then_some(view)
    });
    assert!(outline(&after) > 200, "the selection is gone");
    assert!(errors(&desktop) > 50, "the panel of the shaders is in front and says what is wrong");
    assert_eq!(fs::read_to_string(&file).expect("a shader"), bad, "the file is left alone");

    // The edit can be undone, as before.
    desktop.xdotool("key ctrl+z");
    editor.wait_for_modified(false);
    // A shader that ends is shown again.
    let dark = post_with("if (pixel.x > 0u) { imageStore(display, ivec2(pixel), vec4(0.0)); return; }");
    fs::write(&file, dark).expect("a saved shader");
    editor.wait_for("a dark picture", |desktop| {
        let view = view(desktop);
        (view.pixels().filter(|pixel| pixel.0.iter().all(|c| *c < 40)).count() > 40_000).then_some(())
    });
    desktop.xdotool("key ctrl+q");
    let status = wait_for("the editor to quit", 90, || editor.process.try_wait().expect("the process"));
    let log = editor.log();
    assert!(status.success(), "{status}\n{log}");
    assert!(!log.contains("validation") && !log.contains("panicked"), "{log}");
    let left: Vec<_> =
        fs::read_dir(desktop.settings().join("caustica")).expect("the user's folder").flatten().collect();
    assert!(
        left.iter().all(|entry| !entry.file_name().to_string_lossy().starts_with("after-hang")),
        "{left:?}"
    );
}

#[test]
fn render_names_the_pass_that_never_ends_and_ends_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let project = write_project(folder.path());
    fs::write(folder.path().join("shaders").join(POST), endless()).expect("a saved shader");
    let mut command = std::process::Command::new(program());
    command.arg("render").arg(&project).args(["-o", "out.png", "--size", "64x48", "--samples", "1"]);
    command.arg("--shaders").arg(folder.path().join("shaders")).env("CAUSTICA_HUNG_AFTER_S", HUNG_AFTER_S);
    command.current_dir(folder.path()).env("NO_COLOR", "1");
    command.env("XDG_CONFIG_HOME", folder.path()).env("XDG_DATA_HOME", folder.path());
    let mut process =
        command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let start = Instant::now();
    let status = loop {
        if let Some(status) = process.try_wait().expect("the process") {
            break status;
        }
        if start.elapsed() > Duration::from_secs(PATIENCE_S) {
            let _ = process.kill();
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    let error = std::io::read_to_string(process.stderr.take().expect("a pipe")).expect("what it said");
    assert_eq!(status.code(), Some(3), "{status}: {error}");
    assert!(error.contains("did not finish within 25 s") && error.contains("then came 'post'"), "{error}");
    assert!(!folder.path().join("out.png").exists());
}
