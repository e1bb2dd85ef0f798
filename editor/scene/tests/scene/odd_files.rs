//! Files as other programs and version control leave them: read, or refused by what they are.

use std::path::Path;

use caustica_scene::import::{ImportOptions, load, load_environment, load_shapes};
use caustica_scene::{Document, Project, Target, drawable, is_degenerate, is_flat};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use serde_json::json;

use crate::export::{exported, json_of, placed, read, validated};
use crate::gltf_file::{GltfFile, SQUARE};

const LFS: &str = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n";

/// A square with a texture from a file.
fn textured(image: &str) -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    let uv = file.floats("VEC2", 2, &[0.5; 12]);
    let attributes = json!({"POSITION": position, "TEXCOORD_0": uv});
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "material": 0}]}));
    file.push("materials", json!({"emissiveTexture": {"index": 0}}));
    file.push("textures", json!({"source": 0}));
    file.push("images", json!({"uri": image}));
    file.push("nodes", json!({"name": "square", "mesh": 0}));
    file
}

#[test]
fn what_git_lfs_has_not_fetched_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["a.gltf", "a.glb", "a.obj", "a.hdr", "a.xyz", "a.caustica", "image.png", "m.mtl"] {
        std::fs::write(path(name), LFS).unwrap();
    }
    std::fs::write(path("b.obj"), "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let warnings = |path: &Path| read(path).warnings.iter().map(ToString::to_string).collect::<String>();
    let model = |name: &str| load(&path(name), &ImportOptions::default()).unwrap_err().to_string();
    let file = textured("image.png").write(folder.path());
    let image = warnings(&file);
    // As long as the buffer may be, the pointer is known by its beginning.
    std::fs::write(path("data.bin"), LFS).unwrap();
    for said in [
        model("a.gltf"),
        model("a.glb"),
        model("a.obj"),
        model("file.gltf"),
        load_environment(&path("a.hdr")).unwrap_err().to_string(),
        load_shapes(&path("a.xyz")).unwrap_err().to_string(),
        Project::load(&path("a.caustica")).unwrap_err().to_string(),
        image,
        warnings(&path("b.obj")),
    ] {
        assert!(said.contains("is a Git LFS pointer") && said.contains("run `git lfs pull`"), "{said}");
    }
}

#[test]
fn a_gltf_in_utf_16_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.gltf");
    let wide: Vec<u8> = "{\"asset\":{}}".encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(&path, wide).unwrap();
    let said = load(&path, &ImportOptions::default()).unwrap_err();
    assert!(said.reason.contains("UTF-16") && said.place == "line 1 column 1", "{said}");
}

#[test]
fn a_radiance_map_may_have_line_ends_of_windows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.hdr");
    let map = |end: &str| {
        let head = ["#?RADIANCE", "# made by hand", "FORMAT=32-bit_rle_rgbe", "", "-Y 1 +X 2", ""].join(end);
        let texels = [128, 64, 13, 129, 10, 13, 10, 128];
        std::fs::write(&path, [head.as_bytes(), &texels].concat()).unwrap();
        load_environment(&path).unwrap().0.rgb
    };
    assert_eq!(map("\r\n"), map("\n"));
}

#[test]
fn names_in_quotes_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    image::RgbImage::new(1, 1).save(path("my file.png")).unwrap();
    std::fs::write(path("my lib.mtl"), "newmtl a\nmap_Kd -clamp on \"my file.png\"\n").unwrap();
    let text = "mtllib \"my lib.mtl\"\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    std::fs::write(path("a.obj"), text).unwrap();
    let imported = read(&path("a.obj"));
    assert_eq!(imported.warnings, []);
    assert_eq!(imported.textures[0].name, "my file.png");
}

#[test]
fn what_gltf_forbids_is_made_what_it_allows() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = CMYK
        .as_chunks::<2>()
        .0
        .iter()
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap());
    std::fs::write(folder.path().join("print.jpg"), bytes.collect::<Vec<u8>>()).unwrap();
    let mut file = textured("print.jpg");
    let bright = file.floats("VEC3", 3, &[2.0, 0.5, -1.0].repeat(6));
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(bright);
    let dots = json!({"mode": 0, "attributes": {"POSITION": 0, "COLOR_0": bright}});
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(dots);
    let imported = read(&file.write(folder.path()));
    let words: String = imported.warnings.iter().map(|warning| format!("{warning}\n")).collect();
    assert!(words.contains("/images/0: the image has the colours of print"), "{words}");
    let (path, report) = exported(&placed(imported), folder.path(), "out.glb");
    let said = report.warnings.iter().filter(|warning| warning.message.contains("held to 0 to 1")).count();
    assert_eq!(said, 1, "{:?}", report.warnings);
    let json = json_of(&path);
    assert_eq!(json["images"][0]["mimeType"], "image/png");
    for primitive in json["meshes"][0]["primitives"].as_array().unwrap() {
        assert!(primitive["attributes"]["COLOR_0"].is_u64(), "{json}");
    }
    let again = read(&path);
    assert_eq!(again.meshes[0].data.colors[0].truncate(), Vec3::new(1.0, 0.5, 0.0));
    if let Some(text) = validated(&[path]) {
        assert!(!text.contains("error: "), "{text}");
    }
}

#[test]
fn a_texture_whose_image_is_missing_keeps_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = placed(read(&textured("wood.png").write(folder.path())));
    for name in ["first.gltf", "second.gltf"] {
        let (path, report) = exported(&document, folder.path(), name);
        assert!(
            report.warnings.iter().any(|warning| warning.place == "texture \"wood.png\""),
            "{:?}",
            report.warnings
        );
        let again = read(&path);
        assert_eq!(again.textures[0].name, "wood.png");
        document = placed(again);
    }
}

