//! One-sided surfaces that light meets from behind.

use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::Subject;
use super::walks::{Walks, is_back};

/// Fewer rays are those that slip into cracks.
const RAYS: usize = 20;
/// Share of the rays to an instance that end on backs: from here on worth a warning, and an error.
const SHARES: [f64; 2] = [0.02, 0.5];

pub fn find(subject: &Subject, walks: &Walks) -> Vec<Finding> {
    let mut met = vec![[0usize; 2]; subject.scene.instances.len()];
    let mut behind = vec![false; subject.sources.len()];
    for hit in walks.0.iter().filter_map(|step| step.hit) {
        let back = is_back(subject, &hit);
        met[subject.instance_of(hit.triangle)][usize::from(back)] += 1;
        behind[hit.triangle as usize] |= back;
    }
    let mut triangles = vec![Vec::new(); met.len()];
    subject.triangles().filter(|&t| behind[t as usize]).for_each(|t| triangles[subject.instance_of(t)].push(t));
    let of_instance = |(i, (&[front, back], triangles)): (usize, (&[usize; 2], Vec<u32>))| {
        let share = back as f64 / (front + back).max(1) as f64;
        // The back of a lamp is black, and nobody minds unless most of the light is behind it.
        let emits = !subject.scene.materials[subject.scene.meshes[subject.scene.instances[i].mesh].material]
            .emission
            .is_black();
        (back >= RAYS && share >= SHARES[usize::from(emits)]).then(|| Finding {
            kind: Kind::FlippedNormals,
            severity: if share >= SHARES[1] { Severity::Error } else { Severity::Warning },
            element: subject.instance_element(i),
            count: back,
            area: subject.area(&triangles),
            worst: Worst { value: share, unit: "share" },
            message: format!(
                "{:.0} % of the rays to it end on backs of one-sided triangles ({back} of {})",
                100.0 * share,
                front + back
            ),
            triangles,
        })
    };
    met.iter().zip(triangles).enumerate().filter_map(of_instance).collect()
}
