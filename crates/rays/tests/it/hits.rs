//! The rules of hits: ends of a ray, skipped and refused triangles, ties, trees of few or no
//! triangles.

use twinray_rays::{Bvh, Hit, NO_TRIANGLE, Ray};

use crate::random::Random;

/// Even ones first.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// A large triangle across the z axis at `z`, counter-clockwise from above.
fn pane(z: f32) -> [[f32; 3]; 3] {
    [[-10.0, -10.0, z], [10.0, -10.0, z], [0.0, 20.0, z]]
}

fn down(from: f32) -> Ray {
    Ray::new([0.25, 0.5, from], [0.0, 0.0, -1.0])
}

#[test]
fn no_triangles() {
    let bvh = Bvh::build(&[]);
    assert_eq!((bvh.closest_hit(&down(1.0)), bvh.occluded(&down(1.0))), (None, false));
    assert_eq!((bvh.bounds(), bvh.triangle_count(), bvh.left_out()), (None, 0, 0));
}

#[test]
fn one_triangle_from_both_sides() {
    let bvh = Bvh::build(&[pane(0.0)]);
    let hit = bvh.closest_hit(&down(2.0)).unwrap();
    assert_eq!((hit.t, hit.triangle, hit.front), (2.0, 0, true));
    let hit = bvh.closest_hit(&Ray::new([0.25, 0.5, -2.0], [0.0, 0.0, 4.0])).unwrap();
    assert_eq!((hit.t, hit.triangle, hit.front), (0.5, 0, false));
    assert_eq!(bvh.bounds(), Some([[-10.0, -10.0, 0.0], [10.0, 20.0, 0.0]]));
}

#[test]
fn both_ends_of_the_ray() {
    let bvh = Bvh::build(&[pane(0.0)]);
    let hits = |from: f32, t_max: f32| {
        let ray = Ray { t_max, ..down(from) };
        assert_eq!(bvh.closest_hit(&ray).is_some(), bvh.occluded(&ray));
        bvh.occluded(&ray)
    };
    assert!(hits(2.0, 2.0), "t_max counts");
    assert!(!hits(2.0, 2f32.next_down()), "beyond t_max");
    assert!(!hits(0.0, f32::INFINITY), "t = 0 does not count");
    assert!(hits(f32::MIN_POSITIVE, f32::INFINITY), "the least t does");
    assert!(!hits(-1.0, f32::INFINITY), "behind");
    assert!(!hits(2.0, 0.0) && !hits(2.0, -1.0) && !hits(2.0, f32::NAN), "empty rays");
}

#[test]
fn rays_that_cannot_hit() {
    let bvh = Bvh::build(&[pane(0.0)]);
    let nan = f32::NAN;
    let inf = f32::INFINITY;
    for direction in
        [[0.0; 3], [-0.0; 3], [nan, 0.0, -1.0], [0.0, 0.0, nan], [nan; 3], [0.0, 0.0, -inf], [1e-30, 0.0, -1e-30]]
    {
        let ray = Ray::new([0.0, 0.0, 1.0], direction);
        assert_eq!((bvh.closest_hit(&ray), bvh.occluded(&ray)), (None, false), "{direction:?}");
    }
    for origin in [[nan, 0.0, 1.0], [0.0, 0.0, inf], [0.0, 0.0, nan]] {
        let ray = Ray::new(origin, [0.0, 0.0, -1.0]);
        assert_eq!((bvh.closest_hit(&ray), bvh.occluded(&ray)), (None, false), "{origin:?}");
    }
}

#[test]
fn a_skipped_triangle_is_not_there() {
    let bvh = Bvh::build(&[pane(0.0), pane(1.0)]);
    let first = |skip: u32| bvh.closest_hit(&Ray { skip, ..down(2.0) }).map(|hit| hit.triangle);
    assert_eq!((first(NO_TRIANGLE), first(0), first(1)), (Some(1), Some(1), Some(0)));
    let alone = Bvh::build(&[pane(0.0)]);
    assert!(!alone.occluded(&Ray { skip: 0, ..down(2.0) }));
    assert!(alone.occluded(&Ray { skip: 1, ..down(2.0) }));
}

