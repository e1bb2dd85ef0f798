//! What rays carry: payloads and hit attributes of a stage, read from its SPIR-V, and whether the stages of a pipeline agree.
//! A stage that reads another struct than the one that was sent is not caught by validation, and may crash a driver.

use std::collections::{BTreeMap, HashMap};

use caustica_gpu::MAX_LINKED_PAYLOAD;

use super::constants::Constants;
use super::library::Compiled;
use super::spirv::{instructions, text_of};
use crate::error::Result;

/// The attribute of a hit on a triangle (VK_KHR_ray_tracing_pipeline).
const BARYCENTRIC: &str = "float32x2";
const RAY_PAYLOAD: u32 = 5338;
const HIT_ATTRIBUTE: u32 = 5339;
const INCOMING_RAY_PAYLOAD: u32 = 5342;

/// Types, written out, such as `{vec3, uint}`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RayInterface {
    /// Payloads that a ray generation shader sends, by the names of their structs: one a kind of ray.
    sent: BTreeMap<String, String>,
    /// The payload that a hit or miss shader receives, with the name of its struct.
    received: Option<(String, String)>,
    /// What an intersection shader hands to the hit shaders.
    attribute: Option<String>,
}

impl RayInterface {
    /// Reads a module.
    pub(super) fn of(words: &[u32]) -> Self {
        let mut types: HashMap<u32, String> = HashMap::new();
        let constants = Constants::of(words);
        let mut pointees: HashMap<u32, (String, String)> = HashMap::new();
        let mut names: HashMap<u32, String> = HashMap::new();
        let mut found = Self::default();
        for instruction in instructions(words) {
            let named = |id: &u32| types.get(id).cloned().unwrap_or_else(|| String::from("?"));
            match instruction {
                (5, [_, id, text @ ..]) => drop(names.insert(*id, text_of(text))),
                (20, [_, id, ..]) => drop(types.insert(*id, "bool".to_owned())),
                (21, [_, id, width, signed, ..]) => {
                    let sign = if *signed == 0 { "u" } else { "" };
                    types.insert(*id, format!("{sign}int{width}"));
                }
                (22, [_, id, width, ..]) => drop(types.insert(*id, format!("float{width}"))),
                (23, [_, id, of, count, ..]) => drop(types.insert(*id, format!("{}x{count}", named(of)))),
                (24, [_, id, of, count, ..]) => drop(types.insert(*id, format!("{}x{count}", named(of)))),
                (28, [_, id, of, count, ..]) => {
                    let count = constants.get(*count).unwrap_or_default();
                    types.insert(*id, format!("{}[{count}]", named(of)));
                }
                (30, [_, id, members @ ..]) => {
                    let members: Vec<String> = members.iter().map(named).collect();
                    types.insert(*id, format!("{{{}}}", members.join(", ")));
                }
                (32, [_, id, RAY_PAYLOAD | HIT_ATTRIBUTE | INCOMING_RAY_PAYLOAD, of, ..]) => {
                    pointees.insert(*id, (names.get(of).cloned().unwrap_or_else(|| named(of)), named(of)));
                }
                (59, [_, pointer, _, class, ..]) => {
                    let Some((name, ty)) = pointees.get(pointer).cloned() else { continue };
                    match *class {
                        RAY_PAYLOAD => drop(found.sent.insert(name, ty)),
                        INCOMING_RAY_PAYLOAD => found.received = Some((name, ty)),
                        _ => found.attribute = Some(ty),
                    }
                }
                _ => {}
            }
        }
        found
    }
}

/// Bytes of a type that is written out.
fn bytes_of(ty: &str) -> u32 {
    let scalars = ty.split(['{', '}', ',', ' ']).filter(|part| !part.is_empty());
    let of_scalar = |part: &str| {
        let counts =
            part.split(['x', '[']).skip(1).filter_map(|n| n.trim_end_matches(']').parse::<u32>().ok());
        let bytes = if part.contains("64") { 8 } else { 4 };
        counts.fold(bytes, u32::saturating_mul)
    };
    scalars.map(of_scalar).sum()
}

/// Whether what the stages of a pipeline send is what they receive. The first one generates the rays.
///
/// # Errors
/// [`RendererError::Interface`] naming both stages: expected against found.
pub(crate) fn check_payloads(generation: &Compiled, others: &[&Compiled]) -> Result<()> {
    let refuse = |stage: &Compiled, word: &str, reason: String| Err(stage.refuse(word, reason));
    if let Some((name, ty)) = generation.rays.sent.iter().find(|(_, ty)| bytes_of(ty) > MAX_LINKED_PAYLOAD) {
        let reason = format!(
            "ray payload {name}: expected at most {MAX_LINKED_PAYLOAD} bytes, found {}",
            bytes_of(ty)
        );
        return refuse(generation, "rayPayloadEXT", reason);
    }
    let is_shadow = |stage: &Compiled| stage.name().starts_with("shadow");
    for shadow in [false, true] {
        let of_kind = || others.iter().filter(|stage| is_shadow(stage) == shadow);
        let received = || of_kind().filter_map(|stage| Some((*stage, stage.rays.received.as_ref()?)));
        let sent = received().find_map(|(_, (name, _))| generation.rays.sent.get(name));
        let first = || received().next().map(|(stage, (_, ty))| (stage.file(), ty));
        let Some((from, expected)) = sent.map(|ty| (generation.file(), ty)).or_else(first) else { continue };
        if let Some((stage, (_, found))) = received().find(|(_, (_, found))| found != expected) {
            return refuse(
                stage,
                "rayPayloadInEXT",
                format!("ray payload: expected {expected}, as in {from}, found {found}"),
            );
        }
    }
    // Shapes hand over what their intersection shader writes, if anything.
    let given = others.iter().find(|stage| stage.file().ends_with(".rint"));
    for stage in others {
        let of_shapes = stage.name().starts_with("shape");
        let expected = match given.and_then(|given| given.rays.attribute.as_deref()) {
            Some(attribute) if of_shapes => attribute,
            None if of_shapes => continue,
            _ => BARYCENTRIC,
        };
        if let Some(found) = stage.rays.attribute.as_ref().filter(|found| *found != expected) {
            return refuse(
                stage,
                "hitAttributeEXT",
                format!("hit attribute: expected {expected}, found {found}"),
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_have_sizes() {
        for (ty, bytes) in [
            ("float32", 4),
            ("{float32, uint32, uint32, uint32, float32x2, uint32}", 28),
            ("{float32x3x4, int64x2, {uint32[5]}}", 48 + 16 + 20),
        ] {
            assert_eq!(bytes_of(ty), bytes, "{ty}");
        }
    }
}
