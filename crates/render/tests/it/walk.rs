//! The light that viewers are given: every side has its slots, and a furnace's is even.

use std::f64::consts::{PI, TAU};

use twinray_render::walk::{NO_NODE, Nodes, WalkLight};
use twinray_scene::{PatchBudget, PatchOptions, PatchScene, Scene, Surface, Texel, builtin};
use twinray_solve::{Params, Solver};

fn cut(scene: &Scene, patches: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(patches), two_sided: false }).unwrap()
}

#[test]
fn every_side_with_patches_has_its_slots_and_glossy_ones_come_first() {
    let scene = cut(&builtin::hall(), 9_000);
    let nodes = Nodes::new(&scene);
    assert!(nodes.glossy_nodes > 0 && nodes.glossy_nodes < nodes.len());
    let mut slots = 0;
    for t in 0..scene.triangle_count() {
        for side in 0..2 {
            let first = nodes.first_slots[t][side];
            assert_eq!(first != NO_NODE, (side as u32) < scene.sides_of(t as u32), "triangle {t}");
            if first == NO_NODE {
                continue;
            }
            slots += scene.cells_of(t as u32).grid_count();
            let is_glossy = nodes.first_cells[t][side] != NO_NODE;
            assert_eq!(is_glossy, (first as usize) < nodes.glossy_slots, "triangle {t}");
            for slot in first..first + scene.cells_of(t as u32).grid_count() {
                let node = nodes.node_of_slot[slot as usize] as usize;
                assert_eq!(is_glossy, node < nodes.glossy_nodes, "triangle {t}");
            }
        }
    }
    assert_eq!(slots as usize, nodes.node_of_slot.len());
    assert!(nodes.len() < nodes.node_of_slot.len(), "neighbours share nodes");
}

/// In a furnace of albedo ρ and emission 1 radiosity is 1/(1 − ρ), so irradiance as well, everywhere; of it ρ comes from
/// surfaces and 1 − ρ from what emits.
#[test]
fn a_furnace_is_even_for_viewers_too() {
    const ALBEDO: f64 = 0.5;
    let mut authored = builtin::furnace(ALBEDO, 1.0);
    for material in &mut authored.materials {
        let Surface::Lambertian { reflectance } = &material.surface else { panic!("the furnace is matte") };
        // A lobe that reflects nothing, so that nodes have to know directions.
        material.surface = Surface::MetallicRoughness {
            base_color: Texel::constant(reflectance.factor),
            metallic: 0.0,
            roughness: 0.5,
            metallic_roughness_texture: None,
            specular: 0.0,
            specular_texture: None,
            specular_color: twinray_scene::Rgb::WHITE,
            specular_color_texture: None,
            ior: 1.5,
        };
    }
    let scene = cut(&authored, 2_000);
    let mut solver = Solver::new(&scene, Params::default_preset(1), None).unwrap();
    solver.run(1_000_000);
    let nodes = Nodes::new(&scene);
    assert_eq!(nodes.glossy_nodes, nodes.len());
    let mut walk = WalkLight::new(&scene, &nodes);
    let solution = solver.solution();
    let light = walk.of(&solution, 4);
    let expected = 1.0 / (1.0 - ALBEDO);
    let mean = |of: &dyn Fn(usize) -> f64| (0..nodes.len()).map(of).sum::<f64>() / nodes.len() as f64;
    let irradiance = mean(&|n| f64::from(light.irradiance[n][1]));
    // The solve's noise of a patch is 2 %, over a thousand nodes: .1 %.
    assert!((irradiance / expected - 1.0).abs() < 0.004, "irradiance {irradiance}, expected {expected}");
    for e in &light.irradiance {
        assert!((f64::from(e[1]) / expected - 1.0).abs() < 0.06, "a node of {}", e[1]);
    }
    // ∫ L Y00 over the sphere, of radiance ρ/(1 − ρ)/π from surfaces.
    let even = ALBEDO * expected / PI * (4.0 * PI) * (0.25 / PI).sqrt();
    let found = mean(&|n| f64::from(light.radiance[n][0][1]));
    assert!((found / even - 1.0).abs() < 0.01, "surfaces give {found}, expected {even}");
    // Lamps: radiance 1/π over the hemisphere.
    let lamps = mean(&|n| f64::from(light.lamps[n].radiance[1]));
    assert!((lamps / (TAU / PI) - 1.0).abs() < 0.02, "lamps give {lamps}, expected {}", TAU / PI);
    // No direction is better than others: harmonics vanish in the mean, here over a thousand nodes.
    for k in 1..9 {
        let off = mean(&|n| f64::from(light.radiance[n][k][1] / light.radiance[n][0][1]));
        let most = if k < 4 { 3.0_f64.sqrt() } else { 5.0_f64.sqrt() };
        assert!(off.abs() < 0.005 * most, "harmonic {k}: {:.4} of the largest", off / most);
    }
    // What a matte cell remembers of its lobe reflects nothing; its scale is finite all the same.
    assert_eq!(walk.samples(&solution).len(), nodes.glossy_cells());
    assert!(walk.samples(&solution).iter().flat_map(|s| s.irradiance).all(f32::is_finite));
}
