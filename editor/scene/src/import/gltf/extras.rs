//! What `extras` say in words of this program. Any program may put anything there: what is not as we write it is no
//! fault of the file. In: JSON. Out: a value, or a warning that it is only kept for exports.

use super::json::{Fault, Item};

/// What follows the reason of a warning about something that is not read.
const KEPT: &str = "it is not read, only kept for exports";

/// A number of the `extras` of an object. Out: `None` where it has none; else the number, `None` where it is another's.
pub(super) fn number(owner: &Item<'_>, key: &str, warnings: &mut Vec<Fault>) -> Option<Option<f64>> {
    let extras = owner.get("extras")?;
    let member = extras.get(key)?;
    let number = extras.f32_or(key, 0.0).and_then(|_| extras.f64(key));
    Some(number.unwrap_or_else(|fault| {
        warnings.push(not_read(&member, &fault.reason));
        None
    }))
}

/// A warning about a member that is not as this program writes it.
pub(super) fn not_read(member: &Item<'_>, reason: &str) -> Fault {
    member.fault(format!("{reason}; {KEPT}"))
}

/// Whether [`number`] takes it.
pub(super) fn is_number(owner: &Item<'_>, key: &str) -> bool {
    owner.get("extras").is_some_and(|extras| extras.raw(key).is_some() && extras.f32_or(key, 0.0).is_ok())
}

/// Those of the keys whose numbers [`number`] takes.
pub(super) fn numbers<'k>(owner: &Item<'_>, keys: &[&'k str]) -> Vec<&'k str> {
    keys.iter().copied().filter(|key| is_number(owner, key)).collect()
}
