//! A glTF file that has a little of everything that the importer reads, as `.gltf` with a buffer beside it and as `.glb`.

use serde_json::{Value, json};

/// Adds numbers as a view with an accessor.
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) {
        let view = self.view(bytes);
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "type": kind, "count": count}));
    }

    fn floats(&mut self, kind: &str, count: usize, numbers: &[f32]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, kind, count);
    }
}

fn buffer() -> Buffer {
    let mut buffer = Buffer { bytes: Vec::new(), views: Vec::new(), accessors: Vec::new() };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    buffer.floats("VEC3", 4, &corners.map(|[x, y]| [x, y, 0.0]).concat());
    buffer.floats("VEC3", 4, &[[0.0, 0.0, 1.0]; 4].concat());
    buffer.floats("VEC2", 4, &corners.concat());
    buffer.floats("VEC4", 4, &[[1.0, 0.0, 0.0, 1.0]; 4].concat());
    let indices: Vec<u8> = [0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect();
    buffer.accessor(&indices, 5123, "SCALAR", 6);
    buffer.accessor(&[0, 1, 0, 0].repeat(4), 5121, "VEC4", 4);
    buffer.floats("VEC4", 4, &[[0.75, 0.25, 0.0, 0.0]; 4].concat());
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    buffer.floats("MAT4", 2, &[identity; 2].concat());
    buffer.floats("SCALAR", 3, &[0.0, 0.5, 1.0]);
    buffer.floats("VEC3", 9, &[0.25; 27]);
    buffer.floats("VEC4", 3, &[[0.0, 0.0, 0.0, 1.0]; 3].concat());
    buffer.floats("SCALAR", 3, &[0.0, 1.0, 0.5]);
    // A morph target of zeros with one corner that is not.
    let (places, values) = (buffer.view(&[2, 0]), buffer.view(&[0; 12]));
    buffer.accessors.push(json!({"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {"count": 1,
        "indices": {"bufferView": places, "componentType": 5123}, "values": {"bufferView": values}}}));
    buffer.floats("VEC3", 2, &[0.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    buffer
}

pub fn bytes() -> Vec<u8> {
    buffer().bytes
}

fn document(buffer_source: Value, image: Value) -> Value {
    let Buffer { views, accessors, .. } = buffer();
    let texture = json!({"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1, "scale": [2, 2]}}});
    json!({
        "asset": {"version": "2.0", "generator": "test"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_variants", "KHR_texture_transform", "EXT_mesh_gpu_instancing",
            "KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_clearcoat", "KHR_materials_ior", "VENDOR_unknown"],
        "scene": 0,
        "scenes": [{"nodes": [0, 5], "extras": {"environment": {"constantRadiance": [0.1, 0.2, 0.3]}}}, {"nodes": [0]}],
        "nodes": [
            {"name": "root", "translation": [1, 2, 3], "children": [1, 2, 3, 4]},
            {"name": "skinned", "mesh": 0, "skin": 0, "weights": [0.5]},
            {"name": "joint", "rotation": [0, 0, 0, 1]},
            {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"name": "eye", "camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1]},
            {"name": "many", "mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 13}}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "meshes": [
            {"name": "plate", "weights": [0.25], "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3,
                "JOINTS_0": 5, "WEIGHTS_0": 6}, "indices": 4, "material": 0, "targets": [{"POSITION": 12}]}]},
            {"name": "fan", "primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 3, "TEXCOORD_0": 2}, "mode": 6, "material": 1,
                "extensions": {"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}}},
                {"attributes": {"POSITION": 0}, "mode": 5}]}],
        "materials": [
            {"name": "a", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.5, 1], "baseColorTexture": texture, "metallicRoughnessTexture": {"index": 0}},
                "normalTexture": {"index": 0, "scale": 0.5}, "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1], "alphaMode": "MASK",
                "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatNormalTexture": {"index": 0}}}},
            {"name": "b", "doubleSided": true, "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.3},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2}}}],
        "textures": [{"source": 0, "sampler": 0}],
        "images": [image],
        "samplers": [{"wrapS": 33071, "magFilter": 9728, "minFilter": 9985}],
        "skins": [{"joints": [2, 0], "inverseBindMatrices": 7, "skeleton": 0}],
        "animations": [{"name": "clip", "samplers": [
            {"input": 8, "output": 9, "interpolation": "CUBICSPLINE"}, {"input": 8, "output": 10}, {"input": 8, "output": 11, "interpolation": "STEP"}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}, {"sampler": 1, "target": {"node": 2, "path": "rotation"}},
                {"sampler": 2, "target": {"node": 1, "path": "weights"}}]}],
        "extensions": {"KHR_materials_variants": {"variants": [{"name": "one"}, {"name": "two"}]},
            "KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 10, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}, "extras": {"radius": 0.1}}]}},
        "accessors": accessors, "bufferViews": views, "buffers": [buffer_source]})
}

pub fn json() -> Vec<u8> {
    let image = json!({"uri": "c.png", "name": "checks"});
    serde_json::to_vec_pretty(&document(json!({"byteLength": bytes().len(), "uri": "rich.bin"}), image))
        .unwrap()
}

/// The same with the texels of an image that is named.
pub fn textured(image: &str) -> Vec<u8> {
    let uri = image.replace(' ', "%20");
    let zeros = "A".repeat(bytes().len().div_ceil(3) * 4);
    let source = json!({"byteLength": bytes().len(), "uri": format!("data:;base64,{zeros}")});
    let mut document = document(source, json!({"uri": uri}));
    // A buffer of zeros has no triangle to show and no skin to bend: only the image matters here.
    document
        .as_object_mut()
        .unwrap()
        .retain(|key, _| ["asset", "images", "textures", "samplers", "buffers"].contains(&key.as_str()));
    document["materials"] =
        json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 0}}]);
    serde_json::to_vec(&document).unwrap()
}

pub fn glb() -> Vec<u8> {
    let image = json!({"uri": "c.png"});
    let mut json = serde_json::to_vec(&document(json!({"byteLength": bytes().len()}), image)).unwrap();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = bytes();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((12 + 8 + json.len() as u32 + 8 + bytes.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bytes)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    glb
}
