//! Lights without area: closed forms of their light, and what closed rooms and holes make of it.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use twinray_scene::{Environment, LightKind, LightProfile, PatchId, PunctualLight, Rgb, Scene, builtin};
use twinray_solve::{Estimator, Params, Shares, SolveError, Solver};

use super::build::{matte, quad, room};
use super::{cut, mean_irradiance, solve};

/// A light at `place` that shines towards `direction`.
fn light(kind: LightKind, intensity: Rgb, place: DVec3, direction: DVec3) -> PunctualLight {
    let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, direction.normalize());
    let transform = DAffine3::from_rotation_translation(turn, place);
    PunctualLight { name: "light".into(), kind, intensity, transform, profile: None }
}

/// A measured light, brighter downwards and uneven around the axis.
fn measured(place: DVec3) -> PunctualLight {
    let profile = LightProfile {
        name: "test".into(),
        vertical: vec![0.0, 45.0, 90.0, 135.0],
        horizontal: vec![0.0, 90.0, 180.0, 270.0, 360.0],
        candela: [[300.0, 200.0, 60.0, 0.0], [300.0, 120.0, 0.0, 0.0]]
            .iter()
            .cycle()
            .take(5)
            .flatten()
            .copied()
            .collect(),
    };
    let light = light(LightKind::Point, Rgb::new(1.0, 0.9, 0.8), place, DVec3::new(0.3, -1.0, 0.1));
    PunctualLight { profile: Some(Arc::new(profile)), ..light }
}

/// 1000 cd at a height of 3 m over sensors of half a metre at 0, 1, 2 and 3 m: I h/d³, averaged over the sensor. Four tests at
/// five standard errors, which stratification makes smaller still.
#[test]
fn illuminance_under_a_point() {
    let mut authored = Scene::default();
    let sensors = [0.0, 1.0, 2.0, 3.0].map(|x| {
        let corner = DVec3::new(x - 0.25, 0.0, 0.25);
        quad(&mut authored, matte(0.0), corner, 0.5 * DVec3::X, -0.5 * DVec3::Z)
    });
    authored.lights = vec![light(LightKind::Point, Rgb::grey(1000.0), DVec3::new(0.0, 3.0, 0.0), DVec3::NEG_Z)];
    let scene = cut(&authored, 1);
    let solution = solve(&scene, Params::default_preset(11), 1_500_000);
    for (material, x) in sensors.into_iter().zip([0.0, 1.0, 2.0, 3.0]) {
        let n = 100;
        let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) * 0.5 - 0.25;
        let value = |k: i32| {
            let square = (x + at(k % n)).powi(2) + at(k / n).powi(2) + 9.0;
            1000.0 * 3.0 / (square * square.sqrt())
        };
        let expected = (0..n * n).map(value).sum::<f64>() / f64::from(n * n);
        let patches: Vec<PatchId> = scene.patches().filter(|&p| scene.material_of(p) == material).collect();
        let mean = mean_irradiance(&scene, &solution, |p| patches.contains(&p)).luminance();
        let variance: f64 = patches.iter().map(|&p| solution.standard_error(p).powi(2)).sum();
        let error = (variance / (patches.len() * patches.len()) as f64).sqrt();
        println!("{x} m: {mean:.3} ± {error:.3} lx, expected {expected:.3}");
        assert!(
            (mean - expected).abs() < 5.0 * error && error < 0.05 * expected,
            "{x} m: {mean} ± {error}, {expected}"
        );
    }
}

