//! OBJ and MTL: shapes of the shared assets with known answers, and small files written here for every map and rule.

use std::path::Path;

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{AlphaMode, Material, Mesh, ShadingMode, Texture, Wrap};
use glam::{Vec2, Vec3};

use crate::common::{assert_sound, assets};

fn imported(path: &Path) -> Imported {
    let imported = load(path, &ImportOptions::default()).unwrap();
    assert_sound(path, &imported);
    imported
}

/// A square in the plane z = 0, seen from +z, with these lines of a material called `m`.
fn square(folder: &Path, mtl: &str) -> Imported {
    std::fs::write(folder.join("m.mtl"), format!("newmtl m\n{mtl}\n")).unwrap();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
    let path = folder.join("m.obj");
    std::fs::write(&path, obj).unwrap();
    imported(&path)
}

fn material(imported: &Imported) -> &Material {
    &imported.materials[0]
}

fn texture(imported: &Imported, slot: Option<caustica_scene::TextureUse>) -> &Texture {
    &imported.textures[slot.unwrap().texture.0 as usize]
}

/// Writes a PNG of one row.
fn row(folder: &Path, name: &str, texels: &[[u8; 4]]) {
    let image = image::RgbaImage::from_vec(texels.len() as u32, 1, texels.concat()).unwrap();
    image.save(folder.join(name)).unwrap();
}

fn grey(value: u8) -> [u8; 4] {
    [value, value, value, 255]
}

fn area(mesh: &Mesh) -> f32 {
    let corner = |i: u32| mesh.data.positions[i as usize];
    let (triangles, _) = mesh.data.indices.as_chunks::<3>();
    triangles
        .iter()
        .map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length() / 2.0)
        .sum()
}

fn shape(imported: &Imported) -> Vec<(&str, Vec<u32>)> {
    let corners = |mesh: &Mesh| mesh.primitives.iter().map(|primitive| primitive.index_count / 3).collect();
    imported.meshes.iter().map(|mesh| (mesh.name.as_str(), corners(mesh))).collect()
}

#[test]
fn a_concave_face_is_covered_once() {
    let Some(path) = assets("obj/concave/concave.obj") else { return };
    let imported = imported(&path);
    // Two pentagons, an arrow with its tip inside a square of 2 by 2 each, and five sides of 0.727044 height.
    let tip = 0.541_85 + 0.336_51;
    let sides = 0.727_044 * (3.0 * 2.0 + 2.0 * (1.0_f32 + tip * tip).sqrt());
    let expected = 2.0 * (4.0 - tip) + sides;
    assert!((area(&imported.meshes[0]) - expected).abs() < 1e-3, "{} {expected}", area(&imported.meshes[0]));
    assert_eq!(imported.meshes[0].triangle_count(), 16);
}

#[test]
fn negative_indices_give_the_same_box() {
    let (Some(negative), Some(positive)) = (
        assets("obj/box-negative-indices/box-negative-indices.obj"),
        assets("obj/box-positions-only/box-positions-only.obj"),
    ) else {
        return;
    };
    let corners = |path: &Path| {
        let imported = imported(path);
        let data = &imported.meshes[0].data;
        let mut corners: Vec<[i32; 3]> = data
            .indices
            .iter()
            .map(|&i| data.positions[i as usize].to_array().map(|x| (x * 1e4).round() as i32))
            .collect();
        corners.sort_unstable();
        corners
    };
    assert_eq!(corners(&negative), corners(&positive));
    assert_eq!(corners(&positive).len(), 36);
}

