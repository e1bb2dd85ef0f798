//! What a glTF file has to keep to before anything of it is read: version, extensions, and that every
//! reference names something that exists. In: the JSON. Out: a [`Fault`] with the place of the first error.

use super::json::{Fault, Item};
use crate::import::short;

/// Extensions that may be required: those that are read, and those that may be left out without harm.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Whether an extension is read, so that an export writes it from what the document says.
pub(crate) fn is_read(name: &str) -> bool {
    SUPPORTED.contains(&name) && name != "KHR_xmp_json_ld"
}

/// Most extensions that a message names.
const MOST_NAMED: usize = 20;

/// Number of entries in the lists of a file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub accessors: usize,
    pub buffer_views: usize,
    pub buffers: usize,
    pub cameras: usize,
    pub images: usize,
    pub lights: usize,
    pub materials: usize,
    pub meshes: usize,
    pub nodes: usize,
    pub samplers: usize,
    pub scenes: usize,
    pub skins: usize,
    variants: usize,
}

/// Refuses another major version of glTF.
pub(super) fn version(root: &Item<'_>) -> Result<(), Fault> {
    root.object()?;
    let Some(asset) = root.child("asset")? else {
        return Err(Fault::new("/asset", "\"asset\" is missing, so it is no glTF"));
    };
    for (key, needed) in [("minVersion", false), ("version", true)] {
        let Some(version) = asset.text(key)? else {
            if needed {
                return Err(asset.fault("\"version\" is missing"));
            }
            continue;
        };
        let mut numbers = version.split('.').map(|n| n.parse::<u32>().ok());
        let (major, minor) = (numbers.next().flatten(), numbers.next().flatten());
        let readable = major == Some(2) && (needed || minor == Some(0));
        if !readable {
            let place = format!("{}/{key}", asset.place());
            return Err(Fault::new(
                place,
                format!("glTF version {} is not supported; version 2.0 is read", short(version)),
            ));
        }
    }
    Ok(())
}

/// Refuses required extensions that are not read, by name; returns the used ones that are left out.
pub(super) fn extensions(root: &Item<'_>) -> Result<Vec<String>, Fault> {
    let required = root.texts("extensionsRequired")?;
    let unknown: Vec<&str> = required.into_iter().filter(|name| !SUPPORTED.contains(name)).collect();
    if !unknown.is_empty() {
        let names: Vec<String> = unknown.into_iter().take(MOST_NAMED).map(short).collect();
        let names = names.join(", ");
        let reason = format!("the file requires {names}, which is not supported");
        return Err(Fault::new("/extensionsRequired", reason));
    }
    Ok(root
        .texts("extensionsUsed")?
        .into_iter()
        .filter(|name| !SUPPORTED.contains(name))
        .map(str::to_owned)
        .collect())
}

/// Checks every reference from one list into another.
pub(super) fn references(root: &Item<'_>) -> Result<Counts, Fault> {
    let counts = count(root)?;
    for texture in root.objects("textures")? {
        texture.index("source", counts.images, "image")?;
        texture.index("sampler", counts.samplers, "sampler")?;
        for name in ["EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif"] {
            if let Some(extension) = texture.extension(name)? {
                extension.index("source", counts.images, "image")?;
            }
        }
    }
    for image in root.objects("images")? {
        image.index("bufferView", counts.buffer_views, "buffer view")?;
        image.text("uri")?;
    }
    for mesh in root.objects("meshes")? {
        mesh_references(&mesh, &counts)?;
    }
    node_references(root, &counts)?;
    for skin in root.objects("skins")? {
        skin.index("inverseBindMatrices", counts.accessors, "accessor")?;
        skin.index("skeleton", counts.nodes, "node")?;
        if skin.indices("joints", counts.nodes, "node")?.is_empty() {
            return Err(skin.fault("it has no joints"));
        }
    }
    for animation in root.objects("animations")? {
        animation_references(&animation, &counts)?;
    }
    root.index("scene", counts.scenes, "scene")?;
    for scene in root.objects("scenes")? {
        scene.indices("nodes", counts.nodes, "node")?;
    }
    Ok(counts)
}

