//! White surfaces in white surroundings: no light is lost and none is made, whatever the shape or the lobe.

use caustica_renderer::delta::{Material, ShadingMode};
use caustica_tests::scene::{Scene, camera_at, cube, glass, lambert, mirror, quad, sphere};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

use super::{mean_and_error, settings, within};

const EXTENT: [u32; 2] = [40, 40];

fn sheet(ior: f32) -> Material {
    Material {
        mode: ShadingMode::Refractive,
        ior,
        has_volume: false,
        double_sided: true,
        ..Material::default()
    }
}

/// A ball in a white room of radiance 1.
struct Furnace(Studio);

impl Furnace {
    fn new() -> Self {
        Self(Studio::new(EXTENT, settings()))
    }

    /// Mean radiance with a ball of this material, and its standard error.
    fn with(&mut self, name: &str, material: Material, samples: u64) -> (f64, f64) {
        let mut scene = Scene::new();
        scene.put(sphere(0.8, 64), material, Affine3A::IDENTITY);
        scene.surround(1.0);
        self.0.restage(&scene.delta, camera_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 0.6));
        let image = self.0.mean(samples);
        let spoilt = self.0.statistics().non_finite;
        assert_eq!(spoilt, 0, "{name}: samples that are not finite");
        mean_and_error(&image, 0)
    }
}

#[test]
fn white_surfaces_vanish_in_a_white_room() {
    let mut furnace = Furnace::new();
    for (name, material) in [
        ("diffuse", lambert(1.0)),
        ("mirror", mirror()),
        ("glass", glass(1.5)),
        ("diamond", glass(2.417)),
        ("sheet", sheet(1.5)),
    ] {
        let (mean, error) = furnace.with(name, material, 32);
        assert!((mean - 1.0).abs() < within(error, 1e-4, 2e-3), "{name}: {mean} +- {error}");
    }
}

#[test]
fn rough_coats_and_rough_glass_make_no_light() {
    let mut furnace = Furnace::new();
    // Least means, background included, of metal, frosted glass and a frosted sheet: single scattering loses light at high
    // roughness (glTF 2.0 appendix B); furnace-ggx has how much. Few, bright samples leave frosted glass by its rim.
    for (roughness, least, error_max) in [
        (0.0, [0.999; 3], 1e-3),
        (0.01, [0.9985; 3], 1e-3),
        (0.3, [0.98, 0.94, 0.965], 0.015),
        (1.0, [0.625, 0.575, 0.48], 2e-3),
    ] {
        let metal = Material { metallic: 1.0, roughness, ..Material::default() };
        let frosted =
            Material { metallic: 0.0, roughness, transmission: 1.0, has_volume: true, ..Material::default() };
        let pane = Material { has_volume: false, double_sided: true, ..frosted.clone() };
        let materials = [("metal", metal), ("frosted glass", frosted), ("frosted sheet", pane)];
        for ((name, material), least) in materials.into_iter().zip(least) {
            let (mean, error) = furnace.with(&format!("{name}, roughness {roughness}"), material, 64);
            assert!(
                mean < 1.0 + within(error, 1e-4, error_max),
                "{name}, roughness {roughness}: {mean} +- {error}"
            );
            assert!(mean > least, "{name}, roughness {roughness}: {mean}, not {least}");
        }
    }
}

/// Where half of a surface is glass around a volume, the other half shines from inside as a white wall does.
#[test]
fn what_is_half_glass_makes_no_light() {
    let mut furnace = Furnace::new();
    for roughness in [0.0, 0.1, 0.3] {
        let half =
            Material { metallic: 0.0, roughness, transmission: 0.5, has_volume: true, ..Material::default() };
        let (mean, error) = furnace.with(&format!("half glass, roughness {roughness}"), half, 32);
        // glTF lets the base have a little more than the coat leaves.
        assert!(mean < 1.01 + within(error, 0.0, 4e-3), "roughness {roughness}: {mean} +- {error}");
        assert!(mean > 0.95, "roughness {roughness}: {mean} +- {error}");
    }
}

#[test]
fn rough_metal_loses_nothing_when_repeated_scattering_counts() {
    let mut furnace = Furnace::new();
    furnace.0.set(|settings| settings.multiple_scattering = true);
    for roughness in [0.0, 0.15, 0.4, 0.7, 1.0] {
        let metal = Material { metallic: 1.0, roughness, ..Material::default() };
        let (mean, error) = furnace.with(&format!("roughness {roughness}"), metal, 32);
        assert!((mean - 1.0).abs() < within(error, 2e-3, 2e-3), "roughness {roughness}: {mean} +- {error}");
    }
}

