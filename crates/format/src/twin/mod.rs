//! Solutions as files: the light of the patches with where it comes from.
//!
//! Lives here: the types, and what each section of a `.twin` file means ([`write`], [`read`]); `sections` is the
//! container, which knows names and checksums only. Not here: how the light was found. The layout is described for
//! other programs in `docs/formats.md`.

mod read;
mod sections;
mod write;

use twinray_solve::PatchLight;

pub use read::read_solution;
pub use write::write_solution;

/// The light of a scene's patches and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct SolutionFile {
    /// Where the light comes from.
    pub provenance: Provenance,
    /// The light. Arrays are `[patches]`, in the order of the scene's patches.
    pub light: PatchLight,
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
    /// `PatchScene::fingerprint` of the scene: light of two solutions compares patch by patch only where it agrees.
    pub fingerprint: u64,
    /// Rays shot, or paths of a reference.
    pub rays: u64,
    /// Seed of every random number.
    pub seed: u64,
    /// Settings in words, such as `("preset", "default")`, in the order in which they are to be read.
    pub settings: Vec<(String, String)>,
    /// Relative RMS error that the method claims, √(ΣA ΔE²/ΣA E²) of luminance without emitters; infinite where it
    /// claims nothing.
    pub relative_error: f32,
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

/// Names of the sections, and the bytes that one patch takes in each.
const HEADER: &str = "header";
const AREA: (&str, usize) = ("area", 4);
const EMITS: (&str, usize) = ("emits", 1);
const IRRADIANCE: (&str, usize) = ("irradiance", 12);
const STANDARD_ERROR: (&str, usize) = ("error", 4);
const HITS: (&str, usize) = ("hits", 4);
