//! What else is known of the pixels beside their radiance: for compositing, denoising and looking into a solution.
//!
//! [`aovs`] finds what the scene alone decides, for any method; direct and indirect light and errors are filled in by the
//! methods that know them. Not here: names of channels in files (format).

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchScene, Rgb};

use crate::film::{Crop, Film};
use crate::picture::{MOST_PASSED, first_side};
use crate::vertex::{Look, Step, Vertex};

/// Arbitrary output variables, each `[height, width]` if it is there, first row on top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    /// Albedo towards the camera of what is seen, times what mirrors and glass before it leave, linear Rec. 709; black
    /// where nothing is seen.
    pub albedo: Option<Vec<[f32; 3]>>,
    /// Shading normal in world space, on the side that is seen; shorter than 1 where a pixel sees several, 0 where nothing.
    pub normal: Option<Vec<[f32; 3]>>,
    /// Depth of what is seen, metres, see [`Camera::depth`]; [`Aovs::NO_DEPTH`] where nothing is.
    pub depth: Option<Vec<f32>>,
    /// Radiance of emitters and what surfaces reflect of light that comes straight from them, W·sr⁻¹·m⁻² (or nit).
    pub direct: Option<Vec<[f32; 3]>>,
    /// Radiance of what surfaces reflect of other light; with `direct` the whole radiance.
    pub indirect: Option<Vec<[f32; 3]>>,
    /// Number of the patch that the first sample of a pixel sees; [`Aovs::NO_PATCH`] where there is none.
    pub patch: Option<Vec<u32>>,
    /// Standard error of the pixel's luminance, W·sr⁻¹·m⁻² (or nit).
    pub error: Option<Vec<f32>>,
}

impl Aovs {
    /// Depth where nothing is seen: finite, so that filters survive it, and the value that Blender writes.
    pub const NO_DEPTH: f32 = 1e10;
    /// The patch where none is seen.
    pub const NO_PATCH: u32 = u32::MAX;
}

/// Settings of [`aovs`].
#[derive(Clone, Copy, Debug)]
pub struct AovOptions {
    /// Pixels in a row of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part of the film that is wanted, within it; `None` for all of it.
    pub crop: Option<Crop>,
    /// Camera rays per pixel; a picture of as many by `render` has the same rays, so that edges agree.
    pub samples: u32,
}

/// Purpose of the random numbers by which rays go through glass or are reflected.
const SPECULAR: u64 = 0xA0_5EE7;

/// Albedo, normal, depth and patch of what each pixel sees, in mirrors and through glass too: means over its samples, depths over those that see anything.
///
/// # Panics
/// If the crop is not within the film.
pub fn aovs(scene: &PatchScene, camera: &Camera, options: &AovOptions) -> Aovs {
    let film = Film::new(options.width, options.height, options.crop);
    let pixels: Vec<Seen> = (0..film.len())
        .into_par_iter()
        .map(|index| {
            let at = film.place(index);
            let mut sum = Seen::default();
            for k in 0..options.samples {
                let mut random = Stream::new(0, SPECULAR, film.number(at) << 32 | u64::from(k));
                let mut numbers = || random.uniform();
                let ray = film.sample(camera, at, k);
                let seen = ray.and_then(|(origin, direction)| seen(scene, camera, origin, direction, &mut numbers));
                sum.add(seen.as_ref(), k == 0);
            }
            sum
        })
        .collect();
    let n = f64::from(options.samples.max(1));
    Aovs {
        albedo: Some(pixels.iter().map(|p| (p.albedo / n).to_f32()).collect()),
        normal: Some(pixels.iter().map(|p| (p.normal / n).as_vec3().to_array()).collect()),
        depth: Some(pixels.iter().map(Seen::mean_depth).collect()),
        patch: Some(pixels.iter().map(|p| p.patch.unwrap_or(Aovs::NO_PATCH)).collect()),
        ..Aovs::default()
    }
}

/// What a ray sees, or sums over the rays of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    albedo: Rgb,
    normal: DVec3,
    depth: f64,
    hits: u32,
    patch: Option<u32>,
}

impl Seen {
    fn add(&mut self, other: Option<&Seen>, is_first: bool) {
        let Some(other) = other else { return };
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.depth += other.depth;
        self.hits += 1;
        if is_first {
            self.patch = other.patch;
        }
    }

    fn mean_depth(&self) -> f32 {
        if self.hits == 0 { Aovs::NO_DEPTH } else { (self.depth / f64::from(self.hits)) as f32 }
    }
}

/// What a ray of the world sees: the first point that scatters, in mirrors and through glass too.
fn seen(
    scene: &PatchScene,
    camera: &Camera,
    origin: DVec3,
    direction: DVec3,
    numbers: &mut impl FnMut() -> f64,
) -> Option<Seen> {
    let (mut hit, mut patch) = first_side(scene, origin - scene.centre(), direction)?;
    let (mut wo, mut throughput) = (-direction, Rgb::WHITE);
    let mut length = (scene.point_of(hit.triangle, hit.u, hit.v) + scene.centre() - origin).length();
    for _ in 0..MOST_PASSED {
        let vertex = Vertex::new(scene, &hit, patch, wo, Look::Display);
        match vertex.step(wo, numbers(), || [numbers(), numbers()]) {
            Step::End => return None,
            Step::Scatter(factor) => {
                let albedo = vertex.scatter.brdf.albedo(vertex.geometric.dot(wo).max(0.0));
                return Some(Seen {
                    albedo: throughput * albedo * factor,
                    normal: vertex.normal,
                    // Mirrors are unfolded: what they show lies behind them.
                    depth: camera.depth(origin + direction * length),
                    hits: 1,
                    patch: Some(patch.0),
                });
            }
            Step::On(way) => {
                throughput = throughput * way.factor;
                hit = vertex.next(scene, way.beyond, way.direction)?;
                patch = scene.patch_of(&hit)?;
                length += hit.t;
                wo = -way.direction;
            }
        }
    }
    None
}
