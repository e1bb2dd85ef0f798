//! What is in device memory: a prefab that is placed again takes none, and of textures that do not fit those that are seen
//! least go without their largest levels.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::fmt::Write as _;
use std::path::Path;

use caustica::session::{Session, SessionOptions, load};
use caustica_gpu::MemoryUse;
use caustica_renderer::delta::{Camera, InstanceId, Material, SceneDelta, Texture, TextureId};
use caustica_renderer::{Pipeline, ViewSettings};
use caustica_tests::picture::mean_of;
use caustica_tests::program::caustica;
use caustica_tests::scene::{Scene, camera_at, checker, plain_use, quad, unlit};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const MIB: u64 = 1 << 20;
/// Each takes 4 MiB, 5.3 with its levels.
const SIDE: u32 = 1024;
const COUNT: usize = 8;

/// A row of squares that goes away from the camera, each with a texture of its own.
fn row() -> (Scene, Vec<(InstanceId, TextureId)>) {
    let mut scene = Scene::new();
    let square = scene.mesh(quad(1.0, 1.0));
    let add = |index: usize| {
        let texture =
            scene.texture(Texture { name: format!("checks {index}"), ..checker(SIDE / 8, 20, 200) });
        let material = Material { base_color_texture: Some(plain_use(texture)), ..unlit(Vec3::ONE) };
        let material = scene.material(material);
        let place = Affine3A::from_translation(Vec3::new(1.2 * index as f32, 0.0, -2.0 * index as f32));
        (scene.place(square, material, place), texture)
    };
    let placed = (0..COUNT).map(add).collect();
    (scene, placed)
}

/// Close to one of them: its texels are larger than the pixels.
fn camera(index: usize) -> Camera {
    let at = Vec3::new(1.2 * index as f32, 0.0, -2.0 * index as f32);
    camera_at(at + Vec3::new(0.0, 0.0, 0.2), at, 0.8)
}

fn textures_mib(studio: &Studio) -> f64 {
    let memory = studio.session.device.memory_by_use();
    let bytes = memory.iter().find(|(kind, _)| *kind == MemoryUse::Textures).map_or(0, |(_, bytes)| *bytes);
    bytes as f64 / MIB as f64
}

fn settle(studio: &mut Studio) {
    studio.frames(1);
    let mut frames = 0;
    while studio.renderer.textures_settle() {
        studio.frames(1);
        frames += 1;
        assert!(frames < 200, "the textures never come to rest");
    }
    // What was replaced is freed.
    studio.frames(4);
}

/// Mean brightness, and how much neighbouring pixels differ in the middle: checks of 8 texels are sharp, their lower levels
/// are not.
fn brightness_and_contrast(studio: &mut Studio, samples: u64) -> (f32, f32) {
    let image = studio.mean(samples);
    let [width, height] = image.extent.map(|side| side as usize);
    let middle = |x: usize, y: usize| image.mean[y * width + x][0];
    let rows = height * 3 / 8..height * 5 / 8;
    let columns = width * 3 / 8..width * 5 / 8;
    let pairs = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    let differences: Vec<f32> = pairs.map(|(x, y)| (middle(x, y) - middle(x + 1, y)).abs()).collect();
    (mean_of(&image), differences.iter().sum::<f32>() / differences.len() as f32)
}

#[test]
fn what_is_seen_least_goes_without_levels_and_they_come_back() {
    let settings = ViewSettings { pipeline: Pipeline::Raster, ..ViewSettings::default() };
    let extent = [128, 128];
    let (scene, placed) = row();
    let mut roomy = Studio::of(extent, settings.clone(), &scene.delta, camera(0));
    let (brightness, sharp) = brightness_and_contrast(&mut roomy, 16);
    let whole = textures_mib(&roomy);
    assert!(whole > 5.3 * COUNT as f64, "{whole}");
    drop(roomy);

    let mut studio = Studio::within(40 * MIB, extent, settings);
    studio.view_mut().set_camera(camera(0));
    studio.apply(&scene.delta);
    settle(&mut studio);
    let (mean, near) = brightness_and_contrast(&mut studio, 16);
    let used = textures_mib(&studio);
    println!("contrast of the nearest {near:.4}, whole {sharp:.4}; {used:.1} of {whole:.1} MiB");
    assert!(used < 24.0 && near > 0.95 * sharp);
    assert!((mean - brightness).abs() < 0.01 * brightness, "levels keep their light: {mean}, {brightness}");
    studio.frames(50);
    assert_eq!(textures_mib(&studio), used, "memory is steady");

    // The last of the row comes into sight.
    let last = COUNT - 1;
    studio.view_mut().set_camera(camera(last));
    studio.frames(1);
    // Too soon for anything to come back.
    let (_, before) = brightness_and_contrast(&mut studio, 1);
    settle(&mut studio);
    let (_, after) = brightness_and_contrast(&mut studio, 16);
    println!("contrast of the last one before {before:.4} and after {after:.4}");
    assert!(after > 0.95 * sharp && before < 0.7 * sharp && textures_mib(&studio) < 24.0);

    // What goes makes room for the others.
    let gone = SceneDelta {
        removed_instances: placed[..6].iter().map(|(instance, _)| *instance).collect(),
        removed_textures: placed[..6].iter().map(|(_, texture)| *texture).collect(),
        reason: String::from("removed six"),
        ..SceneDelta::default()
    };
    studio.frame(&gone);
    settle(&mut studio);
    let two = textures_mib(&studio);
    assert!((two - 2.0 * whole / COUNT as f64).abs() < 0.5, "the two that are left are whole: {two}");
}

