//! `caustica bench`: what the program costs on this machine and device. Enters: a suite. Leaves: tables on standard output
//! and one JSON object in a file. It measures and never judges: no exit code depends on a time.

mod cloud;
mod convergence;
mod crowd;
mod edits;
mod hybrid;
mod machine;
mod motion;
mod moves;
mod reload;
mod rig;
mod series;
mod shapes;
mod skinned;
mod soak;
mod structures;
mod table;

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context;
use caustica_renderer::gpu::Device;
use clap::Args;
use clap::builder::PossibleValuesParser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};

use super::DeviceArgs;
use super::render::report_validation;
use convergence::ConvergenceArgs;
use hybrid::HybridArgs;
use motion::MotionArgs;
pub(super) use series::Series;
use table::Table;

/// A named list of measurements.
struct Suite {
    name: &'static str,
    parts: &'static [Part],
}

/// One measurement; its figures stand under its name in the JSON object.
struct Part {
    name: &'static str,
    run: fn(&Bench) -> anyhow::Result<Measured>,
}

const SUITES: [Suite; 6] = [ACCEL, SHAPES, HYBRID, RELOAD, CONVERGENCE, MOTION];

const MOTION: Suite = Suite { name: "motion", parts: &[Part { name: "memory", run: motion::run }] };

const CONVERGENCE: Suite =
    Suite { name: "convergence", parts: &[Part { name: "samplers", run: convergence::run }] };

const RELOAD: Suite = Suite { name: "reload", parts: &[Part { name: "files", run: reload::run }] };

const SHAPES: Suite = Suite { name: "shapes", parts: &[Part { name: "cloud", run: cloud::run }] };

const HYBRID: Suite = Suite { name: "hybrid", parts: &[Part { name: "settings", run: hybrid::run }] };

const ACCEL: Suite = Suite {
    name: "accel",
    parts: &[
        // First, while the process is small: memory that others gave back to the allocator would hide what is lost here.
        Part { name: "soak", run: soak::run },
        Part { name: "moves", run: moves::run },
        Part { name: "structures", run: structures::run },
        Part { name: "skinned", run: skinned::run },
    ],
};

/// Arguments of `caustica bench`.
#[derive(Args, Debug)]
pub(super) struct BenchArgs {
    /// Where the figures go, one JSON object
    #[arg(short, long, value_name = "FILE.json")]
    output: PathBuf,
    /// Which suite (default: all)
    #[arg(long, value_name = "NAME", value_parser = names(&SUITES.each_ref().map(|suite| suite.name)))]
    suite: Option<String>,
    /// Only these parts of it
    #[arg(long, value_name = "PART", value_delimiter = ',', value_parser = names(&part_names()))]
    only: Vec<String>,
    /// Small sizes: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Commit that the program was built from, noted beside the figures (default: the variable CAUSTICA_COMMIT)
    #[arg(long, value_name = "HASH")]
    commit: Option<String>,
    /// Print the JSON object on standard output instead of tables
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    hybrid: HybridArgs,
    #[command(flatten)]
    convergence: ConvergenceArgs,
    #[command(flatten)]
    motion: MotionArgs,
}

fn names(known: &[&'static str]) -> PossibleValuesParser {
    PossibleValuesParser::new(known.iter().copied())
}

fn part_names() -> Vec<&'static str> {
    SUITES.iter().flat_map(|suite| suite.parts).map(|part| part.name).collect()
}

/// What a measurement needs to know.
struct Bench {
    device: Arc<Device>,
    shaders: Option<PathBuf>,
    quick: bool,
    progress: bool,
    hybrid: HybridArgs,
    convergence: ConvergenceArgs,
    motion: MotionArgs,
}

impl Bench {
    /// The sizes of a run, or the small ones of a quick run.
    fn sizes<'a, T>(&self, full: &'a [T], quick: &'a [T]) -> &'a [T] {
        if self.quick { quick } else { full }
    }