#[test]
fn groups_are_primitives_of_their_object() {
    if let Some(path) = assets("obj/box-objects-groups-materials/box-objects-groups-materials.obj") {
        assert_eq!(shape(&imported(&path)), [("Cube", vec![6; 6])],);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.obj");
    let faces = |o: &str, p: &str| {
        format!(
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{o}g a\nf 1 2 3\nf 1 3 4\ng b\nf 1 2 4\n{p}g c\nusemtl x\nf 1 2 3\n"
        )
    };
    std::fs::write(&path, faces("o one\n", "o two\n")).unwrap();
    let objects = imported(&path);
    assert_eq!(shape(&objects), [("one", vec![2, 1]), ("two", vec![1])]);
    assert_eq!(objects.warnings[0].place, "usemtl x");
    std::fs::write(&path, faces("", "")).unwrap();
    assert_eq!(shape(&imported(&path)), [("a", vec![2]), ("b", vec![1]), ("c", vec![1])]);
}

#[test]
fn uneven_corners_lines_and_remarks_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("u.obj");
    let obj = "v 0 0 0 1 0 0\nv 1 0 0 # no colour\nv 1 1 0\nv 0 1 0\nvt .25\nvt 1 1\nvn 0 0 -1\n\
               f 1/1 2 3/2/1 # half a corner\nf 1//1 3//1 \\\n 4//1\nl 1 2 3 4\np 1\nf 1 2\n";
    std::fs::write(&path, obj).unwrap();
    let imported = imported(&path);
    let data = &imported.meshes[0].data;
    let corner = |k: usize| data.indices[k] as usize;
    assert_eq!(data.indices.len(), 6, "the line of four points is no face");
    assert_eq!(data.tex_coords0[corner(0)], Vec2::new(0.25, 1.0));
    assert_eq!(data.tex_coords0[corner(2)], Vec2::new(1.0, 0.0));
    // Normals that are given stay; those that are missing are the face's.
    assert_eq!([0, 1, 2, 3].map(|k| data.normals[corner(k)].z), [1.0, 1.0, -1.0, -1.0]);
    assert_eq!(data.colors[corner(0)].to_array(), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(data.colors[corner(1)].to_array(), [1.0; 4]);
    let found: Vec<&str> = imported.warnings.iter().map(|warning| warning.message.as_str()).collect();
    assert_eq!(
        found,
        [
            "1 face of fewer than three corners was left out",
            "2 points, lines, curves or surfaces were left out"
        ]
    );
}

#[test]
fn a_bad_line_of_a_library_costs_that_line_alone() {
    let folder = tempfile::tempdir().unwrap();
    let imported = square(
        folder.path(),
        "Kd 1 1\nKs 0.5 x 1\nNs\nd -halo 0.25\nKe 0 nan 0\nTr 0\nNi 1.4\nrefl a.png\nmap_Kd -s 2",
    );
    let material = material(&imported);
    assert_eq!((material.base_color.w, material.ior), (0.25, 1.4));
    let places: Vec<&str> = imported.warnings.iter().map(|warning| warning.place.as_str()).collect();
    assert_eq!(places, ["line 9", "line 2", "line 3", "line 6", "line 4", "line 10"]);
    assert!(imported.warnings.iter().all(|warning| warning.file.ends_with("m.mtl")));
    assert_eq!(
        imported.warnings[1].message,
        "expected one or three numbers, found \"1 1\"; the line is left out"
    );
}

#[test]
fn options_of_a_map_are_its_transform() {
    let folder = tempfile::tempdir().unwrap();
    row(folder.path(), "old wood.png", &[grey(10), grey(20)]);
    let imported = square(
        folder.path(),
        "Kd 0 0 0\nmap_Kd -s 2 4 1 -o 0.5 0.25 -clamp on -mm 0 1 -blendu off old wood.png",
    );
    let slot = material(&imported).base_color_texture.unwrap();
    assert_eq!((slot.scale, slot.offset), (Vec2::new(2.0, 4.0), Vec2::new(0.5, -3.25)));
    let texture = &imported.textures[0];
    assert!(texture.srgb && texture.sampler.wrap_u == Wrap::ClampToEdge && texture.encoded.is_some());
    assert_eq!(material(&imported).base_color.truncate(), Vec3::ONE, "black beside a map would hide it");
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
}

#[test]
fn opacity_goes_into_the_base_colour() {
    let folder = tempfile::tempdir().unwrap();
    row(folder.path(), "colour.png", &[[200, 100, 50, 255], [0, 0, 250, 255]]);
    row(folder.path(), "holes.png", &[grey(0), grey(255)]);
    row(folder.path(), "shades.png", &[grey(255), grey(255), grey(90), grey(255)]);
    row(folder.path(), "alpha.png", &[[9, 9, 9, 0], [9, 9, 9, 255]]);
    row(folder.path(), "full.png", &[grey(255)]);
    let texels =
        |imported: &Imported| texture(imported, material(imported).base_color_texture).rgba8.to_vec();

    let holes = square(folder.path(), "map_Kd colour.png\nmap_d holes.png");
    assert_eq!(material(&holes).alpha, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(texels(&holes), [200, 100, 50, 0, 0, 0, 250, 255]);
    assert_eq!((holes.textures.len(), holes.textures[0].encoded.is_none()), (1, true));

    let shades = square(folder.path(), "map_Kd colour.png\nmap_d shades.png");
    assert_eq!(material(&shades).alpha, AlphaMode::Blend);
    let expected = [[200, 100, 50, 255], [200, 100, 50, 255], [0, 0, 250, 90], [0, 0, 250, 255]];
    assert_eq!(texels(&shades), expected.concat());

    let alpha = square(folder.path(), "Kd 0.1 0.2 0.3\nmap_d alpha.png");
    assert_eq!(texels(&alpha), [255, 255, 255, 0, 255, 255, 255, 255]);
    assert_eq!(material(&alpha).base_color.truncate(), Vec3::new(0.1, 0.2, 0.3));
    let luminance = square(folder.path(), "map_d -imfchan l alpha.png");
    assert_eq!((texels(&luminance)[3], material(&luminance).alpha), (9, AlphaMode::Blend));

    assert_eq!(material(&square(folder.path(), "map_d full.png")).alpha, AlphaMode::Opaque);
    assert_eq!(material(&square(folder.path(), "Tr 0.75\nmap_d full.png")).alpha, AlphaMode::Blend);
    assert_eq!(material(&square(folder.path(), "Tr 0.75")).base_color.w, 0.25);
    assert_eq!(material(&square(folder.path(), "Tr 0.75\nd 0.5")).base_color.w, 0.5);
    let apart = square(folder.path(), "map_Kd colour.png\nmap_d -s 2 2 holes.png");
    assert!(apart.warnings[0].message.contains("colour.png") && apart.warnings[0].place == "line 3");
}

#[test]
fn roughness_and_metalness_share_a_texture() {
    let folder = tempfile::tempdir().unwrap();
    row(folder.path(), "rough.png", &[grey(10), grey(20)]);
    row(folder.path(), "metal.png", &[grey(30), grey(40)]);
    row(folder.path(), "packed.png", &[[1, 2, 3, 255]]);
    row(folder.path(), "factor.png", &[grey(0), grey(255)]);
    let surface = |imported: &Imported| {
        let material = material(imported);
        let texture = texture(imported, material.metallic_roughness_texture);
        assert!(!texture.srgb);
        (material.roughness, material.metallic, texture.rgba8.to_vec())
    };
    let both = square(folder.path(), "map_Pr rough.png\nmap_Pm metal.png");
    assert_eq!(surface(&both), (1.0, 1.0, vec![255, 10, 30, 255, 255, 20, 40, 255]));
    let packed = square(folder.path(), "Pr 0.5\nPm 0.25\nmap_Pr packed.png\nmap_Pm packed.png");
    assert_eq!(surface(&packed), (0.5, 0.25, vec![255, 2, 3, 255]));
    let metal = square(folder.path(), "Pr 0.5\nmap_Pm metal.png");
    assert_eq!(surface(&metal), (0.5, 1.0, vec![255, 255, 30, 255, 255, 255, 40, 255]));
    // (2 / (30 + 2))^(1/4) = 0.5, and 1 for an exponent of 0.
    let exponents = square(folder.path(), "Ns 30\nmap_Ns factor.png");
    assert_eq!(surface(&exponents), (1.0, 0.0, vec![255, 255, 255, 255, 255, 128, 255, 255]));
}

#[test]
fn heights_become_normals_and_normal_maps_stay() {
    let folder = tempfile::tempdir().unwrap();
    row(folder.path(), "heights.png", &[grey(0), grey(255), grey(255), grey(0)]);
    row(folder.path(), "normals.png", &[[128, 128, 255, 255], [200, 128, 230, 255]]);
    let normals = |mtl: &str| {
        let imported = square(folder.path(), mtl);
        let material = material(&imported);
        let texture = texture(&imported, material.normal_texture);
        assert!(!texture.srgb);
        (material.normal_scale, texture.rgba8.to_vec())
    };
    // A slope of half a texel's height a texel: normal (-0.5, 0, 1) / sqrt(1.25).
    let (left, right, up) = ([70, 128, 242, 255], [185, 128, 242, 255], [128, 128, 255, 255]);
    assert_eq!(normals("bump heights.png"), (1.0, [left, left, right, right].concat()));
    assert_eq!(normals("map_Bump -bm -1 heights.png"), (1.0, [right, right, left, left].concat()));
    assert_eq!(normals("map_bump -bm 0 heights.png"), (1.0, [up; 4].concat()));
    let as_they_are = vec![128, 128, 255, 255, 200, 128, 230, 255];
    assert_eq!(normals("bump -bm 0.5 normals.png"), (0.5, as_they_are.clone()));
    assert_eq!(normals("norm normals.png"), (1.0, as_they_are));
    // Green points up in the image: it falls towards a step above, whatever the file's order of rows.
    let column = image::RgbaImage::from_vec(1, 3, [grey(255), grey(0), grey(0)].concat()).unwrap();
    column.save(folder.path().join("column.png")).unwrap();
    let (_, texels) = normals("bump -clamp on column.png");
    assert!(texels[5] < 120 && texels[9] == 128, "{texels:?}");
}

#[test]
fn colour_maps_have_their_places() {
    let folder = tempfile::tempdir().unwrap();
    row(folder.path(), "a.png", &[grey(100)]);
    let imported =
        square(folder.path(), "Ks 0.25 0.5 0.5\nmap_Ks a.png\nKe 0 0 0\nmap_Ke a.png\nmap_Kd a.png");
    let material = material(&imported);
    assert_eq!((material.specular, material.specular_color), (1.0, Vec3::new(0.5, 1.0, 1.0)));
    assert_eq!(material.emitted_radiance(), Vec3::ONE);
    assert_eq!(imported.textures.len(), 1, "one texture for three uses");
    for slot in [material.specular_color_texture, material.emissive_texture, material.base_color_texture] {
        assert!(texture(&imported, slot).srgb);
    }
    let plain = square(folder.path(), "Ks 0.25 0.5 0.5\nKe 4 2 0");
    assert_eq!((self::material(&plain).specular, self::material(&plain).specular_color.x), (1.0, 0.5));
    assert_eq!(self::material(&plain).emitted_radiance(), Vec3::new(4.0, 2.0, 0.0));
}

#[test]
fn illumination_models_choose_mirrors_and_glass() {
    let folder = tempfile::tempdir().unwrap();
    let mode = |mtl: &str| material(&square(folder.path(), mtl)).mode;
    for illum in [3, 5] {
        assert_eq!(
            mode(&format!("Kd 0.01 0.01 0.01\nKs 0.9 0.8 0.7\nillum {illum}")),
            ShadingMode::Reflective
        );
        assert_eq!(mode(&format!("Kd 0.5 0.5 0.5\nKs 0.9 0.8 0.7\nillum {illum}")), ShadingMode::Pbr);
    }
    for illum in [4, 6, 7, 9] {
        assert_eq!(mode(&format!("Kd 0.5 0.5 0.5\nd 0.5\nillum {illum}")), ShadingMode::Refractive);
        assert_eq!(mode(&format!("Kd 0 0 0\nTf 1 0.5 1\nillum {illum}")), ShadingMode::Refractive);
        assert_eq!(mode(&format!("Kd 0.5 0.5 0.5\nillum {illum}")), ShadingMode::Pbr);
    }
    for illum in [0, 1, 2, 8, 10] {
        assert_eq!(mode(&format!("Kd 0 0 0\nKs 1 1 1\nd 0.5\nTf 1 1 1\nillum {illum}")), ShadingMode::Pbr);
    }
    let mirror = square(folder.path(), "Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3");
    assert_eq!(material(&mirror).base_color.to_array(), [0.9, 0.8, 0.7, 1.0]);
    let glass = square(folder.path(), "Kd 0 0 0\nTf 1 0.5 1\nNi 1.7\nillum 7");
    assert_eq!((material(&glass).base_color.y, material(&glass).ior), (0.5, 1.7));
    assert_eq!(material(&glass).alpha, AlphaMode::Opaque);
}

#[test]
fn libraries_are_found_by_names_with_blanks_and_in_lists() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("my own.mtl"), "newmtl a\nKd 1 0 0\n").unwrap();
    std::fs::write(folder.path().join("sub/b.mtl"), "newmtl b\nmap_Kd b.png\n").unwrap();
    row(&folder.path().join("sub"), "b.png", &[grey(77)]);
    let path = folder.path().join("l.obj");
    let obj = "mtllib my own.mtl\nmtllib sub/b.mtl absent.mtl\nmtllib my own.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\n\
               usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n";
    std::fs::write(&path, obj).unwrap();
    let imported = imported(&path);
    let names: Vec<&str> = imported.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    let used: Vec<u64> = imported.meshes[0].primitives.iter().map(|primitive| primitive.material.0).collect();
    assert_eq!(used, [0, 1]);
    assert_eq!(imported.textures[0].rgba8[0], 77, "the image beside its library");
    assert_eq!(imported.warnings.len(), 1);
    assert_eq!(imported.warnings[0].place, "mtllib absent.mtl");
}

