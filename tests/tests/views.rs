//! Debug views show what was planted: edges, corners, rays, the shadow of one light, dropped samples, sides; and
//! raster draws spheres and boxes where rays meet them.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use caustica_renderer::delta::{AlphaMode, Camera, Geometry, Light, LightId, Material, SceneDelta};
use caustica_renderer::{Pipeline, Show, ToneMap, ViewSettings};
use caustica_tests::repository;
use caustica_tests::scene::{
    Scene, camera_at, camera_parallel, checker, glass, lambert, mirror, plain_use, point_light, quad,
};
use caustica_tests::shapes::{at, ball, block, mesh_of};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Quat, Vec3};

const EXTENT: [u32; 2] = [96, 64];
type Pixel = [f32; 3];

fn still(pipeline: Pipeline, show: Show) -> ViewSettings {
    ViewSettings {
        pipeline,
        show,
        jitter: false,
        temporal: false,
        tone_map: ToneMap::Linear,
        ..ViewSettings::default()
    }
}

/// What is shown after some frames.
fn shown(studio: &mut Studio, frames: u32) -> Vec<Pixel> {
    studio.frames(frames);
    studio.display().into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

/// The pixel that a parallel camera of this height shows a point with.
fn pixel_of(x: f32, y: f32, ymag_m: f32) -> usize {
    let scale = 0.5 * EXTENT[1] as f32 / ymag_m;
    let column = (0.5 * EXTENT[0] as f32 + x * scale).floor() as usize;
    let row = (0.5 * EXTENT[1] as f32 - y * scale).floor() as usize;
    row * EXTENT[0] as usize + column
}

/// Where the centre of a pixel lies in the plane that a parallel camera sees.
fn place_of(pixel: usize, ymag_m: f32) -> (f32, f32) {
    let scale = 0.5 * EXTENT[1] as f32 / ymag_m;
    let (column, row) = (pixel % EXTENT[0] as usize, pixel / EXTENT[0] as usize);
    let x = (column as f32 + 0.5 - 0.5 * EXTENT[0] as f32) / scale;
    (x, (0.5 * EXTENT[1] as f32 - row as f32 - 0.5) / scale)
}

fn near(a: Pixel, b: Pixel, tolerance: f32) -> bool {
    a.iter().zip(&b).all(|(x, y)| (x - y).abs() <= tolerance)
}

fn assert_near(what: &str, found: Pixel, expected: Pixel) {
    assert!(near(found, expected, 0.01), "{what}: {found:?}, expected {expected:?}");
}

const NOTHING: Pixel = [0.0; 3];
const ONE_RAY: Pixel = [0.02, 0.1, 0.8];
const TWO_RAYS: Pixel = [0.05, 0.6, 0.1];

#[test]
fn ray_depth_counts_the_rays_behind_each_surface() {
    // A ray that looks down meets a mirror that sends it to the right; there, in one half, a second mirror sends it back.
    let mut scene = Scene::new();
    let half_turned = Affine3A::from_rotation_y(std::f32::consts::FRAC_PI_4);
    let silver = scene.material(mirror());
    let (mesh, paint) = (scene.mesh(quad(0.8, 0.8)), scene.material(lambert(0.5)));
    scene.place(mesh, silver, at(0.0, -0.5, 0.0) * half_turned);
    scene.place(mesh, silver, at(0.0, 0.5, 0.0) * half_turned);
    scene.place(mesh, silver, at(2.0, -0.5, 0.0) * half_turned.inverse());
    scene.place(mesh, paint, at(-1.0, 0.0, 0.0));
    scene.surround(0.5);
    let settings = ViewSettings { max_depth: 4, ..still(Pipeline::Hybrid, Show::RayDepth) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(2.0, 1.0));
    let picture = shown(&mut studio, 1);
    for (x, y, expected) in
        [(0.0, -0.5, TWO_RAYS), (0.0, 0.5, ONE_RAY), (-1.0, 0.0, NOTHING), (1.2, 0.9, NOTHING)]
    {
        assert_near(&format!("at {x}, {y}"), picture[pixel_of(x, y, 1.0)], expected);
    }
    // At a depth of one the second mirror is met and not followed.
    studio.set(|settings| settings.max_depth = 1);
    assert_near("depth 1", shown(&mut studio, 1)[pixel_of(0.0, -0.5, 1.0)], ONE_RAY);
    studio.set(|settings| settings.pipeline = Pipeline::Raster);
    let picture = shown(&mut studio, 1);
    assert!(picture.iter().all(|pixel| *pixel == NOTHING), "raster casts no rays");
}

const OUT_OF_REACH: Pixel = [0.0, 0.0, 0.2];

/// A floor in the plane z = 0 and a tile one metre above it that is half a metre wide; lamps two metres above the
/// floor to the left and to the right, and one below it.
fn tile() -> (Scene, [LightId; 3]) {
    let mut scene = Scene::new();
    scene.put(quad(12.0, 8.0), lambert(0.8), Affine3A::IDENTITY);
    scene.put(quad(0.5, 0.5), Material { double_sided: true, ..lambert(0.3) }, at(0.0, 0.0, 1.0));
    let lamps = [Vec3::new(-2.0, 0.0, 2.0), Vec3::new(2.0, 0.0, 2.0), Vec3::new(0.0, 0.0, -1.0)];
    let ids = lamps.map(|place| scene.light(point_light(place, 5.0)));
    (scene, ids)
}

/// Where the floor around a shadow that the tile throws to the side of `sign` is shadowed. `None`: too near to its edge.
fn is_shadowed(x: f32, y: f32, sign: f32, clearance: f32) -> Option<bool> {
    let inside = (0.5 - (x - 2.0 * sign).abs()).min(0.5 - y.abs());
    (inside.abs() > clearance).then_some(inside > 0.0)
}

#[test]
fn the_shadow_of_each_light_lies_where_geometry_says() {
    const YMAG_M: f32 = 2.0;
    let (scene, lamps) = tile();
    let mut studio =
        Studio::of(EXTENT, still(Pipeline::Hybrid, Show::Shadow), &scene.delta, camera_parallel(3.0, YMAG_M));
    for (lamp, sign) in [(None, 1.0), (Some(lamps[0]), 1.0), (Some(lamps[1]), -1.0)] {
        let before = studio.view().samples();
        studio.set(|settings| settings.show_light = lamp);
        let picture = shown(&mut studio, 2);
        assert_eq!(studio.view().samples(), before + 2, "another light resets nothing");
        let mut dark = 0;
        for (index, pixel) in picture.iter().enumerate() {
            let (x, y) = place_of(index, YMAG_M);
            if x.abs().max(y.abs()) < 0.3 {
                continue; // the tile itself
            }
            let Some(shadowed) = is_shadowed(x, y, sign, 0.04) else { continue };
            assert_eq!(*pixel, if shadowed { NOTHING } else { [1.0; 3] }, "{lamp:?} at {x}, {y}");
            dark += usize::from(shadowed);
        }
        assert!(dark > 150, "{dark}");
    }
    studio.set(|settings| settings.show_light = Some(lamps[2]));
    let picture = shown(&mut studio, 1);
    assert_near("from below", picture[pixel_of(1.0, 1.0, YMAG_M)], OUT_OF_REACH);
    studio.set(|settings| settings.show_light = Some(LightId { node: 999, part: 0 }));
    let picture = shown(&mut studio, 1);
    assert!(picture.iter().all(|pixel| *pixel == NOTHING), "there is no such light");
    studio.set(|settings| (settings.pipeline, settings.show_light) = (Pipeline::Raster, None));
    let picture = shown(&mut studio, 1);
    assert!(picture.iter().all(|pixel| *pixel == NOTHING), "raster casts no rays");
}

#[test]
fn the_shadow_of_a_large_light_gathers_over_the_frames() {
    const YMAG_M: f32 = 2.0;
    let (mut scene, lamps) = tile();
    let large = Light::Point {
        position: Vec3::new(-2.0, 0.0, 2.0),
        intensity: Vec3::splat(5.0),
        radius_m: 0.4,
        range_m: f32::INFINITY,
    };
    scene.delta.lights[0].1 = large;
    let settings = ViewSettings { show_light: Some(lamps[0]), ..still(Pipeline::Hybrid, Show::Shadow) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(3.0, YMAG_M));
    // In the middle of the shadow's straight edge about half of the light is seen.
    let edge = pixel_of(2.0, 0.5, YMAG_M);
    let once = shown(&mut studio, 1)[edge][0];
    assert!(once == 0.0 || once == 1.0, "one ray says yes or no: {once}");
    let mean = shown(&mut studio, 63)[edge][0];
    assert!((0.3..0.7).contains(&mean), "{mean}");
    // Through glass the light comes coloured.
    let green =
        Material { attenuation_color: Vec3::new(0.1, 0.9, 0.1), attenuation_distance_m: 0.1, ..glass(1.5) };
    let mut windows = Scene::starting_at(100);
    windows.put(mesh_of(&[block(0.5)]), green, at(-1.0, 1.2, 1.0));
    studio.apply(&windows.delta);
    let picture = shown(&mut studio, 16);
    let tinted = picture.iter().filter(|p| p[1] > 0.05 && p[0] < 0.2 * p[1]).count();
    assert!(tinted > 20, "{tinted} pixels are green");
}

const IN_SURFACE: Pixel = [0.9, 0.8, 0.0];
const IN_DIRECT_LIGHT: Pixel = [0.9, 0.25, 0.0];
const IN_SHADING: Pixel = [0.9, 0.0, 0.6];
const BEFORE: Pixel = [0.8, 0.0, 0.0];

#[test]
fn dropped_samples_are_marked_by_the_pass_that_spoilt_them() {
    let mut scene = Scene::new();
    scene.put(quad(8.0, 8.0), lambert(0.5), Affine3A::IDENTITY);
    let spoilt = Material { emissive: Vec3::new(1.0, f32::INFINITY, 1.0), ..lambert(0.6) };
    scene.put(quad(0.6, 0.6), spoilt, at(-0.8, 0.0, 0.5));
    // A mirror above the view that shows the spoilt square, which turns its back to the floor.
    let tilted = Affine3A::from_rotation_y(-std::f32::consts::FRAC_PI_3);
    scene.put(quad(0.6, 0.6), mirror(), at(0.8, 0.0, 1.42) * tilted);
    scene.light(point_light(Vec3::new(0.0, 0.0, 3.0), 5.0));
    let settings = ViewSettings { max_depth: 2, ..still(Pipeline::Hybrid, Show::NonFinite) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(2.0, 1.0));
    let picture = shown(&mut studio, 2);
    assert_near("a surface", picture[pixel_of(-0.8, 0.0, 1.0)], IN_SURFACE);
    assert_near("a mirror", picture[pixel_of(0.8, 0.0, 1.0)], IN_SHADING);
    let floor = picture[pixel_of(0.0, 0.6, 1.0)];
    assert!(near(floor, [floor[0]; 3], 1e-3) && floor[0] > 0.0, "the floor is grey: {floor:?}");
    studio.read();
    assert!(studio.statistics().non_finite > 0, "they are counted too");
}

#[test]
fn what_an_earlier_sample_lost_stays_marked_until_the_reset() {
    // Two lamps of which each sample draws one; one is so strong and so near that its light is infinite.
    let mut scene = Scene::new();
    scene.put(quad(8.0, 8.0), lambert(0.5), Affine3A::IDENTITY);
    scene.light(point_light(Vec3::new(0.0, 0.0, 3.0), 5.0));
    let absurd = scene.light(point_light(Vec3::new(0.0, 0.0, 0.005), 1e38));
    let settings = ViewSettings { light_samples: 1, ..still(Pipeline::Hybrid, Show::NonFinite) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(2.0, 0.01));
    let count = |picture: &[Pixel], color| picture.iter().filter(|p| near(**p, color, 0.01)).count();
    let picture = shown(&mut studio, 24);
    let (now, before) = (count(&picture, IN_DIRECT_LIGHT), count(&picture, BEFORE));
    assert!(now > 100 && before > 100, "{now} now, {before} before");
    let later = shown(&mut studio, 24);
    let marked = |p: &Pixel| near(*p, IN_DIRECT_LIGHT, 0.01) || near(*p, BEFORE, 0.01);
    assert!(picture.iter().zip(&later).all(|(old, new)| !marked(old) || marked(new)), "it stays");
    studio.frame(&SceneDelta { removed_lights: vec![absurd], ..SceneDelta::default() });
    let clean = shown(&mut studio, 1);
    assert_eq!(clean.iter().filter(|p| marked(p)).count(), 0, "a reset forgets");
}

#[test]
fn normals_have_colours_whatever_they_face() {
    let mut scene = Scene::new();
    let paint = scene.material(lambert(0.5));
    let mesh = scene.mesh(quad(0.8, 0.8));
    scene.place(mesh, paint, at(-0.5, 0.0, 0.0));
    scene.place(mesh, paint, at(0.5, 0.0, 0.0) * Affine3A::from_rotation_y(-0.5));
    for show in [Show::Normal, Show::GeometricNormal] {
        let mut studio =
            Studio::of(EXTENT, still(Pipeline::Raster, show), &scene.delta, camera_parallel(2.0, 1.0));
        let picture = shown(&mut studio, 1);
        // As bytes of an sRGB picture they are (n + 1) / 2.
        let color = |x: f32, z: f32| [x, 0.0, z].map(|c| ((0.5 * c + 0.5 + 0.055) / 1.055).powf(2.4));
        assert_near("towards +Z", picture[pixel_of(-0.5, 0.0, 1.0)], color(0.0, 1.0));
        assert_near("aside", picture[pixel_of(0.5, 0.0, 1.0)], color(-(0.5_f32.sin()), 0.5_f32.cos()));
        assert_near("nothing", picture[pixel_of(0.0, 0.9, 1.0)], NOTHING);
    }
}

#[test]
fn edges_are_one_pixel_wide_at_any_distance() {
    let mut scene = Scene::new();
    scene.put(quad(1.0, 1.0), lambert(0.5), Affine3A::IDENTITY);
    let mut studio =
        Studio::of(EXTENT, still(Pipeline::Hybrid, Show::Wireframe), &scene.delta, camera_parallel(1.0, 0.6));
    for ymag_m in [0.6, 1.2, 0.1] {
        studio.view_mut().set_camera(camera_parallel(1.0, ymag_m));
        let picture = shown(&mut studio, 1);
        // The row through the middle crosses the diagonal once; over half of the line's height, 0.8, are at most two pixels.
        let middle = (EXTENT[1] / 2 * EXTENT[0]) as usize;
        let row = &picture[middle..middle + EXTENT[0] as usize];
        let scale = 0.5 * EXTENT[1] as f32 / ymag_m;
        let half_width = (0.5 * scale) as usize;
        let inside = if half_width < 44 { 48 - half_width + 3..48 + half_width - 3 } else { 0..96 };
        let bright = row[inside].iter().filter(|p| p[0] > 0.4).count();
        assert!((1..=2).contains(&bright), "{bright} bright pixels at a height of {ymag_m}");
    }
    // Corners: red, green and blue sum to one everywhere on the square, and each is met somewhere.
    studio.view_mut().set_camera(camera_parallel(1.0, 0.6));
    studio.set(|settings| settings.show = Show::Barycentric);
    let picture = shown(&mut studio, 1);
    let on: Vec<&Pixel> = picture.iter().filter(|p| p.iter().sum::<f32>() > 0.0).collect();
    assert!(on.len() > 2500, "{}", on.len());
    assert!(on.iter().all(|p| (p.iter().sum::<f32>() - 1.0).abs() < 2e-3));
    for channel in 0..3 {
        assert!(on.iter().any(|p| p[channel] > 0.95), "corner {channel}");
    }
}

#[test]
fn sides_parts_and_occlusion_are_told_apart() {
    let mut scene = Scene::new();
    let both = Material { double_sided: true, ..lambert(0.5) };
    let mut two = quad(0.5, 0.5);
    two.geometries = [0, 3]
        .map(|first_index| Geometry { first_index, index_count: 3, mesh_from_primitive: Affine3A::IDENTITY })
        .to_vec();
    scene.put(two, both.clone(), at(-1.0, 0.0, 0.0));
    scene.put(quad(0.5, 0.5), both, at(0.0, 0.0, 0.0) * Affine3A::from_rotation_y(3.0));
    let dim = scene.texture(caustica_renderer::delta::Texture { srgb: false, ..checker(1, 51, 51) });
    let dusty = Material { occlusion_texture: Some(plain_use(dim)), occlusion_strength: 0.5, ..lambert(0.5) };
    scene.put(quad(0.5, 0.5), dusty, at(1.0, 0.0, 0.0));
    let (upper, lower) = (pixel_of(-1.1, 0.1, 1.0), pixel_of(-0.9, -0.1, 1.0));
    let (turned, dark) = (pixel_of(0.0, 0.0, 1.0), pixel_of(1.0, 0.0, 1.0));
    for pipeline in Pipeline::ALL {
        let mut studio =
            Studio::of(EXTENT, still(pipeline, Show::Facing), &scene.delta, camera_parallel(1.0, 1.0));
        let facing = shown(&mut studio, 1);
        assert!(facing[upper][2] > 0.5 && facing[turned][0] > 0.5, "{}", pipeline.name());
        studio.set(|settings| settings.show = Show::Occlusion);
        let occlusion = shown(&mut studio, 1);
        assert_near("occlusion", occlusion[dark], [0.6; 3]);
        assert_near("no occlusion", occlusion[upper], [1.0; 3]);
        studio.set(|settings| settings.show = Show::Instance);
        let instances = shown(&mut studio, 1);
        assert_eq!(instances[upper], instances[lower]);
        assert_ne!(instances[upper], instances[turned]);
        studio.set(|settings| settings.show = Show::Primitive);
        let primitives = shown(&mut studio, 1);
        assert_ne!(primitives[upper], primitives[lower]);
    }
}

/// Spheres and boxes of every kind, cut by a wall of triangles: outside and around the camera, moved in their mesh,
/// squeezed, mirrored, with holes, single- and double-sided.
fn solids(around: bool) -> (Scene, Camera) {
    let mut scene = Scene::new();
    let paint = scene.texture(checker(4, 40, 230));
    let painted = Material { base_color_texture: Some(plain_use(paint)), ..lambert(0.9) };
    scene.put(quad(6.0, 6.0), lambert(0.6), at(0.0, 0.0, -0.1) * Affine3A::from_rotation_x(-0.3));
    let turn = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.8, 0.2));
    scene.put(mesh_of(&[ball(0.5)]), painted.clone(), at(-1.1, 0.3, 0.0) * turn);
    scene.put(mesh_of(&[block(0.7)]), painted.clone(), at(0.0, 0.4, 0.0) * turn);
    let mirrored = Affine3A::from_scale(Vec3::new(-1.2, 0.6, 0.9));
    scene.put(mesh_of(&[block(0.6), ball(0.4)]), painted.clone(), at(1.1, -0.3, 0.3) * turn * mirrored);
    let mut moved = mesh_of(&[ball(0.4), block(0.4)]);
    moved.geometries[0].mesh_from_primitive = at(-0.9, -0.6, 0.3) * mirrored;
    moved.geometries[1].mesh_from_primitive = at(0.1, -0.6, 0.2) * turn;
    scene.put(moved, painted.clone(), Affine3A::IDENTITY);
    let mut holes = checker(8, 0, 255);
    holes.rgba8 = holes.rgba8.chunks_exact(4).flat_map(|t| [200, 180, 160, t[0]]).collect();
    let holes = scene.texture(holes);
    let lace = Material {
        base_color_texture: Some(plain_use(holes)),
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..lambert(0.9)
    };
    scene.put(mesh_of(&[ball(0.35)]), lace, at(1.2, 0.6, 0.5));
    if around {
        scene.put(mesh_of(&[ball(5.0)]), lambert(0.5), Affine3A::IDENTITY);
        let shell = Material { double_sided: true, ..painted };
        scene.put(mesh_of(&[block(9.0)]), shell, turn);
    }
    scene.light(point_light(Vec3::new(1.0, 2.0, 4.0), 20.0));
    (scene, camera_at(Vec3::new(0.3, 0.6, 3.6), Vec3::ZERO, 0.8))
}

