//! The shape of the repository: who may import whom, where `unsafe` may stand, how long a file may be.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use caustica_tests::repository;

/// Our packages and what of ours each may import (design, "Layout and direction of imports").
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("caustica", &["caustica-scene", "caustica-renderer"]),
    ("caustica-scene", &[]),
    ("caustica-renderer", &["caustica-gpu"]),
    ("caustica-gpu", &[]),
    ("caustica-tests", &["caustica", "caustica-scene", "caustica-renderer", "caustica-gpu"]),
];

/// What only the editor may name, by the beginning of the package's name.
const EDITOR_ONLY: &[&str] = &["anyhow", "clap", "egui", "rfd", "winit"];

/// What must not even come with another package.
const EDITOR_ONLY_AT_ANY_DEPTH: &[&str] = &["clap", "egui", "rfd", "winit"];

fn cargo(arguments: &[&str]) -> String {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo).current_dir(repository()).args(arguments).output().expect("cargo runs");
    assert!(output.status.success(), "cargo {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Direct dependencies of every package of the workspace, all kinds.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let text = cargo(&["metadata", "--no-deps", "--offline", "--format-version", "1"]);
    let metadata: serde_json::Value = serde_json::from_str(&text).expect("JSON of cargo metadata");
    let name = |value: &serde_json::Value| value["name"].as_str().unwrap_or_default().to_owned();
    let packages = metadata["packages"].as_array().expect("packages");
    let of = |package: &serde_json::Value| {
        package["dependencies"].as_array().into_iter().flatten().map(name).collect()
    };
    packages.iter().map(|package| (name(package), of(package))).collect()
}

/// What is wrong with these dependencies, in words.
fn import_faults(dependencies: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut faults = Vec::new();
    for (package, names) in dependencies {
        let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| name == package) else {
            faults.push(format!("{package} is no package of the design"));
            continue;
        };
        for name in names {
            let ours = name == "caustica" || name.starts_with("caustica-");
            if ours && !allowed.contains(&name.as_str()) {
                faults.push(format!("{package} imports {name}"));
            }
            if package != "caustica" && EDITOR_ONLY.iter().any(|beginning| name.starts_with(beginning)) {
                faults.push(format!("{package} imports {name}, which belongs to the editor"));
            }
        }
    }
    faults
}

#[test]
fn packages_import_one_way() {
    let dependencies = dependencies();
    let found: Vec<&str> = dependencies.keys().map(String::as_str).collect();
    let mut expected: Vec<&str> = MAY_IMPORT.iter().map(|(name, _)| *name).collect();
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(import_faults(&dependencies), Vec::<String>::new());
}

#[test]
fn a_turned_import_is_seen() {
    let mut dependencies = dependencies();
    dependencies.entry(String::from("caustica-renderer")).or_default().insert(String::from("caustica-scene"));
    dependencies.entry(String::from("caustica-scene")).or_default().insert(String::from("egui"));
    assert_eq!(import_faults(&dependencies).len(), 2);
}

#[test]
fn libraries_pull_in_no_user_interface() {
    for package in ["caustica-scene", "caustica-renderer", "caustica-gpu"] {
        let tree =
            cargo(&["tree", "--offline", "--package", package, "--edges", "normal", "--prefix", "none"]);
        for line in tree.lines() {
            let name = line.split(' ').next().unwrap_or_default();
            let beginning = EDITOR_ONLY_AT_ANY_DEPTH.iter().find(|beginning| name.starts_with(**beginning));
            assert!(beginning.is_none(), "{package} pulls in {name}");
        }
    }
}

