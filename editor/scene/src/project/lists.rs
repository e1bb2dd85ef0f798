//! What the lists of a project become in memory, asked before anything of them is made.
//! In: the JSON and the record. Out: leave, or a refusal with the list that takes most.

use serde_json::Value;

use super::ProjectProblem;
use super::record::ProjectRecord;
use crate::assets::{MOST_SHAPES_IN_ALL, ShapeSource, too_many_in_all};
use crate::deep::heap_bytes;
use crate::import::Room;

/// What an element becomes beside its JSON, bytes, measured with projects of 200,000 nodes, and of 100,000 materials and 50,000
/// textures of a source that is missing.
const NODE_BYTES: usize = 900;
const MATERIAL_BYTES: usize = 2600;
const STAND_IN_BYTES: usize = 1500;
/// The JSON is there twice: as it was read, and as it was understood.
const TIMES_JSON: usize = 2;
/// What a byte of a project may become: a node may have 27 bytes and needs 2,000.
const TIMES_FILE: usize = 100;

/// Refuses a project whose lists become more than it may.
pub(super) fn require_room(bytes: usize, file: &Value, record: &ProjectRecord) -> Result<(), ProjectProblem> {
    let prefabs = record.prefabs.iter();
    let stand_ins: usize =
        prefabs.map(|prefab| prefab.meshes.len() + prefab.materials.len() + prefab.textures.len()).sum();
    let made = [
        ("prefabs", stand_ins.saturating_mul(STAND_IN_BYTES)),
        ("materials", record.materials.len().saturating_mul(MATERIAL_BYTES)),
        ("shapes", record.shapes.len().saturating_mul(MATERIAL_BYTES)),
        ("nodes", record.nodes.len().saturating_mul(NODE_BYTES)),
    ];
    let sum = made
        .iter()
        .fold(heap_bytes(file).saturating_mul(TIMES_JSON), |sum, (_, bytes)| sum.saturating_add(*bytes));
    let all = |(list, made): &(&str, usize)| file.get(list).map_or(0, heap_bytes).saturating_add(*made);
    let most = made.iter().max_by_key(|list| all(list)).map_or("", |(list, _)| list);
    Room::new(bytes, 0).require(sum, TIMES_FILE).map_err(|no_room| {
        ProjectProblem::Broken(format!("/{most}: with the other lists of the file {no_room}"))
    })?;
    shapes(record)
}

/// Refuses clouds that have more shapes than a document may, in sum.
fn shapes(record: &ProjectRecord) -> Result<(), ProjectProblem> {
    let mut sum = 0_usize;
    for (index, shapes) in record.shapes.iter().enumerate() {
        let ShapeSource::Cloud(cloud) = &shapes.mesh.source else { continue };
        sum = sum.saturating_add(cloud.count as usize);
        if sum > MOST_SHAPES_IN_ALL {
            let reason = too_many_in_all(sum);
            return Err(ProjectProblem::Broken(format!("/shapes/{index}/source/count: {reason}")));
        }
    }
    Ok(())
}
