//! The node tree with lights and cameras, in double precision.
//! In: JSON of the chosen scene. Out: parts in depth-first order. Deep trees are walked without recursion.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat4, DQuat, DVec3, Vec3};

use super::accessor::Accessors;
use super::json::{Fault, Item, held};
use super::mesh::read_weights;
use crate::assets::{Camera, Environment, Light, LightKind, Mesh, Projection};
use crate::ids::MeshId;
use crate::prefab::PartNode;
use crate::transform::{Local, Trs};

/// Radius of point and spot lights whose file gives none, metres: hard shadows, as other programs show them.
const DEFAULT_LIGHT_RADIUS_M: f64 = 0.0;
/// Full angle of directional lights whose file gives none, degrees: hard shadows likewise.
const DEFAULT_SUN_ANGLE_DEG: f64 = 0.0;
/// Most parts that one file may bring, GPU instances counted.
const MAX_PARTS: usize = 4_000_000;
/// Nearest distance drawn by cameras whose file gives none that can be used, metres.
const DEFAULT_NEAR_M: f32 = 0.01;
/// A rotation this close to unit length is left as it is, bit for bit.
const UNIT_TOLERANCE: f64 = 1e-14;

/// The tree of a scene.
#[derive(Default)]
pub(super) struct Tree {
    pub parts: Vec<PartNode>,
    /// Index of the part that a node of the file became; `None` when the scene does not have it.
    pub part_of_node: Vec<Option<u32>>,
    pub environment: Option<Environment>,
    /// How many GPU instances follow a part that has some.
    pub instanced: BTreeMap<u32, u32>,
    pub warnings: Vec<Fault>,
}

/// Reads the default scene, else the first, else all nodes.
pub(super) fn read_scene(root: &Item<'_>, accessors: &Accessors<'_>, meshes: &[Mesh]) -> Result<Tree, Fault> {
    let nodes = root.objects("nodes")?;
    let scene = chosen_scene(root)?;
    let children: Vec<Vec<usize>> =
        nodes.iter().map(|node| node.indices("children", nodes.len(), "node")).collect::<Result<_, _>>()?;
    let roots = match &scene {
        Some(scene) => scene.indices("nodes", nodes.len(), "node")?,
        None => roots_of(&children),
    };
    let reader = Reader {
        accessors,
        meshes,
        lights: match root.extension("KHR_lights_punctual")? {
            Some(extension) => extension.objects("lights")?,
            None => Vec::new(),
        },
        cameras: root.objects("cameras")?,
    };
    let mut tree =
        Tree { environment: scene.as_ref().map(read_environment).transpose()?.flatten(), ..Tree::default() };
    let scenes = root.items("scenes")?.len();
    if let Some(scene) = scene.filter(|_| scenes > 1) {
        tree.warnings
            .push(scene.fault(format!("of {scenes} scenes this one is read, the others are left out")));
    }
    tree.part_of_node = vec![None; nodes.len()];
    let mut stack: Vec<(usize, Option<u32>)> = roots.iter().rev().map(|&n| (n, None)).collect();
    let mut seen = vec![false; nodes.len()];
    while let Some((index, parent)) = stack.pop() {
        let (Some(item), Some(seen)) = (nodes.get(index), seen.get_mut(index)) else {
            continue;
        };
        if std::mem::replace(seen, true) {
            return Err(item.fault("the scene names it twice"));
        }
        let part = tree.parts.len() as u32;
        if let Some(place) = tree.part_of_node.get_mut(index) {
            *place = Some(part);
        }
        reader.read_node(item, parent, &mut tree)?;
        let below = children.get(index).into_iter().flatten().rev();
        stack.extend(below.map(|&child| (child, Some(part))));
    }
    Ok(tree)
}

