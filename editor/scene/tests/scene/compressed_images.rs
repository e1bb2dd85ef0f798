//! Images in formats that glTF itself does not know: WebP, and KTX 2 with blocks of Basis Universal.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::common::assets;
use crate::compressed::{check_damaged, read};
use crate::gltf_file::{GltfFile, SQUARE};

/// A square with a texture of these images; the texture names the first as its plain `source`.
fn textured(folder: &Path, texture: Value, images: &[(&str, &[u8])]) -> PathBuf {
    let mut file = GltfFile::new();
    let attributes = json!({"POSITION": file.floats("VEC3", 3, &SQUARE)});
    for (name, bytes) in images {
        std::fs::write(folder.join(name), bytes).unwrap();
        file.push("images", json!({"uri": name}));
    }
    file.push("textures", texture);
    file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "material": 0}]}));
    file.push("nodes", json!({"mesh": 0}));
    file.write(folder)
}

#[test]
fn webp_is_shown_and_its_fallback_when_it_is_damaged() {
    let Some(folder) = assets("gltf/BoxWebpFallback") else { return };
    let imported = read(&folder.join("box-textured-with-fallback.gltf"));
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let shown = &imported.textures[0];
    assert_eq!((shown.name.as_str(), &shown.encoded), ("cesium%20logo.webp", &None));

    let (webp, png) = (
        std::fs::read(folder.join("cesium logo.webp")).unwrap(),
        std::fs::read(folder.join("cesium logo.png")).unwrap(),
    );
    let own = tempfile::tempdir().unwrap();
    let texture = json!({"source": 0, "extensions": {"EXT_texture_webp": {"source": 1}}});
    let plain = read(&textured(own.path(), json!({"source": 0}), &[("a.png", &png)]));
    let plain = &plain.textures[0];
    assert_eq!((plain.width, plain.height), (shown.width, shown.height));
    let apart =
        plain.rgba8.iter().zip(shown.rgba8.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
    assert!(apart > 0 && apart < 3 * plain.rgba8.len() as u64, "{apart} in {} bytes", plain.rgba8.len());

    let damaged = read(&textured(own.path(), texture, &[("a.png", &png), ("b.webp", &webp[..900])]));
    assert_eq!(damaged.textures[0].rgba8, plain.rgba8);
    assert_eq!(damaged.textures[0].encoded.as_deref(), Some(&png[..]));
    assert_eq!((damaged.warnings.len(), damaged.warnings[0].place.as_str()), (1, "/images/1"));

    let alone = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
    let alone = read(&textured(own.path(), alone, &[("b.webp", &webp)]));
    assert_eq!(alone.textures[0].rgba8, shown.rgba8);
}

/// FNV-1a, 64 bits.
fn hash(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

const ETC1S: &[u8] = include_bytes!("../data/etc1s.ktx2");

/// `etc1s.ktx2` was made by the encoder of Basis Universal 1.16 from a pattern with alpha, 37 x 29 texels and its
/// mip levels; the hash is that of the texels that its own decoder gives (`cTFRGBA32`).
#[test]
fn etc1s_gives_the_texels_of_basis_universal() {
    let folder = tempfile::tempdir().unwrap();
    let texture = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
    let imported = read(&textured(folder.path(), texture, &[("a.ktx2", ETC1S)]));
    let texture = &imported.textures[0];
    assert_eq!((texture.width, texture.height, texture.placeholder), (37, 29, false));
    assert_eq!(hash(&texture.rgba8), 0xef6c_2f3f_999b_e82f);
}

#[test]
fn uastc_of_the_shared_lamp_is_read() {
    let Some(path) = assets("gltf/AnisotropyBarnLamp/glTF-KTX-BasisU/AnisotropyBarnLamp.gltf") else {
        return;
    };
    let imported = read(&path);
    assert!(!imported.textures.is_empty());
    for texture in &imported.textures {
        assert_eq!(
            (texture.width, texture.height, texture.placeholder),
            (2048, 2048, false),
            "{}",
            texture.name
        );
    }
    let normals = imported.textures.iter().find(|texture| texture.name.contains("normal")).unwrap();
    let length = |texel: &[u8; 4]| {
        let [x, y, z, _] = texel.map(|v| f64::from(v) / 127.5 - 1.0);
        (x * x + y * y + z * z).sqrt()
    };
    let texels = normals.rgba8.as_chunks::<4>().0;
    let unit = texels.iter().filter(|texel| (length(texel) - 1.0).abs() < 0.05).count();
    assert!(unit as f64 > 0.99 * texels.len() as f64, "{unit} of {} texels have length 1", texels.len());
}

#[test]
fn ktx2_that_is_not_basis_universal_or_too_large_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let changed = |at: usize, value: u32| {
        let mut bytes = ETC1S.to_vec();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    // Header: width 20, height 24, depth 28, layers 32, faces 36, supercompression 44.
    for (bytes, part) in [
        (changed(20, 100_000), "100000 x 29"),
        (changed(24, 16_000), "cut off"),
        (changed(28, 2), "two-dimensional"),
        (changed(32, 3), "two-dimensional"),
        (changed(36, 6), "two-dimensional"),
        (changed(44, 0), "it has 163, 0"),
        (changed(44, 3), "it has 163, 3"),
        (ETC1S[..400].to_vec(), "KTX 2"),
    ] {
        let texture = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
        let imported = read(&textured(folder.path(), texture, &[("a.ktx2", &bytes)]));
        assert!(imported.textures[0].placeholder, "{part}");
        assert!(imported.warnings[0].message.contains(part), "{part}: {}", imported.warnings[0]);
    }
}

#[test]
fn damaged_images_end_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let texture = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
    let model = textured(folder.path(), texture, &[("a.ktx2", ETC1S)]);
    check_damaged(&model, &folder.path().join("a.ktx2"), 2000);
    if let Some(shared) = assets("gltf/BoxWebpFallback/cesium logo.webp") {
        let texture = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
        let model = textured(folder.path(), texture, &[("b.webp", &std::fs::read(shared).unwrap())]);
        check_damaged(&model, &folder.path().join("b.webp"), 200);
    }
}
