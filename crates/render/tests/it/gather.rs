//! The final gather against the path tracer, and what must not depend on how it is run.

use twinray_render::reference::{self, PathPictureOptions};
use twinray_render::{Crop, Gather, GatherOptions, Picture};
use twinray_scene::{PatchScene, Rgb, Scene, builtin};
use twinray_solve::{Params, Solution, Solver};

use super::reference::cut;
use super::specular::{Boxes, cornell_with};

fn solved(scene: &PatchScene, rays: u64) -> Solution {
    let mut solver = Solver::new(scene, Params::default_preset(1), None).unwrap();
    solver.run(rays);
    solver.solution()
}

fn luminance(c: &[f32; 3]) -> f64 {
    Rgb::from_f32(*c).luminance()
}

/// Mean luminance of a block of pixels, without those that lights cover.
fn blocks(picture: &Picture, variance: &[f32], edge: usize) -> Vec<(f64, f64)> {
    let (width, height) = (picture.image.width as usize, picture.image.height as usize);
    let corners = (0..height / edge).flat_map(|y| (0..width / edge).map(move |x| (x * edge, y * edge)));
    let mean = |(x, y): (usize, usize)| {
        let pixels = (y..y + edge).flat_map(|y| (x..x + edge).map(move |x| y * width + x));
        let (sum, variance, n) =
            pixels.filter(|&i| picture.lights[i].1 == 0.0).fold((0.0, 0.0, 0.0), |(s, v, n), i| {
                (s + luminance(&picture.image.pixels[i]), v + f64::from(variance[i]), n + 1.0)
            });
        (sum / n, variance.sqrt() / n)
    };
    corners.map(mean).filter(|b| b.0.is_finite()).collect()
}

/// Compares a gather with paths: the picture's mean may be off by `bias` at most beside the noise of both, and no block
/// of pixels by more than `local`.
fn agrees(authored: &Scene, patches: usize, [bias, local]: [f64; 2], samples: f64, paths: u32) {
    let scene = cut(authored, patches);
    let solution = solved(&scene, 150 * scene.len() as u64);
    let (camera, width, height) = (&authored.cameras[0], 64, 64);
    let mut gather =
        Gather::new(&scene, &solution, camera, &GatherOptions { width, height, ..GatherOptions::default() });
    gather.advance_to(8.0);
    gather.advance_to(samples);
    let options = PathPictureOptions { width, height, samples: paths, seed: 5, ..PathPictureOptions::default() };
    let (traced, variance) = reference::picture(&scene, camera, &options);
    let gathered = blocks(&gather.picture(), &gather.variance(), 16);
    let traced = blocks(&traced, &variance, 16);
    let (mut sums, mut noise) = ([0.0; 2], [0.0; 2]);
    for (g, t) in gathered.iter().zip(&traced) {
        sums = [sums[0] + g.0, sums[1] + t.0];
        noise = [noise[0] + g.1 * g.1, noise[1] + t.1 * t.1];
        // 16 blocks a picture, and six pictures: 4.5 standard errors have a false-alarm rate of .07 % in all.
        let error = 4.5 * g.1.hypot(t.1);
        assert!(
            (g.0 - t.0).abs() < local * t.0 + error,
            "{}: a block has {:.5} ± {:.5}, by paths {:.5} ± {:.5}",
            authored.name,
            g.0,
            g.1,
            t.0,
            t.1
        );
    }
    let error = 4.0 * (noise[0] + noise[1]).sqrt() / sums[1];
    let off = sums[0] / sums[1] - 1.0;
    println!("{}: mean off by {:+.3} %, noise allows {:.3} %", authored.name, 100.0 * off, 100.0 * error);
    assert!(off.abs() < bias + error, "{}: the mean is off by {off}", authored.name);
    assert!(error < 0.03, "{}: too noisy to tell anything", authored.name);
}

#[test]
fn in_the_cornell_box() {
    agrees(&builtin::cornell(false), 8000, [0.01, 0.02], 64.0, 600);
}

/// Far ends whose lobes are followed, and lamps seen in a floor.
#[test]
fn in_the_hall() {
    agrees(&builtin::hall(), 20_000, [0.01, 0.04], 64.0, 600);
}

#[test]
fn with_mirrors_and_glass() {
    for boxes in [Boxes::Mirror, Boxes::Coat, Boxes::Panes, Boxes::Glass, Boxes::NearlyClear] {
        // What a mirror throws is found by chance alone: it takes many rays of both to know it.
        let (samples, paths) = if matches!(boxes, Boxes::Mirror) { (256.0, 2000) } else { (64.0, 1000) };
        agrees(&cornell_with(boxes, false), 8000, [0.01, 0.03], samples, paths);
    }
}

