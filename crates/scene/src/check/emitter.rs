//! Light from hardly any area.

use std::f64::consts::PI;

use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::Subject;

/// Part of a sphere with half of the scene's diagonal as radius: what a ray finds by chance once in a million.
const FOUND: f64 = 1e-6;
/// Of all emitted power, what is worth a warning.
const POWER: f64 = 0.01;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let patches = subject.patches;
    let mut sums = vec![[0.0f64; 2]; subject.scene.instances.len()];
    let mut triangles = vec![Vec::new(); sums.len()];
    for patch in patches.patches().filter(|&p| !patches.emission(p).is_black()) {
        let (triangle, area) = (patches.triangle_of(patch), patches.area(patch));
        let instance = subject.instance_of(triangle);
        sums[instance][0] += area;
        sums[instance][1] += PI * area * patches.emission(patch).luminance();
        if triangles[instance].last() != Some(&triangle) {
            triangles[instance].push(triangle);
        }
    }
    let all: f64 = sums.iter().map(|s| s[1]).sum();
    let sphere = PI * subject.diagonal().powi(2);
    let of_instance = |(i, (&[area, power], triangles)): (usize, (&[f64; 2], Vec<u32>))| {
        let (found, share) = (area / sphere, power / all);
        (area > 0.0 && found < FOUND && share > POWER).then(|| Finding {
            kind: Kind::TinyEmitter,
            severity: Severity::Warning,
            element: subject.instance_element(i),
            count: triangles.len(),
            area,
            worst: Worst { value: found, unit: "share" },
            message: format!("{:.1} % of the emitted power comes from {:.3} cm²", 100.0 * share, 1e4 * area),
            triangles,
        })
    };
    sums.iter().zip(triangles).enumerate().filter_map(of_instance).collect()
}
