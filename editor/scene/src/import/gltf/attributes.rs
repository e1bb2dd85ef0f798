//! Attributes of a primitive: what each vertex is, what holds it, and what the morph targets add to it.
//! In: JSON and checked accessors. Out: lists of one length. Primitives that name the same accessors share them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::super::geometry::{Attributes, Deltas, Hold};
use super::accessor::{Accessor, Accessors, Component};
use super::json::{Fault, Item};

/// Attributes that are read, beside joints and their weights.
pub(super) const BASE: [&str; 6] = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"];
const MORPHED: [&str; 3] = ["POSITION", "NORMAL", "TANGENT"];
/// Most sets of four joints that are looked at; glTF knows no limit.
const MAX_JOINT_SETS: usize = 16;
/// A sum of weights this close to 1 is 1 but for rounding, and they are left as they are, bit for bit.
const SUM_ROUNDING: f64 = 2e-7;

/// Which accessors a primitive names: of the base (0) and of each morph target (1 and on).
type Key = Vec<(usize, String, usize)>;

/// Reads the attributes of the primitives of one mesh.
pub(super) struct AttributeReader<'a> {
    accessors: &'a Accessors<'a>,
    read: HashMap<Key, Arc<Attributes>>,
    /// Vertices and morphed vertices that may still be read.
    left: usize,
    max_elements: usize,
}

impl<'a> AttributeReader<'a> {
    pub fn new(accessors: &'a Accessors<'a>, max_elements: usize) -> Self {
        Self { accessors, read: HashMap::new(), left: max_elements, max_elements }
    }

    /// The attributes of a primitive; `None` without positions.
    pub fn read(
        &mut self,
        primitive: &Item<'_>,
        warnings: &mut Vec<Fault>,
    ) -> Result<Option<Arc<Attributes>>, Fault> {
        let Some(base) = primitive.child("attributes")? else {
            return Ok(None);
        };
        let Some(position) = base.size("POSITION")? else {
            return Ok(None);
        };
        let accessor = self.accessors.get(position)?;
        let count = accessor.count;
        let targets = primitive.objects("targets")?;
        let sets = joint_sets(&base, warnings)?;
        let key = key_of(&base, &targets, &sets)?;
        if let Some(known) = self.read.get(&key) {
            return Ok(Some(Arc::clone(known)));
        }
        // A morph target may stand on no bytes at all, so that the file does not bound their number.
        let elements = count.saturating_mul(targets.len().saturating_add(1));
        self.left = self.left.checked_sub(elements).ok_or_else(|| {
            let limit = self.max_elements;
            primitive
                .fault(format!("more than {limit} vertices and morphed vertices in one mesh are not read"))
        })?;
        let mut attributes = self.read_base(&base, count)?;
        if !sets.is_empty() {
            attributes.skin = Some(self.read_skin(&base, &sets, count, warnings)?);
        }
        attributes.targets =
            targets.iter().map(|target| self.read_target(target, count)).collect::<Result<_, _>>()?;
        let attributes = Arc::new(attributes);
        self.read.insert(key, Arc::clone(&attributes));
        Ok(Some(attributes))
    }

    fn read_base(&self, item: &Item<'_>, count: usize) -> Result<Attributes, Fault> {
        let mut attributes = Attributes::default();
        for name in BASE {
            let widths: &[usize] = match name {
                "POSITION" | "NORMAL" => &[3],
                "TANGENT" => &[4],
                "COLOR_0" => &[3, 4],
                _ => &[2],
            };
            let Some(index) = self.checked(item, name, widths, count)? else {
                continue;
            };
            match name {
                "POSITION" => attributes.positions = self.vec3s(index)?,
                "NORMAL" => attributes.normals = Some(self.vec3s(index)?),
                "TANGENT" => attributes.tangents = Some(self.vec4s(index)?),
                "TEXCOORD_0" => attributes.tex_coords0 = Some(self.vec2s(index)?),
                "TEXCOORD_1" => attributes.tex_coords1 = Some(self.vec2s(index)?),
                _ => attributes.colors = Some(self.vec4s(index)?),
            }
        }
        Ok(attributes)
    }

