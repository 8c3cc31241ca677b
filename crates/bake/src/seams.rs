//! Charts that meet again: where a smooth surface was cut, what filters read on either side is made the same.
//!
//! Texels that a filter reads along both sides of a cut are moved as little as makes the two sides agree, in the sense of
//! least squares (as in Iwanicki, "Lighting technology of The Last of Us", SIGGRAPH 2013 talks), by conjugate gradients on the normal equations.

use std::collections::HashMap;

use glam::DVec3;
use twinray_scene::PatchScene;

use crate::atlas::Atlas;
use crate::page::Page;
use crate::parts::Part;

/// Cosine between display normals at a cut below which it is an edge of the thing itself.
const SMOOTH: f64 = 0.95;
/// Places are the same within this share of the scene's radius.
const SAME_PLACE: f64 = 1e-5;
/// Weight of a wholly covered texel's own light beside that of one place of a cut.
const OWN: f64 = 0.1;
/// Least share of that weight: texels that only continue a chart may move freely, nearly.
const LEAST: f64 = 0.02;
const STEPS: usize = 60;

/// How much light jumps at cuts of smooth surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamJump {
    /// Length of the cuts, metres.
    pub length: f64,
    /// Root mean square of the jumps of luminance over the mean luminance along the cuts.
    pub rms: f64,
    /// The jump that 99 % of the cuts' length do not exceed, over the same mean.
    pub p99: f64,
}

type Footprint = [(u32, f64); 4];

/// A place on a cut as both sides see it.
struct Crossing {
    sides: [Footprint; 2],
    /// Metres of the cut that it stands for.
    length: f64,
}

/// Cuts of an atlas.
pub struct Seams {
    crossings: Vec<Crossing>,
    /// First texel of each page in the numbering of footprints.
    starts: Vec<u32>,
}

/// One side of an edge.
#[derive(Clone, Copy)]
struct EdgeSide {
    page: u32,
    uv: [[f32; 2]; 2],
    normals: [DVec3; 2],
    length: f64,
}

impl Seams {
    /// Finds the cuts.
    pub fn new(patches: &PatchScene, atlas: &Atlas, parts: &[Part], pages: &[Page]) -> Self {
        let step = 1.0 / (SAME_PLACE * patches.radius());
        let key = |p: DVec3| (p * step).to_array().map(|x| x.round() as i64);
        let mut edges: HashMap<[[i64; 3]; 2], Vec<EdgeSide>> = HashMap::new();
        let mut order = Vec::new();
        for (part, laid) in parts.iter().zip(&atlas.parts) {
            for ((face, corners), &page) in part.faces.iter().zip(&laid.triangles).zip(&laid.pages) {
                if face.dark {
                    continue;
                }
                let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let places = weights.map(|w| part.place(w));
                let points = places.map(|[u, v]| patches.point_of(face.triangle, u, v));
                let normals = places.map(|[u, v]| patches.shading_normal(face.triangle, part.side, u, v));
                let uv = corners.map(|k| laid.vertices[k as usize].uv);
                for k in 0..3 {
                    let l = (k + 1) % 3;
                    let (a, b) = if key(points[k]) <= key(points[l]) { (k, l) } else { (l, k) };
                    let side = EdgeSide {
                        page,
                        uv: [uv[a], uv[b]],
                        normals: [normals[a], normals[b]],
                        length: points[a].distance(points[b]),
                    };
                    let id = [key(points[a]), key(points[b])];
                    edges
                        .entry(id)
                        .or_insert_with(|| {
                            order.push(id);
                            Vec::new()
                        })
                        .push(side);
                }
            }
        }
        let mut starts = vec![0];
        pages.iter().for_each(|p| starts.push(starts[starts.len() - 1] + p.coverage.len() as u32));
        let mut crossings = Vec::new();
        // In the order of the faces: a map's own would not be the same from run to run.
        for id in order {
            let sides = &edges[&id];
            for (i, a) in sides.iter().enumerate() {
                for b in &sides[i + 1..] {
                    let smooth = (0..2).all(|k| a.normals[k].dot(b.normals[k]) > SMOOTH);
                    if smooth && (a.page != b.page || a.uv != b.uv) {
                        cross(a, b, pages, &starts, &mut crossings);
                    }
                }
            }
        }
        Self { crossings, starts }
    }

