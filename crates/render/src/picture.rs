//! The paper's image: what each pixel sees of the patches' light, antialiased.
//!
//! Radiance of a point = emission + base reflectance · E/π + lobe towards the eye. Irradiance E and the lobe come
//! from the patches, smooth or flat; emission and colour from the materials at the point itself, so that no
//! texture is blurred. Paper: §1 (average over iterations, which the solution already is), §2.1.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::brdf::{Detail, attenuated};
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use crate::direct::{Shadows, direct, weights};
use crate::film::{Crop, Film};
use crate::image::Image;
use crate::lights::Lights;
use crate::reconstruct::Reconstruction;
use crate::vertex::{Look, Step, Vertex};

/// Settings of a picture.
#[derive(Clone, Copy, Debug)]
pub struct PictureOptions {
    /// Pixels in a row of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part of the film that is wanted, within it; `None` for all of it.
    pub crop: Option<Crop>,
    /// Camera rays per pixel.
    pub samples: u32,
    /// Show the raw patches instead of smooth light.
    pub flat: bool,
    /// How the lobes of glossy surfaces are shown; `flat` always shows what the patches remember.
    pub lobes: Lobes,
}

/// Where the light in a lobe comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lobes {
    /// All from the patches: what each hit sent to the eye. No finer than the cells.
    Patches,
    /// Light straight from emitters from the patches (a ray would seldom meet a lamp, and then too brightly), all
    /// other by one ray into the lobe per camera ray, which takes the solution's light where it ends.
    #[default]
    Traced,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, crop: None, samples: 16, flat: false, lobes: Lobes::Traced }
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

/// A ray into a lobe counts for at most so many times what the patches know of the lobe: the mean of its hits, or
/// what it would reflect of evenly distributed light.
const FIREFLY: f64 = 6.0;
/// Candidates for the lamp that a camera ray sees in a lobe, where no observer summed lamps up.
const LAMPS: u32 = 16;
/// Mirrors and sheets of glass that a camera ray passes at most.
pub(crate) const MOST_PASSED: u32 = 32;
/// One-sided backs that a camera ray passes at most.
const MOST_BACKS: u32 = 16;

