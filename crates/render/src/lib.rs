//! What one makes of a solution: pictures for now.
//!
//! Products take an immutable `Solution` and a `PatchScene`; they never touch the solver's state, no file and no
//! terminal. `picture` is the paper's own image: the patches as a camera sees them; `display` turns radiance into
//! pixels that a screen shows.

pub mod compare;
pub mod display;
mod element;
mod grid;
pub mod image;
pub mod picture;
mod reconstruct;

pub use display::{Exposure, ToneCurve};
pub use image::Image;
pub use picture::{Lobes, Picture, PictureOptions, render};
