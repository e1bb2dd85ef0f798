//! The structs of a module against their host twins, field by field. Enters: SPIR-V words. Leaves: nothing, or what
//! does not fit: a struct that was changed on one side only would make the device read what the host never wrote.

use std::collections::HashMap;

use super::spirv::{instructions, text_of};
use crate::gpu_types::{Twin, twins};

const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_MEMBER_DECORATE: u32 = 72;
const DECORATION_OFFSET: u32 = 35;

/// Names and offsets of the structs of a module, by SPIR-V id.
#[derive(Default)]
struct Structs {
    names: HashMap<u32, String>,
    members: HashMap<(u32, u32), String>,
    offsets: HashMap<(u32, u32), usize>,
}

/// Compares every struct that has a twin.
///
/// # Errors
/// The first difference, in words: expected against found.
pub(super) fn check(words: &[u32]) -> Result<(), String> {
    let structs = read(words);
    for (id, name) in &structs.names {
        // Struct types that lie in buffers have offsets; copies in variables have none and are of no concern.
        if structs.offsets.contains_key(&(*id, 0))
            && let Some(twin) = twins().iter().find(|twin| twin.name == name)
        {
            compare(&structs, *id, twin)?;
        }
    }
    Ok(())
}

fn compare(structs: &Structs, id: u32, twin: &Twin) -> Result<(), String> {
    let place = |field: &str, offset: usize| format!("{field} at {offset}");
    for index in 0.. {
        let member = u32::try_from(index).ok().and_then(|member| {
            let key = (id, member);
            structs.members.get(&key).zip(structs.offsets.get(&key))
        });
        let expected = twin.fields.get(index);
        match (expected, member) {
            (None, None) => return Ok(()),
            (Some((field, offset)), Some((name, found))) if field == name && offset == found => {}
            (expected, found) => {
                let expected = expected.map_or_else(|| String::from("its end"), |(f, o)| place(f, *o));
                let found = found.map_or_else(|| String::from("its end"), |(f, o)| place(f, *o));
                return Err(format!(
                    "struct {}: the host expects {expected}, the shader has {found}",
                    twin.name
                ));
            }
        }
    }
    Ok(())
}

fn read(words: &[u32]) -> Structs {
    let mut structs = Structs::default();
    for instruction in instructions(words) {
        match instruction {
            (OP_NAME, [_, id, text @ ..]) => {
                structs.names.insert(*id, text_of(text));
            }
            (OP_MEMBER_NAME, [_, id, member, text @ ..]) => {
                structs.members.insert((*id, *member), text_of(text));
            }
            (OP_MEMBER_DECORATE, [_, id, member, DECORATION_OFFSET, offset]) => {
                structs.offsets.insert((*id, *member), *offset as usize);
            }
            _ => {}
        }
    }
    structs
}
