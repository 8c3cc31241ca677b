//! Whether the author's second texture coordinates can carry light: within the page, no piece of it twice, charts apart.

use twinray_scene::Mesh;

use crate::clip::{cross, range, texels_of};
use crate::parts::Part;

/// Share of the charts' area that may be covered twice: rims that share a texel's rounding.
const TOLERATED: f64 = 1e-3;

/// What is wrong with a set of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Some mesh has none.
    Missing,
    /// A coordinate outside of [0, 1].
    Outside,
    /// This share of the charts' area lies on other charts.
    Overlap(f64),
    /// This share of the surface has no area on the page.
    Flat(f64),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing => write!(f, "not every mesh has any"),
            Self::Outside => write!(f, "some lie outside of [0, 1]"),
            Self::Overlap(share) => write!(f, "{:.1} % of their area overlaps", 100.0 * share),
            Self::Flat(share) => write!(f, "{:.1} % of the surface has no area there", 100.0 * share),
        }
    }
}

/// Texture coordinates of a face, if its mesh has a second set.
pub fn authored(mesh: &Mesh, corners: [u32; 3]) -> Option<[[f32; 2]; 3]> {
    mesh.second_texcoords.as_ref().map(|t| corners.map(|k| t[k as usize]))
}

/// Judges the second texture coordinates of several parts that are to share one page of `size` texels a side.
pub fn judge<'a>(
    parts: impl Iterator<Item = (&'a Part, &'a Mesh)>,
    area: impl Fn(u32) -> f64,
    size: u32,
) -> Option<Fault> {
    let mut covered = vec![0.0f32; size as usize * size as usize];
    let (mut flat, mut total, mut on_page) = (0.0, 0.0, 0.0);
    for (part, mesh) in parts {
        for face in &part.faces {
            let Some(uv) = authored(mesh, face.corners) else { return Some(Fault::Missing) };
            if uv.iter().flatten().any(|&c| !(-1e-4..=1.0001).contains(&c)) {
                return Some(Fault::Outside);
            }
            let texels = uv.map(|p| p.map(|c| f64::from(c) * f64::from(size)));
            let there = area(face.triangle);
            total += there;
            if cross(texels[0], texels[1], texels[2]).abs() < 1e-6 {
                flat += there;
            }
            texels_of(texels, range(texels, [size; 2]), |x, y, piece| {
                let area: f64 = (1..piece.len() - 1).map(|k| 0.5 * cross(piece[0], piece[k], piece[k + 1]).abs()).sum();
                covered[(y * size + x) as usize] += area as f32;
                on_page += area;
            });
        }
    }
    if flat > 0.01 * total {
        return Some(Fault::Flat(flat / total));
    }
    let twice: f64 = covered.iter().map(|&c| f64::from(c - 1.0).max(0.0)).sum();
    (twice > TOLERATED * on_page).then(|| Fault::Overlap(twice / on_page))
}
