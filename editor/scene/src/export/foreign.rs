//! What the sources said and the program does not know, said again. In: what import kept, by prefab. Out: members of JSON
//! objects. Where two sources say something for the whole file under one name, the first has it.

use std::collections::BTreeMap;

use serde_json::Value;

use super::json::{Extensions, Object, Put};
use crate::document::Document;
use crate::foreign::{Foreign, Kept, KeptTexture, LooseMesh, Mapping, Unknown};
use crate::ids::{MaterialId, MeshId, PrefabId, Target, TextureId};
use crate::prefab::Prefab;

mod variants;

use variants::Variants;

/// The sources of a scene and what they brought.
pub(super) struct Sources<'a> {
    document: &'a Document,
    prefabs: Vec<(PrefabId, &'a Prefab)>,
    /// Which prefab has an extension of the whole file.
    owners: BTreeMap<&'a str, PrefabId>,
    meshes: BTreeMap<MeshId, (PrefabId, usize)>,
    materials: BTreeMap<MaterialId, (PrefabId, usize)>,
    textures: BTreeMap<TextureId, (PrefabId, usize)>,
    variants: Variants<'a>,
    /// What was left out, in words.
    pub warnings: Vec<String>,
}

impl<'a> Sources<'a> {
    /// `placed`: the prefabs that the scene places, in order.
    pub fn new(document: &'a Document, placed: &[PrefabId]) -> Self {
        let find = |&id: &PrefabId| Some((id, document.prefab(id)?));
        let mut sources = Self {
            document,
            prefabs: placed.iter().filter_map(find).collect(),
            owners: BTreeMap::new(),
            meshes: BTreeMap::new(),
            materials: BTreeMap::new(),
            textures: BTreeMap::new(),
            variants: Variants::default(),
            warnings: Vec::new(),
        };
        for &(id, prefab) in &sources.prefabs {
            let foreign = &prefab.foreign;
            for name in foreign.file.extensions.keys() {
                let owner = *sources.owners.entry(name).or_insert(id);
                if owner != id {
                    let reason = format!("{}: {name} is left out, another source has it too", prefab.name);
                    sources.warnings.push(reason);
                }
            }
            let place = |(place, mesh): (usize, &MeshId)| (*mesh, (id, place));
            sources.meshes.extend(prefab.meshes.iter().enumerate().map(place));
            let place = |(place, material): (usize, &MaterialId)| (*material, (id, place));
            sources.materials.extend(prefab.materials.iter().enumerate().map(place));
            let place = |(place, texture): (usize, &TextureId)| (*texture, (id, place));
            sources.textures.extend(prefab.textures.iter().enumerate().map(place));
        }
        sources.variants = Variants::of(&sources.prefabs, &mut sources.warnings);
        sources
    }

