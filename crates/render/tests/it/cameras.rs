//! What lenses, wide projections and crops do to pictures.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_render::reference::{self, PathPictureOptions};
use twinray_render::{Crop, Gather, GatherOptions, Image, Picture, PictureOptions, render};
use twinray_scene::{Camera, Lens, PatchScene, Projection, Scene, builtin};
use twinray_solve::{Observer, Params, Solution, Solver};

use crate::reference::cut;

fn solved(scene: &PatchScene, camera: &Camera, rays: u64) -> Solution {
    let observer = Observer::new(scene, camera);
    let mut solver = Solver::new(scene, Params::default_preset(1), Some(observer)).unwrap();
    solver.run(rays);
    solver.solution()
}

fn solve_and_look(scene: &PatchScene, camera: &Camera, options: &PictureOptions) -> Picture {
    render(scene, &solved(scene, camera, 20_000), camera, options)
}

/// The window of a picture.
fn part<T: Copy>(all: &[T], width: u32, crop: Crop) -> Vec<T> {
    let rows = (crop.y..crop.y + crop.height).map(|y| (y * width + crop.x) as usize);
    rows.flat_map(|first| all[first..first + crop.width as usize].iter().copied()).collect()
}

#[test]
fn a_crop_is_that_part_of_the_whole_picture() {
    let crop = Crop { x: 9, y: 20, width: 17, height: 5 };
    let (width, height) = (40, 30);
    let authored = builtin::hall();
    let scene = cut(&authored, 3000);
    let lens = Some(Lens { radius: 0.05, focus: 4.0 });
    let camera = Camera { lens, ..authored.cameras[0].clone() };
    let solution = solved(&scene, &camera, 20_000);
    let options = PictureOptions { width, height, samples: 3, ..PictureOptions::default() };
    let whole = render(&scene, &solution, &camera, &options);
    let cropped = render(&scene, &solution, &camera, &PictureOptions { crop: Some(crop), ..options });
    assert_eq!((cropped.image.width, cropped.image.height), (17, 5));
    assert_eq!(cropped.image.pixels, part(&whole.image.pixels, width, crop));
    assert_eq!(cropped.lights, part(&whole.lights, width, crop));

    let options = PathPictureOptions { width, height, samples: 3, ..PathPictureOptions::default() };
    let (whole, variance) = reference::picture(&scene, &camera, &options);
    let options = PathPictureOptions { crop: Some(crop), ..options };
    let (cropped, cropped_variance) = reference::picture(&scene, &camera, &options);
    assert_eq!(cropped.image.pixels, part(&whole.image.pixels, width, crop));
    assert_eq!(cropped_variance, part(&variance, width, crop));
}

#[test]
fn crops_must_lie_on_the_film() {
    let crop = |x, y, width, height| Crop { x, y, width, height };
    assert!(crop(0, 0, 40, 30).lies_within(40, 30) && crop(39, 29, 1, 1).lies_within(40, 30));
    let bad = [crop(39, 0, 2, 1), crop(0, 30, 1, 1), crop(0, 0, 0, 1), crop(u32::MAX, 0, 2, 1)];
    assert!(bad.iter().all(|c| !c.lies_within(40, 30)));
}

/// A glowing unit square alone, seen from `DISTANCE` straight above.
fn square() -> (Scene, Camera) {
    let mut authored = builtin::plates(1.0);
    let lamp = authored.materials.iter().position(|m| !m.emission.is_black()).unwrap();
    let lamp = authored.meshes.iter().position(|m| m.material == lamp).unwrap();
    authored.instances.retain(|i| i.mesh == lamp);
    let patches = cut(&authored, 2);
    let (middle, normal) = (DVec3::new(0.5, 0.0, 0.5), patches.normal(twinray_scene::PatchId(0)));
    let height = patches.cell_centre(twinray_scene::PatchId(0)) + patches.centre();
    let middle = DVec3::new(middle.x, height.y, middle.z);
    let camera = Camera::look_at("c", middle + normal * DISTANCE, middle, DVec3::X, 0.0);
    let vertical_fov = 2.0 * (0.5 * FILM / DISTANCE).atan();
    (authored, Camera { projection: Projection::Perspective { vertical_fov }, ..camera })
}

const DISTANCE: f64 = 10.0;
/// Side of the film at that distance, and its pixels.
const FILM: f64 = 3.2;
const PIXELS: u32 = 64;

/// Variance of where the light of a picture is, along the columns, at the distance of the square.
fn spread(image: &Image) -> f64 {
    let x = |i: usize| ((i as u32 % PIXELS) as f64 + 0.5) / f64::from(PIXELS) * FILM;
    let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
        image.pixels.iter().enumerate().map(|(i, c)| f64::from(c[1]) * f(x(i))).sum()
    };
    let (n, mean, square) = (sum(&|_| 1.0), sum(&|x| x), sum(&|x| x * x));
    square / n - (mean / n).powi(2)
}

