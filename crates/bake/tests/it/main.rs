//! Tests of the whole crate.

mod lightmap;
mod probes;
mod scenes;
mod vertices;
mod watch;
