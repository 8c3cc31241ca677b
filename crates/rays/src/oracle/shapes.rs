//! Scenes of many shapes, common and awkward, against brute force.

use proptest::array::uniform3;
use proptest::prelude::*;

use super::{Random, Triangle, check, count, soup};
use crate::node::LANES;
use crate::ray::{NO_TRIANGLE, Ray};

/// The surfaces of the boxes between the planes of a `n`³ lattice: axis-aligned, every plane
/// shared.
fn lattice_boxes(n: i32) -> Vec<Triangle> {
    let mut out = Vec::new();
    let cells = (0..n).flat_map(|x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])));
    for cell in cells {
        for axis in 0..3 {
            let corner = |i: i32, j: i32| {
                let mut p = cell;
                p[(axis + 1) % 3] += i;
                p[(axis + 2) % 3] += j;
                p.map(|c| c as f32)
            };
            let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
            out.extend([[a, b, c], [a, c, d]]);
        }
    }
    out
}

#[test]
fn soups_of_every_size_and_shape() {
    let mut random = Random(1);
    for (triangles, size) in
        [(1, 1.0), (7, 1.0), (8, 0.5), (9, 0.5), (64, 0.3), (count(1000, 40), 0.1), (count(1000, 40), 1.0)]
    {
        let triangles = soup(triangles, size, &mut random);
        let rays: Vec<Ray> = (0..count(4000, 3)).map(|_| Ray::new(random.point(), random.point())).collect();
        assert!(check(&triangles, rays) >= count(21, 0));
    }
}

