//! The command line as a user and a script see it: exit codes, messages, images, the one JSON object.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::{Path, PathBuf};

use caustica_tests::models::cube;
use caustica_tests::program::{Run, caustica};
use caustica_tests::repository;
use serde_json::Value;

fn gallery() -> String {
    repository().join("projects/gallery/gallery.caustica.json").display().to_string()
}

/// The folder of shared models, if it is there.
fn shared_assets() -> Option<PathBuf> {
    let folder = repository().join("../shared/assets");
    let there = folder.is_dir();
    if !there {
        println!("skipped: {} is not there", folder.display());
    }
    there.then_some(folder)
}

fn json_of(run: &Run) -> Value {
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(run.stdout.trim().lines().count(), 1, "one object and nothing else: {}", run.stdout);
    serde_json::from_str(&run.stdout).expect("JSON on standard output")
}

/// Renders a small picture with validation on; the layer must be silent.
fn render(folder: &Path, file: &str, more: &[&str]) -> Run {
    let mut arguments = vec!["render", file, "--size", "64x48", "--validation"];
    arguments.extend(more);
    let run = caustica(folder, &arguments);
    assert!(!run.stderr.contains("validation"), "{}", run.stderr);
    run
}

#[test]
fn devices_are_listed_and_one_is_chosen() {
    let folder = tempfile::tempdir().expect("a folder");
    let devices = json_of(&caustica(folder.path(), &["devices", "--json"]));
    let chosen = devices["chosen"].as_u64().expect("a chosen device") as usize;
    let list = devices["devices"].as_array().expect("devices");
    assert_eq!(list[chosen]["suitable"], true);
    let name = list[chosen]["name"].as_str().expect("a name");
    let text = caustica(folder.path(), &["devices"]);
    assert_eq!(text.code, Some(0));
    assert!(text.stdout.contains(name) && text.stdout.contains("chosen"), "{}", text.stdout);
}

