//! The command line: what it accepts, and which exit code an error becomes. One file a subcommand.

/// Prints a line to standard output; a reader that has gone away is no error.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::say_line(format_args!($($text)*)) };
}

mod bench;
mod check;
mod devices;
mod export;
mod output;
mod render;
mod report;
mod shot;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use caustica_renderer::RendererError;
use caustica_renderer::gpu::{Device, DeviceOptions, GpuError, Instance, InstanceOptions, Requirements};
use caustica_scene::import::Warning;
use caustica_scene::{Document, Local, Project, ShapeSource};
use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use crate::device_watch::{DeviceWatch, end};
use crate::recovery;
use crate::session::{Loaded, load};
use crate::ui_state::Config;

/// Scene editor with a hybrid Vulkan ray-tracing renderer. Without a subcommand the editor opens.
#[derive(Parser, Debug)]
#[command(name = "caustica", version, about, subcommand_negates_reqs = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// A project, .gltf, .glb or .obj to open in the editor (default: the demo project, where it is found)
    file: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Read shaders from this folder instead of the copy in the binary
    #[arg(long, value_name = "DIR", global = true)]
    shaders: Option<PathBuf>,
    /// What a process has left for this one whose device did not come back
    #[arg(long, hide = true)]
    after_hang: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a project or model to a PNG or EXR
    Render(render::RenderArgs),
    /// Measure how far pipelines and settings are from a reference after how long
    Report(report::ReportArgs),
    /// Audit a project or model: structure and numbers; exit code 1 on errors
    Check(check::CheckArgs),
    /// Write a project or model as .glb or .gltf
    Export(export::ExportArgs),
    /// List the Vulkan devices, what each lacks, and which one is chosen; or measure one
    Devices(devices::DevicesArgs),
    /// Measure what scenes, edits and acceleration structures cost here
    Bench(bench::BenchArgs),
}

/// Which device, and how.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct DeviceArgs {
    /// Use the device with this name (or part of it) or index; see `caustica devices`
    #[arg(long, value_name = "NAME|INDEX", global = true)]
    device: Option<String>,
    /// Load the Vulkan validation layer and log its messages
    #[arg(long, global = true)]
    validation: bool,
    /// Use no more device memory than this: textures go without their largest levels, what cannot fit is refused
    #[arg(long, value_name = "MIB", global = true, value_parser = parse_budget)]
    memory_budget: Option<u64>,
}

/// A number of MiB that something may fit into.
fn parse_budget(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(0) => Err(String::from("nothing fits into that: give at least 1")),
        Ok(mib) => Ok(mib),
        Err(_) => Err(String::from("not a whole number of MiB, at least 1")),
    }
}

impl DeviceArgs {
    /// Opens the device for work without a window.
    fn open(&self) -> Result<Arc<Device>, GpuError> {
        let instance = Instance::new(InstanceOptions { validation: self.validation, display: None })?;
        let requirements = Requirements { device: self.device.clone(), present: false };
        Device::new(&instance, &DeviceOptions { requirements, memory_limit_bytes: self.memory_limit_bytes() })
    }

    /// Ends the program with an error when the device does not come back, for as long as the answer is kept.
    fn watch(device: &Arc<Device>) -> Option<DeviceWatch> {
        let watched = Arc::clone(device);
        let hung = move |waited: Duration| {
            eprintln!("error: {}", watched.overdue(waited.as_secs()));
            end(EXIT_DEVICE);
        };
        let watch = DeviceWatch::start(device, |_| false, hung);
        watch.inspect_err(|error| tracing::warn!("a device that hangs is not noticed: {error}")).ok()
    }

    fn memory_limit_bytes(&self) -> Option<u64> {
        self.memory_budget.map(|mib| mib.saturating_mul(1 << 20))
    }
}

/// Which files of a project are read.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct SourceArgs {
    /// Read also what a project names outside of its folder (else only for projects that were saved here)
    #[arg(long)]
    outside: bool,
}

impl SourceArgs {
    /// Reads a file; says so when unsaved changes of it were left behind.
    fn load(self, file: &Path, progress: &dyn Fn(&str, f32)) -> anyhow::Result<Loaded> {
        let is_project = Project::is_project_path(file);
        let outside = self.outside || is_project && Config::load().trusts(file);
        let loaded = load(file, outside, progress)?;
        if is_project {
            for words in recovery::unsaved_changes_of(file) {
                tracing::warn!("{words}");
            }
        }
        Ok(loaded)
    }
}

/// The input is at fault.
const EXIT_INPUT: u8 = 1;
/// Wrong usage.
const EXIT_USAGE: u8 = 2;
/// No suitable device, or the device failed.
pub(crate) const EXIT_DEVICE: u8 = 3;

