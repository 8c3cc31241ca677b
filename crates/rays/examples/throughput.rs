//! Measures the kernel: a tessellated room of boxes and spheres, incoherent cosine-distributed
//! rays, one thread.
//!
//! `cargo run --release -p twinray-rays --example throughput [rays in millions]`

use std::f32::consts::TAU;
use std::time::{Duration, Instant};

use twinray_rays::{Bvh, NO_TRIANGLE, Ray};

type Triangle = [[f32; 3]; 3];

fn main() {
    let millions: f64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(2.0);
    let count = (millions * 1e6) as usize;
    let triangles = room();

    let (bvh, seconds) = best_of(3, || Bvh::build(&triangles));
    println!("triangles    {}", triangles.len());
    println!("build        {:.0} ms on {} threads", seconds * 1e3, rayon::current_num_threads());
    println!("memory       {:.1} B per triangle", bvh.bytes() as f64 / triangles.len() as f64);

    let rays = cosine_rays(&triangles, count);
    let (hits, seconds) = best_of(3, || rays.iter().filter(|ray| bvh.closest_hit(ray).is_some()).count());
    println!(
        "closest hit  {:.2} Mray/s, {:.4} of the rays hit",
        count as f64 / seconds / 1e6,
        hits as f64 / count as f64
    );

    let segments: Vec<Ray> = rays.windows(2).map(|pair| between(&pair[0], &pair[1])).collect();
    let (blocked, seconds) = best_of(3, || segments.iter().filter(|ray| bvh.occluded(ray)).count());
    println!(
        "occluded     {:.2} Mray/s, {:.4} of the segments blocked",
        count as f64 / seconds / 1e6,
        blocked as f64 / count as f64
    );
}

/// The result of `work` and the seconds of its fastest run: the machine's other work only ever
/// adds.
fn best_of<T>(runs: usize, work: impl Fn() -> T) -> (T, f64) {
    let mut best = Duration::MAX;
    let mut result = None;
    for _ in 0..runs {
        let start = Instant::now();
        result = Some(work());
        best = best.min(start.elapsed());
    }
    (result.expect("at least one run"), best.as_secs_f64())
}

/// A closed 6 × 3 × 4 m room with fifteen boxes and twelve spheres, all finely tessellated: about
/// 80,000 triangles that face the air.
fn room() -> Vec<Triangle> {
    let mut out = Vec::new();
    let mut random = Random(1);
    add_box(&mut out, [0.0; 3], [6.0, 3.0, 4.0], 48, true);
    for _ in 0..15 {
        let low = [random.unit() * 5.0, random.unit() * 1.5, random.unit() * 3.0];
        let size = [0.3 + random.unit() * 0.6, 0.3 + random.unit(), 0.3 + random.unit() * 0.6];
        add_box(&mut out, low, [low[0] + size[0], low[1] + size[1], low[2] + size[2]], 12, false);
    }
    for _ in 0..12 {
        add_sphere(
            &mut out,
            [0.5 + random.unit() * 5.0, 0.5 + random.unit() * 2.0, 0.5 + random.unit() * 3.0],
            0.35,
            24,
        );
    }
    out
}

/// Six walls of `n` × `n` cells; their normals point inwards if `inside`.
fn add_box(out: &mut Vec<Triangle>, low: [f32; 3], high: [f32; 3], n: usize, inside: bool) {
    for axis in 0..3 {
        for far in [false, true] {
            let point = |i: usize, j: usize| {
                let mut p = [0.0; 3];
                p[axis] = if far { high[axis] } else { low[axis] };
                for (other, step) in [((axis + 1) % 3, i), ((axis + 2) % 3, j)] {
                    p[other] = low[other] + (high[other] - low[other]) * step as f32 / n as f32;
                }
                p
            };
            add_grid(out, n, n, far == inside, point);
        }
    }
}

fn add_sphere(out: &mut Vec<Triangle>, centre: [f32; 3], radius: f32, n: usize) {
    add_grid(out, 2 * n, n, true, |i, j| {
        let (azimuth, polar) = (i as f32 / (2 * n) as f32 * TAU, j as f32 / n as f32 * TAU / 2.0);
        let direction = [polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin()];
        [0, 1, 2].map(|k| centre[k] + radius * direction[k])
    });
}

fn add_grid(
    out: &mut Vec<Triangle>,
    columns: usize,
    rows: usize,
    flip: bool,
    point: impl Fn(usize, usize) -> [f32; 3],
) {
    for i in 0..columns {
        for j in 0..rows {
            let (a, b, c, d) = (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
            out.extend(if flip { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
        }
    }
}

/// Rays as a radiosity solver shoots them: each from a random point of a random triangle,
/// cosine-distributed about its normal.
fn cosine_rays(triangles: &[Triangle], count: usize) -> Vec<Ray> {
    let mut random = Random(2);
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        let id = (random.unit() * triangles.len() as f32) as usize % triangles.len();
        let [a, b, c] = triangles[id];
        let (e, f) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt();
        if length == 0.0 {
            continue; // at a pole
        }
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        // The normal plus a uniform point of the unit sphere is cosine-distributed.
        let (height, azimuth) = (2.0 * random.unit() - 1.0, TAU * random.unit());
        let ring = (1.0 - height * height).sqrt();
        let sphere = [ring * azimuth.cos(), ring * azimuth.sin(), height];
        rays.push(Ray {
            origin: [0, 1, 2].map(|k| a[k] + u * e[k] + v * f[k]),
            direction: [0, 1, 2].map(|k| normal[k] / length + sphere[k]),
            t_max: f32::INFINITY,
            skip: id as u32,
        });
    }
    rays
}

/// The segment from the start of one ray nearly to the start of another.
fn between(from: &Ray, to: &Ray) -> Ray {
    Ray { direction: [0, 1, 2].map(|k| to.origin[k] - from.origin[k]), t_max: 0.9999, skip: NO_TRIANGLE, ..*from }
}

/// SplitMix64 (Steele, Lea, Flood 2014), enough to spread rays.
struct Random(u64);

impl Random {
    /// Uniform in 0 … 1.
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}
