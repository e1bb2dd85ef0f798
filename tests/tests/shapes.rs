//! Spheres and boxes that rays meet without triangles: against fine triangle meshes, from inside, through glass, moved,
//! stretched; and what they cost a scene that has none.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::sync::Arc;

use caustica_renderer::delta::{
    AlphaMode, Camera, Geometry, InstanceId, Light, Material, Mesh, MeshId, SceneDelta, Shape, ShapeKind,
};
use caustica_renderer::{AccelPolicy, Accumulated, NeedsMode, Pipeline, Show, TlasWork, ViewSettings};
use caustica_tests::scene::{
    Scene, camera_at, camera_parallel, checker, cube, glass, lambert, mirror, plain_use, point_light, quad,
    sphere,
};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Mat3, Quat, Vec3};

const EXTENT: [u32; 2] = [96, 64];
const RAYS: [Pipeline; 2] = [Pipeline::Hybrid, Pipeline::Raytraced];

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
}

/// A mesh of shapes, each of them a primitive.
fn mesh_of(shapes: &[Shape]) -> Mesh {
    let geometry = |first_index: usize| Geometry {
        first_index: first_index as u32,
        index_count: 1,
        mesh_from_primitive: Affine3A::IDENTITY,
    };
    Mesh {
        name: String::from("shapes"),
        shapes: shapes.to_vec(),
        geometries: (0..shapes.len()).map(geometry).collect(),
        ..Mesh::default()
    }
}

fn ball(radius: f32) -> Shape {
    Shape { kind: ShapeKind::Sphere, centre: Vec3::ZERO, half_extent: Vec3::splat(radius) }
}

fn block(side: f32) -> Shape {
    Shape { kind: ShapeKind::Box, centre: Vec3::ZERO, half_extent: Vec3::splat(0.5 * side) }
}

/// A ball and a cube: of triangles or of shapes.
#[derive(Clone, Copy)]
enum Made {
    Triangles,
    Shapes,
}

impl Made {
    fn ball(self, radius: f32) -> Mesh {
        match self {
            Self::Triangles => sphere(radius, 256),
            Self::Shapes => mesh_of(&[ball(radius)]),
        }
    }

    fn cube(self, side: f32) -> Mesh {
        match self {
            Self::Triangles => cube(side),
            Self::Shapes => mesh_of(&[block(side)]),
        }
    }
}

fn at(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, y, z))
}

fn bits(image: &Accumulated) -> Vec<[u32; 3]> {
    image.mean.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// Pixels of which a channel differs by more than a share of its value.
fn differing(a: &Accumulated, b: &Accumulated, share: f32) -> usize {
    let far = |p: &[f32; 3], q: &[f32; 3]| {
        p.iter().zip(q).any(|(x, y)| (x - y).abs() > share * (x.abs() + y.abs() + 0.01))
    };
    a.mean.iter().zip(&b.mean).filter(|(p, q)| far(p, q)).count()
}

fn mean_of(image: &Accumulated) -> f32 {
    image.mean.iter().flatten().sum::<f32>() / (3.0 * image.mean.len() as f32)
}

/// Scenes shown one after the other by one renderer: meshes of triangles and of shapes take each other's place, and
/// pipelines are made once.
#[derive(Default)]
struct Stage(Option<Studio>);

impl Stage {
    fn mean(&mut self, settings: ViewSettings, scene: &Scene, camera: Camera, samples: u64) -> Accumulated {
        let make = || Studio::of(EXTENT, settings.clone(), &SceneDelta::default(), camera);
        let studio = self.0.get_or_insert_with(make);
        studio.set(|now| *now = settings.clone());
        studio.restage(&scene.delta, camera);
        studio.mean(samples)
    }
}

/// A floor and a mirror, on which things of `made` stand under a hard lamp.
fn room(made: Made) -> (Scene, Camera) {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(8.0, 8.0), lambert(0.7), lying);
    scene.put(quad(4.0, 2.0), mirror(), at(0.0, 1.0, -1.6));
    let paint = scene.texture(checker(8, 40, 230));
    let painted = Material { base_color_texture: Some(plain_use(paint)), ..lambert(0.9) };
    scene.put(made.ball(0.5), painted, at(-0.9, 0.5, 0.2) * Affine3A::from_rotation_y(0.8));
    scene.put(made.cube(0.7), lambert(0.5), at(0.4, 0.35, 0.5) * Affine3A::from_rotation_y(0.6));
    let chrome = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    scene.put(made.ball(0.4), chrome, at(1.4, 0.4, -0.3));
    scene.light(point_light(Vec3::new(1.0, 2.8, 2.2), 12.0));
    (scene, camera_at(Vec3::new(0.2, 1.5, 4.2), Vec3::new(0.1, 0.5, 0.0), 0.7))
}

