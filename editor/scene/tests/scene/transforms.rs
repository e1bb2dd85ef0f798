//! Transform maths and dirty propagation: what is computed again, and that the result is right.

use crate::common::{ARM, LAMP, PLATE, scene, trs};
use caustica_scene::{
    Document, Edit, Local, Node, NodeId, NodeKind, Subtree, Target, Trs, is_degenerate, rigid,
};
use glam::{DAffine3, DQuat, DVec3};

const PARTS: usize = 4;

fn set(document: &mut Document, target: impl Into<Target>, local: Local) {
    let target = target.into();
    document.apply(Edit::SetTransform { target, local }).unwrap();
}

#[test]
fn world_is_the_product_of_the_locals() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (arm, plate) = (scene.part(ARM), scene.part(PLATE));
    let chain = [Target::node(scene.group), Target::node(scene.first), scene.part(0), arm, plate];
    let expected = |document: &Document| {
        let locals = chain.map(|t| document.local(t).unwrap().to_affine());
        locals.into_iter().fold(DAffine3::IDENTITY, |world, local| world * local)
    };
    // The same bits whether it is read before or after the update.
    let lazy = scene.document.world_from(plate).unwrap();
    assert_eq!(lazy, expected(&scene.document));
    scene.document.update_transforms();
    assert_eq!(scene.document.world_from(plate), Some(lazy));
    set(&mut scene.document, arm, trs(7.0, 2.0, 0.5));
    let lazy = scene.document.world_from(plate).unwrap();
    assert_eq!(lazy, expected(&scene.document));
    scene.document.update_transforms();
    assert_eq!(scene.document.world_from(plate), Some(lazy));
}

#[test]
fn only_the_subtree_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let document = &mut scene.document;
    assert_eq!(document.update_transforms(), 5 + 2 * PARTS);
    assert_eq!(document.update_transforms(), 0);
    set(document, scene.light, trs(1.0, 0.0, 1.0));
    assert_eq!(document.update_transforms(), 1);
    set(document, scene.group, trs(1.0, 0.0, 1.0));
    assert_eq!(document.update_transforms(), 3 + PARTS);
    // A part goes with its own subtree, in its own instance only.
    set(document, Target::part(scene.first, ARM), trs(1.0, 0.0, 1.0));
    assert_eq!(document.update_transforms(), 2);
    set(document, Target::part(scene.first, LAMP), trs(1.0, 0.0, 1.0));
    assert_eq!(document.update_transforms(), 1);
    // Marked twice from above and below, computed once.
    set(document, scene.light, trs(2.0, 0.0, 1.0));
    set(document, scene.group, trs(2.0, 0.0, 1.0));
    set(document, scene.first, trs(2.0, 0.0, 1.0));
    assert_eq!(document.update_transforms(), 3 + PARTS);
}

fn chain(levels: u64) -> (Document, Vec<NodeId>) {
    let mut document = Document::new();
    let ids: Vec<NodeId> = (0..levels).map(|_| NodeId(document.allocate_id())).collect();
    let mut subtree = Subtree::default();
    for (i, &id) in ids.iter().enumerate() {
        let mut node =
            Node::new("", NodeKind::Group).with_local(Trs::from_translation(DVec3::new(0.0, 0.0, 1.0)));
        node.parent = i.checked_sub(1).map(|above| ids[above]);
        subtree.nodes.push((id, node));
    }
    let edit = Edit::AddNode { parent: None, index: 0, subtree };
    document.apply(edit).unwrap();
    (document, ids)
}

#[test]
fn ten_thousand_levels_neither_overflow_nor_drift() {
    let (mut document, ids) = chain(10_000);
    let (top, bottom) = (ids[0], *ids.last().unwrap());
    let depth = |document: &Document| document.world_from(bottom.into()).unwrap().translation.z;
    assert_eq!(depth(&document), 10_000.0);
    assert_eq!(document.update_transforms(), 10_000);
    assert_eq!(depth(&document), 10_000.0);
    assert!(document.is_within(bottom.into(), top.into()));
    assert!(document.effectively_visible(bottom.into()));
    // Moving the bottom costs one, moving the top costs all.
    set(&mut document, bottom, Local::default());
    assert_eq!(document.update_transforms(), 1);
    set(&mut document, top, Local::default());
    assert_eq!(document.update_transforms(), 10_000);
    let before = document.clone();
    let (_, copy) = document.duplicate_edit(top).unwrap();
    let undo_copy = document.apply(copy).unwrap();
    document.apply(undo_copy).unwrap();
    let undo = document.apply(Edit::RemoveNode { node: top }).unwrap();
    assert_eq!(document.node_count(), 0);
    document.apply(undo).unwrap();
    assert!(document == before);
}