    /// The materials that came with the sources.
    pub fn materials(&self) -> impl Iterator<Item = MaterialId> + '_ {
        self.materials.keys().copied()
    }

    /// What its source says about a part, and which source.
    pub fn part(&self, prefab: PrefabId, part: u32) -> Option<(PrefabId, &'a Unknown)> {
        Some((prefab, self.prefab(prefab)?.foreign.parts.get(&part)?))
    }

    /// The same of a mesh.
    pub fn mesh(&self, mesh: MeshId) -> Option<(PrefabId, &'a Unknown)> {
        let &(prefab, place) = self.meshes.get(&mesh)?;
        Some((prefab, self.prefab(prefab)?.foreign.meshes.get(&place)?))
    }

    /// The same of a material.
    pub fn material(&self, material: MaterialId) -> Option<(PrefabId, &'a Unknown)> {
        let &(prefab, place) = self.materials.get(&material)?;
        Some((prefab, self.prefab(prefab)?.foreign.materials.get(&place)?))
    }

    /// A source.
    pub fn source(&self, id: PrefabId) -> Option<&'a Prefab> {
        self.prefab(id)
    }

    fn prefab(&self, id: PrefabId) -> Option<&'a Prefab> {
        self.document.prefab(id)
    }

    /// The same of a primitive.
    pub fn primitive(&self, mesh: MeshId, primitive: u32) -> Option<(PrefabId, &'a Unknown)> {
        let &(prefab, place) = self.meshes.get(&mesh)?;
        Some((prefab, self.prefab(prefab)?.foreign.primitives.get(&(place, primitive as usize))?))
    }

    /// What is kept of the light of a target.
    pub fn light(&self, target: Target) -> Option<(PrefabId, &'a Kept)> {
        let prefab = self.document.prefab_of(target.node)?;
        Some((prefab, self.prefab(prefab)?.foreign.lights.get(&target.part?)?))
    }

    /// What is kept of the camera of a target.
    pub fn camera(&self, target: Target) -> Option<(PrefabId, &'a Kept)> {
        let prefab = self.document.prefab_of(target.node)?;
        Some((prefab, self.prefab(prefab)?.foreign.cameras.get(&target.part?)?))
    }

    /// What is kept of a texture.
    pub fn texture(&self, texture: TextureId) -> Option<(PrefabId, &'a KeptTexture)> {
        let &(prefab, place) = self.textures.get(&texture)?;
        Some((prefab, self.prefab(prefab)?.foreign.textures.get(&place)?))
    }

    /// Lights, or cameras, of the sources that no node carries.
    pub fn spare(&self, find: impl Fn(&'a Foreign) -> &'a Vec<Value>, used: &mut Extensions) -> Vec<Value> {
        let spare: Vec<Value> =
            self.prefabs.iter().flat_map(|(_, prefab)| find(&prefab.foreign)).cloned().collect();
        for extensions in spare.iter().filter_map(|value| value.get("extensions")?.as_object()) {
            extensions.keys().for_each(|name| used.note(name));
        }
        spare
    }

    /// How many of them come before those of a source.
    pub fn spare_before(&self, id: PrefabId, find: impl Fn(&'a Foreign) -> &'a Vec<Value>) -> usize {
        let before = self.prefabs.iter().take_while(|(of, _)| *of != id);
        before.map(|(_, prefab)| find(&prefab.foreign).len()).sum()
    }

    /// What of the sources is lost: of which, what, and how often.
    pub fn lost(&self) -> impl Iterator<Item = (&'a Prefab, &'a str, usize)> {
        let of = |(_, prefab): &(PrefabId, &'a Prefab)| {
            let prefab = *prefab;
            prefab.foreign.lost.iter().map(move |(what, count)| (prefab, what.as_str(), *count))
        };
        self.prefabs.iter().flat_map(of).collect::<Vec<_>>().into_iter()
    }

    /// Puts what is unknown into an object, with what of its `extras` is ours.
    pub fn put(
        &self,
        object: &mut Object,
        unknown: Option<(PrefabId, &Unknown)>,
        own_extras: Object,
        used: &mut Extensions,
    ) {
        let Some((prefab, unknown)) = unknown else {
            return object.put_filled("extras", own_extras);
        };
        for (name, value) in &unknown.extensions {
            if self.owners.get(name.as_str()).is_none_or(|owner| *owner == prefab) {
                used.put(object, name, value.clone());
            }
        }
        let extras = match unknown.extras.clone() {
            Some(Value::Object(mut members)) => {
                members.extend(own_extras);
                Some(Value::Object(members))
            }
            Some(other) if own_extras.is_empty() => Some(other),
            _ => Some(Value::Object(own_extras)).filter(|own| own.as_object().is_some_and(|o| !o.is_empty())),
        };
        if let Some(extras) = extras {
            object.put("extras", extras);
        }
        for (name, inner) in &unknown.within {
            let member = match name.strip_prefix("extensions/") {
                Some(extension) => object.get_mut("extensions").and_then(|all| all.get_mut(extension)),
                // Without members it says what is read without it.
                None if name == "pbrMetallicRoughness" => {
                    Some(object.entry(name).or_insert_with(|| Value::Object(Object::new())))
                }
                None => object.get_mut(name),
            };
            match member.and_then(Value::as_object_mut) {
                Some(member) => self.put(member, Some((prefab, inner)), Object::new(), used),
                None => used.homeless += inner.count(),
            }
        }
    }

    /// What the sources say about the file as a whole; after what the extensions that are read say of it.
    pub fn put_file(&self, file: &mut Object, used: &mut Extensions) {
        let variants = self.variants.list();
        if !variants.is_empty() {
            let mut value = Object::new();
            value.put("variants", variants);
            used.put(file, "KHR_materials_variants", value);
        }
        self.put_each(file, |_, prefab| Some(&prefab.foreign.file), Object::new(), used);
    }

    /// What they say about the asset, and who made it.
    pub fn put_asset(&self, asset: &mut Object, used: &mut Extensions) {
        let mut makers: Vec<&str> = Vec::new();
        for maker in self.prefabs.iter().filter_map(|(_, prefab)| prefab.foreign.copyright.as_deref()) {
            if !makers.contains(&maker) {
                makers.push(maker);
            }
        }
        asset.put_text("copyright", &makers.join("; "));
        self.put_each(asset, |_, prefab| Some(&prefab.foreign.asset), Object::new(), used);
    }

    /// What they say about the scenes that are shown. `shown`: their places.
    pub fn put_scene(
        &self,
        scene: &mut Object,
        shown: &BTreeMap<PrefabId, usize>,
        own_extras: Object,
        used: &mut Extensions,
    ) {
        let find = |id, prefab: &'a Prefab| prefab.foreign.scenes.get(*shown.get(&id)?);
        self.put_each(scene, find, own_extras, used);
    }

    /// The extensions of each source, and the `extras` of the first that has some.
    fn put_each(
        &self,
        object: &mut Object,
        find: impl Fn(PrefabId, &'a Prefab) -> Option<&'a Unknown>,
        own_extras: Object,
        used: &mut Extensions,
    ) {
        let mut extras = None;
        for &(id, prefab) in self.prefabs.iter().rev() {
            let Some(unknown) = find(id, prefab) else { continue };
            extras = unknown.extras.clone().or(extras);
            let bare = Unknown { extras: None, ..unknown.clone() };
            self.put(object, Some((id, &bare)), Object::new(), used);
        }
        if let Some((id, _)) = self.prefabs.first() {
            self.put(object, Some((*id, &Unknown { extras, ..Unknown::default() })), own_extras, used);
        } else {
            object.put_filled("extras", own_extras);
        }
    }

    /// Gives the primitives of a mesh the materials that variants choose. `places`: those of the materials in the file.
    pub fn put_variants(
        &self,
        mesh: MeshId,
        primitives: &mut [(u32, &mut Object)],
        places: &BTreeMap<MaterialId, usize>,
        used: &mut Extensions,
    ) {
        let Some(&(id, mesh)) = self.meshes.get(&mesh) else { return };
        let Some(prefab) = self.prefab(id) else { return };
        for (number, object) in primitives {
            if let Some(mappings) = prefab.foreign.mappings.get(&(mesh, *number as usize)) {
                self.put_mappings((id, mappings), object, places, used);
            }
        }
    }

    /// Gives a primitive the materials that variants of its source choose.
    pub fn put_mappings(
        &self,
        (id, mappings): (PrefabId, &[Mapping]),
        object: &mut Object,
        places: &BTreeMap<MaterialId, usize>,
        used: &mut Extensions,
    ) {
        let (Some(prefab), Some(variants)) = (self.prefab(id), self.variants.places.get(&id)) else { return };
        let mut mapping = |mapping: &Mapping| {
            let material = places.get(prefab.materials.get(mapping.material)?)?;
            let mut object = Object::new();
            object.put("material", *material);
            object.put(
                "variants",
                mapping.variants.iter().filter_map(|&v| variants.get(v).copied()).collect::<Vec<_>>(),
            );
            object.put_text("name", &mapping.name);
            self.put(&mut object, Some((id, &mapping.unknown)), Object::new(), used);
            Some(Value::Object(object))
        };
        let mut value = Object::new();
        value.put("mappings", mappings.iter().filter_map(&mut mapping).collect::<Vec<_>>());
        used.put(object, "KHR_materials_variants", value);
    }

    /// The points and lines of a mesh, with their source.
    pub fn loose(&self, mesh: MeshId) -> Option<(PrefabId, &'a Prefab, &'a LooseMesh)> {
        let &(id, place) = self.meshes.get(&mesh)?;
        let prefab = self.prefab(id)?;
        Some((id, prefab, prefab.foreign.loose.get(&place)?))
    }
}