#[test]
fn shapes_look_like_fine_triangle_meshes() {
    for pipeline in RAYS {
        let image = |made| {
            let (scene, camera) = room(made);
            Studio::of(EXTENT, still(pipeline), &scene.delta, camera).mean(1)
        };
        let (fine, shapes) = (image(Made::Triangles), image(Made::Shapes));
        assert!(mean_of(&fine) > 0.05);
        // Outlines, edges of shadows and of checks, and their mirror images, may fall to the next pixel.
        let count = differing(&fine, &shapes, 0.01);
        assert!(count <= 20, "{}: {count} pixels differ", pipeline.name());
    }
}

#[test]
fn textures_lie_on_shapes_as_on_triangles() {
    // The sphere's longitude and latitude, and the face of a box that a square with the same texture covers.
    for pipeline in RAYS {
        let image = |left: Mesh, right: Mesh, right_at: Affine3A| {
            let mut scene = Scene::new();
            let mut paint = checker(2, 10, 250);
            for (index, texel) in paint.rgba8.chunks_exact_mut(4).enumerate() {
                texel[1] = (index % 16 * 15) as u8;
                texel[2] = (index / 16 * 15) as u8;
            }
            let paint = scene.texture(paint);
            let material = Material { base_color_texture: Some(plain_use(paint)), ..lambert(1.0) };
            let material = scene.material(material);
            let (left, right) = (scene.mesh(left), scene.mesh(right));
            scene.place(left, material, at(-0.7, 0.0, 0.0) * Affine3A::from_rotation_y(2.0));
            scene.place(right, material, right_at);
            scene.surround(1.0);
            let settings = ViewSettings { show: Show::BaseColor, ..still(pipeline) };
            let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(1.0, 0.8));
            studio.frames(1);
            studio.display()
        };
        let triangles = image(sphere(0.6, 256), quad(1.0, 1.0), at(0.7, 0.0, 0.5));
        let shapes = image(mesh_of(&[ball(0.6)]), mesh_of(&[block(1.0)]), at(0.7, 0.0, 0.0));
        let far = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).any(|(x, y)| (x - y).abs() > 0.02);
        let count = triangles.iter().zip(&shapes).filter(|(a, b)| far(a, b)).count();
        let painted = triangles.iter().filter(|pixel| pixel[1] > 0.1).count();
        assert!(painted > 500, "{painted}");
        assert!(count <= 40, "{}: {count} pixels differ", pipeline.name());
    }
}

#[test]
fn from_inside_the_far_side_is_seen() {
    let both = Material { double_sided: true, ..lambert(0.6) };
    let mut stage = Stage::default();
    for pipeline in RAYS {
        let mut image = |made: Made, as_box: bool, material: &Material| {
            let mut scene = Scene::new();
            let mesh = if as_box { made.cube(3.0) } else { made.ball(1.5) };
            scene.put(mesh, material.clone(), at(0.1, 0.2, 0.0) * Affine3A::from_rotation_y(0.4));
            scene.light(point_light(Vec3::new(0.3, 0.6, -0.2), 2.0));
            scene.surround(0.25);
            let camera = camera_at(Vec3::new(0.0, 0.1, 0.8), Vec3::new(0.2, 0.0, -1.0), 0.9);
            let settings = ViewSettings { light_samples: 1, ..still(pipeline) };
            stage.mean(settings, &scene, camera, 1)
        };
        for as_box in [false, true] {
            let (fine, shape) = (image(Made::Triangles, as_box, &both), image(Made::Shapes, as_box, &both));
            assert!(mean_of(&shape) > 0.03);
            let count = differing(&fine, &shape, 0.01);
            assert!(count <= 6, "{}, box {as_box}: {count} pixels differ", pipeline.name());
            // The back of a single-sided surface is not seen: the surroundings are.
            let single = image(Made::Shapes, as_box, &lambert(0.6));
            assert!(single.mean.iter().flatten().all(|x| *x == 0.25), "{}", pipeline.name());
        }
    }
}

