//! Second texture coordinates, by which a lightmap lies on a mesh.

mod charts;
pub mod density;
mod layout;
mod overlap;
mod padding;

use super::CheckOptions;
use super::clip::Point;
use super::finding::Finding;
use super::subject::Subject;
use crate::authored::Mesh;

pub fn find(subject: &Subject, options: &CheckOptions) -> Vec<Finding> {
    let mut found = layout::find(subject);
    found.extend(overlap::find(subject));
    found.extend(padding::find(subject, options.texture_size));
    found.extend(density::find(subject, options));
    found
}

/// Second texture coordinates of a mesh's triangles, if it has any.
fn uvs(mesh: &Mesh) -> Option<Vec<[Point; 3]>> {
    let all = mesh.second_texcoords.as_ref()?;
    Some(mesh.triangles.iter().map(|t| t.map(|k| all[k as usize].map(f64::from))).collect())
}

/// Twice the area over the longest edge squared, below which a triangle is a line on the lightmap.
const FLAT: f64 = 1e-6;

/// True if a triangle has no area on the lightmap.
fn is_flat(uv: [Point; 3]) -> bool {
    let length = |a: Point, b: Point| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let longest = length(uv[0], uv[1]).max(length(uv[1], uv[2])).max(length(uv[2], uv[0]));
    super::clip::cross(uv[0], uv[1], uv[2]).abs() <= FLAT * longest
}
