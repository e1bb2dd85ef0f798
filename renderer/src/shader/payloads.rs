//! What rays carry: payloads and hit attributes of a stage, read from its SPIR-V, and whether the stages of a pipeline agree.
//! A stage that reads another struct than the one that was sent is not caught by validation, and may crash a driver.

use std::collections::{BTreeMap, HashMap};

use super::library::Compiled;
use super::twins::text_of;
use crate::error::{RendererError, Result};

const HEADER_WORDS: usize = 5;
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
        let mut constants: HashMap<u32, u32> = HashMap::new();
        let mut pointees: HashMap<u32, (String, String)> = HashMap::new();
        let mut names: HashMap<u32, String> = HashMap::new();
        let mut found = Self::default();
        let mut at = HEADER_WORDS;
        while let Some(&first) = words.get(at) {
            let length = (first >> 16) as usize;
            let Some(instruction) = words.get(at..at + length).filter(|_| length > 0) else { break };
            let named = |id: &u32| types.get(id).cloned().unwrap_or_else(|| String::from("?"));
            match (first & 0xffff, instruction) {
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
                    let count = constants.get(count).copied().unwrap_or_default();
                    types.insert(*id, format!("{}[{count}]", named(of)));
                }
                (30, [_, id, members @ ..]) => {
                    let members: Vec<String> = members.iter().map(named).collect();
                    types.insert(*id, format!("{{{}}}", members.join(", ")));
                }
                (43, [_, _, id, value, ..]) => drop(constants.insert(*id, *value)),
                (32, [_, id, RAY_PAYLOAD | HIT_ATTRIBUTE | INCOMING_RAY_PAYLOAD, of, ..]) => {
                    pointees.insert(*id, (names.get(of).cloned().unwrap_or_else(|| named(of)), named(of)));
                }
                (59, [_, pointer, _, class, ..]) => {
                    let Some((name, ty)) = pointees.get(pointer).cloned() else {
                        at += length;
                        continue;
                    };
                    match *class {
                        RAY_PAYLOAD => drop(found.sent.insert(name, ty)),
                        INCOMING_RAY_PAYLOAD => found.received = Some((name, ty)),
                        _ => found.attribute = Some(ty),
                    }
                }
                _ => {}
            }
            at += length;
        }
        found
    }
}

/// Whether what the stages of a pipeline send is what they receive. The first one generates the rays.
///
/// # Errors
/// [`RendererError::Interface`] naming both stages: expected against found.
pub(crate) fn check_payloads(generation: &Compiled, others: &[&Compiled]) -> Result<()> {
    let refuse = |stage: &Compiled, reason: String| {
        Err(RendererError::Interface { file: stage.file().to_owned(), reason })
    };
    let mut kinds: BTreeMap<bool, (&str, &String)> = BTreeMap::new();
    for stage in others {
        let Some((name, found)) = &stage.rays.received else { continue };
        let sent = generation.rays.sent.get(name).map(|ty| (generation.file(), ty));
        // The stages of one kind of ray agree, also where the generation names another struct.
        let is_shadow = stage.file().rsplit('/').next().is_some_and(|file| file.starts_with("shadow"));
        let (from, expected) =
            sent.unwrap_or_else(|| *kinds.entry(is_shadow).or_insert((stage.file(), found)));
        if expected != found {
            return refuse(stage, format!("ray payload: expected {expected}, as in {from}, found {found}"));
        }
        kinds.entry(is_shadow).or_insert((from, expected));
    }
    let given = others.iter().find(|stage| stage.file().ends_with(".rint"));
    let Some((from, expected)) = given.and_then(|stage| Some((stage, stage.rays.attribute.as_ref()?))) else {
        return Ok(());
    };
    for stage in others {
        // Triangles have two floats, which stages of their own read.
        let shapes = stage.file().rsplit('/').next().is_some_and(|name| name.starts_with("shape"));
        if let Some(found) = stage.rays.attribute.as_ref().filter(|found| shapes && *found != expected) {
            let from = from.file();
            return refuse(
                stage,
                format!("hit attribute: expected {expected}, which {from} writes, found {found}"),
            );
        }
    }
    Ok(())
}
