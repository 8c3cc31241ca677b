//! Triangles without area, or with corners that are nowhere.

use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::{Subject, mesh_corners};
use crate::geom::area_vector_2;

/// Twice the area over the longest edge squared, below which rounding decides which way a triangle faces.
const FLAT: f64 = 1e-10;

pub fn find(subject: &Subject) -> Vec<Finding> {
    // Of all meshes that have an instance: one whose triangles are all flat has none that is placed.
    let mut used = vec![false; subject.scene.meshes.len()];
    subject.scene.instances.iter().for_each(|i| used[i.mesh] = true);
    let of_mesh = |(i, mesh): (usize, &crate::authored::Mesh)| {
        let is_flat = |t: usize| {
            let [a, b, c] = mesh_corners(mesh, t);
            let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            let across = area_vector_2(a, b, c).length();
            across.is_nan() || across <= FLAT * longest
        };
        let count = (0..mesh.triangles.len()).filter(|&t| is_flat(t)).count();
        let share = count as f64 / mesh.triangles.len().max(1) as f64;
        (used[i] && count > 0).then(|| Finding {
            kind: Kind::DegenerateTriangles,
            severity: Severity::Warning,
            element: subject.mesh_element(i),
            count,
            area: 0.0,
            worst: Worst { value: share, unit: "share" },
            message: format!("{count} of {} triangles have no area", mesh.triangles.len()),
            triangles: Vec::new(),
        })
    };
    subject.scene.meshes.iter().enumerate().filter_map(of_mesh).collect()
}
