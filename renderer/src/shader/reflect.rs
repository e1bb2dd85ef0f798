//! What a stage binds, read from its SPIR-V. Set 0 is the scene and must fit `shaders/shared/scene.glsl`;
//! set 1 is given to the host by name. A binding that does not fit is refused before the driver sees it:
//! validation does not catch it reliably, and some drivers crash.

use caustica_gpu::{Access, Binding, BindingKind, Format, Interface};
use spirq::ReflectConfig;
use spirq::spirv::ImageFormat;
use spirq::ty::{AccessType, DescriptorType, Type};
use spirq::var::Variable;

use super::constants::with_plain_constants;
use crate::error::{RendererError, Result};

/// Interface of one stage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reflection {
    /// What it binds.
    pub interface: Interface,
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
    let mut interface = Interface::default();
    for variable in &entry.vars {
        match variable {
            Variable::Descriptor { name, desc_bind, desc_ty, ty, .. } => {
                let name = name.clone().unwrap_or_default();
                match desc_bind.set() {
                    0 => check_scene_binding(file, &name, desc_bind.bind(), desc_ty)?,
                    1 => interface.bindings.push(Binding {
                        kind: kind_of(desc_ty)
                            .ok_or_else(|| refuse(format!("'{name}' is of an unknown kind")))?,
                        binding: desc_bind.bind(),
                        format: format_of(ty),
                        name,
                    }),
                    set => return Err(refuse(format!("'{name}' is in set {set}; only 0 and 1 exist"))),
                }
                interface.uses_scene |= desc_bind.set() == 0;
            }
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
    Ok(Reflection { interface })
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

/// The format that a storage image is declared with.
fn format_of(ty: &Type) -> Option<Format> {
    let Type::StorageImage(image) = ty else { return None };
    Some(match image.fmt {
        ImageFormat::Rgba8 => Format::Rgba8Unorm,
        ImageFormat::Rgba16f => Format::Rgba16Float,
        ImageFormat::Rgba32f => Format::Rgba32Float,
        ImageFormat::Rg16f => Format::Rg16Float,
        ImageFormat::Rg32f => Format::Rg32Float,
        ImageFormat::R32f => Format::R32Float,
        ImageFormat::Rg32ui => Format::Rg32Uint,
        ImageFormat::Rgba32ui => Format::Rgba32Uint,
        ImageFormat::R32ui => Format::R32Uint,
        _ => return None,
    })
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
