//! Rays that start on a plane never meet that plane, whatever its triangles, its place and their angle.

use glam::{DAffine3, DVec3};
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene};

use super::{below, cut, grazing, rotation, scene_of};

/// A square of side 2 in z = 0 cut into triangles of very different sizes: columns and rows halve towards one corner.
fn uneven_square() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    const N: u32 = 9;
    let at = |k: u32| if k == 0 { -1.0 } else { 2f32.powi(k as i32 - N as i32 + 1) * 2.0 - 1.0 };
    let positions = (0..N * N).map(|i| [at(i % N), at(i / N), 0.0]).collect();
    let cells = (0..N - 1).flat_map(|i| (0..N - 1).map(move |j| i + N * j));
    let triangles = cells.flat_map(|a| [[a, a + 1, a + 1 + N], [a, a + 1 + N, a + N]]).collect();
    (positions, triangles)
}

/// Rays from the plane that meet it, out of `rays`.
fn self_hits(scene: &PatchScene, stream: &mut Stream, rays: usize) -> usize {
    let mut hits = 0;
    for _ in 0..rays {
        let patch = PatchId(below(stream, scene.len()) as u32);
        let point = scene.cell_point(patch, stream.uniform(), stream.uniform());
        // From one millionth of a degree upwards, every decade alike.
        let sine = 10f64.powf(-7.0 * stream.uniform());
        let direction = grazing(stream, scene.normal(patch), sine);
        hits += usize::from(scene.trace_from(patch, point, direction).is_some());
    }
    hits
}

#[test]
fn rays_from_a_plane_do_not_meet_it() {
    let mut stream = Stream::new(41, 0, 0);
    let mut total = 0;
    for scale in [1.0, 1e-3, 1e6] {
        for far in [0.0, 1e5] {
            for _ in 0..4 {
                let place = DAffine3::from_scale_rotation_translation(
                    DVec3::splat(scale),
                    rotation(&mut stream),
                    DVec3::new(far, -far, 0.5 * far),
                );
                let (positions, triangles) = uneven_square();
                let scene = cut(&scene_of(positions, triangles, place), 300);
                let hits = self_hits(&scene, &mut stream, 40_000);
                println!("scale {scale:e}, {far:e} away: {hits} of 40000 rays meet their own plane");
                total += hits;
            }
        }
    }
    assert_eq!(total, 0, "of 960000 rays");
}

/// The plane beside other things: the scene's centre is not on it then.
#[test]
fn rays_from_a_floor_of_a_large_scene_do_not_meet_it() {
    let mut stream = Stream::new(42, 0, 0);
    for height in [1.0, 100.0] {
        let (mut positions, mut triangles) = uneven_square();
        let n = positions.len() as u32;
        // Straight below, so that no ray from the front of the plane can meet it.
        positions.extend([[0.0, 0.0, -height], [0.1, 0.0, -height], [0.0, 0.1, -height]]);
        triangles.push([n, n + 1, n + 2]);
        let place = DAffine3::from_quat(rotation(&mut stream));
        let scene = cut(&scene_of(positions, triangles, place), 300);
        let mut hits = 0;
        for _ in 0..100_000 {
            let patch = PatchId(below(&mut stream, scene.len()) as u32);
            if scene.triangle_of(patch) == scene.triangle_count() as u32 - 1 {
                continue;
            }
            let point = scene.cell_point(patch, stream.uniform(), stream.uniform());
            let sine = 10f64.powf(-7.0 * stream.uniform());
            let direction = grazing(&mut stream, scene.normal(patch), sine);
            hits += usize::from(scene.trace_from(patch, point, direction).is_some());
        }
        assert_eq!(hits, 0, "height {height}");
    }
}
