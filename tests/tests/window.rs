//! The editor in a window, from outside: starts under a display of its own, a click selects, a drag of the gizmo moves,
//! undo brings back, the process stays healthy and quits from inside.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::PathBuf;
use std::process::{Child, Stdio};

use caustica_tests::desktop::{Desktop, wait_for};
use caustica_tests::program::program;
use image::RgbImage;

/// The window: small, for slow devices.
const WINDOW: [u32; 2] = [1000, 700];

/// A grey cube as glTF, in one file.
fn cube_gltf() -> String {
    let corners: Vec<[f32; 3]> =
        (0..8).map(|i| [4, 2, 1].map(|bit| if i & bit == 0 { -0.5 } else { 0.5 })).collect();
    let faces: [[u16; 4]; 6] =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let indices = faces.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]);
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(indices.flat_map(u16::to_le_bytes));
    let data = base64(&bytes);
    serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "Cube"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5]},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [{"byteLength": 168, "uri": format!("data:application/octet-stream;base64,{data}")}],
    })
    .to_string()
}

/// RFC 4648 base64.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word =
            chunk.iter().enumerate().fold(0_u32, |word, (i, byte)| word | u32::from(*byte) << (16 - 8 * i));
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i)) as usize & 63] as char;
            text.push(if i <= chunk.len() { letter } else { '=' });
        }
    }
    text
}

/// The editor, ended when the test ends.
struct Editor<'a> {
    process: Child,
    desktop: &'a Desktop,
    log: PathBuf,
}

impl Editor<'_> {
    fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    fn assert_alive(&mut self) {
        let ended = self.process.try_wait().expect("the process");
        assert!(ended.is_none(), "the editor ended: {ended:?}");
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

#[test]
fn an_object_is_selected_dragged_and_put_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("cube.gltf");
    std::fs::write(&model, cube_gltf()).expect("a model on disk");
    let log_path = folder.path().join("log.txt");
    let log = std::fs::File::create(&log_path).expect("a log");
    let desktop = Desktop::start([1600, 960]);
    let mut command = desktop.command(program());
    command
        .arg("--validation")
        .arg(&model)
        .env("CAUSTICA_LOG", "info")
        .env("NO_COLOR", "1")
        .current_dir(folder.path());
    command.stdout(log.try_clone().expect("a log")).stderr(log).stdin(Stdio::null());
    let process = command.spawn().expect("the editor starts");
    let mut editor = Editor { process, desktop: &desktop, log: log_path };

    let window = wait_for("the window", 60, || {
        editor.assert_alive();
        desktop.window("Caustica")
    });
    desktop.xdotool(&format!("windowsize {window} {} {}", WINDOW[0], WINDOW[1]));
    desktop.xdotool(&format!("windowfocus {window}"));
    // The cube in the middle of the view is brighter than the panels around it.
    let middle = [WINDOW[0] * 48 / 100, WINDOW[1] * 43 / 100];
    wait_for("a picture in the resized window", 60, || {
        editor.assert_alive();
        let screen = desktop.screenshot();
        let outside = screen.get_pixel(WINDOW[0] + 50, WINDOW[1] / 2).0;
        let bright = screen.get_pixel(middle[0], middle[1]).0.iter().all(|c| *c > 60);
        (bright && outside == [0, 0, 0]).then_some(())
    });
    assert!(outline(&desktop.screenshot()).is_none(), "nothing is selected at first");

    desktop.xdotool(&format!("mousemove {} {} sleep 0.3 click 1", middle[0], middle[1]));
    let (handle, before) = wait_for("the outline and the gizmo of the selected cube", 30, || {
        editor.assert_alive();
        let screen = desktop.screenshot();
        let around = outline(&screen)?;
        Some((red_handle(&screen, around)?, around))
    });
    let still = desktop.screenshot();

    // Along the red axis, which points to the right of the picture.
    desktop.drag(handle, [100, 0]);
    let moved = |from: Box| {
        let now = outline(&desktop.screenshot())?;
        (now[0] > from[0] + 30).then_some(now)
    };
    let after = wait_for("the cube to follow the drag", 30, || {
        editor.assert_alive();
        moved(before)
    });
    assert!(changed(&still, &desktop.screenshot()) > 2000, "from {before:?} to {after:?}");

    // Away from the handle, which is highlighted as long as it is held.
    desktop.xdotool(&format!("mousemove {} {}", WINDOW[0] / 4, WINDOW[1] / 2));
    wait_for("the drag to end", 30, || {
        let screen = desktop.screenshot();
        red_handle(&screen, outline(&screen)?)
    });
    desktop.xdotool("key ctrl+z");
    wait_for("undo to put the cube back", 30, || {
        editor.assert_alive();
        let now = outline(&desktop.screenshot())?;
        now.iter().zip(before).all(|(a, b)| a.abs_diff(b) <= 3).then_some(())
    });

    desktop.xdotool("key ctrl+q");
    let status = wait_for("the editor to quit", 30, || editor.process.try_wait().expect("the process"));
    let log = editor.log();
    assert!(status.success(), "{status}\n{log}");
    for word in ["validation", "panicked", "ERROR", "lost"] {
        assert!(!log.contains(word), "the log speaks of '{word}':\n{log}");
    }
}

#[test]
fn base64_follows_its_specification() {
    // RFC 4648, section 10.
    for (plain, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(plain.as_bytes()), text);
    }
}
