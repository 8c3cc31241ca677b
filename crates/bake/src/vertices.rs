//! Light at vertices: values whose linear interpolation over the triangles is nearest to the light, in the sense of least
//! squares (Kavan, Bargteil, Sloan, "Least squares vertex baking", EGSR 2011), a little smoothed where triangles say little.

use std::collections::HashMap;

use rayon::prelude::*;
use twinray_scene::{PatchScene, Rgb, Scene};
use twinray_solve::Solution;

use crate::atlas::{AtlasError, area};
use crate::light::{Quality, SurfaceLight};
use crate::parts::{Part, parts};
use crate::watch::{Stage, Watch, pace};

/// Weight of the smoothness of neighbours beside the light itself.
const SMOOTH: f64 = 0.02;
const STEPS: usize = 40;
/// Rounds in which vertices may be held at 0.
const ROUNDS: usize = 8;
/// Points at which the light of a face is asked for, at least and at most.
const POINTS: [f64; 2] = [16.0, 1024.0];
/// Faces between two looks at who may want to stop, at most.
const BATCH: usize = 4096;

/// Irradiance at the vertices of the meshes.
#[derive(Clone, Debug)]
pub struct VertexLight {
    /// Sides of meshes that have light.
    pub parts: Vec<Part>,
    /// For each part, by vertex of its mesh: irradiance, W·m⁻² (or lux); black for vertices of no face.
    pub irradiance: Vec<Vec<[f32; 3]>>,
    /// How far interpolation over the triangles is off: RMS of its difference to the light, the noise of that included, over the
    /// mean of the light, both of luminance.
    pub off: f64,
}

/// Bakes the light of `solution` into vertices.
///
/// # Errors
/// [`AtlasError::Nothing`] if no surface reflects diffusely; [`AtlasError::Cancelled`] if `watch` stops it.
pub fn bake_vertices(
    scene: &Scene,
    patches: &PatchScene,
    solution: &Solution,
    quality: Quality,
    seed: u64,
    watch: &mut Watch<'_>,
) -> Result<VertexLight, AtlasError> {
    let parts = parts(scene, patches, solution);
    if parts.is_empty() {
        return Err(AtlasError::Nothing);
    }
    let light = SurfaceLight::new(patches, solution, quality, seed);
    let faces = parts.iter().map(|p| p.faces.len()).sum::<usize>().max(1) as f64;
    let mut done = 0;
    let mut irradiance = Vec::with_capacity(parts.len());
    let mut sums = Sums::default();
    for part in &parts {
        let mesh = &scene.meshes[scene.instances[part.instance].mesh];
        let mut found = Vec::with_capacity(part.faces.len());
        for batch in part.faces.chunks(pace(light.cost() * POINTS[0] as usize, BATCH)) {
            found.par_extend(batch.par_iter().map(|face| moments(patches, part, face.triangle, &light)));
            done += batch.len();
            watch(Stage::Vertices, done as f64 / faces)?;
        }
        let values = fit(part, &found, &mesh.positions, mesh.normals.as_deref());
        sums.add(part, &found, &values);
        irradiance.push(values);
    }
    Ok(VertexLight { parts, irradiance, off: sums.off() })
}

/// What a face adds to the sums of its corners.
struct Moments {
    area: f64,
    /// ∫ φ E over the face.
    right: [Rgb; 3],
    /// ∫ E² over the face, of luminance.
    square: f64,
    /// ∫ φ φ of corners 0 0, 1 1, 2 2, 0 1, 1 2, 2 0 over the face, from the same points: what is off is a small difference.
    products: [f64; 6],
}

/// Over all faces.
#[derive(Default)]
struct Sums {
    area: f64,
    light: f64,
    /// ∫ (Σ φ x − E)², of luminance.
    off: f64,
}

impl Sums {
    fn add(&mut self, part: &Part, found: &[Moments], values: &[[f32; 3]]) {
        for (face, moments) in part.faces.iter().zip(found) {
            let x = face.corners.map(|k| Rgb::from_f32(values[k as usize]).luminance());
            let right = moments.right.map(|r| r.luminance());
            let square: f64 = (0..3)
                .map(|k| moments.products[k] * x[k] * x[k] + 2.0 * moments.products[3 + k] * x[k] * x[(k + 1) % 3])
                .sum();
            let both: f64 = x.iter().zip(right).map(|(x, r)| x * r).sum();
            self.area += moments.area;
            self.light += right.iter().sum::<f64>();
            self.off += (moments.square - 2.0 * both + square).max(0.0);
        }
    }

    fn off(&self) -> f64 {
        if self.light > 0.0 { (self.off * self.area).sqrt() / self.light } else { 0.0 }
    }
}

