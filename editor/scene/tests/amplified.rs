//! Small files that name the same data many times over, or claim much that is not there: what they become in memory is
//! bounded, by sharing or by words. In a binary of its own, because it counts the memory of the whole process.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use caustica_scene::import::{ImportError, ImportOptions, load};
use caustica_scene::{Document, Local, audit};
use peak_alloc::PeakAlloc;
use serde_json::{Value, json};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What a small file may take, bytes, and a larger one by its size.
const FREE_BYTES: usize = 256 << 20;
const TIMES_FILE: usize = 10;

/// Held by what measures.
static ALONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// What becomes of a file.
enum Wanted {
    Loads,
    /// Refused, at a place that begins so.
    Refused(&'static str),
}
use Wanted::{Loads, Refused};

/// Accessors over one buffer of zeros and ones: 0 positions, 1 indices, 2 times, 3 rotations, 4 matrices, 5 joints,
/// 6 weights, 7 unit vectors, 8 nothing at all, 9 nothing but one sparse element.
struct Data {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// Vertices, keys and matrices.
const COUNT: usize = 10_000;

impl Data {
    fn new() -> Self {
        let mut data = Self { bytes: Vec::new(), views: Vec::new(), accessors: Vec::new() };
        let corners: Vec<f32> = (0..COUNT).flat_map(|i| [i as f32, (i * i % 7) as f32, 0.0]).collect();
        data.add("VEC3", 5126, COUNT, &floats(&corners));
        let indices: Vec<u8> = (0..COUNT / 3 * 3).flat_map(|i| (i as u16).to_le_bytes()).collect();
        data.add("SCALAR", 5123, COUNT / 3 * 3, &indices);
        data.add("SCALAR", 5126, COUNT, &floats(&(0..COUNT).map(|i| i as f32).collect::<Vec<_>>()));
        data.add("VEC4", 5126, COUNT, &floats(&[0.0, 0.0, 0.0, 1.0].repeat(COUNT)));
        data.add("MAT4", 5126, COUNT, &floats(&[1.0; 16].repeat(COUNT)));
        data.add(
            "VEC4",
            5123,
            COUNT,
            &(0..COUNT).flat_map(|i| [i as u16, 0, 0, 0]).flat_map(u16::to_le_bytes).collect::<Vec<_>>(),
        );
        data.add("VEC4", 5126, COUNT, &floats(&[1.0, 0.0, 0.0, 0.0].repeat(COUNT)));
        data.add("VEC3", 5126, COUNT, &floats(&[0.0, 0.0, 1.0].repeat(COUNT)));
        data.accessors.push(json!({"componentType": 5126, "type": "VEC3", "count": 1 << 24}));
        let sparse = json!({"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}});
        data.accessors
            .push(json!({"componentType": 5126, "type": "VEC3", "count": 1 << 24, "sparse": sparse}));
        data
    }

    fn add(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        let view = self.views.len() - 1;
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "type": kind, "count": count}));
    }

    /// Writes a file with these members; gives its bytes and those beside it.
    fn write(&self, path: &Path, members: Value) -> usize {
        let mut file = json!({"asset": {"version": "2.0"}, "bufferViews": self.views, "accessors": self.accessors,
            "buffers": [{"uri": "a.bin", "byteLength": self.bytes.len()}]});
        file.as_object_mut().unwrap().extend(members.as_object().unwrap().clone());
        let text = file.to_string();
        std::fs::write(path, &text).unwrap();
        std::fs::write(path.with_file_name("a.bin"), &self.bytes).unwrap();
        text.len() + self.bytes.len()
    }
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// The same value many times over.
fn times(count: usize, value: Value) -> Value {
    vec![value; count].into()
}

fn meshes(primitives: Value) -> Value {
    json!({"meshes": [{"primitives": primitives}]})
}

fn nodes(count: usize) -> Vec<Value> {
    (0..count).map(|i| json!({"name": i.to_string()})).collect()
}

/// `bytes`: of the buffer.
fn cases(bytes: usize) -> Vec<(&'static str, Value, Wanted)> {
    let bare = json!({"attributes": {"POSITION": 0}, "indices": 1});
    let lit = json!({"attributes": {"POSITION": 0, "NORMAL": 7}, "indices": 1});
    let held =
        json!({"attributes": {"POSITION": 0, "NORMAL": 7, "JOINTS_0": 5, "WEIGHTS_0": 6}, "indices": 1});
    let mut morphed = lit.clone();
    morphed["targets"] = times(5000, json!({"POSITION": 0}));
    let zeros = |accessor: u32| json!({"attributes": {"POSITION": accessor}, "targets": times(20, json!({"POSITION": accessor}))});
    let samplers = times(3000, json!({"input": 2, "output": 3}));
    let channel = |i: usize| json!({"sampler": i, "target": {"node": i, "path": "rotation"}});
    let channels: Vec<Value> = (0..3000).map(channel).collect();
    let early = json!({"input": 10, "output": 3});
    let of_material =
        |i: usize| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": i}]});
    let dressed: Vec<Value> = (0..2000).map(of_material).collect();
    let crowd =
        json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}});
    vec![
        (
            "one accessor in many targets",
            meshes(json!([morphed])),
            Refused("/accessors/0: it becomes 120000 bytes"),
        ),
        (
            "many targets beside many vertices",
            meshes(json!([lit, {"attributes": {"POSITION": 0},
            "targets": times(3000, json!({"NORMAL": 7}))}])),
            Refused("/"),
        ),
        ("one accessor in many flat primitives", meshes(times(3000, bare)), Refused("/")),
        ("one accessor in many primitives", meshes(times(6000, lit.clone())), Refused("/")),
        ("many joints in many primitives", meshes(times(6000, held)), Refused("/")),
        ("vertices that are not there", meshes(json!([zeros(8)])), Refused("/accessors/8")),
        ("vertices of which one is there", meshes(json!([zeros(9)])), Refused("/accessors/9")),
        (
            "one geometry in many meshes",
            json!({"meshes": dressed, "materials": times(2000, json!({}))}),
            Loads,
        ),
        (
            "one accessor in many points",
            meshes(times(6000, json!({"mode": 0, "attributes": {"POSITION": 0}}))),
            Loads,
        ),
        (
            "one accessor in many samplers",
            json!({"nodes": nodes(3000),
            "animations": [{"samplers": samplers, "channels": channels}]}),
            Loads,
        ),
        (
            "keys before 0 in many channels",
            json!({"nodes": nodes(3000),
            "animations": [{"samplers": times(3000, early), "channels": channels}]}),
            Refused("/animations/0/channels/"),
        ),
        (
            "one accessor in many skins",
            json!({"nodes": nodes(1),
            "skins": times(3000, json!({"joints": [0], "inverseBindMatrices": 4}))}),
            Refused("/accessors/4"),
        ),
        (
            "one accessor in many instances",
            json!({"meshes": [{"primitives": [lit]}], "nodes": times(3000, crowd)}),
            Refused("/nodes/"),
        ),
        (
            "one file in many buffers",
            json!({"buffers": times(3000, json!({"uri": "a.bin", "byteLength": bytes}))}),
            Loads,
        ),
    ]
}

