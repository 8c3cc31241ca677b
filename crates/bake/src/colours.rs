//! Surfaces as they look by their baked light, for viewers that know no lightmaps.

use std::f64::consts::PI;

use twinray_scene::{PatchScene, Rgb, SurfaceHit};

use crate::dilate::dilate;
use crate::lightmap::Lightmap;
use crate::page::Page;
use crate::texels::fill;
use crate::watch::{Cancelled, Watch};

/// What a texel takes is worth about so many rays.
const RAYS: usize = 4;

/// A page as it looks.
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    /// In its `irradiance`: radiance, W·sr⁻¹·m⁻² (or nit), emitted and diffusely reflected.
    pub radiance: Page,
    /// Share of each texel's surface that is there, `[height, width]`.
    pub presence: Vec<f32>,
}

/// What is seen of each page's surfaces: emission and diffuse reflection, textures averaged over texels.
///
/// # Errors
/// If `watch` cancels.
pub fn colours(
    patches: &PatchScene,
    lightmap: &Lightmap,
    padding: u32,
    watch: &mut Watch<'_>,
) -> Result<Vec<Colours>, Cancelled> {
    let Lightmap { parts, atlas, pages, .. } = lightmap;
    let radiance = |point: &crate::PagePoint| {
        let [u, v] = point.place;
        if !patches.is_present(point.triangle, u, v) {
            return None;
        }
        let hit = SurfaceHit { triangle: point.triangle, side: point.side, u, v, t: 0.0 };
        let surface = patches.surface_at(&hit, 0.0);
        let irradiance = pages[point.page as usize].sample(point.uv[0], point.uv[1]);
        Some(surface.emission + surface.scatter.brdf.base_reflectance(1.0) * irradiance / PI)
    };
    let (mut seen, charted) = fill(atlas, parts, &radiance, RAYS, watch)?;
    let is_there = |point: &crate::PagePoint| {
        let [u, v] = point.place;
        Some(Rgb::grey(if patches.is_present(point.triangle, u, v) { 1.0 } else { 0.0 }))
    };
    let (mut there, _) = fill(atlas, parts, &is_there, RAYS, watch)?;
    for ((page, charted), there) in seen.iter_mut().zip(&charted).zip(&mut there) {
        dilate(page, charted, padding + 1);
        dilate(there, charted, padding + 1);
    }
    let presence = there.into_iter().map(|page| page.irradiance.iter().map(|p| p[0]).collect());
    Ok(seen.into_iter().zip(presence).map(|(radiance, presence)| Colours { radiance, presence }).collect())
}
