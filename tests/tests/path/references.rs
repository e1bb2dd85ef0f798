//! Pictures of an independent path tracer (Mitsuba 3.9), averaged down to 64 x 64, with the variance of one sample of
//! ours beside them. Stored in `tests/references`; made by
//! `CAUSTICA_BLESS=1 cargo test --release -p caustica-tests --test path references` from the images in `../shared/refs`.

use std::path::{Path, PathBuf};

use caustica::session::{Session, SessionOptions, ViewCamera, load};
use caustica_tests::{gpu, repository, shaders_under_test};
use image::Rgb32FImage;
use serde_json::{Value, json};

use super::settings;

const EXTENT: [u32; 2] = [64, 64];
/// Samples of the test; of each of the images that the variance is made of, and their number.
const SAMPLES: u64 = 64;
const BATCH_SAMPLES: u64 = 8;
const BATCHES: u32 = 64;
/// relMSE of the image of 256 x 256 that the stored one is averaged from (`../shared/refs/README.md`).
const REFERENCE_NOISE: f64 = 5.2e-4 / 16.0;

fn folder() -> PathBuf {
    repository().join("tests/references")
}

fn open(session: &mut Session, file: &Path) {
    let loaded = load(file, false, &|_, _| ()).expect("the scene loads");
    session.open(file, loaded).expect("the scene opens");
    session.set_camera(ViewCamera::of_document(session.document(), 1.0));
}

fn new_session(gpu: &gpu::Session) -> Session {
    let options = SessionOptions {
        shaders: shaders_under_test(),
        settings: settings(),
        extent: EXTENT,
        ..SessionOptions::default()
    };
    Session::new(&gpu.device, options).expect("a session")
}

/// Mean radiance, row by row.
fn render(session: &mut Session, samples: u64, seed: u32) -> Vec<f64> {
    session.set_settings(caustica_renderer::ViewSettings { seed, ..settings() });
    loop {
        let recorder = session.begin_frame(EXTENT).expect("a frame");
        session.submit(recorder, None).expect("a submission");
        if session.samples() >= samples {
            break;
        }
    }
    let image = session.read_back().expect("a read-back");
    image.mean.iter().flatten().map(|value| f64::from(*value)).collect()
}

fn stored(name: &str) -> Vec<f64> {
    let image = image::open(folder().join(name)).expect("a stored reference").to_rgb32f();
    assert_eq!([image.width(), image.height()], EXTENT);
    image.as_raw().iter().map(|value| f64::from(*value)).collect()
}

fn store(name: &str, values: &[f64]) {
    let values = values.iter().map(|value| *value as f32).collect();
    let image = Rgb32FImage::from_raw(EXTENT[0], EXTENT[1], values).expect("as many values as pixels");
    image.save(folder().join(name)).expect("the reference is written");
}

/// Averages squares of pixels.
fn averaged(image: &Rgb32FImage) -> Vec<f64> {
    let side = image.width() / EXTENT[0];
    let mut values = vec![0.0; (EXTENT[0] * EXTENT[1] * 3) as usize];
    for (x, y, pixel) in image.enumerate_pixels() {
        let at = (y / side * EXTENT[0] + x / side) as usize;
        for (channel, value) in pixel.0.iter().enumerate() {
            values[at * 3 + channel] += f64::from(*value) / f64::from(side * side);
        }
    }
    values
}

/// Variance of one sample, by value, from many images.
fn variance(session: &mut Session) -> Vec<f64> {
    let images: Vec<_> = (0..BATCHES).map(|seed| render(session, BATCH_SAMPLES, 1000 + seed)).collect();
    (0..images[0].len())
        .map(|i| {
            let mean = images.iter().map(|image| image[i]).sum::<f64>() / f64::from(BATCHES);
            let squares: f64 = images.iter().map(|image| (image[i] - mean).powi(2)).sum();
            squares / f64::from(BATCHES - 1) * BATCH_SAMPLES as f64
        })
        .collect()
}

