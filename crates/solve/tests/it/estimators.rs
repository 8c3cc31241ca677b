//! Forward, backward, equal and balanced estimators share one mean; the balance heuristic has the least variance.
//!
//! One frozen state, positive everywhere, is transported once: rays are started with density ∝ λ, and the power
//! that arrives on each patch is estimated by each combination from the same rays.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::geom::Frame;
use twinray_scene::sample::{Stream, warp};
use twinray_scene::{PatchId, PatchScene, Rgb, builtin};
use twinray_solve::Estimator;
use twinray_solve::select::Table;
use twinray_solve::transfer::{Endpoint, transfer};
use twinray_testkit::ztest::Mean;

use super::{cut, solve};

const ALL: [Estimator; 4] = [Estimator::Forward, Estimator::Backward, Estimator::Equal, Estimator::Balance];

/// Mean deposits per patch group over batches of rays, for each estimator: `[estimator][group][batch]`.
#[allow(clippy::needless_range_loop)] // the batch is the innermost index of what is filled
pub(super) fn transport(
    scene: &PatchScene,
    radiance: &[Rgb],
    groups: &[usize],
    batches: usize,
    rays: usize,
) -> Vec<Vec<Vec<f64>>> {
    let power: f64 = scene.patches().map(|p| PI * scene.area(p) * radiance[p.index()].luminance()).sum();
    let mut table = Table::default();
    table.fill(scene.patches().map(|p| scene.area(p) * radiance[p.index()].luminance()));
    let count = groups.iter().max().unwrap() + 1;
    let mut sums = vec![vec![vec![0.0; batches]; count]; ALL.len()];
    let mut random = Stream::new(77, 0, 0);
    for batch in 0..batches {
        for _ in 0..rays {
            let y = PatchId(table.select(random.uniform()) as u32);
            let n: DVec3 = scene.normal(y);
            let point = scene.cell_point(y, random.uniform(), random.uniform());
            let local = warp::cosine_hemisphere([random.uniform(), random.uniform()]);
            let direction = Frame::from_normal(n).to_world(local);
            let Some(x) = scene.trace_from(y, point, direction).and_then(|hit| scene.patch_of(&hit)) else { continue };
            let end = |p: PatchId| {
                let radiance = radiance[p.index()];
                Endpoint { radiance, density: radiance.luminance() / power }
            };
            for (e, estimator) in ALL.into_iter().enumerate() {
                let d = transfer(estimator, &end(y), &end(x));
                sums[e][groups[x.index()]][batch] += d.on_hit.luminance() / rays as f64;
                sums[e][groups[y.index()]][batch] += d.on_shooter.luminance() / rays as f64;
            }
        }
    }
    sums
}

/// Sum over groups of variance, for each estimator.
fn variances(sums: &[Vec<Vec<f64>>]) -> Vec<f64> {
    sums.iter().map(|groups| groups.iter().map(|batches| Mean::of(batches).error.powi(2)).sum()).collect()
}

#[test]
fn all_share_one_mean_and_balance_varies_least() {
    let scene = cut(&builtin::cornell(false), 600);
    // A converged state; where it emits, that is direct light, elsewhere indirect.
    let solution = solve(&scene, twinray_solve::Params::default_preset(1), 400_000);
    let reflected = |p: PatchId| solution.irradiance(p) * scene.brdf(p).mean_albedo() / PI + Rgb::grey(1e-4);
    let states: [(&str, Vec<Rgb>); 2] = [
        ("direct", scene.patches().map(|p| scene.emission(p) + reflected(p)).collect()),
        ("indirect", scene.patches().map(reflected).collect()),
    ];
    let groups: Vec<usize> = scene.patches().map(|p| p.index() % 10).collect();
    for (name, state) in states {
        let sums = transport(&scene, &state, &groups, 64, 10_000);
        let balance = 3;
        for (e, estimator) in ALL.iter().enumerate() {
            for (group, (own, balanced)) in sums[e].iter().zip(&sums[balance]).enumerate() {
                let (a, b) = (Mean::of(own), Mean::of(balanced));
                // 80 tests in all: p > 1e-4 has a false-alarm rate of .8 %. The two share their rays, which makes
                // the difference smaller than independence would, so the test is on the safe side.
                assert!(a.p_agrees(&b) > 1e-4, "{name}, {estimator:?}, group {group}: {a:?} against {b:?}");
            }
        }
        let v = variances(&sums);
        for (estimator, variance) in ALL.iter().zip(&v) {
            println!("{name} light: variance of {estimator:?} over balance {:.2}", variance / v[balance]);
        }
        assert!(v[..3].iter().all(|&other| other > v[balance]), "{name}: {v:?}");
        // Twice the forward estimator's efficiency is the theoretical most (Σ βΦ ≥ P/2).
        assert!(v[0] / v[balance] < 2.2, "{name}: {v:?}");
    }
}

/// The solver itself, with each estimator, agrees on the mean light of a scene.
#[test]
fn the_solver_agrees_with_itself() {
    let scene = cut(&builtin::cornell(true), 600);
    let mean = |estimator, seed| {
        let params = twinray_solve::Params { estimator, ..twinray_solve::Params::default_preset(seed) };
        solve(&scene, params, 300_000).arriving_power(&scene).luminance()
    };
    let of = |estimator| Mean::of(&(0..8).map(|s| mean(estimator, 100 + s)).collect::<Vec<_>>());
    let balance = of(Estimator::Balance);
    for estimator in [Estimator::Forward, Estimator::Equal] {
        let other = of(estimator);
        println!("{estimator:?}: {other:?}, balance {balance:?}");
        assert!(other.p_agrees(&balance) > 1e-3, "{estimator:?}: {other:?} against {balance:?}");
    }
}
