//! Writes small glTF files with whatever data a test wants, sound or not.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

/// A file in the making.
pub struct GltfFile {
    pub json: Value,
    bytes: Vec<u8>,
}

/// One component of an accessor.
pub enum Data<'a> {
    F32(&'a [f32]),
    U8(&'a [u8]),
    U16(&'a [u16]),
    I16(&'a [i16]),
}

impl GltfFile {
    /// A file without anything in it.
    pub fn new() -> Self {
        let json = json!({"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "nodes": []});
        Self { json, bytes: Vec::new() }
    }

    fn view(&mut self, data: &Data<'_>) -> (usize, u32) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        let component = match data {
            Data::F32(values) => {
                self.bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
                5126
            }
            Data::U8(values) => {
                self.bytes.extend(*values);
                5121
            }
            Data::U16(values) => {
                self.bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
                5123
            }
            Data::I16(values) => {
                self.bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
                5122
            }
        };
        let length = self.bytes.len() - start;
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        (views.len() - 1, component)
    }

    /// Adds an accessor and returns its number.
    pub fn accessor(&mut self, kind: &str, count: usize, normalized: bool, data: Data<'_>) -> usize {
        let (view, component) = self.view(&data);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": view, "componentType": component, "type": kind, "count": count,
            "normalized": normalized}));
        accessors.len() - 1
    }

    /// Floats of a type with `width` components.
    pub fn floats(&mut self, kind: &str, width: usize, values: &[f32]) -> usize {
        self.accessor(kind, values.len() / width, false, Data::F32(values))
    }

    /// Zeros but for some elements.
    pub fn sparse(&mut self, count: usize, indices: &[u16], values: &[f32]) -> usize {
        let (indices_view, _) = self.view(&Data::U16(indices));
        let (values_view, _) = self.view(&Data::F32(values));
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"componentType": 5126, "type": "VEC3", "count": count, "sparse": {
            "count": indices.len(), "indices": {"bufferView": indices_view, "componentType": 5123},
            "values": {"bufferView": values_view}}}));
        accessors.len() - 1
    }

    /// Adds to a list at the top and returns the place.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Writes the file and returns its path.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let mut json = self.json.clone();
        if !self.bytes.is_empty() {
            json["buffers"] = json!([{"uri": "data.bin", "byteLength": self.bytes.len()}]);
        }
        std::fs::write(folder.join("data.bin"), &self.bytes).unwrap();
        let path = folder.join("file.gltf");
        std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        path
    }
}

/// Corners of a square in the plane z = 0 with two triangles.
pub const SQUARE: [f32; 18] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
