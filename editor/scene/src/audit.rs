//! Numerical audit of a scene: what cannot be rendered as it stands, and what will look wrong.
//! In: a document. Out: findings that name what they are about. It changes nothing.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use crate::alike;
use crate::animation::ClipChoice;
use crate::assets::{AlphaMode, Environment, Material, Mesh, ShapeSource};
use crate::document::Document;
use crate::ids::{MaterialId, MeshId, NodeId, Target, TextureId};
use crate::import::geometry::has_no_area;
use crate::import::{counted, short};
use crate::node::NodeKind;
use crate::prefab::{PartOverride, PartPath, Prefab};
use crate::transform::{is_degenerate, is_flat};

mod finding;

pub use finding::{Finding, Severity, Subject};

/// Longest by shortest axis of a transform above which single precision gets coarse.
const LARGE_SCALE_RATIO: f64 = 1e4;
/// Distance from the origin, in sizes of the object, above which single precision alone would show steps.
const FAR_IN_SIZES: f64 = 1e6;

/// Looks through a document; the worst findings come first, then in order of subject. Of one kind the first are listed, the
/// others counted.
pub fn audit(document: &Document) -> Vec<Finding> {
    let mut audit = Audit { document, findings: Vec::new() };
    audit.prefabs();
    audit.transforms();
    audit.lights();
    for (id, mesh) in document.meshes() {
        audit.mesh(id, mesh);
        audit.shapes(id, mesh);
    }
    for (id, material) in document.materials() {
        audit.material(id, material);
    }
    audit.textures();
    audit.scene();
    let mut findings = audit.findings;
    findings.sort_by_key(|finding| (std::cmp::Reverse(finding.severity), finding.subject));
    let kind = |finding: &Finding| {
        (finding.severity, finding.subject.kind_and_id().0, alike::kind_of(&finding.message))
    };
    alike::summed(findings, kind, |listed, last, count| Finding {
        message: format!("and {count} more like it, the last {}", short(&last.name)),
        ..listed.clone()
    })
}

struct Audit<'a> {
    document: &'a Document,
    findings: Vec<Finding>,
}

