//! Every project in `projects/` opens, is sound and shows something; and what their READMEs say about shaders holds: a
//! quoted line stands where they say, and the edit that they propose compiles and changes the picture.
#![expect(clippy::expect_used, clippy::panic, reason = "a test says what is wrong by panicking")]

use std::path::{Path, PathBuf};

use caustica_tests::program::caustica;
use caustica_tests::{repository, shader_folder};

/// The folders of all projects, sorted by name, each with its project file.
fn projects() -> Vec<(PathBuf, String)> {
    let folders = std::fs::read_dir(repository().join("projects")).expect("the folder of the projects");
    let mut found: Vec<(PathBuf, String)> = folders
        .flatten()
        .flat_map(|folder| std::fs::read_dir(folder.path()).into_iter().flatten().flatten())
        .filter(|file| file.file_name().to_string_lossy().ends_with(".caustica.json"))
        .map(|file| (file.path().with_file_name(""), file.path().display().to_string()))
        .collect();
    found.sort();
    found
}

/// Renders one sample; neither the layer nor the program may have anything to say. Returns the bytes of the picture.
fn render(folder: &Path, project: &str, more: &[&str]) -> Vec<u8> {
    let picture = folder.join("a.png");
    let output = picture.display().to_string();
    let mut arguments =
        vec!["render", project, "-o", &output, "--size", "64x48", "--samples", "1", "--validation"];
    arguments.extend(more);
    let run = caustica(folder, &arguments);
    assert_eq!(run.code, Some(0), "{project}: {}", run.stderr);
    assert_eq!(run.stderr.trim(), "", "{project} {more:?}");
    image::open(picture).expect("the PNG").to_rgb8().into_raw()
}

/// An edit that a README proposes: a `diff` block below a sentence with the file and the function in backticks.
struct Experiment {
    shader: String,
    function: String,
    before: Vec<String>,
    after: Vec<String>,
}

impl Experiment {
    /// All of a README, in order.
    fn all_of(readme: &str) -> Vec<Self> {
        let blocks: Vec<&str> = readme.split("```").collect();
        let diffs = blocks.windows(2).filter_map(|pair| Some((pair[0], pair[1].strip_prefix("diff\n")?)));
        diffs.map(|(text, diff)| Self::read(text, diff)).collect()
    }

    fn read(text_before: &str, diff: &str) -> Self {
        let words: Vec<&str> = text_before.split('`').collect();
        let quoted: Vec<&str> = words.iter().skip(1).step_by(2).copied().collect();
        let at = quoted.iter().rposition(|word| word.starts_with("shaders/"));
        let at = at.unwrap_or_else(|| panic!("no shader file is named before:{diff}"));
        let of =
            |mark: char| diff.lines().filter_map(|line| line.strip_prefix(mark)).map(str::to_owned).collect();
        Self {
            shader: quoted[at].to_owned(),
            function: quoted.get(at + 1).map(|word| (*word).to_owned()).expect("the name of a function"),
            before: of('-'),
            after: of('+'),
        }
    }

    /// The shader file with the edit made.
    fn applied(&self, source: &str) -> Result<String, String> {
        let head = source
            .lines()
            .find(|line| !line.starts_with([' ', '/']) && line.contains(&format!(" {}(", self.function)));
        let start = head.and_then(|line| source.find(line)).ok_or("the function is not there")?;
        let length = source[start..].find("\n}\n").ok_or("the function has no end")?;
        let body = &source[start..start + length + 1];
        let before = self.before.join("\n") + "\n";
        if self.before.is_empty() || body.matches(&before).count() != 1 {
            return Err(format!("not once in the function:\n{before}"));
        }
        let after: String = self.after.iter().map(|line| line.clone() + "\n").collect();
        Ok(source.replacen(body, &body.replacen(&before, &after, 1), 1))
    }
}

fn readme_of(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("README.md"))
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
}

/// Copies the shaders, folder by folder.
fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder of shaders").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

#[test]
fn every_project_is_sound_and_shows_something() {
    let projects = projects();
    assert!(projects.len() >= 10, "the gallery and nine lectures: {projects:?}");
    for (_, project) in projects {
        let folder = tempfile::tempdir().expect("a folder");
        let check = caustica(folder.path(), &["check", &project]);
        assert_eq!(check.code, Some(0), "{project}: {}{}", check.stdout, check.stderr);
        let bytes = render(folder.path(), &project, &[]);
        let mean = bytes.iter().map(|&byte| f64::from(byte)).sum::<f64>() / bytes.len() as f64;
        assert!((5.0..250.0).contains(&mean), "{project}: mean byte {mean}");
    }
}

#[test]
fn every_quoted_shader_line_is_there() {
    for (folder, _) in projects() {
        let readme = readme_of(&folder);
        let experiments = Experiment::all_of(&readme);
        let name = folder.display();
        let promises = name.to_string().contains("lecture-") || readme.contains("to edit");
        assert!(!experiments.is_empty() || !promises, "{name}: nothing to edit");
        assert!(readme.lines().count() < 50, "{name}: a README is under 50 lines");
        for experiment in experiments {
            let source = std::fs::read_to_string(repository().join(&experiment.shader));
            let source = source.unwrap_or_else(|error| panic!("{name}: {}: {error}", experiment.shader));
            if let Err(fault) = experiment.applied(&source) {
                panic!("{name}: {} in {}: {fault}", experiment.function, experiment.shader);
            }
        }
    }
}

#[test]
fn every_proposed_edit_compiles_and_changes_the_picture() {
    for (project_folder, project) in projects() {
        let folder = tempfile::tempdir().expect("a folder");
        let experiments = Experiment::all_of(&readme_of(&project_folder));
        let unchanged = (!experiments.is_empty()).then(|| render(folder.path(), &project, &[]));
        for experiment in experiments {
            copy_folder(&shader_folder(), &folder.path().join("shaders"));
            let file = folder.path().join(&experiment.shader);
            let source = std::fs::read_to_string(&file).expect("the shader");
            let edited = experiment.applied(&source).unwrap_or_else(|fault| panic!("{project}: {fault}"));
            std::fs::write(&file, edited).expect("the edited shader");
            let changed = render(folder.path(), &project, &["--shaders", "shaders"]);
            assert!(unchanged.as_ref() != Some(&changed), "{project}: {} changes nothing", experiment.shader);
        }
    }
}
