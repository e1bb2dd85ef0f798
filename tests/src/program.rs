//! The program itself, as a user starts it. Enters: arguments. Leaves: exit code and what it printed.
//! `CAUSTICA_BINARY` names the program to test; without it, it is built first, which takes no time when it is fresh.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use crate::repository;

/// The program `caustica` of this build.
///
/// # Panics
/// When it does not build.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        if let Some(path) = std::env::var_os("CAUSTICA_BINARY") {
            return PathBuf::from(path);
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut build = Command::new(cargo);
        build.current_dir(repository()).args(["build", "--offline", "--package", "caustica"]);
        let folder = build_folder();
        if folder.ends_with("release") {
            build.arg("--release");
        }
        let status = build.status().expect("cargo runs");
        assert!(status.success(), "the program does not build");
        folder.join("caustica")
    })
}

/// Where this test's own executable was built: `target/release` or `target/debug`.
fn build_folder() -> PathBuf {
    let executable = std::env::current_exe().unwrap_or_default();
    executable.ancestors().nth(2).map(Path::to_owned).unwrap_or_default()
}

/// What a run of the program left.
pub struct Run {
    /// Exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Runs the program in `folder` without a display, and without what the user has configured or left unsaved: that is in the
/// folders `config` and `data` in there.
///
/// # Panics
/// When it cannot be started, or when it panicked.
pub fn caustica(folder: &Path, arguments: &[&str]) -> Run {
    let mut command = Command::new(program());
    command.current_dir(folder).args(arguments);
    let own = std::path::absolute(folder).unwrap_or_default();
    command
        .env("XDG_CONFIG_HOME", own.join("config"))
        .env("XDG_DATA_HOME", own.join("data"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("CAUSTICA_LOG")
        .env("NO_COLOR", "1");
    let Output { status, stdout, stderr } = command.output().expect("the program starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let run = Run { code: status.code(), stdout: text(&stdout), stderr: text(&stderr) };
    let quiet = !run.stderr.contains("panicked at") && !run.stderr.contains("overflow");
    assert!(quiet && run.code.is_some(), "{arguments:?}: {status}\n{}", run.stderr);
    run
}
