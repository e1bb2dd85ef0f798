//! Edits a project until it is killed, through the code that the editor uses, and says after each step that it is done.
//! Arguments: project, folder of the journals, model, seed. It starts with what a process before it has left behind.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::io::Write;
use std::path::PathBuf;

use caustica_tests::edits::{Steps, open};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [project, journals, model, seed] = arguments.as_slice() else {
        return;
    };
    let (project, journals, model) = (PathBuf::from(project), PathBuf::from(journals), PathBuf::from(model));
    let (mut scene, _) = open(&project, &journals);
    let mut steps = Steps::new(seed.parse().expect("a number"), &model);
    let mut output = std::io::stdout().lock();
    loop {
        steps.step(&mut scene, |scene| scene.save(&project).expect("the project is saved"));
        output.write_all(b".").and_then(|()| output.flush()).expect("somebody listens");
    }
}