#[test]
fn raster_draws_spheres_and_boxes_where_rays_meet_them() {
    let views = [
        Show::Triangle,
        Show::Facing,
        Show::GeometricNormal,
        Show::Depth,
        Show::BaseColor,
        Show::Barycentric,
        Show::Wireframe,
    ];
    for (around, parallel) in [(false, false), (true, false), (false, true)] {
        let (scene, mut camera) = solids(around);
        if parallel {
            camera = camera_parallel(3.6, 1.2);
        }
        let mut raster = Studio::of(EXTENT, still(Pipeline::Raster, Show::Triangle), &scene.delta, camera);
        let drawn = views.map(|show| {
            raster.set(|settings| settings.show = show);
            shown(&mut raster, 1)
        });
        drop(raster);
        let mut rays = Studio::of(EXTENT, still(Pipeline::Raytraced, Show::Triangle), &scene.delta, camera);
        for (show, drawn) in views.into_iter().zip(drawn) {
            rays.set(|settings| settings.show = show);
            let met = shown(&mut rays, 1);
            assert!(met.iter().filter(|pixel| **pixel != NOTHING).count() > 1000, "{show:?} shows something");
            // The edge of a hole, a box or the wall may fall to the next pixel.
            let count = met.iter().zip(&drawn).filter(|(a, b)| !near(**a, **b, 0.01)).count();
            assert!(count <= 12, "{show:?}, around {around}, parallel {parallel}: {count} pixels differ");
        }
    }
}

#[test]
fn every_view_is_in_the_list_of_the_documents() {
    let text = std::fs::read_to_string(repository().join("docs/views.md")).expect("docs/views.md");
    for (show, label) in Show::ALL {
        let name = serde_json::to_value(show).expect("a name");
        let row = format!("| `{}` | {label} | {} |", name.as_str().expect("text"), show.meaning());
        assert!(text.contains(&row), "docs/views.md lacks this row:\n{row}");
    }
}
