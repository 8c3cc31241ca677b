//! Variance of one transport step against theory: forward rays, and rays that carry light both ways.
//!
//! The derivation stands at the head of `crates/solve/tests/it/variance.rs`, the test that guards it with the solver's own
//! transfer function; here the same is measured with more batches, for the table. A group is the cells of one triangle,
//! since no ray may have both ends in a group.

use std::f64::consts::PI;

use rayon::prelude::*;
use twinray::scene::geom::Frame;
use twinray::scene::sample::{Stream, warp};
use twinray::scene::{PatchBudget, PatchId, PatchOptions, PatchScene, Rgb, builtin};
use twinray::solve::select::Table;
use twinray::solve::transfer::{Endpoint, transfer};
use twinray::solve::{Estimator, Params, Solver};

use crate::case::{Case, Effort, Row};
use crate::report::Section;

/// Batches of independent rays, and rays of each.
const BATCHES: u64 = 16_000;
const RAYS: u64 = 250;
/// Rays per group that measure β from its own side.
const GATHER: u64 = 100_000;
/// Groups with a smaller share of the light have batches far from normal.
const LEAST_SHARE: f64 = 0.01;

const ESTIMATORS: [(Estimator, &str); 2] = [(Estimator::Forward, "forward"), (Estimator::Balance, "both ways")];

/// A frozen state.
struct State {
    scene: PatchScene,
    radiance: Vec<Rgb>,
    power: f64,
    table: Table,
}

/// The table.
pub fn section(effort: Effort) -> Section {
    let rows = ["cornell-closed", "doorway"].into_iter().flat_map(|name| rows(name, effort)).collect();
    let case = Case {
        title: "Variance of a transport step",
        story: format!(
            "A converged state of about 600 patches is frozen and transported once by independent rays ({BATCHES} batches of {RAYS}, no \
             low-discrepancy numbers). For a group G of coplanar patches that gets Φ of the power P, theory gives the relative \
             variance P/(NΦ) − 1/N of the forward estimator and βP/(NΦ) − 1/N of the balance heuristic, β = \
             (1/Φ)∫ L_y²/(L_x + L_y) dμ in (0, 1]; β is measured apart, by {GATHER} rays that start in the group. Rows give the ratio \
             of measured to theoretical variance over all groups (single triangles with at least 1 % of the light): its mean, its \
             lowest, its highest. A ratio has a standard deviation of 1.3 % from the batches and as much from Φ and β."
        ),
        quantity: "measured / theoretical variance",
        rows,
    };
    Section {
        title: "Variance",
        text: "The noise is what theory says, so error bars and predicted ray counts can be trusted.".into(),
        cases: vec![case],
        figures: Vec::new(),
    }
}

fn rows(name: &str, effort: Effort) -> Vec<Row> {
    let state = state(name);
    let groups: Vec<usize> = state.scene.patches().map(|p| state.scene.triangle_of(p) as usize).collect();
    let moments = moments(&state, &groups, BATCHES / effort.divide);
    let bright = |g: &usize| moments[1][*g].0 > LEAST_SHARE * state.power;
    let chosen: Vec<usize> = (0..state.scene.triangle_count()).filter(bright).collect();
    let betas: Vec<f64> = chosen.par_iter().map(|&g| beta(&state, &groups, g)).collect();
    let mean_gain = betas.iter().map(|b| 1.0 / b).sum::<f64>() / betas.len() as f64;
    let mut rows = Vec::new();
    for (e, (_, what)) in ESTIMATORS.into_iter().enumerate() {
        let ratio = |(&g, &beta): (&usize, &f64)| {
            let (flux, beta) = (moments[1][g].0, if e == 0 { 1.0 } else { beta });
            moments[e][g].1 / ((beta * state.power / flux - 1.0) / RAYS as f64 * flux * flux)
        };
        let ratios: Vec<f64> = chosen.iter().zip(&betas).map(ratio).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let gain = if e == 0 { String::new() } else { format!(", mean 1/β {mean_gain:.2}") };
        let what = format!("{name}, {what}, {} groups{gain}", ratios.len());
        let wide = (effort.divide as f64).sqrt().min(2.0);
        rows.push(Row::fixed(format!("{what}: mean"), 1.0, mean, 0.02 * wide));
        rows.push(Row::fixed(
            format!("{what}: lowest"),
            1.0,
            ratios.iter().copied().fold(f64::MAX, f64::min),
            0.1 * wide,
        ));
        rows.push(Row::fixed(format!("{what}: highest"), 1.0, ratios.iter().copied().fold(0.0, f64::max), 0.1 * wide));
    }
    rows
}