fn count(root: &Item<'_>) -> Result<Counts, Fault> {
    let length = |key| root.objects(key).map(|items| items.len());
    let in_extension = |name, key| match root.extension(name)? {
        Some(extension) => extension.objects(key).map(|items| items.len()),
        None => Ok(0),
    };
    Ok(Counts {
        accessors: length("accessors")?,
        buffer_views: length("bufferViews")?,
        buffers: length("buffers")?,
        cameras: length("cameras")?,
        images: length("images")?,
        lights: in_extension("KHR_lights_punctual", "lights")?,
        materials: length("materials")?,
        meshes: length("meshes")?,
        nodes: length("nodes")?,
        samplers: length("samplers")?,
        scenes: length("scenes")?,
        skins: length("skins")?,
        variants: in_extension("KHR_materials_variants", "variants")?,
    })
}

fn attribute_references(attributes: &Item<'_>, counts: &Counts) -> Result<(), Fault> {
    for name in attributes.object()?.keys() {
        attributes.index(name, counts.accessors, "accessor")?;
    }
    Ok(())
}

fn mesh_references(mesh: &Item<'_>, counts: &Counts) -> Result<(), Fault> {
    let primitives = mesh.objects("primitives")?;
    if primitives.is_empty() {
        return Err(mesh.fault("it has no primitives"));
    }
    for primitive in primitives {
        let Some(attributes) = primitive.child("attributes")? else {
            return Err(primitive.fault("\"attributes\" is missing"));
        };
        attribute_references(&attributes, counts)?;
        for target in primitive.objects("targets")? {
            attribute_references(&target, counts)?;
        }
        primitive.index("indices", counts.accessors, "accessor")?;
        primitive.index("material", counts.materials, "material")?;
        let Some(variants) = primitive.extension("KHR_materials_variants")? else {
            continue;
        };
        for mapping in variants.objects("mappings")? {
            mapping.required_index("material", counts.materials, "material")?;
            mapping.indices("variants", counts.variants, "variant")?;
        }
    }
    Ok(())
}

/// Besides the references: a node has at most one parent, and no node is above itself.
fn node_references(root: &Item<'_>, counts: &Counts) -> Result<(), Fault> {
    let mut parent: Vec<Option<usize>> = vec![None; counts.nodes];
    let nodes = root.objects("nodes")?;
    for (index, node) in nodes.iter().enumerate() {
        node.index("mesh", counts.meshes, "mesh")?;
        node.index("camera", counts.cameras, "camera")?;
        node.index("skin", counts.skins, "skin")?;
        if let Some(light) = node.extension("KHR_lights_punctual")? {
            light.required_index("light", counts.lights, "light")?;
        }
        if let Some(instancing) = node.extension("EXT_mesh_gpu_instancing")?
            && let Some(attributes) = instancing.child("attributes")?
        {
            attribute_references(&attributes, counts)?;
        }
        for child in node.indices("children", counts.nodes, "node")? {
            let Some(slot) = parent.get_mut(child) else {
                continue;
            };
            if let Some(other) = slot.replace(index) {
                return Err(node.fault(format!("its child {child} is already a child of node {other}")));
            }
        }
    }
    // With one parent at most, a node that is not above itself is reached from a root.
    let children: Vec<Vec<usize>> =
        nodes.iter().map(|node| node.indices("children", counts.nodes, "node")).collect::<Result<_, _>>()?;
    let mut reached = vec![false; counts.nodes];
    let mut stack: Vec<usize> =
        (0..counts.nodes).filter(|&node| parent.get(node).copied().flatten().is_none()).collect();
    while let Some(node) = stack.pop() {
        if let Some(slot) = reached.get_mut(node) {
            *slot = true;
        }
        stack.extend(children.get(node).into_iter().flatten());
    }
    match reached.iter().position(|reached| !reached) {
        Some(node) => Err(Fault::new(format!("/nodes/{node}"), "the node is its own ancestor")),
        None => Ok(()),
    }
}

fn animation_references(animation: &Item<'_>, counts: &Counts) -> Result<(), Fault> {
    let samplers = animation.objects("samplers")?;
    for sampler in &samplers {
        sampler.required_index("input", counts.accessors, "accessor")?;
        sampler.required_index("output", counts.accessors, "accessor")?;
    }
    for channel in animation.objects("channels")? {
        channel.required_index("sampler", samplers.len(), "sampler")?;
        if let Some(target) = channel.child("target")? {
            target.index("node", counts.nodes, "node")?;
        }
    }
    Ok(())
}