/// How far an image is from the stored one, in units of what noise explains: mean of z squared over all values, and the
/// largest z of the means of 8 x 8 pixels, and z of the mean of all.
fn deviation(image: &[f64], mean: &[f64], variance: &[f64], samples: u64) -> (f64, f64, f64) {
    let spread = |i: usize| variance[i] / samples as f64 + REFERENCE_NOISE * (mean[i].powi(2) + 0.01);
    let squares: f64 = (0..image.len()).map(|i| (image[i] - mean[i]).powi(2) / spread(i)).sum();
    let mut blocks = vec![(0.0, 0.0); 64 * 3];
    for i in 0..image.len() {
        let (pixel, channel) = (i / 3, i % 3);
        let (x, y) = (pixel % 64, pixel / 64);
        let block = &mut blocks[(y / 8 * 8 + x / 8) * 3 + channel];
        block.0 += image[i] - mean[i];
        block.1 += spread(i);
    }
    let worst =
        blocks.iter().map(|(sum, spread): &(f64, f64)| (sum / spread.sqrt()).abs()).fold(0.0, f64::max);
    let (sum, spread) = blocks.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (squares / image.len() as f64, worst, (sum / f64::sqrt(spread)).abs())
}

/// Asserts that an image differs from the stored reference by noise alone.
fn assert_like_reference(label: &str, image: &[f64], samples: u64) {
    let (mean, variance) = (stored("cornell-diffuse-f0.exr"), stored("cornell-diffuse-f0.variance.exr"));
    let (squares, worst, whole) = deviation(image, &mean, &variance, samples);
    // Low-discrepancy samples err less than independent ones of the same variance, never more.
    assert!((0.5..1.1).contains(&squares), "{label}: mean z^2 {squares}");
    assert!(worst < 5.0, "{label}: a block is {worst} standard deviations off");
    assert!(whole < 4.0, "{label}: the whole image is {whole} standard deviations off");
}

#[test]
fn a_box_with_walls_looks_as_another_path_tracer_shows_it() {
    let gpu = gpu::session();
    let mut session = new_session(&gpu);
    open(&mut session, &folder().join("cornell-diffuse-f0.gltf"));
    if std::env::var_os("CAUSTICA_BLESS").is_some() {
        let source = repository().join("../shared/refs/cornell-diffuse-f0.exr");
        store("cornell-diffuse-f0.exr", &averaged(&image::open(source).expect("the reference").to_rgb32f()));
        let variance = variance(&mut session);
        store("cornell-diffuse-f0.variance.exr", &variance);
    }
    let image = render(&mut session, SAMPLES, 0);
    assert_like_reference("as it is", &image, SAMPLES);
    // The test can fail: three per cent more light is seen.
    let mean = stored("cornell-diffuse-f0.exr");
    let brighter: Vec<f64> = image.iter().map(|value| value * 1.03).collect();
    let (_, _, whole) = deviation(&brighter, &mean, &stored("cornell-diffuse-f0.variance.exr"), SAMPLES);
    assert!(whole > 4.0, "three per cent more light: {whole}");
}

/// The box with everything scaled and moved, in a folder of its own.
fn write_moved(folder: &Path, scale: f64, shift_m: f64) -> PathBuf {
    let text = std::fs::read_to_string(super::references::folder().join("cornell-diffuse-f0.gltf"));
    let mut scene: Value = serde_json::from_str(&text.expect("the scene")).expect("JSON");
    let roots = scene["scenes"][0]["nodes"].clone();
    let nodes = scene["nodes"].as_array_mut().expect("nodes");
    let whole = nodes.len();
    nodes.push(json!({
        "children": roots, "scale": [scale, scale, scale], "translation": [shift_m, -shift_m, shift_m]
    }));
    scene["scenes"][0]["nodes"] = json!([whole]);
    for camera in scene["cameras"].as_array_mut().expect("cameras") {
        let near = camera["perspective"]["znear"].as_f64().unwrap_or(0.01);
        camera["perspective"]["znear"] = json!(near * scale);
        if let Some(lens) = camera["perspective"].as_object_mut() {
            lens.remove("zfar");
        }
    }
    let bin = super::references::folder().join("cornell-diffuse.bin");
    std::fs::copy(bin, folder.join("cornell-diffuse.bin")).expect("the vertices");
    let path = folder.join(format!("box-{scale}-{shift_m}.gltf"));
    std::fs::write(&path, scene.to_string()).expect("the scene is written");
    path
}

#[test]
fn the_size_and_place_of_the_box_do_not_matter() {
    let gpu = gpu::session();
    let folder = tempfile::tempdir().expect("a folder");
    let mut session = new_session(&gpu);
    for (scale, shift_m) in [(1e-4, 0.0), (1e4, 0.0), (1.0, 1e3), (1.0, 1e5)] {
        open(&mut session, &write_moved(folder.path(), scale, shift_m));
        let image = render(&mut session, 16, 3);
        assert_like_reference(&format!("scaled by {scale}, moved by {shift_m} m"), &image, 16);
    }
}
