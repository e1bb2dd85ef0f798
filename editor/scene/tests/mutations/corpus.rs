//! What is damaged: small files written here, so that the test says something anywhere, and the small ones of the shared assets and of
//! the projects where they are. In: the folders. Out: seeds, sorted by name.

use std::path::{Path, PathBuf};

use caustica_scene::import::{ImportOptions, load};
use caustica_scene::{
    Camera, Cloud, Document, Edit, Environment, Light, LightKind, Local, Node, NodeKind, Project,
    ProjectMeta, ShapeSource, Target,
};
use glam::Vec3;
use image::{DynamicImage, ImageFormat, Rgb32FImage, RgbImage, RgbaImage};

use crate::rich;

/// Larger files are left to other tests: the time of a case is that of its file.
const MOST_BYTES: u64 = 48 << 10;

/// Which function reads a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Gltf,
    Obj,
    /// A glTF file for the sake of the image beside it.
    Image,
    Environment,
    Shapes,
    Project,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "glTF and GLB",
            Self::Obj => "OBJ and MTL",
            Self::Image => "PNG and JPEG",
            Self::Environment => "HDR and EXR",
            Self::Shapes => "text files of shapes",
            Self::Project => "projects",
        }
    }
}

/// A file and those that it names.
pub struct Seed {
    pub name: String,
    pub kind: Kind,
    /// Written here and sound.
    pub own: bool,
    pub files: Vec<(String, Vec<u8>)>,
    /// The file that is opened.
    pub entry: usize,
    /// How many of ten damages are its own, and not those of any file.
    pub entry_share: usize,
}

impl Seed {
    pub fn bytes(&self) -> usize {
        self.files.iter().map(|(_, bytes)| bytes.len()).sum()
    }

    pub fn write(&self, folder: &Path) {
        for (name, bytes) in &self.files {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
    }
}

/// All seeds.
pub fn seeds() -> Vec<Seed> {
    let mut seeds = written();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (folder, extensions) in [
        (root.join("../shared/assets"), &["gltf", "glb", "obj", "hdr", "exr"][..]),
        (root.join("projects"), &["json", "hdr"][..]),
    ] {
        let mut files = Vec::new();
        walk(&folder, &mut files);
        let named = |path: &&PathBuf| extensions.contains(&extension(path).as_str());
        // Two million spheres and boxes would be made anew for every case.
        let cheap = |path: &&PathBuf| !path.ends_with("cloud/cloud.caustica.json");
        let entries = files.iter().filter(named).filter(cheap);
        seeds.extend(entries.filter_map(|path| found(path, &folder)));
    }
    seeds.sort_by(|a, b| a.name.cmp(&b.name));
    seeds
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { walk(&path, files) } else { files.push(path) }
    }
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// A file with what lies beside it, unless it is large.
fn found(path: &Path, root: &Path) -> Option<Seed> {
    let folder = path.parent()?;
    let mut near = Vec::new();
    let kind = match extension(path).as_str() {
        "obj" => Kind::Obj,
        "hdr" | "exr" => Kind::Environment,
        "json" => Kind::Project,
        _ => Kind::Gltf,
    };
    match kind {
        Kind::Environment => near.push(path.to_owned()),
        _ => walk(folder, &mut near),
    }
    near.sort();
    // Others of its kind in the same folder are seeds of their own, and pictures of documentation no files of it.
    near.retain(|file| file == path || (extension(file) != extension(path) && extension(file) != "md"));
    let small = |file: &PathBuf| std::fs::metadata(file).is_ok_and(|metadata| metadata.len() <= MOST_BYTES);
    if !small(&path.to_owned()) {
        return None;
    }
    let read = |file: &PathBuf| {
        Some((file.strip_prefix(folder).ok()?.to_string_lossy().into_owned(), std::fs::read(file).ok()?))
    };
    let files: Vec<_> = near.iter().filter(|file| small(file)).filter_map(read).collect();
    let entry = files.iter().position(|(name, _)| folder.join(name) == path)?;
    let name = path.strip_prefix(root).ok()?.to_string_lossy().replace('/', " ");
    Some(Seed { name, kind, own: false, files, entry, entry_share: 7 })
}

/// A seed whose first file is opened.
fn own(name: &str, kind: Kind, files: Vec<(&str, Vec<u8>)>, entry_share: usize) -> Seed {
    let files = files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect();
    Seed { name: format!("own {name}"), kind, own: true, files, entry: 0, entry_share }
}

fn written() -> Vec<Seed> {
    let png = encoded(&rgba(9, 7), ImageFormat::Png);
    let mut seeds = vec![
        own(
            "rich.gltf",
            Kind::Gltf,
            vec![("rich.gltf", rich::json()), ("rich.bin", rich::bytes()), ("c.png", png.clone())],
            7,
        ),
        own("rich.glb", Kind::Gltf, vec![("rich.glb", rich::glb()), ("c.png", png.clone())], 9),
        own(
            "maps.obj",
            Kind::Obj,
            vec![("maps.obj", OBJ.into()), ("maps.mtl", MTL.into()), ("c.png", png.clone())],
            4,
        ),
        own("shapes.csv", Kind::Shapes, vec![("shapes.csv", CSV.into())], 10),
        project(),
    ];
    for (name, bytes) in [
        ("8-bit rgba.png", png),
        ("grey.png", encoded(&rgba(16, 3).into_luma8().into(), ImageFormat::Png)),
        ("16-bit.png", encoded(&rgba(5, 5).into_rgb16().into(), ImageFormat::Png)),
        (
            "colour.jpeg",
            encoded(
                &RgbImage::from_fn(40, 24, |x, y| image::Rgb([x as u8, y as u8, 99])).into(),
                ImageFormat::Jpeg,
            ),
        ),
    ] {
        let gltf = rich::textured(name);
        seeds.push(own(name, Kind::Image, vec![("t.gltf", gltf), (name, bytes)], 0));
    }
    let sky = Rgb32FImage::from_fn(32, 16, |x, y| image::Rgb([x as f32, y as f32 * 0.1, 1e-3]));
    for (name, format) in [("sky.hdr", ImageFormat::Hdr), ("sky.exr", ImageFormat::OpenExr)] {
        seeds.push(own(name, Kind::Environment, vec![(name, encoded(&sky.clone().into(), format))], 10));
    }
    seeds
}

fn rgba(width: u32, height: u32) -> DynamicImage {
    RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8 * 17, y as u8 * 31, 128, 255 - x as u8]))
        .into()
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

