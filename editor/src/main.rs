//! Window or command line; prints the final error and turns it into an exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    caustica::cli::run()
}
