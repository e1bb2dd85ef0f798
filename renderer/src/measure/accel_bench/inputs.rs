//! What is built in a measurement: a grid of triangles, boxes and instances scattered in a cube. Enters: how many. Leaves:
//! plain arrays, neighbours near one another.

use caustica_gpu::pack_instance;
use glam::{DVec3, Vec3};

use crate::tables::order_of;

pub(super) const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// The corners of a unit cube, x first.
pub(super) const CUBE_POSITIONS: [[f32; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];

pub(super) const CUBE_INDICES: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// The smallest whole number whose power is at least `count`.
fn side_of(count: u32, power: u32) -> u32 {
    let enough = |side: u32| u64::from(side).pow(power) >= u64::from(count);
    let guess = f64::from(count).powf(1.0 / f64::from(power)) as u32;
    // The root is rounded: the side is one of a few near it.
    (guess.saturating_sub(1).max(1)..).find(|side| enough(*side)).unwrap_or(guess)
}

/// Exactly `count` triangles on a square grid of shared vertices with bumps, along a Morton curve: positions, and the
/// corners of each triangle.
pub(super) fn bumpy_grid(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let side = side_of(count.div_ceil(2), 2);
    let row = side + 1;
    let height = |x: u32, y: u32| (x as f32 * 0.7).sin() * (y as f32 * 0.45).cos();
    let positions =
        (0..row).flat_map(|y| (0..row).map(move |x| [x as f32, y as f32, height(x, y)])).collect();
    let cells: Vec<DVec3> =
        (0..side).flat_map(|y| (0..side).map(move |x| DVec3::new(f64::from(x), f64::from(y), 0.0))).collect();
    let triangles = order_of(&cells)
        .into_iter()
        .flat_map(|cell| {
            let corner = cell / side * row + cell % side;
            [[corner, corner + 1, corner + row], [corner + 1, corner + row + 1, corner + row]]
        })
        .take(count as usize)
        .collect();
    (positions, triangles)
}

/// `count` cells of a cube of cells 2 apart, along a Morton curve.
fn scattered(count: u32) -> impl Iterator<Item = (u32, Vec3)> {
    let side = side_of(count, 3);
    let at =
        move |i: u32| DVec3::new(f64::from(i % side), f64::from(i / side % side), f64::from(i / side / side));
    let cells: Vec<DVec3> = (0..count).map(at).collect();
    order_of(&cells).into_iter().map(move |i| (i, at(i).as_vec3() * 2.0))
}

/// Boxes of sides 0.5 to 1.5.
pub(super) fn scattered_boxes(count: u32) -> Vec<[f32; 6]> {
    scattered(count)
        .map(|(i, low)| {
            let high = low + 0.5 + (i % 11) as f32 * 0.1;
            [low.x, low.y, low.z, high.x, high.y, high.z]
        })
        .collect()
}

/// Packed descriptors of unit cubes.
pub(super) fn scattered_instances(count: u32, blas_address: u64) -> Vec<u8> {
    scattered(count)
        .flat_map(|(i, at)| {
            let mut transform = IDENTITY;
            for (row, shift) in transform.iter_mut().zip(at.to_array()) {
                row[3] = shift;
            }
            pack_instance(transform, i, 0xff, 0, blas_address)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_holds_the_count_and_no_less_would() {
        for (count, power) in [(1, 2), (2, 2), (4, 2), (5, 2), (50_000, 2), (27, 3), (28, 3), (2_000_000, 3)]
        {
            let side = side_of(count, power);
            assert!(u64::from(side).pow(power) >= u64::from(count), "{side} for {count}");
            assert!(u64::from(side - 1).pow(power) < u64::from(count), "{side} for {count}");
        }
    }

    #[test]
    fn the_grid_has_the_triangles_asked_for_each_once() {
        for count in [1, 2, 7, 1000] {
            let (positions, mut triangles) = bumpy_grid(count);
            assert_eq!(triangles.len(), count as usize);
            assert!(triangles.iter().flatten().all(|vertex| (*vertex as usize) < positions.len()));
            triangles.sort_unstable();
            triangles.dedup();
            assert_eq!(triangles.len(), count as usize, "no triangle twice");
        }
    }

    #[test]
    fn boxes_and_instances_are_distinct_and_neighbours_lie_together() {
        let boxes = scattered_boxes(1000);
        assert!(boxes.iter().all(|b| b[0] < b[3] && b[1] < b[4] && b[2] < b[5]));
        let near = boxes.windows(2).filter(|pair| {
            let step: f32 = (0..3).map(|axis| (pair[0][axis] - pair[1][axis]).abs()).sum();
            assert!(step > 0.0, "two boxes in one place");
            step <= 4.0
        });
        // Three in four steps of a Morton curve go to a neighbour or across one edge of a block of eight.
        assert!(near.count() > 700);
        assert_eq!(scattered_instances(10, 7).len(), 640);
    }
}
