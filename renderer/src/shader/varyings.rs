//! What a vertex shader hands to a fragment shader, and both to the host. Enters: the two stages. Leaves: what does not fit: drivers
//! read what was never written, and may crash.

use caustica_gpu::Format;

use super::library::Compiled;
use super::reflect::Varying;
use crate::error::Result;

/// Whether the fragment shader takes what the vertex shader gives, and writes what the targets hold.
///
/// # Errors
/// [`crate::RendererError::Compile`] with the place: expected against found.
pub(crate) fn check_varyings(vertex: &Compiled, fragment: &Compiled, targets: &[Format]) -> Result<()> {
    let at = |varying: &Varying| format!("'{}' at location {}", varying.name, varying.location);
    if let Some(input) = vertex.inputs.first() {
        let reason = format!("input {}: expected none, as shaders fetch vertices themselves", at(input));
        return Err(vertex.refuse(&input.name, reason));
    }
    for input in &fragment.inputs {
        let given = vertex.outputs.iter().find(|output| output.location == input.location);
        let expected = match given {
            Some(given) if given.ty == input.ty => continue,
            Some(given) => given.ty.clone(),
            None => String::from("nothing"),
        };
        let reason = format!(
            "input {}: expected {expected}, as {} gives, found {}",
            at(input),
            vertex.file(),
            input.ty
        );
        return Err(fragment.refuse(&input.name, reason));
    }
    for output in &fragment.outputs {
        let Some(target) = targets.get(output.location as usize) else {
            let reason = format!("output {}: there are {} targets", at(output), targets.len());
            return Err(fragment.refuse(&output.name, reason));
        };
        let expected = if target.is_uint() { "u32" } else { "f32" };
        if !output.ty.contains(expected) {
            let reason =
                format!("output {}: expected {expected} for {target:?}, found {}", at(output), output.ty);
            return Err(fragment.refuse(&output.name, reason));
        }
    }
    let is_written = |target: usize| fragment.outputs.iter().any(|output| output.location as usize == target);
    match (0..targets.len()).find(|target| !is_written(*target)) {
        None => Ok(()),
        Some(target) => {
            Err(fragment.refuse("out", format!("expected an output at location {target}, found none")))
        }
    }
}
