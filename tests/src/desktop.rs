//! A display without a screen, with a mouse and a keyboard. Enters: xdotool's words. Leaves: screenshots, read from the
//! frame buffer that Xvfb keeps in a file.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};

use crate::picture::failure_folder;

/// One desktop at a time: a server that starts beside another can take that one's socket away, and two editors on a slow
/// device keep nobody's deadlines.
static TURN: Mutex<()> = Mutex::new(());

/// A running Xvfb.
pub struct Desktop {
    _turn: MutexGuard<'static, ()>,
    server: Child,
    display: String,
    folder: tempfile::TempDir,
}

impl Desktop {
    /// Starts a server on a free display, once no other desktop is left.
    ///
    /// # Panics
    /// When Xvfb is missing or does not start.
    pub fn start(extent: [u32; 2]) -> Self {
        // A test that failed in its turn says nothing about the next.
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a folder");
        let screen = format!("{}x{}x24", extent[0], extent[1]);
        let mut server = Command::new("Xvfb")
            // No reset when a client leaves: the next one might find the door shut.
            .args(["-noreset", "-displayfd", "1", "-nolisten", "tcp", "-screen", "0", &screen, "-fbdir"])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts: scripts/setup.sh --test installs it");
        let mut number = String::new();
        let output = server.stdout.take().expect("the server's output");
        BufReader::new(output).read_line(&mut number).expect("the display's number");
        Self { _turn: turn, server, display: format!(":{}", number.trim()), folder }
    }

    /// A command that sees this display and no other, with settings of its own.
    pub fn command(&self, program: &std::path::Path) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        for variable in ["XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"] {
            command.env(variable, self.settings());
        }
        command
    }

    /// Where programs on this display have their settings and their data.
    pub fn settings(&self) -> PathBuf {
        self.folder.path().join("settings")
    }

    /// Runs xdotool; what it printed.
    ///
    /// # Panics
    /// When it is missing or fails.
    pub fn xdotool(&self, words: &str) -> String {
        let output = Command::new("xdotool")
            .env("DISPLAY", &self.display)
            .args(words.split_whitespace())
            .output()
            .expect("xdotool runs: scripts/setup.sh --test installs it");
        assert!(output.status.success(), "xdotool {words}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Whether xdotool finds a window of this name; its number.
    pub fn window(&self, name: &str) -> Option<String> {
        let output = Command::new("xdotool")
            .env("DISPLAY", &self.display)
            .args(["search", "--onlyvisible", "--name", name])
            .output()
            .ok()?;
        String::from_utf8_lossy(&output.stdout).lines().next().map(str::to_owned)
    }

    /// Presses the left button, draws the pointer along in steps, lets go.
    pub fn drag(&self, from: [u32; 2], by: [i32; 2]) {
        const STEPS: i32 = 10;
        self.xdotool(&format!("mousemove {} {} sleep 0.2 mousedown 1 sleep 0.1", from[0], from[1]));
        for _ in 0..STEPS {
            self.xdotool(&format!("mousemove_relative -- {} {}", by[0] / STEPS, by[1] / STEPS));
            std::thread::sleep(Duration::from_millis(40));
        }
        self.xdotool("sleep 0.2 mouseup 1");
    }

    /// Keeps the screen as it is now beside the pictures that failed; where it is.
    pub fn keep_screen(&self) -> PathBuf {
        let path = failure_folder().join("desktop.png");
        let kept = std::fs::create_dir_all(failure_folder()).is_ok() && self.screenshot().save(&path).is_ok();
        if kept { path } else { PathBuf::from("(lost)") }
    }

    /// The screen as it is now.
    ///
    /// # Panics
    /// When the server has gone.
    pub fn screenshot(&self) -> RgbImage {
        let file: PathBuf = self.folder.path().join("Xvfb_screen0");
        let bytes = std::fs::read(file).expect("the server's frame buffer");
        parse_xwd(&bytes).expect("a frame buffer of 32 bits a pixel")
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        // Only the server that was started here.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Reads an X window dump (XWDFile.h): 25 words, a name, colours, pixels.
fn parse_xwd(bytes: &[u8]) -> Option<RgbImage> {
    let word = |i: usize| Some(u32::from_be_bytes(bytes.get(i * 4..i * 4 + 4)?.try_into().ok()?));
    let (header, width, height) = (word(0)? as usize, word(4)?, word(5)?);
    let (little_endian, bits, stride, colors) =
        (word(7)? == 0, word(11)?, word(12)? as usize, word(19)? as usize);
    if bits != 32 {
        return None;
    }
    let pixels = bytes.get(header + colors * 12..)?;
    let mut image = RgbImage::new(width, height);
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let at = y as usize * stride + x as usize * 4;
        let [a, b, c, d]: [u8; 4] = pixels.get(at..at + 4)?.try_into().ok()?;
        *pixel = if little_endian { Rgb([c, b, a]) } else { Rgb([b, c, d]) };
    }
    Some(image)
}

/// Asks again until `found` answers, for at most `seconds`.
///
/// # Panics
/// With `what`, when it never does.
pub fn wait_for<T>(what: &str, seconds: u64, mut found: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = found() {
            return value;
        }
        assert!(start.elapsed() < Duration::from_secs(seconds), "waited {seconds} s in vain: {what}");
        std::thread::sleep(Duration::from_millis(100));
    }
}