/// Bytes of geometry, textures and acceleration structures once everything has come to rest.
fn bytes_of(session: &mut Session) -> [u64; 3] {
    for _ in 0..8 {
        let recorder = session.begin_frame([32, 32]).expect("a frame");
        session.submit(recorder, None).expect("a submission");
    }
    let memory = session.device().memory_by_use();
    let bytes = |wanted| memory.iter().find(|(kind, _)| *kind == wanted).map_or(0, |(_, bytes)| *bytes);
    [MemoryUse::Geometry, MemoryUse::Textures, MemoryUse::AccelerationStructures].map(bytes)
}

#[test]
fn a_prefab_placed_again_takes_no_memory_and_a_unique_one_its_own() {
    let gpu = caustica_tests::gpu::session();
    let settings = ViewSettings { pipeline: Pipeline::Raytraced, ..ViewSettings::default() };
    let options = SessionOptions { settings, extent: [32, 32], ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    let path = caustica_tests::repository().join("projects/gallery/gallery.caustica.json");
    session.open(&path, load(&path, false, &|_, _| {}).expect("the gallery")).expect("a scene");
    let vase = session.document().nodes().find(|(_, node)| node.name == "Painted vase").expect("the vase").0;
    let before = bytes_of(&mut session);
    for _ in 0..50 {
        session.edit_with(|document| document.duplicate_edit(vase).expect("a copy")).expect("an edit");
    }
    let placed = bytes_of(&mut session);
    println!("[geometry, textures, structures]: {before:?}, with 50 more vases {placed:?}");
    assert_eq!(placed[..2], before[..2]);
    assert!(placed[2] - before[2] < 64 << 10, "the top level alone holds 50 more references");
    session.make_unique(vase).expect("a copy of the prefab");
    let unique = bytes_of(&mut session);
    println!("and one of them unique {unique:?}");
    assert!(unique[0] > placed[0] && unique[2] > placed[2]);
    session.undo();
    assert_eq!(bytes_of(&mut session)[..2], before[..2], "what is gone takes nothing");
}

/// 16 textures of 16 MiB each.
fn write_wall(folder: &Path) -> String {
    const SIDE: u32 = 2048;
    let mut images = String::new();
    let (mut materials, mut meshes, mut nodes) = (String::new(), String::new(), String::new());
    for i in 0..16 {
        let checks = |x: u32, y: u32| {
            if (x / 64 + y / 64).is_multiple_of(2) { [200, 80, 10 * i as u8] } else { [40, 40, 160] }
        };
        let image = image::RgbImage::from_fn(SIDE, SIDE, |x, y| image::Rgb(checks(x, y)));
        image.save(folder.join(format!("{i}.png"))).expect("an image");
        let comma = if i == 0 { "" } else { "," };
        let (x, y) = (i % 4, i / 4);
        _ = write!(images, r#"{comma}{{"uri":"{i}.png"}}"#);
        _ = write!(materials, r#"{comma}{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#);
        _ = write!(
            meshes,
            r#"{comma}{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":{i}}}]}}"#
        );
        _ = write!(nodes, r#"{comma}{{"mesh":{i},"translation":[{x},{y},0]}}"#);
    }
    let textures = (0..16).map(|i| format!(r#"{{"source":{i}}}"#)).collect::<Vec<_>>().join(",");
    let all = (0..16).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    // Three corners, then their texture coordinates.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/";
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{all}]}}],"nodes":[{nodes}],"meshes":[{meshes}],
        "materials":[{materials}],"textures":[{textures}],"images":[{images}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
          {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC2"}}],
        "bufferViews":[{{"buffer":0,"byteLength":60}}],
        "buffers":[{{"byteLength":60,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#
    );
    std::fs::write(folder.join("wall.gltf"), text).expect("a file");
    folder.join("wall.gltf").display().to_string()
}

#[test]
fn textures_of_256_mib_are_shown_in_64() {
    let folder = tempfile::tempdir().expect("a folder");
    let wall = write_wall(folder.path());
    let run = |output: &str, samples: &str, budget: &str| {
        let common = ["render", &wall, "--size", "96x96", "--validation", "--json", "--pipeline", "hybrid"];
        let more = ["-o", output, "--samples", samples, "--memory-budget", budget];
        let run = caustica(folder.path(), &[&common[..], &more].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(!run.stderr.contains("validation"), "{}", run.stderr);
        let figures: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
        let memory: u64 =
            figures["memory_bytes"].as_object().expect("memory").values().filter_map(|v| v.as_u64()).sum();
        (run.stderr, figures["samples"].as_u64(), memory)
    };
    let (quiet, _, all) = run("whole.png", "8", "1024");
    assert!(!quiet.contains("levels") && all > 300 * MIB, "{quiet}");
    let (told, samples, used) = run("little.png", "8", "64");
    assert!(told.contains("of 16 textures are shown without their largest levels"), "{told}");
    assert!(used <= 64 * MIB && samples == Some(8), "{used} {samples:?}");
    let (_, samples, later) = run("later.png", "64", "64");
    assert_eq!((samples, later), (Some(64), used), "memory is steady");
    let picture = |name: &str| image::open(folder.path().join(name)).expect("a picture").to_rgb8();
    let (whole, little) = (picture("whole.png"), picture("little.png"));
    let (difference, _) = caustica_tests::picture::difference(&whole, &little, 3);
    assert!(difference < 0.02, "{difference} of the bytes differ by more than 3");
}
