//! How fast the error falls, and what the 1/n average of the paper loses.

use rayon::prelude::*;
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Estimator, Params, Solution, Solver};

use crate::case::{Case, Effort, Row};
use crate::plot::{Axis, Corner, Plot, Series, Style};
use crate::report::{Figure, Section, number};
use crate::rig::replicas;

/// Rays at which errors are read.
const STOPS: [u64; 7] = [100_000, 215_000, 464_000, 1_000_000, 2_150_000, 4_640_000, 10_000_000];
/// Solves behind each error.
const SEEDS: u64 = 3;
/// Solves that make the reference, and rays of each.
const REFERENCES: u64 = 4;
const REFERENCE_RAYS: u64 = 20_000_000;

/// Both parts.
pub fn section(effort: Effort) -> Section {
    let mut figures = Vec::new();
    let mut text = String::from(
        "Error is the relative RMS over patches, √(ΣA ΔE²/ΣA E²) of luminance, emitters left out, as everywhere in this project; \
         mean square over three seeds. The reference is the mean of four default solves of 2 · 10⁷ rays with other seeds; its own noise, \
         known from their scatter, is subtracted from the squares. *Paper* is `--preset paper`; *forward only* is the default preset \
         with the deposit on the hit alone; *default* has both.\n\n\
         | scene | preset | at 10⁵ | at 10⁶ | at 10⁷ rays | slope |\n|---|---|---|---|---|---|\n",
    );
    let mut rows = Vec::new();
    for (name, figure) in [("cornell", "error-cornell"), ("doorway", "error-doorway")] {
        let curves = curves(name, effort);
        for curve in &curves.curves {
            let at = |k: usize| number(curve.points[k].1);
            text +=
                &format!("| {name} | {} | {} | {} | {} | {:.2} |\n", curve.name, at(0), at(3), at(6), curve.slope());
        }
        let slope = |k: usize| curves.curves[k].slope();
        let last = |k: usize| curves.curves[k].points[6].1;
        rows.push(Row::at_most(format!("{name}: slope of forward only, at most"), -0.47, slope(1)));
        rows.push(Row::at_most(format!("{name}: slope of default, at most"), -0.47, slope(2)));
        rows.push(Row::at_most(format!("{name}: default / forward at 10⁷ rays, at most"), 1.0, last(2) / last(1)));
        rows.push(Row::at_most(format!("{name}: default / paper at 10⁷ rays, at most"), 1.0, last(2) / last(0)));
        figures.push(Figure {
            name: figure,
            caption: format!(
                "Built-in scene `{name}`, {} patches. Noise of the reference: {} (subtracted).",
                curves.patches,
                number(curves.reference_error)
            ),
            svg: curves.plot(name).svg(),
        });
    }
    let (loss, figure) = loss(effort);
    figures.push(figure);
    let orders = Case {
        title: "Order of convergence",
        story: "Slopes are least squares of log error over log rays, all seven stops. Independent rays give −0.5; −0.47 is what a \
                slope of −0.5 may look like with the 5 % scatter of three seeds, and low-discrepancy numbers make it steeper."
            .to_owned(),
        quantity: "slope, or ratio of errors",
        rows,
    };
    Section { title: "Convergence", text, cases: vec![orders, loss], figures }
}

struct Curve {
    name: &'static str,
    /// Rays and error.
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// Exponent of the fit error ∝ rays^slope.
    fn slope(&self) -> f64 {
        let logs: Vec<(f64, f64)> = self.points.iter().map(|(x, y)| (libm::log(*x), libm::log(*y))).collect();
        let n = logs.len() as f64;
        let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
            / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
    }
}

struct Curves {
    curves: Vec<Curve>,
    patches: usize,
    reference_error: f64,
}