    /// A bar of `steps`; nothing is drawn where nobody watches.
    fn bar(&self, name: &'static str, steps: usize) -> ProgressBar {
        if !self.progress {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(steps as u64).with_prefix(name);
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix:10} [{bar:30}] {pos}/{len} {elapsed} (about {eta} left) {msg}",
        ) {
            bar.set_style(style);
        }
        bar
    }
}

/// What a measurement gives.
struct Measured {
    figures: Value,
    tables: Vec<Table>,
}

/// Runs the suite.
pub(super) fn run(
    args: &BenchArgs,
    device: &DeviceArgs,
    shaders: Option<PathBuf>,
) -> anyhow::Result<ExitCode> {
    let device = device.open()?;
    let _watch = DeviceArgs::watch(&device);
    let progress = !args.json && std::io::stderr().is_terminal();
    let bench = Bench {
        device: Arc::clone(&device),
        shaders,
        quick: args.quick,
        progress,
        hybrid: args.hybrid.clone(),
        convergence: args.convergence.clone(),
        motion: args.motion.clone(),
    };
    let mut report = head(args, &device);
    // Written after every part: a run that is cut short leaves what it has measured.
    write(args, &report)?;
    if !args.json {
        print_head(&report);
    }
    for suite in SUITES.iter().filter(|suite| args.suite.as_ref().is_none_or(|name| name == suite.name)) {
        let mut figures = Map::new();
        let wanted = |part: &&Part| args.only.is_empty() || args.only.iter().any(|name| name == part.name);
        for part in suite.parts.iter().filter(wanted) {
            let measured = (part.run)(&bench).with_context(|| format!("{} {}", suite.name, part.name))?;
            figures.insert(part.name.to_owned(), measured.figures);
            report.insert(suite.name.to_owned(), Value::Object(figures.clone()));
            write(args, &report)?;
            if !args.json {
                measured.tables.iter().for_each(Table::print);
            }
        }
    }
    report_validation(&device)?;
    if args.json {
        say!("{}", Value::Object(report));
    }
    Ok(ExitCode::SUCCESS)
}

/// What was measured where.
fn head(args: &BenchArgs, device: &Device) -> Map<String, Value> {
    let commit = args.commit.clone().or_else(|| std::env::var("CAUSTICA_COMMIT").ok());
    let mut command = vec![String::from("caustica")];
    command.extend(std::env::args().skip(1));
    let mut head = Map::new();
    head.insert(String::from("date"), json!(machine::today()));
    head.insert(String::from("command"), json!(command.join(" ")));
    head.insert(String::from("commit"), json!(commit.unwrap_or_else(|| String::from("unknown"))));
    head.insert(String::from("version"), json!(env!("CARGO_PKG_VERSION")));
    head.insert(String::from("machine"), machine::describe());
    head.insert(String::from("device"), json!({ "name": device.name(), "driver": device.driver() }));
    head.insert(String::from("quick"), json!(args.quick));
    head
}

fn print_head(head: &Map<String, Value>) {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let of = |object: &str, key: &str| {
        head.get(object).and_then(|value| value.get(key)).map_or_else(String::new, text)
    };
    let plain = |key: &str| head.get(key).map_or_else(String::new, text);
    say!("Device: {}, {}", of("device", "name"), of("device", "driver"));
    say!(
        "Machine: {}, {} threads, {} MiB",
        of("machine", "processor"),
        of("machine", "threads"),
        of("machine", "memory_mib")
    );
    say!(
        "Commit: {}, {}. Milliseconds: median, and in brackets the 95th percentile.",
        plain("commit"),
        plain("date")
    );
    say!("\n    {}", plain("command"));
}

fn write(args: &BenchArgs, report: &Map<String, Value>) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(report)? + "\n";
    let place = || args.output.display().to_string();
    if let Some(folder) = args.output.parent() {
        std::fs::create_dir_all(folder).with_context(place)?;
    }
    std::fs::write(&args.output, text).with_context(place)
}
