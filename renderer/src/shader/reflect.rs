//! What a stage binds, read from its SPIR-V. Set 0 is the scene and must fit `shaders/shared/scene.glsl`;
//! set 1 is given to the host by name. A binding that does not fit is refused before the driver sees it:
//! validation does not catch it reliably, and some drivers crash.

use caustica_gpu::{Access, Binding, BindingKind, Format, Interface};
use spirq::ReflectConfig;
use spirq::spirv::{Dim, ImageFormat};
use spirq::ty::{AccessType, DescriptorType, ScalarType, Type};
use spirq::var::Variable;

use super::constants::with_plain_constants;
use crate::error::{RendererError, Result};

/// Interface of one stage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reflection {
    /// What it binds.
    pub interface: Interface,
    /// What the stage before hands over.
    pub inputs: Vec<Varying>,
    /// What it hands over.
    pub outputs: Vec<Varying>,
}

/// An input or output at a location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Varying {
    /// Name in GLSL.
    pub name: String,
    /// Its number.
    pub location: u32,
    /// Its type, written out.
    pub ty: String,
}

/// Bindings of set 0: number, kind, and what it is.
const SCENE_BINDINGS: [(u32, DescriptorType, &str); 3] = [
    (0, DescriptorType::AccelStruct(), "the acceleration structure"),
    (1, DescriptorType::CombinedImageSampler(), "the textures"),
    (2, DescriptorType::CombinedImageSampler(), "the environment map"),
];

/// Reads the interface of a module that `compile` made from `file`.
///
/// # Errors
/// [`RendererError::Interface`] when a binding or a shared struct does not fit the host's layout.
pub fn reflect(file: &str, words: &[u32]) -> Result<Reflection> {
    let refuse = |reason: String| RendererError::Interface { file: file.to_owned(), reason };
    super::twins::check(words).map_err(refuse)?;
    let entry_points = ReflectConfig::new()
        .spv(with_plain_constants(words))
        .ref_all_rscs(false)
        .combine_img_samplers(false)
        .reflect()
        .map_err(|error| refuse(format!("reflection failed: {error}")))?;
    let entry = entry_points.first().ok_or_else(|| refuse(String::from("no entry point")))?;
    let mut found = Reflection::default();
    let interface = &mut found.interface;
    let varying = |name: &Option<String>, location: u32, ty: &Type| Varying {
        name: name.clone().unwrap_or_default(),
        location,
        ty: ty.to_string(),
    };
    for variable in &entry.vars {
        match variable {
            Variable::Descriptor { name, desc_bind, desc_ty, ty, nbind } => {
                let name = name.clone().unwrap_or_default();
                if !is_plain_image(ty) {
                    return Err(refuse(format!("'{name}': expected a two-dimensional image, found {ty}")));
                }
                match desc_bind.set() {
                    0 => check_scene_binding(file, &name, desc_bind.bind(), desc_ty)?,
                    1 if *nbind != 1 => {
                        return Err(refuse(format!("'{name}': expected one, found an array of {nbind}")));
                    }
                    1 => interface.bindings.push(Binding {
                        kind: kind_of(desc_ty).ok_or_else(|| {
                            refuse(format!("'{name}': a kind that the host never gives, {ty}"))
                        })?,
                        binding: desc_bind.bind(),
                        format: format_of(ty).map_err(|found| {
                            refuse(format!("'{name}': the host has no images of format {found}"))
                        })?,
                        reads_uint: reads_uint(ty),
                        name,
                    }),
                    set => return Err(refuse(format!("'{name}' is in set {set}; only 0 and 1 exist"))),
                }
                interface.uses_scene |= desc_bind.set() == 0;
            }
            Variable::Input { name, location, ty } => found.inputs.push(varying(name, location.loc(), ty)),
            Variable::Output { name, location, ty } => found.outputs.push(varying(name, location.loc(), ty)),
            Variable::PushConstant { ty, .. } => {
                interface.push_bytes = ty.nbyte().unwrap_or(size_of::<crate::gpu_types::Push>()) as u32;
            }
            _ => {}
        }
    }
    let expected = size_of::<crate::gpu_types::Push>() as u32;
    if interface.push_bytes > expected {
        let found = interface.push_bytes;
        return Err(refuse(format!("push constants: expected at most {expected} bytes, found {found}")));
    }
    interface.bindings.sort_by_key(|binding| binding.binding);
    let twice = interface.bindings.windows(2).find(|pair| pair[0].binding == pair[1].binding);
    if let Some([one, other]) = twice {
        let number = one.binding;
        return Err(refuse(format!("'{}': binding {number} is that of '{}' already", other.name, one.name)));
    }
    Ok(found)
}

/// Whether it is a two-dimensional image with one layer and one sample, as all are that the host gives, or none.
fn is_plain_image(ty: &Type) -> bool {
    let (dim, is_array, is_multisampled) = match ty {
        Type::SampledImage(image) => (image.dim, image.is_array, image.is_multisampled),
        Type::CombinedImageSampler(both) => {
            let image = &both.sampled_image_ty;
            (image.dim, image.is_array, image.is_multisampled)
        }
        Type::StorageImage(image) => (image.dim, image.is_array, image.is_multisampled),
        _ => return true,
    };
    dim == Dim::Dim2D && !is_array && !is_multisampled
}