/// The default scene, else the first.
pub(super) fn chosen_scene<'a>(root: &Item<'a>) -> Result<Option<Item<'a>>, Fault> {
    let mut scenes = root.objects("scenes")?;
    let index = root.index("scene", scenes.len(), "scene")?.unwrap_or(0);
    Ok((index < scenes.len()).then(|| scenes.swap_remove(index)))
}

fn roots_of(children: &[Vec<usize>]) -> Vec<usize> {
    let mut is_child = vec![false; children.len()];
    for &child in children.iter().flatten() {
        if let Some(slot) = is_child.get_mut(child) {
            *slot = true;
        }
    }
    (0..children.len()).filter(|&node| is_child.get(node) == Some(&false)).collect()
}

/// `extras.environment.constantRadiance`: the same radiance from everywhere.
fn read_environment(scene: &Item<'_>) -> Result<Option<Environment>, Fault> {
    let environment = scene.get("extras").and_then(|e| e.get("environment"));
    let Some(environment) = environment.filter(|e| e.get("constantRadiance").is_some()) else {
        return Ok(None);
    };
    let radiance = environment.f32s_or("constantRadiance", [0.0; 3])?;
    Ok(Some(Environment::Constant(Vec3::from(radiance).max(Vec3::ZERO))))
}

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    meshes: &'a [Mesh],
    lights: Vec<Item<'a>>,
    cameras: Vec<Item<'a>>,
}

impl Reader<'_> {
    /// Adds a node, and a part below it for each GPU instance.
    fn read_node(&self, item: &Item<'_>, parent: Option<u32>, tree: &mut Tree) -> Result<(), Fault> {
        let mesh = item
            .index("mesh", self.meshes.len(), "mesh")?
            .filter(|&mesh| self.meshes.get(mesh).is_some_and(|m| !m.primitives.is_empty()))
            .map(|mesh| MeshId(mesh as u64));
        let light = match item.extension("KHR_lights_punctual")? {
            Some(extension) => {
                let index = extension.required_index("light", self.lights.len(), "light")?;
                self.lights.get(index).map(|light| read_light(light, item, &mut tree.warnings)).transpose()?
            }
            None => None,
        };
        let camera = match item.index("camera", self.cameras.len(), "camera")? {
            Some(index) => match self.cameras.get(index) {
                Some(camera) => read_camera(camera, &mut tree.warnings)?,
                None => None,
            },
            None => None,
        };
        let visible = match item.extension("KHR_node_visibility")? {
            Some(extension) => extension.bool_or("visible", true)?,
            None => true,
        };
        let part = tree.parts.len() as u32;
        let instances = match (mesh, item.extension("EXT_mesh_gpu_instancing")?) {
            (Some(_), Some(extension)) => self.read_instances(&extension)?,
            _ => None,
        };
        let local = read_local(item, &mut tree.warnings)?;
        let target_count =
            mesh.and_then(|mesh| self.meshes.get(mesh.0 as usize)).map(|mesh| mesh.data.morph.len());
        let weights = match target_count {
            Some(count) if count > 0 => read_weights(item, count, &mut tree.warnings)?,
            _ => None,
        };
        tree.parts.push(PartNode {
            name: item.name()?,
            parent,
            local,
            visible,
            mesh: mesh.filter(|_| instances.is_none()),
            light,
            camera,
            skin: None,
            weights: weights.clone(),
        });
        if let Some(instances) = &instances {
            tree.instanced.insert(part, instances.len() as u32);
        }
        for local in instances.into_iter().flatten() {
            tree.parts.push(PartNode {
                parent: Some(part),
                local: local.into(),
                visible: true,
                mesh,
                weights: weights.clone(),
                ..PartNode::default()
            });
        }
        match tree.parts.len() > MAX_PARTS {
            true => Err(item.fault(format!("more than {MAX_PARTS} nodes are not read"))),
            false => Ok(()),
        }
    }

    fn read_instances(&self, extension: &Item<'_>) -> Result<Option<Vec<Trs>>, Fault> {
        let Some(attributes) = extension.child("attributes")? else {
            return Ok(None);
        };
        let mut count = None;
        let mut values = |name: &str, width: usize| {
            let Some(index) = attributes.size(name)? else {
                return Ok(None);
            };
            let accessor = self.accessors.get(index)?;
            let fault = |reason| Fault::new(format!("{}/{name}", attributes.place()), reason);
            if accessor.width != width || accessor.is_matrix {
                return Err(fault(format!("accessor {index} has the wrong type")));
            }
            if *count.get_or_insert(accessor.count) != accessor.count {
                return Err(fault("the attributes differ in their count".to_owned()));
            }
            if accessor.count > MAX_PARTS {
                return Err(fault(format!("more than {MAX_PARTS} nodes are not read")));
            }
            self.accessors.floats::<4>(index, 0.0).map(Some)
        };
        let translations = values("TRANSLATION", 3)?;
        let rotations = values("ROTATION", 4)?;
        let scales = values("SCALE", 3)?;
        let Some(count) = count else {
            return Ok(None);
        };
        let at = |list: &Option<Vec<[f32; 4]>>, i: usize| {
            let value = list.as_ref().and_then(|list| list.get(i)).copied();
            value.filter(|v| v.iter().all(|v| v.is_finite()))
        };
        let vector = |[x, y, z, _]: [f32; 4]| DVec3::new(x.into(), y.into(), z.into());
        let instance = |i| Trs {
            translation: at(&translations, i).map_or(DVec3::ZERO, vector),
            rotation: at(&rotations, i).map_or(DQuat::IDENTITY, |[x, y, z, w]| {
                unit(DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into())).unwrap_or(DQuat::IDENTITY)
            }),
            scale: at(&scales, i).map_or(DVec3::ONE, vector),
        };
        Ok(Some((0..count).map(instance).collect()))
    }
}

