//! Thin gaps: two plates face to face, a millionth of their size apart, see each other and nothing else.

use glam::{DAffine3, DVec3};
use twinray_scene::geom::Frame;
use twinray_scene::sample::{Stream, warp};
use twinray_scene::{PatchId, PatchScene, Side};

use super::{cut, rotation, scene_of};

/// A unit square that faces +z, and one `gap` above it that faces −z.
fn plates(gap: f64, place: DAffine3) -> PatchScene {
    let low = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.0]);
    let high = low.map(|[x, y, _]| [x, y, gap as f32]);
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
    cut(&scene_of([low, high].concat(), triangles, place), 4)
}

/// What becomes of cosine-distributed rays from the plates: met the front of the other one, met a back, left.
fn fates(scene: &PatchScene, stream: &mut Stream, rays: usize) -> [usize; 3] {
    let mut fates = [0; 3];
    for i in 0..rays {
        let patch = PatchId((i % scene.len()) as u32);
        let point = scene.cell_point(patch, stream.uniform(), stream.uniform());
        let local = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
        let direction = Frame::from_normal(scene.normal(patch)).to_world(local);
        match scene.trace_from(patch, point, direction) {
            Some(hit) if hit.side == Side::Front => fates[0] += 1,
            Some(_) => fates[1] += 1,
            None => fates[2] += 1,
        }
    }
    fates
}

/// What leaves through the slit of height g around a unit square is 1 − F ≈ 2 g: 4 sides of area g see half of
/// each plate's light. Rays that slip through a plate would leave as well, or meet its back.
#[test]
fn light_does_not_pass_a_closed_thin_gap() {
    let mut stream = Stream::new(43, 0, 0);
    for gap in [1e-3, 1e-4, 1e-5, 1e-6] {
        for turned in [false, true] {
            let turn = if turned { DAffine3::from_quat(rotation(&mut stream)) } else { DAffine3::IDENTITY };
            let rays = 200_000;
            let [front, back, left] = fates(&plates(gap, turn), &mut stream, rays);
            println!("gap {gap:e}, turned {turned}: {front} meet the other plate, {back} a back, {left} leave");
            // Six standard deviations of a Poisson count, at least one ray for its skew.
            let expected = 2.0 * gap * rays as f64;
            assert!(left as f64 <= expected + 6.0 * expected.sqrt() + 2.0, "{left} leave, {expected} expected");
            assert_eq!(back, 0, "gap {gap}, turned {turned}");
        }
    }
}

/// A wall of two faces back to back, a gap of a millionth between them: nothing passes, however thin it is.
#[test]
fn thin_walls_are_closed() {
    let mut stream = Stream::new(44, 0, 0);
    for gap in [1e-3, 1e-6, 1e-7, 0.0] {
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let front = square.map(|[x, y]| [x, y, gap as f32]);
        let back = square.map(|[x, y]| [x, y, 0.0]);
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
        let scene = cut(&scene_of([front, back].concat(), triangles, DAffine3::from_quat(rotation(&mut stream))), 100);
        for patch in scene.patches() {
            for _ in 0..200 {
                let point = scene.cell_point(patch, stream.uniform(), stream.uniform());
                let local = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
                let direction = Frame::from_normal(scene.normal(patch)).to_world(local);
                assert!(scene.trace_from(patch, point, direction).is_none(), "gap {gap}");
            }
            // And from outside the near face is what is met.
            let point = scene.cell_point(patch, 0.3, 0.3);
            let normal: DVec3 = scene.normal(patch);
            let hit = scene.trace(point + normal, -normal).expect("the wall");
            if gap >= 1e-6 {
                assert_eq!(hit.side, Side::Front, "gap {gap}");
            }
        }
    }
}
