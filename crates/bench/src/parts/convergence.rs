//! Rays and seconds to a given error: the paper's preset, the default, and the default without the way back.

mod words;

use rayon::ThreadPool;
use serde_json::{Value, json};
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Solution, Solver};
use twinray_rays::Bvh;

use super::kernel::{RAYS, rate};
use super::{Effort, Outcome, Part};
use crate::curve::{self, Point};
use crate::measure::{median, pool, timed};
use crate::rays;
use crate::solving::{Reference, forward_preset, luminances, scene, square_error, start};

/// The part.
pub const PART: Part = Part {
    name: "convergence",
    what: "rays and seconds to 10, 5, 2 and 1 % of error",
    measure,
    describe: words::describe,
};

/// Errors to be reached.
const TARGETS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];
/// A solve that is so much better than the last target need not go on.
const ENOUGH: f64 = 0.95;
/// Rays of the first look, and of each later one over the one before it.
const FIRST_LOOK: f64 = 20_000.0;
const NEXT_LOOK: f64 = 1.4;

/// What it is called here, a scene, its number of patches (its own where there is none), and the longest solve of the paper's
/// preset and of the others, seconds.
const SCENES: [(&str, &str, Option<usize>, [f64; 2]); 6] = [
    ("cornell-2k", "cornell", Some(2000), [12.0, 6.0]),
    ("doorway-2k", "doorway", Some(2000), [12.0, 6.0]),
    ("cornell", "cornell", Some(20_000), [45.0, 20.0]),
    ("doorway", "doorway", Some(20_000), [45.0, 20.0]),
    ("hall-diffuse", "hall-diffuse", None, [25.0, 25.0]),
    ("hall", "hall", None, [25.0, 25.0]),
];
/// Rays of each of two solves.
const REFERENCE_RAYS: u64 = 40_000_000;

