//! Errors measured on the device against those of the host, while a picture is rendered; and what `caustica report` writes.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica::session::{Session, SessionOptions, ViewCamera, load};
use caustica_renderer::{
    Accumulated, ErrorMetrics, Halves, LiveError, Noise, Pipeline, Radiance, Show, Split, ViewSettings,
};
use caustica_tests::program::caustica;
use caustica_tests::{gpu, repository, shaders_under_test};

/// Blocks of 8 x 8 are cut at the right and below.
const EXTENT: [u32; 2] = [44, 37];

fn scene() -> PathBuf {
    repository().join("tests/references/cornell-diffuse-f0.gltf")
}

fn open(session: &mut Session, path: &Path) {
    let loaded = load(path, true, &|_, _| ()).expect("the scene loads");
    session.open(path, loaded).expect("the scene opens");
    session.set_camera(ViewCamera::of_document(session.document(), 1.0));
}

fn frame(session: &mut Session) {
    session.render_frame(EXTENT).expect("a frame");
}

/// Renders so many samples; the error is measured with the last one.
fn render(session: &mut Session, pipeline: Pipeline, seed: u32, samples: u64) -> (Accumulated, LiveError) {
    session.set_settings(ViewSettings { pipeline, seed, ..ViewSettings::default() });
    session.set_sample_offset(0).expect("a view");
    for number in 1..=samples {
        if number == samples {
            session.measure();
        }
        frame(session);
    }
    let picture = session.read_back().expect("a read-back");
    assert_eq!(picture.samples, samples);
    // What was measured is known when the slot of that frame comes round.
    for _ in 0..2 {
        let recorder = session.begin_ui_frame().expect("a frame");
        session.submit(recorder, None).expect("a submission");
    }
    (picture, *session.live_error().expect("it was measured"))
}

fn near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 2e-3 * expected.abs() + 1e-6, "{what}: {found}, expected {expected}");
}