/// Takes a picture of `solution`. The glossy part is that of the observer which the solver was given.
///
/// # Panics
/// If the crop is not within the film.
pub fn render(scene: &PatchScene, solution: &Solution, camera: &Camera, options: &PictureOptions) -> Picture {
    let reconstruction = Reconstruction::new(scene, solution);
    let traced = !options.flat && options.lobes == Lobes::Traced && solution.splits_direct_light();
    let lamps = (traced && !solution.is_observed()).then(|| Lights::new(scene));
    let view = View { scene, reconstruction, flat: options.flat, traced, lamps };
    let film = Film::new(options.width, options.height, options.crop);
    let window = film.window;
    let rows: Vec<(Vec<Pixel>, Light)> = (window.y..window.y + window.height)
        .into_par_iter()
        .map(|y| {
            let mut light = Light::default();
            let row = (window.x..window.x + window.width)
                .map(|x| {
                    let (mut sum, mut lights, mut covered) = (Rgb::BLACK, Rgb::BLACK, 0.0);
                    for k in 0..options.samples {
                        let Some((origin, direction)) = film.sample(camera, [x, y], k) else { continue };
                        let u = LobeNumbers::new(film.number([x, y]), options.samples, k);
                        let (reflected, direct) = view.seen(origin - scene.centre(), direction, u, &mut light);
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
    let (mut pixels, mut lights) = (Vec::with_capacity(film.len()), Vec::with_capacity(film.len()));
    for (row, light) in rows {
        for (pixel, direct) in row {
            pixels.push(pixel);
            lights.push(direct);
        }
        total.add(&light);
    }
    Picture {
        image: Image { width: window.width, height: window.height, pixels },
        lights,
        log2_luminance: (total.lit > 0).then(|| total.log2_sum / total.lit as f64),
        empty: total.empty as f64 / total.rays.max(1) as f64,
    }
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

/// Numbers for a camera ray's ray into the lobe: even over the pixel's samples.
struct LobeNumbers {
    place: [f64; 2],
    /// Which ray of which pixel, for numbers that need not be even.
    index: u64,
}

impl LobeNumbers {
    /// Of sample `k` of `samples` of a pixel, by its number on the whole film.
    fn new(pixel: u64, samples: u32, k: u32) -> Self {
        let mut shift = Stream::new(0, 0x10BE, pixel);
        let n = f64::from(samples);
        let stratum = (f64::from(k) + 0.5) / n + shift.uniform();
        let place = [stratum.fract(), (f64::from(k) * 0.618_033_988_749_894_9 + shift.uniform()).fract()];
        Self { place, index: pixel * u64::from(samples) + u64::from(k) }
    }
}

/// What camera rays look at.
struct View<'a> {
    scene: &'a PatchScene,
    reconstruction: Reconstruction<'a>,
    flat: bool,
    traced: bool,
    /// What emits, where the patches do not know what their lobes send to the eye.
    lamps: Option<Lights<'a>>,
}

impl View<'_> {
    /// Reflected and directly emitted radiance of what a camera ray meets, in mirrors and through glass too.
    fn seen(&self, origin: DVec3, direction: DVec3, u: LobeNumbers, light: &mut Light) -> (Rgb, Rgb) {
        let scene = self.scene;
        light.rays += 1;
        let sky = |direction| scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction));
        let Some((mut hit, mut patch)) = first_side(scene, origin, direction) else {
            light.empty += 1;
            return (Rgb::BLACK, sky(direction));
        };
        let (mut wo, mut throughput, mut emitted, mut medium) = (-direction, Rgb::WHITE, Rgb::BLACK, None);
        let mut random = Stream::new(0, 0x57E9, u.index);
        for _ in 0..MOST_PASSED {
            if let Some(coefficient) = scene.medium_before(&hit, medium) {
                throughput = throughput * attenuated(coefficient, hit.t);
            }
            emitted += throughput * scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            let vertex = Vertex::new(scene, &hit, patch, wo, Look::Display);
            let way = match vertex.step(wo, random.uniform(), || [random.uniform(), random.uniform()]) {
                Step::End => return (Rgb::BLACK, emitted),
                Step::Scatter(factor) => {
                    let reflected = throughput * factor * self.reflected(&vertex, &hit, wo, &u);
                    if emitted.is_black() && reflected.luminance() > 0.0 {
                        light.lit += 1;
                        light.log2_sum += libm::log2(reflected.luminance());
                    }
                    return (reflected, emitted);
                }
                Step::On(way) => way,
            };
            (throughput, medium) = (throughput * way.factor, way.medium);
            let Some(next) = vertex.next(scene, way.beyond, way.direction) else {
                return (Rgb::BLACK, emitted + throughput * sky(way.direction));
            };
            let Some(there) = scene.patch_of(&next) else { return (Rgb::BLACK, emitted) };
            (hit, patch, wo) = (next, there, -way.direction);
        }
        (Rgb::BLACK, emitted)
    }

    /// Radiance that a point reflects towards `wo`: its base and its lobe.
    fn reflected(&self, vertex: &Vertex, hit: &SurfaceHit, wo: DVec3, u: &LobeNumbers) -> Rgb {
        let Vertex { patch, geometric, scatter, .. } = *vertex;
        let brdf = scatter.brdf;
        let smooth = if self.flat { self.reconstruction.flat(patch) } else { self.reconstruction.smooth(patch, hit) };
        let cosine = geometric.dot(wo).max(0.0);
        let lobe = match self.traced && brdf.is_glossy() {
            true => {
                // What the patches know bounds a single ray: a rare bright hit would be a white dot.
                let even = (smooth.irradiance * brdf.lobe_albedo(cosine)).luminance() / PI;
                let limit = FIREFLY * smooth.lobe[1].luminance().max(even);
                let (traced, met) = self.lobe_ray(vertex, wo, u.place);
                let direct = match &self.lamps {
                    None => smooth.lobe[0],
                    Some(lamps) => {
                        let mut random = Stream::new(0, 0x1A39, u.index);
                        let numbers = || [random.uniform(), random.uniform()];
                        let shadows = Shadows { choice: lamps.by_power(), candidates: LAMPS };
                        let lobe = brdf.lobe_towards(vertex.normal, wo);
                        met + direct(self.scene, lamps, vertex, &lobe, |d| lobe.pdf(d), shadows, numbers).0
                    }
                };
                direct + traced * (limit / traced.luminance().max(1e-300)).min(1.0)
            }
            false => smooth.lobe[0] + smooth.lobe[1],
        };
        // The lobe of a single patch may be negative in the paper's representation; a picture never is.
        (smooth.irradiance * brdf.base_reflectance(cosine) / PI + lobe).map(|c| c.max(0.0))
    }

    /// One sample of the lobe's reflection of everything but what emits; and, weighed against [`direct`], of what emits
    /// where the ray ends.
    fn lobe_ray(&self, vertex: &Vertex, wo: DVec3, u: [f64; 2]) -> (Rgb, Rgb) {
        let scene = self.scene;
        let nothing = (Rgb::BLACK, Rgb::BLACK);
        let Vertex { patch, point, normal: n, geometric, scatter, .. } = vertex;
        let brdf = &scatter.brdf;
        let above = |wi: &DVec3| geometric.dot(*wi) > 0.0;
        let Some(wi) = brdf.lobe_sample(*n, wo, u).filter(above) else { return nothing };
        let density = brdf.lobe_pdf(*n, wo, wi);
        let weight = brdf.lobe_eval(*n, wi, wo) * (n.dot(wi) / density);
        let balanced = |other: f64| weights(f64::from(LAMPS) * other, density)[1];
        let Some(far) = scene.trace_from(*patch, *point, wi) else {
            let sky = weight * scene.environment().map_or(Rgb::BLACK, |e| e.radiance(wi));
            return match &self.lamps {
                None => (sky, Rgb::BLACK),
                Some(lamps) => (Rgb::BLACK, sky * balanced(lamps.sky_density(wi))),
            };
        };
        let Some(there) = scene.patch_of(&far) else { return nothing };
        let met = self.lamps.as_ref().map_or(Rgb::BLACK, |lamps| {
            let emitted = scene.emission_at(far.triangle, far.side, far.u, far.v);
            let other = lamps.density(*point, there, scene.point_of(far.triangle, far.u, far.v));
            weight * emitted * balanced(other)
        });
        // What the far end reflects, its own lobe as if it were diffuse, and mirrors too.
        let scatter = scene.scatter_at(&far, Detail::Picture);
        let mirrored = scatter.specular.map_or(Rgb::BLACK, |s| s.passed(0.5, false));
        let light = self.reconstruction.smooth(there, &far).irradiance * (scatter.brdf.mean_albedo() + mirrored) / PI;
        (weight * light, met)
    }
}

/// The first side that scatters: one-sided surfaces are not seen from behind, as glTF has it.
pub(crate) fn first_side(scene: &PatchScene, mut origin: DVec3, direction: DVec3) -> Option<(SurfaceHit, PatchId)> {
    for _ in 0..MOST_BACKS {
        let hit = scene.trace(origin, direction)?;
        if let Some(patch) = scene.patch_of(&hit) {
            return Some((hit, patch));
        }
        origin += direction * (hit.t * (1.0 + 1e-6) + 1e-6 * scene.radius());
    }
    None
}
