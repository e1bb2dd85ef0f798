//! Tone maps rise and stay within 0..1; colours survive the way to the window.

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;
use caustica_tests::picture::srgb_byte;

#[test]
fn tone_maps_rise_and_stay_in_range() {
    const STEPS: usize = 4096;
    let mut session = session();
    // Grey from 1e-6 to 1e6, and the same for a warm colour; then values no display has.
    let body = "
        float x = pow(10.0, -6.0 + 12.0 * float(index) / 4095.0);
        for (uint kind = 0u; kind < 4u; ++kind) {
            write(4u * kind, tone_map(vec3(x), kind).g);
            write(4u * kind + 1u, tone_map(x * vec3(1.0, 0.6, 0.2), kind));
        }
        float extreme = index % 2u == 0u ? FLOAT_MAX : 1e-45;
        float worst = 0.0;
        for (uint kind = 0u; kind < 4u; ++kind) {
            vec3 a = tone_map(vec3(extreme, 0.0, 1.0), kind);
            bool good = is_finite(a) && all(greaterThanEqual(a, vec3(0.0))) && all(lessThanEqual(a, vec3(1.0)));
            worst += good ? 0.0 : 1.0;
        }
        write(16u, worst);";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/tone_map.glsl", "lib/vector.glsl"],
            body,
            values: 17,
            count: STEPS,
            ..Snippet::default()
        },
    );
    for kind in 0..4 {
        let grey: Vec<f32> = values.chunks_exact(17).map(|row| row[4 * kind]).collect();
        assert!(grey.iter().all(|x| (0.0..=1.0).contains(x)), "tone map {kind}");
        // A rounding step down of the half-float target is invisible.
        let fall = grey.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f32::max);
        assert!(fall < 2e-6, "tone map {kind} falls by {fall}");
        assert!(grey[0] < 1e-3, "tone map {kind}: black is {}", grey[0]);
        assert!(grey[STEPS - 1] > 0.95, "tone map {kind}: white is {}", grey[STEPS - 1]);
        let luminance = |row: &[f32]| 0.2126 * row[0] + 0.7152 * row[1] + 0.0722 * row[2];
        let warm: Vec<f32> = values.chunks_exact(17).map(|row| luminance(&row[4 * kind + 1..])).collect();
        let fall = warm.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f32::max);
        assert!(fall < 1e-4, "tone map {kind}: a warm colour darkens by {fall}");
    }
    assert!(values.chunks_exact(17).all(|row| row[16] == 0.0), "extreme radiance leaves 0..1");
}

#[test]
fn the_linear_tone_map_changes_nothing_below_one() {
    let mut session = session();
    let body = "
        float x = float(index) / 255.0;
        write(0u, tone_map(vec3(x), TONE_MAP_LINEAR).r - x);";
    let values = run(
        &mut session,
        &Snippet { includes: &["lib/tone_map.glsl"], body, values: 1, count: 256, ..Snippet::default() },
    );
    assert!(values.iter().all(|difference| *difference == 0.0));
}

#[test]
fn the_window_shows_the_byte_of_the_png() {
    let mut session = session();
    let body = "
        float linear = index == 256u ? 0.5 : srgb_decode(vec3(float(index) / 255.0)).r;
        write(0u, window_encode(vec3(linear)).r);
        write(1u, linear);
        write(2u, srgb_encode(vec3(linear)).r);";
    let values = run(
        &mut session,
        &Snippet { includes: &["lib/color.glsl"], body, values: 3, count: 257, ..Snippet::default() },
    );
    // The user-interface renderer encodes what it is given with pow 1/2.2.
    let shown = |x: f32| (f64::from(x).powf(1.0 / 2.2) * 255.0 + 0.5) as u8;
    for (i, row) in values.chunks_exact(3).enumerate() {
        let expected = if i == 256 { 188 } else { i as u8 };
        assert_eq!(shown(row[0]), expected, "window, value {i}");
        assert_eq!(srgb_byte(row[1]), expected, "PNG, value {i}");
        assert_eq!((row[2] * 255.0 + 0.5) as u8, expected, "srgb_encode, value {i}");
    }
    // Naive: the linear value handed to the window as it is.
    assert_eq!(shown(0.5), 186);
}
