//! `caustica devices`: every Vulkan device, what it lacks, and which one is chosen and why.

use std::process::ExitCode;

use caustica_renderer::gpu::{Candidate, DeviceKind, GpuError, Instance, InstanceOptions, list_devices};
use clap::Args;
use serde_json::json;

use super::EXIT_DEVICE;

/// Arguments of `caustica devices`.
#[derive(Args, Debug)]
pub(super) struct DevicesArgs {
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Lists the devices; exit code 3 when none is suitable.
pub(super) fn run(args: &DevicesArgs) -> anyhow::Result<ExitCode> {
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
    }
}
