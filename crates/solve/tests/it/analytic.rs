//! Scenes with closed solutions: furnace, plates, unit cube; energy balance and linearity.

use std::f64::consts::PI;

use twinray_scene::{Rgb, Side, builtin};
use twinray_solve::{Params, PatchLight, Solver};

use super::{cut, mean_irradiance, solve};

/// In a furnace every surface emits 1 and reflects ρ, so irradiance = radiosity = 1/(1−ρ) everywhere.
#[test]
fn furnace_with_the_default_preset() {
    // Tolerance on the total power, and on the RMS over patches. At 1e6 rays on 2000 patches a patch is met
    // about 1000 times: independent rays would leave 1/√1000 = 3.2 %, half of it variance that the second
    // direction saves; the stated bound is that of independent forward rays.
    for (albedo, total) in [(0.0, 1e-3), (0.5, 1e-3), (0.8, 1e-3), (0.95, 5e-3)] {
        let scene = cut(&builtin::furnace(albedo, 1.0), 2000);
        let solution = solve(&scene, Params::default_preset(3), 1_000_000);
        let expected = 1.0 / (1.0 - albedo);
        let mean = solution.arriving_power(&scene).luminance() / scene.total_area();
        println!("albedo {albedo}: relative error of the total power {:+.2e}", mean / expected - 1.0);
        assert!((mean / expected - 1.0).abs() < total, "albedo {albedo}: mean irradiance {mean}, expected {expected}");
        let mean_square: f64 = scene
            .patches()
            .map(|p| scene.area(p) * (solution.irradiance(p).luminance() / expected - 1.0).powi(2))
            .sum::<f64>()
            / scene.total_area();
        println!("albedo {albedo}: RMS over patches {:.4}", mean_square.sqrt());
        assert!(mean_square.sqrt() < 0.032, "albedo {albedo}: RMS {}", mean_square.sqrt());
        let worst =
            scene.patches().map(|p| (solution.irradiance(p).luminance() / expected - 1.0).abs()).fold(0.0, f64::max);
        // Six standard deviations of independent rays.
        assert!(worst < 6.0 * 0.032, "albedo {albedo}: worst patch {worst}");
    }
}

/// In a grey furnace every ray of the paper preset carries the whole power, so nR_n grows by exactly ρ(Φ + R_n):
/// R_n/R_∞ = 1 − Γ(n+ρ)/(Γ(n+1)Γ(ρ)). There is no noise, only the loss of the 1/n average.
#[test]
fn the_paper_preset_loses_exactly_what_theory_predicts() {
    for albedo in [0.5, 0.8, 0.95] {
        let scene = cut(&builtin::furnace(albedo, 1.0), 500);
        // Patches store their colours in single precision.
        let albedo = f64::from(albedo as f32);
        let emitted = scene.emitted_power().luminance();
        let mut solver = Solver::new(&scene, Params::paper_preset(7), None).unwrap();
        for n in [1u64, 10, 1000, 100_000] {
            while solver.rays() < n {
                solver.advance(n);
            }
            // The iteration n R_n = (n−1) R_{n−1} + ρ(Φ + R_{n−1}) starts at R_0 = 0, whose first step is ρΦ.
            let lost: f64 = (1..=n).map(|k| ((k as f64 - 1.0 + albedo) / k as f64).ln()).sum::<f64>().exp();
            let limit = emitted * albedo / (1.0 - albedo);
            let expected = emitted + limit * (1.0 - lost);
            let power = solver.tree_power().expect("the paper's schedule has a tree");
            assert!((power / expected - 1.0).abs() < 1e-9, "albedo {albedo}, n = {n}: {power} against {expected}");
        }
    }
}

/// One plate emits radiosity 1, so the mean irradiance of the other is the form factor.
#[test]
fn parallel_plates_exchange_their_form_factor() {
    let scene = cut(&builtin::plates(1.0), 200);
    for params in [Params::default_preset(1), Params::paper_preset(1)] {
        let solution = solve(&scene, params, 2_000_000);
        let dark = mean_irradiance(&scene, &solution, |p| scene.emission(p).is_black()).luminance();
        // One ray in five arrives: a standard error of √(.8/(.2 · 2e6)) = .14 % without stratification.
        assert!((dark / 0.199_824_895_7 - 1.0).abs() < 5.0 * 0.0014, "{dark}");
    }
}

