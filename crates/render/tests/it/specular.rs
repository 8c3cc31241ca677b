//! Mirrors and glass: the solver's rays against the path tracer's, and the light that neither may lose.

use glam::{DAffine3, DQuat, DVec3};
use twinray_render::reference::{self, IrradianceOptions};
use twinray_scene::brdf::Event;
use twinray_scene::passing::End;
use twinray_scene::sample::Stream;
use twinray_scene::{
    Instance, LightKind, Material, Mesh, PunctualLight, Rgb, Scene, Surface, Texel, Transmission, Volume, builtin,
};
use twinray_solve::{Params, Solver};
use twinray_testkit::ztest::Mean;

use super::agreement::agrees;
use super::reference::{cut, mean_over};

/// What the boxes of the Cornell box are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Boxes {
    Mirror,
    /// A smooth coat over a diffuse base.
    Coat,
    /// Tinted panes.
    Panes,
    /// Tinted bodies.
    Glass,
    /// Tinted panes of roughness .05: clear to the solver alone.
    NearlyClear,
}

/// The Cornell box with boxes of something else.
pub(crate) fn cornell_with(boxes: Boxes, closed: bool) -> Scene {
    let mut scene = builtin::cornell(closed);
    scene.name = format!("cornell with {boxes:?}");
    let material = scene.materials.iter_mut().find(|m| m.name == "box").unwrap();
    let tint = Rgb::new(0.9, 0.8, 0.5);
    let (metallic, base) = match boxes {
        Boxes::Mirror => (1.0, Rgb::grey(0.9)),
        Boxes::Coat => (0.0, Rgb::grey(0.7)),
        Boxes::Panes | Boxes::NearlyClear => (0.0, tint),
        Boxes::Glass => (0.0, Rgb::WHITE),
    };
    material.surface = Surface::MetallicRoughness {
        base_color: Texel::constant(base),
        metallic,
        roughness: if matches!(boxes, Boxes::NearlyClear) { 0.05 } else { 0.0 },
        metallic_roughness_texture: None,
        specular: 1.0,
        specular_texture: None,
        specular_color: Rgb::WHITE,
        specular_color_texture: None,
        ior: 1.5,
    };
    let volume = matches!(boxes, Boxes::Glass).then_some(Volume { attenuation: Rgb::new(0.5, 1.0, 4.0) });
    material.transmission = matches!(boxes, Boxes::Panes | Boxes::Glass | Boxes::NearlyClear).then_some(Transmission {
        factor: 1.0,
        texture: None,
        volume,
    });
    scene
}

#[test]
fn mirrors_agree() {
    agrees(&cornell_with(Boxes::Mirror, false), 1000, 400_000, 4000);
}

#[test]
fn coats_agree() {
    agrees(&cornell_with(Boxes::Coat, false), 1000, 400_000, 4000);
}

#[test]
fn panes_agree() {
    agrees(&cornell_with(Boxes::Panes, false), 1000, 400_000, 4000);
}

#[test]
fn glass_agrees() {
    agrees(&cornell_with(Boxes::Glass, false), 1000, 400_000, 6000);
}

/// What mirrors and panes send on is neither absorbed nor lost. In the closed box light leaves by the boxes' open bottoms
/// alone. The residual of 400 000 rays is the warm start's: a few tenths of a percent.
#[test]
fn energy_is_kept() {
    for boxes in [Boxes::Mirror, Boxes::Coat, Boxes::Panes] {
        let scene = cut(&cornell_with(boxes, true), 1000);
        for params in [Params::default_preset(3), Params::paper_preset(3)] {
            let mut solver = Solver::new(&scene, params, None).unwrap();
            solver.run(400_000);
            let balance = solver.solution().balance();
            println!("{boxes:?}: {balance:?}, residual {:+.4}", balance.residual());
            assert!(balance.residual().abs() < 0.01, "{boxes:?}: {balance:?}");
        }
    }
}

/// A shadow ray through a tinted pane brings what the path itself finds behind it.
#[test]
fn panes_do_not_stop_shadow_rays() {
    let scene = cut(&cornell_with(Boxes::Panes, false), 100);
    let inside = |technique| {
        let options = IrradianceOptions { paths_per_patch: 3000, technique, ..IrradianceOptions::default() };
        let light = reference::irradiance(&scene, &options);
        mean_over(&scene, &light, |p| scene.material(p).name == "box")
    };
    let [both, path] = [reference::Technique::Both, reference::Technique::Path].map(inside);
    let z = (both.value - path.value) / both.error.hypot(path.error);
    println!("inside of panes: {both:?} by both, {path:?} by paths alone, z {z:+.2}");
    assert!(z.abs() < 4.0);
    assert!(both.error < path.error, "shadow rays through panes find the lamp");
}

