//! The paper's headline run, five million iterations on a hall of 78 443 patches, measured: seconds, and error of
//! patch irradiance against a long solve by the default preset. An argument gives that solve's rays.

use std::time::Instant;

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Solution, Solver};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let reference_rays: f64 = std::env::args().nth(1).map_or(Ok(20e6), |a| a.parse())?;
    let authored = builtin::hall();
    let budget = PatchBudget::Count(authored.suggested_patches.unwrap_or(100_000));
    let scene = PatchScene::new(&authored, PatchOptions { budget, ..PatchOptions::default() })?;
    println!("hall: {} triangles, {} patches", scene.triangle_count(), scene.len());

    let solve = |name: &str, params: Params, rays: f64| -> Result<Solution, Box<dyn std::error::Error>> {
        let start = Instant::now();
        let mut solver = Solver::new(&scene, params, None)?;
        solver.run(rays as u64);
        println!("{name}: {} rays in {:.1} s", solver.rays(), start.elapsed().as_secs_f64());
        Ok(solver.solution())
    };
    let paper = solve("paper preset", Params::paper_preset(1), 5e6)?;
    let ours = solve("default preset", Params::default_preset(1), 5e6)?;
    let reference = solve("reference", Params::default_preset(2), reference_rays)?;
    for (name, solution) in [("paper preset", &paper), ("default preset", &ours)] {
        // √(Σ A ΔE² / Σ A E²) of luminance, emitters left out; and the error of the arriving power.
        let (mut difference, mut energy) = (0.0, 0.0);
        for p in scene.patches().filter(|&p| scene.emission(p).is_black()) {
            let (a, b) = (solution.irradiance(p).luminance(), reference.irradiance(p).luminance());
            difference += scene.area(p) * (a - b).powi(2);
            energy += scene.area(p) * b * b;
        }
        let power = |s: &Solution| s.arriving_power(&scene).luminance();
        println!(
            "{name}: relative RMS error {:.2} %, arriving power {:+.2} %",
            100.0 * f64::sqrt(difference / energy),
            100.0 * (power(solution) / power(&reference) - 1.0)
        );
    }
    println!("the reference's own error is about {:.2} %", 100.0 * reference.relative_error());
    Ok(())
}
