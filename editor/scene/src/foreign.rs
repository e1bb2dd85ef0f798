//! What a source file says and the program does not know: `extras`, unknown extensions, points and lines, channels of
//! clips that cannot be played. Kept as it was read, by place in the prefab, so that an export can say it again. Nothing
//! here is looked into.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Map, Value};

/// What is kept of one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Foreign {
    /// Who made it.
    pub copyright: Option<String>,
    /// Of the object `asset`.
    pub asset: Unknown,
    /// Of the file as a whole.
    pub file: Unknown,
    /// By place in the list of the prefab.
    pub scenes: Vec<Unknown>,
    /// By index of the part.
    pub parts: BTreeMap<u32, Unknown>,
    /// By place in the list of the prefab.
    pub meshes: BTreeMap<usize, Unknown>,
    /// By mesh and primitive.
    pub primitives: BTreeMap<(usize, usize), Unknown>,
    /// By place in the list of the prefab.
    pub materials: BTreeMap<usize, Unknown>,
    /// By index of the part that carries it.
    pub lights: BTreeMap<u32, Kept>,
    /// By index of the part that carries it.
    pub cameras: BTreeMap<u32, Kept>,
    /// Lights and cameras that no node carries, as they stand.
    pub spare_lights: Vec<Value>,
    pub spare_cameras: Vec<Value>,
    /// By place in the list of the prefab.
    pub textures: BTreeMap<usize, KeptTexture>,
    /// By place in the list of the prefab.
    pub skins: BTreeMap<usize, KeptSkin>,
    /// By place in the list of the prefab.
    pub clips: BTreeMap<usize, Unknown>,
    /// Channels that are not played, by clip.
    pub channels: BTreeMap<usize, Vec<KeptChannel>>,
    /// How many of the parts that follow a part were GPU instances of its mesh.
    pub instanced: BTreeMap<u32, u32>,
    /// Variants of materials (KHR_materials_variants), as the file lists them.
    pub variants: Vec<Value>,
    /// By mesh and primitive: places of a material and of the variants that choose it.
    pub mappings: BTreeMap<(usize, usize), Vec<Mapping>>,
    /// Points and lines, by mesh.
    pub loose: BTreeMap<usize, LooseMesh>,
    /// The meshes of parts that place nothing but points and lines.
    pub loose_parts: BTreeMap<u32, usize>,
    /// What cannot be kept, in words, and how often it is there.
    pub lost: BTreeMap<String, usize>,
}

/// A material of a primitive, and the variants that choose it; places in the lists of the prefab.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mapping {
    pub material: usize,
    pub variants: Vec<usize>,
    pub name: String,
    pub unknown: Unknown,
}

/// What is kept of one object.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Unknown {
    pub extras: Option<Value>,
    pub extensions: Map<String, Value>,
    /// Of the objects in it that are read: by name of the member, or `extensions/` and the name of the extension.
    pub within: BTreeMap<String, Unknown>,
}

/// What is kept of a light or camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Kept {
    /// Which of the file it is, counted as the parts come to them.
    pub number: usize,
    pub name: String,
    pub unknown: Unknown,
}

/// What is kept of a texture, its image and its sampler. The image's name is that of the texture in the document.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct KeptTexture {
    pub name: String,
    pub unknown: Unknown,
    pub image: Unknown,
    pub sampler_name: String,
    pub sampler: Unknown,
}

/// What is kept of a skin.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct KeptSkin {
    pub name: String,
    pub unknown: Unknown,
    /// The part that is its root.
    pub skeleton: Option<u32>,
}

/// A channel that is not played.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KeptChannel {
    pub of: Pointed,
    /// What of it, as a JSON pointer that starts behind it.
    pub pointer: String,
    pub interpolation: Option<String>,
    pub input: Numbers,
    pub output: Numbers,
}

/// What a channel points into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pointed {
    /// A part, by index.
    Part(u32),
    /// A mesh, by place in the list of the prefab.
    Mesh(usize),
    /// A material, likewise.
    Material(usize),
    /// A light, by [`Kept::number`].
    Light(usize),
    /// A camera, likewise.
    Camera(usize),
    /// A light that no part carries, by place in [`Foreign::spare_lights`].
    SpareLight(usize),
    /// A camera, likewise.
    SpareCamera(usize),
    /// The file as a whole.
    File,
}

/// The elements of an accessor, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Numbers {
    /// Number of the format for the type of a component.
    pub component: u32,
    /// Name of the format for the type of an element.
    pub kind: &'static str,
    pub normalized: bool,
    pub count: usize,
    pub bytes: Arc<[u8]>,
}

/// The points and lines of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LooseMesh {
    pub primitives: Vec<Loose>,
    /// Weights of the morph targets, where the mesh has no triangles.
    pub weights: Option<Value>,
}

/// A primitive of points or lines.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loose {
    pub mode: usize,
    /// Place in the list of the prefab.
    pub material: Option<usize>,
    pub attributes: Vec<(String, Numbers)>,
    pub indices: Option<Numbers>,
    pub targets: Vec<Vec<(String, Numbers)>>,
    pub mappings: Vec<Mapping>,
    pub unknown: Unknown,
}

impl Unknown {
    pub fn is_empty(&self) -> bool {
        self.extras.is_none() && self.extensions.is_empty() && self.within.is_empty()
    }

    /// How many `extras` and extensions it holds.
    pub fn count(&self) -> usize {
        let inner: usize = self.within.values().map(Self::count).sum();
        usize::from(self.extras.is_some()) + self.extensions.len() + inner
    }

    /// Names of the unknown extensions, those of the objects in it too.
    pub fn extension_names(&self) -> Vec<&String> {
        let inner = self.within.values().flat_map(Self::extension_names);
        self.extensions.keys().chain(inner).collect()
    }
}

impl Foreign {
    /// Every object of which something is kept.
    pub fn all(&self) -> impl Iterator<Item = &Unknown> {
        let lists = self.meshes.values().chain(self.materials.values()).chain(self.parts.values());
        let carried = self.lights.values().chain(self.cameras.values()).map(|kept| &kept.unknown);
        let textures = self.textures.values().flat_map(|kept| [&kept.unknown, &kept.image, &kept.sampler]);
        let loose = self.loose.values().flat_map(|mesh| &mesh.primitives).map(|loose| &loose.unknown);
        let loose_mappings =
            self.loose.values().flat_map(|mesh| &mesh.primitives).map(|loose| &loose.mappings);
        let mappings = self.mappings.values().chain(loose_mappings).flatten().map(|mapping| &mapping.unknown);
        [&self.asset, &self.file]
            .into_iter()
            .chain(&self.scenes)
            .chain(lists)
            .chain(self.primitives.values())
            .chain(carried)
            .chain(textures)
            .chain(self.skins.values().map(|skin| &skin.unknown))
            .chain(self.clips.values())
            .chain(loose)
            .chain(mappings)
    }
}