/// Choices that end in [`Event::Stop`] leave the surface what no other event takes.
#[test]
fn specular_surfaces_know_what_goes_on() {
    let scene = cut(&cornell_with(Boxes::Coat, false), 100);
    let patch = scene.patches().find(|&p| scene.material(p).name == "box").unwrap();
    let (specular, brdf) = (scene.specular(patch).unwrap(), scene.brdf(patch));
    for cosine in [0.05, 0.3, 0.7, 1.0] {
        let choices = specular.choices(cosine, false, brdf.albedo(cosine).max_channel(), true);
        assert_eq!(choices.choose(0.999_999).0, Event::Stop);
        let all = brdf.albedo(cosine) + specular.passed(cosine, false);
        assert!(all.max_channel() < 1.0, "a coat over a base of .7 absorbs: {all:?}");
    }
}

/// Whoever comes to the sky through a body of glass is in the air again, and so are its radiance and densities: otherwise rays
/// to the sky bring less of its light than rays from there.
#[test]
fn the_sky_behind_glass_is_seen_from_the_air() {
    let scene = cut(&cornell_with(Boxes::Glass, false), 500);
    // Boxes have no bottoms: from the floor, rays may start within.
    let is_wall = |n: DVec3| n.y < 0.5;
    let mut bent = 0;
    for patch in
        scene.patches().filter(|&p| is_wall(scene.normal(p)) && scene.passed_share(p, scene.normal(p)).is_black())
    {
        let (n, mut random) = (scene.normal(patch), Stream::new(3, 0, u64::from(patch.0)));
        for _ in 0..20 {
            let direction = DVec3::from_array(std::array::from_fn(|_| random.uniform() - 0.5)).normalize();
            let direction = if n.dot(direction) < 0.0 { -direction } else { direction };
            let arrival = scene.trace_through(Some(patch), scene.cell_centre(patch), direction, || random.uniform());
            if arrival.end == End::Sky {
                bent += u32::from(arrival.direction != direction);
                assert_eq!(arrival.index_ratio, 1.0, "from {patch:?} towards {direction}");
            }
        }
    }
    assert!(bent > 20, "only {bent} rays came through glass to the sky");
}

/// A floor under a large slab of glass, in the light of a far lamp 40° from above: (1 − F)/(1 + F) of it arrives, with
/// Schlick's F, and paths, which do not follow it to and fro within the slab, find (1 − F)².
#[test]
fn slabs_of_glass_let_the_sun_in() {
    let quad = |corners: [[f32; 3]; 4], material| Mesh {
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    };
    let slab = |y: f32, up: bool| {
        let (a, b) = (4.0, if up { -4.0 } else { 4.0 });
        quad([[-a, y, b], [-a, y, -b], [a, y, -b], [a, y, b]], 1)
    };
    let floor = quad([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]], 0);
    let mut scene = cornell_with(Boxes::Glass, true);
    let glass = scene.materials.iter().find(|m| m.name == "box").unwrap().clone();
    let transmission = Transmission { factor: 1.0, texture: None, volume: Some(Volume { attenuation: Rgb::BLACK }) };
    let black = Surface::Lambertian { reflectance: Texel::constant(Rgb::BLACK) };
    scene.materials = vec![
        Material { name: "floor".into(), surface: black, ..Material::default() },
        Material { transmission: Some(transmission), ..glass },
    ];
    scene.meshes = vec![floor, slab(2.0, false), slab(2.1, true)];
    let place = |mesh| Instance { name: String::new(), mesh, transform: DAffine3::IDENTITY };
    scene.instances = (0..3).map(place).collect();
    let towards = DVec3::new(40f64.to_radians().sin(), 40f64.to_radians().cos(), 0.0);
    scene.lights = vec![PunctualLight {
        name: "sun".into(),
        kind: LightKind::Directional,
        intensity: Rgb::grey(1000.0),
        transform: DAffine3::from_quat(DQuat::from_rotation_arc(-DVec3::Z, -towards)),
        profile: None,
    }];
    let scene = cut(&scene, 300);
    // The slab's faces must face away from it.
    let is_floor = |p| scene.material(p).name == "floor";
    let f = 0.04 + 0.96 * (1.0 - towards.y).powi(5);
    let arriving = 1000.0 * towards.y;

    let solved: Vec<f64> = (0..4)
        .map(|seed| {
            let mut solver = Solver::new(&scene, Params::default_preset(seed), None).unwrap();
            solver.run(400_000);
            mean_over(&scene, &solver.solution().patch_light(&scene), is_floor).value
        })
        .collect();
    let solved = Mean::of(&solved);
    let expected = arriving * (1.0 - f) / (1.0 + f);
    println!("solved {solved:?}, expected {expected:.2}; without glass {arriving:.2}");
    // Few rays of so wide a slab meet the floor.
    assert!((solved.value - expected).abs() < 5.0 * solved.error && solved.error < 0.02 * expected, "{solved:?}");
    let options = IrradianceOptions { paths_per_patch: 4, ..IrradianceOptions::default() };
    let traced = mean_over(&scene, &reference::irradiance(&scene, &options), is_floor).value;
    let expected = arriving * (1.0 - f).powi(2);
    assert!((traced / expected - 1.0).abs() < 1e-3, "{traced} against {expected}");
}
