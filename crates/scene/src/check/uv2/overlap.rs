//! Places on the lightmap that several triangles of a mesh have.

use rayon::prelude::*;

use super::super::boxes::{BoxTree, around};
use super::super::clip::{cross, shared};
use super::super::finding::{Finding, Kind, Severity, Worst};
use super::super::subject::{Subject, count};
use super::{is_flat, uvs};

/// Overlaps narrower than this are rounding of single-precision coordinates, in units of the page.
const NARROW: f64 = 1e-5;
/// Share of the charts' area that is there twice, from which on light is plainly wrong.
const PLAIN: f64 = 0.01;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let of_mesh = |(i, mesh)| {
        let uvs = uvs(mesh)?;
        let tree = BoxTree::new(uvs.iter().map(|uv| around(uv, 0.0)).collect());
        let area: Vec<f64> = uvs.iter().map(|uv| 0.5 * cross(uv[0], uv[1], uv[2]).abs()).collect();
        let twice: Vec<f64> = (0..uvs.len())
            .into_par_iter()
            .map(|t| {
                let mut sum = 0.0;
                if is_flat(uvs[t]) {
                    return sum;
                }
                tree.meeting(&around(&uvs[t], 0.0), |other| {
                    let other = other as usize;
                    if other != t && !is_flat(uvs[other]) {
                        let common = shared(uvs[t], uvs[other]);
                        sum += if common.width > NARROW { common.area } else { 0.0 };
                    }
                    // Once all of it is covered, more does not matter: stacked charts would take squares of time.
                    sum < area[t]
                });
                sum.min(area[t])
            })
            .collect();
        let flags: Vec<bool> = twice.iter().map(|&a| a > 0.0).collect();
        let share = twice.iter().sum::<f64>() / area.iter().sum::<f64>();
        if !flags.contains(&true) {
            return None;
        }
        let triangles = subject.placed_where(i, |t| flags[t]);
        Some(Finding {
            kind: Kind::Uv2Overlap,
            severity: if share > PLAIN { Severity::Error } else { Severity::Warning },
            element: subject.mesh_element(i),
            count: count(&flags),
            area: subject.area(&triangles),
            worst: Worst { value: share, unit: "share" },
            message: format!(
                "{} of {} triangles overlap others, {:.2} % of the charts' area",
                count(&flags),
                uvs.len(),
                100.0 * share
            ),
            triangles,
        })
    };
    subject.meshes().filter_map(of_mesh).collect()
}
