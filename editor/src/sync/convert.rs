//! One value of the document as the renderer wants it. Positions are taken off the render origin in double precision
//! before they become single.

use std::sync::Arc;

use caustica_renderer::delta;
use caustica_scene::{self as scene, LightKind, Placed, Target};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};

use crate::default_sky::default_sky;

/// Id of the instance or light that a target brings.
pub fn instance_id(target: Target) -> delta::InstanceId {
    delta::InstanceId { node: target.node.0, part: target.part.unwrap_or(0) }
}

/// World space to render space, then to single precision.
pub fn render_from(world: &DAffine3, origin: DVec3) -> Affine3A {
    let m: DMat3 = world.matrix3;
    Affine3A::from_mat3_translation(m.as_mat3(), (world.translation - origin).as_vec3())
}

/// The same of what is drawn, which is invertible: what is flat gets a thickness; zero where nothing can be drawn.
pub fn drawn_from(world: &DAffine3, origin: DVec3) -> Affine3A {
    scene::drawable(world).map_or(Affine3A::ZERO, |world| render_from(&world, origin))
}

/// Who sees a placed mesh.
pub fn visibility_of(renderable: &scene::Renderable) -> delta::Visibility {
    delta::Visibility {
        shown: renderable.visible,
        to_camera: renderable.camera_visible,
        to_shadows: renderable.casts_shadows,
    }
}

/// A camera of the document, or of the editor, as the renderer wants it.
pub fn camera_of(
    world_from_camera: &DAffine3,
    projection: scene::Projection,
    near_m: f64,
    origin: DVec3,
) -> delta::Camera {
    delta::Camera {
        render_from_camera: render_from(&scene::rigid(world_from_camera), origin),
        projection: match projection {
            scene::Projection::Perspective { yfov_rad } => delta::Projection::Perspective { yfov_rad },
            scene::Projection::Orthographic { ymag_m } => delta::Projection::Orthographic { ymag_m },
        },
        near_m: near_m as f32,
    }
}

/// A mesh with its primitives.
pub fn mesh_of(mesh: &scene::Mesh) -> delta::Mesh {
    let data = &mesh.data;
    delta::Mesh {
        name: mesh.name.clone(),
        positions: data.positions.clone(),
        normals: data.normals.clone(),
        tangents: data.tangents.clone(),
        tex_coords0: data.tex_coords0.clone(),
        tex_coords1: data.tex_coords1.clone(),
        colors: data.colors.clone(),
        indices: data.indices.clone(),
        shapes: mesh.shapes().map_or_else(Vec::new, |shapes| shapes.list().iter().map(shape_of).collect()),
        geometries: mesh
            .primitives
            .iter()
            .map(|primitive| delta::Geometry {
                first_index: primitive.first_index,
                index_count: primitive.index_count,
                mesh_from_primitive: drawn_from(&primitive.mesh_from_primitive, DVec3::ZERO),
            })
            .collect(),
        deformation: super::deform::deformation_of(mesh),
    }
}

fn shape_of(shape: &scene::Shape) -> delta::Shape {
    let kind = match shape.kind {
        scene::ShapeKind::Sphere => delta::ShapeKind::Sphere,
        scene::ShapeKind::Box => delta::ShapeKind::Box,
    };
    delta::Shape { kind, centre: shape.centre, half_extent: shape.half_extent }
}

/// A texture.
pub fn texture_of(texture: &scene::Texture) -> delta::Texture {
    let wrap = |wrap| match wrap {
        scene::Wrap::Repeat => delta::Wrap::Repeat,
        scene::Wrap::MirroredRepeat => delta::Wrap::MirroredRepeat,
        scene::Wrap::ClampToEdge => delta::Wrap::ClampToEdge,
    };
    let sampler = &texture.sampler;
    delta::Texture {
        name: texture.name.clone(),
        width: texture.width,
        height: texture.height,
        rgba8: Arc::clone(&texture.rgba8),
        srgb: texture.srgb,
        sampler: delta::Sampler {
            wrap_u: wrap(sampler.wrap_u),
            wrap_v: wrap(sampler.wrap_v),
            mag_linear: sampler.mag_linear,
            min_linear: sampler.min_linear,
            mip_linear: sampler.mip_linear,
            mipmaps: sampler.mipmaps,
        },
    }
}

/// A light at its place; it shines along its node's -Z. The node's scale does not act on its size.
pub fn light_of(light: &Placed<scene::Light>, origin: DVec3) -> delta::Light {
    let place = scene::rigid(&light.world_from_node);
    let position = (place.translation - origin).as_vec3();
    let direction = place.transform_vector3(DVec3::NEG_Z).as_vec3().try_normalize().unwrap_or(Vec3::NEG_Y);
    let radiant = light.value.radiant().max(Vec3::ZERO);
    let limit = |range: Option<f32>| range.unwrap_or(f32::INFINITY);
    match light.value.kind {
        LightKind::Point { radius_m, range_m } => {
            delta::Light::Point { position, intensity: radiant, radius_m, range_m: limit(range_m) }
        }
        LightKind::Spot { radius_m, range_m, inner_rad, outer_rad } => delta::Light::Spot {
            position,
            direction,
            intensity: radiant,
            radius_m,
            range_m: limit(range_m),
            cos_inner: inner_rad.cos(),
            cos_outer: outer_rad.cos(),
        },
        LightKind::Directional { angular_radius_rad } => {
            delta::Light::Directional { direction, irradiance: radiant, angular_radius_rad }
        }
    }
}

/// Environment maps as the renderer wants them, made once.
#[derive(Default)]
pub struct Maps {
    sky: Option<Arc<delta::RadianceMap>>,
    file: Option<(Arc<scene::RadianceMap>, Arc<delta::RadianceMap>)>,
}

impl Maps {
    /// What surrounds the scene. A file that could not be read is black.
    pub fn environment_of(&mut self, environment: &scene::Environment) -> delta::Environment {
        match environment {
            scene::Environment::Constant(radiance) => {
                delta::Environment::Constant(radiance.min(Vec3::splat(scene::MAX_RADIANCE)))
            }
            scene::Environment::Auto | scene::Environment::DefaultSky => {
                delta::Environment::Equirectangular {
                    map: Arc::clone(self.sky.get_or_insert_with(|| Arc::new(default_sky()))),
                    rotation_rad: 0.0,
                    scale: 1.0,
                }
            }
            scene::Environment::File(file) => match &file.map {
                Some(map) => delta::Environment::Equirectangular {
                    map: self.converted(map),
                    rotation_rad: file.rotation_rad,
                    scale: file.scale,
                },
                None => delta::Environment::Constant(Vec3::ZERO),
            },
        }
    }

    fn converted(&mut self, map: &Arc<scene::RadianceMap>) -> Arc<delta::RadianceMap> {
        match &self.file {
            Some((source, converted)) if Arc::ptr_eq(source, map) => Arc::clone(converted),
            _ => {
                let converted = Arc::new(delta::RadianceMap {
                    name: map.name.clone(),
                    width: map.width,
                    height: map.height,
                    rgb: map.rgb.clone(),
                });
                self.file = Some((Arc::clone(map), Arc::clone(&converted)));
                converted
            }
        }
    }
}
