//! Shapes that are edited: what a moved one builds and refits, what no map of one may do, and what shapes cost a scene that
//! has none.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::sync::Arc;

use caustica_renderer::delta::{Camera, InstanceId, Mesh, MeshId, SceneDelta};
use caustica_renderer::{AccelPolicy, NeedsMode, Pipeline, TlasWork, ViewSettings};
use caustica_tests::picture::{bits, differing};
use caustica_tests::scene::{Scene, camera_at, lambert, mirror, point_light, quad};
use caustica_tests::shapes::{at, ball, block, mesh_of};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [96, 64];

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
}

/// A mesh of a ball and a box whose second primitive stands at `x`.
fn pair(x: f32) -> Mesh {
    let mut mesh = mesh_of(&[ball(0.3), block(0.5)]);
    mesh.geometries[1].mesh_from_primitive = shift(x);
    mesh
}

fn shift(x: f32) -> Affine3A {
    at(x, 0.2, 0.1) * Affine3A::from_rotation_z(x) * Affine3A::from_scale(Vec3::new(1.0, 1.4, 0.7))
}

struct Table {
    scene: Scene,
    mesh: MeshId,
    pair: InstanceId,
    camera: Camera,
}

fn table(x: f32) -> Table {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(6.0, 6.0), lambert(0.7), lying);
    scene.put(quad(4.0, 2.0), mirror(), at(0.0, 1.0, -1.5));
    let mesh = scene.mesh(pair(x));
    let material = scene.material(lambert(0.4));
    let pair = scene.place(mesh, material, at(-0.5, 0.4, 0.0));
    scene.light(point_light(Vec3::new(1.0, 2.5, 1.5), 8.0));
    let camera = camera_at(Vec3::new(0.0, 1.5, 4.0), Vec3::new(0.0, 0.6, 0.0), 0.7);
    Table { scene, mesh, pair, camera }
}

fn slid(mesh: MeshId, x: f32) -> SceneDelta {
    SceneDelta {
        primitive_transforms: vec![(mesh, 1, shift(x))],
        reason: String::from("moved primitive"),
        ..SceneDelta::default()
    }
}

#[test]
fn a_moved_shape_is_right_in_the_next_frame_and_refitted_from_then_on() {
    let table_now = table(0.3);
    let policy = AccelPolicy { compact: false, ..AccelPolicy::default() };
    let settings = ViewSettings { pipeline: Pipeline::Hybrid, ..ViewSettings::default() };
    let mut studio =
        Studio::with_policy(EXTENT, settings.clone(), policy, &table_now.scene.delta, table_now.camera);
    let before = studio.mean(2);
    let work = |studio: &Studio| {
        let figures = studio.statistics().acceleration;
        (figures.blas_built, figures.blas_refit, figures.tlas)
    };
    studio.frame(&slid(table_now.mesh, 0.6));
    assert_eq!(work(&studio), (1, 0, TlasWork::Refit), "a structure that can be refitted takes its place");
    assert!(differing(&before, &studio.read(), 0.05) > 50);
    for x in [0.8, 0.9] {
        studio.frame(&slid(table_now.mesh, x));
        assert_eq!(work(&studio), (0, 1, TlasWork::Refit));
        let figures = studio.statistics();
        assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "moved primitive"));
        assert!(figures.uploaded_bytes < 4096, "{} bytes for one shape", figures.uploaded_bytes);
    }
    let after = studio.read();
    // Loosened, rebuilt in the background from a copy of the boxes, compacted: the picture stays.
    studio.frame(&slid(table_now.mesh, 3.0));
    studio.frame(&slid(table_now.mesh, 0.9));
    let again = studio.read();
    studio.frames(140);
    assert!(studio.statistics().acceleration.total_blas_swapped > 0);
    studio.frame(&slid(table_now.mesh, 0.9));
    let settled = studio.read();
    drop(studio);
    let fresh = table(0.9);
    let expected = Studio::of(EXTENT, settings, &fresh.scene.delta, fresh.camera).mean(1);
    assert_eq!(bits(&after), bits(&expected));
    assert_eq!(bits(&again), bits(&expected));
    assert_eq!(bits(&settled), bits(&expected));
}