#[test]
fn the_gallery_renders_to_a_png_and_tells_what_it_did() {
    let folder = tempfile::tempdir().expect("a folder");
    let figures =
        json_of(&render(folder.path(), &gallery(), &["-o", "out/a.png", "--samples", "4", "--json"]));
    assert_eq!((&figures["samples"], &figures["size"]), (&Value::from(4), &serde_json::json!([64, 48])));
    assert_eq!(figures["non_finite_samples"], 0);
    assert_eq!((&figures["pipeline"], &figures["sampler"]), (&Value::from("hybrid"), &Value::from("sobol")));
    for key in ["device", "version", "reset_reason"] {
        assert!(figures[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {}", figures[key]);
    }
    let passes = figures["ms_per_pass"].as_object().expect("times of the passes");
    for label in ["shadow.trace", "shading.trace", "accumulate", "post"] {
        assert!(passes[label].as_f64().is_some_and(|ms| ms > 0.0), "{label} in {passes:?}");
    }
    assert!(figures["acceleration_structures"]["blas_count"].as_u64().is_some_and(|n| n > 5));
    assert!(figures["memory_bytes"]["geometry"].as_u64().is_some_and(|n| n > 1000));
    let left_out = figures["left_out"].as_array().expect("what was left out");
    assert!(left_out.iter().all(|entry| entry["what"].is_string() && entry["why"].is_string()));

    let picture = image::open(folder.path().join("out/a.png")).expect("the PNG").to_rgb8();
    assert_eq!(picture.dimensions(), (64, 48));
    let mean = picture.pixels().flat_map(|p| p.0).map(f64::from).sum::<f64>() / (64.0 * 48.0 * 3.0);
    assert!((20.0..235.0).contains(&mean), "mean byte {mean}");
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = |name: &str, more: &[&str]| {
        let mut arguments = vec!["-o", name, "--samples", "3"];
        arguments.extend(more);
        assert_eq!(render(folder.path(), &gallery(), &arguments).code, Some(0));
        std::fs::read(folder.path().join(name)).expect("an image")
    };
    let first = bytes("a.png", &[]);
    assert_eq!(first, bytes("b.png", &[]));
    assert_ne!(first, bytes("c.png", &["--seed", "5"]));
    for sampler in ["halton", "hammersley", "independent", "blue-noise"] {
        let other = bytes("d.png", &["--sampler", sampler]);
        assert!(other != first && other == bytes("e.png", &["--sampler", sampler]), "{sampler}");
    }
    let json = &["-o", "f.png", "--samples", "1", "--sampler", "blue-noise", "--json"];
    assert_eq!(json_of(&render(folder.path(), &gallery(), json))["sampler"], "blue-noise");
    assert_eq!(render(folder.path(), &gallery(), &["-o", "g.png", "--sampler", "white"]).code, Some(2));
}

#[test]
fn a_time_of_an_animation_can_be_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, animated) in [("moves.gltf", true), ("stands.gltf", false)] {
        std::fs::write(folder.path().join(name), cube(animated)).expect("a model on disk");
    }
    let bytes = |at: &[&str]| {
        let run = render(folder.path(), "moves.gltf", &[&["-o", "a.png", "--samples", "2"], at].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        std::fs::read(folder.path().join("a.png")).expect("an image")
    };
    let (rest, later) = (bytes(&[]), bytes(&["--at", "1"]));
    assert!(rest == bytes(&["--at", "0"]), "the clip starts where the cube rests");
    assert!(rest != later, "after a second it is elsewhere");
    assert!(later == bytes(&["--at", "3"]), "the clip of two seconds has begun again");

    let json = &["-o", "a.png", "--samples", "1", "--at", "0.5", "--json"];
    let figures = json_of(&render(folder.path(), "moves.gltf", json));
    assert_eq!((&figures["at"], &figures["device_profile"]), (&Value::from(0.5), &Value::from("default")));
    assert!(figures["acceleration_structures"]["total_tlas_built"].as_u64().is_some_and(|n| n > 0));

    let run = render(folder.path(), "stands.gltf", &["-o", "b.png", "--at", "1"]);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stderr.contains("stands.gltf") && run.stderr.contains("--at"), "{}", run.stderr);
    let run = render(folder.path(), "moves.gltf", &["-o", "b.png", "--at=-1"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
}

#[test]
fn a_model_is_exported_and_checked_as_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("moves.gltf"), cube(true)).expect("a model on disk");
    let figures = json_of(&caustica(folder.path(), &["export", "moves.gltf", "-o", "out.glb", "--json"]));
    assert_eq!(
        (&figures["files"], &figures["warnings"]),
        (&serde_json::json!(["out.glb"]), &serde_json::json!([]))
    );
    let check = |name: &str| {
        let mut figures = json_of(&caustica(folder.path(), &["check", name, "--json"]));
        figures.as_object_mut().expect("an object").remove("file");
        figures
    };
    assert_eq!(check("moves.gltf"), check("out.glb"));
    let run = caustica(folder.path(), &["export", "moves.gltf", "-o", "out.gltf"]);
    assert!(run.code == Some(0) && folder.path().join("out.bin").is_file(), "{}", run.stderr);

    for (output, code, reason) in [
        ("out.obj", 2, ".glb or .gltf"),
        ("moves.gltf", 1, "is a source"),
        ("new/folder/a.glb", 0, ""),
        ("out.bin/a.glb", 1, "out.bin: File exists"),
    ] {
        let run = caustica(folder.path(), &["export", "moves.gltf", "-o", output]);
        assert!(run.code == Some(code) && run.stderr.contains(reason), "{:?} {}", run.code, run.stderr);
    }
}

/// Reads an EXR written by the program: pixels and attributes as text.
fn read_exr(path: &Path) -> (Vec<[f32; 3]>, String) {
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0_f32; 3]; size.width() * size.height()]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .expect("the EXR");
    let attributes = format!("{:?}", image.layer_data.attributes);
    (image.layer_data.channel_data.pixels.1, attributes)
}

