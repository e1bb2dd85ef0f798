//! The editor in a window, from outside: starts under a display of its own, a click selects, a drag of the gizmo moves,
//! undo brings back, an animation plays, the process stays healthy and quits from inside.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use caustica_tests::desktop::{Desktop, wait_for};
use caustica_tests::models::cube;
use caustica_tests::program::program;
use caustica_tests::shader_folder;
use image::RgbImage;

/// The window: small, for slow devices.
const WINDOW: [u32; 2] = [1000, 700];
/// Where the cube is in it.
const MIDDLE: [u32; 2] = [WINDOW[0] * 48 / 100, WINDOW[1] * 43 / 100];

/// The editor, ended when the test ends.
struct Editor<'a> {
    process: Child,
    desktop: &'a Desktop,
    log: PathBuf,
    /// Number of its window.
    window: String,
}

impl<'a> Editor<'a> {
    /// Opens a model and waits for its picture in a window of the size that the tests count with.
    fn open(desktop: &'a Desktop, folder: &Path, gltf: &str) -> Self {
        let mut editor = Self::start(desktop, folder, gltf);
        editor.wait_for("a picture in the resized window", 60, |desktop| {
            let screen = desktop.screenshot();
            let outside = screen.get_pixel(WINDOW[0] + 50, WINDOW[1] / 2).0;
            (shows_cube(&screen) && outside == [0, 0, 0]).then_some(())
        });
        editor
    }

    /// Starts on a model, in a window of that size.
    fn start(desktop: &'a Desktop, folder: &Path, gltf: &str) -> Self {
        Self::start_with(desktop, folder, gltf, &[])
    }

    fn start_with(desktop: &'a Desktop, folder: &Path, gltf: &str, arguments: &[&str]) -> Self {
        let model = folder.join("cube.gltf");
        std::fs::write(&model, gltf).expect("a model on disk");
        let log_path = folder.join("log.txt");
        let log = std::fs::File::create(&log_path).expect("a log");
        let mut command = desktop.command(program());
        command
            .arg("--validation")
            .args(arguments)
            .arg(&model)
            .env("CAUSTICA_LOG", "info")
            .env("NO_COLOR", "1")
            .current_dir(folder);
        command.stdout(log.try_clone().expect("a log")).stderr(log).stdin(Stdio::null());
        let process = command.spawn().expect("the editor starts");
        let mut editor = Self { process, desktop, log: log_path, window: String::new() };
        editor.window = editor.wait_for("the window", 60, |desktop| desktop.window("Caustica"));
        desktop.xdotool(&format!("windowsize {} {} {}", editor.window, WINDOW[0], WINDOW[1]));
        desktop.xdotool(&format!("windowfocus {}", editor.window));
        editor
    }

    fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Waits for something to be seen, as long as the editor lives.
    fn wait_for<T>(&mut self, what: &str, seconds: u64, mut found: impl FnMut(&Desktop) -> Option<T>) -> T {
        wait_for(what, seconds, || {
            let ended = self.process.try_wait().expect("the process");
            assert!(ended.is_none(), "the editor ended: {ended:?}");
            found(self.desktop)
        })
    }

    fn title(&self) -> String {
        self.desktop.xdotool(&format!("getwindowname {}", self.window)).trim().to_owned()
    }

