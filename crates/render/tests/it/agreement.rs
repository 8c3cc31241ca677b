//! The solver against the path tracer, which shares none of its transport.
//!
//! Patches of the solver have constant light, so that its means over surfaces are off by what this loses. How much is
//! measured, not guessed: the change from coarse to finer patches bounds what is left, as long as the loss at least
//! halves. It does in the open; beside lamps that stand in corners it does not, so lamps are left out, as in all
//! errors of irradiance.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use twinray_render::reference::{self, IrradianceOptions};
use twinray_scene::{
    Environment, EnvironmentMap, LightKind, LightProfile, PatchId, PatchScene, PunctualLight, RadianceMap, Rgb, Scene,
    Sky, SkyModel, builtin,
};
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

/// Cornell's box with its lamp out, open at the front, which looks to +Z.
fn unlit() -> Scene {
    let mut scene = builtin::cornell(false);
    scene.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
    scene
}

/// A point, a spot and a measured light in the box, and parallel light from outside.
#[test]
fn under_lights_without_area() {
    let mut scene = unlit();
    let corners = scene.meshes.iter().flat_map(|m| &m.positions).map(|p| glam::Vec3::from(*p).as_dvec3());
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let size = high - low;
    let light = |name: &str, kind, candela: f64, at: DVec3, towards: DVec3| PunctualLight {
        name: name.into(),
        kind,
        intensity: Rgb::new(1.0, 0.8, 0.6) * candela,
        transform: DAffine3::from_rotation_translation(
            DQuat::from_rotation_arc(DVec3::NEG_Z, towards.normalize()),
            low + size * at,
        ),
        profile: None,
    };
    let profile = LightProfile {
        name: "two lobes".into(),
        vertical: vec![0.0, 40.0, 60.0, 120.0],
        horizontal: vec![0.0, 90.0, 180.0, 270.0, 360.0],
        candela: [[1.0f32, 2.0, 0.5, 0.0], [1.0, 0.2, 0.0, 0.0]].iter().cycle().take(5).flatten().copied().collect(),
    };
    let square = size.x * size.x;
    let measured = light("measured", LightKind::Point, square, DVec3::new(0.7, 0.8, 0.4), DVec3::NEG_Y);
    scene.lights = vec![
        light("point", LightKind::Point, square, DVec3::new(0.25, 0.8, 0.6), DVec3::Y),
        light(
            "spot",
            LightKind::Spot { inner: 0.3, outer: 0.7 },
            3.0 * square,
            DVec3::splat(0.9),
            DVec3::new(-1.0, -0.9, -0.8),
        ),
        PunctualLight { profile: Some(Arc::new(profile)), ..measured },
        light("sun", LightKind::Directional, 1.0, DVec3::ZERO, DVec3::new(0.3, -0.5, -1.0)),
    ];
    agrees(&scene, 1000, 150_000, 8000);
}

/// A map of a bright window in a dim landscape.
#[test]
fn under_a_map() {
    let pixel = |k: usize| match (k % 32, k / 32) {
        (22..25, 5..8) => [40.0, 38.0, 30.0],
        (_, row) if row < 8 => [0.4, 0.5, 0.8],
        _ => [0.1, 0.08, 0.05],
    };
    let image = RadianceMap { name: "map".into(), width: 32, height: 16, pixels: (0..512).map(pixel).collect() };
    let mut scene = unlit();
    scene.environment = Some(Environment::Map(EnvironmentMap { image: Arc::new(image), rotation: 0.3, strength: 2.0 }));
    agrees(&scene, 1000, 200_000, 6000);
}

#[test]
fn under_sun_and_sky() {
    let mut scene = unlit();
    // From the south, which is +Z, into the open front.
    let sky = Sky::natural(SkyModel::Preetham { turbidity: 3.0 }, Some([35.0, 170.0]));
    scene.environment = Some(Environment::Sky(sky));
    agrees(&scene, 1000, 200_000, 6000);
}
