//! Constants of a SPIR-V module by their values, specialised ones by their defaults: lengths of arrays and sizes of workgroups are
//! given by them. Enters: words. Leaves: values of booleans and of integers of up to 32 bits; others are not known.

use std::collections::HashMap;

use super::spirv::instructions;

const OP_NOP: u32 = 1;
const OP_TYPE_BOOL: u32 = 20;
const OP_TYPE_INT: u32 = 21;
const OP_TYPE_VECTOR: u32 = 23;
const OP_CONSTANT_TRUE: u32 = 41;
const OP_CONSTANT_FALSE: u32 = 42;
const OP_CONSTANT: u32 = 43;
const OP_CONSTANT_COMPOSITE: u32 = 44;
const OP_CONSTANT_NULL: u32 = 46;
const OP_SPEC_CONSTANT_TRUE: u32 = 48;
const OP_SPEC_CONSTANT_FALSE: u32 = 49;
const OP_SPEC_CONSTANT: u32 = 50;
const OP_SPEC_CONSTANT_COMPOSITE: u32 = 51;
const OP_SPEC_CONSTANT_OP: u32 = 52;
const OP_COMPOSITE_EXTRACT: u32 = 81;
const OP_SELECT: u32 = 169;

/// Values by id; a vector has several.
#[derive(Default)]
pub(super) struct Constants {
    /// Types of integers of up to 32 bits.
    ints: Vec<u32>,
    /// The same, booleans, and vectors of both.
    known: Vec<u32>,
    values: HashMap<u32, Vec<u32>>,
}

impl Constants {
    /// Reads a module.
    pub(super) fn of(words: &[u32]) -> Self {
        let mut found = Self::default();
        for (opcode, instruction) in instructions(words) {
            match (opcode, instruction) {
                (OP_TYPE_BOOL, [_, id]) => found.known.push(*id),
                (OP_TYPE_INT, [_, id, 0..=32, _]) => {
                    found.ints.push(*id);
                    found.known.push(*id);
                }
                (OP_TYPE_VECTOR, [_, id, part, _]) if found.known.contains(part) => found.known.push(*id),
                (_, [_, kind, id, rest @ ..]) => {
                    if let Some(value) = found.value(opcode, *kind, rest) {
                        found.values.insert(*id, value);
                    }
                }
                _ => {}
            }
        }
        found
    }

    /// The value of a scalar.
    pub(super) fn get(&self, id: u32) -> Option<u32> {
        self.several(id).filter(|values| values.len() == 1).map(|values| values[0])
    }

    /// The values of a vector.
    pub(super) fn several(&self, id: u32) -> Option<&[u32]> {
        self.values.get(&id).map(Vec::as_slice)
    }

    fn value(&self, opcode: u32, kind: u32, rest: &[u32]) -> Option<Vec<u32>> {
        if !self.known.contains(&kind) {
            return None;
        }
        Some(match (opcode, rest) {
            (OP_CONSTANT_COMPOSITE | OP_SPEC_CONSTANT_COMPOSITE, parts) => {
                return parts.iter().map(|part| self.get(*part)).collect();
            }
            (OP_CONSTANT_TRUE | OP_SPEC_CONSTANT_TRUE, []) => vec![1],
            (OP_CONSTANT_FALSE | OP_SPEC_CONSTANT_FALSE, []) => vec![0],
            (OP_CONSTANT | OP_SPEC_CONSTANT, [value]) => vec![*value],
            (OP_SPEC_CONSTANT_OP, [OP_COMPOSITE_EXTRACT, vector, index]) => {
                vec![*self.several(*vector)?.get(*index as usize)?]
            }
            (OP_SPEC_CONSTANT_OP, [operation, operands @ ..]) => {
                let operands: Vec<&[u32]> =
                    operands.iter().map(|id| self.several(*id)).collect::<Option<_>>()?;
                let count = operands.iter().map(|operand| operand.len()).max()?;
                // Of what is done to a vector each operand is one, or one number for all.
                let part = |at: usize| operands.iter().map(|of| of.get(at).or(of.first()).copied()).collect();
                let parts: Option<Vec<Vec<u32>>> = (0..count).map(part).collect();
                return parts?.iter().map(|part| result_of(*operation, part)).collect();
            }
            _ => return None,
        })
    }
}

