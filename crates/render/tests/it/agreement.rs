//! The solver against the path tracer, which shares none of its transport.
//!
//! Patches of the solver have constant light, so that its means over surfaces are off by what this loses. How much is
//! measured, not guessed: the change from coarse to finer patches bounds what is left, as long as the loss at least
//! halves. It does in the open; beside lamps that stand in corners it does not, so lamps are left out, as in all
//! errors of irradiance.

use std::collections::BTreeMap;

use twinray_render::reference::{self, IrradianceOptions};
use twinray_scene::{PatchId, PatchScene, Scene, builtin};
use twinray_solve::{Params, PatchLight, Solver};
use twinray_testkit::ztest::Mean;

use super::reference::{blended_plates, cut, mean_over};

const SEEDS: u64 = 3;
/// Materials of a smaller share of the area are one group: few paths on a dark corner are too skewed for a z-test.
const LEAST_SHARE: f64 = 0.02;

/// Mean irradiance of what does not emit, by material.
fn groups(authored: &Scene, scene: &PatchScene, light: &PatchLight) -> BTreeMap<String, Mean> {
    let area =
        |which: &dyn Fn(PatchId) -> bool| -> f64 { scene.patches().filter(|&p| which(p)).map(|p| scene.area(p)).sum() };
    let dark = |p: PatchId| scene.emission(p).is_black();
    let all = area(&dark);
    let is_large = |name: &str| area(&|p| dark(p) && scene.material(p).name == name) > LEAST_SHARE * all;
    let large: Vec<&str> = authored.materials.iter().map(|m| m.name.as_str()).filter(|n| is_large(n)).collect();
    let group = |p: PatchId| large.iter().find(|n| **n == scene.material(p).name).copied().unwrap_or("others");
    let names = large.iter().chain((large.len() < authored.materials.len() - 1).then_some(&"others"));
    names.map(|n| ((*n).to_owned(), mean_over(scene, light, |p| dark(p) && group(p) == *n))).collect()
}

/// The same over independent solves.
fn solved(authored: &Scene, patches: usize, rays: u64) -> BTreeMap<String, Mean> {
    let scene = cut(authored, patches);
    let run = |seed| {
        let mut solver = Solver::new(&scene, Params::default_preset(100 + seed), None).unwrap();
        solver.run(rays);
        groups(authored, &scene, &solver.solution().patch_light(&scene))
    };
    let runs: Vec<BTreeMap<String, Mean>> = (0..SEEDS).map(run).collect();
    let over_runs = |name: &String| Mean::of(&runs.iter().map(|r| r[name].value).collect::<Vec<_>>());
    runs[0].keys().map(|name| (name.clone(), over_runs(name))).collect()
}

pub(crate) fn agrees(authored: &Scene, coarse: usize, rays: u64, paths_per_patch: u32) {
    let scene = cut(authored, 100);
    let options = IrradianceOptions { paths_per_patch, ..IrradianceOptions::default() };
    let traced = groups(authored, &scene, &reference::irradiance(&scene, &options));
    let (coarse, fine) = (solved(authored, coarse, rays), solved(authored, 4 * coarse, rays));
    for (name, traced) in traced {
        let (coarse, fine) = (coarse[&name], fine[&name]);
        let (difference, cells) = (fine.value - traced.value, (fine.value - coarse.value).abs());
        let error = fine.error.hypot(traced.error);
        let text = format!(
            "{}, {name}: traced {:.4} ± {:.4}, solved {:.4} ± {:.4}, with coarse patches {:.4} ± {:.4}, z {:+.2}",
            authored.name,
            traced.value,
            traced.error,
            fine.value,
            fine.error,
            coarse.value,
            coarse.error,
            difference / error
        );
        println!("{text}");
        // Some 20 tests at four standard errors: a false-alarm rate of .2 % even without the patches' share.
        assert!(difference.abs() < 4.0 * error + cells, "{text}");
        assert!(error < 0.05 * traced.value, "{text}: too noisy to tell anything");
    }
}

#[test]
fn in_the_cornell_box() {
    agrees(&builtin::cornell(false), 2000, 500_000, 4000);
}

/// Veils scatter, shine and let through, each by its alpha.
#[test]
fn through_veils() {
    agrees(&blended_plates(), 500, 400_000, 4000);
}

#[test]
fn through_a_door() {
    agrees(&builtin::doorway(), 2000, 400_000, 1500);
}

#[test]
fn on_a_glossy_floor() {
    agrees(&builtin::hall(), 10_000, 300_000, 60);
}
