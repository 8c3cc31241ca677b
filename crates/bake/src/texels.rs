//! Pages filled: each texel gets the mean of a value over the piece of surface that it covers.
//!
//! Coverage is by area, exactly: a texel that a chart only grazes has the light of what it grazes, and no texel's centre
//! decides anything.

use std::ops::Range;

use rayon::prelude::*;
use twinray_scene::{Rgb, Side};

use crate::atlas::Atlas;
use crate::clip::{cross, range, texels_of};
use crate::page::Page;
use crate::parts::Part;
use crate::watch::{Cancelled, Stage, Watch, pace};

/// Texels of one task, about.
const TASK: u32 = 256;
/// Tasks whose pieces are held at once, at most.
const BATCH: usize = 2048;

/// A point of a page: where it is on the surface.
#[derive(Clone, Copy, Debug)]
pub struct PagePoint {
    /// Triangle of the patches' scene.
    pub triangle: u32,
    /// Its side.
    pub side: Side,
    /// Barycentric weights of vertices 1 and 2.
    pub place: [f64; 2],
    /// Page.
    pub page: u32,
    /// On the page, in [0, 1]².
    pub uv: [f64; 2],
    /// Names the texel among all.
    pub key: u64,
    /// Share of the texel that came before it.
    pub before: f64,
    /// What it stands for, as a share of a texel.
    pub share: f64,
}

/// Rows of a face.
struct Task {
    part: u32,
    face: u32,
    corners: [[f64; 2]; 3],
    columns: Range<u32>,
    rows: Range<u32>,
}

/// A piece of a face in a texel.
struct Piece {
    page: u32,
    texel: u32,
    /// Texels.
    area: f64,
    value: Option<Rgb>,
}

/// Pages with the mean of `value` over what texels cover of all parts, and per page which texels charts cover at all. Points where
/// `value` knows nothing do not count. It takes about as long as `rays` rays for all of a texel.
///
/// # Errors
/// If `watch` cancels.
pub fn fill(
    atlas: &Atlas,
    parts: &[Part],
    value: &(impl Fn(&PagePoint) -> Option<Rgb> + Sync),
    rays: usize,
    watch: &mut Watch<'_>,
) -> Result<(Vec<Page>, Vec<Vec<bool>>), Cancelled> {
    let mut pages: Vec<Page> = atlas.pages.iter().map(|&size| Page::new(size)).collect();
    let mut charted: Vec<Vec<bool>> = pages.iter().map(|p| vec![false; p.coverage.len()]).collect();
    let mut sums: Vec<Vec<[f64; 4]>> = pages.iter().map(|p| vec![[0.0; 4]; p.coverage.len()]).collect();
    let tasks = tasks(atlas, parts);
    let mut done = 0;
    for batch in tasks.chunks(pace(TASK as usize * rays, BATCH)) {
        let found: Vec<Vec<Piece>> = batch.par_iter().map(|task| pieces(atlas, parts, task, value)).collect();
        for piece in found.iter().flatten() {
            let (page, texel) = (piece.page as usize, piece.texel as usize);
            charted[page][texel] = true;
            if let Some(value) = piece.value {
                let [r, g, b] = (value * piece.area).to_array();
                let sum = &mut sums[page][texel];
                *sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + piece.area];
            }
        }
        done += batch.len();
        watch(Stage::Texels, done as f64 / tasks.len() as f64)?;
    }
    for (page, sums) in pages.iter_mut().zip(&sums) {
        for ((irradiance, coverage), &[r, g, b, area]) in page.irradiance.iter_mut().zip(&mut page.coverage).zip(sums) {
            if area > 0.0 {
                // Estimates may be below 0, light is not.
                *irradiance = [r, g, b].map(|s| (s / area).max(0.0) as f32);
                *coverage = area.min(1.0) as f32;
            }
        }
    }
    for (page, charted) in pages.iter_mut().zip(&charted) {
        drop_slivers(page, charted);
    }
    if let Some((page, [low, high])) = atlas.dark {
        let page = &mut pages[page as usize];
        let span = |axis: usize, size: u32| {
            let texels = |c: f32| f64::from(c) * f64::from(size);
            texels(low[axis]).floor() as u32..(texels(high[axis]).ceil() as u32).min(size)
        };
        for y in span(1, page.height) {
            for x in span(0, page.width) {
                page.coverage[(y * page.width + x) as usize] = 1.0;
            }
        }
    }
    Ok((pages, charted))
}

