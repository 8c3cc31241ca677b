//! Reflectance beyond what paint has.

use super::finding::{Element, Finding, Kind, Severity, Worst};
use super::subject::Subject;
use crate::brdf::Brdf;

const BRIGHT: f64 = 0.9;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let patches = subject.patches;
    // Per material: area, reflectance times area, the brightest patch. Metals and glass may well be as bright.
    let mut sums = vec![[0.0f64; 3]; subject.scene.materials.len()];
    for patch in patches.patches() {
        let brdf = patches.brdf(patch);
        let is_metal = matches!(&brdf, Brdf::Ggx(_))
            && brdf.base_reflectance(1.0).luminance() < 0.5 * brdf.mean_albedo().luminance();
        if is_metal || patches.material(patch).transmission.is_some() {
            continue;
        }
        let (area, albedo) = (patches.area(patch), brdf.mean_albedo().luminance());
        let [total, light, most] = &mut sums[patches.material_of(patch)];
        *total += area;
        *light += area * albedo;
        *most = most.max(albedo);
    }
    let of_material = |(i, &[area, light, most]): (usize, &[f64; 3])| {
        let mean = light / area;
        (area > 0.0 && mean > BRIGHT).then(|| Finding {
            kind: Kind::BrightAlbedo,
            severity: Severity::Warning,
            element: Element::Material(i, subject.scene.materials[i].name.clone()),
            count: 1,
            area,
            worst: Worst { value: mean, unit: "albedo" },
            message: format!(
                "albedo {mean:.3} on average, {most:.3} where it is brightest, textures included; {area:.3} m²"
            ),
            triangles: subject.triangles().filter(|&t| patches.material_index(t) == i).collect(),
        })
    };
    sums.iter().enumerate().filter_map(of_material).collect()
}