/// A closed white box with a small lamp: between walls that reflect 0.8 of the light, radiance is the geometric series.
#[test]
fn paths_between_walls_are_as_long_as_they_need_to_be() {
    let albedo = 0.8_f32;
    let mut scene = Scene::new();
    let wall = Material { emissive: Vec3::splat(0.5), double_sided: true, ..lambert(albedo) };
    scene.put(cube(2.0), wall, Affine3A::IDENTITY);
    let camera = camera_at(Vec3::new(0.1, 0.2, 0.3), Vec3::new(-0.2, 0.1, -0.9), 1.0);
    let mut studio = Studio::of(EXTENT, settings(), &scene.delta, camera);
    let (mean, error) = mean_and_error(&studio.mean(64), 0);
    let expected = 0.5 / (1.0 - f64::from(albedo));
    assert!((mean - expected).abs() < within(error, 1e-4, 5e-3), "{mean} +- {error}, not {expected}");
    // Cut at a depth the sum is the first terms of the series, exactly.
    for depth in [0, 1, 3] {
        studio.set(|settings| settings.path_depth = Some(depth));
        let (mean, error) = mean_and_error(&studio.mean(32), 0);
        let terms = (0..=depth + 1).map(|k| 0.5 * f64::from(albedo).powi(k as i32)).sum::<f64>();
        let bound = within(error, 1e-4, 5e-3);
        assert!((mean - terms).abs() < bound, "depth {depth}: {mean} +- {error}, not {terms}");
    }
}

#[test]
fn sheets_of_glass_let_the_sun_in() {
    // A floor under a pane and a lamp without size: paths cannot hit it, so shadow rays pass the pane.
    let radiance_of = |pane: bool| {
        let mut scene = Scene::new();
        scene.put(quad(6.0, 6.0), lambert(0.5), Affine3A::IDENTITY);
        if pane {
            scene.put(quad(6.0, 6.0), sheet(1.5), Affine3A::from_translation(Vec3::Z));
        }
        scene.light(caustica_tests::scene::point_light(Vec3::new(0.0, 0.0, 40.0), 1000.0));
        let camera = camera_at(Vec3::new(0.0, -0.4, 0.7), Vec3::ZERO, 0.1);
        let mut studio = Studio::of([16, 16], settings(), &scene.delta, camera);
        studio.set(|settings| settings.path_depth = Some(0));
        mean_and_error(&studio.mean(16), 0).0
    };
    let (open, behind) = (radiance_of(false), radiance_of(true));
    // Two interfaces, head-on: r = 0.04, 1 - 2 r / (1 + r).
    assert!((behind / open - (1.0 - 0.08 / 1.04)).abs() < 2e-3, "{behind} of {open}");
}

/// What lies behind a sheet is found by drawn directions and by the path itself, each weighted for the other: both have to
/// reach it where the path is cut.
#[test]
fn cut_paths_find_a_panel_behind_a_sheet() {
    let radiance_of = |tint: Option<f32>| {
        let mut scene = Scene::new();
        scene.put(quad(6.0, 6.0), lambert(0.5), Affine3A::IDENTITY);
        if let Some(tint) = tint {
            let tinted = Material { base_color: Vec3::splat(tint).extend(1.0), ..sheet(1.0) };
            scene.put(quad(6.0, 6.0), tinted, Affine3A::from_translation(Vec3::Z));
        }
        let panel = Material { emissive: Vec3::splat(2.0), double_sided: true, ..lambert(0.0) };
        scene.put(quad(3.0, 3.0), panel, Affine3A::from_translation(Vec3::Z * 1.5));
        let camera = camera_at(Vec3::new(0.0, -0.4, 0.7), Vec3::ZERO, 0.1);
        let mut studio = Studio::of([16, 16], settings(), &scene.delta, camera);
        studio.set(|settings| settings.path_depth = Some(0));
        mean_and_error(&studio.mean(64), 0)
    };
    let (open, error) = radiance_of(None);
    for tint in [1.0, 0.5] {
        let (behind, error_behind) = radiance_of(Some(tint));
        let off = (behind - f64::from(tint) * open).abs();
        let bound = within(error + error_behind, 1e-3, 3e-3);
        assert!(off < bound, "tint {tint}: {behind} +- {error_behind} of {open} +- {error}");
    }
}
