//! Pictures that must be equal: raster and ray primaries, special and general variants, the same command twice,
//! a scene with and without what cannot be seen.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::collections::BTreeSet;

use caustica_renderer::delta::{Geometry, Instance, InstanceId, Material, SceneDelta, Visibility};
use caustica_renderer::{Accumulated, NeedsMode, Pipeline, ViewSettings};
use caustica_tests::numbers::Random;
use caustica_tests::picture::{bits, differing, mean_of};
use caustica_tests::scene::{
    Scene, camera_at, camera_parallel, cube, glass, lambert, point_light, quad, sphere, zoo,
};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Quat, Vec3, Vec3A};

const EXTENT: [u32; 2] = [96, 64];

fn settings(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, ..ViewSettings::default() }
}

fn zoo_image(settings: ViewSettings, samples: u64) -> Accumulated {
    let (scene, camera) = zoo();
    Studio::of(EXTENT, settings, &scene.delta, camera).mean(samples)
}

#[test]
fn raster_and_ray_primaries_see_the_same() {
    let still = |pipeline| ViewSettings { jitter: false, ..settings(pipeline) };
    let hybrid = zoo_image(still(Pipeline::Hybrid), 4);
    let raytraced = zoo_image(still(Pipeline::Raytraced), 4);
    // A pixel whose centre lies on an edge may fall to either side; masked edges have many such.
    let count = differing(&hybrid, &raytraced, 1e-3);
    assert!(count <= 12, "{count} pixels differ");
}

#[test]
fn what_the_scene_does_not_need_changes_nothing() {
    for pipeline in Pipeline::ALL {
        // The zoo needs nearly all; a bare scene needs nearly nothing.
        let auto = zoo_image(settings(pipeline), 2);
        let all = zoo_image(ViewSettings { needs: NeedsMode::All, ..settings(pipeline) }, 2);
        assert_eq!(bits(&auto), bits(&all), "zoo, {}", pipeline.name());

        let mut scene = Scene::new();
        scene.put(quad(8.0, 8.0), lambert(0.5), Affine3A::IDENTITY);
        scene.put(sphere(0.5, 32), lambert(0.9), Affine3A::from_translation(Vec3::new(0.2, 0.1, 0.3)));
        scene.light(point_light(Vec3::new(1.0, 1.2, 3.0), 5.0));
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera_parallel(2.0, 1.0));
        let (auto, left_out) = (studio.mean(2), studio.statistics().left_out);
        studio.set(|settings| settings.needs = NeedsMode::All);
        studio.set(|settings| settings.seed = 7);
        studio.set(|settings| settings.seed = 0);
        let (all, nothing) = (studio.mean(2), studio.statistics().left_out);
        assert!(left_out.len() >= 6, "{left_out:?}");
        // A raster view casts no rays, whatever it is told; lobes come with the scene.
        let as_told = nothing.iter().all(|left| left.what == "coats, sheen, films and other lobes");
        assert!(as_told || pipeline == Pipeline::Raster, "{nothing:?}");
        assert_eq!(bits(&auto), bits(&all), "bare scene, {}", pipeline.name());
    }
}

#[test]
fn the_same_command_gives_the_same_bits() {
    for pipeline in Pipeline::ALL {
        let (scene, camera) = zoo();
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera);
        let first = studio.mean(5);
        studio.set(|settings| settings.seed = 1);
        assert_ne!(bits(&first), bits(&studio.mean(5)), "{}", pipeline.name());
        studio.set(|settings| settings.seed = 0);
        assert_eq!(bits(&first), bits(&studio.mean(5)), "{}", pipeline.name());
        drop(studio);
        let second = zoo_image(settings(pipeline), 5);
        assert_eq!(bits(&first), bits(&second), "{}", pipeline.name());
    }
}

#[test]
fn parts_of_a_sample_set_add_up_to_the_whole() {
    let (scene, camera) = zoo();
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    let whole = studio.mean(12);
    let mut sum = vec![[0.0_f64; 3]; whole.mean.len()];
    for offset in [0, 6] {
        studio.view_mut().set_sample_offset(offset);
        let part = studio.mean(6);
        for (total, pixel) in sum.iter_mut().zip(&part.mean) {
            for (t, p) in total.iter_mut().zip(pixel) {
                *t += 0.5 * f64::from(*p);
            }
        }
    }
    for (pixel, total) in whole.mean.iter().zip(&sum) {
        for (p, t) in pixel.iter().zip(total) {
            assert!((f64::from(*p) - t).abs() <= 1e-5 * t.abs() + 1e-7, "{p} {t}");
        }
    }
}