#[test]
fn what_is_named_many_times_takes_no_more_memory_than_a_file_may() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let mut data = Data::new();
    data.add("SCALAR", 5126, COUNT, &floats(&(0..COUNT).map(|i| i as f32 - 1.0).collect::<Vec<_>>()));
    for (what, members, wanted) in cases(data.bytes.len()) {
        let size = data.write(&path, members);
        assert!(size < 3 << 20, "{what}: {size} bytes are not small");
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let read = load(&path, &ImportOptions::default());
        let bytes = MEMORY.peak_usage().saturating_sub(before);
        println!("{what}: {} KiB become {} MiB", size >> 10, bytes >> 20);
        assert!(bytes <= FREE_BYTES.max(TIMES_FILE * size), "{what}: {size} bytes take {bytes}");
        let said = read.err().map(|error| error.to_string());
        let fits = match (&said, wanted) {
            (None, Loads) => true,
            (Some(said), Refused(place)) => {
                said.contains(&format!("a.gltf: {place}")) && said.contains("are left")
            }
            _ => false,
        };
        assert!(fits, "{what}: {said:?}");
    }
}

/// Lists whose elements say as little as is read, with the pointer that a refusal names.
fn bare_lists(count: usize) -> Vec<(&'static str, Value)> {
    let all = |value| times(count, value);
    let lights = json!({"KHR_lights_punctual": {"lights": all(json!({"type": "point"}))}});
    let variants = json!({"KHR_materials_variants": {"variants": all(json!({"name": "a"}))}});
    let camera = json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}});
    let accessor = json!({"componentType": 5126, "type": "SCALAR", "count": 1});
    let primitive = json!({"primitives": [{"attributes": {}}]});
    vec![
        ("/materials", json!({"materials": all(json!({}))})),
        ("/nodes", json!({"nodes": all(json!({}))})),
        ("/scenes", json!({"nodes": [{}], "scenes": all(json!({}))})),
        ("/skins", json!({"nodes": [{}], "skins": all(json!({"joints": [0]}))})),
        ("/meshes", json!({"meshes": all(primitive)})),
        ("/accessors", json!({"accessors": all(accessor)})),
        (
            "/bufferViews",
            json!({"buffers": [{"uri": "data:,aaaa", "byteLength": 4}],
            "bufferViews": all(json!({"buffer": 0, "byteLength": 4}))}),
        ),
        ("/textures", json!({"textures": all(json!({}))})),
        ("/samplers", json!({"samplers": all(json!({}))})),
        ("/images", json!({"images": all(json!({"uri": "a"}))})),
        ("/cameras", json!({"cameras": all(camera)})),
        ("/animations", json!({"animations": all(json!({"channels": [], "samplers": []}))})),
        ("/extensions/KHR_lights_punctual/lights", json!({"extensions": lights})),
        ("/extensions/KHR_materials_variants/variants", json!({"extensions": variants})),
    ]
}

/// Reads a file into a document, places it and audits that, as `caustica check` does.
fn check(path: &Path) -> Result<(), ImportError> {
    let mut document = Document::new();
    let prefab = document.add_imported(load(path, &ImportOptions::default())?).unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    document.update_transforms();
    audit(&document);
    Ok(())
}

#[test]
fn many_things_that_say_nothing_are_counted() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    for count in [40_000, 400_000] {
        for (place, mut file) in bare_lists(count) {
            file["asset"] = json!({"version": "2.0"});
            let text = file.to_string();
            std::fs::write(&path, &text).unwrap();
            drop(file);
            MEMORY.reset_peak_usage();
            let before = MEMORY.current_usage();
            let said = check(&path).err().map(|error| error.to_string());
            let bytes = MEMORY.peak_usage().saturating_sub(before);
            println!("{place}: {count} become {} MiB, {} bytes each: {said:?}", bytes >> 20, bytes / count);
            let fits = said.as_ref().is_none_or(|said| said.contains(&format!("a.gltf: {place}: with")));
            assert!(fits, "{place}: {said:?}");
            let most = FREE_BYTES.max(32 * text.len());
            assert!(said.is_some() || bytes <= most, "{place}: {} bytes take {bytes}", text.len());
        }
    }
}
