//! What the lists of a file become in memory, so that a short text of many small things is refused before they are made.
//! In: the JSON. Out: leave, or a fault with the list that takes most. Lists of data are counted where they are read.

use super::json::{Fault, Item};
use crate::deep::heap_bytes;
use crate::import::room::Room;

/// What an element becomes beside its JSON, bytes: measured with files of 40,000 that say nothing, at the most that importing
/// them, taking them into a document and checking it need; `many_things_that_say_nothing_are_counted` (`tests/amplified.rs`)
/// prints what they take.
const WEIGHTS: [(&str, usize); 14] = [
    (NODES, 800),
    ("/materials", 2700),
    ("/scenes", 320),
    ("/skins", 600),
    ("/meshes", 600),
    ("/accessors", 400),
    ("/bufferViews", 120),
    ("/textures", 280),
    ("/samplers", 80),
    ("/images", 40),
    ("/cameras", 800),
    ("/animations", 120),
    ("/extensions/KHR_lights_punctual/lights", 620),
    ("/extensions/KHR_materials_variants/variants", 530),
];
const NODES: &str = "/nodes";

/// What a byte of a file may become in its lists, and in them and its nodes: nodes are many in sound files, and one of 60 bytes
/// needs 1,700.
const TIMES_FILE: usize = 16;
const TIMES_NODES: usize = 32;

/// Refuses a file whose lists become more than it may.
pub(super) fn require_room(root: &Item<'_>, room: &Room) -> Result<(), Fault> {
    let (mut sum, mut nodes, mut most) = (heap_bytes(root.value()), 0, ("", 0));
    for (pointer, weight) in WEIGHTS {
        let Some(list) = root.value().pointer(pointer) else { continue };
        let made = list.as_array().map_or(0, |list| list.len()).saturating_mul(weight);
        sum = sum.saturating_add(made);
        let all = made.saturating_add(heap_bytes(list));
        if pointer == NODES {
            nodes = all;
        }
        if all > most.1 {
            most = (pointer, all);
        }
    }
    let others = room.require(sum.saturating_sub(nodes), TIMES_FILE);
    others
        .and_then(|()| room.require(sum, TIMES_NODES))
        .map_err(|no_room| Fault::new(most.0, format!("with the other lists of the file {no_room}")))
}