#[test]
#[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
fn needles_and_scales() {
    let mut random = Random(2);
    let mut hits = 0;
    for (scale, offset) in [(1.0, 1.5e5), (1e3, 1.5e5), (1e-12, 0.0), (1e17, 0.0), (1.0, 0.0)] {
        let mut triangles = soup(500, 0.5, &mut random);
        for [a, b, c] in triangles.iter_mut() {
            // The third vertex a hair off the line of the others.
            let along = random.signed();
            *c = [0, 1, 2].map(|k| a[k] + along * (b[k] - a[k]) + 1e-5 * random.signed());
        }
        triangles.extend(soup(50, 0.1, &mut random));
        let place = |p: [f32; 3]| p.map(|c| c * scale + offset);
        let triangles: Vec<Triangle> = triangles.iter().map(|t| t.map(place)).collect();
        let rays: Vec<Ray> = (0..4000)
            .map(|_| {
                // At points of triangles, or a needle would never be met.
                let ([a, b, c], origin) = (random.pick(&triangles), place(random.point()));
                Ray::new(origin, [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0 - origin[k]))
            })
            .collect();
        hits += check(&triangles, rays);
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
#[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
fn rays_along_axes_and_in_planes_of_boxes() {
    let triangles = lattice_boxes(6);
    let mut random = Random(3);
    let rays: Vec<Ray> = (0..20_000)
        .map(|_| {
            // Half steps: origins on planes, edges and corners of boxes, and between; directions
            // with zeros of both signs.
            let origin = [0; 3].map(|_| random.pick(&[-1.0, -0.5, 0.0, 0.5, 1.0, 2.5, 3.0, 6.0, 7.0]));
            let direction = [0; 3].map(|_| random.pick(&[0.0, -0.0, 1.0, -1.0, 0.0, -0.0, 0.5]));
            let t_max = random.pick(&[0.5, 1.0, 3.0, f32::INFINITY]);
            Ray { origin, direction, t_max, skip: random.pick(&[NO_TRIANGLE, 0, 100]) }
        })
        .collect();
    let hits = check(&triangles, rays);
    assert!(hits > 3000, "{hits}");
}

/// Only the padding of boxes keeps these rays: they meet triangles at the very faces and edges of
/// their boxes, where half of all roundings of the box test fall outside.
#[test]
#[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
fn rays_at_the_borders_of_boxes() {
    let mut random = Random(10);
    let mut hits = 0;
    for offset in [0.0, 10.0, 1.5e5] {
        // Right angles, so that two edges lie in faces of the box; eight of each, so that a leaf's
        // box is that of one triangle; apart from each other, so that no neighbour helps.
        let triangles: Vec<Triangle> = (0..40)
            .flat_map(|_| {
                let corner = random.point().map(|c| 100.0 * c + offset);
                let axis = random.pick(&[0, 1, 2]);
                let (mut b, mut c) = (corner, corner);
                b[(axis + 1) % 3] += random.signed();
                c[(axis + 2) % 3] += random.signed();
                [[corner, b, c]; LANES]
            })
            .collect();
        let rays: Vec<Ray> = (0..20_000)
            .map(|_| {
                let [a, b, c] = random.pick(&triangles);
                let end = random.pick(&[b, c]);
                let along = random.pick(&[0.0, 1.0, 0.5, 0.3]);
                let target = [0, 1, 2].map(|k| a[k] + along * (end[k] - a[k]));
                // Far away along one axis and beside the box along the others: there the error of
                // the shear is largest against the distance to the box's face.
                let beside = random.point();
                let mut origin = [0, 1, 2].map(|k| target[k] + beside[k]);
                origin[random.pick(&[0, 1, 2])] += random.pick(&[0.0, 1e2, -1e4, 1e6]);
                Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
            })
            .collect();
        hits += check(&triangles, rays);
    }
    assert!(hits > 10_000, "{hits}");
}

/// Seen from a few units in the last place off a large wall, the rounding of its far vertices
/// exceeds the distance to it: the case that needs the padding, as relative slack is worth nothing.
#[test]
#[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
fn rays_that_start_beside_a_wall() {
    let mut random = Random(11);
    let mut hits = 0;
    for axis in 0..3 {
        let level = 0.3 + 0.1 * random.signed();
        let triangles = [[-9.1, -7.3], [8.7, -9.9], [0.7, 9.3]].map(|[i, j]| {
            let mut vertex = [level; 3];
            (vertex[(axis + 1) % 3], vertex[(axis + 2) % 3]) = (i, j);
            vertex
        });
        let rays: Vec<Ray> = (0..100_000)
            .map(|_| {
                let mut origin = random.point();
                let ulps = random.pick(&[-8, -4, -3, -2, -1, 0, 1, 2, 3, 4, 8]) as f32;
                origin[axis] = level + ulps * (level.next_up() - level);
                Ray::new(origin, random.point())
            })
            .collect();
        hits += check(&[triangles], rays);
    }
    assert!(hits > 50_000, "{hits}");
}

#[test]
#[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
fn one_flat_sheet() {
    // All boxes have no thickness, and a ray may lie in the plane of all of them.
    let sheet: Vec<Triangle> = lattice_boxes(8).into_iter().filter(|t| t.iter().all(|v| v[1] == 0.0)).collect();
    let mut random = Random(4);
    let rays: Vec<Ray> = (0..5000)
        .map(|_| {
            let origin = [random.signed() * 8.0, random.pick(&[0.0, 1.0]), random.signed() * 8.0];
            Ray::new(origin, [random.signed(), random.pick(&[0.0, -0.0, -1.0, -1e-30]), random.signed()])
        })
        .collect();
    let hits = check(&sheet, rays);
    assert!(hits > 100, "{hits}");
}

proptest! {
    /// On a small lattice everything that is rare elsewhere is common: ties, shared edges, edge-on
    /// triangles, rays in planes.
    #[test]
    #[cfg_attr(miri, ignore = "takes hours there; soups go through the same code")]
    fn lattice_triangles(
        triangles in prop::collection::vec(uniform3(uniform3(-2i8..=2)), 0..40),
        rays in prop::collection::vec((uniform3(-3i8..=3), uniform3(-2i8..=2)), 20),
    ) {
        let real = |v: &[i8; 3]| v.map(f32::from);
        let triangles: Vec<Triangle> = triangles.iter().map(|t| t.each_ref().map(real)).collect();
        check(&triangles, rays.iter().map(|(o, d)| Ray::new(real(o), real(d))));
    }
}
