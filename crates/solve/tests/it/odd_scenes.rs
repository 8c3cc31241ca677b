//! Scenes at the ends of what there can be: black, empty, without light, without loss, lamps that shine on nothing.

use std::f64::consts::PI;
use std::time::Instant;

use glam::{DAffine3, DQuat, DVec3, dvec3};
use twinray_scene::{Material, PatchBudget, PatchError, PatchOptions, PatchScene, Rgb, Scene, builtin};
use twinray_solve::{Params, Solution, SolveError, Solver};

use super::build::{lamp, matte, placed, quad};
use super::{cut, solve};

/// Irradiance at a point of the upper plate: π L times the point's form factor to the lower one, Lambert's sum over
/// the edges of the polygon.
fn lambert(point: DVec3, normal: DVec3, polygon: &[DVec3], radiance: f64) -> f64 {
    let edges = (0..polygon.len()).map(|i| {
        let (a, b) = ((polygon[i] - point).normalize(), (polygon[(i + 1) % polygon.len()] - point).normalize());
        a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize().dot(normal)
    });
    0.5 * radiance * edges.sum::<f64>().abs()
}

/// Nothing reflects: what is left is direct light, which is known for every patch.
#[test]
fn a_black_scene_has_direct_light_and_no_other() {
    let scene = cut(&builtin::plates(1.0), 400);
    let corner = |x: f64, z: f64| dvec3(x, 0.0, z) - scene.centre();
    let emitter = [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, 0.0)];
    let rays = 2_000_000;
    for params in [Params::default_preset(1), Params::paper_preset(1)] {
        let solution = solve(&scene, params, rays);
        let (mut squares, mut expected_squares, mut worst) = (0.0, 0.0, 0.0f64);
        for p in scene.patches() {
            let e = solution.irradiance(p).luminance();
            if !scene.emission(p).is_black() {
                assert_eq!(e, 0.0, "nothing shines back");
                continue;
            }
            // Mean of the exact irradiance over the cell.
            let place = |k: u32| (f64::from(k) + 0.5) / 4.0;
            let points = (0..16).map(|k| scene.cell_point(p, place(k / 4), place(k % 4)));
            let exact = points.map(|x| lambert(x, scene.normal(p), &emitter, 1.0 / PI)).sum::<f64>() / 16.0;
            // F1 of independent rays: relative variance P/(NΦ); emitted power is 1 W.
            let variance = 1.0 / (rays as f64 * exact * scene.area(p));
            squares += (e / exact - 1.0).powi(2);
            expected_squares += variance;
            worst = worst.max((e / exact - 1.0).abs() / variance.sqrt());
        }
        println!("χ² over its expectation {:.3}, worst {worst:.2} standard deviations", squares / expected_squares);
        // 200 patches: the ratio has a standard deviation of √(2/200) = .1 for independent rays; stratified ones
        // vary less. The worst of 200 is beyond 5 one time in ten thousand.
        assert!(squares / expected_squares < 1.4 && worst < 5.0, "{squares} {expected_squares} {worst}");
    }
}

fn none_arrives(scene: &PatchScene, solution: &Solution) {
    for p in scene.patches() {
        assert_eq!(solution.irradiance(p), Rgb::BLACK, "patch {p:?}");
    }
    let b = solution.balance();
    assert_eq!((b.absorbed, solution.invalid_deposits()), (0.0, 0));
    assert!((b.emitted - scene.emitted_power().luminance()).abs() < 1e-6 * b.emitted, "{b:?}");
    // A tenth of the rays starts evenly, dark patches among them. Choices are stratified, so in each of a dozen waves
    // the lamp's share of rays is right to about one ray: a dozen of at least 1e4, 2e5 in all.
    assert!(((b.escaped + b.lost) / b.emitted - 1.0).abs() < 1e-4, "{b:?}");
}

/// A lamp and nothing else; one triangle; and two in one plane that face the same way, wherever they are.
#[test]
fn lamps_that_shine_on_nothing_get_nothing_back() {
    let mut square = Scene::default();
    quad(&mut square, lamp(3.0), DVec3::ZERO, DVec3::X, DVec3::Y);
    let mut pair = square.clone();
    quad(&mut pair, Material { emission: Rgb::WHITE, ..matte(0.9) }, dvec3(1.0, 0.0, 0.0), 5.0 * DVec3::X, DVec3::Y);
    let mut triangle = square.clone();
    triangle.meshes[0].triangles.pop();
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_x(0.7), dvec3(1e5, -3.0, 1e4));
    for scene in [&square, &pair, &triangle] {
        for place in [DAffine3::IDENTITY, turn * DAffine3::from_quat(DQuat::from_rotation_z(1.0))] {
            for params in [Params::default_preset(1), Params::paper_preset(1)] {
                let scene = cut(&placed(scene.clone(), place), 50);
                let solution = solve(&scene, params, 200_000);
                none_arrives(&scene, &solution);
                assert_eq!(solution.balance().lost, 0.0, "rays from a plane do not meet it");
            }
        }
    }
}