fn curves(name: &str, effort: Effort) -> Curves {
    let options = PatchOptions { budget: PatchBudget::Count(2000), two_sided: false };
    let scene = PatchScene::new(&builtin::by_name(name).expect("a built-in scene"), options).expect("a built-in scene");
    let parts = replicas(&scene, &Params::default_preset(9000), effort.rays(REFERENCE_RAYS), REFERENCES, |s| {
        luminances(&scene, s)
    });
    let count = parts.len() as f64;
    let reference: Vec<f64> = (0..scene.len()).map(|i| parts.iter().map(|p| p[i]).sum::<f64>() / count).collect();
    // The mean of n parts has 1/(n(n−1)) of the summed squares around it.
    let squares: f64 = parts.iter().map(|p| square_error(&scene, p, &reference)).sum();
    let reference_square = squares / (count * (count - 1.0));

    let forward = |seed| Params { estimator: Estimator::Forward, ..Params::default_preset(seed) };
    let presets: [(&'static str, &(dyn Fn(u64) -> Params + Sync)); 3] =
        [("paper", &Params::paper_preset), ("forward only", &forward), ("default", &Params::default_preset)];
    let curve = |(name, preset): (&'static str, &(dyn Fn(u64) -> Params + Sync))| {
        let runs: Vec<Vec<(f64, f64)>> =
            (0..SEEDS).into_par_iter().map(|k| run(&scene, preset(50 + k), &reference, effort)).collect();
        let mean =
            |stop: usize, part: fn(&(f64, f64)) -> f64| runs.iter().map(|r| part(&r[stop])).sum::<f64>() / SEEDS as f64;
        let point = |stop| (mean(stop, |p| p.0), (mean(stop, |p| p.1) - reference_square).max(0.0).sqrt());
        Curve { name, points: (0..STOPS.len()).map(point).collect() }
    };
    Curves {
        curves: presets.into_iter().map(curve).collect(),
        patches: scene.len(),
        reference_error: reference_square.sqrt(),
    }
}

/// Rays and square error at every stop of one solve.
fn run(scene: &PatchScene, params: Params, reference: &[f64], effort: Effort) -> Vec<(f64, f64)> {
    let mut solver = Solver::new(scene, params, None).expect("a built-in scene has light");
    let at = |stop: &u64| {
        solver.run(effort.rays(*stop));
        (solver.rays() as f64, square_error(scene, &luminances(scene, &solver.solution()), reference))
    };
    STOPS.iter().map(at).collect()
}

fn luminances(scene: &PatchScene, solution: &Solution) -> Vec<f64> {
    scene.patches().map(|p| solution.irradiance(p).luminance()).collect()
}

/// ΣA ΔE²/ΣA E² without emitters.
fn square_error(scene: &PatchScene, light: &[f64], reference: &[f64]) -> f64 {
    let dark = || scene.patches().filter(|&p| scene.emission(p).is_black());
    let energy: f64 = dark().map(|p| scene.area(p) * reference[p.index()].powi(2)).sum();
    dark().map(|p| scene.area(p) * (light[p.index()] - reference[p.index()]).powi(2)).sum::<f64>() / energy
}

impl Curves {
    fn plot(&self, name: &str) -> Plot {
        let mut series: Vec<Series> = (0..)
            .zip(&self.curves)
            .map(|(look, c)| Series {
                name: format!("{}, slope {:.2}", c.name, c.slope()).replace('-', "−"),
                style: Style::Line,
                look,
                points: c.points.clone(),
            })
            .collect();
        // A guide of slope −½ under the curves.
        let start = self.curves[2].points[0].1 * 0.6;
        let guide = [1e5, 1e7].map(|x: f64| (x, start * (1e5 / x).sqrt())).to_vec();
        series.push(Series { name: "slope −0.5".into(), style: Style::Theory, look: 5, points: guide });
        Plot {
            title: format!("{name}: error of patch irradiance"),
            x: Axis { label: "rays", range: [8e4, 1.3e7], logarithmic: true },
            y: Axis { label: "relative RMS error", range: [2e-3, 0.5], logarithmic: true },
            series,
            legend: Corner::UpperRight,
        }
    }
}

/// Share of the reflected power that is missing in a furnace, by albedo.
pub fn loss(effort: Effort) -> (Case, Figure) {
    let albedos = effort.thin(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99]);
    let rays = effort.rays(1_000_000);
    let missing = |albedo: f64| {
        let options = PatchOptions { budget: PatchBudget::Count(500), two_sided: false };
        let scene = PatchScene::new(&builtin::furnace(albedo, 1.0), options).expect("a built-in scene");
        let rho = f64::from(albedo as f32);
        let emitted = scene.emitted_power().luminance();
        let limit = emitted * rho / (1.0 - rho);
        let mut paper = Solver::new(&scene, Params::paper_preset(60), None).expect("a furnace has light");
        paper.run(rays);
        let paper = 1.0 - (paper.tree_power().unwrap_or(f64::NAN) - emitted) / limit;
        // Irradiance is reflected power over ρ.
        let default = replicas(&scene, &Params::default_preset(61), rays, 4, |s| {
            1.0 - rho * s.arriving_power(&scene).luminance() / limit
        });
        let worst = default.iter().fold(0.0, |worst: f64, m| worst.max(m.abs()));
        (paper, lost_by_law(rho, rays), worst)
    };
    let measured: Vec<(f64, f64, f64)> = albedos.par_iter().map(|&a| missing(a)).collect();
    let mut rows = Vec::new();
    for (albedo, (paper, law, worst)) in albedos.iter().copied().zip(&measured) {
        rows.push(Row::fixed(format!("ρ = {albedo}: paper"), *law, *paper, 1e-8));
        // Noise of the warm start and the known deviation, which both grow with the number of bounces.
        let bound = 1e-4 / (1.0 - albedo) * (effort.divide as f64).sqrt();
        rows.push(Row::at_most(format!("ρ = {albedo}: default, worst of 4 seeds, at most"), bound, *worst));
    }
    let case = Case {
        title: "What the 1/n average loses",
        story: "Furnace of 500 patches, 10⁶ rays: the share of the reflected power that is missing. Every ray of the paper preset \
                carries the whole power, so there is no noise, and theory gives the loss exactly: Γ(n+ρ)/(Γ(n+1)Γ(ρ)), about \
                n^−(1−ρ)/Γ(ρ). The default preset has no such loss, only noise and the known deviation named above; the table \
                bounds the largest deviation of four seeds by 10⁻⁴/(1−ρ)."
            .to_owned(),
        quantity: "missing share of reflected power",
        rows,
    };
    let points =
        |part: fn(&(f64, f64, f64)) -> f64| albedos.iter().copied().zip(measured.iter().map(part)).collect::<Vec<_>>();
    let fine: Vec<(f64, f64)> = (5..=99).map(|k| f64::from(k) / 100.0).map(|a| (a, lost_by_law(a, rays))).collect();
    let series = vec![
        Series { name: "theory for the paper's average".into(), style: Style::Theory, look: 5, points: fine },
        Series { name: "paper, measured".into(), style: Style::Markers, look: 0, points: points(|m| m.0) },
        Series { name: "default, worst of 4 seeds".into(), style: Style::Line, look: 1, points: points(|m| m.2) },
    ];
    let plot = Plot {
        title: "furnace after 10⁶ rays: reflected power that is missing".into(),
        x: Axis { label: "albedo", range: [0.0, 1.0], logarithmic: false },
        y: Axis { label: "missing share", range: [1e-7, 1.0], logarithmic: true },
        series,
        legend: Corner::UpperLeft,
    };
    let caption =
        "The paper's average against its own law, and the default preset. What is left of the latter is noise and the known deviation.".into();
    (case, Figure { name: "loss-by-albedo", caption, svg: plot.svg() })
}

/// Γ(n+ρ)/(Γ(n+1)Γ(ρ)) as the product of the iteration's factors: no cancellation.
fn lost_by_law(rho: f64, n: u64) -> f64 {
    libm::exp((1..=n).map(|k| libm::log1p((rho - 1.0) / k as f64)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_law_is_the_quotient_of_gammas() {
        for rho in [0.1, 0.5, 0.9] {
            let n = 1000.0;
            let gammas = libm::exp(libm::lgamma(n + rho) - libm::lgamma(n + 1.0) - libm::lgamma(rho));
            assert!((lost_by_law(rho, 1000) / gammas - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn slopes_are_exponents() {
        let points = STOPS.iter().map(|&n| (n as f64, 3.0 * libm::pow(n as f64, -0.6))).collect();
        assert!((Curve { name: "", points }.slope() + 0.6).abs() < 1e-12);
    }
}
