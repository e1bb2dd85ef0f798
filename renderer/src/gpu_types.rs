//! Host twins of the structs and constants in `shaders/shared/`: same names, same order, scalar layout.
//! In: nothing. Out: plain-old-data types whose size and field offsets are asserted at compile time, and
//! [`twins`], the same numbers as data, for the test against SPIR-V reflection. Knows no table and no Vulkan.

/// Three rows of a 3x4 affine map: `p' = (dot(row.xyz, p) + row.w, ...)`.
pub type Rows = [[f32; 4]; 3];

/// One shared struct as data: what the layout test compares with SPIR-V reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Twin {
    /// Name of the struct in GLSL and in Rust.
    pub name: &'static str,
    /// Size in bytes, which is also the array stride.
    pub size: usize,
    /// Fields in order: name and offset in bytes.
    pub fields: &'static [(&'static str, usize)],
}

/// Declares the twins: each field with the offset that GLSL's scalar layout gives it, asserted here.
macro_rules! twins {
    ($($(#[$meta:meta])* struct $name:ident, size $size:literal {
        $($(#[$field_meta:meta])* $offset:literal $field:ident: $type:ty,)*
    })*) => {
        $(
            $(#[$meta])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name {
                $($(#[$field_meta])* pub $field: $type,)*
            }

            const _: () = {
                assert!(std::mem::size_of::<$name>() == $size);
                $(assert!(std::mem::offset_of!($name, $field) == $offset);)*
            };
        )*

        /// The structs of this file as data.
        pub(super) const TWINS: &[super::Twin] = &[$(super::Twin {
            name: stringify!($name),
            size: $size,
            fields: &[$((stringify!($field), $offset)),*],
        }),*];
    };
}

// Past the macro, so that the files see it.
mod accel;
mod frame;
mod scene;

pub use accel::*;
pub use frame::*;
pub use scene::*;

/// Every struct shared with GLSL.
pub fn twins() -> impl Iterator<Item = &'static Twin> {
    [scene::TWINS, frame::TWINS, accel::TWINS].into_iter().flatten()
}
