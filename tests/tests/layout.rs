//! Host twins against the compiled shaders: every shared struct has the same fields at the same offsets, every shared
//! constant the same value, every specialisation constant the same meaning.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use caustica_renderer::gpu_types::twins;
use caustica_renderer::shader::{ShaderSources, SpirvCache, compile, reflect};
use caustica_renderer::{Needs, Sampler, Sampling};
use caustica_tests::compute::shader_text;
use caustica_tests::{repository, shader_folder};

/// What SPIR-V says of its types (specification 1.6, section 3.49).
#[derive(Default)]
struct Module {
    names: BTreeMap<u32, String>,
    member_names: BTreeMap<(u32, u32), String>,
    member_offsets: BTreeMap<(u32, u32), u32>,
    array_strides: BTreeMap<u32, u32>,
    constants: BTreeMap<u32, u32>,
    /// Opcode and operands of every type.
    types: BTreeMap<u32, (u32, Vec<u32>)>,
}

/// Names and offsets in bytes.
type Fields = Vec<(String, usize)>;

const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_TYPE_FIRST: u32 = 19;
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_FLOAT: u32 = 22;
const OP_TYPE_VECTOR: u32 = 23;
const OP_TYPE_MATRIX: u32 = 24;
const OP_TYPE_ARRAY: u32 = 28;
const OP_TYPE_RUNTIME_ARRAY: u32 = 29;
const OP_TYPE_STRUCT: u32 = 30;
const OP_TYPE_LAST: u32 = 39;
const OP_CONSTANT: u32 = 43;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const DECORATION_ARRAY_STRIDE: u32 = 6;
const DECORATION_OFFSET: u32 = 35;

