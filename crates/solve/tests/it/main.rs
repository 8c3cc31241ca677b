//! The solver against what is known: analytic scenes, conservation laws, and itself by other means.

mod analytic;
mod build;
mod convergence;
mod determinism;
mod error_bars;
mod estimators;
mod invariance;
mod laws;
mod lights;
mod odd_scenes;
mod ranks;
mod record;
mod representation;
mod strategies;
mod variance;

use twinray_scene::{PatchBudget, PatchOptions, PatchScene, Rgb, Scene, Surface, Texel, builtin};
use twinray_solve::{Params, Solution, Solver};

/// A scene cut into about `patches` patches.
fn cut(scene: &Scene, patches: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(patches), two_sided: false }).unwrap()
}

fn solve(scene: &PatchScene, params: Params, rays: u64) -> Solution {
    let mut solver = Solver::new(scene, params, None).unwrap();
    solver.run(rays);
    solver.solution()
}

/// Area-weighted mean irradiance over the patches that a condition chooses.
fn mean_irradiance(scene: &PatchScene, solution: &Solution, which: impl Fn(twinray_scene::PatchId) -> bool) -> Rgb {
    let (mut sum, mut area) = (Rgb::BLACK, 0.0);
    for p in scene.patches().filter(|&p| which(p)) {
        sum += solution.irradiance(p) * scene.area(p);
        area += scene.area(p);
    }
    sum / area
}

/// Cornell's box with a floor and blocks that shine: a lacquer of roughness 0.35.
fn glossy_cornell() -> Scene {
    let mut scene = builtin::cornell(false);
    for material in scene.materials.iter_mut().filter(|m| m.emission.is_black()) {
        let Surface::Lambertian { reflectance } = &material.surface else { continue };
        material.surface = Surface::MetallicRoughness {
            base_color: Texel::constant(reflectance.factor),
            metallic: 0.0,
            roughness: 0.35,
            metallic_roughness_texture: None,
            specular_texture: None,
            specular_color_texture: None,
            specular: 1.0,
            specular_color: Rgb::WHITE,
            ior: 1.8,
        };
    }
    scene
}