/// Files below a folder with one of these endings, the build folder left out.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(next) = waiting.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder of the repository").flatten() {
            let path = entry.path();
            let name = entry.file_name();
            if path.is_dir() {
                if name != "target" && !name.to_string_lossy().starts_with('.') {
                    waiting.push(path);
                }
            } else if path.extension().is_some_and(|e| endings.iter().any(|ending| e == *ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

const GLSL: &[&str] = &["glsl", "vert", "frag", "comp", "rgen", "rchit", "rahit", "rmiss", "rint"];

/// Which rooms a shader file of a room may include.
fn room_may_include(room: &str, other: &str) -> bool {
    match room {
        "passes" => ["passes", "lib", "shared"].contains(&other),
        "lib" => ["lib", "shared"].contains(&other),
        "shared" => other == "shared",
        _ => false,
    }
}

fn includes(text: &str) -> Vec<String> {
    text.lines()
        .filter_map(|line| line.trim_start().strip_prefix("#include"))
        .filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next().map(str::to_owned))
        .collect()
}

#[test]
fn shaders_include_one_way() {
    let root = repository().join("shaders");
    let mut graph: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in files(&root, GLSL) {
        let name = path.strip_prefix(&root).expect("inside").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a shader");
        graph.insert(name, includes(&text));
    }
    assert!(graph.len() > 20, "only {} shaders were found", graph.len());
    let room = |file: &str| file.split('/').next().unwrap_or_default().to_owned();
    for (file, included) in &graph {
        for other in included {
            assert!(graph.contains_key(other), "{file} includes {other}, which is not there");
            assert!(
                room_may_include(&room(file), &room(other)),
                "{file} includes {other}: against the direction"
            );
        }
        assert!(!reaches(&graph, file, file), "{file} includes itself");
    }
}

fn reaches(graph: &BTreeMap<String, Vec<String>>, from: &str, goal: &str) -> bool {
    let mut seen = BTreeSet::new();
    let mut waiting: Vec<&str> = graph.get(from).into_iter().flatten().map(String::as_str).collect();
    while let Some(next) = waiting.pop() {
        if next == goal {
            return true;
        }
        if seen.insert(next) {
            waiting.extend(graph.get(next).into_iter().flatten().map(String::as_str));
        }
    }
    false
}

/// Lines that hold the keyword outside of comments and strings, as far as a line shows it.
fn lines_with_unsafe(text: &str) -> Vec<usize> {
    let keyword = ["un", "safe"].concat();
    let holds = |line: &str| {
        let code = line.split("//").next().unwrap_or_default();
        let outside: String = code.split('"').step_by(2).collect::<Vec<_>>().join(" ");
        outside.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == keyword)
    };
    text.lines().enumerate().filter(|(_, line)| holds(line)).map(|(i, _)| i + 1).collect()
}

#[test]
fn unsafe_code_stands_in_one_package() {
    let root = repository();
    for path in files(&root, &["rs"]) {
        if path.starts_with(root.join("renderer/gpu")) {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a source file");
        assert_eq!(lines_with_unsafe(&text), Vec::<usize>::new(), "{}", path.display());
    }
    let seen = lines_with_unsafe("fn a() {\n    un\u{73}afe { b() }\n}\n// unsafe\nlet c = \"unsafe\";\n");
    assert_eq!(seen, [2]);
}

#[test]
fn files_stay_short() {
    const LINES: usize = 500;
    let root = repository();
    let endings: Vec<&str> = GLSL.iter().copied().chain(["rs"]).collect();
    let mut long = Vec::new();
    for path in files(&root, &endings) {
        let lines = std::fs::read_to_string(&path).expect("a source file").lines().count();
        if lines > LINES {
            long.push(format!("{}: {lines} lines", path.strip_prefix(&root).unwrap_or(&path).display()));
        }
    }
    assert!(long.is_empty(), "past {LINES} lines look for the seam:\n{}", long.join("\n"));
}

/// The rows of the first table below a heading, cells trimmed, without the two lines of its head.
fn table_below(text: &str, heading: &str) -> Vec<Vec<String>> {
    let lines = text.lines().map(|line| line.trim_start_matches("//!").trim());
    let table = lines.skip_while(|line| *line != heading).skip_while(|line| !line.starts_with('|'));
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    table.take_while(|line| line.starts_with('|')).skip(2).map(cells).collect()
}

/// What is wrong with the list of tests of the rows of a table, in words. `is_test`: whether there is a function of that name.
fn list_faults(rows: &[Vec<String>], list: &[Vec<String>], is_test: impl Fn(&str) -> bool) -> Vec<String> {
    let events = |table: &[Vec<String>]| table.iter().map(|row| row[0].clone()).collect::<Vec<_>>();
    let mut faults = Vec::new();
    if events(rows) != events(list) {
        faults.push(format!("other rows: {:?} and {:?}", events(rows), events(list)));
    }
    for row in list {
        let tests: Vec<&str> =
            row[1].split('`').skip(1).step_by(2).filter(|word| !word.ends_with(".rs")).collect();
        let missing = tests.iter().filter(|test| !is_test(test));
        faults.extend(missing.map(|test| format!("{}: there is no test {test}", row[0])));
        if tests.is_empty() {
            faults.push(format!("{} has no test", row[0]));
        }
    }
    faults
}

#[test]
fn each_row_of_the_table_of_invalidation_has_a_test() {
    let read = |path: &str| std::fs::read_to_string(repository().join(path)).expect(path);
    let rows = table_below(&read("ARCHITECTURE.md"), "## Invalidation");
    let head = read("tests/tests/acceleration.rs");
    let list = table_below(&head, "");
    let files = ["acceleration", "accel_edges", "invalidation", "deform", "churn/rows"];
    let text: String = files.iter().map(|name| read(&format!("tests/tests/{name}.rs"))).collect();
    let is_test = |name: &str| text.contains(&format!("fn {name}("));
    assert!(rows.len() > 10);
    assert_eq!(list_faults(&rows, &list, is_test), Vec::<String>::new());
    let mut damaged = list;
    damaged.pop();
    damaged[0][1] = String::from("`a_test_that_is_gone`");
    damaged[1][1].clear();
    assert_eq!(list_faults(&rows, &damaged, is_test).len(), 3);
}
