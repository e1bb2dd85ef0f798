//! Small golden pictures of every target that can be shown, and of every pipeline, at 96 x 64 on lavapipe.
//! `CAUSTICA_BLESS=1 cargo test --release -p caustica-tests --test golden` makes them anew: look at them before
//! they are committed.

use caustica_renderer::{Pipeline, Show, ToneMap, ViewSettings};
use caustica_tests::picture::{Tolerance, assert_golden, encode};
use caustica_tests::scene::{camera_at, zoo};
use caustica_tests::studio::Studio;
use glam::Vec3;

const EXTENT: [u32; 2] = [96, 64];

/// Values that are functions of a pixel's centre alone: 2 steps for rounding in half floats and in the encoding; edges
/// may fall to the other pixel on another device, and there are about 500 edge pixels.
const EXACT: Tolerance = Tolerance { steps: 2, outliers: 0.02 };
/// Sampled light at few samples: the same random numbers meet the same surfaces, but where a comparison falls the
/// other way (a shadow ray at an edge, a choice of lobe) one sample of the pixel is another.
const SAMPLED: Tolerance = Tolerance { steps: 6, outliers: 0.04 };

fn snake(name: &str) -> String {
    name.to_lowercase().replace(' ', "_")
}

#[test]
fn every_target_looks_as_it_did() {
    let (scene, camera) = zoo();
    let still = ViewSettings { jitter: false, ..ViewSettings::default() };
    let mut studio = Studio::of(EXTENT, still, &scene.delta, camera);
    // A camera that moves: motion vectors and a history show something.
    studio.frames(1);
    let target = Vec3::new(0.1, 0.55, -0.2);
    for step in 1..=6_u8 {
        studio.view_mut().set_camera(camera_at(
            Vec3::new(0.3 + 0.15 * f32::from(step), 1.7, 4.2),
            target,
            0.75,
        ));
        let (show, name) =
            if step == 6 { (Show::History, "history_length") } else { (Show::Motion, "motion") };
        studio.set(|settings| settings.show = show);
        studio.frames(1);
        if step >= 5 {
            assert_golden(name, &encode(EXTENT, &studio.display()), if step == 5 { EXACT } else { SAMPLED });
        }
    }
    studio.view_mut().set_camera(camera);
    for (show, name) in Show::ALL {
        if matches!(show, Show::Motion | Show::History | Show::Image) {
            continue;
        }
        studio.set(|settings| settings.show = show);
        let drawn_by_chance = matches!(
            show,
            Show::DirectDiffuse | Show::DirectSpecular | Show::Shadow | Show::RayDepth | Show::NonFinite
        );
        studio.set(|settings| settings.tone_map = ToneMap::Linear);
        studio.frames(2);
        let picture = encode(EXTENT, &studio.display());
        assert_golden(&snake(name), &picture, if drawn_by_chance { SAMPLED } else { EXACT });
    }
}

#[test]
fn every_pipeline_looks_as_it_did() {
    let (scene, camera) = zoo();
    let mut studio = Studio::of(EXTENT, ViewSettings::default(), &scene.delta, camera);
    for pipeline in Pipeline::ALL {
        studio.set(|settings| settings.pipeline = pipeline);
        studio.mean(32);
        assert_golden(&format!("image_{}", pipeline.name()), &encode(EXTENT, &studio.display()), SAMPLED);
    }
}

#[test]
fn every_tone_map_looks_as_it_did() {
    let (scene, camera) = zoo();
    let mut studio = Studio::of(EXTENT, ViewSettings::default(), &scene.delta, camera);
    studio.mean(16);
    for tone_map in ToneMap::ALL {
        studio.set(|settings| settings.tone_map = tone_map);
        studio.frames(1);
        assert_golden(&format!("tone_map_{}", tone_map.name()), &encode(EXTENT, &studio.display()), SAMPLED);
    }
}