#[test]
fn a_variant_of_materials_is_chosen_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut model: Value = serde_json::from_str(&cube(false)).expect("JSON");
    let unlit = |rgba: [f32; 4]| serde_json::json!({"pbrMetallicRoughness": {"baseColorFactor": rgba}, "extensions": {"KHR_materials_unlit": {}}});
    model["materials"] = serde_json::json!([unlit([1.0, 0.0, 0.0, 1.0]), unlit([0.0, 1.0, 0.0, 1.0])]);
    model["extensions"] = serde_json::json!({"KHR_materials_variants": {"variants": [{"name": "green"}]}});
    model["extensionsUsed"] = serde_json::json!(["KHR_materials_unlit", "KHR_materials_variants"]);
    let primitive = &mut model["meshes"][0]["primitives"][0];
    primitive["material"] = Value::from(0);
    primitive["extensions"] =
        serde_json::json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}});
    std::fs::write(folder.path().join("cube.gltf"), model.to_string()).expect("a file");
    let middle = |more: &[&str]| {
        let run = render(folder.path(), "cube.gltf", &[&["-o", "a.png", "--samples", "2"], more].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        image::open(folder.path().join("a.png")).expect("the PNG").to_rgb8().get_pixel(32, 24).0
    };
    let ([red, ..], [_, green, _]) = (middle(&[]), middle(&["--variant", "green"]));
    assert!(red > 200 && green > 200, "{red} {green}");
    let run = render(folder.path(), "cube.gltf", &["-o", "a.png", "--variant", "blue"]);
    assert!(
        run.code == Some(1) && run.stderr.contains("no variant 'blue'; there is: green"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_scene_is_chosen_by_name_or_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut model: Value = serde_json::from_str(&cube(false)).expect("JSON");
    model["scenes"] =
        serde_json::json!([{"name": "full", "nodes": model["scenes"][0]["nodes"]}, {"nodes": []}]);
    for scene in [0, 1] {
        let radiance = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][scene];
        model["scenes"][scene]["extras"] = serde_json::json!({"environment": {"constantRadiance": radiance}});
    }
    std::fs::write(folder.path().join("cube.gltf"), model.to_string()).expect("a file");
    let corner = |more: &[&str]| {
        let run = render(folder.path(), "cube.gltf", &[&["-o", "a.png", "--samples", "2"], more].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        image::open(folder.path().join("a.png")).expect("the PNG").to_rgb8().get_pixel(0, 0).0
    };
    let is_green = |[red, green, _]: [u8; 3]| green > 150 && red < 50;
    let is_red = |[red, green, _]: [u8; 3]| red > 150 && green < 50;
    assert!(is_red(corner(&[])) && is_red(corner(&["--scene", "full"])) && is_red(corner(&["--scene", "1"])));
    assert!(is_green(corner(&["--scene", "scene 2"])) && is_green(corner(&["--scene", "2"])));
    let run = render(folder.path(), "cube.gltf", &["-o", "a.png", "--scene", "night"]);
    assert!(
        run.code == Some(1) && run.stderr.contains("no scene 'night'; there is: full, scene 2"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_picture_takes_the_place_of_no_source() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("cube.gltf"), cube(false)).expect("a file");
    let sky = folder.path().join("sky.exr");
    image::Rgb32FImage::from_pixel(4, 2, image::Rgb([0.5, 1.0, 2.0])).save(&sky).expect("a map");
    let before = std::fs::read(&sky).expect("the map");
    let arguments = ["-o", "sky.exr", "--samples", "1", "--environment", "sky.exr"];
    let run = render(folder.path(), "cube.gltf", &arguments);
    assert!(
        run.code == Some(1) && run.stderr.contains("sky.exr: is a source of this scene"),
        "{}",
        run.stderr
    );
    assert_eq!(std::fs::read(&sky).expect("the map"), before);
}

#[test]
fn an_exr_holds_radiance_and_its_origin() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = render(folder.path(), &gallery(), &["-o", "a.exr", "--samples", "6", "--exposure", "3"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let (whole, attributes) = read_exr(&folder.path().join("a.exr"));
    assert_eq!(whole.len(), 64 * 48);
    for word in ["caustica.samples", "caustica.seconds", "caustica.device", "software_name"] {
        assert!(attributes.contains(word), "{word} in {attributes}");
    }
    // Two halves of the sample set have the mean of the whole; exposure changes nothing in an EXR.
    let mut halves = Vec::new();
    for offset in ["0", "3"] {
        let run =
            render(folder.path(), &gallery(), &["-o", "b.exr", "--samples", "3", "--sample-offset", offset]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        halves.push(read_exr(&folder.path().join("b.exr")).0);
    }
    for (i, pixel) in whole.iter().enumerate() {
        for channel in 0..3 {
            let mean = 0.5 * (halves[0][i][channel] + halves[1][i][channel]);
            let difference = (pixel[channel] - mean).abs();
            assert!(difference <= 1e-5 * mean.abs() + 1e-7, "pixel {i}: {} {mean}", pixel[channel]);
        }
    }
}

#[test]
fn every_pipeline_and_target_can_be_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    for pipeline in ["raster", "hybrid", "raytraced"] {
        let arguments = ["-o", "a.png", "--samples", "1", "--pipeline", pipeline, "--json"];
        assert_eq!(json_of(&render(folder.path(), &gallery(), &arguments))["pipeline"], pipeline);
    }
    let all = json_of(&render(
        folder.path(),
        &gallery(),
        &["-o", "a.png", "--samples", "1", "--needs", "all", "--json"],
    ));
    let auto = json_of(&render(folder.path(), &gallery(), &["-o", "b.png", "--samples", "1", "--json"]));
    let count = |figures: &Value| figures["left_out"].as_array().map_or(0, Vec::len);
    assert!(count(&all) <= count(&auto));
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("an image");
    assert_eq!(bytes("a.png"), bytes("b.png"), "what is not needed changes no pixel");
    for target in ["base_color", "normal", "depth"] {
        let run = render(folder.path(), &gallery(), &["-o", "c.png", "--samples", "1", "--show", target]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert_ne!(bytes("c.png"), bytes("a.png"), "{target}");
    }
}

#[test]
fn what_has_no_effect_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("far.obj"), "v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 1 2 3\n")
        .expect("a model");
    let warning = |arguments: &[&str]| {
        let run = render(folder.path(), "far.obj", &[&["-o", "a.png", "--samples", "1"], arguments].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        run.stderr.lines().find_map(|line| Some(line.split_once("without effect: ")?.1.to_owned()))
    };
    for (arguments, named) in [
        (["--pipeline", "path", "--show", "direct_diffuse"], Some("--show")),
        (["--pipeline", "path", "--show", "direct_specular"], Some("--show")),
        (["--pipeline", "hybrid", "--show", "direct_diffuse"], None),
        (["--pipeline", "raster", "--show", "ray_depth"], Some("--show")),
        (["--pipeline", "raster", "--max-depth", "3"], Some("--max-depth")),
        (["--pipeline", "raster", "--max-depth", "0"], None),
        (["--pipeline", "path", "--max-depth", "3"], None),
    ] {
        let found = warning(&arguments);
        let named_alone = found.as_deref().zip(named).is_some_and(|(found, named)| found.starts_with(named));
        assert!(named_alone || found.is_none() && named.is_none(), "{arguments:?}: {found:?}");
    }
}

#[test]
fn the_shadow_of_a_light_is_chosen_by_name_or_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let shot = |output: &str, light: &[&str]| {
        let mut args = vec!["-o", output, "--samples", "1", "--show", "shadow"];
        args.extend(light);
        render(folder.path(), &gallery(), &args)
    };
    for (output, light) in [("1.png", "1"), ("2.png", "2"), ("sun.png", "Sun")] {
        let run = shot(output, &["--show-light", light]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
    }
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("an image");
    assert_ne!(bytes("1.png"), bytes("2.png"));
    assert!(bytes("sun.png") == bytes("1.png") || bytes("sun.png") == bytes("2.png"));
    for unknown in ["Moon", "0", "99"] {
        let run = shot("no.png", &["--show-light", unknown]);
        assert_eq!(run.code, Some(1), "{unknown}");
        assert!(run.stderr.contains("Sun"), "the message names those that there are: {}", run.stderr);
    }
}

#[test]
fn a_constant_environment_comes_from_the_command_line() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("far.obj"), "v 0 0 -1e3\nv 1e-3 0 -1e3\nv 0 1e-3 -1e3\nf 1 2 3\n")
        .expect("a model");
    let run =
        render(folder.path(), "far.obj", &["-o", "a.exr", "--samples", "1", "--environment", "0.25,0.5,2"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let (pixels, _) = read_exr(&folder.path().join("a.exr"));
    assert_eq!(pixels[0], [0.25, 0.5, 2.0]);
}

#[test]
fn faults_of_the_input_end_with_1_and_name_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("broken.gltf"), "{ \"asset\": ").expect("a file");
    std::fs::write(folder.path().join("text.xyz"), "nothing").expect("a file");
    for file in ["missing.glb", "broken.gltf", "text.xyz"] {
        let run =
            caustica(folder.path(), &["render", file, "-o", "a.png", "--size", "16x16", "--samples", "1"]);
        assert_eq!(run.code, Some(1), "{file}: {}", run.stderr);
        assert!(run.stderr.contains(file), "{file} in: {}", run.stderr);
        assert!(run.stdout.is_empty() && !folder.path().join("a.png").exists());
    }
    let check = caustica(folder.path(), &["check", "broken.gltf"]);
    assert_eq!(check.code, Some(1), "{}{}", check.stdout, check.stderr);
}

#[test]
fn wrong_usage_ends_with_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let gallery = gallery();
    for arguments in [
        vec!["render"],
        vec!["render", &gallery],
        vec!["render", &gallery, "-o", "a.jpg"],
        vec!["render", &gallery, "-o", "a.png", "--size", "0x10"],
        vec!["render", &gallery, "-o", "a.png", "--samples", "0"],
        vec!["render", &gallery, "-o", "a.png", "--pipeline", "magic"],
        vec!["render", &gallery, "-o", "a.png", "--samples", "3", "--time", "0"],
        vec!["--nonsense"],
        vec!["render", &gallery, "-o", "a.png", "--memory-budget", "0"],
        vec!["--memory-budget", "much"],
    ] {
        let run = caustica(folder.path(), &arguments);
        assert_eq!(run.code, Some(2), "{arguments:?}: {}", run.stderr);
        assert!(run.stdout.is_empty());
    }
    for (size, words) in [("160x", "expected WIDTHxHEIGHT"), ("1.5x2", "'1.5' is no number of pixels")] {
        let run = caustica(folder.path(), &["render", &gallery, "-o", "a.png", "--size", size]);
        assert!(run.code == Some(2) && run.stderr.contains(words), "{}", run.stderr);
    }
    let nothing = caustica(folder.path(), &["--memory-budget", "0", "devices"]).stderr;
    let first = nothing.lines().next().unwrap_or_default();
    assert!(first.contains("--memory-budget") && first.contains("give at least 1"), "{nothing}");
    let help = caustica(folder.path(), &["--help"]);
    assert_eq!(help.code, Some(0));
    assert!(help.stdout.contains("render"));
}

#[test]
fn faults_of_the_device_end_with_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let gallery = gallery();
    let common = ["render", &gallery, "-o", "a.png", "--size", "64x48", "--samples", "1"];
    let run = caustica(folder.path(), &[&common[..], &["--device", "no such device"]].concat());
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(run.stderr.contains("no suitable Vulkan device"), "{}", run.stderr);
    let run = caustica(folder.path(), &[&common[..], &["--memory-budget", "16"]].concat());
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(run.stderr.contains("out of device memory"), "{}", run.stderr);
    // A size that fits is named however small it is.
    std::fs::write(folder.path().join("cube.gltf"), cube(false)).expect("a file");
    let large = ["render", "cube.gltf", "-o", "a.png", "--size", "8000x8000", "--memory-budget", "64"];
    let run = caustica(folder.path(), &large);
    assert!(run.stderr.contains("has room, as would --memory-budget"), "{}", run.stderr);
}

