//! Polygons to triangles. In: a mesh of tobj with faces of any number of corners. Out: the same with triangles alone.
//! A convex face becomes a fan around its first corner, as ever; the others are clipped by earcut in their plane. What
//! crosses itself has no right triangles and costs earcut the cube of its corners: a fan too, and counted.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::DVec3;

/// Sine of the inward angle up to which a corner counts as straight.
const STRAIGHT: f64 = 1e-6;

/// Most corners of a face that may cross itself and is clipped all the same.
const FEW: usize = 32;
/// Most corners of a face that is clipped: whether it crosses itself is asked of every two edges.
pub(super) const MANY: usize = 1 << 14;

/// How many faces should have been clipped and became fans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fans {
    /// They cross themselves.
    pub crossed: usize,
    /// They have more than [`MANY`] corners, so that nobody asked.
    pub large: usize,
}

impl std::iter::Sum for Fans {
    fn sum<I: Iterator<Item = Self>>(fans: I) -> Self {
        fans.fold(Self::default(), |a, b| Self { crossed: a.crossed + b.crossed, large: a.large + b.large })
    }
}

/// Splits all faces.
pub(super) fn triangulate(mesh: &mut tobj::Mesh) -> Fans {
    let arities = std::mem::take(&mut mesh.face_arities);
    let mut fans = Fans::default();
    if arities.is_empty() {
        return fans;
    }
    let mut triangles = Vec::with_capacity(mesh.indices.len() * 3);
    let mut clipper = Clipper::default();
    let mut rest = &mesh.indices[..];
    for arity in arities {
        let Some((face, after)) = rest.split_at_checked(arity as usize) else {
            break;
        };
        rest = after;
        let corners: Vec<DVec3> = face.iter().map(|&index| position(mesh, index)).collect();
        let normal = newell(&corners);
        if face.len() < 4 || is_convex(&corners, normal) {
            fan(face, &mut triangles);
        } else if !clipper.clip(face, &corners, normal, &mut triangles) {
            fan(face, &mut triangles);
            let reason = if face.len() > MANY { &mut fans.large } else { &mut fans.crossed };
            *reason += 1;
        }
    }
    mesh.indices = triangles;
    fans
}

fn position(mesh: &tobj::Mesh, index: u32) -> DVec3 {
    let (positions, _) = mesh.positions.as_chunks::<3>();
    positions.get(index as usize).map_or(DVec3::ZERO, |&[x, y, z]| glam::Vec3::new(x, y, z).as_dvec3())
}

fn fan(face: &[u32], triangles: &mut Vec<u32>) {
    let Some((&first, others)) = face.split_first() else {
        return;
    };
    for &[second, third] in others.array_windows::<2>() {
        triangles.extend([first, second, third]);
    }
}

/// Twice the area along the mean normal (Newell's method), taken from the first corner so that far ones keep digits.
fn newell(corners: &[DVec3]) -> DVec3 {
    let Some((&first, others)) = corners.split_first() else {
        return DVec3::ZERO;
    };
    others.array_windows::<2>().map(|[a, b]| (*a - first).cross(*b - first)).sum()
}

/// Whether no corner points inward. True where there is no plane to judge it in.
fn is_convex(corners: &[DVec3], normal: DVec3) -> bool {
    let Some(normal) = normal.try_normalize() else {
        return true;
    };
    let next = |i: usize| corners.get((i + 1) % corners.len()).copied().unwrap_or_default();
    corners.iter().enumerate().all(|(i, &corner)| {
        let (before, after) = (next(i) - corner, next(i + 1) - next(i));
        before.cross(after).dot(normal) >= -STRAIGHT * before.length() * after.length()
    })
}

/// Whether an outline crosses itself nowhere and comes to no vertex more than twice, as the two sides of a slit do.
fn is_simple(face: &[u32], outline: &[[f64; 2]]) -> bool {
    let mut vertices = face.to_vec();
    vertices.sort_unstable();
    if vertices.array_windows::<3>().any(|[a, _, c]| a == c) {
        return false;
    }
    let side = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2], [px, py]: [f64; 2]| {
        (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    };
    let ends = outline.iter().cycle().skip(1);
    let edges: Vec<([f64; 2], [f64; 2])> = outline.iter().copied().zip(ends.copied()).collect();
    edges.iter().enumerate().all(|(i, &(a, b))| {
        let later = edges.get(i + 1..).unwrap_or_default();
        !later
            .iter()
            .any(|&(c, d)| side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0)
    })
}

#[derive(Default)]
struct Clipper {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    places: Vec<u32>,
}

