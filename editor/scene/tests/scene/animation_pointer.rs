//! `KHR_animation_pointer`: clips that change visibility, materials, lights and cameras.

use std::path::Path;

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{
    ClipChoice, Document, Driven, Edit, LightKind, Local, MaterialId, NodeId, NodeKind, Projection,
    ShadingMode, Target,
};
use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use crate::gltf_file::{Data, GltfFile, SQUARE};

/// Parts of the file in depth-first order.
const PLATE: u32 = 0;
const BELOW: u32 = 1;
const LAMP: u32 = 2;
const OTHER_LAMP: u32 = 3;
const EYE: u32 = 4;

const LIGHT: &str = "/extensions/KHR_lights_punctual/lights/0";

pub struct Clip {
    file: GltfFile,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Clip {
    /// A plate with a material and a lamp below it, two lamps that are one light, and a camera.
    fn new() -> Self {
        let mut file = GltfFile::new();
        let attributes = json!({"POSITION": file.floats("VEC3", 3, &SQUARE)});
        file.push("meshes", json!({"primitives": [{"attributes": attributes, "material": 0}]}));
        file.push("images", json!({"uri": "missing.png"}));
        file.push("textures", json!({"source": 0}));
        file.push(
            "materials",
            json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1],
            "baseColorTexture": {"index": 0}}}),
        );
        file.push(
            "materials",
            json!({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}),
        );
        file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
        let spot = json!({"innerConeAngle": 0.1, "outerConeAngle": 0.4});
        file.json["extensions"] =
            json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": spot}]}});
        let lamp = json!({"KHR_lights_punctual": {"light": 0}});
        file.push("nodes", json!({"mesh": 0, "children": [1]}));
        file.push("nodes", json!({"mesh": 0}));
        file.push("nodes", json!({"extensions": lamp}));
        file.push("nodes", json!({"extensions": lamp}));
        file.push("nodes", json!({"camera": 0}));
        file.json["scenes"] = json!([{"nodes": [0, 2, 3, 4]}]);
        Self { file, channels: Vec::new(), samplers: Vec::new() }
    }

    fn channel(&mut self, pointer: &str, interpolation: &str, output: usize, keys: usize) {
        let times: Vec<f32> = (0..keys).map(|key| key as f32).collect();
        let input = self.file.floats("SCALAR", 1, &times);
        let target =
            json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
        self.channels.push(json!({"sampler": self.samplers.len(), "target": target}));
        self.samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    }

    /// A straight line between two values at 0 and 1 seconds.
    fn line(&mut self, pointer: &str, kind: &str, values: &[f32]) {
        let output = self.file.floats(kind, values.len() / 2, values);
        self.channel(pointer, "LINEAR", output, 2);
    }

    fn read(mut self, folder: &Path) -> Imported {
        self.file.json["extensionsRequired"] = json!(["KHR_animation_pointer"]);
        self.file.push("animations", json!({"channels": self.channels, "samplers": self.samplers}));
        load(&self.file.write(folder), &ImportOptions::default()).unwrap()
    }

    pub fn place(self) -> (Document, NodeId) {
        let folder = tempfile::tempdir().unwrap();
        let mut document = Document::new();
        let prefab = document.add_imported(self.read(folder.path())).unwrap();
        let (node, edit) = document.instantiate_edit(prefab, None, Local::default());
        document.apply(edit).unwrap();
        document.drain_changes();
        (document, node)
    }
}

fn material(document: &Document) -> MaterialId {
    document.materials().next().unwrap().0
}

