//! `caustica check`: numerical and structural audit of files; exit code 1 on errors.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use caustica_scene::import::{Warning, counted, load_environment};
use caustica_scene::{
    Document, Edit, Environment, EnvironmentFile, Finding, Mesh, Severity, Subject, Target, audit,
};
use clap::Args;
use serde_json::{Value, json};

use super::{EXIT_INPUT, SourceArgs, document_of};

/// Arguments of `caustica check`.
#[derive(Args, Debug)]
pub(super) struct CheckArgs {
    /// Projects, .gltf, .glb, .obj, text files of spheres and boxes, or environments (.hdr, .exr)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    sources: SourceArgs,
    /// Print one JSON object; for several files with a list of them and the time that each took
    #[arg(long)]
    json: bool,
}

/// What was found in a file that loads.
struct Report {
    document: Document,
    warnings: Vec<Warning>,
    findings: Vec<Finding>,
}

/// Audits the files. Of several, one that does not load is named and the others go on.
pub(super) fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let mut bad = 0;
    let mut list = Vec::new();
    for file in &args.files {
        let start = Instant::now();
        let report = match (read(file, args.sources), &args.files[..]) {
            (Err(error), [_]) => return Err(error),
            (report, _) => report,
        };
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        bad += usize::from(report.as_ref().map_or(1, Report::errors) > 0);
        match (&report, args.json) {
            (Ok(report), false) => report.say(file),
            (Err(error), false) => say!("Error: {error:#}"),
            (report, true) => {
                let mut value = match report {
                    Ok(report) => report.json(file),
                    Err(error) => json!({ "file": file, "error": format!("{error:#}") }),
                };
                if args.files.len() > 1 {
                    value["milliseconds"] = milliseconds.into();
                }
                list.push(value);
            }
        }
    }
    match (args.json, &list[..]) {
        (true, [one]) => say!("{one}"),
        (true, _) => say!("{}", json!({ "files": list, "files_with_errors": bad })),
        (false, _) if args.files.len() > 1 => say!("{} files, {bad} with errors", args.files.len()),
        (false, _) => {}
    }
    Ok(if bad == 0 { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INPUT) })
}

fn read(file: &Path, sources: SourceArgs) -> anyhow::Result<Report> {
    let extension = file.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let (document, warnings) = match extension.as_deref() {
        Some("hdr" | "exr") => surroundings(file)?,
        _ => document_of(file, sources)?,
    };
    let findings = audit(&document);
    Ok(Report { document, warnings, findings })
}

/// An environment is checked as that of an empty scene.
fn surroundings(file: &Path) -> anyhow::Result<(Document, Vec<Warning>)> {
    let (map, warnings) = load_environment(file)?;
    let map = Some(Arc::new(map));
    let file = EnvironmentFile { path: file.to_owned(), rotation_rad: 0.0, scale: 1.0, map };
    let mut document = Document::new();
    document.apply(Edit::SetEnvironment(Environment::File(file)))?;
    Ok((document, warnings))
}

impl Report {
    fn errors(&self) -> usize {
        self.findings.iter().filter(|finding| finding.severity == Severity::Error).count()
    }

    fn placed(&self, count: fn(&Mesh) -> usize) -> usize {
        self.document.renderables().filter_map(|r| self.document.mesh(r.mesh).map(count)).sum()
    }

    fn json(&self, file: &Path) -> Value {
        let finding = |f: &Finding| json!({ "severity": format!("{:?}", f.severity).to_lowercase(), "subject": subject(f), "message": f.message });
        json!({
            "file": file,
            "errors": self.errors(),
            "findings": self.findings.iter().map(finding).collect::<Vec<_>>(),
            "import_warnings": self.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "triangles": self.placed(Mesh::triangle_count),
            "shapes": self.placed(Mesh::shape_count),
            "materials": self.document.materials().count(),
            "textures": self.document.textures().count(),
        })
    }

    fn say(&self, file: &Path) {
        for finding in &self.findings {
            say!("{:?}: {}", finding.severity, finding.about());
        }
        say!(
            "{}: {}, {}, {}, {}, {}, {}, {}",
            file.display(),
            counted(self.placed(Mesh::triangle_count), "triangle", "triangles"),
            counted(self.placed(Mesh::shape_count), "sphere or box", "spheres and boxes"),
            counted(self.document.materials().count(), "material", "materials"),
            counted(self.document.textures().count(), "texture", "textures"),
            counted(self.warnings.len(), "import warning", "import warnings"),
            counted(self.findings.len(), "finding", "findings"),
            counted(self.errors(), "error", "errors")
        );
    }
}

/// What a finding is about: kind, name and id, and the number of a part.
fn subject(finding: &Finding) -> Value {
    let (kind, id) = finding.subject.kind_and_id();
    let mut value = json!({ "kind": kind, "name": finding.name, "id": id });
    if let Subject::Target(Target { part: Some(part), .. }) = finding.subject {
        value["part"] = part.into();
    }
    value
}