/// An OBJ file with a library in a folder below it.
fn in_sub_folder(folder: &Path, mtl: &str) -> Imported {
    std::fs::create_dir_all(folder.join("model/sub")).unwrap();
    std::fs::write(folder.join("model/sub/a.mtl"), format!("newmtl m\n{mtl}\n")).unwrap();
    let path = folder.join("model/m.obj");
    let obj = "mtllib .\\sub\\a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl m\nf 1 2 3\n";
    std::fs::write(&path, obj).unwrap();
    imported(&path)
}

#[test]
fn a_library_in_a_folder_below_reaches_up_to_that_of_the_model() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("model")).unwrap();
    row(folder.path(), "outside.png", &[grey(9)]);
    row(&folder.path().join("model"), "red.png", &[[255, 0, 0, 255]]);
    for name in ["../red.png", "..\\red.png", "red.png"] {
        let imported = in_sub_folder(folder.path(), &format!("map_Kd {name}"));
        assert!(imported.warnings.is_empty(), "{name}: {:?}", imported.warnings);
        let map = texture(&imported, material(&imported).base_color_texture);
        assert_eq!(&map.rgba8[..4], [255, 0, 0, 255], "{name}");
    }
    let said =
        |name: &str| in_sub_folder(folder.path(), &format!("map_Kd {name}")).warnings[0].message.clone();
    assert!(said("../../outside.png").contains("reaches above the folder of the model"));
    assert!(said("../absent.png").contains("cannot be opened"));
}

