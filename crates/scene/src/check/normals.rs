//! Vertex normals that point to the back of their triangle.

use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::{Subject, mesh_corners};
use crate::geom::area_vector_2;
use crate::patch::vec;

/// Cosine below which all three normals of a triangle are clearly on the other side: smoothing bends them far.
const OPPOSED: f64 = -0.1;

/// Share of a mesh's area that is worth a warning.
const SHARE: f64 = 1e-3;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let of_mesh = |(i, mesh): (usize, &crate::authored::Mesh)| {
        let normals = mesh.normals.as_ref()?;
        let is_opposed = |t: usize| {
            let [a, b, c] = mesh_corners(mesh, t);
            let front = area_vector_2(a, b, c).normalize_or_zero();
            mesh.triangles[t].iter().all(|&k| vec(normals[k as usize]).normalize_or_zero().dot(front) < OPPOSED)
        };
        let flags: Vec<bool> = (0..mesh.triangles.len()).map(is_opposed).collect();
        let triangles = subject.placed_where(i, |t| flags[t]);
        let area = subject.area(&triangles);
        let share = area / subject.area(subject.placed(i));
        (!triangles.is_empty()).then(|| Finding {
            kind: Kind::FlippedNormals,
            // Of a two-sided surface no light is lost, and its shading follows the side that is seen.
            severity: if subject.is_two_sided(i) || share < SHARE { Severity::Note } else { Severity::Warning },
            element: subject.mesh_element(i),
            count: triangles.len(),
            area,
            worst: Worst { value: share, unit: "share" },
            message: format!(
                "vertex normals of {} triangles ({:.1} % of its area) point to their backs: winding or normals are reversed",
                triangles.len(),
                100.0 * share
            ),
            triangles,
        })
    };
    subject.meshes().filter_map(of_mesh).collect()
}
