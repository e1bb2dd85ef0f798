//! The device profile from measuring to its use: what is stored, found again, refused; and the microbenchmarks below.
#![expect(clippy::expect_used, clippy::panic, reason = "a test says what is wrong by panicking")]

use std::path::{Path, PathBuf};

use caustica_renderer::{AccelBench, BlasTimes, RendererError};
use caustica_tests::gpu::session;
use caustica_tests::program::{Run, caustica};
use serde_json::Value;

const FIGURES: [&str; 6] = [
    "blas_build_ms",
    "blas_fast_build_ms",
    "blas_refit_ms",
    "tlas_build_ms",
    "tlas_refit_ms",
    "compacted_share",
];

fn json_of(run: &Run) -> Value {
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(run.stdout.trim().lines().count(), 1, "one object and nothing else: {}", run.stdout);
    serde_json::from_str(&run.stdout).expect("JSON on standard output")
}

/// What `caustica devices` says of the device that it chooses.
fn chosen(run: &Run) -> Value {
    let list = json_of(run);
    let index = list["chosen"].as_u64().expect("a chosen device") as usize;
    list["devices"][index].clone()
}

/// The stored profiles.
fn stored(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join("config/caustica/devices")) else { return Vec::new() };
    entries.map(|entry| entry.expect("an entry").path()).collect()
}

/// Every decision follows from the figures beside it.
fn assert_decisions(profile: &Value) {
    let figure = |name: &str| profile["figures"][name].as_f64().expect("a figure");
    for name in FIGURES {
        assert!(figure(name) > 0.0 && figure(name) < 1e5, "{name}: {}", figure(name));
    }
    let expected = [
        ("refit_pays", figure("blas_refit_ms") < 0.7 * figure("blas_fast_build_ms")),
        ("refits_tlas", figure("tlas_refit_ms") <= 1.2 * figure("tlas_build_ms")),
        ("compaction_pays", figure("compacted_share") < 0.95),
    ];
    for (decision, pays) in expected {
        assert_eq!(profile[decision], pays, "{decision} in {profile}");
    }
    let triangles = profile["triangles_built_in_1_ms"].as_f64().expect("a number");
    assert!((triangles - 1e5 / figure("blas_build_ms")).abs() <= 1.0, "{profile}");
}

#[test]
fn what_is_measured_is_kept_and_then_in_force() {
    let folder = tempfile::tempdir().expect("a folder");
    let before = chosen(&caustica(folder.path(), &["devices", "--json"]));
    assert_eq!(before["profile"]["file"], Value::Null, "nothing was measured yet");
    assert_decisions(&before["profile"]);
    assert_eq!(stored(folder.path()), Vec::<PathBuf>::new(), "listing measures and stores nothing");

    let run = caustica(folder.path(), &["devices", "--measure", "--json", "--validation"]);
    let measured = json_of(&run);
    assert!(!run.stderr.contains("validation"), "{}", run.stderr);
    assert_decisions(&measured);
    let files = stored(folder.path());
    assert_eq!(files.len(), 1, "one file and nothing temporary: {files:?}");
    assert_eq!(measured["file"].as_str().map(PathBuf::from), files.first().cloned());
    assert_eq!(measured["figures"]["device"], before["name"]);

    let after = chosen(&caustica(folder.path(), &["devices", "--json"]));
    assert_eq!(after["profile"], measured, "found again, to the last bit");
    let text = caustica(folder.path(), &["devices"]);
    assert!(text.stdout.contains("profile: measured"), "{}", text.stdout);
    assert!(text.stdout.contains("refit of a BLAS pays: "), "{}", text.stdout);
}

#[test]
fn a_damaged_profile_is_a_warning_and_the_default_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let default = chosen(&caustica(folder.path(), &["devices", "--json"]))["profile"].clone();
    json_of(&caustica(folder.path(), &["devices", "--measure", "--json"]));
    let file = stored(folder.path()).pop().expect("a file");
    let text = std::fs::read_to_string(&file).expect("the file");
    std::fs::write(&file, &text[..text.len() / 3]).expect("the file can be written");

    let run = caustica(folder.path(), &["devices", "--json"]);
    assert_eq!(chosen(&run)["profile"], default);
    let name = file.file_name().and_then(|name| name.to_str()).expect("a name");
    assert!(run.stderr.contains("WARN") && run.stderr.contains(name), "{}", run.stderr);
    let again = json_of(&caustica(folder.path(), &["devices", "--measure", "--json"]));
    assert_eq!(chosen(&caustica(folder.path(), &["devices", "--json"]))["profile"], again);
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("config"), "in the way").expect("a file");
    let run = caustica(folder.path(), &["devices", "--measure"]);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stderr.contains("config/caustica/devices/"), "{}", run.stderr);
    let run = caustica(folder.path(), &["devices", "--measure", "--device", "no such card"]);
    assert_eq!(run.code, Some(3), "{}", run.stderr);
}

fn assert_blas(times: &BlasTimes, primitives: u32) {
    assert_eq!(times.primitives, primitives);
    let ms = [times.build_fast_trace_ms, times.build_fast_build_ms, times.refit_ms, times.compact_ms];
    assert!(ms.iter().all(|ms| *ms > 0.0 && *ms < 1e4), "{times:?}");
    assert!((1..=times.bytes).contains(&times.compacted_bytes), "{times:?}");
    // A box or triangle takes some bytes at the least, and not thousands.
    let each = times.bytes / u64::from(primitives);
    assert!((16..2000).contains(&each), "{times:?}");
}

#[test]
fn structures_of_every_kind_are_measured() {
    let mut session = session();
    let device = session.device.clone();
    let mut bench = AccelBench::new(&device, &mut session.frames).expect("a bench");
    assert_blas(&bench.triangles(3001).expect("times"), 3001);
    assert_blas(&bench.boxes(2000).expect("times"), 2000);
    let few = bench.instances(50).expect("times");
    let many = bench.instances(5000).expect("times");
    assert!(few.build_ms > 0.0 && few.refit_ms > 0.0 && many.build_ms > 0.0 && many.refit_ms > 0.0);
    assert!(many.bytes > 20 * few.bytes, "{few:?} {many:?}");
    let most = device.limits().max_instances;
    let Ok(too_many) = u32::try_from(most + 1) else { panic!("{most} instances fit a count of 24 bits") };
    let refused = bench.instances(too_many);
    assert!(matches!(refused, Err(RendererError::Limit { limit, .. }) if limit == most), "{refused:?}");
}