#[test]
fn check_accepts_the_demo() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = caustica(folder.path(), &["check", &gallery()]);
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    let run = caustica(folder.path(), &["check", &gallery(), "--json"]);
    assert_eq!(json_of(&run)["errors"], 0);
}

#[test]
fn check_of_several_files_goes_on_after_a_bad_one() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("broken.obj"), "v 0 0 x").expect("a file");
    std::fs::write(folder.path().join("good.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").expect("a file");
    let run = caustica(folder.path(), &["check", "broken.obj", "good.obj", "--json"]);
    assert_eq!(run.code, Some(1), "{}{}", run.stdout, run.stderr);
    let report: Value = serde_json::from_str(&run.stdout).expect("JSON on standard output");
    assert_eq!(report["files_with_errors"], 1);
    let error = report["files"][0]["error"].as_str().unwrap_or_default();
    assert!(error.contains("broken.obj: line 1: \"x\" is not a number"), "{error}");
    assert_eq!((&report["files"][1]["triangles"], &report["files"][1]["errors"]), (&1.into(), &0.into()));
    assert!(report["files"][1]["milliseconds"].is_number());
    let run = caustica(folder.path(), &["check", "good.obj", "good.obj"]);
    assert_eq!((run.code, run.stdout.lines().count()), (Some(0), 3), "{}", run.stdout);
}

