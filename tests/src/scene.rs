//! Flat scenes for tests: meshes with known shapes, and a delta that collects them. Space: render space, metres.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use caustica_renderer::delta::{
    AlphaMode, Camera, Environment, Geometry, Instance, InstanceId, Light, LightId, Material, MaterialId,
    Mesh, MeshId, Projection, Sampler, SceneDelta, ShadingMode, Texture, TextureId, TextureUse, Visibility,
};
use glam::{Affine3A, Vec2, Vec3, Vec4};

/// A scene that grows; ids count up from 1.
#[derive(Default)]
pub struct Scene {
    /// What the renderer is to be given.
    pub delta: SceneDelta,
    next: u64,
}

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self { delta: SceneDelta { reason: String::from("test scene"), ..SceneDelta::default() }, next: 0 }
    }

    /// An empty scene whose ids start past `first`, to be added to another.
    pub fn starting_at(first: u64) -> Self {
        Self { next: first, ..Self::new() }
    }

    fn number(&mut self) -> u64 {
        self.next += 1;
        self.next
    }

    /// Adds a mesh.
    pub fn mesh(&mut self, mesh: Mesh) -> MeshId {
        let id = MeshId(self.number());
        self.delta.meshes.push((id, Arc::new(mesh)));
        id
    }

    /// Adds a material.
    pub fn material(&mut self, material: Material) -> MaterialId {
        let id = MaterialId(self.number());
        self.delta.materials.push((id, material));
        id
    }

    /// Adds a texture.
    pub fn texture(&mut self, texture: Texture) -> TextureId {
        let id = TextureId(self.number());
        self.delta.textures.push((id, Arc::new(texture)));
        id
    }

    /// Places a mesh, with one material on all its geometries.
    pub fn place(&mut self, mesh: MeshId, material: MaterialId, render_from_mesh: Affine3A) -> InstanceId {
        let geometries =
            self.delta.meshes.iter().find(|(id, _)| *id == mesh).map_or(1, |(_, mesh)| mesh.geometries.len());
        let id = InstanceId { node: self.number(), part: 0 };
        let instance = Instance {
            mesh,
            render_from_mesh,
            materials: vec![material; geometries],
            visibility: Visibility::default(),
            pose: None,
        };
        self.delta.instances.push((id, instance));
        id
    }

    /// Adds a mesh of its own, with its material, in one call.
    pub fn put(&mut self, mesh: Mesh, material: Material, render_from_mesh: Affine3A) -> InstanceId {
        let (mesh, material) = (self.mesh(mesh), self.material(material));
        self.place(mesh, material, render_from_mesh)
    }

    /// Adds a light.
    pub fn light(&mut self, light: Light) -> LightId {
        let id = LightId { node: self.number(), part: 0 };
        self.delta.lights.push((id, light));
        id
    }

    /// Sets the environment to the same radiance everywhere.
    pub fn surround(&mut self, radiance: f32) {
        self.delta.environment = Some(Environment::Constant(Vec3::splat(radiance)));
    }
}

/// A point light without size or range.
pub fn point_light(position: Vec3, intensity: f32) -> Light {
    Light::Point { position, intensity: Vec3::splat(intensity), radius_m: 0.0, range_m: f32::INFINITY }
}

