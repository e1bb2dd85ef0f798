//! `caustica check`: numerical and structural audit of a file; exit code 1 on errors.

use std::path::PathBuf;
use std::process::ExitCode;

use caustica_scene::{Mesh, Severity, audit};
use clap::Args;
use serde_json::json;

use super::{EXIT_INPUT, SourceArgs, document_of};

/// Arguments of `caustica check`.
#[derive(Args, Debug)]
pub(super) struct CheckArgs {
    /// A project, .gltf, .glb, .obj, or a text file of spheres and boxes
    file: PathBuf,
    #[command(flatten)]
    sources: SourceArgs,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Audits the file.
pub(super) fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let (document, warnings) = document_of(&args.file, args.sources)?;
    let findings = audit(&document);
    let errors = findings.iter().filter(|finding| finding.severity == Severity::Error).count();
    let placed = |count: fn(&Mesh) -> usize| -> usize {
        document.renderables().filter_map(|r| document.mesh(r.mesh).map(count)).sum()
    };
    let (triangles, shapes) = (placed(Mesh::triangle_count), placed(Mesh::shape_count));
    if args.json {
        let list: Vec<_> = findings
            .iter()
            .map(|f| json!({ "severity": format!("{:?}", f.severity).to_lowercase(), "message": f.message }))
            .collect();
        let warnings: Vec<_> = warnings.iter().map(ToString::to_string).collect();
        say!(
            "{}",
            json!({
                "file": args.file,
                "errors": errors,
                "findings": list,
                "import_warnings": warnings,
                "triangles": triangles,
                "shapes": shapes,
                "materials": document.materials().count(),
                "textures": document.textures().count(),
            })
        );
    } else {
        for finding in &findings {
            say!("{:?}: {}", finding.severity, finding.message);
        }
        say!(
            "{}: {triangles} triangles, {shapes} spheres and boxes, {} materials, {} textures, {} import warnings, {} findings, {errors} errors",
            args.file.display(),
            document.materials().count(),
            document.textures().count(),
            warnings.len(),
            findings.len()
        );
    }
    Ok(if errors == 0 { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INPUT) })
}
