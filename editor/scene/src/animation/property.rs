//! Numbers of lights, cameras and materials that clips change, by their names in glTF.
//! In: what a JSON pointer says behind the thing, or numbers. Out: which property it is, or the thing with it changed.
//! Names: `KHR_animation_pointer` and the object models of glTF 2.0 and of each extension.

use std::slice::from_mut;

use glam::{Vec2, Vec3, Vec4};

use crate::assets::{Camera, Light, LightKind, Material, Projection};

mod material;

/// One of the numbers or colours of a light, camera or material, by its place in the table of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Property(u16);

/// A row of such a table.
pub(crate) struct Row<T> {
    pointer: &'static str,
    /// Least and largest number.
    range: (f32, f32),
    /// The numbers; `None` where this one has no such property.
    slot: fn(&mut T) -> Option<&mut [f32]>,
}

/// What clips can change properties of.
pub(crate) trait Animated: Clone + 'static {
    const PROPERTIES: &'static [Row<Self>];
}

impl Property {
    /// The property of a material, by what its pointer says behind the material, such as
    /// `pbrMetallicRoughness/roughnessFactor`.
    pub fn of_material(pointer: &str) -> Option<Self> {
        Self::find::<Material>(pointer)
    }

    /// The property of a name.
    pub(crate) fn find<T: Animated>(pointer: &str) -> Option<Self> {
        let place = T::PROPERTIES.iter().position(|row| row.pointer == pointer)?;
        u16::try_from(place).ok().map(Self)
    }

    /// What its pointer says behind the thing.
    pub(crate) fn pointer<T: Animated>(self) -> &'static str {
        self.row::<T>().map_or("", |row| row.pointer)
    }

    fn row<T: Animated>(self) -> Option<&'static Row<T>> {
        T::PROPERTIES.get(usize::from(self.0))
    }

    /// How many numbers it has; 0: this one has no such property.
    pub(crate) fn width_in<T: Animated>(self, value: &T) -> usize {
        let mut value = value.clone();
        self.row::<T>().and_then(|row| (row.slot)(&mut value)).map_or(0, |slot| slot.len())
    }

    /// Least and largest number.
    pub(crate) fn range<T: Animated>(self) -> (f32, f32) {
        self.row::<T>().map_or((f32::MIN, f32::MAX), |row| row.range)
    }

    /// Puts numbers in, held to their range. What is not finite changes nothing.
    pub(crate) fn set<T: Animated>(self, value: &mut T, numbers: &[f32]) {
        let Some(row) = self.row::<T>() else { return };
        if !numbers.iter().all(|number| number.is_finite()) {
            return;
        }
        for (to, number) in (row.slot)(value).into_iter().flatten().zip(numbers) {
            *to = number.clamp(row.range.0, row.range.1);
        }
    }
}

/// Holds every number to its range. A number that is not finite is left to who refuses it.
pub(crate) fn hold<T: Animated>(value: &mut T) {
    let fits =
        |row: &Row<T>, number: &f32| !number.is_finite() || (row.range.0..=row.range.1).contains(number);
    // To ask for a number may make what has it, with numbers that fit.
    let mut asked = value.clone();
    for row in T::PROPERTIES {
        let numbers = (row.slot)(&mut asked).unwrap_or_default();
        if !numbers.iter().all(|number| fits(row, number)) {
            let numbers = (row.slot)(value).unwrap_or_default();
            numbers.iter_mut().for_each(|number| *number = number.clamp(row.range.0, row.range.1));
        }
    }
}

const ANY: (f32, f32) = (f32::MIN, f32::MAX);
const UNIT: (f32, f32) = (0.0, 1.0);
const POSITIVE: (f32, f32) = (0.0, f32::MAX);
/// What may not be 0.
const ABOVE_ZERO: (f32, f32) = (f32::MIN_POSITIVE, f32::MAX);
/// From 1 to what stands for no end.
const INDEX: (f32, f32) = (1.0, 1e6);
/// A cone to one side.
const CONE: (f32, f32) = (0.0, std::f32::consts::FRAC_PI_2);
/// Angle of view: less than to all sides.
const VIEW: (f32, f32) = (1e-4, std::f32::consts::PI - 1e-4);

const fn row<T>(pointer: &'static str, range: (f32, f32), slot: fn(&mut T) -> Option<&mut [f32]>) -> Row<T> {
    Row { pointer, range, slot }
}

fn one(number: &mut f32) -> Option<&mut [f32]> {
    Some(from_mut(number))
}

fn two(vector: &mut Vec2) -> Option<&mut [f32]> {
    let numbers: &mut [f32; 2] = vector.as_mut();
    Some(numbers)
}

fn three(vector: &mut Vec3) -> Option<&mut [f32]> {
    let numbers: &mut [f32; 3] = vector.as_mut();
    Some(numbers)
}

fn four(vector: &mut Vec4) -> Option<&mut [f32]> {
    let numbers: &mut [f32; 4] = vector.as_mut();
    Some(numbers)
}

impl Animated for Light {
    const PROPERTIES: &'static [Row<Self>] = &[
        row("color", POSITIVE, |light| three(&mut light.color)),
        row("intensity", POSITIVE, |light| one(&mut light.intensity)),
        row("range", ABOVE_ZERO, |light| match &mut light.kind {
            LightKind::Point { range_m, .. } | LightKind::Spot { range_m, .. } => {
                one(range_m.get_or_insert(1.0))
            }
            LightKind::Directional { .. } => None,
        }),
        row("spot/innerConeAngle", CONE, |light| match &mut light.kind {
            LightKind::Spot { inner_rad, .. } => one(inner_rad),
            _ => None,
        }),
        row("spot/outerConeAngle", CONE, |light| match &mut light.kind {
            LightKind::Spot { outer_rad, .. } => one(outer_rad),
            _ => None,
        }),
    ];
}

fn perspective(camera: &mut Camera) -> Option<&mut Camera> {
    matches!(camera.projection, Projection::Perspective { .. }).then_some(camera)
}

fn orthographic(camera: &mut Camera) -> Option<&mut Camera> {
    matches!(camera.projection, Projection::Orthographic { .. }).then_some(camera)
}

/// The far end and the shape of the image have no effect on rays, but are changed like the rest.
impl Animated for Camera {
    const PROPERTIES: &'static [Row<Self>] = &[
        row("perspective/yfov", VIEW, |camera| match &mut camera.projection {
            Projection::Perspective { yfov_rad } => one(yfov_rad),
            Projection::Orthographic { .. } => None,
        }),
        row("perspective/znear", ABOVE_ZERO, |camera| one(&mut perspective(camera)?.near_m)),
        row("perspective/zfar", ABOVE_ZERO, |camera| one(perspective(camera)?.far_m.get_or_insert(1.0))),
        row("perspective/aspectRatio", ABOVE_ZERO, |camera| {
            one(perspective(camera)?.aspect.get_or_insert(1.0))
        }),
        row("orthographic/ymag", ABOVE_ZERO, |camera| match &mut camera.projection {
            Projection::Orthographic { ymag_m } => one(ymag_m),
            Projection::Perspective { .. } => None,
        }),
        row("orthographic/znear", POSITIVE, |camera| one(&mut orthographic(camera)?.near_m)),
        row("orthographic/zfar", ABOVE_ZERO, |camera| one(orthographic(camera)?.far_m.get_or_insert(1.0))),
    ];
}
