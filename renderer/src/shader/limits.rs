//! What a stage takes of the device: the size of its workgroups, memory that they share, and variables of its own. Enters: SPIR-V, and
//! the texts that it was made of. Leaves: the size of workgroups, or what is too large: drivers crash over it, or never come back.

use std::collections::HashMap;

use caustica_gpu::Limits;

use super::constants::Constants;
use super::fault::ShaderFault;
use super::sources::Source;
use super::spirv::{instructions, text_of};
use crate::error::{RendererError, Result};

/// Most bytes of one variable that each invocation has of its own. Vulkan knows no limit; NVIDIA's devices have 512 KiB a thread (CUDA
/// C++ Programming Guide, "local memory"), and compilers may take for ever over larger ones.
const MOST_OWN_BYTES: u64 = 512 << 10;

const OP_NAME: u32 = 5;
const OP_EXECUTION_MODE: u32 = 16;
const OP_POINTER: u32 = 32;
const OP_VARIABLE: u32 = 59;
const OP_DECORATE: u32 = 71;
const OP_EXECUTION_MODE_ID: u32 = 331;
const LOCAL_SIZE: u32 = 17;
const LOCAL_SIZE_ID: u32 = 38;
const BUILT_IN: u32 = 11;
const WORKGROUP_SIZE: u32 = 25;
const SHARED: u32 = 4;
const PRIVATE: u32 = 6;
const FUNCTION: u32 = 7;

/// Invocations of a workgroup along each axis.
pub type GroupSize = [u32; 3];

/// What a module takes.
#[derive(Default)]
struct Taken {
    group: Option<GroupSize>,
    /// Variables with their storage class, name, and bytes.
    variables: Vec<(u32, String, u64)>,
}

/// Holds a stage against the limits of a device; gives the size of its workgroups, if it has them.
///
/// # Errors
/// [`RendererError::Compile`] with file and line as far as the texts show them: expected against found.
pub(super) fn check(source: &Source, words: &[u32], limits: &Limits) -> Result<Option<GroupSize>> {
    let taken = Taken::of(words);
    let mut faults = Vec::new();
    if let Some(group) = taken.group {
        let count: u64 = group.iter().map(|n| u64::from(*n)).product();
        let most = u64::from(limits.max_group_invocations);
        let sides = limits.max_group_size;
        if count > most || group.iter().zip(sides).any(|(found, most)| *found > most) {
            let message = format!(
                "workgroup size: this device allows {most} invocations, at most {} along the axes, found {} ({count})",
                written(sides),
                written(group)
            );
            faults.push(ShaderFault::at(source, &["local_size"], message));
        }
    }
    let shared = || taken.variables.iter().filter(|(class, ..)| *class == SHARED);
    let bytes = shared().fold(0, |sum: u64, (.., bytes)| sum.saturating_add(*bytes));
    if bytes > u64::from(limits.max_shared_bytes)
        && let Some((_, name, _)) = shared().max_by_key(|(.., bytes)| *bytes)
    {
        let most = limits.max_shared_bytes;
        let message = format!("shared memory: this device allows {most} bytes a workgroup, found {bytes}");
        faults.push(ShaderFault::at(source, &["shared", name], message));
    }
    let own = taken.variables.iter().filter(|(class, _, bytes)| *class != SHARED && *bytes > MOST_OWN_BYTES);
    faults.extend(own.map(|(_, name, bytes)| {
        let message = format!(
            "variable '{name}': expected at most {MOST_OWN_BYTES} bytes that each invocation has of its own, found {bytes}"
        );
        ShaderFault::at(source, &[name], message)
    }));
    if faults.is_empty() { Ok(taken.group) } else { Err(refuse(source, faults)) }
}

/// Holds the size of workgroups against the one that the host counts with when it says how many there are.
///
/// # Errors
/// [`RendererError::Compile`], as above.
pub(super) fn check_dispatched(source: &Source, found: Option<GroupSize>, expected: GroupSize) -> Result<()> {
    let Some(found) = found.filter(|found| *found != expected) else { return Ok(()) };
    let message = format!("workgroup size: the host expects {}, found {}", written(expected), written(found));
    Err(refuse(source, vec![ShaderFault::at(source, &["local_size"], message)]))
}

fn written([x, y, z]: GroupSize) -> String {
    format!("{x} x {y} x {z}")
}

fn refuse(source: &Source, faults: Vec<ShaderFault>) -> RendererError {
    RendererError::Compile { file: source.file.clone(), faults }
}

