//! Local transforms in double precision: translation, rotation and scale, or a matrix that has shear.
//! In: values of a file or of an edit. Out: `DAffine3` to multiply. Knows no node and no hierarchy.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::project::LocalRecord;

mod flat;

pub(crate) use flat::orthogonal_columns;
pub use flat::{drawable, is_degenerate, is_flat};

/// Largest relative difference at which a matrix counts as exactly a translation, rotation and scale.
const EXACT_TRS_TOLERANCE: f64 = 1e-12;

/// Translation, rotation and scale, applied in the order scale, rotation, translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trs {
    /// Translation, metres in the parent's space.
    pub translation: DVec3,
    /// Unit rotation.
    pub rotation: DQuat,
    /// Scale along the node's own axes; may be negative.
    pub scale: DVec3,
}

impl Trs {
    /// Leaves everything in place.
    pub const IDENTITY: Self =
        Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// Only a translation, metres.
    pub const fn from_translation(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// `parent_from_node`.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite() && self.scale.is_finite()
    }
}

impl Default for Trs {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The transform of a node against its parent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "LocalRecord", into = "LocalRecord")]
pub enum Local {
    /// The usual form.
    Trs(Trs),
    /// A matrix that no translation, rotation and scale equals, such as one with shear.
    Matrix(DAffine3),
}

impl Default for Local {
    fn default() -> Self {
        Self::Trs(Trs::IDENTITY)
    }
}

impl From<Trs> for Local {
    fn from(trs: Trs) -> Self {
        Self::Trs(trs)
    }
}

impl Local {
    /// Takes a matrix apart when translation, rotation and scale represent it to 1e-12 relative;
    /// keeps it as it is otherwise.
    pub fn from_affine(parent_from_node: DAffine3) -> Self {
        match exact_trs(&parent_from_node) {
            Some(trs) => Self::Trs(trs),
            None => Self::Matrix(parent_from_node),
        }
    }

    /// `parent_from_node`.
    pub fn to_affine(&self) -> DAffine3 {
        match self {
            Self::Trs(trs) => trs.to_affine(),
            Self::Matrix(matrix) => *matrix,
        }
    }

    /// The translation, metres in the parent's space.
    pub fn translation(&self) -> DVec3 {
        match self {
            Self::Trs(trs) => trs.translation,
            Self::Matrix(matrix) => matrix.translation,
        }
    }

    /// Translation, rotation and scale; of a matrix the nearest ones, shear is dropped.
    pub fn nearest_trs(&self) -> Trs {
        match self {
            Self::Trs(trs) => *trs,
            Self::Matrix(matrix) => nearest_trs(matrix),
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Trs(trs) => trs.is_finite(),
            Self::Matrix(matrix) => matrix.is_finite(),
        }
    }
}

/// Orthonormal axes by Gram-Schmidt in the order x, y, z; a mirrored matrix gets a negative x scale.
/// A zero axis gets any unit axis that completes the frame, with scale zero.
fn nearest_trs(matrix: &DAffine3) -> Trs {
    let m = matrix.matrix3;
    let lengths = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
    if !lengths.is_finite() {
        return Trs::from_translation(matrix.translation);
    }
    let mirrored = m.determinant() < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    let x_hint = m.x_axis * sign;
    let x = x_hint.try_normalize().or_else(|| m.y_axis.cross(m.z_axis).try_normalize()).unwrap_or(DVec3::X);
    let y = (m.y_axis - x * x.dot(m.y_axis))
        .try_normalize()
        .or_else(|| m.z_axis.cross(x).try_normalize())
        .unwrap_or_else(|| x.any_orthonormal_vector());
    let z = x.cross(y);
    Trs {
        translation: matrix.translation,
        rotation: DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize(),
        scale: DVec3::new(sign * lengths.x, lengths.y, lengths.z),
    }
}

fn exact_trs(matrix: &DAffine3) -> Option<Trs> {
    let trs = nearest_trs(matrix);
    let again = trs.to_affine().matrix3.to_cols_array();
    let wanted = matrix.matrix3.to_cols_array();
    let size = wanted.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let close = again.iter().zip(&wanted).all(|(a, b)| (a - b).abs() <= EXACT_TRS_TOLERANCE * size);
    close.then_some(trs)
}

/// The part of a placement that a camera uses: rotation and translation without scale or mirroring.
/// The view axis (-Z) and the up side (+Y) are kept, X completes a right-handed frame. An axis that is scaled to nothing follows from
/// the other two.
pub fn rigid(world_from_node: &DAffine3) -> DAffine3 {
    let m = world_from_node.matrix3;
    let z = m.z_axis.try_normalize().or_else(|| m.x_axis.cross(m.y_axis).try_normalize()).unwrap_or(DVec3::Z);
    let x = m.y_axis.cross(z).try_normalize().or_else(|| (m.x_axis - z * z.dot(m.x_axis)).try_normalize());
    let x = x.unwrap_or_else(|| z.any_orthonormal_vector());
    DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: world_from_node.translation }
}
