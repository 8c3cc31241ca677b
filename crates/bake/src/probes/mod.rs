//! An irradiance volume: the light in free space at the points of a grid, for objects that move through it.
//!
//! `grid` says where probes are, `place` which of them are in the open and moves those that are not, `reach` how far each
//! sees towards its neighbours, `fill` gives those that stay within bodies the light of their own side, `harmonics` is
//! the light of one probe, `lookup` reads the volume as a consumer is to.

mod fill;
mod grid;
mod harmonics;
mod lookup;
mod place;
mod reach;

use rayon::prelude::*;
use twinray_render::RadianceGather;
use twinray_scene::{PatchScene, Rgb};
use twinray_solve::Solution;

use crate::watch::{Stage, Watch, pace};

pub use grid::{NEIGHBOURS, ProbeError, ProbeGrid, ProbeSpacing, neighbours};
pub use harmonics::{HARMONICS, Harmonics};
use place::Place;

/// Probes between two looks at who may want to stop, at most.
const BATCH: usize = 256;

/// Settings of [`bake_probes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeOptions {
    /// How far probes are apart.
    pub spacing: ProbeSpacing,
    /// Rays of each probe, evenly over the sphere; each has a shadow ray.
    pub rays: u32,
    /// Whether light straight from lights without area is in the probes: not where a renderer lights moving objects with
    /// them by itself.
    pub punctual: bool,
    /// Of the rays.
    pub seed: u64,
}

impl Default for ProbeOptions {
    fn default() -> Self {
        Self { spacing: ProbeSpacing::Default, rays: 512, punctual: true, seed: 1 }
    }
}

/// The light in a grid of points. Arrays are `[z, y, x]`, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeVolume {
    /// Where probes are.
    pub grid: ProbeGrid,
    /// Radiance that arrives, as factors of spherical harmonics; of probes within bodies that of their own side.
    pub radiance: Vec<Harmonics>,
    /// Share of the probe's rays that meet no dark back, where it was moved to; 0 of probes within bodies.
    pub validity: Vec<f32>,
    /// Way from the point of the grid to where the light was taken, metres.
    pub offset: Vec<[f32; 3]>,
    /// From where the light was taken, for each of the [`neighbours`]: how far it is away over the free distance in its
    /// direction; 0 where nothing was met at all, above 1 where something is in between.
    pub nearness: Vec<[f32; NEIGHBOURS]>,
}

/// Bakes the light of `solution`, the solution of `patches`, into the points of a grid.
///
/// The result depends on these values alone, not on threads.
///
/// # Errors
/// If the spacing is no length, or asks for too many probes; [`ProbeError::Cancelled`] if `watch` stops it.
pub fn bake_probes(
    patches: &PatchScene,
    solution: &Solution,
    options: &ProbeOptions,
    watch: &mut Watch<'_>,
) -> Result<ProbeVolume, ProbeError> {
    let grid = ProbeGrid::new(patches, options.spacing)?;
    let gather = RadianceGather::new(patches, solution);
    let places: Vec<Place> =
        (0..grid.len()).into_par_iter().map(|probe| place::place(patches, solution, &grid, probe)).collect();
    let light = |probe: usize| {
        let mut sum = [Rgb::BLACK; HARMONICS];
        if places[probe].validity > 0.0 {
            let ProbeOptions { rays, punctual, seed, .. } = *options;
            let point = places[probe].point - patches.centre();
            gather.over_sphere(point, rays, punctual, seed, probe as u64, |towards, light| {
                let basis = twinray_render::walk::basis(towards);
                sum.iter_mut().zip(basis).for_each(|(s, b)| *s += light * b);
            });
        }
        Harmonics::from_rgb(sum)
    };
    let mut radiance: Vec<Harmonics> = Vec::with_capacity(places.len());
    let size = pace(options.rays as usize, BATCH);
    while radiance.len() < places.len() {
        let batch = radiance.len()..(radiance.len() + size).min(places.len());
        radiance.par_extend(batch.into_par_iter().map(light));
        watch(Stage::Probes, radiance.len() as f64 / places.len() as f64)?;
    }
    fill::fill(patches, &grid, &places, &mut radiance);
    let nearness = places.par_iter().map(|place| reach::nearness(patches, &grid, place.point)).collect();
    let offset = places.iter().enumerate().map(|(i, p)| (p.point - grid.point(i)).as_vec3().to_array()).collect();
    let validity = places.iter().map(|p| p.validity as f32).collect();
    Ok(ProbeVolume { grid, radiance, validity, offset, nearness })
}

impl ProbeVolume {
    /// Irradiance over π for the normals +x, +y, +z, −x, −y, −z, per probe: what a white matte surface sends out, and what
    /// an ambient cube holds. Nowhere negative.
    pub fn ambient_cubes(&self) -> Vec<[[f32; 3]; 6]> {
        let axes = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z];
        let cube = |light: &Harmonics| {
            std::array::from_fn(|k| {
                let normal = if k < 3 { axes[k] } else { -axes[k - 3] };
                (light.irradiance(normal) / std::f64::consts::PI).to_f32()
            })
        };
        self.radiance.iter().map(cube).collect()
    }
}