    /// Quits by its key, which asks nothing when nothing is unsaved, and looks for complaints.
    fn quit(mut self) {
        self.desktop.xdotool("key ctrl+q");
        let status = wait_for("the editor to quit", 90, || self.process.try_wait().expect("the process"));
        let log = self.log();
        assert!(status.success(), "{status}\n{log}");
        for word in ["validation", "panicked", "ERROR", "lost"] {
            assert!(!log.contains(word), "the log speaks of '{word}':\n{log}");
        }
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

/// The cube in the middle of the view is brighter than the panels around it.
fn shows_cube(screen: &RgbImage) -> bool {
    screen.get_pixel(MIDDLE[0], MIDDLE[1]).0.iter().all(|c| *c > 60)
}

/// A box of pixels: left, top, right, bottom.
type Box = [u32; 4];

/// The box around the orange outline of what is selected, if anything is.
fn outline(screen: &RgbImage) -> Option<Box> {
    let mut found: Option<Box> = None;
    let mut count = 0;
    for (x, y, pixel) in screen.enumerate_pixels() {
        let [r, g, b] = pixel.0;
        if r > 230 && (115..165).contains(&g) && b < 70 {
            count += 1;
            let [left, top, right, bottom] = found.unwrap_or([x, y, x, y]);
            found = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
    }
    found.filter(|_| count > 200)
}

/// A point of the red handle inside of the box, away from its ends.
fn red_handle(screen: &RgbImage, inside: Box) -> Option<[u32; 2]> {
    let is_red = |pixel: [u8; 3]| pixel[0] > 200 && pixel[1] < 100 && pixel[2] < 110;
    let mut points: Vec<[u32; 2]> = screen
        .enumerate_pixels()
        .filter(|(x, y, pixel)| {
            (inside[0]..inside[2]).contains(x) && (inside[1]..inside[3]).contains(y) && is_red(pixel.0)
        })
        .map(|(x, y, _)| [x, y])
        .collect();
    points.sort_unstable();
    // The head of the arrow holds most of the red: three quarters of the way is on it or close before it.
    (points.len() > 30).then(|| points[points.len() * 3 / 4])
}

/// Pixels that differ visibly.
fn changed(a: &RgbImage, b: &RgbImage) -> usize {
    a.pixels().zip(b.pixels()).filter(|(p, q)| (0..3).any(|i| p.0[i].abs_diff(q.0[i]) > 40)).count()
}

/// Mean brightness of squares of 16 pixels in the part of the view that the cube moves through: noise evens out.
fn squares(screen: &RgbImage) -> Vec<f64> {
    let [left, top, right, bottom] =
        [WINDOW[0] * 30 / 100, WINDOW[1] * 22 / 100, WINDOW[0] * 68 / 100, WINDOW[1] * 58 / 100];
    let corners = (top..bottom).step_by(16).flat_map(|y| (left..right).step_by(16).map(move |x| (x, y)));
    let mean = |(x, y): (u32, u32)| {
        let pixels = (0..16).flat_map(|dy| (0..16).map(move |dx| (dx, dy)));
        let sum: f64 = pixels.map(|(dx, dy)| f64::from(screen.get_pixel(x + dx, y + dy).0[1])).sum();
        sum / 256.0
    };
    corners.map(mean).collect()
}

/// The screen once the picture has come to rest.
fn settled(editor: &mut Editor<'_>) -> RgbImage {
    let mut last = editor.desktop.screenshot();
    editor.wait_for("the picture to come to rest", 90, |desktop| {
        std::thread::sleep(std::time::Duration::from_millis(700));
        let before = std::mem::replace(&mut last, desktop.screenshot());
        (moved_squares(&before, &last) <= 2).then_some(())
    });
    last
}

/// Squares that differ visibly.
fn moved_squares(a: &RgbImage, b: &RgbImage) -> usize {
    squares(a).iter().zip(squares(b)).filter(|(a, b)| (*a - b).abs() > 16.0).count()
}

#[test]
fn an_object_is_selected_dragged_and_put_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let desktop = Desktop::start([1600, 960]);
    let mut editor = Editor::open(&desktop, folder.path(), &cube(false));
    assert!(outline(&desktop.screenshot()).is_none(), "nothing is selected at first");

    desktop.xdotool(&format!("mousemove {} {} sleep 0.3 click 1", MIDDLE[0], MIDDLE[1]));
    let (handle, before) = editor.wait_for("the outline and the gizmo of the selected cube", 90, |desktop| {
        let screen = desktop.screenshot();
        let around = outline(&screen)?;
        Some((red_handle(&screen, around)?, around))
    });
    let still = desktop.screenshot();

    // Along the red axis, which points to the right of the picture.
    desktop.drag(handle, [100, 0]);
    let after = editor.wait_for("the cube to follow the drag", 90, |desktop| {
        let now = outline(&desktop.screenshot())?;
        (now[0] > before[0] + 30).then_some(now)
    });
    assert!(changed(&still, &desktop.screenshot()) > 2000, "from {before:?} to {after:?}");

    // Away from the handle, which is highlighted as long as it is held.
    desktop.xdotool(&format!("mousemove {} {}", WINDOW[0] / 4, WINDOW[1] / 2));
    editor.wait_for("the drag to end", 90, |desktop| {
        let screen = desktop.screenshot();
        red_handle(&screen, outline(&screen)?)
    });
    desktop.xdotool("key ctrl+z");
    editor.wait_for("undo to put the cube back", 90, |desktop| {
        let now = outline(&desktop.screenshot())?;
        now.iter().zip(before).all(|(a, b)| a.abs_diff(b) <= 3).then_some(())
    });
    editor.quit();
}

#[test]
fn an_animation_plays_and_leaves_the_document_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let desktop = Desktop::start([1600, 960]);
    let mut editor = Editor::open(&desktop, folder.path(), &cube(true));
    let title = editor.title();
    assert!(!title.contains('\u{2022}'), "nothing is unsaved: {title}");
    let at_rest = settled(&mut editor);

    desktop.xdotool("key space");
    editor.wait_for("the cube to leave its place", 90, |desktop| {
        (moved_squares(&at_rest, &desktop.screenshot()) > 20).then_some(())
    });
    let once = desktop.screenshot();
    editor.wait_for("the cube to move on", 90, |desktop| {
        (moved_squares(&once, &desktop.screenshot()) > 20).then_some(())
    });

    // From the start of the clip, which is where the cube stood, so that the pause is seen in a known place.
    desktop.xdotool("key space key alt+Home");
    editor.wait_for("the cube at the start of its clip", 90, |desktop| {
        (moved_squares(&at_rest, &desktop.screenshot()) <= 4).then_some(())
    });
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let paused = moved_squares(&at_rest, &desktop.screenshot());
    assert!(paused <= 4, "it stays there: {paused} squares differ");

    // Twelve frames on are half a metre: a step is a time, and no edit.
    for _ in 0..12 {
        desktop.xdotool("key alt+Right sleep 0.1");
    }
    editor.wait_for("the steps to be seen", 90, |desktop| {
        (moved_squares(&at_rest, &desktop.screenshot()) > 20).then_some(())
    });
    desktop.xdotool("key ctrl+z sleep 1");
    assert!(moved_squares(&at_rest, &desktop.screenshot()) > 20, "there was nothing to undo");
    assert_eq!(editor.title(), title, "nothing is unsaved");
    desktop.xdotool("key shift+space");
    editor.wait_for("the rest pose", 90, |desktop| {
        (moved_squares(&at_rest, &desktop.screenshot()) <= 4).then_some(())
    });
    assert!(!editor.log().contains("undone"), "{}", editor.log());
    editor.quit();
}

#[test]
fn what_a_killed_editor_had_not_saved_is_recovered() {
    let folder = tempfile::tempdir().expect("a folder");
    let desktop = Desktop::start([1600, 960]);
    let mut editor = Editor::open(&desktop, folder.path(), &cube(false));
    desktop.xdotool(&format!("mousemove {} {} sleep 0.3 click 1", MIDDLE[0], MIDDLE[1]));
    editor.wait_for("the outline of the cube", 90, |desktop| outline(&desktop.screenshot()));
    desktop.xdotool("key h");
    let window = editor.window.clone();
    let is_modified = move |desktop: &Desktop| {
        desktop.xdotool(&format!("getwindowname {window}")).contains('\u{2022}').then_some(())
    };
    editor.wait_for("the cube to be hidden", 90, is_modified);
    editor.process.kill().expect("a signal that nothing can catch");
    editor.process.wait().expect("the end");
    drop(editor);

    // The system may take its time with the end of a large process, whose journal is locked until then: so it is here.
    let ending = lock_journal(&desktop);
    let mut again = Editor::start(&desktop, folder.path(), &cube(false));
    let log = again.log.clone();
    let told = || std::fs::read_to_string(&log).unwrap_or_default().contains("left behind");
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert!(!told(), "the one before is still ending");
    drop(ending);
    again.wait_for("the question", 15, |_| told().then_some(()));
    let window = again.window.clone();
    again.wait_for("Enter to say: recover", 60, |desktop| {
        desktop.xdotool("key Return sleep 0.5");
        desktop.xdotool(&format!("getwindowname {window}")).contains('\u{2022}').then_some(())
    });
    assert!(!shows_cube(&settled(&mut again)), "it was hidden");
    // What was done before the end can be undone after it.
    desktop.xdotool("key ctrl+z");
    again.wait_for("undo to bring the cube back", 90, |desktop| {
        shows_cube(&desktop.screenshot()).then_some(())
    });
}

/// Texts of shaders that are kept for the next start: the name of the file that holds them, and what it says.
fn typed(folder: &Path) -> Option<(PathBuf, String)> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let path = files.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "typed"))?;
    let kept: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).ok()?).ok()?;
    Some((path, kept["texts"]["lib/fresnel.glsl"].as_str()?.to_owned()))
}

