//! Transforms without an inverse. What is flattened in one direction still has a picture, but ray tracing asks for an inverse (Vulkan,
//! VUID-VkTransformMatrixKHR-matrix-03799). In: any transform. Out: one with a thickness, or nothing where no area is left.

use glam::{DAffine3, DMat3, DVec3};

/// Shortest and longest axis that single precision on the device can square (f32 ends at 3.4e38).
const AXIS_LENGTH_RANGE: (f64, f64) = (1e-18, 1e18);
/// Shortest by longest axis below which the shortest is rounding.
const LEAST_RATIO: f64 = 1e-12;
/// Volume of the cell spanned by the unit axes from which on single precision inverts a transform.
const LEAST_VOLUME: f64 = 1e-6;
/// Thickness of what is flattened, in parts of its longest axis: the first that is enough.
const THICKNESSES: [f64; 3] = [1e-5, 1e-4, 1e-3];
/// Angle between two columns, as a cosine, at which they count as orthogonal.
const ORTHOGONAL: f64 = 1e-16;
/// Each makes the columns more orthogonal; it takes about six.
const MOST_SWEEPS: usize = 30;

/// Whether nothing of a transform can be rendered: not finite, scaled to nothing in two directions, or with axes that single
/// precision cannot hold. Such an instance never reaches the device.
pub fn is_degenerate(world_from_mesh: &DAffine3) -> bool {
    drawable(world_from_mesh).is_none()
}

/// Whether a transform flattens space to a plane that can be rendered.
pub fn is_flat(world_from_mesh: &DAffine3) -> bool {
    !is_sound(world_from_mesh) && drawable(world_from_mesh).is_some()
}

/// What is rendered for a transform: itself, or where it is flat the same with a thickness of a hundred thousandth of its width (a
/// thousandth of needles), turned so that it is not mirrored: the front stays where triangles go round counter-clockwise. `None`
/// where it is degenerate.
pub fn drawable(world_from_mesh: &DAffine3) -> Option<DAffine3> {
    if is_sound(world_from_mesh) {
        return Some(*world_from_mesh);
    }
    let size =
        world_from_mesh.matrix3.to_cols_array().iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    if !world_from_mesh.is_finite() || !(AXIS_LENGTH_RANGE.0..=AXIS_LENGTH_RANGE.1).contains(&size) {
        return None;
    }
    let unit = world_from_mesh.matrix3 * size.recip();
    let (columns, turn) = orthogonal_columns(unit);
    let lengths = [0, 1, 2].map(|axis| columns.col(axis).length());
    let by_length = |a: &usize, b: &usize| lengths[*a].total_cmp(&lengths[*b]);
    let [thin, middle, long] = {
        let mut order = [0, 1, 2];
        order.sort_by(by_length);
        order
    };
    let normal = columns.col(long).cross(columns.col(middle)).try_normalize()?;
    let across = turn.col(thin);
    let thickened = |thickness: f64| {
        let added = |sign: f64| {
            let along = normal * (sign * thickness * lengths[long]) - columns.col(thin);
            unit + DMat3::from_cols(along * across.x, along * across.y, along * across.z)
        };
        let matrix = if added(1.0).determinant() < 0.0 { added(-1.0) } else { added(1.0) };
        DAffine3 { matrix3: matrix * size, translation: world_from_mesh.translation }
    };
    THICKNESSES.into_iter().map(thickened).find(is_sound)
}

/// Whether single precision can hold and invert a transform.
fn is_sound(map: &DAffine3) -> bool {
    let m = map.matrix3;
    let axes = [m.x_axis, m.y_axis, m.z_axis];
    let lengths = axes.map(DVec3::length);
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let range = AXIS_LENGTH_RANGE.0.max(LEAST_RATIO * longest)..=AXIS_LENGTH_RANGE.1;
    if !map.is_finite() || !lengths.iter().all(|length| range.contains(length)) {
        return false;
    }
    let [x, y, z] = axes.map(DVec3::normalize);
    x.dot(y.cross(z)).abs() >= LEAST_VOLUME
}

/// Orthogonal columns, and the rotation that makes them of those of `matrix`: the first is `matrix * the second`.
/// The one-sided Jacobi method (Hestenes 1958).
pub(crate) fn orthogonal_columns(matrix: DMat3) -> (DMat3, DMat3) {
    let (mut columns, mut turn) = (matrix, DMat3::IDENTITY);
    for _ in 0..MOST_SWEEPS {
        let mut done = true;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (columns.col(p), columns.col(q));
            let product = a.dot(b);
            if product.abs() <= ORTHOGONAL * a.length() * b.length() {
                continue;
            }
            done = false;
            let zeta = (b.length_squared() - a.length_squared()) / (2.0 * product);
            let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
            let cosine = (1.0 + tangent * tangent).sqrt().recip();
            for matrix in [&mut columns, &mut turn] {
                let (a, b) = (matrix.col(p), matrix.col(q));
                *matrix.col_mut(p) = (a - b * tangent) * cosine;
                *matrix.col_mut(q) = (a * tangent + b) * cosine;
            }
        }
        if done {
            break;
        }
    }
    (columns, turn)
}
