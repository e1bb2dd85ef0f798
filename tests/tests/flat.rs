//! What its node scales to nothing in one direction is drawn as the plane that it is, in every pipeline, and nothing is said against it.
//! Lines and points are left out.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use caustica::session::{Session, SessionOptions, ViewCamera, load};
use caustica_renderer::{Pipeline, ViewSettings};
use caustica_scene::{Severity, audit};
use caustica_tests::gpu::session;
use caustica_tests::models;
use glam::DVec3;
use serde_json::{Value, json};

const EXTENT: [u32; 2] = [48, 32];
const SAMPLES: u64 = 16;

fn settings(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
}

/// Opens a cube in a node and renders it from the front.
fn picture(session: &mut Session, pipeline: Pipeline, node: &Value) -> Vec<[f32; 3]> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut file: Value = serde_json::from_str(&models::cube(false)).expect("a model");
    file["nodes"] = json!([node]);
    file["nodes"][0]["mesh"] = json!(0);
    let path = folder.path().join("cube.gltf");
    std::fs::write(&path, file.to_string()).expect("a file");
    session.open(&path, load(&path, false, &|_, _| ()).expect("a model")).expect("a scene");
    session.set_settings(settings(pipeline));
    session.set_camera(ViewCamera::looking_at(DVec3::new(0.2, 0.1, 3.0), DVec3::ZERO, 0.7, 0.01));
    let errors = audit(session.document()).iter().filter(|found| found.severity == Severity::Error).count();
    assert_eq!(errors, 0, "{node}");
    // The first frame begins the count again.
    let mut samples = 0;
    while samples < SAMPLES {
        let recorder = session.begin_frame(EXTENT).expect("a frame");
        session.submit(recorder, None).expect("a submission");
        samples = session.samples();
    }
    session.read_back().expect("a picture").mean
}

/// How many pixels are another.
fn differing(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    let is_other = |(a, b): (&[f32; 3], &[f32; 3])| {
        (0..3).any(|i| a[i].is_nan() || (a[i] - b[i]).abs() > 0.02 * b[i].abs() + 1e-3)
    };
    a.iter().zip(b).filter(|(a, b)| is_other((a, b))).count()
}

#[test]
fn a_flattened_cube_is_the_square_that_it_casts() {
    let gpu = session();
    let options =
        SessionOptions { settings: settings(Pipeline::Raster), extent: EXTENT, ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    for pipeline in Pipeline::ALL {
        // Its front is where the flattened one is, and hides the rest.
        let square = picture(&mut session, pipeline, &json!({"translation": [0.0, 0.0, -0.5]}));
        let nothing = picture(&mut session, pipeline, &json!({"scale": [1.0, 0.0, 0.0]}));
        let seen = differing(&nothing, &square);
        assert!(seen > 100, "{}: a line is left out, and {seen} pixels are of the square", pipeline.name());
        let half = 0.5_f64.sqrt();
        for flat in [
            json!({"scale": [1.0, 1.0, 0.0]}),
            json!({"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]}),
            json!({"rotation": [0.0, half, 0.0, half], "scale": [0.0, 1.0, 1.0]}),
        ] {
            let found = picture(&mut session, pipeline, &flat);
            let differing = differing(&found, &square);
            assert!(differing <= 8, "{flat}, {}: {differing} pixels are another", pipeline.name());
        }
    }
}