#[test]
fn materials_change_with_time_and_rest_as_they_were() {
    let mut clip = Clip::new();
    clip.line(
        "/materials/0/pbrMetallicRoughness/baseColorFactor",
        "VEC4",
        &[1., 0., 0., 1., 0., 1., 0., 0.5],
    );
    clip.line("/materials/0/emissiveFactor", "VEC3", &[0., 0., 0., 1., 2., 3.]);
    clip.line(
        "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength",
        "SCALAR",
        &[1., 9.],
    );
    clip.line("/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor", "SCALAR", &[0., 1.]);
    let transform = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform";
    clip.line(&format!("{transform}/offset"), "VEC2", &[0., 0., 2., 4.]);
    clip.line(&format!("{transform}/rotation"), "SCALAR", &[0., 3.]);
    let (mut document, node) = clip.place();
    let id = material(&document);
    let own = document.material(id).unwrap().clone();

    document.set_time(Some(0.5));
    assert!(document.has_changes());
    let changes = document.drain_changes();
    assert_eq!(changes.materials, [id].into());
    assert_eq!(changes.reasons, ["animation"]);
    let posed = document.posed_material(id).unwrap().into_owned();
    assert_eq!(posed.base_color, Vec4::new(0.5, 0.5, 0.0, 0.75));
    assert_eq!((posed.emissive, posed.emissive_strength), (Vec3::new(0.5, 1.0, 1.5), 5.0));
    assert_eq!(posed.clearcoat.unwrap().factor, 0.5);
    let texture = posed.base_color_texture.unwrap();
    assert_eq!((texture.offset, texture.rotation_rad), (Vec2::new(1.0, 2.0), 1.5));
    assert_eq!(document.material(id), Some(&own));

    // The same time again changes nothing.
    document.set_time(Some(0.5));
    assert!(!document.has_changes());

    // An edit shows in what no clip changes.
    let value = caustica_scene::Material { metallic: 0.25, base_color: Vec4::ONE, ..own.clone() };
    document.apply(Edit::SetMaterial { material: id, value: Box::new(value) }).unwrap();
    let posed = document.posed_material(id).unwrap().into_owned();
    assert_eq!((posed.metallic, posed.base_color), (0.25, Vec4::new(0.5, 0.5, 0.0, 0.75)));

    document.drain_changes();
    document.apply(Edit::SetClip { node, clip: ClipChoice::None }).unwrap();
    assert_eq!(document.drain_changes().materials, [id].into());
    assert_eq!(document.posed_material(id).unwrap().base_color, Vec4::ONE);
    document.apply(Edit::SetClip { node, clip: ClipChoice::First }).unwrap();
    document.drain_changes();
    document.set_time(None);
    assert_eq!(document.drain_changes().materials, [id].into());
    assert_eq!(document.posed_material(id).as_deref(), document.material(id));
}

#[test]
fn materials_rest_when_the_instance_that_plays_goes() {
    let mut clip = Clip::new();
    clip.line("/materials/0/emissiveFactor", "VEC3", &[0., 0., 0., 1., 1., 1.]);
    let (mut document, node) = clip.place();
    let prefab = document.prefabs().next().unwrap().0;
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    document.set_time(Some(0.5));
    document.drain_changes();
    let id = material(&document);
    document.apply(Edit::RemoveNode { node }).unwrap();
    assert!(document.drain_changes().materials.is_empty(), "the other instance says the same");
    assert_eq!(document.posed_material(id).unwrap().emissive, Vec3::splat(0.5));
    let other = document.roots()[0];
    let back = document.apply(Edit::RemoveNode { node: other }).unwrap();
    assert_eq!(document.drain_changes().materials, [id].into());
    assert_eq!(document.posed_material(id).unwrap().emissive, Vec3::ZERO);
    document.apply_back(back).unwrap();
    document.drain_changes();
    assert_eq!(document.posed_material(id).unwrap().emissive, Vec3::splat(0.5));
}

/// Smooth glass has a mode of its own, which would not look at the share of transmitted light.
#[test]
fn glass_that_clouds_over_is_no_glass_any_more() {
    let mut clip = Clip::new();
    clip.line("/materials/1/extensions/KHR_materials_transmission/transmissionFactor", "SCALAR", &[1., 0.]);
    let (mut document, _) = clip.place();
    let id = document.materials().nth(1).unwrap().0;
    assert_eq!(document.material(id).unwrap().mode, ShadingMode::Refractive);
    for (time_s, mode) in [(0.0, ShadingMode::Refractive), (0.25, ShadingMode::Pbr)] {
        document.set_time(Some(time_s));
        document.drain_changes();
        assert_eq!(document.posed_material(id).unwrap().mode, mode);
    }
}