#[test]
fn the_device_measures_what_the_host_does() {
    let gpu = gpu::session();
    let options =
        SessionOptions { shaders: shaders_under_test(), extent: EXTENT, ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    open(&mut session, &scene());
    let (reference, alone) = render(&mut session, Pipeline::Path, 99, 64);
    assert_eq!(alone.against, None);
    let reference = Arc::new(reference);
    session.set_reference(Some(Arc::clone(&reference)));
    for pipeline in [Pipeline::Path, Pipeline::Hybrid] {
        let (picture, found) = render(&mut session, pipeline, 1, 16);
        assert_eq!(found.samples, 16);
        let noise = Noise::of(&picture).expect("noise").error();
        let told = found.noise.expect("noise").error();
        for (found, expected) in [(told.value, noise.value), (told.low, noise.low), (told.high, noise.high)] {
            near(found, expected, "noise");
        }
        let split = Split::of(&reference, &picture, Halves::Streams).expect("a split");
        let [truth, seen] =
            [&*reference, &picture].map(|p| Radiance::new(p.extent, &p.mean).expect("a picture"));
        let metrics = ErrorMetrics::of(&truth, &seen).expect("metrics");
        let against = found.against.expect("a reference");
        near(against.split.total, split.total, "total");
        near(against.split.noise, split.noise, "noise of the split");
        near(against.split.bias.value, split.bias.value, "bias");
        near(against.split.bias.high, split.bias.high, "upper end of the bias");
        near(against.rmse, metrics.rmse, "RMSE");
        near(against.rel_mse, metrics.rel_mse, "relMSE");
        for (found, trimmed, whole) in [
            (against.rmse_trimmed, metrics.rmse_trimmed, metrics.rmse),
            (against.rel_mse_trimmed, metrics.rel_mse_trimmed, metrics.rel_mse),
        ] {
            assert!(trimmed * 0.998 <= found && found < whole, "trimmed: {found}, {trimmed} to {whole}");
        }
        near(against.block_rel_mse, metrics.block_rel_mse, "relMSE of blocks");
        near(against.luminance_ratio, metrics.luminance_ratio, "luminance");
        // Hybrid has no light that surfaces send on to each other.
        assert_eq!(pipeline == Pipeline::Hybrid, against.split.bias.low > 0.1, "{against:?}");
    }
}

#[test]
fn maps_show_where_the_error_is() {
    let gpu = gpu::session();
    let options =
        SessionOptions { shaders: shaders_under_test(), extent: EXTENT, ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    open(&mut session, &scene());
    let shown = |session: &mut Session, show| {
        session.set_settings(ViewSettings { show, ..session.settings().clone() });
        frame(session);
        session.read_display().expect("a display")
    };
    let (picture, _) = render(&mut session, Pipeline::Path, 1, 8);
    assert!(shown(&mut session, Show::Error).iter().all(|pixel| pixel[..3] == [0.0; 3]), "no reference");
    // A reference from which the left half differs by more than 80 %, and the right half not at all.
    let left = |at: usize| at % (EXTENT[0] as usize) < EXTENT[0] as usize / 2;
    let of = |(at, pixel): (usize, &[f32; 3])| pixel.map(|c| if left(at) { (c + 1.0) * 8.0 } else { c });
    let other = Accumulated { mean: picture.mean.iter().enumerate().map(of).collect(), ..picture };
    session.set_reference(Some(Arc::new(other)));
    let map = shown(&mut session, Show::Error);
    let red = |pixel: &[f32; 4]| pixel[0] > 0.7 && pixel[1] < 0.3 && pixel[2] < 0.1;
    let (wrong, right): (Vec<_>, Vec<_>) = map.iter().enumerate().partition(|(at, _)| left(*at));
    assert!(wrong.iter().filter(|(_, pixel)| red(pixel)).count() * 10 > wrong.len() * 9, "{:?}", wrong[0]);
    assert!(right.iter().filter(|(_, pixel)| red(pixel)).count() * 10 < right.len(), "{:?}", right[0]);
    let noise = shown(&mut session, Show::Noise);
    assert!(noise.iter().any(|pixel| pixel != &noise[0]), "every pixel is as noisy as the first");
}

#[test]
fn a_report_has_figures_a_page_and_images() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["cornell-diffuse-f0.gltf", "cornell-diffuse.bin"] {
        std::fs::copy(scene().with_file_name(name), folder.path().join(name)).expect("a copy");
    }
    let report = |pipelines: &str| {
        let fixed = ["report", "cornell-diffuse-f0.gltf", "-o", "out", "--size", "32x32", "--samples", "8"];
        let more = ["--reference", "path:16", "--seconds", "100", "--json", "--pipelines", pipelines];
        caustica(folder.path(), &[&fixed[..], &more].concat())
    };
    let first = report("hybrid+denoise,path");
    assert_eq!(first.code, Some(0), "{}", first.stderr);
    let told: serde_json::Value = serde_json::from_str(&first.stdout).expect("JSON");
    let pipelines = told["pipelines"].as_array().expect("a list");
    assert_eq!(pipelines.len(), 2);
    let path = pipelines[1]["curve"].as_array().expect("a curve");
    let samples: Vec<u64> = path.iter().filter_map(|point| point["samples"].as_u64()).collect();
    assert_eq!(samples, [2, 4, 8]);
    let last = &path[2];
    assert!(
        last["split"]["noise"].as_f64() > Some(0.0) && last["gpu_ms"].as_f64() > path[0]["gpu_ms"].as_f64()
    );
    let csv = std::fs::read_to_string(folder.path().join("out/curves.csv")).expect("curves.csv");
    assert_eq!(csv.lines().count(), 1 + 4 + 3, "{csv}");
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).expect("report.html");
    assert_eq!(page.matches("<img ").count(), 7);
    assert!(!page.contains("NaN") && !page.contains("http"), "what is not finite, or lies elsewhere");
    // The reference is kept, and taken again.
    let kept = |answer: &serde_json::Value| {
        answer["reference"]["source"].as_str().map(|text| text.contains(", from "))
    };
    assert_eq!(kept(&told), Some(false));
    let again = report("path");
    let told: serde_json::Value = serde_json::from_str(&again.stdout).expect("JSON");
    assert_eq!(kept(&told), Some(true));
    let wrong = report("hybrid+blurry");
    assert_eq!(wrong.code, Some(2));
    assert!(wrong.stderr.contains("no setting 'blurry'"), "{}", wrong.stderr);
}