/// All that is emitted and reflected in a furnace is the same in every direction: what corners and contacts get wrong shows.
#[test]
fn a_furnace_is_even() {
    let authored = builtin::furnace(0.5, 1.0);
    let scene = cut(&authored, 3000);
    let solution = solved(&scene, 2_000_000);
    let options = GatherOptions { width: 48, height: 36, ..GatherOptions::default() };
    let mut gather = Gather::new(&scene, &solution, &authored.cameras[0], &options);
    gather.advance_to(64.0);
    let expected = 2.0 / std::f64::consts::PI;
    let ratios: Vec<f64> = gather.picture().image.pixels.iter().map(|pixel| f64::from(pixel[1]) / expected).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let spread = (ratios.iter().map(|r| (r - 1.0).powi(2)).sum::<f64>() / ratios.len() as f64).sqrt();
    println!("mean {mean:.5} of the furnace's radiance, pixels scatter by {:.2} %", 100.0 * spread);
    // Half of a pixel is emitted where it is seen; the other half scatters by some 2 % after 64 samples. Dark rims of contacts
    // would be some tens of percent off.
    assert!((mean - 1.0).abs() < 0.003 && spread < 0.03, "mean {mean}, spread {spread}");
    let worst = ratios.iter().fold(0.0, |w: f64, r| w.max((r - 1.0).abs()));
    assert!(worst < 0.15, "a pixel is {worst} off");
}

#[test]
fn threads_do_not_change_a_bit() {
    let authored = cornell_with(Boxes::Panes, false);
    let scene = cut(&authored, 2000);
    let solution = solved(&scene, 100_000);
    let picture = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let options = GatherOptions { width: 50, height: 41, ..GatherOptions::default() };
            let mut gather = Gather::new(&scene, &solution, &authored.cameras[0], &options);
            [8.0, 12.0, 20.0].iter().for_each(|&n| gather.advance_to(n));
            assert!((gather.samples() / 20.0 - 1.0).abs() < 0.01, "{} camera rays per pixel", gather.samples());
            (gather.picture().image, gather.variance(), gather.direct())
        })
    };
    let one = picture(1);
    assert_eq!(one, picture(2));
    assert_eq!(one, picture(7));
}

/// However small the film, and however little is wished for, a wish is fulfilled.
#[test]
fn small_films_get_on() {
    let authored = builtin::cornell(false);
    let scene = cut(&authored, 500);
    let solution = solved(&scene, 20_000);
    for (width, height) in [(1, 1), (3, 4), (17, 1), (40, 23)] {
        for adaptive in [true, false] {
            let options = GatherOptions { width, height, adaptive, ..GatherOptions::default() };
            let mut gather = Gather::new(&scene, &solution, &authored.cameras[0], &options);
            for step in 1..=200 {
                let before = gather.samples();
                let wish = (1.25 * before).clamp(8.0, 64.0);
                gather.advance_to(wish);
                assert!(gather.samples() > before, "{width}x{height}: nothing comes of a wish for {wish}");
                if gather.samples() >= 63.9 {
                    break;
                }
                assert!(step < 200);
            }
            assert!(gather.samples() < 72.0 || width * height < 256, "{}", gather.samples());
            assert!(gather.picture().image.pixels.iter().flatten().all(|c| c.is_finite()));
        }
    }
}

/// A part of the film shows what the whole shows there.
#[test]
fn crops_are_parts() {
    let authored = builtin::cornell(false);
    let scene = cut(&authored, 2000);
    let solution = solved(&scene, 400_000);
    let take = |crop| {
        let options = GatherOptions { width: 64, height: 64, crop, adaptive: false, ..GatherOptions::default() };
        let mut gather = Gather::new(&scene, &solution, &authored.cameras[0], &options);
        gather.advance_to(32.0);
        gather.picture().image
    };
    let (whole, part) = (take(None), take(Some(Crop { x: 19, y: 30, width: 21, height: 18 })));
    assert_eq!((part.width, part.height), (21, 18));
    let differs = |dx: u32, dy: u32| {
        let places = (0..18).flat_map(|y| (0..21).map(move |x| (x, y)));
        let (mut squares, mut sums) = (0.0, [0.0; 2]);
        for (x, y) in places {
            let (a, b) = (part.pixel(x, y).luminance(), whole.pixel(x + 19 + dx, y + 30 + dy).luminance());
            squares += (a - b).powi(2);
            sums = [sums[0] + a, sums[1] + b];
        }
        (squares, sums[0] / sums[1] - 1.0)
    };
    // Noise is all that differs: the means by less than a percent, and anything else than the right place by far more.
    let (squares, means) = differs(0, 0);
    println!("squares {squares}, beside {} and {}, means {means:+.4}", differs(2, 0).0, differs(0, 2).0);
    assert!(means.abs() < 0.01);
    assert!(squares < 0.5 * differs(2, 0).0 && squares < 0.5 * differs(0, 2).0);
}