#[test]
fn lights_and_cameras_change_wherever_they_stand() {
    let mut clip = Clip::new();
    clip.line(&format!("{LIGHT}/color"), "VEC3", &[1., 1., 1., 0., 1., -1.]);
    clip.line(&format!("{LIGHT}/intensity"), "SCALAR", &[10., 30.]);
    clip.line(&format!("{LIGHT}/spot/outerConeAngle"), "SCALAR", &[0.4, 0.8]);
    clip.line("/cameras/0/perspective/yfov", "SCALAR", &[0.5, 1.5]);
    let (mut document, node) = clip.place();
    let at = |part| Target::part(node, part);
    document.set_time(Some(0.5));
    let changes = document.drain_changes();
    assert_eq!(changes.lights, [at(LAMP), at(OTHER_LAMP)].into());
    assert_eq!(changes.cameras, [at(EYE)].into());
    for lamp in [LAMP, OTHER_LAMP] {
        let light = document.light(at(lamp)).unwrap().value;
        assert_eq!((light.intensity, light.color), (20.0, Vec3::new(0.5, 1.0, 0.0)));
        let LightKind::Spot { inner_rad, outer_rad, .. } = light.kind else { panic!("{light:?}") };
        assert!(inner_rad == 0.1 && (outer_rad - 0.6).abs() < 1e-6);
        assert_eq!(document.light_of(at(lamp)).unwrap().intensity, 1.0);
    }
    let eye = document.camera(at(EYE)).unwrap().value;
    assert!(matches!(eye.projection, Projection::Perspective { yfov_rad } if yfov_rad == 1.0));
    assert_eq!(document.driven(at(LAMP)), Driven { light: true, ..Driven::default() });
    assert_eq!(document.driven(at(EYE)), Driven { camera: true, ..Driven::default() });

    document.set_time(None);
    let changes = document.drain_changes();
    assert_eq!((changes.lights.len(), changes.cameras.len()), (2, 1));
    assert_eq!(document.light(at(LAMP)).unwrap().value, document.light_of(at(LAMP)).unwrap());
}

#[test]
fn visibility_hides_what_hangs_below_too() {
    let mut clip = Clip::new();
    let output = clip.file.accessor("SCALAR", 3, false, Data::U8(&[1, 0, 1]));
    clip.channel("/nodes/0/extensions/KHR_node_visibility/visible", "STEP", output, 3);
    let (mut document, node) = clip.place();
    let at = |part| Target::part(node, part);
    for (time_s, shown) in [(0.5, true), (1.5, false), (2.0, true)] {
        document.set_time(Some(time_s));
        // Also before the change is drained.
        assert_eq!(document.renderable(at(BELOW)).unwrap().visible, shown);
        let changes = document.drain_changes();
        assert_eq!(changes.visibility.len(), if time_s > 1.0 { 2 } else { 0 });
        for part in [PLATE, BELOW] {
            assert_eq!(document.renderable(at(part)).unwrap().visible, shown, "{time_s}");
        }
        assert_eq!(document.visible(at(PLATE)), Some(true));
        assert!(document.driven(at(PLATE)).visibility && !document.driven(at(BELOW)).visibility);
    }
    document.set_time(Some(1.5));
    document.drain_changes();
    document.set_time(None);
    assert_eq!(document.drain_changes().visibility.len(), 2);
}

#[test]
fn transforms_by_pointer_are_as_good_as_others() {
    let mut clip = Clip::new();
    clip.line("/nodes/1/translation", "VEC3", &[0., 0., 0., 4., 0., 0.]);
    let (mut document, node) = clip.place();
    document.set_time(Some(0.25));
    assert_eq!(document.world_from(Target::part(node, BELOW)).unwrap().translation.x, 1.0);
}