/// Whether a sampled image is one of unsigned integers.
fn reads_uint(ty: &Type) -> bool {
    let scalar = match ty {
        Type::SampledImage(image) => &image.scalar_ty,
        Type::CombinedImageSampler(both) => &both.sampled_image_ty.scalar_ty,
        _ => return false,
    };
    matches!(scalar, ScalarType::Integer { is_signed: false, .. })
}

fn check_scene_binding(file: &str, name: &str, binding: u32, found: &DescriptorType) -> Result<()> {
    let reason = match SCENE_BINDINGS.iter().find(|(number, ..)| *number == binding) {
        Some((_, expected, _)) if expected == found => return Ok(()),
        Some((_, expected, what)) => {
            format!("'{name}' at set 0, binding {binding} ({what}): expected {expected:?}, found {found:?}")
        }
        None => format!("'{name}' at set 0, binding {binding}: the scene has no such binding"),
    };
    Err(RendererError::Interface { file: file.to_owned(), reason })
}

/// The format that a storage image is declared with, if it is one; else the one that the host has none of.
fn format_of(ty: &Type) -> std::result::Result<Option<Format>, String> {
    let Type::StorageImage(image) = ty else { return Ok(None) };
    Ok(Some(match image.fmt {
        ImageFormat::Rgba8 => Format::Rgba8Unorm,
        ImageFormat::Rgba16f => Format::Rgba16Float,
        ImageFormat::Rgba32f => Format::Rgba32Float,
        ImageFormat::Rg16f => Format::Rg16Float,
        ImageFormat::Rg32f => Format::Rg32Float,
        ImageFormat::R32f => Format::R32Float,
        ImageFormat::Rg32ui => Format::Rg32Uint,
        ImageFormat::Rgba32ui => Format::Rgba32Uint,
        ImageFormat::R32ui => Format::R32Uint,
        other => return Err(format!("{other:?}")),
    }))
}

fn kind_of(descriptor: &DescriptorType) -> Option<BindingKind> {
    let access = |access: &AccessType| match access {
        AccessType::ReadOnly => Access::StorageRead,
        AccessType::WriteOnly => Access::StorageWrite,
        AccessType::ReadWrite => Access::StorageReadWrite,
    };
    Some(match descriptor {
        DescriptorType::SampledImage() => BindingKind::SampledImage,
        DescriptorType::CombinedImageSampler() => BindingKind::CombinedImage,
        DescriptorType::StorageImage(a) => BindingKind::StorageImage(access(a)),
        DescriptorType::StorageBuffer(a) => BindingKind::StorageBuffer(access(a)),
        DescriptorType::AccelStruct() => BindingKind::AccelStructure,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::super::compile::{SpirvCache, compile};
    use super::super::sources::Source;
    use super::*;

    /// Operations on specialisation constants of every kind; an array of a binding has a length made of them.
    #[test]
    fn constants_that_are_specialised_refuse_no_shader() {
        let text = "#version 460
            layout(local_size_x = 8, local_size_y = 8) in;
            layout(constant_id = 0) const int n = 7;
            layout(constant_id = 1) const bool b = false;
            layout(constant_id = 2) const uint u = 9u;
            layout(constant_id = 3) const float f = 0.5;
            layout(constant_id = 4) const double d = 0.5lf;
            const int length = b ? n : ((n * 3 - 1) / 2 % 6 << 1) + int(u > 3u) + (-n & 3) + (~n ^ -8) + int(u >> 1);
            const double wide = double(f);
            const float narrow = float(d);
            const ivec2 pair = ivec2(n, 3) + 1;
            const int second = pair.y;
            layout(set = 1, binding = 0) buffer Numbers { float numbers[length]; int more[second]; };
            void main() { numbers[0] = narrow + float(wide) + (b ? 1.0 : f); more[0] = pair.x; }";
        let texts = [("a.comp".to_owned(), text.to_owned())].into();
        let source = Source { file: "a.comp".to_owned(), texts, ..Source::default() };
        let words = compile(&source, &SpirvCache::default()).unwrap();
        let found = reflect("a.comp", &words).unwrap().interface.bindings;
        assert_eq!(found.len(), 1);
        assert!(matches!(found[0].kind, BindingKind::StorageBuffer(_)), "{found:?}");
        let constants = super::super::constants::Constants::of(&words);
        // (20 / 2 % 6 << 1) + 1 + 1 + 0 + 4
        let lengths = super::super::spirv::instructions(&words).filter_map(|instruction| match instruction {
            (28, [_, _, _, length]) => constants.get(*length),
            _ => None,
        });
        assert_eq!(lengths.take(2).collect::<Vec<_>>(), [14, 4]);
    }
}
