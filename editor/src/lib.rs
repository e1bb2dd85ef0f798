//! Caustica, the program: a window on a session, and the command line on the same session.
//! The only package with egui, clap and anyhow.

pub mod cli;
mod default_sky;
pub mod history;
pub mod session;
pub mod sync;