/// What an operation on scalars gives (SPIR-V 1.6, 3.42.13 to 3.42.15); `None`: it is another one, or not defined for these.
fn result_of(operation: u32, operands: &[u32]) -> Option<u32> {
    let signed = u32::cast_signed;
    Some(match (operation, operands) {
        // Conversions and casts between integers.
        (113 | 114 | 124, [a]) => *a,
        (126, [a]) => a.wrapping_neg(),
        (168, [a]) => u32::from(*a == 0),
        (200, [a]) => !a,
        (OP_SELECT, [which, a, b]) => *if *which != 0 { a } else { b },
        (128, [a, b]) => a.wrapping_add(*b),
        (130, [a, b]) => a.wrapping_sub(*b),
        (132, [a, b]) => a.wrapping_mul(*b),
        (134, [a, b]) => a.checked_div(*b)?,
        (135, [a, b]) => signed(*a).checked_div(signed(*b))?.cast_unsigned(),
        (137, [a, b]) => a.checked_rem(*b)?,
        (138, [a, b]) => signed(*a).checked_rem(signed(*b))?.cast_unsigned(),
        (139, [a, b]) => {
            let (rest, by) = (signed(*a).checked_rem(signed(*b))?, signed(*b));
            if rest != 0 && (rest < 0) != (by < 0) { rest + by } else { rest }.cast_unsigned()
        }
        (164 | 170, [a, b]) => u32::from(a == b),
        (165 | 171, [a, b]) => u32::from(a != b),
        (166 | 197, [a, b]) => a | b,
        (167 | 199, [a, b]) => a & b,
        (172, [a, b]) => u32::from(a > b),
        (173, [a, b]) => u32::from(signed(*a) > signed(*b)),
        (174, [a, b]) => u32::from(a >= b),
        (175, [a, b]) => u32::from(signed(*a) >= signed(*b)),
        (176, [a, b]) => u32::from(a < b),
        (177, [a, b]) => u32::from(signed(*a) < signed(*b)),
        (178, [a, b]) => u32::from(a <= b),
        (179, [a, b]) => u32::from(signed(*a) <= signed(*b)),
        (194, [a, b]) => a.checked_shr(*b)?,
        (195, [a, b]) => signed(*a).checked_shr(*b)?.cast_unsigned(),
        (196, [a, b]) => a.checked_shl(*b)?,
        (198, [a, b]) => a ^ b,
        _ => return None,
    })
}

/// The module with plain constants alone, for a reader that knows neither every operation nor every type of a constant. What is no
/// integer becomes zero: of constants only lengths of arrays matter to bindings.
pub(super) fn with_plain_constants(words: &[u32]) -> Vec<u32> {
    let constants = Constants::of(words);
    let mut plain = words[..words.len().min(5)].to_vec();
    for (opcode, instruction) in instructions(words) {
        let start = plain.len();
        match (opcode, instruction) {
            (
                OP_CONSTANT
                | OP_SPEC_CONSTANT
                | OP_SPEC_CONSTANT_OP
                | OP_SPEC_CONSTANT_TRUE
                | OP_SPEC_CONSTANT_FALSE,
                [_, kind, id, ..],
            ) => match constants.ints.contains(kind) {
                true => plain.extend([4 << 16 | OP_CONSTANT, *kind, *id, constants.get(*id).unwrap_or(1)]),
                false => plain.extend([3 << 16 | OP_CONSTANT_NULL, *kind, *id]),
            },
            _ => plain.extend(instruction),
        }
        plain.resize((start + instruction.len()).max(plain.len()), 1 << 16 | OP_NOP);
    }
    plain
}