const OBJ: &str = "# a comb, a star of quads and what else there is\nmtllib maps.mtl\nv 0 0 0 1 0 0\nv 5 0 0\nv 5 0 3\nv 4 0 1\n\
    v 3 0 3\nv 2 0 1\nv 1 0 3\nv 0 1 0 0.5\nvt 0 0\nvt 1 0 0\nvt 1 1\nvn 0 1 0\nvn 0 0 1\no comb\ng a b\nusemtl wood\n\
    f 1/1/1 2/2/1 3/3/1 4/1/1 5/2/1 6/3/1 7/1/1\ns 1\ng c\nusemtl glass\nf -8//2 -7 -1\nf 1 2 \\\n 8\nl 1 2 3\np 4\n\
    o other\nusemtl mirror\nf 1/1 3/3 8/2\nf 1 2 3 8\nusemtl none\nf 2 3 8\n";

const MTL: &str = "newmtl wood\nKa 1 1 1\nKd 0.8 0.7 0.6\nKs 0.5 0.5 0.5\nKe 0 0.5 0\nNs 96\nNi 1.45\nd 0.9\nillum 2\n\
    map_Kd -s 2 2 1 -o 0.5 0 0 -clamp on c.png\nmap_d -imfchan m c.png\nmap_Ks c.png\nmap_Ke c.png\nmap_Pr c.png\nmap_Pm -imfchan r c.png\n\
    bump -bm 0.5 c.png\nnewmtl glass\nKd 0 0 0\nTf 1 0.9 1\nNi 1.5\nTr 0.9\nillum 7\nmap_Ns c.png\nNs 20\nnorm c.png\n\
    newmtl mirror\nKd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\n";

const CSV: &str = "x,y,z,r\n0,0,0,1\n1 2 3 0.5 # a remark\n-1;0;1;0.1;0.2;0.3\n";

/// A project with a prefab, shapes, lights, a camera, overrides and surroundings.
fn project() -> Seed {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("rich.glb"), rich::glb()).unwrap();
    std::fs::write(at("c.png"), encoded(&rgba(9, 7), ImageFormat::Png)).unwrap();
    let sky = Rgb32FImage::from_fn(4, 2, |x, _| image::Rgb([x as f32; 3]));
    std::fs::write(at("sky.hdr"), encoded(&sky.into(), ImageFormat::Hdr)).unwrap();
    let mut document = Document::new();
    let prefab = document.add_imported(load(&at("rich.glb"), &ImportOptions::default()).unwrap()).unwrap();
    let (node, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    let cloud = Cloud { count: 20, ..Cloud::default() };
    let (_, edit) =
        document.add_shapes_edit("cloud", ShapeSource::Cloud(cloud), &[], Local::default()).unwrap();
    document.apply(edit).unwrap();
    let light =
        Light { color: Vec3::ONE, intensity: 2.0, kind: LightKind::Point { radius_m: 0.1, range_m: None } };
    for kind in [NodeKind::Light(light), NodeKind::Camera(Camera::default()), NodeKind::Group] {
        let (_, edit) = document.add_edit(Node::new("n", kind), None);
        document.apply(edit).unwrap();
    }
    document.apply(Edit::SetVisible { target: Target::part(node, 0), visible: false }).unwrap();
    let (map, _) = caustica_scene::import::load_environment(&at("sky.hdr")).unwrap();
    let file = caustica_scene::EnvironmentFile {
        path: at("sky.hdr"),
        rotation_rad: 0.5,
        scale: 2.0,
        map: Some(map.into()),
    };
    document.apply(Edit::SetEnvironment(Environment::File(file))).unwrap();
    let path = at("p.caustica.json");
    Project::save(&path, &document, &ProjectMeta::default()).unwrap();
    let read = |name: &'static str| (name, std::fs::read(at(name)).unwrap());
    own("project", Kind::Project, ["p.caustica.json", "rich.glb", "c.png", "sky.hdr"].map(read).into(), 8)
}