#[test]
fn a_face_of_too_many_corners_says_so() {
    let folder = tempfile::tempdir().unwrap();
    // A comb: concave, and nowhere across itself.
    let teeth = 9_000;
    let mut obj = String::new();
    for tooth in 0..teeth {
        obj += &format!("v {} 1 0\nv {tooth}.5 0.5 0\n", tooth);
    }
    obj += &format!("v {teeth} -1 0\nv 0 -1 0\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.2 0.2 0\n");
    let all: Vec<String> = (1..=2 * teeth + 2).map(|corner| corner.to_string()).collect();
    obj += &format!("f {}\n", all.join(" "));
    let path = folder.path().join("comb.obj");
    std::fs::write(&path, &obj).unwrap();
    let said = |path: &Path| {
        let imported = load(path, &ImportOptions::default()).unwrap();
        imported.warnings.into_iter().map(|warning| warning.message).collect::<Vec<_>>()
    };
    let words = said(&path);
    let large = "1 face has more than 16384 corners, too many to be clipped";
    assert!(words.iter().any(|word| word.starts_with(large)), "{words:?}");
    assert!(!words.iter().any(|word| word.contains("crosses itself")), "{words:?}");
}

#[test]
fn text_in_utf16_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\n";
    let marked: Vec<u8> =
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let bare: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let path = folder.path().join("a.obj");
    for bytes in [&marked, &bare] {
        std::fs::write(&path, bytes).unwrap();
        let error = load(&path, &ImportOptions::default()).unwrap_err().to_string();
        assert!(error.contains("a.obj: is text in UTF-16"), "{error}");
        let shapes = folder.path().join("a.xyz");
        std::fs::write(&shapes, bytes).unwrap();
        let error = caustica_scene::import::load_shapes(&shapes).unwrap_err().to_string();
        assert!(error.contains("is text in UTF-16"), "{error}");
    }
    std::fs::write(&path, format!("{text}v 1 0 0\nv 0 1 0\nf 1 2 3\n")).unwrap();
    std::fs::write(folder.path().join("a.mtl"), &marked).unwrap();
    let imported = load(&path, &ImportOptions::default()).unwrap();
    assert!(imported.warnings[0].message.contains("a.mtl: is text in UTF-16"), "{:?}", imported.warnings);
}