/// In a closed black room everything arrives. Rays of points and spots carry exactly their flux, so that only their number
/// varies, by a few rays of 75 000 (a quarter of all, in strata); what those of profiles carry varies by a fifth, in strata too.
#[test]
fn all_flux_of_a_light_arrives_in_a_closed_room() {
    let place = DVec3::new(1.0, 2.2, 1.7);
    let (inner, outer) = (0.4f64, 0.9f64);
    let cone = 2.0 * PI * ((1.0 - inner.cos()) + (inner.cos() - outer.cos()) / 3.0);
    let (color, down) = (Rgb::new(3.0, 2.0, 1.0), DVec3::new(0.2, -1.0, 0.5));
    let profile = measured(place);
    let flux = profile.profile.as_ref().unwrap().flux();
    for (name, light, expected, tolerance) in [
        ("point", light(LightKind::Point, color, place, down), color * (4.0 * PI), 1e-4),
        ("spot", light(LightKind::Spot { inner, outer }, color, place, down), color * cone, 1e-4),
        ("profile", profile.clone(), profile.intensity * flux, 2e-3),
    ] {
        let mut authored = Scene::default();
        room(&mut authored, DVec3::new(4.0, 3.0, 4.0), std::array::from_fn(|_| matte(0.0)));
        authored.lights = vec![light];
        let scene = cut(&authored, 300);
        assert!((scene.lights_power() - expected).map(f64::abs).max_channel() < 1e-9 * expected.r, "{name}");
        let solution = solve(&scene, Params::default_preset(12), 300_000);
        let arrived = solution.arriving_power(&scene);
        for channel in 0..3 {
            let error = arrived[channel] / expected[channel] - 1.0;
            assert!(error.abs() < tolerance, "{name}: {arrived:?}, expected {expected:?}");
        }
        let balance = solution.balance();
        assert!(balance.residual().abs() < tolerance && balance.lost == 0.0, "{name}: {balance:?}");
    }
}

/// A room of 4 × 4 × 4 m and 10 000 lm: mean illuminance Φ/(S (1 − ρ)) = 104.17/(1 − ρ) lx, of which the first part is direct.
#[test]
fn energy_is_balanced_under_a_point() {
    for (albedo, indirect) in [(0.5, 104.2), (0.8, 416.7), (0.9, 937.5)] {
        let mut authored = Scene::default();
        room(&mut authored, DVec3::splat(4.0), std::array::from_fn(|_| matte(albedo)));
        let intensity = Rgb::grey(10_000.0 / (4.0 * PI));
        authored.lights = vec![light(LightKind::Point, intensity, DVec3::new(1.2, 3.0, 2.0), DVec3::NEG_Y)];
        let scene = cut(&authored, 1000);
        let solution = solve(&scene, Params::default_preset(13), 500_000);
        let mean = mean_irradiance(&scene, &solution, |_| true).luminance();
        let expected = 10_000.0 / 96.0 + indirect;
        // The noise of the total is some 1e-3 at 500 000 rays (`analytic`); the table has four digits.
        println!("albedo {albedo}: {mean:.2} lx, expected {expected:.2}; {:?}", solution.balance());
        assert!((mean / expected - 1.0).abs() < 3e-3, "albedo {albedo}: {mean}, expected {expected}");
        assert!(solution.balance().residual().abs() < 3e-3, "{:?}", solution.balance());
    }
}

