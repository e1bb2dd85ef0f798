//! `caustica bench` in its small sizes: what it writes, what it refuses, and what must hold whatever the machine's speed. No
//! time is judged here.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::Path;

use caustica_renderer::gpu_types::Instance;
use caustica_tests::program::{Run, caustica};
use serde_json::{Value, json};

/// A quick run with validation on; the layer must be silent. Gives what the file holds.
fn bench(folder: &Path, more: &[&str]) -> (Run, Value) {
    let mut arguments = vec!["bench", "--quick", "--validation", "-o", "out/figures.json"];
    arguments.extend(more);
    let run = caustica(folder, &arguments);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(!run.stderr.contains("validation"), "{}", run.stderr);
    let text = std::fs::read_to_string(folder.join("out/figures.json")).expect("a file of figures");
    (run, serde_json::from_str(&text).expect("JSON in the file"))
}

fn rows<'a>(part: &'a Value, name: &str) -> &'a [Value] {
    part[name].as_array().expect("rows")
}

fn number(row: &Value, name: &str) -> u64 {
    row[name].as_u64().expect("a whole number")
}

fn median(row: &Value, name: &str) -> f64 {
    row[name]["median"].as_f64().expect("a median")
}

#[test]
fn a_move_costs_the_same_bytes_in_any_document_and_is_seen_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let (run, figures) = bench(folder.path(), &["--only", "moves", "--commit", "abc123"]);
    assert_eq!((&figures["commit"], &figures["quick"]), (&json!("abc123"), &json!(true)));
    assert!(figures["date"].as_str().is_some_and(|date| date.len() == 10), "{figures}");
    let moves = &figures["accel"]["moves"];
    let record = size_of::<Instance>() as u64;
    for pipeline in ["raytraced", "hybrid"] {
        let of_pipeline: Vec<&Value> =
            rows(moves, "rows").iter().filter(|row| row["pipeline"] == pipeline).collect();
        let nodes: Vec<u64> = of_pipeline.iter().map(|row| number(row, "nodes")).collect();
        assert_eq!(nodes, [1, 100, 1000]);
        for row in &of_pipeline {
            assert_eq!(number(row, "latency_frames"), 1, "{row}");
            assert_eq!((number(row, "blas_builds"), number(row, "tlas_builds")), (0, 0), "{row}");
            assert_eq!(number(row, "tlas_refits"), number(row, "moves"), "{row}");
            let host = rows(row, "host");
            assert!(host.len() == 3 && host.iter().all(|of| median(of, "scene_ms") > 0.0), "{row}");
            for name in ["tlas_ms", "descriptors_ms", "bare_refit_ms", "bare_refit_at_rest_ms"] {
                assert!(median(row, name) > 0.0, "{name}: {row}");
            }
            let parts_ms = median(row, "tlas_ms") + median(row, "descriptors_ms");
            assert!(median(row, "accel_ms") > 0.5 * parts_ms && row["tlas_over_bare"].as_f64() > Some(0.0));
            // The record, and what the pass that writes its descriptor is told; then the record once more.
            assert!((record + 4..=record + 64).contains(&number(row, "moved_bytes")), "{row}");
            assert_eq!(number(row, "settled_bytes"), record, "{row}");
        }
        assert_eq!(of_pipeline[1]["moved_bytes"], of_pipeline[2]["moved_bytes"]);
    }
    let edits = rows(moves, "edits");
    assert_eq!(edits.len(), 9 * 3);
    for row in edits {
        let structural = ["delete", "copy"].iter().any(|edit| row["edit"] == *edit || row["undone"] == *edit);
        // A new material has another BLAS only where opacity differs, which it does not here.
        assert_eq!(number(row, "tlas_builds"), if structural { 3 } else { 0 }, "{row}");
        assert!(!structural || (median(row, "tlas_build_ms") > 0.0 && median(row, "bare_build_ms") > 0.0));
    }
    for title in ["One node moves: the host", "One node moves: the device", "Other edits"] {
        assert!(run.stdout.contains(title), "{}", run.stdout);
    }
}

#[test]
fn structures_and_skinned_meshes_are_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let (run, figures) = bench(folder.path(), &["--only", "structures,skinned", "--json"]);
    let printed: Value = serde_json::from_str(&run.stdout).expect("one object on standard output");
    assert_eq!(printed, figures);
    assert_eq!((&figures["accel"]["moves"], &figures["accel"]["soak"]), (&Value::Null, &Value::Null));
    let structures = &figures["accel"]["structures"];
    let sizes =
        |name: &str| -> Vec<u64> { rows(structures, name).iter().map(|row| number(row, "count")).collect() };
    assert_eq!((sizes("blas"), sizes("tlas")), (vec![1000, 10_000, 2000], vec![1, 1000]));
    for row in rows(structures, "blas") {
        for figure in ["build_fast_build_ms", "compact_ms", "bytes", "compacted_bytes"] {
            assert!(row[figure].as_f64() > Some(0.0), "{figure}: {row}");
        }
        assert!(
            row["build_fast_trace"]["ms"].as_f64() > Some(0.0) && row["refit"]["ms"].as_f64() > Some(0.0)
        );
    }
    let steps: Vec<(u64, bool, bool)> = rows(structures, "in_session")
        .iter()
        .map(|row| {
            let timed = median(row, "blas_ms") > 0.0 && median(row, "bare_ms") > 0.0;
            (number(row, "builds"), number(row, "builds") + number(row, "refits") == 3, timed)
        })
        .collect();
    // Whether the last one refits is the device's choice.
    assert_eq!(steps[..2], [(3, true, true); 2], "{structures}");
    assert!(steps.len() == 3 && steps[2].1 && steps[2].2, "{structures}");
    let dances = rows(&figures["accel"]["skinned"], "rows");
    let work: Vec<(u64, u64, u64)> = dances
        .iter()
        .map(|row| (number(row, "frames"), number(row, "blas_refits"), number(row, "blas_builds")))
        .collect();
    assert_eq!(work, [(8, 80, 0), (8, 0, 80)], "ten meshes, all in every frame");
    assert!(dances.iter().all(|row| row["deform_ms"]["median"].as_f64() > Some(0.0)));
}

