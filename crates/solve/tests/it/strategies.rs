//! Each strategy and each mixture of them shares one mean: power shooting, even starts, the sky.
//!
//! Welch tests on groups of patches over independent seeds.

use twinray_scene::{Environment, PatchScene, Rgb, builtin};
use twinray_solve::{Estimator, Params, Representation};
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

/// Every variant against the first, group by group. At most 60 tests at 1e-4 each: a false-alarm rate of 0.6 %, some
/// more for the normal approximation with ten seeds.
fn agree(scene: &PatchScene, rays: u64, variants: &[(&str, Params)]) {
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

#[test]
fn gather_shares_share_one_mean() {
    let scene = cut(&builtin::doorway(), 400);
    let share = |gather_share| Params { gather_share, ..Params::default_preset(0) };
    agree(
        &scene,
        60_000,
        &[
            ("default", share(0.1)),
            ("power alone", share(0.0)),
            ("half and half", share(0.5)),
            ("hardly by power", Params { environment_share: 0.0, ..share(0.95) }),
            ("forward", Params { estimator: Estimator::Forward, ..share(0.1) }),
        ],
    );
}

#[test]
fn sky_shares_share_one_mean() {
    let mut authored = builtin::cornell(false);
    authored.environment = Some(Environment::Uniform(Rgb::grey(0.3)));
    let scene = cut(&authored, 300);
    let shares =
        |gather_share, environment_share| Params { gather_share, environment_share, ..Params::default_preset(0) };
    agree(
        &scene,
        60_000,
        &[
            ("default", shares(0.1, 0.3)),
            ("little sky", shares(0.35, 0.05)),
            ("much sky", shares(0.05, 0.6)),
            ("gathered", shares(0.9, 0.05)),
        ],
    );
}

#[test]
fn representations_share_one_mean() {
    let scene = cut(&super::glossy_cornell(), 300);
    let of = |representation| Params { representation, ..Params::default_preset(0) };
    agree(&scene, 60_000, &[("both", of(Representation::Both)), ("sample", of(Representation::Sample))]);
}
