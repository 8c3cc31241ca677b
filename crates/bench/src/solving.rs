//! Solves with a clock: the built-in scenes, the presets, and the pace of the solver.

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Estimator, Params, Solution, Solver};

use crate::measure::timed;

/// A built-in scene with about so many patches, or as many as it asks for.
pub fn scene(name: &str, patches: Option<usize>) -> Result<PatchScene, String> {
    let authored = builtin::by_name(name).ok_or_else(|| format!("no built-in scene {name}"))?;
    let count = patches.or(authored.suggested_patches).unwrap_or(100_000);
    let options = PatchOptions { budget: PatchBudget::Count(count), two_sided: false };
    PatchScene::new(&authored, options).map_err(|e| format!("{name}: {e}"))
}

/// A solver and the seconds it took to make it, warm start included.
pub fn start(scene: &PatchScene, params: Params) -> Result<(Solver<'_>, f64), String> {
    let (solver, seconds) = timed(|| Solver::new(scene, params, None));
    Ok((solver.map_err(|e| e.to_string())?, seconds))
}

/// The default preset with deposits on the hit alone.
pub fn forward_preset(seed: u64) -> Params {
    Params { estimator: Estimator::Forward, ..Params::default_preset(seed) }
}

/// Rays a second.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Of the whole solve, from nothing.
    pub whole: f64,
    /// Of its last four fifths: without set-up and warm start.
    pub later: f64,
}

/// The pace of a solve of so many rays on the current threads.
pub fn pace(scene: &PatchScene, params: Params, rays: u64) -> Result<Pace, String> {
    let (mut solver, start) = start(scene, params)?;
    let ((), before) = timed(|| solver.run(rays / 5));
    let first = solver.rays();
    // At least a wave, even where the warm start alone was as long.
    let ((), after) = timed(|| solver.run(rays.max(first + 1)));
    let all = solver.rays();
    Ok(Pace { whole: all as f64 / (start + before + after), later: (all - first) as f64 / after })
}

/// Luminance of the irradiance of every patch.
pub fn luminances(scene: &PatchScene, solution: &Solution) -> Vec<f64> {
    scene.patches().map(|p| solution.irradiance(p).luminance()).collect()
}

/// ΣA ΔE²/ΣA E², without emitters unless there is nothing else.
pub fn square_error(scene: &PatchScene, light: &[f64], reference: &[f64]) -> f64 {
    let only_emitters = scene.patches().all(|p| !scene.emission(p).is_black());
    let counted = || scene.patches().filter(|&p| only_emitters || scene.emission(p).is_black());
    let energy: f64 = counted().map(|p| scene.area(p) * reference[p.index()].powi(2)).sum();
    counted().map(|p| scene.area(p) * (light[p.index()] - reference[p.index()]).powi(2)).sum::<f64>() / energy
}

/// The light of a scene, from two long solves of the default preset with seeds of their own.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Per patch, the mean of both.
    pub light: Vec<f64>,
    /// Square error of that mean, from how far the two are apart.
    pub noise: f64,
    /// Rays of both.
    pub rays: u64,
    /// Arriving power, W.
    pub power: f64,
}

impl Reference {
    /// Solves with so many rays each.
    pub fn new(scene: &PatchScene, rays: u64) -> Result<Self, String> {
        let solve = |seed| {
            let (mut solver, _) = start(scene, Params::default_preset(seed))?;
            solver.run(rays);
            let solution = solver.solution();
            let power = solution.arriving_power(scene).luminance();
            Ok::<_, String>((luminances(scene, &solution), solver.rays(), power))
        };
        let (first, second) = (solve(9001)?, solve(9002)?);
        let light: Vec<f64> = first.0.iter().zip(&second.0).map(|(a, b)| 0.5 * (a + b)).collect();
        // Each is half the difference away from the mean, and the mean has half the variance of each: a quarter of the
        // squared difference.
        let noise = square_error(scene, &first.0, &light);
        Ok(Self { light, noise, rays: first.1 + second.1, power: 0.5 * (first.2 + second.2) })
    }

    /// Relative error of a solution, the reference's own noise subtracted.
    pub fn error(&self, scene: &PatchScene, solution: &Solution) -> f64 {
        (square_error(scene, &luminances(scene, solution), &self.light) - self.noise).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_that_of_the_solution_alone() {
        // Against a reference of few rays, whose noise is not small, and against one of many.
        let scene = scene("cornell", Some(500)).unwrap();
        let (mut solver, _) = start(&scene, Params::default_preset(1)).unwrap();
        solver.run(20_000);
        let solution = solver.solution();
        let [few, many] = [20_000, 1_000_000].map(|rays| Reference::new(&scene, rays).unwrap());
        let [a, b] = [&few, &many].map(|r| r.error(&scene, &solution));
        assert!(few.noise.sqrt() > 3.0 * many.noise.sqrt());
        // Squares over 500 patches scatter by some ten percent.
        assert!((a / b - 1.0).abs() < 0.25, "{a} {b}");
    }
}
