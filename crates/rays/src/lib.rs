//! The ray kernel of twinray: triangles and rays in, hits out.
//!
//! Here live the acceleration structure ([`Bvh`]), its build, its traversal and the ray–triangle
//! test. Light, materials, scenes and random numbers do not: this crate knows geometry only, and is
//! useful alone. `twinray-scene` is the only crate of the engine that calls it. It is also the
//! engine's only home of SIMD and of `unsafe`.
//!
//! What is promised, and tested:
//! - *Watertight*: a ray aimed at an edge or a vertex that triangles share (the same vertex bits)
//!   never slips between them.
//! - *Same bits everywhere*: no fused multiply-add, no reassociation; every instruction set gives
//!   the same hits, and the build does not depend on the number of threads.
//! - *Order-free ties*: of hits at equal distance the front-facing one wins, then the lower
//!   triangle id.
//!
//! ```
//! use twinray_rays::{Bvh, Ray};
//!
//! let bvh = Bvh::build(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
//! let hit = bvh.closest_hit(&Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0])).unwrap();
//! assert_eq!((hit.triangle, hit.t, hit.front), (0, 2.0, true));
//! assert_eq!((hit.u, hit.v), (0.25, 0.5));
//! ```
//!
//! Code map: [`Bvh`] in `bvh`, construction in `build` (`binary`, then `collapse`),
//! memory layout in `node`, per-ray constants
//! in `ray`, the walk in `traverse`, the eight-lane tests in `lanes` (portable, the oracle) and
//! `wide` (AVX2 and AVX-512), the exact single-triangle test in `triangle`.

mod binary;
mod bounds;
mod build;
mod bvh;
mod collapse;
mod lanes;
mod node;
mod ray;
mod traverse;
mod triangle;
#[cfg(target_arch = "x86_64")]
mod wide;

#[cfg(test)]
mod oracle;

pub use bvh::Bvh;
pub use ray::{Hit, NO_TRIANGLE, Ray};