impl Taken {
    fn of(words: &[u32]) -> Self {
        let constants = Constants::of(words);
        let mut names: HashMap<u32, String> = HashMap::new();
        let mut sizes: HashMap<u32, u64> = HashMap::new();
        let mut pointees: HashMap<u32, u32> = HashMap::new();
        let mut taken = Self::default();
        let three = |ids: [u32; 3]| ids.map(|id| constants.get(id).unwrap_or(1));
        // What the constant says counts before the mode (SPIR-V 1.6, BuiltIn WorkgroupSize).
        let mut built_in = None;
        for instruction in instructions(words) {
            match instruction {
                (OP_NAME, [_, id, text @ ..]) => drop(names.insert(*id, text_of(text))),
                (OP_EXECUTION_MODE, [_, _, LOCAL_SIZE, x, y, z]) => taken.group = Some([*x, *y, *z]),
                (OP_EXECUTION_MODE_ID, [_, _, LOCAL_SIZE_ID, x, y, z]) => {
                    taken.group = Some(three([*x, *y, *z]));
                }
                (OP_DECORATE, [_, id, BUILT_IN, WORKGROUP_SIZE]) => {
                    built_in = constants.several(*id).and_then(|sizes| sizes.try_into().ok());
                }
                (OP_POINTER, [_, id, _, of]) => {
                    pointees.insert(*id, *of);
                    sizes.insert(*id, 8);
                }
                (OP_VARIABLE, [_, pointer, id, class @ (SHARED | PRIVATE | FUNCTION), ..]) => {
                    let of = pointees.get(pointer);
                    let bytes = of.and_then(|of| sizes.get(of)).copied().unwrap_or_default();
                    let name = names.get(id).cloned().unwrap_or_default();
                    taken.variables.push((*class, name, bytes));
                }
                (opcode, [_, id, rest @ ..]) => {
                    if let Some(bytes) = bytes_of(opcode, rest, &sizes, &constants) {
                        sizes.insert(*id, bytes);
                    }
                }
                _ => {}
            }
        }
        taken.group = built_in.or(taken.group);
        taken
    }
}

/// Bytes of a type without padding; `None`: it is none that variables have.
fn bytes_of(opcode: u32, rest: &[u32], sizes: &HashMap<u32, u64>, constants: &Constants) -> Option<u64> {
    let of = |id: &u32| sizes.get(id).copied().unwrap_or_default();
    Some(match (opcode, rest) {
        // Booleans, numbers, vectors and matrices, arrays, structs.
        (20, []) => 4,
        (21, [bits, _]) | (22, [bits, ..]) => u64::from(bits / 8),
        (23 | 24, [part, count]) => of(part).saturating_mul(u64::from(*count)),
        (28, [part, length]) => of(part).saturating_mul(u64::from(constants.get(*length).unwrap_or(1))),
        (30, parts) => parts.iter().fold(0, |sum, part| sum.saturating_add(of(part))),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::super::compile::{SpirvCache, compile};
    use super::*;

    #[test]
    fn what_is_too_large_is_named_with_its_line() {
        let limits = Limits {
            max_group_invocations: 256,
            max_group_size: [256, 256, 32],
            max_shared_bytes: 1024,
            ..Limits::default()
        };
        let checked = |head: &str, size: &str, body: &str| {
            let text = format!("#version 460\n{head}\nlayout({size}) in;\nvoid main() {{\n{body}\n}}\n");
            let texts = [("a.comp".to_owned(), text)].into();
            let source = Source { file: "a.comp".to_owned(), texts, ..Source::default() };
            let words = compile(&source, &SpirvCache::default()).unwrap();
            check(&source, &words, &limits).map_err(|error| error.to_string())
        };
        let size = "local_size_x = 8, local_size_y = 8";
        let shared = "shared vec4 few[4];\nshared struct { mat4 m; uvec2 u; } many[100];";
        let uses = "few[0] = vec4(0); many[1].u = uvec2(few[0].xy);";
        let big = "int big[100000000]; big[gl_LocalInvocationIndex] = 1; if (big[7] == 1) return;";
        assert_eq!(checked("", size, ""), Ok(Some([8, 8, 1])));
        let specialised = "layout(constant_id = 3) const uint n = 4;\nshared float a[n * 2];";
        let group = "local_size_x_id = 1, local_size_y = 16";
        assert_eq!(checked(specialised, group, "a[0] = 1.0;"), Ok(Some([1, 16, 1])));
        for (head, size, body, words) in [
            (
                "",
                "local_size_x = 32, local_size_y = 16",
                "",
                "a.comp:3:8: workgroup size: this device allows 256 invocations, at most 256 x 256 x 32 along the axes, found 32 x 16 x 1 (512)",
            ),
            ("", "local_size_z = 48", "", "found 1 x 1 x 48 (48)"),
            (
                shared,
                size,
                uses,
                "a.comp:3:1: shared memory: this device allows 1024 bytes a workgroup, found 7264",
            ),
            (
                "",
                size,
                big,
                "a.comp:5:5: variable 'big': expected at most 524288 bytes that each invocation has of its own, found 400000000",
            ),
        ] {
            let said = checked(head, size, body).unwrap_err();
            assert!(said.contains(words), "{said}");
        }
    }
}