/// A single triangle may be a whole scene; no triangle is none.
#[test]
fn one_triangle_is_a_scene_and_none_is_not() {
    let mut scene = Scene::default();
    let options = PatchOptions { budget: PatchBudget::Count(1), two_sided: false };
    assert_eq!(PatchScene::new(&scene, options).unwrap_err(), PatchError::Empty);
    quad(&mut scene, lamp(1.0), DVec3::ZERO, DVec3::X, DVec3::Y);
    scene.meshes[0].triangles.clear();
    assert_eq!(PatchScene::new(&scene, options).unwrap_err(), PatchError::Empty);
    scene.meshes[0].triangles.push([0, 1, 2]);
    let scene = cut(&scene, 1);
    assert_eq!(scene.len(), 1);
    none_arrives(&scene, &solve(&scene, Params::default_preset(1), 10_000));
}

#[test]
fn without_a_lamp_there_is_an_error_that_says_so() {
    let mut scene = Scene::default();
    quad(&mut scene, matte(0.5), DVec3::ZERO, DVec3::X, DVec3::Y);
    let dark = cut(&scene, 10);
    // A sky of no radiance is no light either.
    scene.environment = Some(twinray_scene::Environment::Uniform(Rgb::BLACK));
    for scene in [dark, cut(&scene, 10)] {
        for params in [Params::default_preset(1), Params::paper_preset(1)] {
            let error = Solver::new(&scene, params, None).unwrap_err();
            assert_eq!(error, SolveError::NoLight);
            assert!(error.to_string().contains("no light"), "{error}");
        }
    }
}

/// The back of a one-sided wall absorbs: what lies before the wall stays dark, and the loss is counted.
#[test]
fn a_lamp_behind_a_one_sided_wall_is_lost() {
    let mut scene = Scene::default();
    // A lamp that faces up, a wall that faces up over all of it, and a ceiling that faces down.
    quad(&mut scene, lamp(1.0), dvec3(0.4, 0.0, 0.4), dvec3(0.0, 0.0, 0.2), dvec3(0.2, 0.0, 0.0));
    quad(&mut scene, matte(0.8), dvec3(-50.0, 0.1, -50.0), dvec3(0.0, 0.0, 101.0), dvec3(101.0, 0.0, 0.0));
    quad(&mut scene, matte(0.8), dvec3(0.0, 1.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, 1.0));
    for params in [Params::default_preset(1), Params::paper_preset(1)] {
        let scene = cut(&scene, 100);
        let solution = solve(&scene, params, 200_000);
        none_arrives(&scene, &solution);
        let balance = solution.balance();
        // The wall covers all but 1e-5 of the lamp's hemisphere: (0.1 m / 50 m)² of it is beside the wall.
        assert!(balance.lost_share() > 0.9998, "{balance:?}");
    }
}

/// A closed room that absorbs nothing has no solution: light would pile up for ever. The solver ends all the same,
/// with finite numbers and a balance that says that the light went nowhere.
#[test]
fn a_closed_room_without_loss_ends_and_is_flagged() {
    let authored = builtin::furnace(1.0, 1.0);
    assert_eq!(authored.validate(), [], "an albedo of exactly 1 is allowed");
    let scene = cut(&authored, 500);
    let start = Instant::now();
    for params in [Params::default_preset(1), Params::paper_preset(1)] {
        let solution = solve(&scene, params, 200_000);
        assert!(scene.patches().all(|p| solution.irradiance(p).is_finite()));
        let balance = solution.balance();
        println!("{balance:?}, residual {}, after {:?}", balance.residual(), start.elapsed());
        assert!(balance.residual() < -0.99, "nothing was absorbed: {balance:?}");
        assert_eq!(solution.invalid_deposits(), 0);
    }
    // Minutes, if the warm start went on as long as there is light. Generous: tests share the machine.
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}
