//! Lengths and light of another order of magnitude than rooms have.

use super::finding::{Element, Finding, Kind, Severity, Worst};
use super::subject::Subject;
use super::walks::Walks;
use crate::authored::LightKind;

/// Diagonals of scenes that are lit as rooms, streets or furniture, metres.
const SIZES: [f64; 2] = [0.5, 1000.0];

/// What light travels from surface to surface on average, metres: 2 in rooms, 15 in cathedrals, 60 in stadiums. A small room in
/// centimetres has more than 100, and is not a kilometre across.
const FREE: f64 = 80.0;
/// Fewer rays have no average.
const RAYS: usize = 1000;

/// Mean illuminance of surfaces by lamps, lx (or W/m²): from below moonlight to above sunlight.
const LEVELS: [f64; 2] = [0.1, 1e6];

/// More than any sun gives, lx.
const SUN: f64 = 2e5;

pub fn find(subject: &Subject, walks: &Walks) -> Vec<Finding> {
    let mut found = Vec::new();
    let area = subject.patches.total_area();
    let mut report = |element, area, value, unit, message| {
        let worst = Worst { value, unit };
        let (kind, severity) = (Kind::Units, Severity::Warning);
        found.push(Finding { kind, severity, element, count: 1, area, worst, message, triangles: Vec::new() });
    };
    let size = subject.diagonal();
    let free = free_path(walks).filter(|&free| free > FREE);
    if size < SIZES[0] {
        let message =
            format!("{size:.4} m from corner to corner: smaller than a shoe box, lengths may not be in metres");
        report(Element::Scene, area, size, "m", message);
    } else if size > SIZES[1] {
        let message = format!("{size:.0} m from corner to corner: lengths may be in millimetres or centimetres");
        report(Element::Scene, area, size, "m", message);
    } else if let Some(free) = free {
        let message = format!(
            "light travels {free:.0} m from surface to surface on average, as in no room: lengths may be in millimetres or centimetres"
        );
        report(Element::Scene, area, free, "m", message);
    }
    let power = (subject.patches.emitted_power() + subject.patches.near_lights_power()).luminance();
    let level = power / area;
    if power > 0.0 && !(LEVELS[0]..=LEVELS[1]).contains(&level) {
        let than = if level < LEVELS[0] { "darker than a moonlit night" } else { "brighter than ten suns" };
        let message = format!(
            "lamps send {power:.3} lm, {level:.3e} lx on all of its area: {than}, so the factors of 683 lm/W or of π may be missing or doubled"
        );
        report(Element::Scene, area, level, "lx", message);
    }
    for (i, light) in subject.scene.lights.iter().enumerate() {
        let lux = light.intensity.luminance();
        if light.kind == LightKind::Directional && lux > SUN {
            let message = format!("{lux:.0} lx, brighter than the sun (1e5 lx): its unit may be another");
            report(Element::Light(i, light.name.clone()), 0.0, lux, "lx", message);
        }
    }
    found
}

/// What rays travel from surface to surface on average, metres, if enough of them meet one.
fn free_path(walks: &Walks) -> Option<f64> {
    let lengths = || walks.0.iter().filter(|step| step.from.is_some()).filter_map(|step| step.hit).map(|hit| hit.t);
    let count = lengths().count();
    (count >= RAYS).then(|| lengths().sum::<f64>() / count as f64)
}