/// What cannot be seen: hidden, without size, singular, not a number, infinite.
fn unseen() -> [(&'static str, bool, Affine3A); 6] {
    let (x, z) = (Vec3A::new(0.3, 0.4, 0.0), Vec3A::Z);
    [
        ("hidden", false, in_front()),
        ("without size", true, Affine3A::from_scale(Vec3::ZERO)),
        ("two axes alike", true, Affine3A::from_cols(x, x, z, in_front().translation)),
        ("not a number", true, Affine3A::from_translation(Vec3::new(f32::NAN, 0.0, 0.0))),
        ("turned by what is no number", true, Affine3A::from_cols(x, Vec3A::new(0.0, f32::NAN, 1.0), z, x)),
        ("infinite", true, Affine3A::from_scale(Vec3::new(1.0, f32::INFINITY, 1.0))),
    ]
}

fn in_front() -> Affine3A {
    Affine3A::from_translation(Vec3::new(0.2, 1.0, 2.0))
}

#[test]
fn what_cannot_be_seen_changes_nothing_else() {
    for pipeline in Pipeline::ALL {
        let without = zoo_image(settings(pipeline), 3);
        let (mut scene, camera) = zoo();
        let id = scene.put(sphere(0.6, 24), lambert(0.5), in_front());
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera);
        let shown = studio.mean(3);
        assert!(differing(&without, &shown, 1e-2) > 300, "{}", pipeline.name());
        let instance =
            scene.delta.instances.iter().find(|(other, _)| *other == id).expect("the instance").1.clone();
        let with = |shown, render_from_mesh| SceneDelta {
            instances: vec![(
                id,
                Instance {
                    visibility: Visibility { shown, ..Visibility::default() },
                    render_from_mesh,
                    ..instance.clone()
                },
            )],
            ..SceneDelta::default()
        };
        for (name, visible, transform) in unseen() {
            // Seen in between: what is unseen before and after keeps its samples.
            studio.apply(&with(true, in_front()));
            studio.apply(&with(visible, transform));
            let image = studio.mean(3);
            assert_eq!(differing(&without, &image, 1e-6), 0, "{name}, {}", pipeline.name());
        }
        // Flattened or as large as floats go: whatever is seen of it, nothing turns into nonsense.
        let flat = in_front() * Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
        for transform in [flat, Affine3A::from_scale(Vec3::splat(f32::MAX))] {
            studio.apply(&with(true, transform));
            let image = studio.mean(3);
            assert!(image.mean.iter().flatten().all(|x| x.is_finite()), "{}", pipeline.name());
        }
        studio.apply(&with(true, in_front()));
        assert_eq!(differing(&shown, &studio.mean(3), 1e-6), 0, "and back, {}", pipeline.name());
    }
}

/// The first, the last and one in the middle of the instances that the camera sees.
fn seen_of(studio: &mut Studio, ids: &[InstanceId]) -> [InstanceId; 3] {
    let mut seen: BTreeSet<InstanceId> = BTreeSet::new();
    for pixel in (0..EXTENT[0]).step_by(5).flat_map(|x| (0..EXTENT[1]).step_by(5).map(move |y| [x, y])) {
        let hit = studio.renderer.pick(&mut studio.session.frames, studio.view, pixel).expect("a pick");
        seen.extend(hit.map(|hit| hit.instance));
    }
    let seen: Vec<InstanceId> = ids.iter().copied().filter(|id| seen.contains(id)).collect();
    assert!(seen.len() > 50, "{} are seen", seen.len());
    [seen[0], seen[seen.len() / 2], seen[seen.len() - 1]]
}

