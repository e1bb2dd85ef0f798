//! Skins: which nodes are joints, and how the mesh lies to them when nothing is bent.
//! In: JSON, checked accessors and the tree. Out: skins, and parts that name them. A skin that cannot bend is left
//! out with a warning: its meshes are then shown in their own pose.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat4};

use super::accessor::{Accessors, Component};
use super::json::{Fault, Item};
use super::node::Tree;
use crate::assets::Mesh;
use crate::prefab::Skin;

/// Reads the skins and gives them to the parts of the tree that they bend. Gives their places in that list too, `None` for
/// those that were left out.
pub(super) fn read_all(
    root: &Item<'_>,
    accessors: &Accessors<'_>,
    meshes: &[Mesh],
    tree: &mut Tree,
) -> Result<(Vec<Skin>, Vec<Option<u32>>), Fault> {
    let items = root.objects("skins")?;
    let mut skins = Vec::new();
    let mut place_of: Vec<Option<u32>> = Vec::new();
    for item in &items {
        let skin = read(item, accessors, tree)?;
        place_of.push(skin.is_some().then_some(skins.len() as u32));
        skins.extend(skin);
    }
    let largest: Vec<Option<u16>> = meshes.iter().map(largest_joint).collect();
    for (node, item) in root.objects("nodes")?.iter().enumerate() {
        let Some(index) = item.index("skin", items.len(), "skin")? else {
            continue;
        };
        let skin = place_of.get(index).copied().flatten();
        let part = tree.part_of_node.get(node).copied().flatten();
        let (Some(part), Some(skin)) = (part.and_then(|part| tree.parts.get_mut(part as usize)), skin) else {
            continue;
        };
        let Some(mesh) = part.mesh else {
            tree.warnings.push(
                item.fault("a skin bends no GPU instances and nothing without a mesh; it was left out"),
            );
            continue;
        };
        let joint_count = skins.get(skin as usize).map_or(0, |skin| skin.joints.len());
        match largest.get(mesh.0 as usize).copied().flatten() {
            None => tree
                .warnings
                .push(item.fault("its mesh has no JOINTS_0 and WEIGHTS_0; its skin was left out")),
            Some(joint) if joint as usize >= joint_count => {
                return Err(
                    item.fault(format!("a vertex names joint {joint}, skin {index} has {joint_count}"))
                );
            }
            Some(_) => part.skin = Some(skin),
        }
    }
    Ok((skins, place_of))
}

/// `None` for a mesh without joints.
fn largest_joint(mesh: &Mesh) -> Option<u16> {
    let skin = mesh.data.skin.as_ref()?;
    skin.joints.iter().flatten().copied().max()
}

fn read(item: &Item<'_>, accessors: &Accessors<'_>, tree: &mut Tree) -> Result<Option<Skin>, Fault> {
    let nodes = item.indices("joints", tree.part_of_node.len(), "node")?;
    let inverse_bind = match item.size("inverseBindMatrices")? {
        Some(index) => read_matrices(item, accessors, index, nodes.len(), &mut tree.warnings)?,
        None => Some(vec![DAffine3::IDENTITY; nodes.len()]),
    };
    let mut joints = Vec::with_capacity(nodes.len());
    for node in nodes {
        match tree.part_of_node.get(node).copied().flatten() {
            Some(part) => joints.push(part),
            None => {
                let reason = format!("its joint, node {node}, is not in the scene; it bends nothing");
                tree.warnings.push(item.fault(reason));
                return Ok(None);
            }
        }
    }
    let mut seen = BTreeSet::new();
    if !joints.iter().all(|joint| seen.insert(*joint)) {
        tree.warnings.push(item.fault("it names a joint twice; exports give it another node"));
    }
    Ok(inverse_bind.map(|inverse_bind| Skin { joints, inverse_bind }))
}

/// `None`, with a warning, when a number is not finite.
fn read_matrices(
    item: &Item<'_>,
    accessors: &Accessors<'_>,
    index: usize,
    count: usize,
    warnings: &mut Vec<Fault>,
) -> Result<Option<Vec<DAffine3>>, Fault> {
    let place = format!("{}/inverseBindMatrices", item.place());
    let accessor = accessors.get(index)?;
    if accessor.component != Component::F32 || accessor.width != 16 {
        return Err(Fault::new(place, format!("accessor {index} has no matrices of 4 x 4 floats")));
    }
    if accessor.count < count {
        let reason = format!("accessor {index} has {} matrices for {count} joints", accessor.count);
        return Err(Fault::new(place, reason));
    }
    accessors.take(count, size_of::<DAffine3>(), &place)?;
    let columns = accessors.floats::<16>(index, 0.0)?;
    let matrices = columns.iter().take(count).map(|c| DMat4::from_cols_array(&c.map(f64::from)));
    let matrices: Vec<DMat4> = matrices.collect();
    if !matrices.iter().all(|matrix| matrix.is_finite()) {
        warnings.push(Fault::new(place, "a number is not finite; the skin bends nothing"));
        return Ok(None);
    }
    let affine = |matrix: &DMat4| matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
    if !matrices.iter().all(affine) {
        warnings.push(Fault::new(place, "the last row of a matrix is not 0 0 0 1 and was ignored"));
    }
    Ok(Some(matrices.into_iter().map(DAffine3::from_mat4).collect()))
}
