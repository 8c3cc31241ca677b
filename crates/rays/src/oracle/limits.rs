//! The ends of the range: depth, coincident triangles, bad numbers, threads, instruction sets.

use super::{Random, check, count, soup};
use crate::Bvh;
use crate::build::{Tree, build};
use crate::lanes::{Lanes, Portable};
use crate::node::{LANES, Leaf, Node};
use crate::ray::{PreparedRay, Ray};
use crate::traverse::MAX_DEPTH;

#[test]
fn a_hundred_thousand_coincident_triangles() {
    let mut triangles = vec![[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; count(100_000, 30)];
    triangles.extend(soup(count(100, 10), 1.0, &mut Random(5)));
    let mut random = Random(6);
    let rays: Vec<Ray> = (0..count(50, 5)).map(|_| Ray::new([0.3, 0.3, 2.0], random.point())).collect();
    check(&triangles, rays);
    let hit = Bvh::build(&triangles).closest_hit(&Ray::new([0.3, 0.3, 1e-3], [0.0, 0.0, -1.0])).unwrap();
    assert_eq!((hit.triangle, hit.front), (0, true));
}

/// Levels of inner nodes.
fn depth(tree: &Tree, node: usize) -> usize {
    let Node { planes, children } = &tree.nodes[node];
    let used = (0..LANES).filter(|&lane| planes[0][lane] <= planes[3][lane]).map(|lane| children[lane]);
    let inner = used.filter(|child| !child.is_leaf());
    1 + inner.map(|child| depth(tree, child.index())).max().unwrap_or(0)
}

#[test]
fn skewed_input_keeps_the_depth_bounded() {
    // Sizes in geometric progression, many of each: area alone would peel them off a few at a time.
    let mut triangles = Vec::new();
    for step in 0..count(6000, 60) {
        let x = 2f32.powf(60.0 - step as f32 / 40.0);
        triangles.push([[x, 0.0, 0.0], [0.0, x, 0.0], [0.0, 0.0, x]]);
    }
    let depth = depth(&build(&triangles), 0);
    println!("depth {depth}");
    assert!(depth <= MAX_DEPTH, "{depth}");
    let rays = [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [0.3, 0.2, 1.0], [1e-6, 1.0, 1e-9]];
    assert!(check(&triangles, rays.map(|d| Ray::new([1e-3, 1e-3, 1e-3], d))) > 0);
}

#[test]
fn bad_numbers_are_left_out_and_counted() {
    let good = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut triangles = vec![good];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e19] {
        for place in 0..9 {
            let mut triangle = good;
            triangle[place / 3][place % 3] = bad;
            triangles.push(triangle);
        }
    }
    triangles.push([[1.0, 2.0, 3.0]; 3]);
    triangles.push([[0.0; 3], [1.0; 3], [2.0; 3]]);
    let bvh = Bvh::build(&triangles);
    assert_eq!((bvh.left_out(), bvh.triangle_count()), (triangles.len() - 1, triangles.len()));
    assert_eq!(bvh.bounds(), Some([[0.0; 3], [1.0, 1.0, 0.0]]));
    assert_eq!(check(&triangles, [Ray::new([0.2, 0.2, 1.0], [0.0, 0.0, -1.0])]), 1);
}

#[test]
fn rays_of_any_bits_end() {
    let mut random = Random(7);
    let triangles = soup(300, 0.3, &mut random);
    let any = |random: &mut Random| f32::from_bits(random.bits() as u32);
    let special = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, 1e-19, 1.0, 1e19, f32::MAX];
    for round in 0..count(20_000, 6) {
        let mut number = || {
            if round % 2 == 0 { any(&mut random) } else { random.pick(&special) }
        };
        let ray =
            Ray { origin: [0; 3].map(|_| number()), direction: [0; 3].map(|_| number()), t_max: number(), skip: 0 };
        check(&triangles[..20], [ray]);
    }
}

#[test]
fn the_build_does_not_depend_on_threads() {
    let triangles = soup(count(30_000, 60), 0.02, &mut Random(8));
    let build_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build(&triangles))
    };
    let one = build_on(1);
    for threads in [2, 5] {
        let many = build_on(threads);
        assert!(one.nodes == many.nodes, "nodes on {threads} threads");
        // Bits, because unused lanes hold NaN.
        let bits = |leaf: &Leaf| (leaf.vertices.map(|v| v.map(|a| a.map(f32::to_bits))), leaf.labels);
        assert!(one.leaves.iter().map(bits).eq(many.leaves.iter().map(bits)), "leaves on {threads} threads");
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn lanes_agree_to_the_bit() {
    use crate::wide::{Avx2, Avx512};

    if Avx2::detected() {
        agrees_with_portable::<Avx2>();
    } else {
        println!("no AVX2 here, nothing to compare");
    }
    if Avx512::detected() {
        agrees_with_portable::<Avx512>();
    } else {
        println!("no AVX-512 here, nothing to compare");
    }
}

/// Boxes and triangles of any numbers, special ones among them.
#[cfg(target_arch = "x86_64")]
fn agrees_with_portable<L: Lanes>() {
    let mut random = Random(9);
    let numbers = [0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    for round in 0..count(50_000, 100) {
        let mut number = || {
            if round % 3 == 0 { random.pick(&numbers) } else { random.signed() }
        };
        let mut node = Node::empty();
        node.planes.iter_mut().flatten().for_each(|plane| *plane = number());
        let mut leaf = Leaf::empty();
        leaf.vertices.iter_mut().flatten().flatten().for_each(|c| *c = number());
        let t_cull = number();
        let ray = Ray::new([0; 3].map(|_| number()), [0; 3].map(|_| number()));
        let Some(mut ray) = PreparedRay::new(&ray, &[[-1.0; 3], [1.0; 3]]) else {
            continue;
        };
        if round % 2 == 0 {
            // Without padding planes through the origin are common, and with them 0·inf.
            (ray.near_origin, ray.far_origin) = (ray.origin, ray.origin);
        }
        let (mask, near) = Portable::boxes(&node, &ray, t_cull);
        let (wide_mask, wide_near) = L::boxes(&node, &ray, t_cull);
        assert_eq!((mask, near.map(f32::to_bits)), (wide_mask, wide_near.map(f32::to_bits)), "{node:?} {ray:?}");
        assert_eq!(Portable::triangles(&leaf, &ray), L::triangles(&leaf, &ray), "{leaf:?} {ray:?}");
    }
}