#[test]
fn what_cannot_be_animated_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut clip = Clip::new();
    let pointers = [
        "/nodes/0/matrix",
        "/nodes/9/translation",
        "/nodes/0/weights/0",
        "/materials/0/doubleSided",
        "/materials/7/emissiveFactor",
        "/materials/x/emissiveFactor",
        "/materials/00/emissiveFactor",
        "/nodes/+0/translation",
        "/cameras/0/orthographic",
        "/scenes/0/name",
        "",
    ];
    for pointer in pointers {
        clip.line(pointer, "VEC3", &[0.; 6]);
    }
    // Of another kind, of another width, without steps, twice.
    clip.line("/cameras/0/orthographic/ymag", "SCALAR", &[1., 2.]);
    clip.line("/materials/0/alphaCutoff", "SCALAR", &[0., 1.]);
    clip.line("/materials/0/emissiveFactor", "SCALAR", &[0., 1.]);
    clip.line("/nodes/0/extensions/KHR_node_visibility/visible", "SCALAR", &[0., 1.]);
    clip.line("/materials/0/occlusionTexture/strength", "SCALAR", &[0., 1.]);
    clip.line("/materials/0/occlusionTexture/strength", "SCALAR", &[0., 1.]);
    // Held to its range.
    clip.line("/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", &[0., 2.]);
    let imported = clip.read(folder.path());
    let all: Vec<String> = imported.warnings.iter().map(|warning| warning.to_string()).collect();
    let of_channel = |channel: usize| {
        let place = format!("/animations/0/channels/{channel}: ");
        all.iter().find(|warning| warning.contains(&place)).unwrap_or_else(|| panic!("{place} in {all:#?}"))
    };
    for (channel, pointer) in pointers.iter().enumerate() {
        assert!(of_channel(channel).contains(&format!("{pointer:?}")), "{}", of_channel(channel));
    }
    for (channel, part) in [
        (11, "no such property"),
        (12, "no such property"),
        (13, "wrong type"),
        (14, "steps"),
        (16, "same"),
        (17, "held to 0 to 1"),
    ] {
        assert!(of_channel(channel).contains(part), "{}", of_channel(channel));
    }
    assert_eq!(imported.prefab.animations[0].channels.len(), 2);
}

/// A clip with channels of every kind, also such as are not played.
pub fn every_channel() -> Clip {
    let mut clip = Clip::new();
    let shown = clip.file.accessor("SCALAR", 2, false, Data::U8(&[1, 0]));
    clip.channel("/nodes/1/extensions/KHR_node_visibility/visible", "STEP", shown, 2);
    clip.line("/cameras/0/perspective/yfov", "SCALAR", &[0.5, 0.75]);
    let strength = "extensions/KHR_materials_emissive_strength/emissiveStrength";
    clip.line(&format!("/materials/1/{strength}"), "SCALAR", &[1., 2.]);
    clip.line("/cameras/0/orthographic/xmag", "SCALAR", &[1., 2.]);
    clip.line("/nodes/4/extensions/ACME_dial/turn", "SCALAR", &[3., 4.]);
    clip.line("/images/0/name", "SCALAR", &[3., 4.]);
    clip.file.json["nodes"][4]["extensions"] = json!({"ACME_dial": {"turn": 3}});
    clip.line("/nodes/1/translation", "VEC3", &[0., 0., 0., 4., 0., 0.]);
    clip.line(&format!("{LIGHT}/intensity"), "SCALAR", &[10., 30.]);
    clip
}