/// The values at the vertices of a part whose faces gave `found`.
fn fit(part: &Part, found: &[Moments], positions: &[[f32; 3]], normals: Option<&[[f32; 3]]>) -> Vec<[f32; 3]> {
    // Vertices that were split for texture coordinates alone are one.
    let mut number = HashMap::new();
    let mut variables = 0;
    let variable: Vec<usize> = (0..positions.len())
        .map(|k| {
            let key = (positions[k].map(f32::to_bits), normals.map(|n| n[k].map(f32::to_bits)));
            *number.entry(key).or_insert_with(|| {
                variables += 1;
                variables - 1
            })
        })
        .collect();
    let corners: Vec<[usize; 3]> = part.faces.iter().map(|f| f.corners.map(|k| variable[k as usize])).collect();
    let (mut right, mut mass) = (vec![Rgb::BLACK; variables], vec![0.0; variables]);
    for (corner, moments) in corners.iter().zip(found) {
        for k in 0..3 {
            right[corner[k]] += moments.right[k];
            mass[corner[k]] += moments.area / 3.0;
        }
    }
    // Start from weighted means, which are smooth and positive.
    let start: Vec<Rgb> = right.iter().zip(&mass).map(|(r, &m)| if m > 0.0 { *r / m } else { Rgb::BLACK }).collect();
    let areas: Vec<f64> = found.iter().map(|m| m.area).collect();
    let values = [0, 1, 2].map(|c| {
        let channel = |v: &[Rgb]| -> Vec<f64> { v.iter().map(|x| x.to_array()[c]).collect() };
        let (right, mut x) = (channel(&right), channel(&start));
        // No light is negative: what would be is held at 0, and the rest is fitted again.
        let mut free: Vec<bool> = mass.iter().map(|&m| m > 0.0).collect();
        for _ in 0..ROUNDS {
            x = solve(&corners, &areas, &right, x, &mass, &free);
            let negative: Vec<usize> = (0..x.len()).filter(|&k| x[k] < 0.0).collect();
            negative.iter().for_each(|&k| (x[k], free[k]) = (0.0, false));
            if negative.is_empty() {
                break;
            }
        }
        x
    });
    variable.iter().map(|&v| [0, 1, 2].map(|c| values[c][v] as f32)).collect()
}

/// Sums over a face, with points spread evenly over it.
fn moments(patches: &PatchScene, part: &Part, triangle: u32, light: &SurfaceLight<'_>) -> Moments {
    let cells = f64::from(patches.cells_of(triangle).count());
    let count = (4.0 * cells).clamp(POINTS[0], POINTS[1]) as u32;
    let (mut right, mut lit, mut square, mut products) = ([Rgb::BLACK; 3], [0.0; 3], 0.0, [0.0; 6]);
    for k in 0..count {
        // The plastic sequence, folded into the triangle (Roberts 2018).
        let place = |step: f64| (f64::from(k) * step + 0.5).fract();
        let (mut s, mut t) = (place(0.754_877_666_246_692_7), place(0.569_840_290_998_053_2));
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let weights = [1.0 - s - t, s, t];
        let each = light.rays().div_ceil(count);
        let (key, rays) = (u64::from(triangle), k * each..(k + 1) * each);
        let Some(there) = light.at(triangle, part.side, part.place(weights), key, rays) else { continue };
        for c in 0..3 {
            right[c] += there * weights[c];
            lit[c] += weights[c];
            products[c] += weights[c] * weights[c];
            products[3 + c] += weights[c] * weights[(c + 1) % 3];
        }
        square += there.luminance().powi(2);
    }
    let area = area(patches, triangle);
    // What stands on the face hides its share of every corner's light.
    let total: f64 = lit.iter().sum();
    let area = area * total / f64::from(count);
    let scale = if total > 0.0 { area / total } else { 0.0 };
    Moments { area, right: right.map(|r| r * scale), square: square * scale, products: products.map(|p| p * scale) }
}

/// Minimises ∫ (Σ φ x − E)² + smoothness over the vertices that are `free`, by conjugate gradients.
fn solve(
    corners: &[[usize; 3]],
    areas: &[f64],
    right: &[f64],
    start: Vec<f64>,
    mass: &[f64],
    free: &[bool],
) -> Vec<f64> {
    let apply = |x: &[f64]| {
        let mut y = vec![0.0; x.len()];
        for (corner, area) in corners.iter().zip(areas) {
            let sum: f64 = corner.iter().map(|&k| x[k]).sum();
            for &k in corner {
                // Mass matrix of linear elements, and differences to the face's mean.
                y[k] += area / 12.0 * (sum + x[k]) + SMOOTH * area * (x[k] - sum / 3.0);
            }
        }
        y
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = start;
    let image = apply(&x);
    let held = |r: Vec<f64>| -> Vec<f64> { r.into_iter().zip(free).map(|(r, &f)| if f { r } else { 0.0 }).collect() };
    let mut residual = held(right.iter().zip(&image).map(|(r, a)| r - a).collect());
    let precondition = |r: &[f64]| held(r.iter().zip(mass).map(|(r, m)| r / m).collect());
    let mut z = precondition(&residual);
    let mut direction = z.clone();
    let mut rest = dot(&residual, &z);
    let target = 1e-14 * rest;
    for _ in 0..STEPS {
        if rest <= target || rest.is_nan() {
            break;
        }
        let image = held(apply(&direction));
        let step = rest / dot(&direction, &image);
        x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
        residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        z = precondition(&residual);
        let next = dot(&residual, &z);
        let ratio = next / rest;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + ratio * *d);
        rest = next;
    }
    x
}