impl Clipper {
    /// Adds the triangles of a face; false when there are none.
    fn clip(&mut self, face: &[u32], corners: &[DVec3], normal: DVec3, triangles: &mut Vec<u32>) -> bool {
        let size = normal.length().sqrt().recip();
        let Some(&first) = corners.first().filter(|_| size.is_finite()) else {
            return false;
        };
        // Of unit size and near zero, whatever the model's.
        let unit: Vec<[f64; 3]> =
            corners.iter().map(|&corner| ((corner - first) * size).to_array()).collect();
        let in_plane = face.len() <= MANY && project3d_to_2d(&unit, unit.len(), &mut self.flat);
        if !in_plane || (face.len() > FEW && !is_simple(face, &self.flat)) {
            return false;
        }
        self.places.clear();
        self.earcut.earcut(self.flat.iter().copied(), &[], &mut self.places);
        let (found, _) = self.places.as_chunks::<3>();
        for &places in found {
            let [a, b, c] = places.map(|place| face.get(place as usize).copied().unwrap_or_default());
            let [p, q, r] = places.map(|place| corners.get(place as usize).copied().unwrap_or_default());
            // Turned as the face is.
            let forward = (q - p).cross(r - p).dot(normal) >= 0.0;
            triangles.extend(if forward { [a, b, c] } else { [a, c, b] });
        }
        !found.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_of(outline: &[[f32; 3]]) -> (usize, f64, f64) {
        let count = outline.len() as u32;
        let mut mesh = tobj::Mesh {
            positions: outline.concat(),
            indices: (0..count).collect(),
            face_arities: vec![count],
            ..tobj::Mesh::default()
        };
        triangulate(&mut mesh);
        let corners: Vec<DVec3> = (0..count).map(|index| position(&mesh, index)).collect();
        let whole = newell(&corners);
        let areas = mesh.indices.as_chunks::<3>().0.iter().map(|t| {
            let [p, q, r] = t.map(|index| position(&mesh, index));
            (q - p).cross(r - p)
        });
        let areas: Vec<DVec3> = areas.collect();
        let sum: f64 = areas.iter().map(|area| area.length()).sum();
        assert!(areas.iter().all(|area| area.dot(whole) >= 0.0), "{areas:?}");
        (areas.len(), sum / 2.0, whole.length() / 2.0)
    }

    /// A fan of a concave face covers more than the face, or the same place twice.
    #[test]
    fn triangles_cover_a_face_once() {
        let arrow = [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.5, 1.0, 0.0]];
        let comb =
            [[0, 0], [5, 0], [5, 3], [4, 1], [3, 3], [2, 1], [1, 3]].map(|[x, z]| [x as f32, 7.0, z as f32]);
        let hexagon =
            [[2, 0], [1, 2], [-1, 2], [-2, 0], [-1, -2], [1, -2]].map(|[x, y]| [x as f32, y as f32, 1.0]);
        for outline in [&arrow[..], &comb, &hexagon] {
            for turned in [outline.to_vec(), outline.iter().rev().copied().collect()] {
                for shift in 0..turned.len() {
                    let mut turned = turned.clone();
                    turned.rotate_left(shift);
                    let (count, sum, whole) = area_of(&turned);
                    assert_eq!(count, outline.len() - 2);
                    assert!((sum - whole).abs() < 1e-9 * whole, "{sum} for {whole}");
                }
            }
        }
    }

    /// Earcut takes minutes for the first two.
    #[test]
    fn outlines_that_cross_themselves_are_fans() {
        let comb = [[0, 0], [5, 0], [5, 3], [4, 1], [3, 3], [2, 1], [1, 3]];
        let positions: Vec<f32> = comb.iter().flat_map(|&[x, y]| [x as f32, y as f32, 0.0]).collect();
        let round_and_round: Vec<u32> = (0..21_000).map(|corner| corner % 7).collect();
        let star: Vec<f32> =
            (0..2000).flat_map(|i| [(i * 7919 % 2003) as f32, (i * 104_729 % 1999) as f32, 0.0]).collect();
        let slit =
            [[0, 0], [4, 0], [4, 4], [0, 4], [0, 2], [2, 2], [0, 2]].map(|[x, y]| [x as f32, y as f32, 0.0]);
        let fans = |crossed, large| Fans { crossed, large };
        for (positions, face, fans) in [
            (positions, round_and_round, fans(0, 1)),
            (star, (0..2000).collect(), fans(1, 0)),
            (slit.concat(), (0..7).collect(), fans(0, 0)),
        ] {
            let arity = face.len();
            let mut mesh = tobj::Mesh {
                positions,
                indices: face,
                face_arities: vec![arity as u32],
                ..tobj::Mesh::default()
            };
            assert_eq!(triangulate(&mut mesh), fans, "{arity} corners");
        }
    }
}