/// Every channel is in an export, those that are not played too; what a pointer needs to end somewhere is made.
#[test]
fn an_export_has_every_channel() {
    let clip = every_channel();
    let strength = "extensions/KHR_materials_emissive_strength/emissiveStrength";
    let (document, _) = clip.place();
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("out.glb");
    let exported = caustica_scene::export(&document, &written).unwrap();
    let channels = exported.warnings.iter().find(|warning| warning.place == "animations");
    assert_eq!(channels, None, "the image cannot be pointed at, which the import says");
    let again = load(&written, &ImportOptions::default()).unwrap();
    let NodeKind::Prefab { prefab, .. } = document.node(document.roots()[0]).unwrap().kind else { panic!() };
    let before = &document.prefab(prefab).unwrap().animations[0].channels;
    let after = &again.prefab.animations[0].channels;
    assert_eq!((before.len(), after.len()), (6, 6), "the light is that of two lamps");
    for (before, after) in before.iter().zip(after) {
        assert_eq!((before.part, before.interpolation), (after.part, after.interpolation));
        assert_eq!((&before.times_s, &before.values), (&after.times_s, &after.values));
    }
    let file = crate::export::json_of(&written);
    let pointers: Vec<&str> = file["animations"][0]["channels"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|channel| channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"].as_str())
        .collect();
    let visible = "/nodes/1/extensions/KHR_node_visibility/visible";
    let material = format!("/materials/1/{strength}");
    let intensity = format!("{LIGHT}/intensity");
    let [camera, xmag, dial] =
        ["/cameras/0/perspective/yfov", "/cameras/0/orthographic/xmag", "/nodes/4/extensions/ACME_dial/turn"];
    assert_eq!(pointers, [visible, camera, &material, &intensity, xmag, dial]);
    assert_eq!(file["materials"][1]["extensions"]["KHR_materials_emissive_strength"], json!({}));
    assert_eq!(file["nodes"][1]["extensions"]["KHR_node_visibility"], json!({}));
    let kept = again.warnings.iter().filter(|warning| warning.message.contains("animated; it is only kept"));
    assert_eq!(kept.count(), 2, "{:?}", again.warnings);
    let second = crate::export::exported(&crate::export::placed(again), folder.path(), "again.glb").0;
    assert!(std::fs::read(written).unwrap() == std::fs::read(second).unwrap(), "a second export is the same");
}

/// Channels of a light and a camera that no node has come back; what moves nothing, and a camera that was refused, are counted.
#[test]
fn what_no_node_has_is_kept_or_counted() {
    let mut clip = Clip::new();
    let camera = |yfov: f32| json!({"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.1}});
    for yfov in [-1.0, -2.0, 0.75] {
        clip.file.push("cameras", camera(yfov));
    }
    clip.file.json["nodes"][0]["camera"] = json!(1);
    let lights = clip.file.json["extensions"]["KHR_lights_punctual"]["lights"].as_array_mut().unwrap();
    lights.insert(0, json!({"type": "point", "name": "spare"}));
    for node in [2, 3] {
        clip.file.json["nodes"][node]["extensions"]["KHR_lights_punctual"]["light"] = json!(1);
    }
    clip.line(&format!("{LIGHT}/intensity"), "SCALAR", &[10., 30.]);
    clip.line("/cameras/3/perspective/yfov", "SCALAR", &[0.5, 0.75]);
    clip.line("/cameras/1/perspective/yfov", "SCALAR", &[0.5, 0.75]);
    clip.line("/nodes/1/extensions/ACME_dial/turn", "SCALAR", &[3., 4.]);
    clip.channels.push(json!({"sampler": 0, "target": {"path": "translation"}}));
    let folder = tempfile::tempdir().unwrap();
    let document = crate::export::placed(clip.read(folder.path()));
    let (written, done) = crate::export::exported(&document, folder.path(), "out.glb");
    let file = crate::export::json_of(&written);
    let angles: Vec<&Value> =
        file["cameras"].as_array().unwrap().iter().map(|c| &c["perspective"]["yfov"]).collect();
    assert_eq!(angles, [&json!(0.5), &json!(0.75)]);
    assert_eq!(file["extensions"]["KHR_lights_punctual"]["lights"][1]["name"], "spare");
    let channels = file["animations"][0]["channels"].as_array().unwrap();
    let pointer =
        |channel: &Value| channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"].clone();
    let pointers: Vec<Value> = channels.iter().map(pointer).collect();
    let light = "/extensions/KHR_lights_punctual/lights/1/intensity";
    assert_eq!(pointers, [light, "/cameras/1/perspective/yfov", "/nodes/1/extensions/ACME_dial/turn"]);
    assert_eq!(file["nodes"][1].get("extensions"), None, "not an empty one for the dial");
    let said: Vec<&str> = done.warnings.iter().map(|warning| warning.message.as_str()).collect();
    for words in [
        "a camera that cannot be used is left out (2 times)",
        "a channel of the clip \"\" that moves nothing is left out",
    ] {
        assert!(said.contains(&words), "{words}: {said:#?}");
    }
    let again = crate::export::placed(crate::export::read(&written));
    let (second, _) = crate::export::exported(&again, folder.path(), "again.glb");
    assert!(std::fs::read(written).unwrap() == std::fs::read(second).unwrap(), "a second export is the same");
}