/// A surface that scatters light evenly and has no coat: radiance = albedo / pi x irradiance, exactly.
pub fn lambert(albedo: f32) -> Material {
    Material {
        base_color: Vec4::new(albedo, albedo, albedo, 1.0),
        metallic: 0.0,
        roughness: 1.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// A perfect mirror.
pub fn mirror() -> Material {
    Material { mode: ShadingMode::Reflective, ..Material::default() }
}

/// Smooth glass that encloses a volume.
pub fn glass(ior: f32) -> Material {
    Material { mode: ShadingMode::Refractive, ior, has_volume: true, ..Material::default() }
}

/// A surface that shows its colour whatever the light.
pub fn unlit(color: Vec3) -> Material {
    Material {
        mode: ShadingMode::Unlit,
        base_color: color.extend(1.0),
        double_sided: true,
        ..Material::default()
    }
}

/// Triangles from corners and normals, with indices; tangents along x, texture coordinates as given.
pub fn mesh_of(
    name: &str,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tex_coords0: Vec<Vec2>,
    indices: Vec<u32>,
) -> Mesh {
    let geometry = Geometry {
        first_index: 0,
        index_count: indices.len() as u32,
        mesh_from_primitive: Affine3A::IDENTITY,
    };
    Mesh {
        name: name.to_owned(),
        tangents: normals.iter().map(|n| n.any_orthonormal_vector().extend(1.0)).collect(),
        tex_coords1: Vec::new(),
        colors: Vec::new(),
        geometries: vec![geometry],
        deformation: None,
        shapes: Vec::new(),
        positions,
        normals,
        tex_coords0,
        indices,
    }
}

/// A rectangle in the plane z = 0 that faces +z, centred. Texture coordinates: 0, 0 at the upper left.
pub fn quad(width: f32, height: f32) -> Mesh {
    let (x, y) = (0.5 * width, 0.5 * height);
    let positions =
        vec![Vec3::new(-x, -y, 0.0), Vec3::new(x, -y, 0.0), Vec3::new(x, y, 0.0), Vec3::new(-x, y, 0.0)];
    let tex_coords = vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)];
    let mut mesh = mesh_of("quad", positions, vec![Vec3::Z; 4], tex_coords, vec![0, 1, 2, 0, 2, 3]);
    mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    mesh
}

/// A sphere around the origin with smooth normals; `slices` around the y axis, half as many rings.
pub fn sphere(radius: f32, slices: u32) -> Mesh {
    let rings = slices / 2;
    let (mut normals, mut tex_coords, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..=rings {
        for slice in 0..=slices {
            let (v, u) = (ring as f32 / rings as f32, slice as f32 / slices as f32);
            let (down, turn) = (v * PI, u * TAU);
            normals.push(Vec3::new(down.sin() * turn.sin(), down.cos(), down.sin() * turn.cos()));
            tex_coords.push(Vec2::new(u, v));
        }
    }
    let at = |ring: u32, slice: u32| ring * (slices + 1) + slice;
    for ring in 0..rings {
        for slice in 0..slices {
            if ring > 0 {
                indices.extend([at(ring, slice), at(ring + 1, slice), at(ring, slice + 1)]);
            }
            if ring + 1 < rings {
                indices.extend([at(ring, slice + 1), at(ring + 1, slice), at(ring + 1, slice + 1)]);
            }
        }
    }
    let positions = normals.iter().map(|n| *n * radius).collect();
    mesh_of("sphere", positions, normals, tex_coords, indices)
}

/// A cube around the origin with flat faces that look outwards.
pub fn cube(side: f32) -> Mesh {
    let (mut positions, mut normals, mut tex_coords, mut indices) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let normal = Vec3::AXES[axis] * sign;
            let (right, up) = normal.any_orthonormal_pair();
            let first = positions.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                positions.push((normal + right * x + up * y) * (0.5 * side));
                normals.push(normal);
                tex_coords.push(Vec2::new(0.5 * (x + 1.0), 0.5 * (1.0 - y)));
            }
            let turned = right.cross(up).dot(normal) < 0.0;
            let corners = if turned { [0, 2, 1, 0, 3, 2] } else { [0, 1, 2, 0, 2, 3] };
            indices.extend(corners.map(|corner| first + corner));
        }
    }
    mesh_of("cube", positions, normals, tex_coords, indices)
}

/// A checkerboard texture of `cells` x `cells`, 8 texels each.
pub fn checker(cells: u32, dark: u8, light: u8) -> Texture {
    let size = cells * 8;
    let texel = |i: u32| if ((i % size) / 8 + (i / size) / 8).is_multiple_of(2) { light } else { dark };
    let rgba8 = (0..size * size).flat_map(|i| [texel(i), texel(i), texel(i), 255]).collect();
    Texture {
        name: String::from("checker"),
        width: size,
        height: size,
        rgba8,
        srgb: true,
        sampler: Sampler::default(),
    }
}

/// A texture as it is.
pub fn plain_use(texture: TextureId) -> TextureUse {
    TextureUse { texture, tex_coord: 0, offset: Vec2::ZERO, rotation_rad: 0.0, scale: Vec2::ONE }
}

