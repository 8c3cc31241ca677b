//! The program knows how wrong it is: error bars of patches against true errors, over many seeds.

use twinray_scene::{PatchId, PatchScene, Scene, builtin};
use twinray_solve::{Params, Solution};
use twinray_testkit::ztest::{Mean, sidak, student};

use super::{cut, glossy_cornell, solve};

/// z-scores of the patches with at least 100 hits, and mean squares (area-weighted, without emitters) of the true
/// relative error and of its estimate.
#[derive(Default)]
struct Outcome {
    z: Vec<f64>,
    true_square: f64,
    estimated_square: f64,
}

impl Outcome {
    fn add(&mut self, scene: &PatchScene, solution: &Solution, truth: impl Fn(PatchId) -> (f64, f64), all: bool) {
        let (mut difference, mut energy) = (0.0, 0.0);
        for p in scene.patches() {
            let (expected, its_error) = truth(p);
            let error = solution.irradiance(p).luminance() - expected;
            if solution.hits(p) >= 100 {
                self.z.push(error / solution.standard_error(p).hypot(its_error));
            }
            if all || scene.emission(p).is_black() {
                difference += scene.area(p) * (error * error - its_error * its_error);
                energy += scene.area(p) * expected * expected;
            }
        }
        self.true_square += difference / energy;
        self.estimated_square += solution.relative_error().powi(2);
    }

    /// Coverage of one and two bars as a normal distribution has it, and the estimate of the whole error.
    fn check(&self, name: &str) {
        let within = |k: f64| self.z.iter().filter(|z| z.abs() < k).count() as f64 / self.z.len() as f64;
        let (one, two) = (within(1.0), within(2.0));
        let ratio = (self.estimated_square / self.true_square).sqrt();
        let mean_z = self.z.iter().map(|z| z.abs()).sum::<f64>() / self.z.len() as f64;
        println!(
            "{name}: {:.1} % within one bar, {:.1} % within two, mean |z| {mean_z:.3}, estimated over true error {ratio:.3}, {} patches",
            100.0 * one,
            100.0 * two,
            self.z.len()
        );
        assert!(self.z.len() > 5000, "{name}: {} patches with enough hits", self.z.len());
        assert!((one - 0.68).abs() < 0.05, "{name}: {one} within one bar");
        assert!((two - 0.95).abs() < 0.03, "{name}: {two} within two bars");
        // The mean over 64 seeds of some hundred patches each: about 1 % of noise, more where noise is shared.
        assert!((ratio - 1.0).abs() < 0.07, "{name}: estimated over true error {ratio}");
    }
}

const SEEDS: u64 = 64;

/// Irradiance 1/(1−ρ) is known exactly.
#[test]
fn bars_cover_the_truth_in_the_furnace() {
    for albedo in [0.5, 0.9] {
        let scene = cut(&builtin::furnace(albedo, 1.0), 2000);
        let truth = 1.0 / (1.0 - albedo);
        let mut outcome = Outcome::default();
        let mut samples = vec![Vec::new(); scene.len()];
        for seed in 0..SEEDS {
            let solution = solve(&scene, Params::default_preset(seed), 300_000);
            outcome.add(&scene, &solution, |_| (truth, 0.0), true);
            scene.patches().for_each(|p| samples[p.index()].push(solution.irradiance(p).luminance()));
        }
        outcome.check(&format!("furnace, albedo {albedo}"));
        no_patch_is_biased(&samples, truth);
    }
}

/// Student's test of every patch's mean over seeds, with Šidák's correction for the number of patches: a false-alarm
/// rate of 0.1 % for patches that are independent, less for such that are not.
fn no_patch_is_biased(samples: &[Vec<f64>], truth: f64) {
    let t = |s: &Vec<f64>| {
        let mean = Mean::of(s);
        (mean.value - truth) / mean.error
    };
    let scores: Vec<f64> = samples.iter().map(t).collect();
    let dof = (SEEDS - 1) as f64;
    let smallest = scores.iter().map(|&t| student(t, dof)).fold(1.0, f64::min);
    let mean = scores.iter().map(|t| t.abs()).sum::<f64>() / scores.len() as f64;
    let family = sidak(smallest, scores.len());
    println!("means over seeds: mean |t| {mean:.3}, smallest p {smallest:.1e}, of all patches {family:.3}");
    assert!(family > 1e-3, "smallest p {smallest} among {} patches", scores.len());
    // .806 for Student's distribution with 63 degrees of freedom, ± .6/√2000 = .013 for so many patches.
    assert!((mean - 0.80).abs() < 0.03, "mean |t| {mean}");
}

/// The truth is a solve of many more rays, whose own bars count.
fn bars_cover_a_long_solve(name: &str, authored: &Scene) {
    let scene = cut(authored, 500);
    let long = solve(&scene, Params::default_preset(1000), 6_000_000);
    let mut outcome = Outcome::default();
    for seed in 0..SEEDS {
        let solution = solve(&scene, Params::default_preset(seed), 150_000);
        outcome.add(&scene, &solution, |p| (long.irradiance(p).luminance(), long.standard_error(p)), false);
    }
    outcome.check(name);
}

#[test]
fn bars_cover_the_truth_in_cornells_box() {
    bars_cover_a_long_solve("cornell", &builtin::cornell(false));
}

#[test]
fn bars_cover_the_truth_behind_a_door() {
    bars_cover_a_long_solve("doorway", &builtin::doorway());
}

#[test]
fn bars_cover_the_truth_among_glossy_surfaces() {
    bars_cover_a_long_solve("glossy cornell", &glossy_cornell());
}

/// The paper's schedule: its bars are those of its noise, so the truth is the mean over seeds, which shares its bias.
#[test]
fn bars_cover_the_noise_of_the_paper_preset() {
    let scene = cut(&builtin::cornell(false), 300);
    let solutions: Vec<Solution> = (0..SEEDS).map(|seed| solve(&scene, Params::paper_preset(seed), 100_000)).collect();
    let luminance = |s: &Solution, p: PatchId| s.irradiance(p).luminance();
    let mean = |p: PatchId| solutions.iter().map(|s| luminance(s, p)).sum::<f64>() / SEEDS as f64;
    let mut outcome = Outcome::default();
    for s in &solutions {
        // A run's distance from the mean of all is √(1 − 1/64) of its error, 0.8 %.
        outcome.add(&scene, s, |p| (mean(p), 0.0), false);
    }
    outcome.check("paper preset, cornell");
}

/// What never got light has no bar, and no light has no error.
#[test]
fn patches_without_light_have_infinite_bars() {
    let scene = cut(&builtin::plates(1.0), 50);
    let solution = solve(&scene, Params::default_preset(1), 10_000);
    for p in scene.patches() {
        let emitter = !scene.emission(p).is_black();
        // The dark plate sends nothing back: nothing arrives on the lamp.
        assert_eq!(solution.standard_error(p).is_infinite(), emitter, "patch {p:?}, {} hits", solution.hits(p));
        assert_eq!(solution.hits(p) == 0, emitter);
    }
    assert!(solution.relative_error() > 0.0 && solution.relative_error() < 0.1);
}
