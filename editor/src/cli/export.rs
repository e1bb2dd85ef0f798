//! `caustica export`: a project or model as glTF or GLB; exit code 1 when it cannot be read or written.

use std::path::PathBuf;
use std::process::ExitCode;

use caustica_scene::import::counted;
use caustica_scene::{ExportFormat, export};
use clap::Args;
use serde_json::json;

use super::{SourceArgs, document_of, output};

/// Arguments of `caustica export`.
#[derive(Args, Debug)]
pub(super) struct ExportArgs {
    /// A project, .gltf, .glb, .obj, or a text file of spheres and boxes
    file: PathBuf,
    #[command(flatten)]
    sources: SourceArgs,
    /// The file to write: .glb, or .gltf with a .bin beside it
    #[arg(short, long, value_name = "OUT", value_parser = parse_output)]
    output: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Writes the scene.
pub(super) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let (document, import_warnings) = document_of(&args.file, args.sources)?;
    output::make_folder(&args.output)?;
    let exported = export(&document, &args.output)?;
    exported.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
    let (nodes, meshes, materials) = (exported.nodes, exported.meshes, exported.materials);
    if args.json {
        let texts = |warnings: &[caustica_scene::import::Warning]| -> Vec<String> {
            warnings.iter().map(ToString::to_string).collect()
        };
        say!(
            "{}",
            json!({
                "files": exported.files,
                "nodes": nodes,
                "meshes": meshes,
                "materials": materials,
                "import_warnings": texts(&import_warnings),
                "warnings": texts(&exported.warnings),
            })
        );
    } else {
        say!(
            "{}: {}, {}, {}, {}",
            args.output.display(),
            counted(nodes, "node", "nodes"),
            counted(meshes, "mesh", "meshes"),
            counted(materials, "material", "materials"),
            counted(exported.warnings.len(), "warning", "warnings")
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn parse_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match ExportFormat::of(&path) {
        Some(_) => Ok(path),
        None => Err(String::from("the name of the output must end in .glb or .gltf")),
    }
}