#[test]
fn what_is_typed_into_a_shader_outlives_the_end_of_the_editor() {
    let folder = tempfile::tempdir().expect("a folder");
    let desktop = Desktop::start([1600, 960]);
    let journals = desktop.settings().join("caustica/journals");
    std::fs::create_dir_all(&journals).expect("a folder");
    let left = journals.join("1-1.typed");
    let shaders = shader_folder();
    let texts = serde_json::json!({ "folder": &shaders, "texts": { "lib/fresnel.glsl": "// mine\n" } });
    std::fs::write(&left, texts.to_string()).expect("a text that was left behind");
    let arguments = ["--shaders", shaders.to_str().expect("a path")];
    // Not by a lost terminal, which `nohup` has it ignore.
    for end in ["-TERM", "-KILL"] {
        let mut editor = Editor::start_with(&desktop, folder.path(), &cube(false), &arguments);
        let log = editor.log.clone();
        let words = "lib/fresnel.glsl: what was typed and not saved when the program ended is back";
        let told = || std::fs::read_to_string(&log).unwrap_or_default().contains(words);
        editor.wait_for("the text to be back", 90, |_| told().then_some(()));
        let before = editor.wait_for("the text to be kept again", 90, |_| {
            typed(&journals)
                .filter(|(path, text)| *path != left && text.contains("// mine"))
                .map(|(_, text)| text)
        });
        // The text is to the right of the files, below the view; it is there once the window has its size.
        editor.wait_for("what is typed to be kept", 90, |desktop| {
            desktop.xdotool("mousemove 590 630 sleep 0.5 mousemove 600 630 sleep 1 click 1 sleep 1");
            desktop.xdotool("type --delay 50 abc");
            std::thread::sleep(std::time::Duration::from_secs(1));
            typed(&journals).filter(|(_, text)| *text != before && text.contains("abc"))
        });
        let process = editor.process.id().to_string();
        let sent = std::process::Command::new("kill").args([end, &process]).status();
        assert!(sent.expect("kill").success());
        editor.process.wait().expect("the end");
    }
    let (_, text) = typed(&journals).expect("it is left behind");
    assert!(text.contains("// mine") && text.matches("abc").count() >= 2, "{text}");
}

/// Holds the only journal that there is, as its process does.
fn lock_journal(desktop: &Desktop) -> std::fs::File {
    let folder = desktop.settings().join("caustica/journals");
    let files = std::fs::read_dir(folder).expect("journals").map(|entry| entry.expect("a file").path());
    let journals: Vec<PathBuf> = files.collect();
    assert_eq!(journals.len(), 1, "{journals:?}");
    let file = std::fs::File::open(&journals[0]).expect("a journal");
    wait_for("its process to let go of it", 20, || file.try_lock().ok());
    file
}

#[test]
fn an_editor_with_little_memory_shows_a_coarse_view_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let desktop = Desktop::start([1600, 960]);
    let little = ["--memory-budget", "96"];
    let mut editor = Editor::start_with(&desktop, folder.path(), &cube(false), &little);
    editor.wait_for("the cube", 60, |desktop| shows_cube(&desktop.screenshot()).then_some(()));
    settled(&mut editor);
    assert!(editor.log().contains("the view is shown at 1/"), "{}", editor.log());
    assert!(editor.log().contains("of 96 MiB are in use"), "{}", editor.log());
    editor.quit();
}
