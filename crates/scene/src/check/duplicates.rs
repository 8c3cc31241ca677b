//! Surfaces twice in one place: triangles of one plane that face the same way and overlap.
//!
//! Those that face opposite ways are the two sides of a sheet, or a foot on its floor.

use glam::DVec3;
use rayon::prelude::*;

use super::boxes::{BoxTree, around};
use super::clip::{self, Point};
use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::Subject;
use crate::geom::{Frame, area_vector_2};

/// Distance of two planes, in parts of the smaller triangle's size.
const APART: f64 = 1e-4;
/// Share of the smaller triangle that must be there twice.
const SHARE: f64 = 0.01;
/// Share of an instance's area that is worth a warning.
const LITTLE: f64 = 1e-3;
/// Share of the scene's area that is: less is some square centimetres in a hall.
const SPECK: f64 = 1e-6;
/// Cosine between planes that are one.
const PARALLEL: f64 = 1.0 - 1e-6;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let corners: Vec<[DVec3; 3]> = subject.triangles().map(|t| subject.corners(t)).collect();
    let size: Vec<f64> = subject.triangles().map(|t| subject.patches.triangle_area(t).sqrt()).collect();
    let boxes = corners.iter().zip(&size).map(|(c, s)| around(&c.map(|p| p.to_array()), APART * s)).collect();
    let tree = BoxTree::new(boxes);
    // Per triangle: area that a lower-numbered or larger one has as well.
    let doubled: Vec<f64> = subject
        .triangles()
        .into_par_iter()
        .map(|t| {
            let own = corners[t as usize];
            let area = size[t as usize].powi(2);
            let mut sum = 0.0;
            tree.meeting(&around(&own.map(|p| p.to_array()), APART * size[t as usize]), |other| {
                if other != t {
                    sum += shared(subject, &corners, &size, t, other);
                }
                sum < area
            });
            sum.min(area)
        })
        .collect();
    let mut triangles = vec![Vec::new(); subject.scene.instances.len()];
    for t in subject.triangles().filter(|&t| doubled[t as usize] > SHARE * size[t as usize].powi(2)) {
        triangles[subject.instance_of(t)].push(t);
    }
    let of_instance = |i: usize| -> Vec<u32> { subject.triangles().filter(|&t| subject.instance_of(t) == i).collect() };
    let speck = SPECK * subject.patches.total_area();
    let finding = |(i, triangles): (usize, Vec<u32>)| {
        let twice: f64 = triangles.iter().map(|&t| doubled[t as usize]).sum();
        (!triangles.is_empty()).then(|| Finding {
            kind: Kind::CoplanarDuplicates,
            severity: if twice < speck.max(LITTLE * subject.area(&of_instance(i))) {
                Severity::Note
            } else {
                Severity::Warning
            },
            element: subject.instance_element(i),
            count: triangles.len(),
            area: twice,
            worst: Worst { value: twice, unit: "m²" },
            message: format!(
                "{} triangles share {twice:.4} m² of their planes with others that face the same way",
                triangles.len()
            ),
            triangles,
        })
    };
    triangles.into_iter().enumerate().filter_map(finding).collect()
}

/// Area that two triangles have in common, if they lie in one plane, face one way, and can be seen.
fn shared(subject: &Subject, corners: &[[DVec3; 3]], size: &[f64], t: u32, other: u32) -> f64 {
    let [own, met] = [corners[t as usize], corners[other as usize]];
    let front = |[a, b, c]: [DVec3; 3]| area_vector_2(a, b, c).normalize_or_zero();
    let (normal, small) = (front(own), size[t as usize].min(size[other as usize]));
    if normal.dot(front(met)) < PARALLEL {
        return 0.0;
    }
    let frame = Frame::from_normal(normal);
    let flat = |p: DVec3| -> Point { [(p - own[0]).dot(frame.x), (p - own[0]).dot(frame.y)] };
    let common = clip::shared(own.map(flat), met.map(flat));
    if common.area <= SHARE * small * small {
        return 0.0;
    }
    let middle = own[0] + frame.x * common.middle[0] + frame.y * common.middle[1];
    if (middle - met[0]).dot(front(met)).abs() > APART * small {
        return 0.0;
    }
    // What another body covers is never seen: feet on one floor.
    let lift = middle + normal * (10.0 * APART * small);
    let is_covered = subject.patches.trace(lift, normal).is_some_and(|hit| hit.t < 0.1 * small);
    if is_covered { 0.0 } else { common.area }
}
