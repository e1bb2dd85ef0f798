//! What a view can show beside the finished picture: names, and what the colours mean.

use serde::{Deserialize, Serialize};

/// What a view shows: the image, one of the intermediate targets, or what a pass of its own finds out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Show {
    /// The finished image.
    #[default]
    Image,
    /// Base colour.
    BaseColor,
    /// Shading normal in render space.
    Normal,
    /// Geometric normal in render space.
    GeometricNormal,
    /// Front or back.
    Facing,
    /// Depth.
    Depth,
    /// Metalness.
    Metallic,
    /// Roughness.
    Roughness,
    /// Occlusion textures.
    Occlusion,
    /// Motion vectors.
    Motion,
    /// Emitted radiance.
    Emissive,
    /// A colour an instance.
    Instance,
    /// A colour a geometry of an instance.
    Primitive,
    /// A colour a material.
    Material,
    /// A colour a triangle.
    Triangle,
    /// Edges of triangles.
    Wireframe,
    /// Barycentric coordinates.
    Barycentric,
    /// Direct diffuse light, demodulated.
    DirectDiffuse,
    /// Direct specular light, demodulated.
    DirectSpecular,
    /// What arrives of one light.
    Shadow,
    /// Rays behind the first surface.
    RayDepth,
    /// Length of the temporal history.
    History,
    /// Where samples were dropped, and by which pass.
    NonFinite,
    /// Noise of each pixel.
    Noise,
    /// Difference of each pixel from the reference.
    Error,
}

impl Show {
    /// Everything that can be shown, in the order of menus, with its name.
    pub const ALL: [(Self, &'static str); 25] = [
        (Self::Image, "Image"),
        (Self::BaseColor, "Base colour"),
        (Self::Normal, "Shading normal"),
        (Self::GeometricNormal, "Geometric normal"),
        (Self::Facing, "Facing"),
        (Self::Depth, "Depth"),
        (Self::Metallic, "Metallic"),
        (Self::Roughness, "Roughness"),
        (Self::Occlusion, "Occlusion"),
        (Self::Motion, "Motion"),
        (Self::Emissive, "Emission"),
        (Self::Instance, "Instances"),
        (Self::Primitive, "Primitives"),
        (Self::Material, "Materials"),
        (Self::Triangle, "Triangles"),
        (Self::Wireframe, "Wireframe"),
        (Self::Barycentric, "Barycentrics"),
        (Self::DirectDiffuse, "Direct diffuse light"),
        (Self::DirectSpecular, "Direct specular light"),
        (Self::Shadow, "Shadow of a light"),
        (Self::RayDepth, "Ray depth"),
        (Self::History, "History length"),
        (Self::NonFinite, "Not finite"),
        (Self::Noise, "Noise"),
        (Self::Error, "Error"),
    ];

    /// What its colours mean, in words for a user.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Image => "The finished picture",
            Self::BaseColor => "Colour of the surface, without light",
            Self::Normal => {
                "Direction of the normal that light sees: x, y, z from -1 to 1 as red, green, blue"
            }
            Self::GeometricNormal => {
                "Direction of the flat triangle's normal: x, y, z from -1 to 1 as red, green, blue"
            }
            Self::Facing => "Blue: the front of a surface; red: its back, or the inside of a sphere or box",
            Self::Depth => "Near is bright; the sky, infinitely far, is black",
            Self::Metallic => "White is metal, black is not",
            Self::Roughness => "Black is smooth, white is rough",
            Self::Occlusion => "The occlusion texture: dark where it holds back the light of the environment",
            Self::Motion => {
                "Motion since the last frame: grey is none, more red is to the right, more green is down, 8 pixels are full colour"
            }
            Self::Emissive => "Radiance that surfaces send out by themselves, exposed like the picture",
            Self::Instance => "A colour an instance",
            Self::Primitive => "A colour a primitive of each instance: a part with one material",
            Self::Material => "A colour a material",
            Self::Triangle => "A colour a triangle, sphere or box",
            Self::Wireframe => {
                "Edges of the triangles and boxes that are seen, and a net on spheres: one pixel wide"
            }
            Self::Barycentric => {
                "Weights of the three corners of a triangle as red, green, blue; on spheres and boxes the texture coordinates as red, green"
            }
            Self::DirectDiffuse => {
                "Light of lamps and environment before the surface colours it, exposed like the picture; black in `path`, which does not keep it apart"
            }
            Self::DirectSpecular => {
                "Highlights of lamps and environment before the surface colours them, exposed like the picture; black in `path`, which does not keep them apart"
            }
            Self::Shadow => {
                "White: the chosen light arrives; black: something is in its way; coloured: through glass; blue: turned away or out of its reach"
            }
            Self::RayDepth => {
                "Rays traced one after the other behind the first surface: black is none, then blue, green, yellow, red at the greatest depth"
            }
            Self::History => {
                "Frames that the denoiser has gathered while something moves: black is none, white the most it keeps"
            }
            Self::NonFinite => {
                "Samples dropped because they are no number. Yellow: by the surface itself; orange: by direct light; magenta: by shading; red: in an earlier sample. Grey: the picture"
            }
            Self::Noise => {
                "What the samples of each pixel differ by: from 0.1 % of its brightness, blue, by 1 %, green, and 10 %, yellow, to 100 %, red"
            }
            Self::Error => {
                "Difference from the reference: from 0.1 % of its brightness, blue, by 1 %, green, and 10 %, yellow, to 100 %, red; black without a reference of this size"
            }
        }
    }
}