impl Audit<'_> {
    fn add(&mut self, severity: Severity, subject: Subject, name: &str, message: String) {
        let (kind, id) = subject.kind_and_id();
        self.findings.push(Finding { severity, subject, name: crate::edit::shown(name, kind, id), message });
    }

    fn prefabs(&mut self) {
        for (id, prefab) in self.document.prefabs().filter(|(_, p)| p.missing) {
            let message = format!(
                "{} could not be read; put the file back or choose another source",
                prefab.source.display()
            );
            self.add(Severity::Error, Subject::Prefab(id), &prefab.name, message);
        }
        for (id, node) in self.document.nodes() {
            let NodeKind::Prefab { prefab, overrides, clip, variant, scene } = &node.kind else {
                continue;
            };
            let Some(prefab) = self.document.prefab(*prefab).filter(|p| !p.missing) else {
                continue;
            };
            if let ClipChoice::Clip(index) = *clip
                && clip.of(&prefab.animations).is_empty()
            {
                let count = prefab.animations.len();
                let message = format!(
                    "it stands still: it is to play clip {index}, the source has {count}; choose another"
                );
                self.add(Severity::Warning, Subject::Target(Target::node(id)), &node.name, message);
            }
            let lost = |choice: &Option<String>, known: Vec<String>| {
                choice.as_ref().filter(|name| !known.contains(name)).cloned()
            };
            for (lost, is_to) in [
                (lost(variant, prefab.variants()), "be shown in"),
                (lost(scene, prefab.scene_names()), "show the scene"),
            ] {
                let Some(name) = lost else { continue };
                let message =
                    format!("it is to {is_to} {name}, which the source does not have; choose another");
                self.add(Severity::Warning, Subject::Target(Target::node(id)), &node.name, message);
            }
            let lost = overrides.keys().filter(|path| prefab.part_at(path).is_none());
            let lost: Vec<&str> = lost.map(|path| path.0.as_str()).collect();
            self.lost_primitives(id, &node.name, prefab, overrides);
            if !lost.is_empty() {
                let subject = Subject::Target(Target::node(id));
                let message = format!(
                    "changes to parts that the source no longer has are kept aside: {}",
                    lost.join(", ")
                );
                self.add(Severity::Warning, subject, &node.name, message);
            }
        }
    }

    /// Materials of primitives that the meshes of an instance do not have.
    fn lost_primitives(
        &mut self,
        id: NodeId,
        name: &str,
        prefab: &Prefab,
        overrides: &BTreeMap<PartPath, PartOverride>,
    ) {
        for (path, own) in overrides.iter().filter(|(_, own)| !own.materials.is_empty()) {
            let Some(part) = prefab.part_at(path).and_then(|part| prefab.node(part)) else { continue };
            let mesh = part.mesh.and_then(|mesh| self.document.mesh(mesh));
            let count = mesh.map_or(0, |mesh| mesh.primitives.len());
            let lost = own.materials.keys().filter(|&&primitive| primitive as usize >= count);
            let lost: Vec<String> = lost.map(u32::to_string).collect();
            if !lost.is_empty() {
                let has = counted(count, "primitive", "primitives");
                let message = format!(
                    "it gives materials to primitives {} of {}, whose mesh has {has}; they are kept aside",
                    lost.join(", "),
                    path.0
                );
                self.add(Severity::Warning, Subject::Target(Target::node(id)), name, message);
            }
        }
    }

    fn transforms(&mut self) {
        let placed: Vec<(Target, DAffine3, Option<MeshId>)> = self
            .document
            .renderables()
            .map(|r| (r.target, r.world_from_mesh, Some(r.mesh)))
            .chain(self.document.lights().map(|l| (l.target, l.world_from_node, None)))
            .chain(self.document.cameras().map(|c| (c.target, c.world_from_node, None)))
            .collect();
        for (target, world, mesh) in placed {
            let name = self.document.display_name(target);
            let subject = Subject::Target(target);
            if !world.is_finite() {
                let message = "its place in the world is not finite; it is left out".to_owned();
                self.add(Severity::Error, subject, &name, message);
                continue;
            }
            // Lights and cameras take no scale from their node.
            let Some(mesh) = mesh else { continue };
            let m = world.matrix3;
            let lengths = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
            let longest = lengths.into_iter().fold(0.0, f64::max);
            let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
            if is_degenerate(&world) {
                let (severity, message) = match longest > 1.0 {
                    true => (Severity::Error, "it is larger than single precision can hold; it is left out"),
                    false => (
                        Severity::Warning,
                        "it is scaled to nothing in more than one direction; it is left out",
                    ),
                };
                self.add(severity, subject, &name, message.to_owned());
                continue;
            }
            if is_flat(&world) {
                let message = "it is scaled to nothing in one direction; it is drawn flat".to_owned();
                self.add(Severity::Info, subject, &name, message);
            } else if longest / shortest > LARGE_SCALE_RATIO {
                let message = format!("its axes are scaled very differently, {:.0} to 1", longest / shortest);
                self.add(Severity::Warning, subject, &name, message);
            }
            let size = self.document.mesh(mesh).and_then(|m| m.bounds);
            let size = size.map_or(0.0, |(low, high)| length(high - low) * longest);
            let distance = length(world.translation);
            if size > 0.0 && distance / size > FAR_IN_SIZES {
                let message = format!("it is {distance:.3e} m from the origin and {size:.3e} m large");
                self.add(Severity::Info, subject, &name, message);
            }
        }
    }

    fn lights(&mut self) {
        let faulty: Vec<(Target, Vec<&str>)> =
            self.document.lights().map(|placed| (placed.target, placed.value.faults())).collect();
        for (target, faults) in faulty {
            let name = self.document.display_name(target);
            for fault in faults {
                self.add(Severity::Warning, Subject::Target(target), &name, fault.to_owned());
            }
        }
    }

    fn mesh(&mut self, id: MeshId, mesh: &Mesh) {
        let data = &mesh.data;
        let subject = Subject::Mesh(id);
        let finite = |bad: usize, one: &str, many: &str| {
            (bad > 0).then(|| format!("{} not finite", counted(bad, one, many)))
        };
        let bad_positions = data.positions.iter().filter(|p| !p.is_finite()).count();
        let bad_normals = data.normals.iter().filter(|n| !n.is_finite()).count();
        let bad_tangents = data.tangents.iter().filter(|t| !t.is_finite()).count();
        for message in [
            finite(bad_positions, "position is", "positions are"),
            finite(bad_normals, "normal is", "normals are"),
            finite(bad_tangents, "tangent is", "tangents are"),
        ]
        .into_iter()
        .flatten()
        {
            self.add(Severity::Error, subject, &mesh.name, message);
        }
        let (mut degenerate, mut outside) = (0_usize, 0_usize);
        for primitive in &mesh.primitives {
            let (triangles, _) = mesh.indices_of(primitive).as_chunks::<3>();
            for triangle in triangles {
                match triangle.map(|i| data.positions.get(i as usize)) {
                    [Some(p), Some(q), Some(r)] => {
                        degenerate += usize::from(has_no_area(*p, *q, *r));
                    }
                    _ => outside += 1,
                }
            }
            if is_degenerate(&primitive.mesh_from_primitive) {
                let message = "a primitive is scaled to nothing in more than one direction".to_owned();
                self.add(Severity::Warning, subject, &mesh.name, message);
            }
        }
        if degenerate > 0 {
            let message = format!("{} no area", counted(degenerate, "triangle has", "triangles have"));
            self.add(Severity::Warning, subject, &mesh.name, message);
        }
        if outside > 0 {
            let message = format!(
                "{} vertices that do not exist",
                counted(outside, "triangle names", "triangles name")
            );
            self.add(Severity::Error, subject, &mesh.name, message);
        }
    }

    fn shapes(&mut self, id: MeshId, mesh: &Mesh) {
        let Some(shapes) = mesh.shapes() else { return };
        let subject = Subject::Mesh(id);
        if let ShapeSource::File(file) = shapes.source()
            && file.shapes.is_none()
        {
            let message = format!("{} could not be read; put the file back", file.path.display());
            self.add(Severity::Error, subject, &mesh.name, message);
        } else if shapes.list().is_empty() {
            let message = "there is not one sphere or box in it".to_owned();
            self.add(Severity::Info, subject, &mesh.name, message);
        }
        let points = shapes.list().iter().filter(|shape| shape.half_extent.min_element() <= 0.0).count();
        if points > 0 {
            let message = format!(
                "{} not seen",
                counted(points, "sphere or box has no size and is", "spheres or boxes have no size and are")
            );
            self.add(Severity::Warning, subject, &mesh.name, message);
        }
    }

    fn material(&mut self, id: MaterialId, material: &Material) {
        let subject = Subject::Material(id);
        if !material.is_finite() {
            let message = "a value is not a finite number".to_owned();
            self.add(Severity::Error, subject, &material.name, message);
        }
        let unit = 0.0..=1.0_f32;
        let cutoff = match material.alpha {
            AlphaMode::Mask { cutoff } => cutoff,
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        };
        let ranged = [
            ("base colour", material.base_color.max_element(), &unit),
            ("base colour", material.base_color.min_element(), &unit),
            ("metallic", material.metallic, &unit),
            ("roughness", material.roughness, &unit),
            ("transmission", material.transmission, &unit),
            ("specular", material.specular, &unit),
            ("occlusion strength", material.occlusion_strength, &unit),
            ("alpha cutoff", cutoff, &unit),
        ];
        let mut outside: BTreeMap<&str, f32> = ranged
            .into_iter()
            .chain(lobe_shares(material).into_iter().map(|(what, value)| (what, value, &unit)))
            .filter(|(_, value, range)| value.is_finite() && !range.contains(value))
            .map(|(what, value, _)| (what, value))
            .collect();
        if material.ior < 1.0 {
            outside.insert("index of refraction", material.ior);
        }
        if let Some(film) = material.iridescence.as_ref().filter(|film| film.ior < 1.0) {
            outside.insert("index of the film", film.ior);
        }
        if material.dispersion < 0.0 {
            outside.insert("dispersion", material.dispersion);
        }
        if material.emitted_radiance().min_element() < 0.0 {
            outside.insert("emission", material.emitted_radiance().min_element());
        }
        for (what, value) in outside {
            let message = format!("{what} is {value}, outside of what is physical");
            self.add(Severity::Warning, subject, &material.name, message);
        }
        let missing = |id: &TextureId| self.document.texture(*id).is_none();
        let lost = material.textures().filter(|u| missing(&u.texture)).count();
        if lost > 0 {
            let message = format!("{} missing", counted(lost, "of its textures is", "of its textures are"));
            self.add(Severity::Error, subject, &material.name, message);
        }
    }

    fn textures(&mut self) {
        for (id, texture) in self.document.textures().filter(|(_, t)| t.placeholder) {
            let message = "the image could not be read; a checker stands in".to_owned();
            self.add(Severity::Warning, Subject::Texture(id), &texture.name, message);
        }
    }

    fn scene(&mut self) {
        if let Environment::File(file) = self.document.environment()
            && file.map.is_none()
        {
            let message = format!(
                "{} could not be read and the surroundings are black; put the file back or choose others",
                file.path.display()
            );
            self.add(Severity::Error, Subject::Scene, "environment", message);
        }
        if self.document.renderables().next().is_none() {
            let message = "there is nothing to see: no mesh is placed".to_owned();
            self.add(Severity::Info, Subject::Scene, "scene", message);
        }
    }
}

