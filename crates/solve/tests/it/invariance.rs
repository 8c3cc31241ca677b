//! What must not matter: size, place and turn of a scene; how lamps are added up; which end of a path shines.

use glam::{DAffine3, DQuat, DVec3, dvec3};
use twinray_scene::{Material, PatchScene, Rgb, Scene, Surface, Texel, builtin};
use twinray_solve::{Params, Shares};
use twinray_testkit::ztest::Mean;

use super::build::{lamp, matte, placed, quad, room};
use super::{cut, mean_irradiance, solve};

/// Independent runs behind every mean. Student's t of 30 degrees of freedom is beyond 5 with a probability of
/// 2.3e-5; the tests below make 13 such comparisons.
const SEEDS: u64 = 16;
const MOST: f64 = 5.0;

/// Means over independent runs agree.
fn agree(what: &str, a: Mean, b: Mean) {
    let t = (a.value - b.value) / a.error.hypot(b.error);
    let (errors, relative) = (a.error.hypot(b.error) / a.value, b.value / a.value - 1.0);
    println!("{what}: {relative:+.2e} apart, standard error {errors:.1e}, t = {t:+.2}");
    assert!(t.abs() < MOST, "{what}: {a:?} against {b:?}");
}

/// Luminance of the irradiance of every patch. With fixed shares of the strategies: fitted ones follow every single ray,
/// and a ten-thousandth of a share moves some percent of the rays that come after to the next patch.
fn irradiances(scene: &PatchScene, rays: u64) -> Vec<f64> {
    let params = Params { shares: Some(Shares::even(0.1, 0.0)), ..Params::default_preset(4) };
    let solution = solve(scene, params, rays);
    scene.patches().map(|p| solution.irradiance(p).luminance()).collect()
}

/// Relative RMS difference.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.iter().map(|a| a * a).sum::<f64>()).sqrt()
}

/// Neither the unit of length nor the place in the world changes irradiance.
///
/// The rays are the same ones, but vertices round differently, by 6e-8 of the scene's size: of 2e5 rays on 600 patches
/// a few may choose another patch or end on the other side of an edge. One such ray changes the irradiance of two of
/// the 600 patches by a 300th, which is an RMS of 2e-4; the bound allows some tens of them. Independent runs would
/// differ by 6e-2.
#[test]
fn scale_and_place_do_not_matter() {
    let authored = builtin::cornell(false);
    let rays = 200_000;
    let here = irradiances(&cut(&authored, 600), rays);
    for scale in [1e-3, 0.3, 1e3, 1e6] {
        let there = irradiances(&cut(&placed(authored.clone(), DAffine3::from_scale(DVec3::splat(scale))), 600), rays);
        let rms = difference(&here, &there);
        println!("scale {scale:e}: relative RMS difference {rms:.1e}");
        assert!(rms < 1e-3, "scale {scale}: {rms}");
    }
    for far in [dvec3(1e5, 0.0, 0.0), dvec3(1e5, -1e5, 1e5)] {
        let there = irradiances(&cut(&placed(authored.clone(), DAffine3::from_translation(far)), 600), rays);
        let rms = difference(&here, &there);
        println!("{far} away: relative RMS difference {rms:.1e}");
        assert!(rms < 1e-3, "{far}: {rms}");
    }
}

/// A large scene far away, in single precision from the author: coordinates of 1e5 m in the mesh itself resolve 8 mm,
/// which moves the walls of a 10 m room by a thousandth of its size, and its light by as much.
#[test]
fn coordinates_far_away_in_the_mesh_itself() {
    let mut near = builtin::cornell(false);
    near = placed(near, DAffine3::from_scale(DVec3::splat(20.0)));
    let mut far = builtin::cornell(false);
    for mesh in &mut far.meshes {
        for p in &mut mesh.positions {
            *p = (DVec3::from(p.map(f64::from)) * 20.0 + DVec3::splat(1e5)).as_vec3().to_array();
        }
    }
    let mean = |scene: &Scene| {
        let scene = cut(scene, 600);
        mean_irradiance(&scene, &solve(&scene, Params::default_preset(4), 200_000), |_| true).luminance()
    };
    let (near, far) = (mean(&near), mean(&far));
    println!("{near} near, {far} far");
    assert!((far / near - 1.0).abs() < 3e-3, "{near} near, {far} far");
}

/// Mean irradiance of the patches of each material, over independent runs: `[material]`.
fn by_material(scene: &Scene, patches: usize, rays: u64, first_seed: u64) -> Vec<Vec<f64>> {
    let count = scene.materials.len();
    let scene = cut(scene, patches);
    let mut samples = vec![Vec::new(); count];
    for seed in 0..SEEDS {
        let solution = solve(&scene, Params::default_preset(first_seed + seed), rays);
        for (material, samples) in samples.iter_mut().enumerate() {
            let mean = mean_irradiance(&scene, &solution, |p| scene.material_of(p) == material);
            samples.push(mean.luminance());
        }
    }
    samples
}

