//! The scenes of the file. In: the tree and the sources. Out: their JSON, and which of them is shown. A source that is
//! written as it is keeps all of its scenes; else there is one, and what others have is left out with a warning.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

use image::{ImageFormat, Rgb32FImage};
use serde_json::Value;

use super::Writer;
use super::buffer::Use;
use super::foreign::Sources;
use super::json::{self, Object, Put};
use super::tree::Tree;
use crate::assets::{Environment, EnvironmentFile};
use crate::ids::{NodeId, PrefabId, Target};
use crate::import::counted;
use crate::prefab::SourceScene;

impl Writer<'_> {
    /// Which of the scenes is shown, and all of them.
    pub(super) fn scenes(&mut self, tree: &Tree, sources: &Sources<'_>) -> (usize, Vec<Value>) {
        let whole = tree.whole.and_then(|(node, id)| Some((node, id, self.document.prefab(id)?)));
        let Some((node, id, prefab)) = whole.filter(|(_, _, prefab)| !prefab.scenes().is_empty()) else {
            self.warn_about_scenes(tree);
            return (0, vec![Value::Object(self.only_scene(tree, sources))]);
        };
        let shown = prefab.scene_place(self.document.scene_of(node));
        let mut list = Vec::new();
        for (place, scene) in prefab.scenes().iter().enumerate() {
            let extras = match place == shown {
                true => self.environment(tree),
                false => self.surroundings(scene.environment.as_ref()),
            };
            let mut object = Object::new();
            object.put_text("name", &scene.name);
            let roots = scene.roots.iter().filter_map(|&root| tree.top_of(Target::part(node, root)));
            object.put_filled("nodes", roots.collect::<Vec<_>>());
            let unknown = prefab.foreign.scenes.get(place).map(|unknown| (id, unknown));
            sources.put(&mut object, unknown, extras, &mut self.used);
            list.push(Value::Object(object));
        }
        (shown, list)
    }

    /// The scene of a document that is more than a source as it is.
    fn only_scene(&mut self, tree: &Tree, sources: &Sources<'_>) -> Object {
        let mut shown: BTreeMap<PrefabId, usize> = BTreeMap::new();
        for &(node, id) in &tree.instances {
            if let Some(prefab) = self.document.prefab(id) {
                shown.entry(id).or_insert_with(|| prefab.scene_place(self.document.scene_of(node)));
            }
        }
        let mut scene = Object::new();
        if let [instance] = tree.instances[..] {
            scene.put_text("name", self.shown_scene(instance).map_or("", |scene| &scene.name));
        }
        scene.put_filled("nodes", tree.roots.clone());
        let extras = self.environment(tree);
        sources.put_scene(&mut scene, &shown, extras, &mut self.used);
        scene
    }

    fn shown_scene(&self, (node, id): (NodeId, PrefabId)) -> Option<&SourceScene> {
        let prefab = self.document.prefab(id)?;
        prefab.scenes().get(prefab.scene_place(self.document.scene_of(node)))
    }

    /// What `extras` say of the surroundings.
    fn environment(&mut self, tree: &Tree) -> Object {
        let asked = tree
            .instances
            .iter()
            .filter_map(|&(node, id)| self.document.prefab(id)?.environment_in(self.document.scene_of(node)));
        let environment = match self.document.environment() {
            Environment::Auto => asked.into_iter().next(),
            set => Some(set),
        };
        self.surroundings(environment)
    }

    /// `extras` for an environment; nothing for none. A map goes into the buffer, as its file is or as EXR.
    fn surroundings(&mut self, environment: Option<&Environment>) -> Object {
        let mut said = Object::new();
        match environment {
            None | Some(Environment::Auto) => return Object::new(),
            Some(Environment::Constant(radiance)) => {
                said.put("constantRadiance", json::numbers(&radiance.to_array()));
            }
            Some(Environment::DefaultSky) => said.put("sky", true),
            Some(Environment::File(file)) => {
                let Some(bytes) = encoded(file) else {
                    self.warn("environment", "its map could not be read and is left out");
                    return Object::new();
                };
                said.put("bufferView", self.buffer.view(&bytes, Use::Other));
                said.put("rotationRad", file.rotation_rad);
                said.put("scale", file.scale);
            }
        }
        let mut extras = Object::new();
        extras.put("environment", said);
        extras
    }

    /// Scenes of sources that are left out, with the nodes that only they have.
    fn warn_about_scenes(&mut self, tree: &Tree) {
        for id in tree.prefabs() {
            let Some(prefab) = self.document.prefab(id) else { continue };
            let nodes: Vec<NodeId> =
                tree.instances.iter().filter(|(_, prefab)| *prefab == id).map(|(node, _)| *node).collect();
            let shown: BTreeSet<usize> =
                nodes.iter().map(|node| prefab.scene_place(self.document.scene_of(*node))).collect();
            let parts = 0..prefab.nodes().len() as u32;
            let is_nowhere =
                |part: &u32| nodes.iter().all(|n| self.document.is_absent(Target::part(*n, *part)));
            let (scenes, parts) =
                (prefab.scenes().len().saturating_sub(shown.len()), parts.filter(is_nowhere).count());
            if scenes + parts > 0 {
                let place = format!("source \"{}\"", prefab.source.display());
                let scenes = counted(
                    scenes,
                    "scene that is not shown is left out",
                    "scenes that are not shown are left out",
                );
                let parts = counted(parts, "node that is in no other", "nodes that are in no other");
                let reason =
                    format!("{scenes}, with {parts}; a file that is exported alone and unmoved keeps them");
                self.warn(&place, reason);
            }
        }
    }
}

/// The bytes of a map: those of its file, where it has one of its own.
fn encoded(file: &EnvironmentFile) -> Option<Vec<u8>> {
    let map = file.map.as_ref()?;
    let own =
        file.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hdr") || e.eq_ignore_ascii_case("exr"));
    if let Some(bytes) = own.then(|| std::fs::read(&file.path).ok()).flatten() {
        return Some(bytes);
    }
    let image = Rgb32FImage::from_raw(map.width, map.height, map.rgb.as_flattened().to_vec())?;
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::OpenExr).ok()?;
    Some(bytes.into_inner())
}
