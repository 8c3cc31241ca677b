//! Rays to race with: what the solver shoots, without the solver.
//!
//! Incoherent: uniform points on all surfaces by area, cosine-distributed directions on the front. They start where the
//! solver's start, a little above the surface, and skip the triangle they start on.

use glam::DVec3;
use rayon::prelude::*;
use twinray::scene::PatchScene;
use twinray::scene::geom::Frame;
use twinray::scene::sample::{Stream, warp};
use twinray_rays::Ray;

/// A triangle as the kernel takes it.
pub type Triangle = [[f32; 3]; 3];

/// Rays that are sorted together.
pub const SORT_BLOCK: usize = 1 << 18;
/// Steps of each axis that the order of rays tells apart, as bits.
const BITS: u32 = 10;
/// Rays that a thread takes at a time.
const CHUNK: usize = 1 << 12;
/// How far above their surface rays start, relative to their largest coordinate: as in the solver.
const LIFT: f64 = 1.0 / (1u64 << 20) as f64;

/// The author's triangles as the scene has them: patches are cells of these, and rays never see them.
pub fn triangles(scene: &PatchScene) -> Vec<Triangle> {
    let corners = |t| scene.corners(t).map(|p| p.as_vec3().to_array());
    (0..scene.triangle_count() as u32).map(corners).collect()
}

/// `count` incoherent rays; the same for the same seed.
pub fn incoherent(scene: &PatchScene, count: usize, seed: u64) -> Vec<Ray> {
    let mut total = 0.0;
    let sums: Vec<f64> = (0..scene.triangle_count() as u32)
        .map(|t| {
            total += scene.triangle_area(t);
            total
        })
        .collect();
    let ray = |index: usize| {
        let mut random = Stream::new(seed, 0, index as u64);
        let wanted = random.uniform() * total;
        let triangle = sums.partition_point(|&s| s <= wanted).min(sums.len() - 1) as u32;
        let [u, v] = warp::uniform_triangle([random.uniform(), random.uniform()]);
        let [a, b, c] = scene.corners(triangle);
        let normal = (b - a).cross(c - a).normalize();
        let local = warp::cosine_hemisphere([random.uniform(), random.uniform()]);
        let direction = Frame::from_normal(normal).to_world(local);
        let point = scene.point_of(triangle, u, v);
        let lift = LIFT * point.abs().max_element().max(1e-3 * scene.radius());
        let array = |v: DVec3| v.as_vec3().to_array();
        Ray { origin: array(point + normal * lift), direction: array(direction), t_max: f32::INFINITY, skip: triangle }
    };
    (0..count).into_par_iter().map(ray).collect()
}

/// The rays in an order in which neighbours go a like way from a like place: in blocks of [`SORT_BLOCK`], by direction
/// octant, then along the Morton curve of their origins.
pub fn sorted(rays: &[Ray]) -> Vec<Ray> {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for ray in rays {
        for axis in 0..3 {
            low[axis] = low[axis].min(ray.origin[axis]);
            high[axis] = high[axis].max(ray.origin[axis]);
        }
    }
    let mut rays = rays.to_vec();
    rays.par_chunks_mut(SORT_BLOCK).for_each(|block| block.sort_by_cached_key(|ray| key(ray, low, high)));
    rays
}

/// Three bits of direction above thirty of place.
fn key(ray: &Ray, low: [f32; 3], high: [f32; 3]) -> u64 {
    let steps = (1u32 << BITS) as f32;
    let mut key = 0;
    for axis in 0..3 {
        let size = (high[axis] - low[axis]).max(f32::MIN_POSITIVE);
        let step = ((ray.origin[axis] - low[axis]) / size * steps).clamp(0.0, steps - 1.0) as u32;
        key |= spread(step) << axis;
        key |= u64::from(ray.direction[axis] < 0.0) << (3 * BITS as usize + axis);
    }
    key
}

/// The bits of a number below 2¹⁰, three places apart.
fn spread(x: u32) -> u64 {
    (0..BITS).map(|bit| u64::from(x >> bit & 1) << (3 * bit)).sum()
}

/// How many of the rays meet something, on the current threads.
pub fn hits(rays: &[Ray], meets: impl Fn(&Ray) -> bool + Sync) -> usize {
    rays.par_chunks(CHUNK).map(|chunk| chunk.iter().filter(|ray| meets(ray)).count()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solving;

    #[test]
    fn keys_follow_octant_and_morton_order() {
        assert_eq!((spread(0b1), spread(0b10), spread(0b11), spread(1023)), (1, 8, 9, 0o1111111111));
        let ray = |origin, direction| Ray { direction, ..Ray::new(origin, [0.0; 3]) };
        let (low, high) = ([0.0; 3], [1.0; 3]);
        let at = |origin, direction| key(&ray(origin, direction), low, high);
        assert_eq!(at([0.0; 3], [1.0; 3]), 0);
        assert_eq!(at([1.0, 0.0, 0.0], [1.0; 3]), 0o1111111111);
        assert_eq!(at([0.0, 0.0, 1.0], [1.0; 3]), 0o4444444444);
        assert_eq!(at([0.0; 3], [-1.0, 1.0, -1.0]), 0b101 << 30);
        // The octant counts before any place.
        assert!(at([1.0; 3], [1.0; 3]) < at([0.0; 3], [-1.0, 1.0, 1.0]));
    }

    #[test]
    fn rays_start_on_their_triangles_and_sorting_loses_none() {
        let scene = solving::scene("cornell", Some(1000)).unwrap();
        let rays = incoherent(&scene, 3000, 7);
        for ray in &rays {
            let [a, b, c] = scene.corners(ray.skip);
            let normal = (b - a).cross(c - a).normalize();
            let [origin, direction] = [ray.origin, ray.direction].map(|v| DVec3::from_array(v.map(f64::from)));
            assert!((origin - a).dot(normal).abs() < 1e-5 && direction.dot(normal) > -1e-6);
        }
        let order = |rays: &[Ray]| {
            let mut bits: Vec<_> = rays.iter().map(|r| r.origin.map(f32::to_bits)).collect();
            bits.sort_unstable();
            bits
        };
        assert_eq!(order(&rays), order(&sorted(&rays)));
        assert_ne!(rays, sorted(&rays));
    }
}