    /// The jumps as they are.
    pub fn jump(&self, pages: &[Page]) -> SeamJump {
        let light = |texel: u32| {
            let page = self.starts.partition_point(|&s| s <= texel) - 1;
            let [r, g, b] = pages[page].irradiance[(texel - self.starts[page]) as usize].map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let read = |f: &Footprint| f.iter().map(|&(t, w)| w * light(t)).sum::<f64>();
        let (mut length, mut mean, mut square) = (0.0, 0.0, 0.0);
        let mut jumps: Vec<(f64, f64)> = Vec::with_capacity(self.crossings.len());
        for crossing in &self.crossings {
            let [a, b] = [read(&crossing.sides[0]), read(&crossing.sides[1])];
            length += crossing.length;
            mean += crossing.length * 0.5 * (a + b);
            square += crossing.length * (a - b).powi(2);
            jumps.push(((a - b).abs(), crossing.length));
        }
        if mean <= 0.0 || mean.is_nan() {
            return SeamJump { length, ..SeamJump::default() };
        }
        mean /= length;
        jumps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut passed = 0.0;
        let p99 = jumps.iter().find(|(_, l)| {
            passed += l;
            passed >= 0.99 * length
        });
        SeamJump { length, rms: (square / length).sqrt() / mean, p99: p99.map_or(0.0, |j| j.0 / mean) }
    }

    /// Moves the texels of `pages` so that both sides agree.
    pub fn stitch(&self, pages: &mut [Page]) {
        let mut number = HashMap::new();
        let mut texels = Vec::new();
        let rows: Vec<[(usize, f64); 8]> = self
            .crossings
            .iter()
            .map(|crossing| {
                let mut row = [(0, 0.0); 8];
                for (side, footprint) in crossing.sides.iter().enumerate() {
                    for (k, &(texel, weight)) in footprint.iter().enumerate() {
                        let variable = *number.entry(texel).or_insert_with(|| {
                            texels.push(texel);
                            texels.len() - 1
                        });
                        row[4 * side + k] = (variable, if side == 0 { weight } else { -weight });
                    }
                }
                row
            })
            .collect();
        let at = |texel: u32| {
            let page = self.starts.partition_point(|&s| s <= texel) - 1;
            (page, (texel - self.starts[page]) as usize)
        };
        let own: Vec<f64> = texels
            .iter()
            .map(|&t| {
                let (page, texel) = at(t);
                OWN * f64::from(pages[page].coverage[texel]).max(LEAST)
            })
            .collect();
        for channel in 0..3 {
            let start: Vec<f64> = texels
                .iter()
                .map(|&t| {
                    let (page, texel) = at(t);
                    f64::from(pages[page].irradiance[texel][channel])
                })
                .collect();
            let moved = agree(&rows, &own, &start);
            for (&t, value) in texels.iter().zip(moved) {
                let (page, texel) = at(t);
                pages[page].irradiance[texel][channel] = value.max(0.0) as f32;
            }
        }
    }
}

/// Places along an edge, two for each texel that its longer side passes.
fn cross(a: &EdgeSide, b: &EdgeSide, pages: &[Page], starts: &[u32], crossings: &mut Vec<Crossing>) {
    let texels = |side: &EdgeSide| {
        let page = &pages[side.page as usize];
        let d = [0, 1].map(|k| f64::from(side.uv[1][k] - side.uv[0][k]));
        (d[0] * f64::from(page.width)).hypot(d[1] * f64::from(page.height))
    };
    let count = (2.0 * texels(a).max(texels(b))).ceil().clamp(1.0, 1e5) as u32;
    for k in 0..count {
        let t = (f64::from(k) + 0.5) / f64::from(count);
        let footprint = |side: &EdgeSide| {
            let [u, v] = [0, 1].map(|k| f64::from(side.uv[0][k]) * (1.0 - t) + f64::from(side.uv[1][k]) * t);
            let start = starts[side.page as usize];
            pages[side.page as usize].footprint(u, v).map(|(texel, weight)| (start + texel as u32, weight))
        };
        crossings.push(Crossing { sides: [footprint(a), footprint(b)], length: a.length / f64::from(count) });
    }
}

/// Minimises Σ (row · x)² + Σ own (x − start)².
fn agree(rows: &[[(usize, f64); 8]], own: &[f64], start: &[f64]) -> Vec<f64> {
    let apply = |x: &[f64]| {
        let mut y: Vec<f64> = x.iter().zip(own).map(|(x, o)| x * o).collect();
        for row in rows {
            let dot: f64 = row.iter().map(|&(i, w)| w * x[i]).sum();
            row.iter().for_each(|&(i, w)| y[i] += w * dot);
        }
        y
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = start.to_vec();
    let right: Vec<f64> = start.iter().zip(own).map(|(s, o)| s * o).collect();
    let mut residual: Vec<f64> = right.iter().zip(apply(&x)).map(|(r, a)| r - a).collect();
    let mut direction = residual.clone();
    let mut rest = dot(&residual, &residual);
    let target = 1e-12 * dot(&right, &right);
    for _ in 0..STEPS {
        if rest <= target {
            break;
        }
        let image = apply(&direction);
        let step = rest / dot(&direction, &image);
        x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
        residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        let next = dot(&residual, &residual);
        let ratio = next / rest;
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + ratio * *d);
        rest = next;
    }
    x
}
