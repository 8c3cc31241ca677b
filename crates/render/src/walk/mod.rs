//! Light for eyes that walk: what a viewer on another processor needs to show a solution from anywhere.
//!
//! [`Nodes`] are the places where a viewer knows the light: the corners of the cells, between which it interpolates, so
//! that cells join smoothly. [`WalkLight`] gives them their irradiance, and glossy ones the radiance of all directions in
//! spherical harmonics, which serve any eye at once. What one remembered sample adds to that ([`Sample`]) flickers and is
//! averaged by the viewer over solutions, as the paper has it (§1). Called by the viewer's crate, which makes bytes of it.

mod light;
mod lobes;
mod nodes;

pub use light::{Lamp, NodeLight, Sample, WalkLight};
pub use lobes::{BASIS, basis};
pub use nodes::{NO_NODE, Nodes};
