//! Charts so near each other that filters mix their light.

use rayon::prelude::*;

use super::super::boxes::{BoxTree, around};
use super::super::clip::{gap, shared};
use super::super::finding::{Finding, Kind, Severity, Worst};
use super::super::subject::{Subject, count};
use super::charts::charts;
use super::uvs;

/// Texels between charts that a bilinear filter needs: half a texel's reach and its rounding, on both sides.
const TEXELS: f64 = 2.0;

pub fn find(subject: &Subject, texture_size: u32) -> Vec<Finding> {
    let texels = f64::from(texture_size);
    let reach = TEXELS / texels;
    let of_mesh = |(i, mesh)| {
        let (uvs, charts) = (uvs(mesh)?, charts(mesh));
        let tree = BoxTree::new(uvs.iter().map(|uv| around(uv, 0.0)).collect());
        // Those that overlap are another finding.
        let nearest: Vec<f64> = (0..uvs.len())
            .into_par_iter()
            .map(|t| {
                let mut least = f64::INFINITY;
                tree.meeting(&around(&uvs[t], reach), |other| {
                    let other = other as usize;
                    if charts[t] != charts[other] && shared(uvs[t], uvs[other]).area == 0.0 {
                        least = least.min(gap(uvs[t], uvs[other]));
                    }
                    least > 0.0
                });
                least * texels
            })
            .collect();
        // A little less than that is rounding of the coordinates.
        let flags: Vec<bool> = nearest.iter().map(|&d| d < TEXELS - 0.01).collect();
        let least = nearest.iter().copied().fold(f64::INFINITY, f64::min);
        if !flags.contains(&true) {
            return None;
        }
        let triangles = subject.placed_where(i, |t| flags[t]);
        Some(Finding {
            kind: Kind::Uv2Padding,
            severity: if least < 0.5 * TEXELS { Severity::Warning } else { Severity::Note },
            element: subject.mesh_element(i),
            count: count(&flags),
            area: subject.area(&triangles),
            worst: Worst { value: least, unit: "texels" },
            message: format!(
                "{} triangles are nearer than {TEXELS} texels to another chart at {texture_size} x {texture_size}, {least:.2} at the least",
                count(&flags)
            ),
            triangles,
        })
    };
    subject.meshes().filter_map(of_mesh).collect()
}
