//! Copies with ids of their own: an instance made unique, and another document merged into this one.
//! In: what is to stand beside what is there. Out: edits, as one step each.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Document, MOST_MERGED_ID};
use crate::edit::{Edit, EditError};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target, TextureId};
use crate::node::{Node, NodeKind, Subtree};
use crate::package::{MaterialEntry, PrefabPackage};

/// Copies that are to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct Copies {
    /// Makes them, as one step.
    pub edit: Edit,
    /// The new node, or that which gets copies.
    pub node: NodeId,
    ids: NewIds,
}

#[derive(Clone, Debug, PartialEq)]
enum NewIds {
    After(u64),
    These(BTreeMap<u64, u64>),
}

impl Copies {
    /// The id of the copy of what has this id; `None`: there is none.
    pub fn id_of(&self, id: u64) -> Option<u64> {
        match &self.ids {
            NewIds::After(offset) => id.checked_add(*offset),
            NewIds::These(ids) => ids.get(&id).copied(),
        }
    }
}

/// Other ids in the place of those that something has. One map serves all kinds: what has one number before has one number after.
type Renumber<'a> = &'a dyn Fn(u64) -> u64;

impl Document {
    /// The edit that gives an instance a copy of its prefab: its materials, moved primitives and source can then be changed
    /// without the other instances. Vertices and texels are shared in this process; a device holds them once more.
    ///
    /// # Errors
    /// When the node is no instance, or the only one of its prefab.
    pub fn make_unique_edit(&mut self, node: NodeId) -> Result<Copies, EditError> {
        let wrong = EditError::WrongKind { target: Target::node(node), wanted: "instance" };
        let old = self.prefab_of(node).ok_or(wrong.clone())?;
        if !self.nodes().any(|(id, other)| id != node && other.prefab() == Some(old)) {
            return Err(EditError::OnlyInstance);
        }
        let package = self.package_of(old).ok_or(wrong)?;
        let mut fresh = BTreeMap::new();
        for id in ids_of(&package).chain(package.prefab.asset_names.gone()) {
            fresh.entry(id).or_insert_with(|| self.allocate_id());
        }
        let renumber = |id: u64| fresh.get(&id).copied().unwrap_or(id);
        let own: BTreeSet<MaterialId> = package.materials.iter().map(|(id, _)| *id).collect();
        let mut package = renumbered_package(package, &renumber);
        package.prefab.name = format!("{} copy", package.prefab.name);
        let prefab = package.id;
        let mut edits = vec![Edit::AddPrefab(Box::new(package)), Edit::SetPrefab { node, prefab }];
        // Materials of the prefab that overrides name become those of the copy.
        let slot = self.slots.get(&node);
        for (&part, values) in slot.iter().flat_map(|slot| &slot.parts.overrides) {
            for (&primitive, material) in values.materials.iter().filter(|(_, id)| own.contains(id)) {
                let (target, material) = (Target::part(node, part), MaterialId(renumber(material.0)));
                edits.push(Edit::AssignMaterial { target, primitive, material });
            }
        }
        let edit = Edit::batch(format!("made {} unique", self.display_name(node.into())), edits);
        Ok(Copies { edit, node, ids: NewIds::These(fresh) })
    }

    /// The edit that adds everything in another document, below a group of this name when it has several roots. Its environment and its choice of a camera are left out.
    ///
    /// # Errors
    /// When there is no node in it, or no number is left for its ids.
    pub fn merge_edit(&mut self, other: &Document, name: &str) -> Result<Copies, EditError> {
        let empty = EditError::NoTree(format!("there is nothing in {name}"));
        let offset = self.next_id;
        let last = offset.checked_add(other.next_id).filter(|last| *last <= MOST_MERGED_ID);
        let last = last.ok_or_else(|| EditError::Taken("every id".to_owned()))?;
        self.reserve_ids_up_to(last);
        let renumber = |id: u64| id.saturating_add(offset);
        let mut edits: Vec<Edit> = Vec::new();
        let (mut brought, mut brought_meshes) = (BTreeSet::new(), BTreeSet::new());
        for package in other.prefabs().filter_map(|(id, _)| other.package_of(id)) {
            brought.extend(package.materials.iter().map(|(id, _)| *id));
            brought_meshes.extend(package.meshes.iter().map(|(id, _)| *id));
            edits.push(Edit::AddPrefab(Box::new(renumbered_package(package, &renumber))));
        }
        for (&id, entry) in other.materials.iter().filter(|(id, _)| !brought.contains(id)) {
            let entry = Box::new(renumbered_material(entry.clone(), &renumber));
            edits.push(Edit::AddMaterial { material: MaterialId(renumber(id.0)), entry });
        }
        for (id, mesh) in other.meshes().filter(|(id, _)| !brought_meshes.contains(id)) {
            let value = Box::new(renumbered_mesh(mesh.clone(), &renumber));
            edits.push(Edit::AddMesh { mesh: MeshId(renumber(id.0)), value });
        }
        let ids = other.roots().iter().flat_map(|&root| other.subtree_ids(root));
        let nodes = ids.filter_map(|id| Some((id, other.node(id)?.clone())));
        let mut subtree = Subtree {
            nodes: nodes
                .map(|(id, node)| (renumbered_id(id, &renumber), renumbered_node(node, &renumber)))
                .collect(),
        };
        if other.roots().len() > 1 {
            let group = NodeId(self.allocate_id());
            for (_, root) in subtree.nodes.iter_mut().filter(|(_, node)| node.parent.is_none()) {
                root.parent = Some(group);
            }
            subtree.nodes.insert(0, (group, Node::new(name, NodeKind::Group)));
        }
        let node = subtree.top().ok_or(empty)?;
        edits.push(Edit::AddNode { parent: None, index: usize::MAX, subtree });
        Ok(Copies { edit: Edit::batch(format!("merged {name}"), edits), node, ids: NewIds::After(offset) })
    }
}