#[test]
fn settings_of_a_project_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = r#"{"caustica":2,"render":{"pipeline":"nonsense","max_depth":-5},"view":{"exposure":"x"}}"#;
    std::fs::write(folder.path().join("p.caustica.json"), text).expect("a file");
    let run = caustica(folder.path(), &["check", "p.caustica.json", "--json"]);
    let said = json_of(&run)["import_warnings"].to_string();
    for place in ["/render/pipeline", "/render/max_depth", "/view/exposure"] {
        assert!(said.contains(&format!("p.caustica.json: {place}: ")), "{said}");
    }
}

#[test]
fn models_of_other_hands_render() {
    let Some(assets) = shared_assets() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    for model in
        ["Box", "BoxTextured", "SimpleSparseAccessor", "NegativeScaleTest", "TransmissionTest", "CornellBox"]
    {
        let Some(file) = model_file(&assets.join("gltf").join(model)) else {
            println!("skipped: no {model}");
            continue;
        };
        let run =
            render(folder.path(), &file.display().to_string(), &["-o", "a.png", "--samples", "1", "--json"]);
        assert_eq!(json_of(&run)["non_finite_samples"], 0, "{model}");
    }
}

/// The first model file below a folder.
fn model_file(folder: &Path) -> Option<PathBuf> {
    let mut waiting = vec![folder.to_owned()];
    let mut found = Vec::new();
    while let Some(next) = waiting.pop() {
        for entry in std::fs::read_dir(next).ok()?.flatten() {
            let path = entry.path();
            if path.is_dir() {
                waiting.push(path);
            } else if path.extension().is_some_and(|ending| ending == "gltf" || ending == "glb") {
                found.push(path);
            }
        }
    }
    found.sort();
    found.into_iter().next()
}