#[test]
fn rotation_does_not_matter() {
    let authored = builtin::cornell(false);
    let axis = dvec3(1.0, 2.0, -0.5).normalize();
    let turned = placed(authored.clone(), DAffine3::from_quat(DQuat::from_axis_angle(axis, 1.234)));
    let (here, there) = (by_material(&authored, 600, 60_000, 100), by_material(&turned, 600, 60_000, 200));
    for (i, (a, b)) in here.iter().zip(&there).enumerate() {
        agree(&authored.materials[i].name, Mean::of(a), Mean::of(b));
    }
}

/// The light of two lamps is the light of the one and the light of the other.
#[test]
fn lamps_add_up() {
    let with = |first: f64, second: f64| {
        let mut scene = builtin::cornell(false);
        scene.materials[4].emission *= first;
        // The boxes glow as well, reddish.
        scene.materials[3].emission = Rgb::new(1.0, 0.5, 0.2) * second;
        scene
    };
    let run = |first, second, seed| by_material(&with(first, second), 600, 60_000, seed);
    let (one, two, both) = (run(1.0, 0.0, 300), run(0.0, 1.0, 400), run(1.0, 1.0, 500));
    for i in 0..one.len() {
        let (a, b) = (Mean::of(&one[i]), Mean::of(&two[i]));
        let sum = Mean { value: a.value + b.value, error: a.error.hypot(b.error) };
        agree(&with(1.0, 1.0).materials[i].name, sum, Mean::of(&both[i]));
    }
}

/// A room with a screen in the middle; a large black quadrilateral under the ceiling, a small one in a wall behind
/// the screen. Light from either to the other goes around the screen, by the floor mostly.
fn lamp_and_sensor(floor: Surface, wall: Surface, radiance: [f64; 2]) -> (Scene, [usize; 2]) {
    let mut scene = Scene::default();
    let with = |surface: &Surface| Material { surface: surface.clone(), ..Material::default() };
    let size = dvec3(3.0, 2.0, 2.0);
    room(&mut scene, size, [matte(0.6), matte(0.5), with(&floor), matte(0.7), with(&wall), matte(0.3)]);
    let screen = Material { two_sided: true, ..matte(0.4) };
    quad(&mut scene, screen, dvec3(1.5, 0.5, 0.0), dvec3(0.0, 1.5, 0.0), dvec3(0.0, 0.0, 1.7));
    let one = quad(&mut scene, lamp(radiance[0]), dvec3(0.3, 1.9, 0.4), dvec3(0.8, 0.0, 0.0), dvec3(0.0, 0.0, 1.2));
    let other = quad(&mut scene, lamp(radiance[1]), dvec3(2.9, 0.3, 0.6), dvec3(0.0, 0.0, 0.5), dvec3(0.0, 0.6, 0.0));
    (scene, [one, other])
}

/// Helmholtz: a lamp of radiance L at y sends as much power to a black sensor at x as the same radiance at x would
/// send to y, whatever lies between them: L ∫∫ f G … over the same paths, read from the other end.
///
/// A warm start that takes lobes for diffuse must not stay in the result: with it, the scene with Phong was 5 % off.
#[test]
fn lamp_and_sensor_may_be_swapped() {
    let grey = |x| Texel::constant(Rgb::grey(x));
    let diffuse = || Surface::Lambertian { reflectance: grey(0.5) };
    let ggx = |roughness, metallic| Surface::MetallicRoughness {
        base_color: grey(0.6),
        metallic,
        roughness,
        metallic_roughness_texture: None,
        specular_texture: None,
        specular_color_texture: None,
        specular: 1.0,
        specular_color: Rgb::WHITE,
        ior: 1.5,
    };
    let phong = Surface::Phong { diffuse: grey(0.2), specular: Rgb::grey(0.5), exponent: 20.0 };
    for (name, floor, wall) in [
        ("diffuse", diffuse(), diffuse()),
        ("metal and coat", ggx(0.4, 1.0), ggx(0.5, 0.0)),
        ("Phong", phong, diffuse()),
    ] {
        let power = |radiance: [f64; 2], to: usize, first_seed: u64| {
            let (scene, ends) = lamp_and_sensor(floor.clone(), wall.clone(), radiance);
            let scene = cut(&scene, 500);
            let sensor = ends[to];
            let samples: Vec<f64> = (0..SEEDS)
                .map(|seed| {
                    let solution = solve(&scene, Params::default_preset(first_seed + seed), 250_000);
                    let patches = scene.patches().filter(|&p| scene.material_of(p) == sensor);
                    patches.map(|p| solution.irradiance(p).luminance() * scene.area(p)).sum()
                })
                .collect();
            Mean::of(&samples)
        };
        agree(name, power([1.0, 0.0], 1, 600), power([0.0, 1.0], 0, 700));
    }
}