    fn read_target(&self, item: &Item<'_>, count: usize) -> Result<Deltas, Fault> {
        let deltas = |name| match self.checked(item, name, &[3], count)? {
            Some(index) => self.vec3s(index).map(Some),
            None => Ok(None),
        };
        let [positions, normals, tangents] = MORPHED;
        Ok(Deltas { positions: deltas(positions)?, normals: deltas(normals)?, tangents: deltas(tangents)? })
    }

    /// The strongest four joints of each vertex with weights of sum 1.
    fn read_skin(
        &self,
        item: &Item<'_>,
        sets: &[(String, String)],
        count: usize,
        warnings: &mut Vec<Fault>,
    ) -> Result<Vec<Hold>, Fault> {
        let mut read = Vec::new();
        for (joints_name, weights_name) in sets {
            let Some((joints, weights)) = self.checked(item, joints_name, &[4], count)?.zip(self.checked(
                item,
                weights_name,
                &[4],
                count,
            )?) else {
                continue;
            };
            self.require(item, joints_name, joints, |a| {
                matches!(a.component, Component::U8 | Component::U16)
            })?;
            read.push((self.accessors.quadruples(joints)?, self.accessors.floats::<4>(weights, 0.0)?));
        }
        self.accessors.take(count, size_of::<Hold>(), item.place())?;
        let mut holds = Vec::with_capacity(count);
        let (mut repaired, mut twice, mut cut, mut free) = (0_usize, 0_usize, 0_usize, 0_usize);
        let mut hold: Vec<(u32, f32)> = Vec::new();
        for vertex in 0..count {
            hold.clear();
            let sets =
                read.iter().filter_map(|(joints, weights)| joints.get(vertex).zip(weights.get(vertex)));
            for (joints, weights) in sets {
                repaired += weights.iter().filter(|weight| !(weight.is_finite() && **weight >= 0.0)).count();
                let pairs = joints.iter().copied().zip(weights.iter().copied());
                hold.extend(pairs.filter(|(_, weight)| weight.is_finite() && *weight > 0.0));
            }
            twice += usize::from(merge_twins(&mut hold));
            cut += usize::from(hold.len() > 4);
            free += usize::from(hold.is_empty());
            holds.push(strongest(&mut hold));
        }
        for (number, what) in [
            (repaired, "weights are negative or not finite and count as 0"),
            (twice, "vertices name a joint twice; its weights are added"),
            (cut, "vertices have more than 4 joints; the 4 strongest are kept"),
            (free, "vertices have no joint with a weight; they stay where they are"),
        ] {
            if number > 0 {
                warnings.push(item.fault(format!("{number} {what}")));
            }
        }
        Ok(holds)
    }

    /// The accessor behind a name, if it is there and fits.
    fn checked(
        &self,
        item: &Item<'_>,
        name: &str,
        widths: &[usize],
        count: usize,
    ) -> Result<Option<usize>, Fault> {
        let Some(index) = item.size(name)? else {
            return Ok(None);
        };
        let accessor = self.accessors.get(index)?;
        self.require(item, name, index, |a| !a.is_matrix && widths.contains(&a.width))?;
        if accessor.component == Component::U32 {
            let reason = format!("accessor {index} has 32-bit integers");
            return Err(Fault::new(format!("{}/{name}", item.place()), reason));
        }
        if accessor.count != count {
            let reason = format!("it has {} elements, POSITION has {count}", accessor.count);
            return Err(Fault::new(format!("{}/{name}", item.place()), reason));
        }
        Ok(Some(index))
    }

    fn require(
        &self,
        item: &Item<'_>,
        name: &str,
        index: usize,
        fits: impl Fn(&Accessor) -> bool,
    ) -> Result<(), Fault> {
        match fits(self.accessors.get(index)?) {
            true => Ok(()),
            false => {
                let reason = format!("accessor {index} has the wrong type");
                Err(Fault::new(format!("{}/{name}", item.place()), reason))
            }
        }
    }

    fn vec2s(&self, index: usize) -> Result<Vec<Vec2>, Fault> {
        let values = self.accessors.floats::<2>(index, 0.0)?;
        Ok(values.into_iter().map(Vec2::from).collect())
    }

