//! Damaged skins, morph targets and clips: what cannot be read is refused by place, what the rest does not need is
//! left out with a warning.

use caustica_scene::import::{ImportOptions, load};
use serde_json::{Value, json};

use crate::common::assert_sound;
use crate::gltf_file::{Data, GltfFile};
use crate::rig_import::rig;

/// Imports the rig after a change and returns the skin of its body, its number of channels and its warnings.
fn damaged(change: impl FnOnce(&mut GltfFile)) -> Result<(Option<u32>, usize, String), String> {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    change(&mut file);
    let path = file.write(folder.path());
    let imported = load(&path, &ImportOptions::default()).map_err(|error| error.to_string())?;
    assert_sound(&path, &imported);
    let channels = imported.prefab.animations.iter().map(|clip| clip.channels.len()).sum();
    let warnings: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    Ok((imported.prefab.nodes()[0].skin, channels, warnings.join("\n")))
}

#[test]
fn a_sound_rig_has_nothing_to_complain_about() {
    assert_eq!(damaged(|_| {}), Ok((Some(0), 1, String::new())));
}

#[test]
fn skins_that_do_not_fit_are_refused_by_place() {
    let refused = |change: &dyn Fn(&mut GltfFile), words: &[&str]| {
        let error = damaged(change).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    refused(&|f| f.json["skins"][0]["joints"] = json!([1]), &["/nodes/0", "joint 1", "has 1"]);
    refused(&|f| f.json["skins"][0]["joints"] = json!([1, 9]), &["/skins/0/joints/1", "no node 9"]);
    refused(
        &|f| {
            let one = f.floats("MAT4", 16, &[0.0; 16]);
            f.json["skins"][0]["inverseBindMatrices"] = json!(one);
        },
        &["/skins/0/inverseBindMatrices", "1 matrices for 2"],
    );
    refused(
        &|f| f.json["skins"][0]["inverseBindMatrices"] = json!(0),
        &["/skins/0/inverseBindMatrices", "4 x 4"],
    );
    refused(
        &|f| {
            let floats = f.floats("VEC4", 4, &[0.0; 24]);
            f.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(floats);
        },
        &["/meshes/0/primitives/0/attributes/JOINTS_0", "wrong type"],
    );
    refused(
        &|f| {
            let short = f.floats("VEC4", 4, &[1.0; 8]);
            f.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(short);
        },
        &["/meshes/0/primitives/0/attributes/WEIGHTS_0", "2 elements, POSITION has 6"],
    );
    refused(
        &|f| {
            let short = f.floats("VEC3", 3, &[0.0; 9]);
            f.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": short}]);
        },
        &["/meshes/0/primitives/0/targets/0/POSITION", "3 elements"],
    );
}

#[test]
fn skins_that_cannot_bend_are_left_out_with_a_warning() {
    let nan = damaged(|f| {
        let matrices = f.floats("MAT4", 16, &[f32::NAN; 32]);
        f.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
    });
    let (skin, channels, warnings) = nan.unwrap();
    assert_eq!((skin, channels), (None, 1));
    assert!(
        warnings.contains("/skins/0/inverseBindMatrices") && warnings.contains("not finite"),
        "{warnings}"
    );
    let outside = damaged(|f| f.json["scenes"] = json!([{"nodes": [0]}])).unwrap();
    assert_eq!((outside.0, outside.1), (Some(0), 1), "a joint that no scene has bends too: {}", outside.2);
    let bare = damaged(|f| {
        f.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0");
    });
    let (skin, _, warnings) = bare.unwrap();
    assert_eq!(skin, None);
    assert!(
        warnings.contains("JOINTS_0 and WEIGHTS_0 go together") && warnings.contains("its skin was left out")
    );
}

#[test]
fn channels_that_cannot_be_played_are_left_out_with_a_warning() {
    let left_out = |change: &dyn Fn(&mut GltfFile), word: &str| {
        let (skin, channels, warnings) = damaged(change).unwrap();
        assert_eq!((skin, channels), (Some(0), 0), "{word}");
        assert!(warnings.contains("/animations/0/channels/0") && warnings.contains(word), "{warnings}");
    };
    let set = |f: &mut GltfFile, what: &str, accessor: usize| {
        f.json["animations"][0]["samplers"][0][what] = json!(accessor);
    };
    for times in [[1.0, 0.5], [1.0, 1.0], [0.0, f32::NAN], [f32::NEG_INFINITY, 0.0]] {
        left_out(
            &|f| {
                let times = f.floats("SCALAR", 1, &times);
                set(f, "input", times);
            },
            "do not grow",
        );
    }
    left_out(
        &|f| {
            let times = f.floats("SCALAR", 1, &[0.0, 1.0, 2.0]);
            set(f, "input", times);
        },
        "6 numbers for 3 keys of 3",
    );
    left_out(
        &|f| {
            let times = f.accessor("SCALAR", 2, false, Data::U8(&[0, 1]));
            set(f, "input", times);
        },
        "no single floats",
    );
    left_out(
        &|f| {
            let values = f.floats("VEC3", 3, &[0.0, f32::INFINITY, 0.0, 0.0, 0.0, 0.0]);
            set(f, "output", values);
        },
        "not finite",
    );
    left_out(
        &|f| f.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE"),
        "keys of 9",
    );
    left_out(&|f| f.json["animations"][0]["samplers"][0]["interpolation"] = json!("SMOOTH"), "SMOOTH");
    left_out(&|f| f.json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation"), "wrong type");
    left_out(&|f| f.json["animations"][0]["channels"][0]["target"]["path"] = json!("colour"), "colour");
    left_out(
        &|f| {
            f.json["animations"][0]["channels"][0]["target"] = json!({"path": "pointer", "extensions":
            {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}})
        },
        "no such property",
    );
    left_out(
        &|f| {
            let values = f.floats("VEC4", 4, &[0.0; 8]);
            set(f, "output", values);
            f.json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation");
        },
        "length 0",
    );
    left_out(
        &|f| {
            let values = f.floats("SCALAR", 1, &[0.0; 2]);
            set(f, "output", values);
            f.json["animations"][0]["channels"][0]["target"] = json!({"node": 0, "path": "weights"});
        },
        "no morph targets",
    );
    // A channel without a node moves nothing and is nothing to speak of; of two that move the same one is left.
    let none = damaged(|f| f.json["animations"][0]["channels"][0]["target"] = json!({"path": "scale"}));
    assert_eq!(none, Ok((Some(0), 0, String::new())));
    let twice = damaged(|f| {
        let channel = f.json["animations"][0]["channels"][0].clone();
        f.json["animations"][0]["channels"].as_array_mut().unwrap().push(channel);
    });
    let (_, channels, warnings) = twice.unwrap();
    assert_eq!(channels, 1);
    assert!(warnings.contains("/animations/0/channels/1"), "{warnings}");
}

#[test]
fn targets_without_data_do_not_fill_the_memory() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = GltfFile::new();
    // Every accessor may stand for 16 million zeros without a byte behind it.
    let empty = file.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 1 << 24}));
    let targets: Vec<Value> = (0..1000).map(|_| json!({"POSITION": empty})).collect();
    let primitive = json!({"attributes": {"POSITION": empty}, "targets": targets});
    file.push("meshes", json!({"primitives": [primitive]}));
    let error = load(&file.write(folder.path()), &ImportOptions::default()).unwrap_err();
    assert!(error.reason.contains("more than 400000000 vertices"), "{error}");
}