/// A pinhole camera at `eye` that looks at `target`, +y up.
pub fn camera_at(eye: Vec3, target: Vec3, yfov_rad: f32) -> Camera {
    let back = (eye - target).normalize();
    let up = if back.y.abs() > 0.999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = up.cross(back).normalize();
    Camera {
        render_from_camera: Affine3A::from_cols(
            right.into(),
            back.cross(right).into(),
            back.into(),
            eye.into(),
        ),
        projection: Projection::Perspective { yfov_rad },
        near_m: 0.01,
    }
}

/// A camera with parallel rays that looks along -z from z = `distance`; the image is `2 * ymag_m` high.
pub fn camera_parallel(distance: f32, ymag_m: f32) -> Camera {
    Camera {
        render_from_camera: Affine3A::from_translation(Vec3::new(0.0, 0.0, distance)),
        projection: Projection::Orthographic { ymag_m },
        near_m: 0.01,
    }
}

/// One of everything on a checkered floor: a mirror, a glass ball, a rough metal cube, a smooth plastic ball, a lamp
/// panel, a ball with holes; a sun, a small and a large lamp. With the camera that sees them all.
pub fn zoo() -> (Scene, Camera) {
    let mut scene = Scene::new();
    let ball = scene.mesh(sphere(0.5, 48));
    let floor_texture = scene.texture(checker(8, 60, 220));
    let floor = Material {
        base_color_texture: Some(plain_use(floor_texture)),
        metallic: 0.0,
        roughness: 0.9,
        ..Material::default()
    };
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(6.0, 6.0), floor, lying);
    let at = |x: f32, y: f32, z: f32| Affine3A::from_translation(Vec3::new(x, y, z));
    let standing = at(0.0, 1.0, -2.0);
    scene.put(quad(4.0, 2.0), Material { double_sided: true, ..mirror() }, standing);
    let clear = scene.material(Material {
        attenuation_color: Vec3::new(0.6, 0.9, 0.7),
        attenuation_distance_m: 1.0,
        ..glass(1.5)
    });
    scene.place(ball, clear, at(-0.55, 0.5, 0.6));
    let plastic = scene.material(Material {
        base_color: Vec4::new(0.7, 0.1, 0.08, 1.0),
        metallic: 0.0,
        roughness: 0.2,
        ..Material::default()
    });
    scene.place(ball, plastic, at(0.65, 0.5, 0.3));
    let gold = Material {
        base_color: Vec4::new(1.0, 0.77, 0.34, 1.0),
        metallic: 1.0,
        roughness: 0.35,
        ..Material::default()
    };
    scene.put(cube(0.8), gold, at(-1.6, 0.4, -0.4) * Affine3A::from_rotation_y(0.5));
    let holes = scene.texture(Texture {
        name: String::from("holes"),
        rgba8: checker(8, 0, 255).rgba8.chunks_exact(4).flat_map(|t| [200, 220, 255, t[0]]).collect(),
        ..checker(8, 0, 255)
    });
    let lace = scene.material(Material {
        base_color_texture: Some(plain_use(holes)),
        metallic: 0.0,
        roughness: 0.8,
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..Material::default()
    });
    scene.place(ball, lace, at(1.75, 0.5, -0.5) * Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0)));
    let lamp = Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
        emissive: Vec3::new(2.0, 3.0, 5.0),
        ..lambert(0.0)
    };
    scene.put(quad(0.5, 0.5), lamp, at(2.3, 1.0, -1.2) * Affine3A::from_rotation_y(-0.6));
    scene.light(Light::Directional {
        direction: Vec3::new(-0.4, -1.0, -0.5).normalize(),
        irradiance: Vec3::new(1.5, 1.4, 1.2),
        angular_radius_rad: 0.01,
    });
    scene.light(point_light(Vec3::new(-2.0, 2.2, 1.5), 3.0));
    scene.light(Light::Point {
        position: Vec3::new(1.5, 2.5, 2.0),
        intensity: Vec3::new(4.0, 3.0, 2.0),
        radius_m: 0.3,
        range_m: f32::INFINITY,
    });
    scene.surround(0.15);
    (scene, camera_at(Vec3::new(0.3, 1.7, 4.2), Vec3::new(0.1, 0.55, -0.2), 0.75))
}
