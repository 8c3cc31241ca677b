//! The light at a point of a surface, as texels and vertices ask for it.

use std::ops::Range;

use twinray_render::{IrradianceGather, Reconstruction};
use twinray_scene::{PatchScene, Rgb, Side, SurfaceHit};
use twinray_solve::Solution;

use crate::texels::PagePoint;

/// A surface closer than this share of a cell's side covers a point.
const TOUCHING: f64 = 0.02;

/// Reconstruction at a point takes as long as about so many rays, neighbours that are looked for among them.
const SMOOTH: usize = 30;

/// Whence the light of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// The mean of its cell: what arrived there, as it is.
    Cells,
    /// Smooth between cells of the same surface that see each other.
    Smooth,
    /// So many rays gather it anew from all that the solution knows.
    Gathered(u32),
}

/// The light of a solution at any point.
pub struct SurfaceLight<'a> {
    patches: &'a PatchScene,
    source: Source<'a>,
    seed: u64,
}

enum Source<'a> {
    Cells(&'a Solution),
    Smooth(Box<Reconstruction<'a>>),
    Gathered(Box<IrradianceGather<'a>>, u32),
}

impl<'a> SurfaceLight<'a> {
    /// The light of `solution`; `seed` is that of gather rays.
    pub fn new(patches: &'a PatchScene, solution: &'a Solution, quality: Quality, seed: u64) -> Self {
        let source = match quality {
            Quality::Cells => Source::Cells(solution),
            Quality::Smooth => Source::Smooth(Box::new(Reconstruction::new(patches, solution))),
            Quality::Gathered(rays) => Source::Gathered(Box::new(IrradianceGather::new(patches, solution)), rays),
        };
        Self { patches, source, seed }
    }

    /// Rays that one piece of surface is to have in all.
    pub fn rays(&self) -> u32 {
        if let Source::Gathered(_, rays) = self.source { rays } else { 1 }
    }

    /// About as many rays as what is done for one piece of surface takes the time of.
    pub(crate) fn cost(&self) -> usize {
        match self.source {
            Source::Cells(_) => 2,
            Source::Smooth(_) => SMOOTH,
            Source::Gathered(_, rays) => rays as usize,
        }
    }

    /// Irradiance, W·m⁻² (or lux), on one side of a triangle at barycentric (`u`, `v`): `None` where the side absorbs, or
    /// something stands on the point, so that nothing can light it. Of gather rays it has those of the given numbers of the sequence `key`.
    pub fn at(&self, triangle: u32, side: Side, [u, v]: [f64; 2], key: u64, rays: Range<u32>) -> Option<Rgb> {
        let patch = self.patches.patch_at(triangle, side, u, v)?;
        let hit = SurfaceHit { triangle, side, u, v, t: 0.0 };
        let touching = TOUCHING * self.patches.cell_area(patch).sqrt();
        if self.patches.is_covered(patch, self.patches.point_of(triangle, u, v), touching) {
            return None;
        }
        Some(match &self.source {
            Source::Cells(solution) => solution.irradiance(patch),
            Source::Smooth(reconstruction) => reconstruction.smooth(patch, &hit).irradiance,
            Source::Gathered(gather, _) => gather.at(patch, &hit, rays, self.seed, key),
        })
    }

    /// The same at a point of a page, with its share of a texel's rays.
    pub(crate) fn at_point(&self, point: &PagePoint) -> Option<Rgb> {
        let number = |share: f64| (f64::from(self.rays()) * share) as u32;
        let first = number(point.before);
        let rays = first..number(point.before + point.share).max(first + 1);
        self.at(point.triangle, point.side, point.place, point.key, rays)
    }
}
