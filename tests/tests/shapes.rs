//! Spheres and boxes without triangles, drawn and met by rays: against fine triangle meshes, from inside, through glass, moved,
//! stretched, at every scale.

use caustica_renderer::delta::{AlphaMode, Camera, Light, Material, Mesh, SceneDelta, Shape};
use caustica_renderer::{Accumulated, Pipeline, Show, ViewSettings};
use caustica_tests::picture::{differing, mean_of};
use caustica_tests::scene::{
    Scene, camera_at, camera_parallel, checker, cube, glass, lambert, mirror, plain_use, point_light, quad,
    sphere,
};
use caustica_tests::shapes::{at, ball, block, mesh_of};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Mat3, Quat, Vec3};

const EXTENT: [u32; 2] = [96, 64];
const PIPELINES: [Pipeline; 3] = [Pipeline::Raster, Pipeline::Hybrid, Pipeline::Raytraced];

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
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
    for pipeline in PIPELINES {
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
    for pipeline in PIPELINES {
        let image = |left: Mesh, right: Mesh, right_at: Affine3A| {
            let mut scene = Scene::new();
            let mut paint = checker(2, 10, 250);
            for (index, texel) in std::sync::Arc::make_mut(&mut paint.rgba8).chunks_exact_mut(4).enumerate() {
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
    for pipeline in PIPELINES {
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
    for pipeline in PIPELINES {
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
    for pipeline in PIPELINES {
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
    for pipeline in PIPELINES {
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
