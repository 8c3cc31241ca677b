//! Tests of the whole crate.

mod lightmap;
mod scenes;
mod vertices;
