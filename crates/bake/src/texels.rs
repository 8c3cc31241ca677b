//! Pages filled: each texel gets the mean irradiance of the piece of surface that it covers.
//!
//! Coverage is by area, exactly: a texel that a chart only grazes has the light of what it grazes, and no texel's centre
//! decides anything.

use rayon::prelude::*;
use twinray_scene::{Rgb, Side};

use crate::atlas::Atlas;
use crate::clip::{cross, texels_of};
use crate::light::SurfaceLight;
use crate::page::Page;
use crate::parts::Part;

/// Faces that one task does.
const FACES: usize = 256;
/// Faces whose pieces are held at once.
const BATCH: usize = 64 * FACES;

/// A piece of a face in a texel.
struct Piece {
    page: u32,
    texel: u32,
    /// Texels.
    area: f32,
    light: Option<Rgb>,
}

/// Pages with the light of all parts, and per page which texels charts cover, lit or not.
pub fn fill(atlas: &Atlas, parts: &[Part], light: &SurfaceLight<'_>) -> (Vec<Page>, Vec<Vec<bool>>) {
    let mut pages: Vec<Page> = atlas.pages.iter().map(|&size| Page::new(size)).collect();
    let mut charted: Vec<Vec<bool>> = pages.iter().map(|p| vec![false; p.coverage.len()]).collect();
    let mut sums: Vec<Vec<[f64; 3]>> = pages.iter().map(|p| vec![[0.0; 3]; p.coverage.len()]).collect();
    let faces: Vec<(u32, u32)> = parts
        .iter()
        .enumerate()
        .flat_map(|(p, part)| (0..part.faces.len() as u32).map(move |f| (p as u32, f)))
        .filter(|&(p, f)| !parts[p as usize].faces[f as usize].dark)
        .collect();
    for batch in faces.chunks(BATCH) {
        let found: Vec<Vec<Piece>> = batch
            .par_chunks(FACES.min(batch.len().div_ceil(64)))
            .map(|faces| faces.iter().flat_map(|&(p, f)| pieces(atlas, parts, p as usize, f as usize, light)).collect())
            .collect();
        for piece in found.iter().flatten() {
            let (page, texel) = (piece.page as usize, piece.texel as usize);
            charted[page][texel] = true;
            if let Some(light) = piece.light {
                let area = f64::from(piece.area);
                let sum = &mut sums[page][texel];
                let light = light.to_array();
                (0..3).for_each(|c| sum[c] += area * light[c]);
                pages[page].coverage[texel] += piece.area;
            }
        }
    }
    for (page, sums) in pages.iter_mut().zip(&sums) {
        for ((irradiance, coverage), sum) in page.irradiance.iter_mut().zip(&mut page.coverage).zip(sums) {
            if *coverage > 0.0 {
                *irradiance = sum.map(|s| (s / f64::from(*coverage)) as f32);
            }
            *coverage = coverage.min(1.0);
        }
    }
    if let Some((page, [low, high])) = atlas.dark {
        let page = &mut pages[page as usize];
        let texels = |c: f32, size: u32| f64::from(c) * f64::from(size);
        let range = |axis: usize, size: u32| {
            texels(low[axis], size).floor() as u32..(texels(high[axis], size).ceil() as u32).min(size)
        };
        for y in range(1, page.height) {
            for x in range(0, page.width) {
                page.coverage[(y * page.width + x) as usize] = 1.0;
            }
        }
    }
    (pages, charted)
}

fn pieces(atlas: &Atlas, parts: &[Part], part: usize, face: usize, light: &SurfaceLight<'_>) -> Vec<Piece> {
    let laid = &atlas.parts[part];
    let page = laid.pages[face];
    let size = atlas.pages[page as usize];
    let corners = laid.triangles[face].map(|k| {
        let [u, v] = laid.vertices[k as usize].uv.map(f64::from);
        [u * f64::from(size[0]), v * f64::from(size[1])]
    });
    let mut found = Vec::new();
    let whole = cross(corners[0], corners[1], corners[2]);
    if whole == 0.0 {
        return found;
    }
    let part = &parts[part];
    let (triangle, side) = (part.faces[face].triangle, part.side);
    texels_of(corners, size, |x, y, piece| {
        let texel = y * size[0] + x;
        let (mut sum, mut lit, mut area) = (Rgb::BLACK, 0.0, 0.0);
        for k in 1..piece.len() - 1 {
            let fan = [piece[0], piece[k], piece[k + 1]];
            let share = (0.5 * cross(fan[0], fan[1], fan[2])).abs();
            area += share;
            for (point, weight) in points(fan, share) {
                let weights = [
                    cross(point, corners[1], corners[2]) / whole,
                    cross(corners[0], point, corners[2]) / whole,
                    cross(corners[0], corners[1], point) / whole,
                ];
                // The place on the page names the point, whatever else there is.
                let key = (u64::from(page) << 1 | u64::from(side == Side::Back)) ^ point[0].to_bits().rotate_left(19) ^ point[1].to_bits();
                let rays = (f64::from(light.rays()) * share * weight).ceil() as u32;
                let weight = weight * share;
                if let Some(there) = light.at(triangle, side, part.place(weights), key, rays) {
                    sum += there * weight;
                    lit += weight;
                }
            }
        }
        let light = (lit > 0.0).then(|| sum / lit);
        found.push(Piece { page, texel, area: if light.is_some() { lit as f32 } else { area as f32 }, light });
    });
    found
}

/// Points that stand for a triangle of `area` texels, and their shares: the middles of its four parts, or its own.
fn points([a, b, c]: [[f64; 2]; 3], area: f64) -> impl Iterator<Item = ([f64; 2], f64)> {
    let at = move |wa: f64, wb: f64, wc: f64| [0, 1].map(|k| wa * a[k] + wb * b[k] + wc * c[k]);
    let third = 1.0 / 3.0;
    let all = [
        at(third, third, third),
        at(2.0 * third, 0.5 * third, 0.5 * third),
        at(0.5 * third, 2.0 * third, 0.5 * third),
        at(0.5 * third, 0.5 * third, 2.0 * third),
    ];
    let count = if area > 0.1 { 4 } else { 1 };
    all.into_iter().take(count).map(move |p| (p, 1.0 / count as f64))
}
