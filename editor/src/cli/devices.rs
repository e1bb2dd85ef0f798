//! `caustica devices`: every Vulkan device, what it lacks, which one is chosen and why, and which profile is in force.
//! With `--measure` a device is measured, and its profile is kept.

use std::io::IsTerminal;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use caustica_renderer::gpu::{
    Candidate, DeviceKind, Frames, GpuError, Instance, InstanceOptions, list_devices,
};
use caustica_renderer::{DeviceProfile, ProfileInForce};
use clap::Args;
use indicatif::ProgressBar;
use serde_json::json;

use super::render::report_validation;
use super::{DeviceArgs, EXIT_DEVICE};

/// Arguments of `caustica devices`.
#[derive(Args, Debug)]
pub(super) struct DevicesArgs {
    /// Measure the device that is chosen, or the one of `--device`, and keep the figures: from them follows what is
    /// refitted, compacted and built at once, and how the first surfaces are found
    #[arg(long)]
    measure: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Lists the devices, or measures one; exit code 3 when none is suitable.
pub(super) fn run(args: &DevicesArgs, device: &DeviceArgs) -> anyhow::Result<ExitCode> {
    if args.measure { measure(args, device) } else { list(args) }
}

fn list(args: &DevicesArgs) -> anyhow::Result<ExitCode> {
    let (candidates, problem) = match Instance::new(InstanceOptions::default()) {
        Ok(instance) => (list_devices(&instance, false)?, None),
        Err(error @ GpuError::NoLoader { .. }) => (Vec::new(), Some(error.to_string())),
        Err(error) => return Err(error.into()),
    };
    let chosen = candidates.iter().filter(|c| c.is_suitable()).min_by_key(|c| c.rank()).map(|c| c.index);
    if args.json {
        say!("{}", to_json(&candidates, chosen, problem.as_deref()));
    } else {
        print_table(&candidates, chosen, problem.as_deref());
    }
    Ok(if chosen.is_some() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_DEVICE) })
}

fn measure(args: &DevicesArgs, device: &DeviceArgs) -> anyhow::Result<ExitCode> {
    let device = device.open()?;
    let _watch = DeviceArgs::watch(&device);
    let progress = if args.json || !std::io::stderr().is_terminal() {
        ProgressBar::hidden()
    } else {
        ProgressBar::new_spinner()
    };
    progress.enable_steady_tick(Duration::from_millis(100));
    let mut frames = Frames::new(&device)?;
    let profile = DeviceProfile::measure(&device, &mut frames, &mut |what| {
        progress.set_message(format!("measuring {what}"));
    })?;
    progress.finish_and_clear();
    report_validation(&device)?;
    let file = profile.store()?;
    if args.json {
        say!("{}", profile_to_json(&profile, Some(&file)));
    } else {
        say!("{} ({})", profile.device, profile.driver);
        print_profile(&profile);
        say!("   stored: {}", file.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// The profile in force for a device that is not open.
fn profile_of(candidate: &Candidate) -> ProfileInForce {
    DeviceProfile::in_force(&candidate.name, &candidate.driver, candidate.kind)
}

fn profile_to_json(profile: &DeviceProfile, file: Option<&Path>) -> serde_json::Value {
    json!({
        "file": file,
        "figures": profile,
        "refit_pays": profile.refit_pays(),
        "refits_tlas": profile.refits_tlas(),
        "compaction_pays": profile.compaction_pays(),
        "primary_rays_pay": profile.primary_rays_pay(),
        "triangles_built_in_1_ms": profile.triangles_in(1.0),
    })
}

/// The figures, and what follows from them.
fn print_profile(profile: &DeviceProfile) {
    let answer = |pays: bool| if pays { "yes" } else { "no" };
    say!(
        "   BLAS of 100,000 triangles: built in {:.2} ms, {} triangles in 1 ms",
        profile.blas_build_ms,
        profile.triangles_in(1.0)
    );
    say!(
        "   refit of a BLAS pays: {} ({:.2} ms against {:.2})",
        answer(profile.refit_pays()),
        profile.blas_refit_ms,
        profile.blas_fast_build_ms
    );
    say!(
        "   a TLAS of 100,000 instances is refitted: {} ({:.2} ms against {:.2})",
        answer(profile.refits_tlas()),
        profile.tlas_refit_ms,
        profile.tlas_build_ms
    );
    say!(
        "   compaction pays: {} ({:.0} % of the bytes are left)",
        answer(profile.compaction_pays()),
        profile.compacted_share * 100.0
    );
    if let Some(primary) = profile.primary {
        say!(
            "   rays find the first surfaces faster: {} ({:.2} ms against {:.2})",
            answer(profile.primary_rays_pay()),
            primary.rays_ms,
            primary.raster_ms
        );
    }
}

fn kind_name(kind: DeviceKind) -> &'static str {
    match kind {
        DeviceKind::Discrete => "discrete GPU",
        DeviceKind::Integrated => "integrated GPU",
        DeviceKind::Virtual => "virtual GPU",
        DeviceKind::Cpu => "processor",
        DeviceKind::Other => "other",
    }
}

fn to_json(candidates: &[Candidate], chosen: Option<usize>, problem: Option<&str>) -> serde_json::Value {
    let devices: Vec<_> = candidates
        .iter()
        .map(|c| {
            json!({
                "index": c.index,
                "name": c.name,
                "kind": kind_name(c.kind),
                "driver": c.driver,
                "vulkan": c.api_version,
                "device_local_mib": c.device_local_bytes >> 20,
                "suitable": c.is_suitable(),
                "lacks": c.lacks,
                "profile": c.is_suitable().then(|| {
                    let ProfileInForce { profile, file } = profile_of(c);
                    profile_to_json(&profile, file.as_deref())
                }),
            })
        })
        .collect();
    json!({ "devices": devices, "chosen": chosen, "problem": problem })
}

fn print_table(candidates: &[Candidate], chosen: Option<usize>, problem: Option<&str>) {
    if let Some(problem) = problem {
        say!("{problem}");
    } else if candidates.is_empty() {
        say!("no Vulkan driver is installed (mesa-vulkan-drivers brings one that needs no GPU)");
    }
    for c in candidates {
        say!("{}: {} ({}, {}, Vulkan {})", c.index, c.name, kind_name(c.kind), c.driver, c.api_version);
        say!("   {} MiB on the device", c.device_local_bytes >> 20);
        if !c.is_suitable() {
            say!("   cannot be used: it lacks {}", c.lacks.join(", "));
        } else if chosen == Some(c.index) {
            say!(
                "   chosen: the first suitable one of the best kind (discrete, integrated, virtual, processor)"
            );
        } else {
            say!("   suitable");
        }
        if c.is_suitable() {
            let ProfileInForce { profile, file } = profile_of(c);
            match &file {
                Some(file) => say!("   profile: measured, {}", file.display()),
                None => say!(
                    "   profile: not measured, the usual one of its kind (`caustica devices --measure --device {}`)",
                    c.index
                ),
            }
            print_profile(&profile);
        }
    }
}
