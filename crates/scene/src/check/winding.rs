//! Meshes whose neighbouring triangles face opposite ways.

use std::collections::HashMap;

use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::{Subject, mesh_corners};
use crate::authored::Mesh;
use crate::geom::area_vector_2;

/// Share of a mesh's area that is worth a warning.
const SHARE: f64 = 1e-3;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let of_mesh = |(i, mesh): (usize, &Mesh)| {
        let flags = turned(mesh);
        let triangles = subject.placed_where(i, |t| flags[t]);
        let area = subject.area(&triangles);
        let share = area / subject.area(subject.placed(i));
        (!triangles.is_empty()).then(|| Finding {
            kind: Kind::FlippedNormals,
            severity: if subject.is_two_sided(i) || share < SHARE { Severity::Note } else { Severity::Warning },
            element: subject.mesh_element(i),
            count: triangles.len(),
            area,
            worst: Worst { value: share, unit: "share" },
            message: format!(
                "{} triangles ({:.1} % of its area) are wound against their neighbours",
                triangles.len(),
                100.0 * share
            ),
            triangles,
        })
    };
    subject.meshes().filter_map(of_mesh).collect()
}

/// Triangles that face another way than most of the surface they are joined to. Only edges that exactly two triangles share join.
fn turned(mesh: &Mesh) -> Vec<bool> {
    let key = |k: u32| mesh.positions[k as usize].map(|x| (x + 0.0).to_bits());
    // Per edge: its triangles, each with whether it runs from the lower to the higher end.
    let mut edges: HashMap<_, Vec<(u32, bool)>> = HashMap::new();
    for (t, corners) in (0u32..).zip(&mesh.triangles) {
        for k in 0..3 {
            let (a, b) = (key(corners[k]), key(corners[(k + 1) % 3]));
            edges.entry((a.min(b), a.max(b))).or_default().push((t, a < b));
        }
    }
    // Per triangle: neighbours, and whether they are wound alike.
    let mut joined = vec![Vec::new(); mesh.triangles.len()];
    for pair in edges.values() {
        let [(s, s_up), (t, t_up)] = pair[..] else { continue };
        joined[s as usize].push((t, s_up != t_up));
        joined[t as usize].push((s, s_up != t_up));
    }
    let area = |t: usize| {
        let [a, b, c] = mesh_corners(mesh, t);
        area_vector_2(a, b, c).length()
    };
    let mut facing: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut flags = vec![false; mesh.triangles.len()];
    for start in 0..mesh.triangles.len() {
        if facing[start].is_some() {
            continue;
        }
        facing[start] = Some(true);
        let (mut surface, mut next, mut is_orientable) = (vec![start], 0, true);
        while next < surface.len() {
            let t = surface[next];
            next += 1;
            for &(other, alike) in &joined[t] {
                let wanted = facing[t] == Some(alike);
                match facing[other as usize] {
                    None => {
                        facing[other as usize] = Some(wanted);
                        surface.push(other as usize);
                    }
                    Some(is) => is_orientable &= is == wanted,
                }
            }
        }
        // A Möbius strip has no right way round.
        if !is_orientable {
            continue;
        }
        // Sums must not depend on the order in which the map gave the edges.
        surface.sort_unstable();
        let sum = |way: bool| surface.iter().filter(|&&t| facing[t] == Some(way)).map(|&t| area(t)).sum::<f64>();
        let wrong = sum(true) < sum(false);
        surface.iter().for_each(|&t| flags[t] = facing[t] == Some(wrong));
    }
    flags
}