/// Parallel light of 1000 lx, 30° from the vertical, through a hole of 1 m² in a roof, onto a floor that is as large as it must be: the
/// floor gets 1000 cos 30° lm, the roof its own share. Five standard errors of so many hits.
#[test]
fn parallel_light_comes_through_a_hole() {
    let mut authored = Scene::default();
    let floor = quad(&mut authored, matte(0.0), DVec3::new(-3.0, 0.0, 3.0), 6.0 * DVec3::X, -6.0 * DVec3::Z);
    // Four plates leave the square from −½ to ½ open; from above only the floor is seen through it.
    let plates = [
        ([-8.0, -8.0], [16.0, 7.5]),
        ([-8.0, 0.5], [16.0, 7.5]),
        ([-8.0, -0.5], [7.5, 1.0]),
        ([0.5, -0.5], [7.5, 1.0]),
    ];
    for ([x, z], [along, across]) in plates {
        quad(&mut authored, matte(0.0), DVec3::new(x, 1.5, z + across), along * DVec3::X, -across * DVec3::Z);
    }
    let angle = 30f64.to_radians();
    let direction = DVec3::new(angle.sin(), -angle.cos(), 0.0);
    authored.lights = vec![light(LightKind::Directional, Rgb::grey(1000.0), DVec3::ZERO, direction)];
    let scene = cut(&authored, 100);
    let rays = 600_000u64;
    let solution = solve(&scene, Params::default_preset(14), rays);
    let power = |which: &dyn Fn(PatchId) -> bool| -> f64 {
        scene.patches().filter(|&p| which(p)).map(|p| scene.area(p) * solution.irradiance(p).luminance()).sum()
    };
    let through = PI * scene.radius().powi(2);
    for (name, found, area) in [
        ("floor", power(&|p| scene.material_of(p) == floor), 1.0),
        ("roof", power(&|p| scene.material_of(p) != floor), 255.0),
    ] {
        let expected = 1000.0 * area * angle.cos();
        let error = (1.0 / (rays as f64 * area * angle.cos() / through)).sqrt();
        println!("{name}: {found:.2} lm, expected {expected:.2} ± {:.2} %", 100.0 * error);
        assert!((found / expected - 1.0).abs() < 5.0 * error, "{name}: {found}, expected {expected} ± {error}");
    }
    // What misses is nobody's loss.
    let balance = solution.balance();
    assert!(balance.emitted == 0.0 && balance.escaped == 0.0 && balance.residual().abs() < 1e-6, "{balance:?}");
}

/// All kinds of lights beside a lamp and under a sky: estimators and shares have one mean.
#[test]
fn whatever_the_shares_the_mean_is_one() {
    let mut authored = builtin::cornell(false);
    authored.environment = Some(Environment::Uniform(Rgb::grey(0.05)));
    let (scale, middle) = (0.5, DVec3::new(0.278, 0.3, -0.1));
    authored.lights = vec![
        light(LightKind::Point, Rgb::new(0.2, 0.1, 0.1) * scale, middle, DVec3::Y),
        light(LightKind::Spot { inner: 0.2, outer: 0.8 }, Rgb::grey(0.5) * scale, middle, DVec3::new(1.0, -0.5, 0.3)),
        light(LightKind::Directional, Rgb::grey(0.4), DVec3::ZERO, DVec3::new(0.1, -0.3, -1.0)),
        PunctualLight { intensity: Rgb::grey(2e-4), ..measured(middle) },
    ];
    let scene = cut(&authored, 300);
    let base = Shares { power: 0.1, lamps: 0.2, ..Shares::even(0.4, 0.3) };
    let shares = |points| Params { shares: Some(base.with_points(points)), ..Params::default_preset(0) };
    let estimator = |estimator| Params { estimator, ..shares(0.3) };
    super::strategies::agree(
        &scene,
        60_000,
        &[
            ("fitted", Params::default_preset(0)),
            ("few rays from lights", shares(0.1)),
            ("many", shares(0.7)),
            ("forward", estimator(Estimator::Forward)),
            ("equal", estimator(Estimator::Equal)),
            ("backward", estimator(Estimator::Backward)),
        ],
    );
}

#[test]
fn settings_that_would_lose_lights_are_refused() {
    let mut authored = builtin::cornell(true);
    let place = DVec3::new(0.2, 0.2, -0.2);
    authored.lights = vec![light(LightKind::Point, Rgb::WHITE, place, DVec3::NEG_Y)];
    let scene = cut(&authored, 100);
    let error = |params| Solver::new(&scene, params, None).err();
    assert_eq!(error(Params::paper_preset(1)), Some(SolveError::PaperLights));
    let without = Params { shares: Some(Shares::POWER), ..Params::default_preset(1) };
    assert_eq!(error(without), Some(SolveError::NoShareOfLights));
    // Black ones need none.
    authored.lights[0].intensity = Rgb::BLACK;
    let scene = cut(&authored, 100);
    assert!(Solver::new(&scene, Params::paper_preset(1), None).is_ok());
}
