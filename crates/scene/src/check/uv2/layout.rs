//! Second texture coordinates that are missing, outside of [0, 1], or without area.

use super::super::finding::{Element, Finding, Kind, Severity, Worst};
use super::super::subject::{Subject, count};
use super::{is_flat, uvs};

/// Rounding of coordinates beyond [0, 1].
const BEYOND: f64 = 1e-4;
/// Share of a mesh's area that is worth a warning.
const SHARE: f64 = 1e-3;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let mut found = missing(subject);
    for (i, mesh) in subject.meshes() {
        let Some(uvs) = uvs(mesh) else { continue };
        let beyond = |c: f64| (-c).max(c - 1.0);
        let most = |t: usize| uvs[t].iter().flatten().map(|&c| beyond(c)).fold(0.0, f64::max);
        let outside: Vec<bool> = (0..uvs.len()).map(|t| most(t) > BEYOND).collect();
        let flat: Vec<bool> = uvs.iter().map(|&uv| is_flat(uv)).collect();
        let worst = (0..uvs.len()).map(most).fold(0.0, f64::max);
        let total = subject.area(subject.placed(i));
        if outside.contains(&true) {
            let triangles = subject.placed_where(i, |t| outside[t]);
            found.push(Finding {
                kind: Kind::Uv2Outside,
                severity: Severity::Warning,
                element: subject.mesh_element(i),
                count: count(&outside),
                area: subject.area(&triangles),
                worst: Worst { value: worst, unit: "UV" },
                message: format!("{} of {} triangles reach up to {worst:.4} outside", count(&outside), uvs.len()),
                triangles,
            });
        }
        let triangles = subject.placed_where(i, |t| flat[t]);
        if !triangles.is_empty() {
            let area = subject.area(&triangles);
            let share = area / total;
            found.push(Finding {
                kind: Kind::Uv2Degenerate,
                severity: if share > SHARE { Severity::Warning } else { Severity::Note },
                element: subject.mesh_element(i),
                count: count(&flat),
                area,
                worst: Worst { value: share, unit: "share" },
                message: format!("{} triangles, {:.2} % of its area, have none there", count(&flat), 100.0 * share),
                triangles,
            });
        }
    }
    found
}

/// One note where nobody has any; warnings where some have.
fn missing(subject: &Subject) -> Vec<Finding> {
    let without: Vec<usize> = subject.meshes().filter(|(_, m)| m.second_texcoords.is_none()).map(|(i, _)| i).collect();
    let meshes = subject.meshes().count();
    let finding = |severity, element, count, triangles: Vec<u32>, message| Finding {
        kind: Kind::Uv2Missing,
        severity,
        element,
        count,
        area: subject.area(&triangles),
        worst: Worst { value: without.len() as f64 / meshes as f64, unit: "share" },
        message,
        triangles,
    };
    if without.len() == meshes {
        let message = format!("none of {meshes} meshes has second texture coordinates");
        return vec![finding(Severity::Note, Element::Scene, meshes, Vec::new(), message)];
    }
    let of_mesh = |&i: &usize| {
        let message = format!("has none, while {} of {meshes} meshes have", meshes - without.len());
        finding(Severity::Warning, subject.mesh_element(i), 1, subject.placed(i).to_vec(), message)
    };
    without.iter().map(of_mesh).collect()
}