fn state(name: &str) -> State {
    let options = PatchOptions { budget: PatchBudget::Count(600), two_sided: false };
    let scene = PatchScene::new(&builtin::by_name(name).expect("a built-in scene"), options).expect("a built-in scene");
    let mut solver = Solver::new(&scene, Params::default_preset(1), None).expect("a built-in scene has light");
    solver.run(400_000);
    let solution = solver.solution();
    let radiance: Vec<Rgb> = scene.patches().map(|p| scene.emission(p) + solution.main_part(&scene, p)).collect();
    let mut table = Table::default();
    let power = table.fill(scene.patches().map(|p| PI * scene.area(p) * radiance[p.index()].luminance()));
    State { scene, radiance, power, table }
}

impl State {
    /// What a ray that leaves `patch` at random meets.
    fn shoot(&self, patch: PatchId, random: &mut Stream) -> Option<PatchId> {
        let point = self.scene.cell_point(patch, random.uniform(), random.uniform());
        let local = warp::cosine_hemisphere([random.uniform(), random.uniform()]);
        let direction = Frame::from_normal(self.scene.normal(patch)).to_world(local);
        self.scene.trace_from(patch, point, direction).and_then(|hit| self.scene.patch_of(&hit))
    }

    fn end(&self, patch: PatchId) -> Endpoint {
        let radiance = self.radiance[patch.index()];
        Endpoint { radiance, density: radiance.luminance() / self.power }
    }
}

/// Mean and variance of batches, `[estimator][group]`.
fn moments(state: &State, groups: &[usize], batches: u64) -> Vec<Vec<(f64, f64)>> {
    let count = state.scene.triangle_count();
    let batch = |index: u64| {
        let mut random = Stream::new(77, 1, index);
        let mut sums = vec![vec![0.0; count]; ESTIMATORS.len()];
        for _ in 0..RAYS {
            let shooter = PatchId(state.table.select(random.uniform()) as u32);
            let Some(hit) = state.shoot(shooter, &mut random) else { continue };
            for (sums, (estimator, _)) in sums.iter_mut().zip(ESTIMATORS) {
                let deposits = transfer(estimator, &state.end(shooter), &state.end(hit));
                sums[groups[hit.index()]] += deposits.on_hit.luminance() / RAYS as f64;
                sums[groups[shooter.index()]] += deposits.on_shooter.luminance() / RAYS as f64;
            }
        }
        sums
    };
    // Chunks in order, so that sums of floating-point numbers are the same on any number of threads.
    let all: Vec<Vec<Vec<f64>>> = (0..batches).into_par_iter().map(batch).collect();
    let of = |e: usize, g: usize| {
        let mean = all.iter().map(|b| b[e][g]).sum::<f64>() / batches as f64;
        (mean, all.iter().map(|b| (b[e][g] - mean).powi(2)).sum::<f64>() / (batches as f64 - 1.0))
    };
    (0..ESTIMATORS.len()).map(|e| (0..count).map(|g| of(e, g)).collect()).collect()
}

/// β of a group from rays that start in it evenly. Cells of a triangle have equal areas.
fn beta(state: &State, groups: &[usize], group: usize) -> f64 {
    let patches: Vec<PatchId> = state.scene.patches().filter(|p| groups[p.index()] == group).collect();
    let mut random = Stream::new(5, 1, group as u64);
    let (mut below, mut above) = (0.0, 0.0);
    for _ in 0..GATHER {
        let x = patches[(random.uniform() * patches.len() as f64) as usize];
        let Some(y) = state.shoot(x, &mut random) else { continue };
        let (qx, qy) = (state.radiance[x.index()].luminance(), state.radiance[y.index()].luminance());
        below += qy;
        above += qy * qy / (qx + qy);
    }
    above / below
}