fn text_of(words: &[u32]) -> String {
    let bytes: Vec<u8> =
        words.iter().flat_map(|word| word.to_le_bytes()).take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Module {
    fn parse(words: &[u32]) -> Self {
        let mut module = Self::default();
        let mut rest = words.get(5..).unwrap_or_default();
        while let Some(first) = rest.first() {
            let (opcode, length) = (first & 0xffff, (first >> 16) as usize);
            let (instruction, after) = rest.split_at(length.clamp(1, rest.len()));
            module.take(opcode, &instruction[1..]);
            rest = after;
        }
        module
    }

    fn take(&mut self, opcode: u32, operands: &[u32]) {
        match (opcode, operands) {
            (OP_NAME, [id, name @ ..]) => {
                self.names.insert(*id, text_of(name));
            }
            (OP_MEMBER_NAME, [id, member, name @ ..]) => {
                self.member_names.insert((*id, *member), text_of(name));
            }
            (OP_CONSTANT, [_, id, value, ..]) => {
                self.constants.insert(*id, *value);
            }
            (OP_DECORATE, [id, DECORATION_ARRAY_STRIDE, stride, ..]) => {
                self.array_strides.insert(*id, *stride);
            }
            (OP_MEMBER_DECORATE, [id, member, DECORATION_OFFSET, offset, ..]) => {
                self.member_offsets.insert((*id, *member), *offset);
            }
            (OP_TYPE_FIRST..=OP_TYPE_LAST, [id, of @ ..]) => {
                self.types.insert(*id, (opcode, of.to_vec()));
            }
            _ => {}
        }
    }

    /// Bytes of a type with an explicit layout; `None` for one without.
    fn size_of(&self, id: u32) -> Option<usize> {
        let (opcode, operands) = self.types.get(&id)?;
        match (*opcode, operands.as_slice()) {
            (OP_TYPE_INT | OP_TYPE_FLOAT, [bits, ..]) => Some(*bits as usize / 8),
            (OP_TYPE_VECTOR | OP_TYPE_MATRIX, [part, count]) => Some(self.size_of(*part)? * *count as usize),
            (OP_TYPE_ARRAY, [_, length]) => {
                Some(*self.array_strides.get(&id)? as usize * *self.constants.get(length)? as usize)
            }
            (OP_TYPE_STRUCT, members) => {
                let last = members.len().checked_sub(1)?;
                let offset = *self.member_offsets.get(&(id, last as u32))? as usize;
                Some(offset + self.size_of(members[last])?)
            }
            _ => None,
        }
    }

    /// Structs with a layout: id, name, fields in order.
    fn structs(&self) -> Vec<(u32, &str, Fields)> {
        let mut found = Vec::new();
        for (id, (opcode, members)) in &self.types {
            let Some(name) = self.names.get(id).filter(|_| *opcode == OP_TYPE_STRUCT) else { continue };
            let field = |member: u32| {
                let name = self.member_names.get(&(*id, member)).cloned().unwrap_or_default();
                Some((name, *self.member_offsets.get(&(*id, member))? as usize))
            };
            let fields: Option<Vec<_>> = (0..members.len() as u32).map(field).collect();
            // The compiler keeps a second copy without offsets for values outside of memory.
            found.extend(fields.map(|fields| (*id, name.as_str(), fields)));
        }
        found
    }

    /// Strides of the unbounded arrays of a type.
    fn runtime_strides(&self, element: u32) -> impl Iterator<Item = usize> {
        self.types
            .iter()
            .filter(move |(_, (opcode, of))| *opcode == OP_TYPE_RUNTIME_ARRAY && of.first() == Some(&element))
            .filter_map(|(id, _)| self.array_strides.get(id).map(|stride| *stride as usize))
    }
}

/// Every main file of the passes.
fn main_files() -> Vec<String> {
    let root = shader_folder();
    let mut found = Vec::new();
    for pass in std::fs::read_dir(root.join("passes")).expect("passes").flatten() {
        for file in std::fs::read_dir(pass.path()).expect("a pass").flatten() {
            let path = file.path();
            if path.extension().is_some_and(|ending| ending != "glsl") {
                found.push(path.strip_prefix(&root).map(Path::to_string_lossy).expect("inside").into_owned());
            }
        }
    }
    found.sort();
    found
}

#[test]
fn structs_lie_alike_on_both_sides() {
    let sources = ShaderSources::new(Some(shader_folder()));
    let mut seen = BTreeSet::new();
    for file in main_files() {
        let words =
            compile(&sources.load(&file).expect("sources"), &SpirvCache::of_user()).expect("it compiles");
        reflect(&file, &words).expect("its interface fits the host");
        let module = Module::parse(&words);
        for (id, name, fields) in module.structs() {
            let Some(twin) = twins().iter().find(|twin| twin.name == name) else { continue };
            let expected: Vec<_> =
                twin.fields.iter().map(|(name, offset)| ((*name).to_owned(), *offset)).collect();
            assert_eq!(fields, expected, "{name} in {file}");
            assert_eq!(module.size_of(id), Some(twin.size), "size of {name} in {file}");
            for stride in module.runtime_strides(id) {
                assert_eq!(stride, twin.size, "array stride of {name} in {file}");
            }
            seen.insert(twin.name);
        }
    }
    let unseen: Vec<_> = twins().iter().map(|twin| twin.name).filter(|name| !seen.contains(name)).collect();
    assert!(unseen.is_empty(), "no shader uses {unseen:?}");
}

/// Every file of `shaders/shared`.
fn shared_files() -> Vec<String> {
    let folder = std::fs::read_dir(shader_folder().join("shared")).expect("the shared shaders");
    let mut found: Vec<String> =
        folder.flatten().map(|file| format!("shared/{}", file.file_name().to_string_lossy())).collect();
    found.sort();
    found
}

/// `NAME = VALUE` of every `u32` constant in a text.
fn constants(text: &str, beginning: &str, separator: &str) -> BTreeMap<String, u32> {
    let mut found = BTreeMap::new();
    for line in text.lines() {
        let Some(rest) = line.trim_start().strip_prefix(beginning) else { continue };
        let Some((name, rest)) = rest.split_once(separator) else { continue };
        let Some((value, _)) = rest.split_once(';') else { continue };
        let digits = value.trim().trim_end_matches('u').replace('_', "");
        let parsed = match digits.strip_prefix("0x") {
            Some(hex) => u32::from_str_radix(hex, 16),
            None => digits.parse(),
        };
        if let Ok(value) = parsed {
            found.insert(name.trim().to_owned(), value);
        }
    }
    found
}

#[test]
fn constants_are_the_same_on_both_sides() {
    let host_file = repository().join("renderer/src/gpu_types/constants.rs");
    let host_text = std::fs::read_to_string(host_file).expect("the host twins");
    let host = constants(&host_text, "pub const ", ": u32 =");
    let mut device = BTreeMap::new();
    for file in shared_files() {
        device.extend(constants(&shader_text(&file), "const uint ", "="));
    }
    assert!(device.len() > 30, "only {} constants were found", device.len());
    for beginning in ["MASK_", "GEOMETRY_", "LOBE_", "TLAS_", "RAY_", "SHOW_"] {
        assert!(device.keys().any(|name| name.starts_with(beginning)), "no {beginning}* was found");
    }
    for (name, value) in &device {
        assert_eq!(host.get(name), Some(value), "{name} of shaders/shared on the host");
    }
}

#[test]
fn specialisation_constants_mean_the_same_on_both_sides() {
    let nothing = Needs {
        lights: false,
        emissive_lights: false,
        environment: false,
        environment_map: false,
        textures: false,
        normal_maps: false,
        reflection: false,
        refraction: false,
        emission: false,
        any_hit: false,
        alpha: false,
        shadow_rays: false,
        temporal: false,
        spatial: false,
        motion: false,
        shapes: false,
        primary_rays: false,
        paths: false,
        lobes: false,
        known_shadows: false,
        ray_depth: false,
    };
    let cases = [
        ("LIGHTS", Needs { lights: true, ..nothing }),
        ("EMISSIVE_LIGHTS", Needs { emissive_lights: true, ..nothing }),
        ("ENVIRONMENT", Needs { environment: true, ..nothing }),
        ("ENVIRONMENT_MAP", Needs { environment_map: true, ..nothing }),
        ("TEXTURES", Needs { textures: true, ..nothing }),
        ("NORMAL_MAPS", Needs { normal_maps: true, ..nothing }),
        ("REFLECTION", Needs { reflection: true, ..nothing }),
        ("REFRACTION", Needs { refraction: true, ..nothing }),
        ("EMISSION", Needs { emission: true, ..nothing }),
        ("SHADOW_RAYS", Needs { shadow_rays: true, ..nothing }),
        ("MOTION", Needs { motion: true, ..nothing }),
        ("SHAPES", Needs { shapes: true, ..nothing }),
        ("LOBES", Needs { lobes: true, ..nothing }),
        ("RAY_DEPTH", Needs { ray_depth: true, ..nothing }),
        ("DENOISING", Needs { temporal: true, ..nothing }),
        ("KNOWN_SHADOWS", Needs { known_shadows: true, ..nothing }),
    ];
    let text = shader_text("shared/needs.glsl");
    let count = text.matches("constant_id").count();
    assert_eq!(count, cases.len());
    for (name, needs) in cases {
        let line = text.lines().find(|line| line.contains(&format!(" NEEDS_{name} ="))).expect(name);
        let id = line.split("constant_id = ").nth(1).and_then(|rest| rest.split(')').next()).expect(name);
        let set: Vec<_> =
            needs.specialization().values.into_iter().filter(|(_, value)| *value == 1).collect();
        assert_eq!(set, [(id.parse().expect("a number"), 1)], "{name}");
        assert_eq!(needs.specialization().values.len(), count);
    }
}

#[test]
fn the_sampler_is_specialised_alike_on_both_sides() {
    let text = shader_text("shared/sampler.glsl");
    let id_of = |name: &str| {
        let line = text.lines().find(|line| line.contains(&format!(" const uint {name} ="))).expect(name);
        let id = line.split("constant_id = ").nth(1).and_then(|rest| rest.split(')').next()).expect(name);
        id.parse::<u32>().expect("a number")
    };
    let device = constants(&text, "const uint ", "=");
    for sampler in Sampler::ALL {
        let name = format!("SAMPLER_{}", sampler.name().replace('-', "_").to_uppercase());
        let size = if sampler == Sampler::Hammersley { 50 } else { Sampling::UNKNOWN_SET };
        let expected = [(id_of("SAMPLER"), device[&name]), (id_of("HAMMERSLEY_SIZE"), size)];
        assert_eq!(Sampling::of(sampler, Some(100)).specialization().values, expected, "{name}");
    }
    let needs = shader_text("shared/needs.glsl").matches("constant_id").count() as u32;
    assert!(needs <= id_of("SAMPLER"), "the constants of needs.glsl have grown into these");
}
