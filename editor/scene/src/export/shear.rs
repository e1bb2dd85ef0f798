//! Matrices with shear, which a node of the format cannot hold, as two nodes that can. In: a matrix.
//! Out: the translation, rotation and scale of the outer node, and the rotation of the inner one.

use glam::{DAffine3, DQuat};

use crate::transform::{Local, Trs, orthogonal_columns};

/// Largest shear, relative to the longest axis, that is the rounding of a matrix in single precision.
const ROUNDING: f64 = 1e-6;
/// Matrices of other sizes stay as they are: nothing of them can be drawn.
const SIZES: std::ops::Range<f64> = 1e-100..1e100;

/// Outer and inner node of a matrix with shear; `None` where one node does.
///
/// Every matrix is a rotation, a scale, and another rotation (its singular value decomposition).
pub(super) fn two_nodes(local: &Local) -> Option<[Trs; 2]> {
    let Local::Matrix(matrix) = local else { return None };
    let columns = matrix.matrix3.to_cols_array();
    let size = columns.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let nearest = local.nearest_trs().to_affine().matrix3.to_cols_array();
    let has_shear = columns.iter().zip(&nearest).any(|(a, b)| (a - b).abs() > ROUNDING * size);
    if !has_shear || !SIZES.contains(&size) {
        return None;
    }
    let (orthogonal, turn) = orthogonal_columns(matrix.matrix3 * size.recip());
    let outer = DAffine3 { matrix3: orthogonal * size, translation: matrix.translation };
    let inner = Trs { rotation: DQuat::from_mat3(&turn.transpose()).normalize(), ..Trs::IDENTITY };
    Some([Local::Matrix(outer).nearest_trs(), inner])
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;

    #[test]
    fn two_nodes_place_what_a_matrix_places() {
        let flat = DMat3::from_cols(DVec3::new(1.0, 0.5, 0.0), DVec3::new(0.5, 0.25, 0.0), DVec3::Z);
        let sheared = DMat3::from_cols(DVec3::new(1.0, 0.1, 0.0), DVec3::new(0.3, 1.0, 0.5), DVec3::Z * 3.0);
        let mirrored = sheared * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        for matrix in [flat, sheared, mirrored, sheared * 1e-12, mirrored * 1e12] {
            let local = Local::Matrix(DAffine3::from_mat3_translation(matrix, DVec3::new(1.0, 2.0, 3.0)));
            let [outer, inner] = two_nodes(&local).unwrap();
            let both = outer.to_affine() * inner.to_affine();
            let error =
                (both.matrix3 - matrix).to_cols_array().iter().fold(0.0_f64, |most, e| most.max(e.abs()));
            let size = matrix.to_cols_array().iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            assert!(error <= 4e-15 * size, "{error:e} of {size:e}: {outer:?} {inner:?}");
            assert_eq!(both.translation, DVec3::new(1.0, 2.0, 3.0));
        }
        let rounded = DMat3::from_quat(DQuat::from_rotation_y(0.3)).as_mat3().as_dmat3();
        assert_eq!(two_nodes(&Local::Matrix(DAffine3::from_mat3(rounded))), None);
    }
}