#[test]
fn a_spoilt_instance_of_two_hundred_takes_no_other_with_it() {
    let mut random = Random::new(200);
    let mut scene = Scene::new();
    let (mesh, material) = (scene.mesh(cube(1.0)), scene.material(lambert(0.6)));
    let mut number = |low: f64, high: f64| random.between(low, high) as f32;
    let ids: Vec<InstanceId> = (0..200)
        .map(|_| {
            let scale = Vec3::new(number(0.1, 0.4), number(0.1, 0.4), number(0.1, 0.4));
            let turn = Quat::from_rotation_y(number(0.0, 6.0)) * Quat::from_rotation_x(number(0.0, 6.0));
            let at = Vec3::new(number(-2.4, 2.4), number(0.0, 2.2), number(-2.0, 2.0));
            scene.place(mesh, material, Affine3A::from_scale_rotation_translation(scale, turn, at))
        })
        .collect();
    scene.light(point_light(Vec3::new(1.0, 4.0, 3.0), 15.0));
    scene.surround(0.1);
    let camera = camera_at(Vec3::new(0.2, 1.6, 5.0), Vec3::new(0.0, 1.0, 0.0), 0.7);
    for pipeline in Pipeline::ALL {
        let still = ViewSettings { temporal: false, ..settings(pipeline) };
        let mut studio = Studio::of(EXTENT, still, &scene.delta, camera);
        let whole = studio.mean(2);
        for id in seen_of(&mut studio, &ids) {
            let (_, instance) = scene.delta.instances.iter().find(|(other, _)| *other == id).expect("a box");
            let without = SceneDelta { removed_instances: vec![id], ..SceneDelta::default() };
            studio.apply(&without);
            let without = studio.mean(2);
            assert!(differing(&whole, &without, 0.1) > 0, "it is seen");
            studio.apply(&SceneDelta { instances: vec![(id, instance.clone())], ..SceneDelta::default() });
            for (name, shown, place) in unseen() {
                // As a move alone, and as a whole instance.
                let visibility = Visibility { shown, ..Visibility::default() };
                let moved = SceneDelta {
                    transforms: vec![(id, place)],
                    visibility: vec![(id, visibility)],
                    ..SceneDelta::default()
                };
                let changed = Instance { render_from_mesh: place, visibility, ..instance.clone() };
                let sent = SceneDelta { instances: vec![(id, changed)], ..SceneDelta::default() };
                for delta in [moved, sent] {
                    studio.apply(&delta);
                    assert_eq!(bits(&studio.mean(2)), bits(&without), "{name}, {}", pipeline.name());
                    studio.apply(&SceneDelta {
                        instances: vec![(id, instance.clone())],
                        ..SceneDelta::default()
                    });
                }
            }
            assert_eq!(bits(&studio.mean(2)), bits(&whole), "and back, {}", pipeline.name());
        }
    }
}

/// The same odd numbers every time: xorshift over a small set of values.
fn odd_transforms(count: usize) -> Vec<Affine3A> {
    const VALUES: [f32; 14] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        3.0,
        1e-20,
        -1e-20,
        1e-38,
        1e20,
        f32::MAX,
        f32::MIN,
        f32::NAN,
        f32::INFINITY,
    ];
    let mut state = 0x9e37_79b9_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        // Odd values are rare, so that many matrices are almost ordinary.
        let kinds = if state.is_multiple_of(3) { VALUES.len() } else { 6 };
        VALUES[(state >> 8) as usize % kinds]
    };
    let mut column = || Vec3::new(next(), next(), next());
    (0..count)
        .map(|_| Affine3A::from_cols(column().into(), column().into(), column().into(), column().into()))
        .collect()
}

#[test]
fn no_transform_harms_the_device_or_the_picture() {
    let (mut scene, camera) = zoo();
    let id = scene.put(sphere(0.6, 12), lambert(0.5), in_front());
    let instance =
        scene.delta.instances.iter().find(|(other, _)| *other == id).expect("the instance").1.clone();
    let mut studio = Studio::of([48, 32], settings(Pipeline::Hybrid), &scene.delta, camera);
    let mut before = studio.mean(1);
    for (index, render_from_mesh) in odd_transforms(60).into_iter().enumerate() {
        // By turns as a whole instance and as a move alone.
        let delta = if index % 2 == 0 {
            let changed = Instance { render_from_mesh, ..instance.clone() };
            SceneDelta { instances: vec![(id, changed)], ..SceneDelta::default() }
        } else {
            SceneDelta { transforms: vec![(id, render_from_mesh)], ..SceneDelta::default() }
        };
        studio.apply(&delta);
        before = studio.mean(1);
        assert!(before.mean.iter().flatten().all(|x| x.is_finite()), "{render_from_mesh:?}");
    }
    studio.apply(&SceneDelta { transforms: vec![(id, in_front())], ..SceneDelta::default() });
    assert!(differing(&before, &studio.mean(1), 1e-2) > 20, "and back in sight");
}