type Preset = (&'static str, fn(u64) -> Params);
const PRESETS: [Preset; 3] =
    [("paper", Params::paper_preset), ("forward only", forward_preset), ("default", Params::default_preset)];

/// The closed room: its albedo, its patches, rays of the paper's preset.
const ALBEDO: f64 = 0.9;
const ROOM_PATCHES: usize = 5000;
const ROOM_RAYS: u64 = 5_000_000;
const ROOM_SECONDS: f64 = 20.0;
/// The error to which the paper's rays are predicted.
const ROOM_TARGET: f64 = 0.02;

fn measure(effort: Effort) -> Result<Outcome, String> {
    let two = pool(2)?;
    let mut scenes = Vec::new();
    for (name, of, patches, longest) in SCENES {
        let patches = if effort == Effort::FULL { patches } else { effort.scene_patches() };
        scenes.push(measured_scene(name, of, patches, longest, effort, &two)?);
    }
    Ok(Outcome::Measured(json!({"scenes": scenes, "room": two.install(|| room(effort))?})))
}

fn measured_scene(
    name: &str,
    of: &str,
    patches: Option<usize>,
    [paper, others]: [f64; 2],
    effort: Effort,
    two: &ThreadPool,
) -> Result<Value, String> {
    let scene = scene(of, patches)?;
    eprintln!("  {name}: reference");
    let reference = two.install(|| Reference::new(&scene, effort.rays(REFERENCE_RAYS)))?;
    let bvh = Bvh::build(&rays::triangles(&scene));
    let test = rays::incoherent(&scene, effort.rays(RAYS) as usize, 1);
    let (mut kernel, mut curves) = (Vec::new(), Vec::new());
    for (preset, params) in PRESETS {
        eprintln!("  {name}: {preset}");
        kernel.push(rate(two, &test, |ray| bvh.closest_hit(ray).is_some()));
        let longest = effort.seconds(if preset == "paper" { paper } else { others });
        let error = |solution: &Solution| reference.error(&scene, solution);
        let points = two.install(|| looks(&scene, params(1), longest, error))?;
        curves.push(json!({"preset": preset, "points": curve::json(&points)}));
    }
    Ok(json!({
        "scene": name,
        "patches": scene.len(),
        "reference_rays": reference.rays,
        "reference_error": reference.noise.sqrt(),
        "kernel_rate": median(&kernel),
        "curves": curves,
    }))
}

/// Solves until the last target is reached, or the next look would come too late; the clock stands still during looks.
fn looks(
    scene: &PatchScene,
    params: Params,
    longest: f64,
    error: impl Fn(&Solution) -> f64,
) -> Result<Vec<Point>, String> {
    let (mut solver, mut seconds) = start(scene, params)?;
    let mut points: Vec<Point> = Vec::new();
    let mut stop = FIRST_LOOK;
    loop {
        seconds += run_past(&mut solver, stop);
        let point = Point { rays: solver.rays() as f64, seconds, error: error(&solver.solution()) };
        points.push(point);
        if point.error < ENOUGH * TARGETS[TARGETS.len() - 1] || NEXT_LOOK * seconds > longest {
            return Ok(points);
        }
        stop = NEXT_LOOK * point.rays;
    }
}

/// At least one step, and on to `rays`; gives the seconds.
fn run_past(solver: &mut Solver, rays: f64) -> f64 {
    timed(|| solver.run((rays as u64).max(solver.rays() + 1))).1
}

/// The furnace: a closed room whose light is known.
fn room(effort: Effort) -> Result<Value, String> {
    eprintln!("  closed room of albedo {ALBEDO}");
    let options = PatchOptions { budget: PatchBudget::Count(effort.patches(ROOM_PATCHES)), two_sided: false };
    let scene = PatchScene::new(&builtin::furnace(ALBEDO, 1.0), options).map_err(|e| e.to_string())?;
    // Surfaces emit a radiosity of 1, and albedos are single precision.
    let rho = f64::from(ALBEDO as f32);
    let truth = vec![1.0 / (1.0 - rho); scene.len()];
    let error = |solution: &Solution| square_error(&scene, &luminances(&scene, solution), &truth).sqrt();
    let points = looks(&scene, Params::default_preset(1), effort.seconds(ROOM_SECONDS), error)?;
    let (mut paper, _) = start(&scene, Params::paper_preset(1))?;
    paper.run(effort.rays(ROOM_RAYS));
    let solution = paper.solution();
    let mean = solution.arriving_power(&scene).luminance() / scene.total_area();
    Ok(json!({
        "patches": scene.len(),
        "points": curve::json(&points),
        "paper_rays": paper.rays(),
        "paper_error": error(&solution),
        "paper_missing": 1.0 - mean / truth[0],
        "law_missing": lost_by_law(rho, paper.rays() as f64),
        "law_rays": rays_by_law(rho, ROOM_TARGET),
    }))
}

/// Share of the reflected light that the average of n iterations of equal weight lacks in a closed room of albedo ρ:
/// Γ(n+ρ)/(Γ(n+1)Γ(ρ)), by its leading terms; relative error below 1/n².
fn lost_by_law(rho: f64, n: f64) -> f64 {
    libm::pow(n, rho - 1.0) / libm::tgamma(rho) * (1.0 - rho * (1.0 - rho) / (2.0 * n))
}

/// Iterations after which [`lost_by_law`] is `loss`, by the leading term.
fn rays_by_law(rho: f64, loss: f64) -> f64 {
    libm::pow(loss * libm::tgamma(rho), -1.0 / (1.0 - rho))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_law_is_the_product_of_the_iterations_factors() {
        for rho in [0.2, 0.5, 0.9] {
            let product: f64 = (1..=1000).map(|k| 1.0 + (rho - 1.0) / f64::from(k)).product();
            assert!((lost_by_law(rho, 1000.0) / product - 1.0).abs() < 1e-6, "{rho}");
            let n = rays_by_law(rho, 1e-3);
            assert!((lost_by_law(rho, n) / 1e-3 - 1.0).abs() < 1.0 / n + 1e-12, "{rho}");
        }
    }
}
