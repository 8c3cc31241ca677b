//! Laws that hold for any input: sums and choices of the tree and the table, and the identity of the transfer.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use twinray_scene::Rgb;
use twinray_solve::Estimator;
use twinray_solve::select::{PowerTree, Table};
use twinray_solve::transfer::{Endpoint, transfer};

fn config() -> ProptestConfig {
    ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

/// A weight: none, usual, or far from usual.
fn weight() -> impl Strategy<Value = f64> {
    prop_oneof![2 => Just(0.0), 4 => 0.0..1.0f64, 2 => (-20.0..20.0f64).prop_map(|e| 10f64.powf(e))]
}

fn weights() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(weight(), 1..70).prop_filter("some weight", |w| w.iter().any(|&w| w > 0.0))
}

/// In [0, 1), the ends among them.
fn unit() -> impl Strategy<Value = f64> {
    prop_oneof![8 => 0.0..1.0f64, 1 => Just(0.0), 1 => Just(1.0 - f64::EPSILON / 2.0)]
}

fn endpoint() -> impl Strategy<Value = Endpoint> {
    let radiance = [-10.0..1e3f64, 0.0..1e3f64, 0.0..1e-3f64].prop_map(Rgb::from_array);
    (radiance, -30.0..30.0f64).prop_map(|(radiance, e)| Endpoint { radiance, density: 10f64.powf(e) })
}

proptest! {
    #![proptest_config(config())]

    /// The root is the sum of the leaves, a choice never falls on a leaf without power, and it is the leaf whose
    /// interval of the running sum holds u, to rounding.
    #[test]
    fn the_tree_is_its_leaves(
        emitted in weights(), updates in prop::collection::vec((any::<u16>(), weight()), 0..50), n in 1u64..1000,
        us in prop::collection::vec(unit(), 10),
    ) {
        let mut tree = PowerTree::new(emitted.iter().copied());
        let mut reflected = vec![0.0; emitted.len()];
        for &(patch, x) in &updates {
            let patch = patch as usize % emitted.len();
            tree.add_reflected(patch, x);
            reflected[patch] += x;
        }
        let power: Vec<f64> = emitted.iter().zip(&reflected).map(|(e, r)| e + r / n as f64).collect();
        let total: f64 = power.iter().sum();
        for (i, p) in power.iter().enumerate() {
            prop_assert!((tree.power(i, n) - p).abs() <= 1e-12 * p);
        }
        prop_assert!((tree.total(n) - total).abs() <= 1e-12 * total);
        tree.rebuild();
        prop_assert!((tree.total(n) - total).abs() <= 1e-12 * total);
        for u in us {
            let chosen = tree.select(u, n);
            prop_assert!(power[chosen] > 0.0, "{chosen} has no power");
            let before: f64 = power[..chosen].iter().sum();
            let slack = 1e-12 * total;
            prop_assert!(before <= u * total + slack && u * total <= before + power[chosen] + slack);
        }
    }

    /// The inverse of the running sum: the first entry whose sum passes u times the total.
    #[test]
    fn the_table_inverts_its_sums(weights in weights(), us in prop::collection::vec(unit(), 20)) {
        let mut table = Table::default();
        let sum = table.fill(weights.iter().copied());
        let cumulative: Vec<f64> = weights.iter().scan(0.0, |s, w| { *s += w; Some(*s) }).collect();
        prop_assert_eq!(sum, *cumulative.last().unwrap());
        let mut last = 0;
        let mut us = us;
        us.sort_by(f64::total_cmp);
        for u in us {
            let chosen = table.select(u);
            let expected = cumulative.iter().position(|&c| c > u * sum).unwrap();
            prop_assert_eq!(chosen, expected, "u = {}", u);
            prop_assert!(weights[chosen] > 0.0 && chosen >= last);
            last = chosen;
        }
    }

    /// Balanced deposits times the sum of densities are the two radiances, whatever the densities; the other
    /// estimators give what they say.
    #[test]
    fn deposits_are_radiances_over_densities(y in endpoint(), x in endpoint()) {
        let close = |a: Rgb, b: Rgb| (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-12 * (a[c].abs() + b[c].abs()));
        let d = transfer(Estimator::Balance, &y, &x);
        let sum = y.density + x.density;
        prop_assert!(close(d.on_hit * sum, y.radiance) && close(d.on_shooter * sum, x.radiance), "{d:?}");
        // One ray from either end, weighted by how likely it was: the balance heuristic's two techniques share
        // what each alone would give.
        let (forward, backward) = (transfer(Estimator::Forward, &y, &x), transfer(Estimator::Backward, &y, &x));
        let share = y.density / sum;
        prop_assert!(close(d.on_hit, forward.on_hit * share) && close(d.on_shooter, backward.on_shooter * share));
        prop_assert!(forward.on_shooter.is_black() && backward.on_hit.is_black());
        let equal = transfer(Estimator::Equal, &y, &x);
        prop_assert!(close(equal.on_hit * 2.0, forward.on_hit) && close(equal.on_shooter * 2.0, backward.on_shooter));
    }
}
