//! The audit on small documents with one fault each.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use std::sync::Arc;

use super::*;
use crate::assets::{Light, LightKind, MeshData, Primitive};
use crate::edit::Edit;
use crate::import::Imported;
use crate::node::Node;
use crate::prefab::{PartNode, Prefab};
use crate::transform::{Local, Trs};

fn with_triangle(scale: DVec3, corner: Vec3) -> Document {
    let data = MeshData {
        positions: vec![Vec3::ZERO, Vec3::X, corner],
        normals: vec![Vec3::Z; 3],
        tangents: vec![Vec3::X.extend(1.0); 3],
        tex_coords0: vec![Default::default(); 3],
        indices: vec![0, 1, 2],
        ..MeshData::default()
    };
    let primitive = Primitive {
        first_index: 0,
        index_count: 3,
        material: MaterialId(0),
        mesh_from_primitive: DAffine3::IDENTITY,
    };
    let mut prefab = Prefab::new("triangle", "triangle.gltf");
    let part = PartNode { visible: true, mesh: Some(MeshId(0)), ..PartNode::default() };
    prefab.set_nodes(vec![part]).unwrap();
    let imported = Imported {
        prefab,
        meshes: vec![Mesh::new("t".to_owned(), Arc::new(data), vec![primitive])],
        materials: vec![Material::default()],
        ..Imported::default()
    };
    let mut document = Document::new();
    let prefab = document.add_imported(imported).unwrap();
    let trs = Trs { scale, ..Trs::IDENTITY };
    let (_, edit) = document.instantiate_edit(prefab, None, Local::Trs(trs));
    document.apply(edit).unwrap();
    document
}

fn messages(document: &Document) -> Vec<String> {
    audit(document).iter().map(ToString::to_string).collect()
}

#[test]
fn a_sound_scene_has_no_findings() {
    assert_eq!(messages(&with_triangle(DVec3::ONE, Vec3::Y)), [""; 0]);
}

#[test]
fn faults_are_found() {
    for (scale, severity, words) in [
        (DVec3::new(1.0, 0.0, 1.0), Severity::Info, "it is drawn flat"),
        (DVec3::new(0.0, 0.0, 1.0), Severity::Warning, "nothing in more than one direction"),
        (DVec3::splat(1e30), Severity::Error, "larger than single precision"),
    ] {
        let found = audit(&with_triangle(scale, Vec3::Y));
        assert_eq!(found[0].severity, severity);
        assert!(found[0].message.contains(words), "{}", found[0].message);
    }
    let stretched = with_triangle(DVec3::new(1e6, 1.0, 1.0), Vec3::Y);
    assert!(messages(&stretched)[0].contains("1000000 to 1"));
    let nan = with_triangle(DVec3::ONE, Vec3::NAN);
    assert!(messages(&nan)[0].contains("1 position is not finite"));
    let line = with_triangle(DVec3::ONE, Vec3::X * 2.0);
    assert!(messages(&line)[0].contains("no area"));
}

#[test]
fn a_clip_that_is_not_there_is_found() {
    let mut document = with_triangle(DVec3::ONE, Vec3::Y);
    let (node, _) = document.nodes().next().unwrap();
    document.apply(Edit::SetClip { node, clip: ClipChoice::Clip(2) }).unwrap();
    assert!(messages(&document)[0].contains("clip 2, the source has 0"));
    document.apply(Edit::SetClip { node, clip: ClipChoice::All }).unwrap();
    assert_eq!(messages(&document), [""; 0]);
}

#[test]
fn a_lamp_that_cannot_be_is_found() {
    let mut document = Document::new();
    let point = LightKind::Point { radius_m: 0.0, range_m: None };
    let spot = |inner_rad, outer_rad| LightKind::Spot { radius_m: 0.0, range_m: None, inner_rad, outer_rad };
    let sun = |angular_radius_rad| LightKind::Directional { angular_radius_rad };
    let ended = LightKind::Point { radius_m: 0.1, range_m: Some(0.0) };
    for (kind, intensity, faults) in [
        (point, 1.0, 0),
        (spot(0.0, 0.7), 1.0, 0),
        (sun(0.005), 1.0, 0),
        (point, -5.0, 1),
        (ended, 1.0, 1),
        (spot(0.8, 0.4), 1.0, 1),
        (spot(0.8, 2.0), 1.0, 1),
        (sun(6.3), 1.0, 1),
    ] {
        let light = Light { color: Vec3::ONE, intensity, kind };
        let (node, edit) = document.add_edit(Node::new("lamp", NodeKind::Light(light)), None);
        document.apply(edit).unwrap();
        let found = messages(&document).iter().filter(|message| message.contains("warning: lamp")).count();
        assert_eq!(found, faults, "{light:?}");
        document.apply(Edit::RemoveNode { node }).unwrap();
    }
}

#[test]
fn a_material_out_of_range_is_found() {
    let mut document = with_triangle(DVec3::ONE, Vec3::Y);
    let (material, value) = document.materials().next().unwrap();
    let value = Material { roughness: 2.0, ..value.clone() };
    document.apply(Edit::SetMaterial { material, value: Box::new(value) }).unwrap();
    assert!(messages(&document)[0].contains("roughness is 2"));
}
