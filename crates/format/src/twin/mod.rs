//! Solutions as files: the light of the patches, where it comes from, and what it takes to go on.
//!
//! Lives here: the types, and what each section of a `.twin` file means ([`write_solution`], [`StoredSolution`]);
//! `sections` is the container, which knows names, kinds and checksums only. Not here: how the light was found. The layout
//! is described for other programs in `docs/formats.md`.

mod header;
mod read;
mod sections;
mod write;

use twinray_solve::{PatchLight, Record};

pub use read::{StoredSolution, read_solution};
pub use write::write_solution;

// Arrays are written and mapped as they lie in memory.
#[cfg(target_endian = "big")]
compile_error!("`.twin` files are little-endian, and this processor is not");

/// A solution as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct SolutionFile<'a> {
    /// Where the light comes from.
    pub provenance: Provenance,
    /// The light. Arrays are `[patches]`, in the order of the scene's patches.
    pub light: PatchLight,
    /// What it takes to go on, to take pictures or to add other solves; `None` of a reference.
    pub record: Option<Record<'a>>,
}

/// What made a solution, and of which scene: enough to make it again.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// Name and version of the program, such as `twinray 0.1.0`.
    pub software: String,
    /// How the light was found.
    pub method: Method,
    /// Name of the scene, for messages.
    pub scene: String,
    /// Where the scene is and how it was cut.
    pub source: SceneSource,
    /// `PatchScene::fingerprint` of the scene: light of two solutions compares patch by patch only where it agrees.
    pub fingerprint: u64,
    /// Rays shot, or paths of a reference.
    pub rays: u64,
    /// Seed that the user gave.
    pub seed: u64,
    /// Which of how many parts this is, counted from 1; such have seeds of their own.
    pub part: Option<[u32; 2]>,
    /// Seeds that random numbers were made from, of all solves that were added up; ascending.
    pub seeds: Vec<u64>,
    /// Settings in words, such as `("preset", "default")`, in the order in which they are to be read.
    pub settings: Vec<(String, String)>,
    /// Relative RMS error that the method claims, √(ΣA ΔE²/ΣA E²) of luminance without emitters; infinite where it
    /// claims nothing.
    pub relative_error: f32,
}

/// Where a scene is, and how it was cut into patches.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSource {
    /// Name of a built-in scene, or path of a file as seen from the solution's folder, with `/` between folders.
    pub file: String,
    /// Metres of the file's unit of length.
    pub metres_per_unit: f64,
    /// Number of patches that was aimed at, or what the scene suggests.
    pub patches: Option<u64>,
    /// Side of a patch that was asked for instead, m; infinite for one patch per triangle.
    pub patch_size: Option<f64>,
    /// Whether every surface counts as two-sided.
    pub two_sided: bool,
    /// How it was lit beside what its file says, in words such as `("sun", "35,180")`; files among them as seen from the
    /// solution's folder.
    pub light: Vec<(String, String)>,
}

/// Ways to find the light of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The solver: bi-directional rays.
    Solve,
    /// An independent path tracer.
    Reference,
}

impl Method {
    /// As written in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solve => "solve",
            Self::Reference => "reference",
        }
    }
}

/// Names of sections that more than one file of this folder speaks of.
const HEADER: &str = "header";
const AREA: &str = "area";
const EMITS: &str = "emits";
const STANDARD_ERROR: &str = "error";