    fn vec3s(&self, index: usize) -> Result<Vec<Vec3>, Fault> {
        let values = self.accessors.floats::<3>(index, 0.0)?;
        Ok(values.into_iter().map(Vec3::from).collect())
    }

    fn vec4s(&self, index: usize) -> Result<Vec<Vec4>, Fault> {
        let values = self.accessors.floats::<4>(index, 1.0)?;
        Ok(values.into_iter().map(Vec4::from).collect())
    }
}

/// Names of the sets of joints and weights that a primitive has.
fn joint_sets(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Vec<(String, String)>, Fault> {
    let mut sets = Vec::new();
    for set in 0..=MAX_JOINT_SETS {
        let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        match (item.get(&joints).is_some(), item.get(&weights).is_some()) {
            (true, true) if set < MAX_JOINT_SETS => sets.push((joints, weights)),
            (true, true) => {
                let most = MAX_JOINT_SETS * 4;
                warnings.push(item.fault(format!("more than {most} joints a vertex are not looked at")));
            }
            (false, false) => break,
            _ => {
                warnings
                    .push(item.fault(format!("{joints} and {weights} go together; the one was left out")));
                break;
            }
        }
    }
    Ok(sets)
}

fn key_of(base: &Item<'_>, targets: &[Item<'_>], sets: &[(String, String)]) -> Result<Key, Fault> {
    let mut key = Key::new();
    let joints = sets.iter().flat_map(|(joints, weights)| [joints.as_str(), weights.as_str()]);
    for name in BASE.into_iter().chain(joints) {
        if let Some(index) = base.size(name)? {
            key.push((0, name.to_owned(), index));
        }
    }
    for (number, target) in (1..).zip(targets) {
        for name in MORPHED {
            if let Some(index) = target.size(name)? {
                key.push((number, name.to_owned(), index));
            }
        }
    }
    // Targets without any deltas count too.
    key.push((targets.len(), String::new(), 0));
    Ok(key)
}

/// Adds the weights of a joint that is named twice, in the place of the first; whether there was one.
fn merge_twins(holds: &mut Vec<(u32, f32)>) -> bool {
    let count = holds.len();
    for at in (1..count).rev() {
        let Some(&(joint, weight)) = holds.get(at) else { continue };
        if let Some((_, sum)) = holds.iter_mut().take(at).find(|(other, _)| *other == joint) {
            *sum = (*sum + weight).min(f32::MAX);
            holds.remove(at);
        }
    }
    holds.len() < count
}

/// At most four holds, their weights made a sum of 1; all zero when there are none.
fn strongest(holds: &mut Vec<(u32, f32)>) -> Hold {
    // Stable, so that equally strong ones keep the order of the file.
    holds.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    holds.truncate(4);
    let sum: f64 = holds.iter().map(|(_, weight)| f64::from(*weight)).sum();
    let sum = if (sum - 1.0).abs() <= SUM_ROUNDING { 1.0 } else { sum };
    let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
    for ((to_joint, to_weight), (joint, weight)) in joints.iter_mut().zip(&mut weights).zip(holds.drain(..)) {
        (*to_joint, *to_weight) = (joint as u16, (f64::from(weight) / sum) as f32);
    }
    (joints, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strongest_joints_are_kept_with_weights_of_sum_one() {
        let mut holds = vec![(7, 0.1), (8, 0.4), (9, 0.2), (5, 0.2), (6, 0.1), (4, 0.05)];
        let (joints, weights) = strongest(&mut holds);
        assert_eq!(joints, [8, 9, 5, 7]);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((weights[0] - 0.4 / 0.9).abs() < 1e-6);
        assert_eq!(strongest(&mut vec![(3, 0.5)]), ([3, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]));
        let mut twins = vec![(3, 0.25), (1, 0.25), (3, 0.5)];
        assert!(merge_twins(&mut twins) && !merge_twins(&mut twins));
        assert_eq!(twins, [(3, 0.75), (1, 0.25)]);
        assert_eq!(strongest(&mut Vec::new()), ([0; 4], [0.0; 4]));
        // The sum of the largest numbers is more than single precision holds.
        assert_eq!(strongest(&mut vec![(1, f32::MAX), (2, f32::MAX)]).1, [0.5, 0.5, 0.0, 0.0]);
    }
}
