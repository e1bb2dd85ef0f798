//! Tests of the package through its public interface, one file a subject.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

mod common;
mod edits;
mod import;
mod projects;
mod transforms;