/// A ball and a cube of glass before a wall of checks, their coloured shadows on it.
fn glass_house(made: Made) -> (Scene, Camera) {
    let mut scene = Scene::new();
    let paint = scene.texture(checker(6, 60, 230));
    let wall = Material { base_color_texture: Some(plain_use(paint)), ..lambert(0.9) };
    scene.put(quad(8.0, 8.0), wall, at(0.0, 0.0, -2.0));
    let green =
        Material { attenuation_color: Vec3::new(0.5, 0.9, 0.6), attenuation_distance_m: 1.0, ..glass(1.5) };
    scene.put(made.ball(0.8), green, at(-0.9, 0.1, 0.0));
    scene.put(made.cube(1.0), glass(1.3), at(1.0, 0.0, 0.0) * Affine3A::from_rotation_y(0.5));
    scene.light(point_light(Vec3::new(0.5, 1.5, 5.0), 40.0));
    scene.surround(0.1);
    (scene, camera_at(Vec3::new(0.0, 0.2, 4.5), Vec3::ZERO, 0.7))
}

#[test]
fn glass_shapes_bend_and_tint_light_as_glass_triangles_do() {
    for pipeline in RAYS {
        let image = |made| {
            let (scene, camera) = glass_house(made);
            Studio::of(EXTENT, still(pipeline), &scene.delta, camera).mean(48)
        };
        let (fine, shapes) = (image(Made::Triangles), image(Made::Shapes));
        // The mean says that nothing is lost or gained; pixels differ where a chain of choices came out another way.
        let (a, b) = (mean_of(&fine), mean_of(&shapes));
        assert!((a - b).abs() < 2e-3 * a, "{}: {a} and {b}", pipeline.name());
        let count = differing(&fine, &shapes, 0.05);
        assert!(count <= 20, "{}: {count} pixels differ", pipeline.name());
    }
}

#[test]
fn nothing_is_lost_or_gained_in_a_furnace_of_shapes() {
    let camera = camera_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 0.5);
    let settings = ViewSettings { max_depth: 64, ..still(Pipeline::Hybrid) };
    let scene_of = |material: &Material, shape: Shape| {
        let mut scene = Scene::new();
        let turn = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, 0.1));
        scene.put(mesh_of(&[shape]), material.clone(), turn);
        scene.surround(1.0);
        scene
    };
    let mut studio = Studio::of([32, 32], settings, &scene_of(&lambert(1.0), ball(1.0)).delta, camera);
    for (name, material, samples) in
        [("diffuse", lambert(1.0), 64), ("mirror", mirror(), 4), ("glass", glass(1.5), 128)]
    {
        for shape in [ball(1.0), block(1.4)] {
            studio.restage(&scene_of(&material, shape).delta, camera);
            let mean = mean_of(&studio.mean(samples));
            assert!((mean - 1.0).abs() < 1.5e-3, "{name}, {:?}: {mean}", shape.kind);
            assert_eq!(studio.statistics().non_finite, 0);
        }
    }
}