#[test]
fn back_sides_are_unseen_even_beside_glass() {
    // One mesh of three parts: a single-sided square turned away, one turned to the camera, and a pane of glass.
    let mut parts = quad(1.0, 1.0);
    for (dx, normal, order) in [(1.2, Vec3::Z, [0, 1, 2, 0, 2, 3]), (0.0, Vec3::NEG_Z, [0, 2, 1, 0, 3, 2])] {
        let first = parts.positions.len() as u32;
        let corners: Vec<Vec3> = parts.positions[..4].iter().map(|p| *p + Vec3::X * dx).collect();
        parts.positions.extend(if dx == 0.0 {
            corners.iter().map(|p| *p - Vec3::X * 1.2).collect()
        } else {
            corners
        });
        parts.normals.extend([normal; 4]);
        parts.tangents.extend_from_within(..4);
        parts.tex_coords0.extend_from_within(..4);
        let geometry = Geometry { first_index: parts.indices.len() as u32, ..parts.geometries[0] };
        parts.indices.extend(order.map(|corner| first + corner));
        parts.geometries.push(geometry);
    }
    for pipeline in Pipeline::ALL {
        let mut scene = Scene::new();
        let (pane, paint) = (scene.material(glass(1.0)), scene.material(lambert(0.8)));
        let mesh = scene.mesh(parts.clone());
        scene.place(mesh, paint, Affine3A::IDENTITY);
        scene.delta.instances[0].1.materials = vec![pane, paint, paint];
        scene.surround(0.5);
        let still = ViewSettings { jitter: false, ..settings(pipeline) };
        let mut studio = Studio::of(EXTENT, still, &scene.delta, camera_parallel(1.0, 1.2));
        let image = studio.mean(32);
        let at = |x: f32| image.mean[(32 * EXTENT[0] + ((x / 1.8 + 1.0) * 48.0) as u32) as usize][0];
        // Glass of index 1 changes nothing; the square turned away shows the background, the other one its paint.
        assert!((at(0.0) - 0.5).abs() < 1e-3, "{}: glass {}", pipeline.name(), at(0.0));
        assert_eq!(at(-1.2), 0.5, "{}: the back", pipeline.name());
        assert!((at(1.2) - 0.4).abs() < 0.02, "{}: the front {}", pipeline.name(), at(1.2));
    }
}

/// At an index of 1 no microfacet bends light, so roughness does not show: what is seen of a slab at an angle is the way
/// through it.
#[test]
fn rough_glass_of_index_1_is_clear_to_all_rays() {
    let fog = Material {
        metallic: 0.0,
        roughness: 1.0,
        specular: 0.0,
        transmission: 1.0,
        ior: 1.0,
        has_volume: true,
        attenuation_color: Vec3::splat(0.5),
        attenuation_distance_m: 1.0,
        ..Material::default()
    };
    let mut scene = Scene::new();
    scene.put(cube(1.0), fog, Affine3A::from_scale(Vec3::new(40.0, 40.0, 1.0)));
    scene.surround(1.0);
    let slanting = camera_at(Vec3::new(0.0, -6.0, 4.0), Vec3::ZERO, 0.01);
    let expected = 0.5_f32.powf(13.0_f32.sqrt() / 2.0);
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Path] {
        let image = Studio::of([8, 8], settings(pipeline), &scene.delta, slanting).mean(8);
        let found = mean_of(&image);
        assert!((found / expected - 1.0).abs() < 0.01, "{}: {found}, not {expected}", pipeline.name());
    }
}

#[test]
fn an_empty_scene_is_its_environment() {
    for pipeline in Pipeline::ALL {
        let mut scene = Scene::new();
        scene.surround(0.25);
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera_parallel(1.0, 1.0));
        let image = studio.mean(2);
        assert!(image.mean.iter().flatten().all(|x| *x == 0.25), "{}", pipeline.name());
        let nothing = SceneDelta::default();
        studio.frame(&nothing);
        assert_eq!(studio.statistics().samples, 3);
    }
}

#[test]
fn picking_finds_what_is_under_the_pixel() {
    for pipeline in Pipeline::ALL {
        let mut scene = Scene::new();
        let left =
            scene.put(quad(1.0, 1.0), lambert(0.5), Affine3A::from_translation(Vec3::new(-0.7, 0.0, 0.0)));
        let right =
            scene.put(quad(1.0, 1.0), lambert(0.5), Affine3A::from_translation(Vec3::new(0.7, 0.0, 0.0)));
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera_parallel(1.0, 1.0));
        studio.frames(1);
        let mut pick = |x: u32, y: u32| -> Option<InstanceId> {
            let (renderer, view) = (&mut studio.renderer, studio.view);
            renderer.pick(&mut studio.session.frames, view, [x, y]).expect("a pick").map(|hit| hit.instance)
        };
        assert_eq!(pick(24, 32), Some(left), "{}", pipeline.name());
        assert_eq!(pick(72, 32), Some(right), "{}", pipeline.name());
        assert_eq!(pick(48, 32), None, "{}", pipeline.name());
        assert_eq!(pick(1000, 32), None, "{}", pipeline.name());
    }
}
