//! What a solve will take, before it starts: its state, the rays in flight, the snapshot of the light.
//!
//! Sizes of the arrays are known; how many rays are in flight at once depends on the light of the scene, which only a
//! solve knows, so that this is guessed from the reflectance of its surfaces. Not here: the patches' own memory (scene).

use crate::frozen;
use crate::glossy::GlossyPatches;
use crate::params::{Params, Schedule};
use crate::sequential;
use crate::solution::GlossySolution;
use crate::source::Source;
use crate::wave::close;
use crate::waves::{warm_start_rays, wave_size};

/// Two deposits of a ray, and its places in the order.
const BYTES_PER_RAY: usize = 33;
/// The directions of its deposits, in scenes with lobes.
const BYTES_PER_GLOSSY_RAY: usize = 8;
/// Of a patch in a snapshot: irradiance, error bar, hits.
const SOLUTION_BYTES: usize = 20;
/// What allocating the lists of rays adds to them: they grow from step to step of the warm start, and leave gaps.
const GROWTH: f64 = 1.25;

/// What there is to be solved.
#[derive(Clone, Copy, Debug)]
pub struct Demand {
    /// Patches, K.
    pub patches: usize,
    /// Those of them that have a lobe.
    pub glossy: usize,
    /// True if there is a fixed camera.
    pub observed: bool,
    /// Mean reflectance of the patches by area: it decides how many rays a step of the warm start shoots at once.
    pub reflectance: f64,
    /// Rays to shoot; `None` if something else ends the solve.
    pub rays: Option<u64>,
}

/// Most memory of a solver, with the snapshot of its light at the end, in bytes.
///
/// The paper's preset keeps other sums than the default one, and a tree instead of a table.
pub fn solving_bytes(params: &Params, demand: &Demand) -> usize {
    let Demand { patches, glossy, .. } = *demand;
    let solution = SOLUTION_BYTES * patches
        + size_of::<GlossySolution>() * glossy
        + if glossy > 0 { GlossyPatches::BYTES_PER_PATCH * patches } else { 0 };
    if matches!(params.schedule, Schedule::Paper { .. }) {
        return sequential::state_bytes(patches, glossy) + solution;
    }
    let ray = BYTES_PER_RAY + if glossy > 0 { BYTES_PER_GLOSSY_RAY } else { 0 };
    let in_flight = (GROWTH * ray as f64 * rays_in_flight(params, demand) as f64) as usize;
    // What a step of the warm start has not sent on yet; it is gone before there is a solution.
    let unshot = size_of::<Source>() * patches;
    state_bytes(patches, glossy, demand.observed) + in_flight + solution.max(unshot)
}

/// Most rays that are in flight at once. The first step of the warm start shoots all light that is emitted, later ones
/// what comes back; waves grow with the rays so far.
fn rays_in_flight(params: &Params, demand: &Demand) -> u64 {
    let planned = warm_start_rays(params.warm_start, demand.patches, demand.glossy > 0);
    // Of one that returns ρ of the light at every step, 1 − ρ; some of it is lost in openings.
    let first = (1.0 - 0.8 * demand.reflectance.clamp(0.0, 1.0)) * planned as f64;
    let of_each = demand.rays.map_or(u64::MAX, |rays| rays / 2);
    let wave = if of_each <= planned { 0 } else { wave_size(of_each, demand.patches, demand.glossy > 0) };
    wave.max(first as u64)
}

/// Bytes that a solve of a scene of so many patches, of which some are glossy, keeps for each (default schedule), error
/// bars and table of the choice included; beside them are the lists of the rays in flight, 33 bytes a ray of a wave.
pub fn state_bytes(patches: usize, glossy: usize, observed: bool) -> usize {
    let lobe = close::BYTES_PER_GLOSSY_PATCH
        + frozen::BYTES_PER_GLOSSY_PATCH
        + GlossyPatches::BYTES_PER_GLOSSY_PATCH
        + if observed { close::BYTES_PER_OBSERVED_PATCH + GlossyPatches::BYTES_PER_OBSERVED_PATCH } else { 0 };
    let number = if glossy > 0 { GlossyPatches::BYTES_PER_PATCH } else { 0 };
    patches * (close::BYTES_PER_PATCH + frozen::BYTES_PER_PATCH + number) + glossy * lobe
}