/// `None` for a rotation without direction.
pub(crate) fn unit(rotation: DQuat) -> Option<DQuat> {
    let length2 = rotation.length_squared();
    if (length2 - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(rotation);
    }
    let usable = length2.is_finite() && length2 > 0.0;
    usable.then(|| rotation / length2.sqrt())
}

fn read_local(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Local, Fault> {
    if let Some(columns) = item.f64s::<16>("matrix")? {
        let matrix = DMat4::from_cols_array(&columns);
        let row = matrix.row(3);
        if row.truncate() != DVec3::ZERO || row.w != 1.0 {
            warnings.push(item.fault("the last row of its matrix is not 0 0 0 1 and was ignored"));
        }
        return Ok(Local::from_affine(DAffine3::from_mat4(matrix)));
    }
    let mut trs = Trs::IDENTITY;
    if let Some(translation) = item.f64s::<3>("translation")? {
        trs.translation = translation.into();
    }
    if let Some(rotation) = item.f64s::<4>("rotation")? {
        trs.rotation = unit(DQuat::from_array(rotation)).unwrap_or_else(|| {
            warnings.push(item.fault("its rotation has length 0 and was ignored"));
            DQuat::IDENTITY
        });
    }
    if let Some(scale) = item.f64s::<3>("scale")? {
        trs.scale = scale.into();
    }
    Ok(Local::Trs(trs))
}

/// A number in `extras` of the light, else of the node that carries it.
fn extra(light: &Item<'_>, node: &Item<'_>, key: &str, default: f64) -> Result<f64, Fault> {
    for owner in [light, node] {
        if let Some(extras) = owner.get("extras")
            && extras.get(key).is_some()
        {
            extras.f32_or(key, 0.0)?;
            return extras.f64(key).map(|value| value.unwrap_or(default).max(0.0));
        }
    }
    Ok(default)
}

/// KHR_lights_punctual, with `radius` (metres) or `angle` (full angle in degrees) from `extras`.
fn read_light(item: &Item<'_>, node: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Light, Fault> {
    let range_m = match item.f64("range")? {
        Some(range) if range > 0.0 && (range as f32).is_finite() => Some(range as f32),
        _ => None,
    };
    let radius = || extra(item, node, "radius", DEFAULT_LIGHT_RADIUS_M).map(|radius| radius as f32);
    let kind = match item.text("type")? {
        Some("point") => LightKind::Point { radius_m: radius()?, range_m },
        Some("spot") => {
            let (inner, outer) = match item.child("spot")? {
                Some(spot) => (
                    spot.f32_or("innerConeAngle", 0.0)?,
                    spot.f32_or("outerConeAngle", std::f32::consts::FRAC_PI_4)?,
                ),
                None => (0.0, std::f32::consts::FRAC_PI_4),
            };
            let outer_rad =
                held(item, "spot/outerConeAngle", outer, &(0.0..=std::f32::consts::FRAC_PI_2), warnings);
            LightKind::Spot {
                radius_m: radius()?,
                range_m,
                inner_rad: held(item, "spot/innerConeAngle", inner, &(0.0..=outer_rad), warnings),
                outer_rad,
            }
        }
        Some("directional") => {
            let angle_deg = extra(item, node, "angle", DEFAULT_SUN_ANGLE_DEG)?;
            if angle_deg > 180.0 {
                let words = format!("a sun of {angle_deg} degrees; 180 are taken");
                warnings.push(item.fault(words));
            }
            let angle_deg = angle_deg.min(180.0);
            LightKind::Directional { angular_radius_rad: (angle_deg.to_radians() / 2.0) as f32 }
        }
        Some(other) => return Err(item.fault(format!("light type {other} does not exist"))),
        None => return Err(item.fault("\"type\" is missing")),
    };
    Ok(Light {
        color: Vec3::from(item.f32s_or("color", [1.0; 3])?).max(Vec3::ZERO),
        intensity: held(item, "intensity", item.f32_or("intensity", 1.0)?, &(0.0..=f32::MAX), warnings),
        kind,
    })
}

/// A camera that cannot be used is left out with a warning.
fn read_camera(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Option<Camera>, Fault> {
    let optional = |item: &Item<'_>, key: &str| {
        item.f64(key).map(|v| v.map(|v| v as f32).filter(|v| v.is_finite() && *v > 0.0))
    };
    let (projection, lens) = match item.text("type")? {
        Some("perspective") => {
            let Some(lens) = item.child("perspective")? else {
                return Err(item.fault("\"perspective\" is missing"));
            };
            let yfov_rad = lens.f32_or("yfov", 0.0)?;
            (Projection::Perspective { yfov_rad }, lens)
        }
        Some("orthographic") => {
            let Some(lens) = item.child("orthographic")? else {
                return Err(item.fault("\"orthographic\" is missing"));
            };
            let ymag_m = lens.f32_or("ymag", 0.0)?.abs();
            (Projection::Orthographic { ymag_m }, lens)
        }
        _ => return Err(item.fault("the camera is neither perspective nor orthographic")),
    };
    let usable = match projection {
        Projection::Perspective { yfov_rad } => yfov_rad > 0.0 && yfov_rad < std::f32::consts::PI,
        Projection::Orthographic { ymag_m } => ymag_m > 0.0,
    };
    if !usable {
        warnings.push(item.fault("its angle or size is 0 or less, or too wide; it was left out"));
        return Ok(None);
    }
    let aspect = match projection {
        Projection::Perspective { .. } => optional(&lens, "aspectRatio")?,
        Projection::Orthographic { ymag_m } => {
            // In double precision, so that an export can give the width that leads to the same quotient.
            let xmag = optional(&lens, "xmag")?.and(lens.f64("xmag")?);
            xmag.map(|xmag| (xmag / f64::from(ymag_m)) as f32)
        }
    };
    Ok(Some(Camera {
        projection,
        near_m: optional(&lens, "znear")?.unwrap_or(DEFAULT_NEAR_M),
        far_m: optional(&lens, "zfar")?,
        aspect,
    }))
}
