//! Pictures of scenes whose picture is known, and what smoothing must and must not do.

mod agreement;
mod aovs;
mod cameras;
mod flip;
mod gather;
mod reference;
mod specular;
mod walk;

use std::f64::consts::PI;

use twinray_render::{Picture, PictureOptions, render};
use twinray_scene::{PatchBudget, PatchOptions, PatchScene, Scene, builtin};
use twinray_solve::{Observer, Params, Solver};

fn picture(scene: &Scene, patches: usize, rays: u64, options: PictureOptions) -> Picture {
    let cut = PatchOptions { budget: PatchBudget::Count(patches), two_sided: false };
    let patches = PatchScene::new(scene, cut).unwrap();
    let camera = &scene.cameras[0];
    let observer = Observer::new(&patches, camera);
    let mut solver = Solver::new(&patches, Params::default_preset(1), Some(observer)).unwrap();
    solver.run(rays);
    render(&patches, &solver.solution(), camera, &options)
}

fn small(flat: bool) -> PictureOptions {
    PictureOptions { width: 64, height: 48, samples: 4, flat, ..PictureOptions::default() }
}

/// In a furnace everything has radiance 1/(π (1−ρ)): a block that stands in it is invisible, and a dark rim at a
/// contact, a leak or a hole would be the only thing to see.
#[test]
fn a_furnace_is_one_even_grey() {
    let expected = 1.0 / (PI * 0.5);
    let smooth = picture(&builtin::furnace(0.5, 1.0), 3000, 2_000_000, small(false));
    let spread = |p: &Picture| {
        let off = |c: &[f32; 3]| (f64::from(c[1]) / expected - 1.0).powi(2);
        (p.image.pixels.iter().map(off).sum::<f64>() / p.image.pixels.len() as f64).sqrt()
    };
    for pixel in &smooth.image.pixels {
        let ratio = f64::from(pixel[1]) / expected;
        // Half of the radiance is emission; the other half carries some 2 % of noise before smoothing.
        assert!((ratio - 1.0).abs() < 0.03, "a pixel of {ratio} times the furnace's radiance");
    }
    let flat = picture(&builtin::furnace(0.5, 1.0), 3000, 2_000_000, small(true));
    println!("RMS off the furnace's radiance: smooth {:.4}, flat {:.4}", spread(&smooth), spread(&flat));
    assert!(spread(&smooth) < 0.6 * spread(&flat), "smoothing must average noise");
}

/// Smoothing moves light between cells of one surface only, so the mean of a picture stays what it was.
#[test]
fn smoothing_keeps_the_mean_of_a_picture() {
    let mean = |p: &Picture| {
        p.image.pixels.iter().zip(&p.lights).map(|(c, (l, _))| f64::from(c[1] - l[1])).sum::<f64>()
            / p.image.pixels.len() as f64
    };
    for scene in [builtin::cornell(true), builtin::doorway()] {
        let (smooth, flat) = (
            mean(&picture(&scene, 8000, 2_000_000, small(false))),
            mean(&picture(&scene, 8000, 2_000_000, small(true))),
        );
        println!("{}: mean smooth {smooth:.5}, flat {flat:.5}", scene.name);
        assert!((smooth / flat - 1.0).abs() < 0.02, "{}: {smooth} against {flat}", scene.name);
    }
}

/// What a lamp's part of a pixel is, is told apart from what is reflected there.
#[test]
fn lights_are_a_part_of_their_pixels() {
    let p = picture(&builtin::cornell(false), 2000, 200_000, small(false));
    assert!(p.lights.iter().any(|(_, covered)| *covered == 1.0), "the lamp is in the picture");
    for (pixel, (light, covered)) in p.image.pixels.iter().zip(&p.lights) {
        assert!((0..3).all(|c| pixel[c] >= light[c] - 1e-5 && pixel[c].is_finite()));
        assert_eq!(*covered == 0.0, light[1] == 0.0);
    }
}

/// Who looks only after the solve sees the same lamps in the same floor: what an observer had summed up is sampled instead.
#[test]
fn lamps_shine_in_floors_whoever_was_expected() {
    let scene = builtin::hall();
    let cut = PatchOptions { budget: PatchBudget::Count(9_000), two_sided: false };
    let patches = PatchScene::new(&scene, cut).unwrap();
    let camera = &scene.cameras[0];
    let options = PictureOptions { width: 96, height: 54, samples: 64, ..PictureOptions::default() };
    let floor = |observer: Option<Observer>| {
        let mut solver = Solver::new(&patches, Params::default_preset(1), observer).unwrap();
        solver.run(3_000_000);
        let picture = render(&patches, &solver.solution(), camera, &options);
        // The lower third is floor, for the most part.
        let pixels = &picture.image.pixels[picture.image.pixels.len() * 2 / 3..];
        pixels.iter().map(|c| f64::from(c[1])).sum::<f64>() / pixels.len() as f64
    };
    let (expected, surprised) = (floor(Some(Observer::new(&patches, camera))), floor(None));
    println!("mean radiance of the floor: {expected:.3} with an observer, {surprised:.3} without");
    // Without lamps in lobes it is 2.1 % less; the noise of both is some .3 %.
    assert!((surprised / expected - 1.0).abs() < 0.01, "{surprised} against {expected}");
}