#[test]
fn far_from_the_origin_a_micrometre_is_kept() {
    let (mut document, ids) = chain(3);
    let far = DVec3::new(6_371_000.0, -1e6, 1e6);
    set(&mut document, ids[0], Trs::from_translation(far).into());
    let small = DVec3::new(1e-6, 0.0, 0.0);
    set(&mut document, ids[1], Trs::from_translation(small).into());
    set(&mut document, ids[2], Local::default());
    let world = document.world_from(ids[2].into()).unwrap().translation;
    assert!(((world - far).x - 1e-6).abs() < 1e-9);
}

#[test]
fn matrices_come_apart_only_when_that_is_exact() {
    for scale in [
        DVec3::ONE,
        DVec3::new(1e-6, 2.0, 1e6),
        DVec3::new(-1.0, 2.0, 3.0),
        DVec3::new(1.0, -2.0, 3.0),
        DVec3::splat(-1.0),
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::ZERO,
    ] {
        for angle in [0.0, 0.1, 1.5, 3.1] {
            let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
            let rotation = DQuat::from_axis_angle(axis, angle);
            let matrix = DAffine3::from_scale_rotation_translation(scale, rotation, DVec3::X);
            let local = Local::from_affine(matrix);
            assert!(matches!(local, Local::Trs(_)), "{scale} {angle}");
            let size = scale.abs().max_element().max(1.0);
            assert!(local.to_affine().abs_diff_eq(matrix, 1e-12 * size), "{scale} {angle}");
        }
    }
    let mut shear = DAffine3::IDENTITY;
    shear.matrix3.y_axis.x = 1e-9;
    assert_eq!(Local::from_affine(shear), Local::Matrix(shear));
    assert!(Local::Matrix(shear).nearest_trs().to_affine().abs_diff_eq(shear, 1e-8));
}

#[test]
fn degenerate_transforms_are_known() {
    let scaled = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
    for good in
        [scaled(1.0, 1.0, 1.0), scaled(1e-6, 1e-6, 1e-6), scaled(1e6, 1.0, 1e-3), scaled(-1.0, 1.0, 1.0)]
    {
        assert!(!is_degenerate(&good), "{good}");
    }
    for bad in [
        scaled(1.0, 0.0, 0.0),
        scaled(f64::NAN, 1.0, 1.0),
        scaled(1e-30, 1e-30, 1.0),
        scaled(1e30, 1.0, 1.0),
        DAffine3::from_translation(DVec3::INFINITY),
    ] {
        assert!(is_degenerate(&bad), "{bad}");
    }
}

#[test]
fn a_camera_takes_no_scale_and_keeps_its_view() {
    let placed = DAffine3::from_scale_rotation_translation(
        DVec3::new(-2.0, 3.0, 0.1),
        DQuat::from_rotation_y(0.4),
        DVec3::ONE,
    );
    let camera = rigid(&placed);
    assert!((camera.matrix3.determinant() - 1.0).abs() < 1e-12);
    let view = placed.transform_vector3(DVec3::NEG_Z).normalize();
    assert!(camera.transform_vector3(DVec3::NEG_Z).abs_diff_eq(view, 1e-12));
    assert_eq!(camera.translation, DVec3::ONE);
}

#[test]
fn a_lamp_or_camera_that_is_flattened_looks_where_it_looked() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let placed = |scale| rigid(&DAffine3::from_scale_rotation_translation(scale, turn, DVec3::ONE));
    let as_it_was = placed(DVec3::ONE);
    for scale in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 3.0)] {
        assert!(placed(scale).abs_diff_eq(as_it_was, 1e-12), "{scale}");
    }
}

#[test]
fn bounds_are_those_of_visible_meshes_in_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let document = &mut scene.document;
    let hide = |target: Target| Edit::SetVisible { target, visible: false };
    document.apply(hide(scene.group.into())).unwrap();
    set(document, scene.second, Local::default());
    set(document, Target::part(scene.second, ARM), Local::default());
    // The root part moves by one in x, the plate is scaled by two: a triangle with sides of two.
    let (low, high) = document.bounds().unwrap();
    assert_eq!((low, high), (DVec3::X, DVec3::new(3.0, 2.0, 0.0)));
    assert_eq!(document.bounds_of(scene.second.into()), Some((low, high)));
    document.apply(hide(scene.second.into())).unwrap();
    assert_eq!(document.bounds(), None);
}