#[test]
fn holes_and_thin_coats_are_those_of_triangles() {
    // Masked: holes by texture. Blended: either side of a shape is met or passed by itself, so a quarter is seen through.
    let mut stage = Stage::default();
    for pipeline in RAYS {
        let mut image = |made: Made, alpha: AlphaMode| {
            let mut scene = Scene::new();
            let mut paint = checker(8, 0, 255);
            paint.rgba8 = paint.rgba8.chunks_exact(4).flat_map(|t| [200, 180, 160, t[0] / 2 + 64]).collect();
            let paint = scene.texture(paint);
            let lace = Material {
                base_color_texture: Some(plain_use(paint)),
                alpha,
                double_sided: true,
                ..lambert(0.9)
            };
            scene.put(made.ball(0.8), lace, Affine3A::from_rotation_y(1.0));
            scene.put(quad(8.0, 8.0), lambert(0.6), at(0.0, 0.0, -1.5));
            scene.light(point_light(Vec3::new(1.0, 1.0, 4.0), 20.0));
            let camera = camera_parallel(1.2, 1.2);
            stage.mean(still(pipeline), &scene, camera, 64)
        };
        for alpha in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
            let (fine, shapes) = (image(Made::Triangles, alpha), image(Made::Shapes, alpha));
            let (a, b) = (mean_of(&fine), mean_of(&shapes));
            assert!((a - b).abs() < 5e-3 * a, "{}, {alpha:?}: {a} and {b}", pipeline.name());
            // Coverage is drawn anew for each triangle and for each side of a shape: only holes are where they were.
            if matches!(alpha, AlphaMode::Mask { .. }) {
                let count = differing(&fine, &shapes, 0.02);
                assert!(count <= 20, "{}, {alpha:?}: {count} pixels differ", pipeline.name());
            }
        }
    }
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
fn a_moved_shape_says_where_it_came_from() {
    // Motion vectors of a ball that its primitive carries sideways: those of the triangles moved alike.
    let motion = |made: Made| {
        let mut scene = Scene::new();
        let mesh = scene.mesh(made.ball(0.6));
        let material = scene.material(lambert(0.5));
        scene.place(mesh, material, Affine3A::IDENTITY);
        scene.surround(0.5);
        let settings = ViewSettings { show: Show::Motion, ..still(Pipeline::Raytraced) };
        let mut studio = Studio::of(EXTENT, settings, &scene.delta, camera_parallel(1.2, 1.2));
        studio.frames(2);
        let rest = studio.display();
        let turned = at(0.2, 0.1, 0.0) * Affine3A::from_rotation_z(0.3);
        studio.frame(&SceneDelta { primitive_transforms: vec![(mesh, 0, turned)], ..SceneDelta::default() });
        (rest, studio.display())
    };
    let ((rest, fine), (shape_rest, shapes)) = (motion(Made::Triangles), motion(Made::Shapes));
    let far = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).any(|(x, y)| (x - y).abs() > 0.01);
    let count = |a: &[[f32; 4]], b: &[[f32; 4]]| a.iter().zip(b).filter(|(a, b)| far(a, b)).count();
    assert!(count(&rest, &fine) > 500, "the ball moves");
    assert!(count(&rest, &shape_rest) <= 8 && count(&fine, &shapes) <= 8, "{}", count(&fine, &shapes));
}

#[test]
fn a_stretched_sphere_is_an_ellipsoid() {
    let squeezed = Affine3A::from_scale(Vec3::new(1.3, 0.4, 0.8));
    let sheared = Affine3A::from_mat3(Mat3::from_cols(
        Vec3::new(0.9, 0.3, 0.0),
        Vec3::new(-0.4, 0.7, 0.2),
        Vec3::new(0.1, 0.2, 0.8),
    ));
    let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 0.6, 1.2)) * Affine3A::from_rotation_z(0.5);
    let (mut stage, mut last) = (Stage::default(), None);
    for pipeline in RAYS {
        for (name, map) in [("squeezed", squeezed), ("sheared", sheared), ("mirrored", mirrored)] {
            // The map inside the mesh, and as the instance's own; material: smooth, so that normals are seen in mirror images.
            let mut image = |made: Made, inside: bool| {
                let mut scene = Scene::new();
                let chrome =
                    scene.material(Material { metallic: 1.0, roughness: 0.0, ..Material::default() });
                for (mut mesh, x) in [(made.ball(0.6), -0.8), (made.cube(0.9), 0.8)] {
                    let place = at(x, 0.0, 0.2);
                    if inside {
                        mesh.geometries[0].mesh_from_primitive = map;
                    }
                    let mesh = scene.mesh(mesh);
                    scene.place(mesh, chrome, if inside { place } else { place * map });
                }
                scene.put(quad(8.0, 8.0), lambert(0.6), at(0.0, 0.0, -1.0));
                scene.light(point_light(Vec3::new(1.5, 2.0, 4.0), 30.0));
                let camera = camera_at(Vec3::new(0.3, 0.6, 4.0), Vec3::ZERO, 0.7);
                stage.mean(still(pipeline), &scene, camera, 1)
            };
            for inside in [false, true] {
                let (fine, shapes) = (image(Made::Triangles, inside), image(Made::Shapes, inside));
                if let Some(other) = last.replace(shapes.clone()).filter(|_| !inside) {
                    assert!(differing(&other, &shapes, 0.02) > 100, "{name}: another map, another picture");
                }
                let count = differing(&fine, &shapes, 0.02);
                assert!(count <= 6, "{name}, {}, inside {inside}: {count} pixels differ", pipeline.name());
            }
        }
    }
}

