//! A whole lightmap: parts, atlas, pages, charts continued and stitched.

use twinray_scene::{PatchScene, Scene};
use twinray_solve::Solution;

use crate::atlas::{Atlas, AtlasError, AtlasOptions};
use crate::dilate::dilate;
use crate::light::{Quality, SurfaceLight};
use crate::page::Page;
use crate::parts::{self, Part};
use crate::seams::{SeamJump, Seams};
use crate::texels;
use crate::watch::{Stage, Watch};

/// Settings of [`bake`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightmapOptions {
    /// The pages.
    pub atlas: AtlasOptions,
    /// Whence the light.
    pub quality: Quality,
    /// Make charts agree where a smooth surface was cut.
    pub stitch: bool,
    /// Of gather rays.
    pub seed: u64,
}

/// A scene's light on pages.
#[derive(Clone, Debug)]
pub struct Lightmap {
    /// Sides of meshes that have light.
    pub parts: Vec<Part>,
    /// Where they are.
    pub atlas: Atlas,
    /// Their light.
    pub pages: Vec<Page>,
    /// Jumps at cuts of smooth surfaces before they were stitched, and after.
    pub seams: [SeamJump; 2],
}

/// Bakes the light of `solution`, the solution of `patches`, into which `scene` was cut.
///
/// The result depends on these values alone, not on threads.
///
/// # Errors
/// See [`Atlas::new`]; and [`AtlasError::Cancelled`] if `watch` stops it.
pub fn bake(
    scene: &Scene,
    patches: &PatchScene,
    solution: &Solution,
    options: &LightmapOptions,
    watch: &mut Watch<'_>,
) -> Result<Lightmap, AtlasError> {
    watch(Stage::Atlas, 0.0)?;
    let parts = parts::parts(scene, patches, solution);
    let atlas = Atlas::new(scene, patches, &parts, &options.atlas)?;
    let light = SurfaceLight::new(patches, solution, options.quality, options.seed);
    let (mut pages, charted) = texels::fill(&atlas, &parts, &|point| light.at_point(point), light.cost(), watch)?;
    watch(Stage::Seams, 0.0)?;
    for (page, charted) in pages.iter_mut().zip(&charted) {
        dilate(page, charted, options.atlas.padding + 1);
    }
    let seams = Seams::new(patches, &atlas, &parts, &pages);
    let before = seams.jump(&pages);
    if options.stitch {
        seams.stitch(&mut pages);
    }
    let after = seams.jump(&pages);
    Ok(Lightmap { parts, atlas, pages, seams: [before, after] })
}