/// Unit cube, floor emitting radiosity 1, every face of albedo ρ: means of the continuous solution.
#[test]
fn unit_cube() {
    for (albedo, floor, ceiling, wall) in [(0.5, 1.10433, 0.17122, 0.18111), (0.8, 1.58740, 0.66099, 0.68790)] {
        let scene = cut(&builtin::cube(albedo), 6 * 400);
        let solution = solve(&scene, Params::default_preset(5), 4_000_000);
        let radiosity = |which: &dyn Fn(f64) -> bool| {
            let mean = mean_irradiance(&scene, &solution, |p| which(scene.normal(p).y)).luminance();
            mean * albedo + if which(1.0) { 1.0 } else { 0.0 }
        };
        for (name, value, expected) in [
            ("floor", radiosity(&|y| y > 0.5), floor),
            ("ceiling", radiosity(&|y| y < -0.5), ceiling),
            ("walls", radiosity(&|y| y.abs() < 0.5), wall),
        ] {
            // 4e6 rays leave about .1 % on a face's mean; 400 patches a face are the continuous solution to 1e-4.
            assert!((value / expected - 1.0).abs() < 4e-3, "albedo {albedo}, {name}: {value} against {expected}");
        }
    }
}

#[test]
fn one_patch_per_face_is_the_six_by_six_system() {
    // The smallest mesh (two triangles a face) still has one unknown more per face than the table's system, so
    // only the sum, which any patching keeps, is exact.
    let scene = cut(&builtin::cube(0.5), 1);
    assert_eq!(scene.len(), 12);
    let solution = solve(&scene, Params::default_preset(5), 1_000_000);
    let total = solution.arriving_power(&scene).luminance() * 0.5 + scene.emitted_power().luminance();
    assert!((total / 2.0 - 1.0).abs() < 1e-3, "{total}");
}

#[test]
fn energy_is_balanced() {
    for name in ["cornell", "cornell-closed", "doorway", "hall"] {
        let scene = cut(&builtin::by_name(name).unwrap(), 10_000);
        let b = solve(&scene, Params::default_preset(2), 1_000_000).balance();
        println!("{name}: {b:?}");
        assert!(b.residual().abs() < 2e-3, "{name}: {b:?}");
        assert!(b.lost_share() < 1e-5, "{name}: {b:?}");
        if name != "cornell" {
            assert!(b.escaped / b.emitted < 1e-5, "{name}: {b:?}");
        } else {
            assert!(b.escaped / b.emitted > 0.1, "{name}: {b:?}");
        }
    }
}

/// A sky over an open box: what the box's opening lets in, its walls absorb or send back.
#[test]
fn sky_light_is_balanced_and_right() {
    let mut authored = builtin::plates(1.0);
    authored.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
    authored.environment = Some(twinray_scene::Environment::Uniform(Rgb::WHITE));
    let scene = cut(&authored, 200);
    let solution = solve(&scene, Params::default_preset(1), 2_000_000);
    // Each plate sees 1 − F of the sky, and a black plate besides: E = π (1 − F).
    let expected = PI * (1.0 - 0.199_824_895_7);
    let mean = mean_irradiance(&scene, &solution, |_| true).luminance();
    assert!((mean / expected - 1.0).abs() < 3e-3, "{mean} against {expected}");
    assert!(solution.balance().residual().abs() < 1e-6);
}

#[test]
fn light_is_linear_in_emission() {
    let run = |factor: f64| {
        let mut authored = builtin::cornell(false);
        authored.materials.iter_mut().for_each(|m| m.emission *= factor);
        let scene = cut(&authored, 3000);
        solve(&scene, Params::default_preset(4), 300_000).patch_light(&scene)
    };
    let luminances =
        |light: &PatchLight| -> Vec<f64> { light.irradiance.iter().map(|e| Rgb::from_f32(*e).luminance()).collect() };
    let one = run(1.0);
    let reference = luminances(&one);
    for factor in [1.0 / 1024.0, 4.0, f64::from(1u32 << 20)] {
        for (a, b) in reference.iter().zip(luminances(&run(factor))) {
            // Powers of two change no rounding of the state: the same rays, the same sums but for fixed-point units.
            assert!((b / factor - a).abs() <= 1e-6 * a.max(1e-3), "{a} times {factor} is not {b}");
        }
    }
    for factor in [1e-6, 3.0] {
        // Other factors round the state differently. A single ray that starts from a neighbour shifts the choice of
        // all later ones a little, so the runs part until they are as good as independent: a z-test, p > 1e-4.
        let noise: f64 = one.standard_error.iter().map(|&e| f64::from(e).powi(2)).filter(|v| v.is_finite()).sum();
        let (a, b): (f64, f64) = (reference.iter().sum(), luminances(&run(factor)).iter().sum());
        let z = (b / factor - a) / (2.0 * noise).sqrt();
        println!("factor {factor}: z = {z:.2}, relative difference {:.1e}", b / factor / a - 1.0);
        assert!(z.abs() < 3.9, "{a} times {factor} is not {b}: z = {z}");
    }
}

#[test]
fn patches_are_one_sided_unless_asked() {
    let scene = cut(&builtin::plates(1.0), 10);
    assert!(scene.patches().all(|p| scene.side_of(p) == Side::Front));
}
