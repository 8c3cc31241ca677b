//! The paper's image: what each pixel sees of the patches' light, antialiased.
//!
//! Radiance of a point = emission + base reflectance · E/π + lobe towards the eye. Irradiance E and the lobe come
//! from the patches, smooth or flat; emission and colour from the materials at the point itself, so that no
//! texture is blurred. Paper: §1 (average over iterations, which the solution already is), §2.1.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use crate::image::Image;
use crate::reconstruct::Reconstruction;

/// Settings of a picture.
#[derive(Clone, Copy, Debug)]
pub struct PictureOptions {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Camera rays per pixel.
    pub samples: u32,
    /// Show the raw patches instead of smooth light.
    pub flat: bool,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, samples: 16, flat: false }
    }
}

/// A picture, and what automatic exposure needs to know of it.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Linear radiance.
    pub image: Image,
    /// Per pixel: the part of the radiance that comes straight from emitters and surroundings, and the share of the
    /// pixel that they cover. Displays clip these lights before they mix them with what is beside them, or their
    /// edges would be jagged.
    pub lights: Vec<([f32; 3], f32)>,
    /// Mean of log₂ luminance over camera rays that met a lit surface without emission; `None` if none did.
    pub log2_luminance: Option<f64>,
    /// Share of camera rays that met nothing.
    pub empty: f64,
}

/// One-sided backs that a camera ray passes at most.
const MOST_BACKS: u32 = 16;

/// Takes a picture of `solution`. The glossy part is that of the observer which the solver was given.
pub fn render(scene: &PatchScene, solution: &Solution, camera: &Camera, options: &PictureOptions) -> Picture {
    let reconstruction = Reconstruction::new(scene, solution);
    let aspect = f64::from(options.width) / f64::from(options.height);
    let rows: Vec<(Vec<Pixel>, Light)> = (0..options.height)
        .into_par_iter()
        .map(|y| {
            let mut light = Light::default();
            let row = (0..options.width)
                .map(|x| {
                    let (mut sum, mut lights, mut covered) = (Rgb::BLACK, Rgb::BLACK, 0.0);
                    for k in 0..options.samples {
                        let [dx, dy] = film_offset(options, x, y, k);
                        let (px, py) = (f64::from(x) + dx, f64::from(y) + dy);
                        let (origin, direction) =
                            camera.ray(px / f64::from(options.width), py / f64::from(options.height), aspect);
                        let (reflected, direct) =
                            seen(scene, &reconstruction, options, origin - scene.centre(), direction, &mut light);
                        sum += reflected + direct;
                        lights += direct;
                        covered += if direct.is_black() { 0.0 } else { 1.0 };
                    }
                    let n = f64::from(options.samples);
                    ((sum / n).to_f32(), ((lights / n).to_f32(), (covered / n) as f32))
                })
                .collect();
            (row, light)
        })
        .collect();
    let mut total = Light::default();
    let count = options.width as usize * options.height as usize;
    let (mut pixels, mut lights) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for (row, light) in rows {
        for (pixel, direct) in row {
            pixels.push(pixel);
            lights.push(direct);
        }
        total.add(&light);
    }
    Picture {
        image: Image { width: options.width, height: options.height, pixels },
        lights,
        log2_luminance: (total.lit > 0).then(|| total.log2_sum / total.lit as f64),
        empty: total.empty as f64 / total.rays.max(1) as f64,
    }
}

/// Place of a sample within and around its pixel: stratified, spread by a tent of one pixel's radius.
fn film_offset(options: &PictureOptions, x: u32, y: u32, k: u32) -> [f64; 2] {
    let pixel = u64::from(y) * u64::from(options.width) + u64::from(x);
    let mut jitter = Stream::new(0, 0xF11A, pixel);
    // An additive recurrence (R2), shifted at random per pixel, is even for any number of samples.
    let place = |step: f64, shift: f64| (f64::from(k) * step + shift).fract();
    let u = [place(0.754_877_666_246_692_7, jitter.uniform()), place(0.569_840_290_998_053_3, jitter.uniform())];
    u.map(|u| 0.5 + if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() })
}

/// Radiance, and of it the lights' part with their coverage.
type Pixel = ([f32; 3], ([f32; 3], f32));

#[derive(Clone, Copy, Debug, Default)]
struct Light {
    rays: u64,
    empty: u64,
    lit: u64,
    log2_sum: f64,
}

impl Light {
    fn add(&mut self, other: &Light) {
        self.rays += other.rays;
        self.empty += other.empty;
        self.lit += other.lit;
        self.log2_sum += other.log2_sum;
    }
}

/// Reflected and directly emitted radiance of what a camera ray meets.
fn seen(
    scene: &PatchScene,
    reconstruction: &Reconstruction,
    options: &PictureOptions,
    origin: DVec3,
    direction: DVec3,
    light: &mut Light,
) -> (Rgb, Rgb) {
    light.rays += 1;
    let Some((hit, patch)) = first_side(scene, origin, direction) else {
        light.empty += 1;
        return (Rgb::BLACK, scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction)));
    };
    let smooth = if options.flat { reconstruction.flat(patch) } else { reconstruction.smooth(patch, &hit) };
    let brdf = scene.brdf_of(hit.triangle, scene.color_at(hit.triangle, hit.u, hit.v));
    let cosine = scene.normal(patch).dot(-direction).max(0.0);
    let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
    // The lobe of a single patch may be negative in the paper's representation; a picture never is.
    let reflected = (smooth.irradiance * brdf.base_reflectance(cosine) / PI + smooth.lobe).map(|c| c.max(0.0));
    if emitted.is_black() && reflected.luminance() > 0.0 {
        light.lit += 1;
        light.log2_sum += libm::log2(reflected.luminance());
    }
    (reflected, emitted)
}

/// The first side that scatters: one-sided surfaces are not seen from behind, as glTF has it.
fn first_side(scene: &PatchScene, mut origin: DVec3, direction: DVec3) -> Option<(SurfaceHit, PatchId)> {
    for _ in 0..MOST_BACKS {
        let hit = scene.trace(origin, direction)?;
        if let Some(patch) = scene.patch_of(&hit) {
            return Some((hit, patch));
        }
        origin += direction * (hit.t * (1.0 + 1e-6) + 1e-6 * scene.radius());
    }
    None
}