fn ids_of(package: &PrefabPackage) -> impl Iterator<Item = u64> {
    let meshes = package.meshes.iter().map(|(id, _)| id.0);
    let materials = package.materials.iter().map(|(id, _)| id.0);
    let textures = package.textures.iter().map(|(id, _)| id.0);
    std::iter::once(package.id.0).chain(meshes).chain(materials).chain(textures)
}

fn renumbered_package(package: PrefabPackage, renumber: Renumber<'_>) -> PrefabPackage {
    let PrefabPackage { id, mut prefab, meshes, materials, textures, beside: _ } = package;
    let mesh_id = |id: MeshId| MeshId(renumber(id.0));
    let material_id = |id: MaterialId| MaterialId(renumber(id.0));
    let texture_id = |id: TextureId| TextureId(renumber(id.0));
    prefab.meshes.iter_mut().for_each(|id| *id = mesh_id(*id));
    prefab.materials.iter_mut().for_each(|id| *id = material_id(*id));
    prefab.textures.iter_mut().for_each(|id| *id = texture_id(*id));
    prefab.map_meshes(mesh_id);
    prefab.map_animated_materials(material_id);
    Arc::make_mut(&mut prefab.asset_names).map_gone(renumber);
    PrefabPackage {
        id: PrefabId(renumber(id.0)),
        prefab,
        meshes: meshes.into_iter().map(|(id, mesh)| (mesh_id(id), renumbered_mesh(mesh, renumber))).collect(),
        materials: materials
            .into_iter()
            .map(|(id, entry)| (material_id(id), renumbered_material(entry, renumber)))
            .collect(),
        textures: textures.into_iter().map(|(id, texture)| (texture_id(id), texture)).collect(),
        beside: Vec::new(),
    }
}

fn renumbered_mesh(mut mesh: crate::assets::Mesh, renumber: Renumber<'_>) -> crate::assets::Mesh {
    for primitive in &mut mesh.primitives {
        primitive.material = MaterialId(renumber(primitive.material.0));
    }
    mesh
}

fn renumbered_material(mut entry: MaterialEntry, renumber: Renumber<'_>) -> MaterialEntry {
    let all = entry.original.iter_mut().chain([&mut entry.value]);
    for value in all.filter(|value| value.textures().next().is_some()) {
        for slot in Arc::make_mut(value).texture_slots_mut().flatten() {
            slot.texture = TextureId(renumber(slot.texture.0));
        }
    }
    entry
}

fn renumbered_id(id: NodeId, renumber: Renumber<'_>) -> NodeId {
    NodeId(renumber(id.0))
}

fn renumbered_node(mut node: Node, renumber: Renumber<'_>) -> Node {
    node.parent = node.parent.map(|id| renumbered_id(id, renumber));
    let material = |id: &mut MaterialId| *id = MaterialId(renumber(id.0));
    match &mut node.kind {
        NodeKind::Prefab { prefab, overrides, .. } => {
            *prefab = PrefabId(renumber(prefab.0));
            overrides.values_mut().flat_map(|own| own.materials.values_mut()).for_each(material);
        }
        NodeKind::Mesh { mesh, materials, .. } => {
            *mesh = MeshId(renumber(mesh.0));
            materials.iter_mut().for_each(material);
        }
        NodeKind::Group | NodeKind::Light(_) | NodeKind::Camera(_) => {}
    }
    node
}
