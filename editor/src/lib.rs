//! Caustica, the program: a window on a session, and the command line on the same session.
//! The only package with egui, clap and anyhow.

pub mod app;
mod camera_control;
pub mod cli;
mod curve;
mod default_sky;
mod device_watch;
mod dialogs;
mod error_watch;
mod exr_file;
mod gizmo;
pub mod history;
mod log_buffer;
pub mod open_scene;
mod panels;
mod playback;
mod projection;
mod recovery;
mod reference;
pub mod session;
mod sync;
mod theme;
mod typed;
mod ui_renderer;
mod ui_state;
mod whole_file;
mod worker;