#[test]
fn refused_hits_are_passed_through() {
    let panes: Vec<_> = (0..50).map(|z| pane(z as f32)).collect();
    let bvh = Bvh::build(&panes);
    let below =
        |end: u32| bvh.closest_hit_where(&down(100.0), |hit| hit.triangle < end).map(|hit| (hit.triangle, hit.t));
    assert_eq!(below(50), Some((49, 51.0)));
    assert_eq!(below(20), Some((19, 81.0)));
    assert_eq!(below(0), None);
    // What `accept` sees is the hit itself, a mask's coordinates included.
    let left = bvh.closest_hit_where(&down(100.0), |hit| hit.u + 1e-3 * hit.t < 0.4);
    let all = (0..50).rev().map(|z| Bvh::build(&[pane(z as f32)]).closest_hit(&down(100.0)).unwrap());
    assert_eq!(left.map(|h| h.t), all.into_iter().find(|h| h.u + 1e-3 * h.t < 0.4).map(|h| h.t));
}

#[test]
fn of_coincident_triangles_the_front_then_the_lowest_id_wins() {
    let mut random = Random(21);
    let mut ties = 0;
    for _ in 0..3000 {
        let triangle = random.triangle(1.0);
        let copies: Vec<_> = (0..20).map(|_| ORDERS[random.below(6)]).collect();
        let bvh = Bvh::build(&copies.iter().map(|order| order.map(|i| triangle[i])).collect::<Vec<_>>());
        let origin = random.point();
        let ray =
            Ray::new(origin, [0, 1, 2].map(|k| (triangle[0][k] + triangle[1][k] + triangle[2][k]) / 3.0 - origin[k]));
        let alone = |id: u32| Bvh::build(&[copies[id as usize].map(|i| triangle[i])]).closest_hit(&ray).unwrap();
        let Some(hit) = bvh.closest_hit(&ray) else {
            continue;
        };
        let all: Vec<Hit> = (0..20).map(|id| Hit { triangle: id, ..alone(id) }).collect();
        assert!(all.iter().all(|h| h.t.to_bits() == hit.t.to_bits()), "the same t, whatever the vertex order");
        let expected = all.iter().find(|h| h.front).unwrap_or(&all[0]);
        assert_eq!(&hit, expected);
        ties += 1;
    }
    assert!(ties > 2500, "{ties}");
}

#[test]
fn vertex_order_only_renames_the_weights() {
    let mut random = Random(22);
    for _ in 0..3000 {
        let triangle = random.triangle(1.0);
        let origin = random.point();
        let weight = [0.5, 0.3, 0.2];
        let ray =
            Ray::new(origin, [0, 1, 2].map(|k| (0..3).map(|i| weight[i] * triangle[i][k]).sum::<f32>() - origin[k]));
        let Some(hit) = Bvh::build(&[triangle]).closest_hit(&ray) else {
            continue;
        };
        for (at, order) in ORDERS.iter().enumerate() {
            let other = Bvh::build(&[order.map(|i| triangle[i])]).closest_hit(&ray).unwrap();
            let named = |hit: &Hit| [1.0 - hit.u - hit.v, hit.u, hit.v];
            for i in 0..3 {
                assert!((named(&other)[i] - named(&hit)[order[i]]).abs() < 1e-6, "{order:?}: {hit:?} {other:?}");
            }
            assert_eq!((other.t, other.front), (hit.t, hit.front ^ (at >= 3)));
        }
    }
}

#[test]
fn memory_stays_below_a_hundred_bytes_a_triangle() {
    let mut random = Random(23);
    let triangles: Vec<_> = (0..50_000).map(|_| random.triangle(0.02)).collect();
    let per_triangle = Bvh::build(&triangles).bytes() as f64 / triangles.len() as f64;
    println!("{per_triangle:.1} B per triangle of a random soup");
    assert!(per_triangle < 100.0, "{per_triangle}");
}