/// Forgets what is known of texels that a chart hardly touches, where it has others beside them: a line on the rim of a floor
/// may see past the wall that stands on it.
fn drop_slivers(page: &mut Page, charted: &[bool]) {
    let (width, height) = (page.width as usize, page.height as usize);
    let is_sliver = |i: usize| page.coverage[i] > 0.0 && page.coverage[i] < SLIVER;
    let has_more = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
            .any(|n| n != i && charted[n] && !is_sliver(n))
    };
    let dropped: Vec<usize> = (0..charted.len()).filter(|&i| is_sliver(i) && has_more(i)).collect();
    for i in dropped {
        (page.irradiance[i], page.coverage[i]) = ([0.0; 3], 0.0);
    }
}

fn tasks(atlas: &Atlas, parts: &[Part]) -> Vec<Task> {
    let mut found = Vec::new();
    for (p, (part, laid)) in parts.iter().zip(&atlas.parts).enumerate() {
        for (f, face) in part.faces.iter().enumerate() {
            if face.dark {
                continue;
            }
            let size = atlas.pages[laid.pages[f] as usize];
            let corners = laid.triangles[f].map(|k| {
                let [u, v] = laid.vertices[k as usize].uv.map(f64::from);
                [u * f64::from(size[0]), v * f64::from(size[1])]
            });
            let [columns, rows] = range(corners, size);
            let step = (TASK / (columns.len() as u32).max(1)).max(1) as usize;
            for start in rows.clone().step_by(step) {
                let rows = start..rows.end.min(start + step as u32);
                found.push(Task { part: p as u32, face: f as u32, corners, columns: columns.clone(), rows });
            }
        }
    }
    found
}

fn pieces(
    atlas: &Atlas,
    parts: &[Part],
    task: &Task,
    value: &(impl Fn(&PagePoint) -> Option<Rgb> + Sync),
) -> Vec<Piece> {
    let (part, corners) = (&parts[task.part as usize], task.corners);
    let page = atlas.parts[task.part as usize].pages[task.face as usize];
    let size = atlas.pages[page as usize];
    let mut found = Vec::new();
    let whole = cross(corners[0], corners[1], corners[2]);
    if whole == 0.0 {
        return found;
    }
    let (triangle, side) = (part.faces[task.face as usize].triangle, part.side);
    texels_of(corners, [task.columns.clone(), task.rows.clone()], |x, y, piece| {
        let (mut sum, mut known, mut before) = (Rgb::BLACK, 0.0, 0.0);
        let texel = y * size[0] + x;
        for k in 1..piece.len() - 1 {
            let fan = [piece[0], piece[k], piece[k + 1]];
            let area = (0.5 * cross(fan[0], fan[1], fan[2])).abs();
            let points = points(fan, area);
            for &point in points.iter() {
                let weights = [
                    cross(point, corners[1], corners[2]) / whole,
                    cross(corners[0], point, corners[2]) / whole,
                    cross(corners[0], corners[1], point) / whole,
                ];
                let share = area / points.len() as f64;
                let key = (u64::from(page) << 32) | u64::from(texel);
                let uv = [point[0] / f64::from(size[0]), point[1] / f64::from(size[1])];
                let point = PagePoint { triangle, side, place: part.place(weights), page, uv, key, before, share };
                before += share;
                if let Some(there) = value(&point) {
                    sum += there * share;
                    known += share;
                }
            }
        }
        let value = (known > 0.0).then(|| sum / known);
        found.push(Piece { page, texel, area: known, value });
    });
    found
}

/// Points that stand for a triangle of `area` texels: the middles of its four parts, or its own.
fn points([a, b, c]: [[f64; 2]; 3], area: f64) -> Points {
    let at = move |wa: f64, wb: f64, wc: f64| [0, 1].map(|k| wa * a[k] + wb * b[k] + wc * c[k]);
    let third = 1.0 / 3.0;
    let middle = at(third, third, third);
    if area <= SMALL {
        return Points([middle; 4], 1);
    }
    let corner = 2.0 * third;
    let other = 0.5 * third;
    Points([middle, at(corner, other, other), at(other, corner, other), at(other, other, corner)], 4)
}

/// Texels below which a piece tells too little of its texel.
const SLIVER: f32 = 1e-3;

/// Texels below which one point is enough.
const SMALL: f64 = 0.1;

struct Points([[f64; 2]; 4], usize);

impl std::ops::Deref for Points {
    type Target = [[f64; 2]];

    fn deref(&self) -> &Self::Target {
        &self.0[..self.1]
    }
}
