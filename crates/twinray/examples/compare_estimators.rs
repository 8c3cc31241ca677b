//! What the second direction of a ray is worth: the error of each estimator after equally many rays.
//!
//! Errors are those of patch irradiance against a solve of a hundred times as many rays, √(ΣA ΔE²/ΣA E²) over the
//! luminance of patches that do not emit.

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Estimator, Params, Solution, Solver};

const RAYS: u64 = 200_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = PatchOptions { budget: PatchBudget::Count(1_000), ..PatchOptions::default() };
    let scene = PatchScene::new(&builtin::cornell(false), options)?;
    let solve = |params: Params, rays: u64| -> Result<Solution, Box<dyn std::error::Error>> {
        let mut solver = Solver::new(&scene, params, None)?;
        solver.run(rays);
        Ok(solver.solution())
    };
    let reference = solve(Params::default_preset(100), 100 * RAYS)?;
    println!("{} patches, {RAYS} rays", scene.len());
    for estimator in [Estimator::Forward, Estimator::Backward, Estimator::Equal, Estimator::Balance] {
        let solution = solve(Params { estimator, ..Params::default_preset(1) }, RAYS)?;
        println!("{:9} {:7.2} %", format!("{estimator:?}"), 100.0 * error(&scene, &solution, &reference));
    }
    Ok(())
}

fn error(scene: &PatchScene, solution: &Solution, reference: &Solution) -> f64 {
    let (mut difference, mut energy) = (0.0, 0.0);
    for p in scene.patches().filter(|&p| scene.emission(p).is_black()) {
        let (e, r) = (solution.irradiance(p).luminance(), reference.irradiance(p).luminance());
        difference += scene.area(p) * (e - r).powi(2);
        energy += scene.area(p) * r.powi(2);
    }
    f64::sqrt(difference / energy)
}
