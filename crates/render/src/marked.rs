//! A grey model with some of its surfaces coloured: pictures of findings, not of light.

use rayon::prelude::*;
use twinray_scene::{Camera, PatchScene, SurfaceHit};

/// What lies where nothing is seen.
const NOTHING: [f64; 3] = [0.13; 3];
/// Rays of a pixel along each side.
const SIDE: u32 = 2;

/// RGB bytes for a screen `[height, width, 3]`, first row on top. `colour` gives the colour of a place, 0 to 1 as on the screen;
/// `None` is grey. Shading follows the angle to the ray, so that shapes show without any light.
pub fn marked(
    scene: &PatchScene,
    camera: &Camera,
    [width, height]: [u32; 2],
    colour: impl Fn(&SurfaceHit) -> Option<[f64; 3]> + Sync,
) -> Vec<u8> {
    let aspect = f64::from(width) / f64::from(height);
    let seen = |x: f64, y: f64| {
        let Some((eye, direction)) = camera.ray(x / f64::from(width), y / f64::from(height), aspect, [0.0; 2]) else {
            return [0.0; 3];
        };
        let Some(hit) = scene.trace(eye - scene.centre(), direction) else { return NOTHING };
        let [a, b, c] = scene.corners(hit.triangle);
        let facing = (b - a).cross(c - a).normalize_or_zero().dot(direction).abs();
        let shade = 0.35 + 0.65 * facing;
        colour(&hit).unwrap_or([0.72; 3]).map(|c| c * shade)
    };
    let rays = f64::from(SIDE * SIDE);
    (0..width * height)
        .into_par_iter()
        .flat_map_iter(|pixel| {
            let (x, y) = (f64::from(pixel % width), f64::from(pixel / width));
            let mut sum = [0.0; 3];
            for k in 0..SIDE * SIDE {
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
                let one = seen(x + at(k % SIDE), y + at(k / SIDE));
                sum = std::array::from_fn(|c| sum[c] + one[c]);
            }
            sum.map(|c| (255.0 * c / rays).round().clamp(0.0, 255.0) as u8)
        })
        .collect()
}
