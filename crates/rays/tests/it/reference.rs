//! Hits against an independent test (Möller, Trumbore 1997, in `f64`), and against their own
//! geometry.

use twinray_rays::{Bvh, Hit, Ray};

use crate::random::Random;

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `(t, u, v, front)` of the hit, and how far inside the triangle it is (the least barycentric
/// weight).
fn moeller_trumbore(ray: &Ray, triangle: &[[f32; 3]; 3]) -> Option<(f64, f64, f64, bool, f64)> {
    let [a, b, c] = triangle.map(|v| v.map(f64::from));
    let (origin, direction) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
    let (e, f) = (sub(b, a), sub(c, a));
    let p = cross(direction, f);
    let determinant = dot(e, p);
    let s = sub(origin, a);
    let q = cross(s, e);
    let (u, v, t) = (dot(s, p) / determinant, dot(direction, q) / determinant, dot(f, q) / determinant);
    let margin = u.min(v).min(1.0 - u - v);
    (margin >= 0.0 && t > 0.0).then_some((t, u, v, determinant > 0.0, margin))
}

#[test]
fn agrees_with_moeller_trumbore() {
    let mut random = Random(11);
    let triangles: Vec<_> = (0..300).map(|_| random.triangle(0.4)).collect();
    let bvh = Bvh::build(&triangles);
    let (mut compared, mut hit_something) = (0, 0);
    for _ in 0..20_000 {
        let ray = Ray::new(random.point(), random.point());
        let all = triangles.iter().enumerate().filter_map(|(id, t)| moeller_trumbore(&ray, t).map(|hit| (id, hit)));
        let expected = all.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let got = bvh.closest_hit(&ray);
        // Within rounding of an edge the two may differ: those are the business of the watertight
        // tests.
        let clear = match (&expected, &got) {
            (None, None) => true,
            (Some((_, (.., margin))), Some(_)) => *margin > 1e-4,
            _ => false,
        };
        if !clear {
            continue;
        }
        compared += 1;
        let (Some((id, (t, u, v, front, _))), Some(hit)) = (expected, got) else {
            continue;
        };
        hit_something += 1;
        assert_eq!((hit.triangle as usize, hit.front), (id, front), "{ray:?}");
        for (what, got, expected) in [("t", hit.t, t), ("u", hit.u, u), ("v", hit.v, v)] {
            // Grazing hits amplify the rounding of the coordinates; 1e-3 still tells any two
            // quantities apart.
            assert!((f64::from(got) - expected).abs() < 1e-3 * (1.0 + expected), "{what}: {got} against {expected}");
        }
    }
    assert!(compared > 19_900 && hit_something > 10_000, "{compared} {hit_something}");
}

/// The two names of a hit, `origin + t * direction` and the barycentric point, are one place,
/// within the rounding of vertices relative to the ray: each coordinate of a sheared vertex is off
/// by at most 2·U·X + 4·U·Z, `t` along z by 2·U·Z, `u` and `v` by U each, where X and Z are
/// distances from the origin to vertices (`ray.rs` derives this). Needles are no exception.
#[test]
fn the_hit_lies_on_the_triangle_and_on_the_ray() {
    let mut random = Random(12);
    let mut hits = 0;
    for round in 0..200_000 {
        let scale = [1.0, 1e-3, 1e4][round % 3];
        let offset = [0.0, 1.5e5][round % 2];
        let mut triangle = random.triangle(1.0);
        if round % 5 == 0 {
            let [a, b, _] = triangle;
            triangle[2] = [0, 1, 2].map(|k| 0.3 * a[k] + 0.7 * b[k] + 1e-6 * random.unit());
        }
        let triangle = triangle.map(|v| v.map(|c| c * scale + offset));
        let origin = random.point().map(|c| c * scale + offset);
        let weights = [random.unit(), random.unit(), random.unit()];
        let sum: f32 = weights.iter().sum();
        let direction = [0, 1, 2].map(|k| (0..3).map(|i| (triangle[i][k] - origin[k]) * weights[i] / sum).sum());
        let ray = Ray::new(origin, direction);
        let Some(hit) = Bvh::build(&[triangle]).closest_hit(&ray) else {
            continue;
        };
        hits += 1;
        check_place(&ray, &triangle, &hit);
    }
    assert!(hits > 100_000, "{hits}");
}

fn check_place(ray: &Ray, triangle: &[[f32; 3]; 3], hit: &Hit) {
    let unit = f64::from(f32::EPSILON) / 2.0;
    let (u, v, t) = (f64::from(hit.u), f64::from(hit.v), f64::from(hit.t));
    assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v) && u + v <= 1.0 + 2.0 * unit, "{hit:?}");
    let extent: [f64; 3] = [0, 1, 2]
        .map(|k| (0..3).map(|i| (f64::from(triangle[i][k]) - f64::from(ray.origin[k])).abs()).fold(0.0, f64::max));
    let z = (0..3).max_by(|&i, &j| ray.direction[i].abs().total_cmp(&ray.direction[j].abs())).unwrap();
    for axis in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|i| f64::from(triangle[i][axis]));
        let barycentric = (1.0 - u - v) * a + u * b + v * c;
        let along_ray = f64::from(ray.origin[axis]) + t * f64::from(ray.direction[axis]);
        let bound = 10.0 * unit * (extent[axis] + extent[z]);
        assert!(
            (barycentric - along_ray).abs() <= bound,
            "axis {axis}: {barycentric} {along_ray}, {ray:?} {triangle:?} {hit:?}"
        );
    }
}
