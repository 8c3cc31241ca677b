//! Light straight from what emits, at one point: a shadow ray to the best of some candidates.
//!
//! Candidates are weighed against the BRDF's own rays; one is chosen by what it would give, so
//! that the only shadow ray goes where it matters (Talbot, Cline, Egbert, "Importance resampling for global
//! illumination", EGSR 2005).

use glam::DVec3;
use twinray_scene::brdf::Towards;
use twinray_scene::{PatchScene, Rgb};

use crate::lights::{Choice, Lights};
use crate::vertex::Vertex;

/// How lamps are chosen for shadow rays.
#[derive(Clone, Copy)]
pub(crate) struct Shadows<'a> {
    /// Probabilities of the lamps.
    pub choice: &'a Choice,
    /// Candidates for one shadow ray.
    pub candidates: u32,
}

/// True if a path that was scattered into `heading` and passed clear glass arrives in `direction` as a shadow ray would.
#[inline]
pub(crate) fn is_straight(heading: DVec3, direction: DVec3) -> bool {
    // Rounding tilts by far less, and faces that are not parallel by far more.
    heading.dot(direction) > 1.0 - 1e-8
}

/// Weights of a shadow ray and of the BRDF's own ray in a direction that have these densities: the power heuristic with
/// exponent 2 (Veach and Guibas 1995), since one of the two is most often the far better one here.
#[inline]
pub(crate) fn weights(shadow_ray: f64, brdf: f64) -> [f64; 2] {
    // Squares of very large densities are beyond numbers; their ratio is not.
    let ratio = brdf / shadow_ray;
    let shadow_ray = 1.0 / (1.0 + ratio * ratio);
    [shadow_ray, 1.0 - shadow_ray]
}

/// One sample of the radiance that `brdf` reflects at `vertex` of light straight from what emits, and the lamp that it
/// comes from. `own` is the density per solid angle of the caller's own ray. `numbers` gives pairs of uniform numbers, two for each candidate and one more.
pub(crate) fn direct(
    scene: &PatchScene,
    lights: &Lights,
    vertex: &Vertex,
    brdf: &Towards,
    own: impl Fn(DVec3) -> f64,
    shadows: Shadows,
    mut numbers: impl FnMut() -> [f64; 2],
) -> (Rgb, Option<usize>) {
    let Shadows { choice: by, candidates } = shadows;
    let Vertex { point, geometric, normal, .. } = vertex;
    let (mut sum, mut chosen) = (0.0, None);
    let [mut pick, _] = numbers();
    for _ in 0..candidates {
        let ([choice, _], place) = (numbers(), numbers());
        let Some(light) = lights.sample_by(by, *point, choice, place) else { continue };
        let cosine = normal.dot(light.towards);
        if cosine <= 0.0 || geometric.dot(light.towards) <= 0.0 {
            continue;
        }
        let (a, b) = (f64::from(candidates) * light.density, own(light.towards));
        let density = a / weights(a, b)[0];
        let gives = light.radiance * brdf.eval(light.towards) * (cosine / density);
        let luminance = gives.luminance();
        if luminance > 0.0 {
            sum += luminance;
            // One uniform number serves all choices: what is left of its interval is uniform again.
            let probability = luminance / sum;
            if pick < probability {
                chosen = Some((gives / luminance, light));
                pick /= probability;
            } else {
                pick = (pick - probability) / (1.0 - probability);
            }
        }
    }
    let Some((gives, light)) = chosen else { return (Rgb::BLACK, None) };
    let seen = match light.end {
        Some((end, normal_there)) => scene.transmittance(*point, *geometric, end, normal_there),
        None => scene.transmittance_from_sky(vertex.patch, *point, light.towards),
    };
    (gives * seen * sum, Some(light.lamp))
}
