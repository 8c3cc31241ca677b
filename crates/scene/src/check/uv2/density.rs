//! How many texels a metre of surface has.

use super::super::CheckOptions;
use super::super::clip::{Point, cross};
use super::super::finding::{Element, Finding, Kind, Severity, Worst};
use super::super::subject::Subject;
use super::{is_flat, uvs};
use crate::authored::{Mesh, Scene};
use crate::patch::{PatchScene, Side};

/// Ratio between what the densest and the coarsest twentieth of an area have, from which on it is uneven.
const UNEVEN: f64 = 4.0;
/// Share of a page that charts fill; the rest is between them.
const FILLED: f64 = 0.6;

/// Texels for a metre of one triangle of a mesh, of world area `area`, on a page of `size` texels a side. `None` without
/// second texture coordinates.
pub fn texels_per_metre(mesh: &Mesh, triangle: usize, area: f64, size: u32) -> Option<f64> {
    let all = mesh.second_texcoords.as_ref()?;
    let uv: [Point; 3] = mesh.triangles[triangle].map(|k| all[k as usize].map(f64::from));
    let there = 0.5 * cross(uv[0], uv[1], uv[2]).abs();
    Some((there / area).sqrt() * f64::from(size))
}

pub fn find(subject: &Subject, options: &CheckOptions) -> Vec<Finding> {
    let scene: &Scene = subject.scene;
    let mut found: Vec<Finding> = subject.meshes().filter_map(|(i, mesh)| of_mesh(subject, i, mesh, options)).collect();
    if let Some(density) = options.density {
        let patches: &PatchScene = subject.patches;
        let sides = |t: u32| if patches.has_side(t, Side::Back) { 2.0 } else { 1.0 };
        let area: f64 = subject.triangles().map(|t| sides(t) * patches.triangle_area(t)).sum();
        let texels = area * density * density;
        let page = f64::from(options.texture_size).powi(2);
        let pages = (texels / (FILLED * page)).ceil();
        found.push(Finding {
            kind: Kind::TexelDensity,
            severity: Severity::Note,
            element: Element::Scene,
            count: scene.instances.len(),
            area,
            worst: Worst { value: texels, unit: "texels" },
            message: format!(
                "{density} texels for a metre are {:.2} M texels on {area:.2} m², {pages:.0} pages of {size} x {size} filled to {:.0} %",
                1e-6 * texels,
                100.0 * FILLED,
                size = options.texture_size
            ),
            triangles: Vec::new(),
        });
    }
    found
}

fn of_mesh(subject: &Subject, i: usize, mesh: &Mesh, options: &CheckOptions) -> Option<Finding> {
    let uvs = uvs(mesh)?;
    let number = |t: u32| subject.sources[t as usize].triangle as usize;
    let mut densities: Vec<(f64, f64, u32)> = subject
        .placed(i)
        .iter()
        .filter(|&&t| !is_flat(uvs[number(t)]))
        .filter_map(|&t| {
            let area = subject.patches.triangle_area(t);
            Some((texels_per_metre(mesh, number(t), area, options.texture_size)?, area, t))
        })
        .collect();
    densities.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let total: f64 = densities.iter().map(|d| d.1).sum();
    let at = |share: f64| {
        let mut sum = 0.0;
        densities.iter().find(|d| {
            sum += d.1;
            sum >= share * total
        })
    };
    let (low, middle, high) = (at(0.05)?.0, at(0.5)?.0, at(0.95)?.0);
    let (least, most) = (densities.first()?.0, densities.last()?.0);
    let is_uneven = high > UNEVEN * low;
    let is_coarse = options.density.is_some_and(|wish| middle < 0.5 * wish);
    let mut triangles: Vec<u32> = densities.iter().filter(|d| d.0 * 2.0 < middle).map(|d| d.2).collect();
    if is_coarse {
        triangles = subject.placed(i).to_vec();
    }
    triangles.sort_unstable();
    (is_uneven || is_coarse).then(|| Finding {
        kind: Kind::TexelDensity,
        severity: if is_coarse { Severity::Warning } else { Severity::Note },
        element: subject.mesh_element(i),
        count: densities.len(),
        area: total,
        worst: Worst { value: if is_coarse { middle } else { high / low }, unit: if is_coarse { "texels/m" } else { "ratio" } },
        message: format!(
            "{least:.1} to {most:.1} texels for a metre at {size} x {size}, {middle:.1} in the middle; a twentieth of the area has less than {low:.1}, another more than {high:.1}",
            size = options.texture_size
        ),
        triangles,
    })
}