#[test]
fn no_map_of_a_shape_harms_the_device_or_the_picture() {
    let table_now = table(0.3);
    let settings = ViewSettings { pipeline: Pipeline::Hybrid, ..ViewSettings::default() };
    let mut studio = Studio::of([48, 32], settings, &table_now.scene.delta, table_now.camera);
    let before = studio.mean(1);
    let flat =
        [Vec3::new(1.0, 0.0, 1.0), Vec3::ZERO, Vec3::splat(1e-20), Vec3::splat(1e20), Vec3::splat(f32::MAX)];
    let tall = [Vec3::new(1.0, 1e30, 1.0), Vec3::new(1e-30, 1.0, 1.0), Vec3::new(1e-38, 1e38, 1.0)];
    for scale in flat.into_iter().chain(tall) {
        for turn in [Affine3A::IDENTITY, Affine3A::from_rotation_y(0.7)] {
            let map = turn * Affine3A::from_scale(scale) * turn.inverse();
            let map = if map.is_finite() { map } else { Affine3A::from_scale(scale) };
            studio.frame(&SceneDelta {
                primitive_transforms: vec![(table_now.mesh, 1, map)],
                ..SceneDelta::default()
            });
            let image = studio.read();
            assert!(image.mean.iter().flatten().all(|x| x.is_finite()), "{scale}");
        }
    }
    studio.frame(&slid(table_now.mesh, 0.3));
    assert_eq!(differing(&before, &studio.read(), 1e-6), 0, "and back");
}

#[test]
fn a_scene_without_shapes_pays_nothing_for_them() {
    let named =
        |studio: &Studio, what: &str| studio.statistics().left_out.iter().any(|left| left.what == what);
    let table_now = table(0.3);
    let settings = ViewSettings { pipeline: Pipeline::Hybrid, ..ViewSettings::default() };
    let mut studio = Studio::of(EXTENT, settings, &table_now.scene.delta, table_now.camera);
    studio.frames(1);
    assert!(!named(&studio, "spheres and boxes") && named(&studio, "raster of primary surfaces"));
    // Without the pair, and the pair of triangles in its place.
    studio.frame(&SceneDelta {
        removed_instances: vec![table_now.pair],
        removed_meshes: vec![table_now.mesh],
        ..SceneDelta::default()
    });
    studio.frames(1);
    assert!(named(&studio, "spheres and boxes") && !named(&studio, "raster of primary surfaces"));
    let image = |needs| {
        let mut bare = table(0.3);
        bare.scene.delta.meshes.retain(|(id, _)| *id != bare.mesh);
        bare.scene.delta.instances.retain(|(id, _)| *id != bare.pair);
        let settings = ViewSettings { pipeline: Pipeline::Hybrid, needs, ..ViewSettings::default() };
        bits(&Studio::of(EXTENT, settings, &bare.scene.delta, bare.camera).mean(2))
    };
    drop(studio);
    assert_eq!(image(NeedsMode::Auto), image(NeedsMode::All));
}

/// Which of the pair's two primitives some pixel of the present pipeline picks.
fn picked(studio: &mut Studio, table: &Table) -> [bool; 2] {
    studio.frames(1);
    let mut found = [false; 2];
    for (x, y) in (0..EXTENT[1]).flat_map(|y| (0..EXTENT[0]).map(move |x| (x, y))).step_by(7) {
        let (renderer, view) = (&mut studio.renderer, studio.view);
        let hit = renderer.pick(&mut studio.session.frames, view, [x, y]).expect("a pick");
        if let Some(hit) = hit.filter(|hit| hit.instance == table.pair) {
            found[hit.geometry as usize] = true;
        }
    }
    found
}

#[test]
fn shapes_are_picked_where_rays_find_them_and_where_raster_draws_them() {
    let table = table(0.3);
    let mut studio = Studio::of(EXTENT, still(Pipeline::Hybrid), &table.scene.delta, table.camera);
    assert_eq!(picked(&mut studio, &table), [true; 2], "hybrid");
    studio.set(|settings| settings.pipeline = Pipeline::Raster);
    assert_eq!(picked(&mut studio, &table), [true; 2], "raster");
}

#[test]
fn shapes_beside_triangles_in_one_mesh_are_refused_by_name() {
    let mut mixed = quad(1.0, 1.0);
    mixed.shapes.push(ball(1.0));
    let mut scene = Scene::new();
    scene.put(mixed, lambert(0.5), Affine3A::IDENTITY);
    let mut studio = Studio::new([16, 16], still(Pipeline::Hybrid));
    let mut recorder = studio.session.frames.begin().expect("a frame");
    let refusal = studio.renderer.apply(&mut recorder, &scene.delta).err();
    studio.session.frames.submit(recorder, None).expect("a submission");
    let words = refusal.expect("a refusal").to_string();
    assert!(words.contains("mesh 'quad'") && words.contains("triangles"), "{words}");
    let whole = Arc::new(mesh_of(&[ball(0.0), block(1.0)]));
    studio.frame(&SceneDelta { meshes: vec![(MeshId(77), whole)], ..SceneDelta::default() });
}