#[test]
fn no_shape_shades_itself_at_any_scale() {
    let extent = [64, 64];
    let mut studio: Option<Studio> = None;
    for scale in [1e-3_f32, 1.0, 1e3] {
        for (shape, inside) in
            [(ball(0.8), false), (block(1.3), false), (ball(0.8), true), (block(1.3), true)]
        {
            // Off the origin, turned out of the axes and stretched, by the instance or inside the mesh.
            let turn = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.8, 0.2));
            let place = at(3.3, 1.7, -2.1) * turn * Affine3A::from_scale(Vec3::new(1.0, 0.7, 1.1));
            let grow = Affine3A::from_scale(Vec3::splat(scale));
            let mut mesh = mesh_of(&[Shape { centre: Vec3::new(4.0, -2.0, 1.0), ..shape }]);
            let back = at(-4.0, 2.0, -1.0);
            let instance = if inside {
                mesh.geometries[0].mesh_from_primitive = place * back;
                grow
            } else {
                grow * place * back
            };
            let mut scene = Scene::new();
            scene.put(mesh, lambert(1.0), instance);
            let direction = Vec3::new(-0.9, -0.35, -0.25).normalize();
            scene.light(Light::Directional { direction, irradiance: Vec3::ONE, angular_radius_rad: 0.0 });
            let mut camera = camera_parallel(3.0 * scale, 1.1 * scale);
            camera.render_from_camera =
                Affine3A::from_translation(Vec3::new(3.3, 1.7, -2.1) * scale) * camera.render_from_camera;
            camera.near_m = 0.01 * scale;
            let studio = studio
                .get_or_insert_with(|| Studio::of(extent, still(Pipeline::Raytraced), &scene.delta, camera));
            studio.restage(&scene.delta, camera);
            let lit = studio.mean(1);
            studio.set(|settings| settings.show = Show::GeometricNormal);
            studio.frames(1);
            let normals = studio.display();
            studio.set(|settings| settings.show = Show::Image);
            let seen = lit.mean.iter().filter(|pixel| pixel[0] > 0.0).count();
            assert!(seen > 300, "{seen} lit pixels at scale {scale:e}");
            let wrong = lit.mean.iter().zip(&normals).filter(|(pixel, normal)| {
                let normal = 2.0 * Vec3::new(normal[0], normal[1], normal[2]) - 1.0;
                // Clearly turned to the light, and dark: it shades itself.
                normal.is_finite()
                    && (normal.length() - 1.0).abs() < 0.01
                    && -normal.dot(direction) > 0.01
                    && pixel[0] <= 0.0
            });
            assert_eq!(wrong.count(), 0, "scale {scale:e}, {:?}, inside {inside}", shape.kind);
        }
    }
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

#[test]
fn picking_finds_shapes_and_the_raster_pipeline_says_that_it_lacks_them() {
    let table_now = table(0.3);
    let mut studio = Studio::of(EXTENT, still(Pipeline::Hybrid), &table_now.scene.delta, table_now.camera);
    studio.frames(1);
    let mut found = [false; 2];
    for (x, y) in (0..EXTENT[1]).flat_map(|y| (0..EXTENT[0]).map(move |x| (x, y))).step_by(7) {
        let (renderer, view) = (&mut studio.renderer, studio.view);
        let hit = renderer.pick(&mut studio.session.frames, view, [x, y]).expect("a pick");
        if let Some(hit) = hit.filter(|hit| hit.instance == table_now.pair) {
            found[hit.geometry as usize] = true;
        }
    }
    assert_eq!(found, [true; 2], "both primitives are picked");
    studio.set(|settings| settings.pipeline = Pipeline::Raster);
    studio.frames(1);
    let left_out = studio.statistics().left_out;
    let why = left_out.iter().find(|left| left.what == "spheres and boxes").map(|left| left.why.clone());
    assert!(why.expect("a reason").contains("raster"), "{left_out:?}");
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
