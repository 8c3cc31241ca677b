//! Each strategy and each mixture of them shares one mean: power shooting, even starts, the sky.
//!
//! Welch tests on groups of patches over independent seeds.

use twinray_scene::{Environment, PatchId, PatchScene, Rgb, Surface, Texel, builtin};
use twinray_solve::{Estimator, Params, Representation, Shares};
use twinray_testkit::ztest::Mean;

use super::{cut, solve};

const SEEDS: u64 = 10;
const GROUPS: usize = 8;

/// Power that arrives on groups of patches, mean over seeds.
fn groups(scene: &PatchScene, first_seed: u64, rays: u64, params: &Params) -> Vec<Mean> {
    let mut samples = vec![Vec::new(); GROUPS];
    for seed in first_seed..first_seed + SEEDS {
        let solution = solve(scene, Params { seed, ..params.clone() }, rays);
        let mut sums = [0.0; GROUPS];
        scene.patches().for_each(|p| {
            sums[p.index() * GROUPS / scene.len()] += scene.area(p) * solution.irradiance(p).luminance();
        });
        samples.iter_mut().zip(sums).for_each(|(s, x)| s.push(x));
    }
    samples.iter().map(|s| Mean::of(s)).collect()
}

/// Every variant against the first, group by group. At most 96 tests at 1e-4 each: a false-alarm rate of 1 %, some
/// more for the normal approximation with ten seeds.
pub fn agree(scene: &PatchScene, rays: u64, variants: &[(&str, Params)]) {
    let first = groups(scene, 100, rays, &variants[0].1);
    for (k, (name, params)) in (1..).zip(&variants[1..]) {
        let other = groups(scene, 1000 * k, rays, params);
        for (group, (a, b)) in first.iter().zip(&other).enumerate() {
            let p = a.p_agrees(b);
            println!(
                "{name}, group {group}: {:+.2} ± {:.2} %, p = {p:.4}",
                100.0 * (b.value / a.value - 1.0),
                100.0 * a.error.hypot(b.error) / a.value
            );
            assert!(p > 1e-4, "{name}, group {group}: {b:?} against {a:?}, p = {p}");
        }
    }
}

/// Shares in the order power, lamps, area, patches, environment.
fn shares([power, lamps, area, patches, environment]: [f64; 5]) -> Params {
    let shares = Shares { power, lamps, area, patches, environment, points: 0.0 };
    Params { shares: Some(shares), ..Params::default_preset(0) }
}

#[test]
fn each_strategy_alone_and_every_mixture_share_one_mean() {
    let scene = cut(&builtin::doorway(), 400);
    agree(
        &scene,
        60_000,
        &[
            ("fitted", Params::default_preset(0)),
            ("power alone", shares([1.0, 0.0, 0.0, 0.0, 0.0])),
            ("area alone", shares([0.0, 0.0, 1.0, 0.0, 0.0])),
            ("patches alone", shares([0.0, 0.0, 0.0, 1.0, 0.0])),
            ("lamps and area", shares([0.0, 0.5, 0.5, 0.0, 0.0])),
            ("lamps and patches", shares([0.0, 0.7, 0.0, 0.3, 0.0])),
            ("all of them", shares([0.25, 0.25, 0.25, 0.25, 0.0])),
            ("forward", Params { estimator: Estimator::Forward, ..shares([0.9, 0.0, 0.05, 0.05, 0.0]) }),
        ],
    );
}

/// The lamps alone can start no ray that carries reflected light onwards but backwards: with black walls they are enough.
#[test]
fn lamps_alone_find_direct_light() {
    let mut authored = builtin::cornell(true);
    authored.materials.iter_mut().for_each(|m| {
        m.surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::BLACK) };
    });
    let scene = cut(&authored, 400);
    let all = [("fitted", Params::default_preset(0)), ("lamps alone", shares([0.0, 1.0, 0.0, 0.0, 0.0]))];
    agree(&scene, 60_000, &all);
}

#[test]
fn sky_shares_share_one_mean() {
    let mut authored = builtin::cornell(false);
    authored.environment = Some(Environment::Uniform(Rgb::grey(0.3)));
    let scene = cut(&authored, 300);
    agree(
        &scene,
        60_000,
        &[
            ("fitted", Params::default_preset(0)),
            ("little sky", shares([0.6, 0.0, 0.175, 0.175, 0.05])),
            ("much sky", shares([0.25, 0.1, 0.025, 0.025, 0.6])),
            ("gathered", shares([0.05, 0.0, 0.45, 0.45, 0.05])),
        ],
    );
}

/// √ of the mean over patches of (ΔE/E)², emitters left out where there is anything else, mean over seeds.
fn relative_error(scene: &PatchScene, params: &Params, rays: u64, truth: &[f64]) -> f64 {
    let squares: Vec<f64> = (0..3)
        .map(|k| {
            let solution = solve(scene, Params { seed: 50 + k, ..params.clone() }, rays);
            let all_emit = scene.emitter_count() == scene.len();
            let known = || scene.patches().filter(|&p| all_emit || scene.emission(p).is_black());
            let square = |p: PatchId| (solution.irradiance(p).luminance() / truth[p.index()] - 1.0).powi(2);
            known().map(square).sum::<f64>() / known().count() as f64
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Where areas are very uneven the fit saves most of the rays, where they are even it costs none: ratios of mean-square
/// relative errors to bidirectional shooting by power alone. Three seeds of 10⁶ rays on thousands of patches scatter by a
/// few percent; the thresholds are the project's aims.
#[test]
fn fitted_shares_need_fewer_rays() {
    let cases = [("uneven", 1, 5.0), ("uneven-glowing", 1, 20.0), ("cornell", 2000, 0.97), ("doorway", 2000, 0.97)];
    for (name, budget, least) in cases {
        let scene = cut(&builtin::by_name(name).expect("a built-in scene"), budget);
        let truth: Vec<f64> = {
            let solution = solve(&scene, shares([0.4, 0.2, 0.0, 0.4, 0.0]), 10_000_000);
            scene.patches().map(|p| solution.irradiance(p).luminance()).collect()
        };
        let error = |params: &Params| relative_error(&scene, params, 1_000_000, &truth);
        let [fitted, power] = [error(&Params::default_preset(0)), error(&shares([1.0, 0.0, 0.0, 0.0, 0.0]))];
        let gain = (power / fitted).powi(2);
        println!("{name}: fitted {fitted:.4}, power alone {power:.4}, {gain:.2} times fewer rays");
        assert!(gain > least, "{name}: {gain}");
    }
}

#[test]
fn representations_share_one_mean() {
    let scene = cut(&super::glossy_cornell(), 300);
    let of = |representation| Params { representation, ..Params::default_preset(0) };
    agree(&scene, 60_000, &[("both", of(Representation::Both)), ("sample", of(Representation::Sample))]);
}
