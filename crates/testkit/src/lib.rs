//! Statistical checks for tests, over closures and slices only.
//!
//! Names no type of the other crates, so that a crate's own unit tests can use it without meeting two copies
//! of that crate.

pub mod chi2;
pub mod ztest;