/// Out of focus a point becomes a disc of radius R |1 − d/f| at its distance d, of variance R²(1 − d/f)²/4 along an axis; it
/// adds to the square's 1/12 and the sixth of a pixel's square of the filter.
///
/// Some 4096 · 64 · .1 = 26,000 rays meet the square; a variance of so many has a standard deviation of less than
/// √(2/26,000) = .9 % of itself, however the light is spread. Four of them: one false alarm in 16,000.
#[test]
fn a_lens_blurs_as_its_aperture_and_focus_say() {
    let (authored, pinhole) = square();
    let scene = cut(&authored, 2);
    for (radius, focus) in [(0.0, 5.0), (0.5, DISTANCE), (0.5, 5.0), (0.3, 30.0)] {
        let camera = Camera { lens: Some(Lens { radius, focus }), ..pinhole.clone() };
        let blur = radius * (1.0 - DISTANCE / focus).abs();
        let expected = 1.0 / 12.0 + (FILM / f64::from(PIXELS)).powi(2) / 6.0 + blur * blur / 4.0;
        let options = PathPictureOptions { width: PIXELS, height: PIXELS, ..PathPictureOptions::default() };
        let traced = spread(&reference::picture(&scene, &camera, &options).0.image);
        let options = PictureOptions { width: PIXELS, height: PIXELS, samples: 64, ..PictureOptions::default() };
        let seen = spread(&solve_and_look(&scene, &camera, &options).image);
        let gathered = spread(&gather(&scene, &camera, PIXELS, 64.0).image);
        println!(
            "aperture {radius}, focus {focus}: traced {traced:.5}, seen {seen:.5}, gathered {gathered:.5}, expected {expected:.5}"
        );
        assert!((gathered / expected - 1.0).abs() < 0.036, "{gathered} against {expected}");
        assert!((traced / expected - 1.0).abs() < 0.036, "{traced} against {expected}");
        // Its points are evenly spread: better than independent ones.
        assert!((seen / expected - 1.0).abs() < 0.01, "{seen} against {expected}");
    }
}

/// A square picture by final gather.
fn gather(scene: &PatchScene, camera: &Camera, side: u32, samples: f64) -> Picture {
    let solution = solved(scene, camera, 100_000);
    let mut gather =
        Gather::new(scene, &solution, camera, &GatherOptions { width: side, height: side, ..GatherOptions::default() });
    gather.advance_to(samples);
    gather.picture()
}

/// The film beside the circle is black, and exposure does not take it for a dark surface: the two methods, which take
/// tiles for their logarithms, see the same mean of them but for noise.
#[test]
fn black_film_does_not_change_the_exposure() {
    let authored = builtin::cornell(true);
    let scene = cut(&authored, 2000);
    let camera = Camera { projection: Projection::Fisheye { angle: 2.5 }, ..authored.cameras[0].clone() };
    let gathered = gather(&scene, &camera, 32, 32.0);
    let options = PathPictureOptions { width: 32, height: 32, ..PathPictureOptions::default() };
    let traced = reference::picture(&scene, &camera, &options).0;
    let [a, b] = [&gathered, &traced].map(|p| p.log2_luminance.unwrap());
    println!("log2 luminance: gathered {a:.3}, traced {b:.3}");
    // A third of the tiles lie on the edge of the circle: half black, they would lower the mean by a third of a stop. The
    // noise of a tile is some percent, and so is what patches know.
    assert!((a - b).abs() < 0.1, "{a} and {b}");
    assert!(gathered.image.pixel(0, 0).is_black() && gathered.empty == 0.0);
}

/// In a furnace all directions are equal, and a fisheye sees a disc of them.
#[test]
fn wide_cameras_see_a_furnace_all_around() {
    let authored = builtin::furnace(0.5, 1.0);
    let scene = cut(&authored, 300);
    let expected = 1.0 / (PI * 0.5);
    let options = PathPictureOptions { width: 32, height: 32, ..PathPictureOptions::default() };
    let look = |projection| {
        let camera = Camera { projection, ..authored.cameras[0].clone() };
        let (picture, variance) = reference::picture(&scene, &camera, &options);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / variance.len() as f64;
        let value = mean(&mut picture.image.pixels.iter().map(|c| f64::from(c[1])));
        let error = (mean(&mut variance.iter().map(|v| f64::from(*v))) / variance.len() as f64).sqrt();
        println!("{projection:?}: {value:.5} ± {error:.5}");
        (picture, value, error)
    };
    let (panorama, mean, error) = look(Projection::Panorama);
    // Half of the radiance is emission, which no ray misses. Four standard errors: one false alarm in 16,000.
    assert!(panorama.image.pixels.iter().all(|c| f64::from(c[1]) > 0.5 * expected * (1.0 - 1e-6)));
    assert!((mean - expected).abs() < 4.0 * error);
    let (fisheye, mean, error) = look(Projection::Fisheye { angle: PI });
    assert_eq!([fisheye.image.pixel(0, 0), fisheye.image.pixel(31, 31)].map(|c| c.is_black()), [true; 2]);
    assert!(fisheye.image.pixel(16, 16).g > 0.5 * expected * (1.0 - 1e-6));
    // Pixels beyond the film would have got a part ½ − d, in pixels, of the light that falls d from the edge. The circle of
    // radius r touches the edge four times, with chords of 2√(2rd): ∫ 8 √(2rd) (½ − d) dd over half a pixel is lost.
    let r = 16.0f64;
    let lost = 8.0 * (2.0 * r).sqrt() * (0.5f64.powf(1.5) / 3.0 - 0.5f64.powf(2.5) * 2.0 / 5.0);
    let share = (PI * r * r - lost) / (4.0 * r * r);
    assert!((mean - expected * share).abs() < 4.0 * error, "{mean} against {}", expected * share);
    assert!(fisheye.empty == 0.0, "black film is not empty space");
}
