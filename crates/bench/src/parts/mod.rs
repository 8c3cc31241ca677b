//! The parts of the benchmark. A part is a file here: what it measures, and how that is put into words.
//!
//! To add one, write `parts/NAME.rs` with a `PART` and name it below, as a module and in [`PARTS`]; its result file, its
//! section of the document and its targets follow.

mod convergence;
mod embree;
mod headline;
mod kernel;
pub mod memory;
mod pictures;
mod scaling;
mod stages;
mod strategies;
mod threads;

use serde_json::Value;

use crate::document::Section;

/// In the order of the document.
pub const PARTS: &[Part] = &[
    kernel::PART,
    embree::PART,
    stages::PART,
    threads::PART,
    scaling::PART,
    convergence::PART,
    strategies::PART,
    headline::PART,
    pictures::PART,
    memory::PART,
];

/// Something that is measured, and said.
pub struct Part {
    /// Name of the part, of its result file, of its section.
    pub name: &'static str,
    /// What it is, in a line.
    pub what: &'static str,
    /// Measures.
    pub measure: fn(Effort) -> Result<Outcome, String>,
    /// Puts a stored result into words. Fails where the result is of another version of this part.
    pub describe: fn(&Value) -> Result<Section, String>,
}

/// What a measurement came to.
pub enum Outcome {
    /// The result, to be stored.
    Measured(Value),
    /// It cannot be measured here; why.
    Skipped(String),
}

/// How much work a measurement does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    divide: u64,
}

impl Effort {
    /// For the document.
    pub const FULL: Self = Self { divide: 1 };
    /// To see that it runs.
    pub const QUICK: Self = Self { divide: 50 };

    /// Rays where the document has `rays`.
    pub fn rays(self, rays: u64) -> u64 {
        (rays / self.divide).max(10_000)
    }

    /// Patches where the document has `patches`.
    pub fn patches(self, patches: usize) -> usize {
        (patches / self.divide as usize).max(500)
    }

    /// The scene's own number of patches, or far fewer.
    pub fn scene_patches(self) -> Option<usize> {
        (self != Self::FULL).then_some(8000)
    }

    /// Turns where the document has `turns`.
    pub fn turns(self, turns: usize) -> usize {
        if self == Self::FULL { turns } else { 1 }
    }

    /// Seconds where the document has `seconds`.
    pub fn seconds(self, seconds: f64) -> f64 {
        seconds / self.divide as f64
    }
}
