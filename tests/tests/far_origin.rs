//! Robustness, row 2: a scene far from the origin of the world looks as it does at the origin. World positions are
//! doubles from the file to the render origin, which is taken off before they become single.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use caustica_tests::program::caustica;
use caustica_tests::repository;
use serde_json::{Value, json};

/// The plinth of the demo project under a soft lamp, everything moved by `shift` along x and z.
fn write_scene(folder: &Path, shift: f64) -> String {
    let assets = repository().join("projects/gallery/assets");
    std::fs::copy(assets.join("plinth.bin"), folder.join("plinth.bin")).unwrap();
    let text = std::fs::read_to_string(assets.join("plinth.gltf")).unwrap();
    let mut scene: Value = serde_json::from_str(&text).unwrap();
    let at = |x: f64, y: f64, z: f64| json!([x + shift, y, z - shift]);
    scene["nodes"][0]["translation"] = at(0.0, 0.0, 0.0);
    let nodes = scene["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "camera": 0, "translation": at(0.1, 0.7, 3.0) }));
    nodes.push(
        json!({ "translation": at(1.0, 2.0, 1.5), "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
    );
    let last = nodes.len();
    scene["scenes"][0]["nodes"] = json!([0, last - 2, last - 1]);
    scene["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.6, "znear": 0.01 } }]);
    scene["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    let lamp = json!({ "type": "point", "intensity": 20.0, "extras": { "radius": 0.1 } });
    scene["extensions"] = json!({ "KHR_lights_punctual": { "lights": [lamp] } });
    let name = format!("at-{shift}.gltf");
    std::fs::write(folder.join(&name), scene.to_string()).unwrap();
    name
}

fn render(folder: &Path, shift: f64) -> Vec<f64> {
    let file = write_scene(folder, shift);
    let output = format!("{file}.png");
    let run = caustica(folder, &["render", &file, "-o", &output, "--size", "80x80", "--samples", "8"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let image = image::open(folder.join(output)).unwrap().to_rgb8();
    image.as_raw().iter().map(|byte| f64::from(*byte)).collect()
}

#[test]
fn a_scene_looks_the_same_far_from_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let here = render(folder.path(), 0.0);
    assert!(here.iter().sum::<f64>() / here.len() as f64 > 5.0, "there is something to see");
    for shift in [1e3, 1e5, 1e6, 1e9] {
        let there = render(folder.path(), shift);
        let differing = here.iter().zip(&there).filter(|(a, b)| (*a - *b).abs() > 3.0).count();
        // Doubles at 1e9 m are 1e-7 m apart: a few samples at edges and in the penumbra fall on the other side.
        assert!(differing * 200 <= here.len(), "{shift} m: {differing} of {} values differ", here.len());
    }
    // The naive form, world positions in single precision, loses centimetres at 1e6 m and everything at 1e9 m.
    let naive_error = |shift: f64| (f64::from((shift + 0.1) as f32) - shift - 0.1).abs();
    assert!(naive_error(1e6) > 0.01 && naive_error(1e9) > 0.09);
}
