//! The shader library against oracles in double precision: robustness, rows 1 and 3 to 13, each with the naive form
//! beside it, which fails. Each snippet runs on the device through the renderer's own compiler; passes that work on tables
//! alone run whole.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

mod accumulate;
mod bsdf;
mod color;
mod deform;
mod descriptors;
mod directions;
mod environment;
mod fresnel;
mod ggx;
mod lights;
mod lobes;
mod lobes_bsdf;
mod offsets;
mod random;
mod samplers;
mod samplers_apart;
mod scatter;
mod shape_surface;
mod shapes;
mod table_pass;
