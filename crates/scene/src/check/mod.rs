//! What ruins a bake, found before it is paid for: one file a kind of finding, each a function from the scene to a list.
//!
//! Not here: faults that no scene may have (`validate`), words for a terminal and pictures (the command). Findings depend
//! on scene and settings alone, whatever the number of threads.

mod albedo;
mod backs;
mod boxes;
mod clip;
mod degenerate;
mod duplicates;
mod emitter;
mod finding;
mod leak;
mod normals;
mod shell;
mod subject;
mod units;
mod uv2;
mod walks;
mod winding;

#[cfg(test)]
mod tests;

pub use finding::{Element, Finding, Kind, Severity, Worst};
pub use uv2::density::texels_per_metre;

use crate::authored::Scene;
use crate::camera::Camera;
use crate::patch::PatchScene;
use subject::Subject;
use walks::Walks;

/// Settings of [`check`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckOptions {
    /// Side of a lightmap, texels.
    pub texture_size: u32,
    /// Texels for a metre that are wanted, if that is known.
    pub density: Option<f64>,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { texture_size: 1024, density: None }
    }
}

/// All findings, worst first. `patches` are those of `scene`; light is followed from its emitters and `cameras`.
///
/// # Panics
/// If an index of the scene is out of range: see [`Scene::validate`].
pub fn check(scene: &Scene, patches: &PatchScene, cameras: &[Camera], options: &CheckOptions) -> Vec<Finding> {
    let subject = Subject::new(scene, patches);
    let walks = Walks::new(&subject, cameras);
    let mut found = units::find(&subject, &walks);
    found.extend(degenerate::find(&subject));
    found.extend(duplicates::find(&subject));
    found.extend(normals::find(&subject));
    found.extend(winding::find(&subject));
    found.extend(backs::find(&subject, &walks));
    found.extend(shell::find(&subject));
    found.extend(leak::find(&subject, &walks));
    found.extend(albedo::find(&subject));
    found.extend(emitter::find(&subject));
    found.extend(uv2::find(&subject, options));
    // Stable: within a kind, what is worst by its own measure first, then the order of the scene.
    found.sort_by(|a, b| {
        let rank = |f: &Finding| (f.severity, f.kind);
        rank(a).cmp(&rank(b)).then(b.area.total_cmp(&a.area))
    });
    found
}