#[test]
fn line_ends_of_old_macs_are_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.mtl"), "newmtl a\rKd 0 0 1\rnewmtl b\rKd 1 0 0\r").unwrap();
    let path = folder.path().join("mac.obj");
    let obj = "mtllib m.mtl\rv 0 0 0\rv 1 0 0\rv 0 1 0\rusemtl b\rf 1 2 3\r";
    std::fs::write(&path, obj).unwrap();
    let imported = imported(&path);
    assert_eq!((imported.meshes[0].triangle_count(), imported.materials.len()), (1, 2));
    std::fs::write(&path, obj.replace("v 1 0 0", "v 1 0 x")).unwrap();
    let error = load(&path, &ImportOptions::default()).unwrap_err();
    assert_eq!((error.place.as_str(), error.reason.as_str()), ("line 3", "\"x\" is not a number"));
}

#[test]
fn a_file_that_shows_nothing_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nothing.obj");
    let nothing = "the file holds no triangle that could be shown";
    let not_finite = format!("a position is not finite, and {nothing}");
    let flat = "1 triangle without area or with positions that are not finite was removed";
    for (text, place, reason) in [
        ("v 0 0 0\nv 1e308 0 0\nv 0 1 0\nf 1 2 3\n", "line 2", not_finite.clone()),
        ("\nv 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "line 4", not_finite),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "", format!("{nothing}: {flat}")),
        ("v 0 0 0\n", "", format!("{nothing}: it has no faces")),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = load(&path, &ImportOptions::default()).unwrap_err();
        assert_eq!((error.place.as_str(), error.reason), (place, reason), "{text:?}");
    }
}