/// Parses the command line and runs it.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors; clap prints both where they belong.
            let code = if error.use_stderr() { EXIT_USAGE } else { 0 };
            return if error.print().is_ok() { ExitCode::from(code) } else { ExitCode::from(EXIT_USAGE) };
        }
    };
    let result = match cli.command {
        _ if cli.shaders.as_ref().is_some_and(|folder| !folder.join("passes").is_dir()) => {
            let folder = cli.shaders.unwrap_or_default();
            Err(anyhow::anyhow!(
                "--shaders {}: is no folder of shaders, it has no folder \"passes\"",
                folder.display()
            ))
        }
        Some(Command::Render(args)) => logged(|| render::run(&args, &cli.device, cli.shaders.clone())),
        Some(Command::Report(args)) => logged(|| report::run(&args, &cli.device, cli.shaders.clone())),
        Some(Command::Check(args)) => logged(|| check::run(&args)),
        Some(Command::Export(args)) => logged(|| export::run(&args)),
        Some(Command::Devices(args)) => logged(|| devices::run(&args, &cli.device)),
        Some(Command::Bench(args)) => logged(|| bench::run(&args, &cli.device, cli.shaders.clone())),
        None => match cli.file.as_ref().filter(|file| !file.exists()) {
            Some(missing) => {
                let missing = missing.display();
                Err(anyhow::anyhow!("{missing}: there is no such file, and no such command (see --help)"))
            }
            None => crate::app::run(crate::app::AppOptions {
                file: cli.file.or_else(demo_project),
                device: cli.device.device.clone(),
                shaders: cli.shaders.or_else(shader_folder),
                validation: cli.device.validation,
                memory_limit_bytes: cli.device.memory_limit_bytes(),
                after_hang: cli.after_hang,
            })
            .map(|()| ExitCode::SUCCESS),
        },
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        match exit_code_of(&error) {
            // A driver whose device does not answer may hold the process at its end.
            EXIT_DEVICE => end(EXIT_DEVICE),
            code => ExitCode::from(code),
        }
    })
}

/// The demo project, where the program is started from its checkout or was built in one that is still there.
fn demo_project() -> Option<PathBuf> {
    const DEMO: &str = "projects/gallery/gallery.caustica.json";
    let folders = [PathBuf::from("."), PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))];
    folders.into_iter().map(|folder| folder.join(DEMO)).find(|file| file.is_file())
}

/// The folder of the shaders, where the program is started from its checkout or was built in one that is still there.
fn shader_folder() -> Option<PathBuf> {
    let folders = [PathBuf::from("."), PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))];
    folders.into_iter().map(|folder| folder.join("shaders")).find(|folder| folder.join("passes").is_dir())
}

/// The scene of a file, with what was left out or repaired on reading.
fn document_of(file: &Path, sources: SourceArgs) -> anyhow::Result<(Document, Vec<Warning>)> {
    let mut document = Document::new();
    let warnings = match sources.load(file, &|_, _| {})? {
        Loaded::Project(project) => return Ok((project.document, project.warnings)),
        Loaded::Model(imported) => {
            let warnings = imported.warnings.clone();
            let prefab = document.add_imported(*imported)?;
            let (_, place) = document.instantiate_edit(prefab, None, Local::default());
            document.apply(place)?;
            document.update_transforms();
            warnings
        }
        Loaded::Shapes(shapes) => {
            let source = ShapeSource::File(shapes);
            let (_, edit) = document.add_shapes_edit("shapes", source, &[], Local::default())?;
            document.apply(edit)?;
            Vec::new()
        }
        Loaded::Environment(..) => anyhow::bail!("{}: an environment has no scene", file.display()),
    };
    Ok((document, warnings))
}

/// A bar on a terminal, nothing elsewhere or where only an object is to be printed.
fn progress_bar(json: bool) -> ProgressBar {
    if json || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(100);
    if let Ok(style) =
        ProgressStyle::with_template("{msg:12} [{bar:40}] {pos}/{len} {elapsed} (about {eta} left)")
    {
        bar.set_style(style);
    }
    bar
}

/// Shows on a bar how far the reading of a file is.
fn steps_on(bar: &ProgressBar) -> impl Fn(&str, f32) {
    move |step: &str, share: f32| {
        bar.set_message(step.to_owned());
        bar.set_position((share * 100.0) as u64);
    }
}

/// What `say!` does.
fn say_line(text: std::fmt::Arguments<'_>) {
    use std::io::Write;
    // The only thing that can go wrong is that nobody reads any more.
    let _ = writeln!(std::io::stdout().lock(), "{text}");
}

/// Runs a subcommand with warnings printed to standard error.
fn logged(run: impl FnOnce() -> anyhow::Result<ExitCode>) -> anyhow::Result<ExitCode> {
    let filter = tracing_subscriber::EnvFilter::try_from_env("CAUSTICA_LOG")
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time()
        .finish();
    // Of all threads: shaders are watched and compiled by others. There is another one only where a test runs several commands.
    let _ = tracing::subscriber::set_global_default(subscriber);
    run()
}

/// 3 when the device is at fault, else 1.
fn exit_code_of(error: &anyhow::Error) -> u8 {
    let from_device = error.chain().any(|cause| {
        let gpu = match cause.downcast_ref::<RendererError>() {
            Some(RendererError::Gpu(gpu)) => Some(gpu),
            _ => cause.downcast_ref::<GpuError>(),
        };
        // What is larger than any device of this kind takes is the input's fault.
        gpu.is_some_and(|gpu| !matches!(gpu, GpuError::Limit { .. }))
    });
    if from_device { EXIT_DEVICE } else { EXIT_INPUT }
}
