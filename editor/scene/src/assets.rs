//! What nodes refer to: meshes, materials, textures, lights, cameras, the environment.
//! Plain data, large arrays behind `Arc` so that clones are cheap. Knows no file format and no device.

mod deform;
mod environment;
mod light;
mod lobes;
mod material;
mod mesh;
mod shapes;
mod texture;

pub(crate) use deform::{Bounds, join, moved};
pub use deform::{DeformPose, MorphTarget, SkinData};
pub use environment::{Environment, EnvironmentFile, MAX_RADIANCE, RadianceMap};
pub use light::{Camera, Light, LightKind, Projection};
pub use lobes::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Sheen, SpecularGlossiness};
pub use material::{AlphaMode, Material, ShadingMode};
pub use mesh::{Mesh, MeshData, Primitive};
pub use shapes::{
    Cloud, Distribution, MOST_SHAPES, Shape, ShapeFault, ShapeFile, ShapeKind, ShapeSource, Shapes,
};
pub(crate) use shapes::{MOST_SHAPES_IN_ALL, too_many_in_all};
pub use texture::{Sampler, Texture, TextureUse, Wrap};
