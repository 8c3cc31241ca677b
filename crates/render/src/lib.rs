//! What one makes of a solution: pictures for now; and a path tracer to compare solutions with.
//!
//! Products take an immutable `Solution` and a `PatchScene`; they never touch the solver's state, no file and no
//! terminal. `picture` is the paper's own image: the patches as a camera sees them; `display` turns radiance into
//! pixels that a screen shows; `reference` needs no solution and shares no transport with the solver.

mod aovs;
pub mod compare;
mod direct;
pub mod display;
mod element;
mod film;
mod gather;
mod grid;
pub mod image;
mod lights;
mod marked;
pub mod picture;
mod reconstruct;
pub mod reference;
mod sums;
mod vantage;
mod vertex;
pub mod walk;

pub use aovs::{AovOptions, Aovs, aovs};
pub use display::{Exposure, PhysicalCamera, ToneCurve, WhiteBalance};
pub use film::Crop;
pub use gather::{Gather, GatherOptions, IrradianceGather, RadianceGather};
pub use image::Image;
pub use marked::marked;
pub use picture::{Lobes, Picture, PictureOptions, render};
pub use reconstruct::{Reconstruction, Smooth, Surfaces};