#[test]
fn an_export_of_any_name_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
    file.push("nodes", json!({"mesh": 0}));
    let document = placed(read(&file.write(folder.path())));
    let mut names = vec!["a b%20#?.gltf", "...gltf"];
    if !cfg!(windows) {
        names.extend(["c:d.gltf", "http:x.gltf", "data:,a.gltf", "a\\b.gltf"]);
    }
    for name in names {
        let (path, _) = exported(&document, folder.path(), name);
        assert_eq!(read(&path).warnings, [], "{name}");
        exported(&document, folder.path(), name);
    }
}

#[test]
fn what_is_flat_gets_a_thickness_and_lines_do_not() {
    let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7));
    let scaled = |x, y, z| turn * DMat3::from_diagonal(DVec3::new(x, y, z)) * turn.transpose() * turn;
    let alike = DMat3::from_cols(DVec3::new(0.3, 0.4, 0.0), DVec3::new(0.3, 0.4, 0.0), DVec3::Z);
    let squeezed = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)) * turn;
    for size in [1e-9, 1.0, 1e9] {
        for flat in [scaled(1.0, 1.0, 0.0), scaled(0.0, -2.0, 1.0), scaled(1.0, 1e-3, 0.0), alike, squeezed] {
            let map = DAffine3::from_mat3_translation(flat * size, DVec3::new(1.0, 2.0, 3.0));
            assert!(is_flat(&map) && !is_degenerate(&map), "{map}");
            let drawn = drawable(&map).unwrap();
            let moved = (drawn.matrix3 - map.matrix3)
                .to_cols_array()
                .into_iter()
                .fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(moved <= 2.1e-3 * size && drawn.translation == map.translation, "{moved} of {size}");
            // As single precision holds it, too.
            let single = drawn.matrix3.as_mat3().as_dmat3() * size.recip();
            assert!(single.determinant() > 1e-9, "{single}");
            // Normals of what is seen keep their direction: that of the plane.
            let plane = |m: DMat3| {
                let normals = [m.x_axis.cross(m.y_axis), m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis)];
                normals.into_iter().max_by(|a, b| a.length().total_cmp(&b.length())).unwrap().normalize()
            };
            assert!(plane(drawn.matrix3).dot(plane(map.matrix3)).abs() > 1.0 - 1e-5, "{drawn}");
        }
        for line in
            [scaled(1.0, 0.0, 0.0), scaled(0.0, 0.0, 0.0), DMat3::from_cols(DVec3::X, DVec3::X, DVec3::X)]
        {
            let map = DAffine3::from_mat3(line * size);
            assert!(is_degenerate(&map) && !is_flat(&map), "{map}");
        }
    }
    let sound = DAffine3::from_scale(DVec3::new(-1.0, 1e-6, 1e6));
    assert_eq!((drawable(&sound), is_flat(&sound)), (Some(sound), false));
}

#[test]
fn a_number_may_name_one_thing_of_each_kind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    textured("image.png").write(folder.path());
    image::RgbImage::new(1, 1).save(folder.path().join("image.png")).unwrap();
    let own = |id: u64| json!({"id": id, "value": {"name": format!("own {id}")}});
    let node = |id: u64, overrides: serde_json::Value| json!({"id": id, "name": format!("n{id}"), "prefab": 1, "overrides": overrides});
    let text = json!({"caustica": 2,
        "prefabs": [{"id": 1, "name": "p", "source": "file.gltf", "meshes": [1, 2], "materials": [3], "textures": [1]}],
        "materials": [own(1), own(2)],
        "shapes": [{"id": 3, "name": "ball", "source": {"kind": "sphere", "centre": [0, 0, 0], "radiusM": 1}, "materials": [2]}],
        "nodes": [node(1, json!({"square": {"materials": {"0": 1}}})), node(2, json!({})),
            {"id": 3, "name": "ball", "mesh": 3, "materials": [2]}]});
    std::fs::write(&path, text.to_string()).unwrap();
    let project = Project::load(&path).unwrap();
    assert_eq!(project.warnings, []);
    let names = |document: &Document| {
        let mut names: Vec<String> =
            document.materials().map(|(_, material)| material.name.clone()).collect();
        names.sort();
        names
    };
    Project::save(&path, &project.document, &project.meta).unwrap();
    assert!(Project::load(&path).unwrap().document == project.document);
    let mut merged = Document::new();
    let edit = merged.merge_edit(&project.document, "more").unwrap().edit;
    merged.apply(edit).unwrap();
    assert_eq!(names(&merged), names(&project.document));
    let mut document = project.document;
    let (first, _) = document.nodes().next().unwrap();
    let seen = |document: &Document| document.renderable(Target::part(first, 0)).unwrap().materials;
    let before = seen(&document);
    let edit = document.make_unique_edit(first).unwrap().edit;
    document.apply(edit).unwrap();
    assert_eq!(seen(&document), before, "a material of its own is none of the prefab's");
}

/// Eight by eight texels of one colour, in the four channels of print.
const CMYK: &[u8] = b"ffd8ffee000e41646f626500640000000002ffdb004300100b0c0e0c0a100e0d0e1211101318281a181616183123251d283a333d3c3933383740485c4e404457453738506d51575f626768673e4d71797064785c656763ffdb0043011112121815182f1a1a2f634238426363636363636363636363636363636363636363636363636363636363636363636363636363636363636363636363636363ffc00014080008000804012200021101031101042200ffc400160001010100000000000000000000000000000507ffc40014100100000000000000000000000000000000ffc4001501010100000000000000000000000000000506ffc40014110100000000000000000000000000000000ffda000e040100021103110400003f00b401441b4001ffd9";