/// Length without squares that overflow.
fn length(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { largest * (vector / largest).length() } else { 0.0 }
}

/// What lobes hold that has to be within 0 and 1.
fn lobe_shares(material: &Material) -> Vec<(&'static str, f32)> {
    let mut shares = Vec::new();
    if let Some(lobe) = &material.anisotropy {
        shares.push(("anisotropy", lobe.strength));
    }
    if let Some(lobe) = &material.clearcoat {
        shares.extend([("clear coat", lobe.factor), ("roughness of the clear coat", lobe.roughness)]);
    }
    if let Some(lobe) = &material.iridescence {
        shares.push(("iridescence", lobe.factor));
    }
    if let Some(lobe) = &material.sheen {
        let (low, high) = (lobe.color.min_element(), lobe.color.max_element());
        shares.extend([("sheen", low), ("sheen", high), ("roughness of the sheen", lobe.roughness)]);
    }
    if let Some(lobe) = &material.diffuse_transmission {
        let (low, high) = (lobe.color.min_element(), lobe.color.max_element());
        let tint = "tint of diffuse transmission";
        shares.extend([("diffuse transmission", lobe.factor), (tint, low), (tint, high)]);
    }
    if let Some(lobe) = &material.specular_glossiness {
        let (low, high) = (lobe.specular.min_element(), lobe.specular.max_element());
        shares.extend([("glossiness", lobe.glossiness), ("reflectance", low), ("reflectance", high)]);
    }
    shares
}

#[cfg(test)]
mod tests;
