//! What the tests of Caustica share: a GPU session that fails on any validation message, a runner for snippets of the
//! shader library, flat scenes, pictures, and small statistics. It knows no hierarchy and no file format of scenes.
#![expect(clippy::expect_used, clippy::panic, reason = "a test says what is wrong by panicking")]

pub mod compute;
pub mod desktop;
pub mod edits;
pub mod gpu;
pub mod models;
pub mod numbers;
pub mod picture;
pub mod program;
pub mod scene;
pub mod shapes;
pub mod studio;

use std::path::PathBuf;

/// The root of the repository.
pub fn repository() -> PathBuf {
    let tests = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    tests.parent().map_or_else(|| tests.clone(), PathBuf::from)
}

/// The folder of the shaders.
pub fn shader_folder() -> PathBuf {
    repository().join("shaders")
}

/// Where the tests take shaders from: the copy in the binary, or the folder that `CAUSTICA_TEST_SHADERS` names. With a
/// fault planted there, the tests must fail.
pub fn shaders_under_test() -> Option<PathBuf> {
    std::env::var_os("CAUSTICA_TEST_SHADERS").map(PathBuf::from)
}