#[test]
fn three_hundred_edits_taken_back_leave_the_device_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, figures) = bench(folder.path(), &["--only", "soak"]);
    let soak = &figures["accel"]["soak"];
    let looks = rows(soak, "looks");
    let cycles: Vec<u64> = looks.iter().map(|look| number(look, "cycles")).collect();
    assert_eq!(cycles, [100, 150, 300]);
    assert!(
        looks.iter().all(|look| look["device_bytes"] == looks[0]["device_bytes"]),
        "bytes by kind: {looks:?}"
    );
    for kind in ["acceleration_structures", "geometry", "tables", "targets", "staging"] {
        assert!(looks[0]["device_bytes"][kind].as_u64() > Some(0), "{kind}: {looks:?}");
    }
    assert_eq!(soak["document_unchanged"], true);
    assert_eq!(soak["device"], json!({ "growth_bytes": 0, "steady": true }));
    // What the process holds is printed, not judged here: other tests share its allocator's moods.
    assert!(soak["process"]["growth_share"].is_f64() && soak["process"]["noise_share"].is_f64(), "{soak}");
}

#[test]
fn a_cloud_is_measured_whole_and_in_every_pipeline() {
    let folder = tempfile::tempdir().expect("a folder");
    let (run, figures) = bench(folder.path(), &["--suite", "shapes"]);
    assert!(figures.get("accel").is_none(), "one suite was asked for");
    let [row] = rows(&figures["shapes"]["cloud"], "rows") else { unreachable!("one size in a quick run") };
    assert_eq!(
        (number(row, "count"), number(row, "shape_bytes"), number(row, "box_bytes")),
        (2000, 56_000, 48_000)
    );
    assert!(row["build_ms"].as_f64() > Some(0.0) && row["boxes_ms"].as_f64() > Some(0.0), "{row}");
    assert!(number(row, "blas_bytes") > 48_000, "{row}");
    let pipelines: Vec<&Value> = rows(row, "frames").iter().map(|frame| &frame["pipeline"]).collect();
    assert_eq!(pipelines, ["raster", "hybrid", "raytraced", "path"]);
    assert!(
        rows(row, "frames").iter().all(|frame| frame["device_ms"]["median"].as_f64() > Some(0.0)),
        "{row}"
    );
    assert!(run.stdout.contains("each frame, device ms"), "{}", run.stdout);
}

#[test]
fn every_setting_of_hybrid_is_timed_and_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let project =
        caustica_tests::repository().join("projects/lecture-08-soft-shadows/soft-shadows.caustica.json");
    let project = project.to_str().expect("a name in Unicode");
    let more = ["--suite", "hybrid", "--project", project, "--reference-samples", "8", "--size", "48x32"];
    let (run, figures) = bench(folder.path(), &more);
    let settings = &figures["hybrid"]["settings"];
    assert_eq!((&settings["extent_px"], &settings["samples"]), (&json!([48, 32]), &json!(2)));
    assert_eq!(rows(settings, "rows").len(), 8, "{settings}");
    for row in rows(settings, "rows") {
        assert!(median(row, "frame_ms") > 0.0 && row["ratio"].as_f64() > Some(0.0), "{row}");
        let luminance = row["error"]["luminance"].as_f64().expect("a ratio");
        assert!((0.8..1.2).contains(&luminance), "{row}");
        let [all, most] =
            ["rel_mse", "rel_mse_999"].map(|name| row["error"][name].as_f64().expect("an error"));
        assert!(all >= most && most > 0.0, "{row}");
        let penumbra =
            row["settings"].as_str().is_some_and(|name| name.contains("penumbra") || name.contains("both"));
        let share = row["shadow_rays_share"].as_f64();
        assert_eq!(share.is_some(), penumbra, "{row}");
        assert!(share.is_none_or(|share| (0.1..1.0).contains(&share)), "{row}");
    }
    assert!(run.stdout.contains("Hybrid, error"), "{}", run.stdout);
}

#[test]
fn wrong_names_and_places_are_refused_before_anything_is_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = caustica(folder.path(), &["bench", "--suite", "speed", "-o", "a.json"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("speed") && run.stderr.contains("accel"), "{}", run.stderr);
    let run = caustica(folder.path(), &["bench", "--quick"]);
    assert_eq!(run.code, Some(2), "no file is named: {}", run.stderr);
    std::fs::write(folder.path().join("file"), "in the way").expect("a file");
    let run = caustica(folder.path(), &["bench", "--quick", "-o", "file/a.json"]);
    assert_eq!((run.code, run.stdout.contains("One node")), (Some(1), false), "{}", run.stderr);
    assert!(run.stderr.contains("file/a.json"), "{}", run.stderr);
    let run = caustica(folder.path(), &["bench", "--quick", "-o", "a.json", "--device", "no such card"]);
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(!folder.path().join("a.json").exists());
}
