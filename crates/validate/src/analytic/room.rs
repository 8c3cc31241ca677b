//! The 4 × 4 × 4 m room with a lamp of 10 000 lm: mean inter-reflected illuminance at eleven albedos.

use twinray::solve::Params;

use crate::case::{Case, Effort, Row};
use crate::rig::{Group, Rectangle, Rig, sequence_bias};

/// Φρ/(S(1−ρ)), exact for any closed room of one albedo, wherever the lamp is.
pub fn room(effort: Effort) -> Case {
    let (flux, side) = (10_000.0, 4.0);
    let mut rows = Vec::new();
    for albedo in effort.thin(&[0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95]) {
        let mut rig = Rig::default();
        let (wall, lamp) = (rig.material(albedo, 0.0), rig.material(albedo, flux));
        let groups = closed_room(&mut rig, [side; 3], wall, lamp);
        let areas = rig.areas();
        let surface: f64 = groups.iter().map(|&g| areas[g]).sum();
        let measured = rig.measure(&Params::default_preset(800), effort.rays(1 << 18));
        // The mean of direct light is Φ/S to the last digit: every ray of the lamp arrives.
        let reflected: Vec<f64> = measured.mean_of(&groups, &areas).iter().map(|e| e - flux / surface).collect();
        let rho = f64::from(albedo as f32);
        let expected = flux / surface * rho / (1.0 - rho);
        let resolution = effort.resolution(if albedo > 0.85 { 8e-3 } else { 2e-3 });
        // Irradiance is kept in single precision, and direct light was taken away.
        let rounding = 1e-6 * flux / surface + sequence_bias(albedo) * expected;
        rows.push(Row::statistical(format!("ρ = {albedo}"), expected, &reflected, rounding, resolution));
    }
    Case {
        title: "Inter-reflected illuminance of a room",
        story: "A closed room of 4 × 4 × 4 m, S = 96 m², every surface of albedo ρ, and a lamp of 1 m² in the ceiling that emits \
                10 000 lm. The mean inter-reflected illuminance is Φρ/(S(1−ρ)) by energy conservation, wherever the lamp is; measured \
                is the mean of all illuminance less the direct Φ/S. 792 patches, 2¹⁸ rays, default preset."
            .to_owned(),
        quantity: "illuminance, lx",
        rows,
    }
}

/// Floor, four walls and a ceiling with a lamp of 1 m² in its middle; all groups.
pub(crate) fn closed_room(rig: &mut Rig, [x, y, z]: [f64; 3], wall: usize, lamp: usize) -> Vec<Group> {
    let groups: Vec<Group> = (0..7).map(|_| rig.group()).collect();
    let faces = [
        Rectangle::new([0.0; 3], [0.0, 0.0, z], [x, 0.0, 0.0]),
        Rectangle::new([0.0; 3], [0.0, y, 0.0], [0.0, 0.0, z]),
        Rectangle::new([x, 0.0, 0.0], [0.0, 0.0, z], [0.0, y, 0.0]),
        Rectangle::new([0.0; 3], [x, 0.0, 0.0], [0.0, y, 0.0]),
        Rectangle::new([0.0, 0.0, z], [0.0, y, 0.0], [x, 0.0, 0.0]),
    ];
    for (face, &group) in faces.iter().zip(&groups) {
        rig.rectangle(group, wall, face, [8, 8]);
    }
    let ceiling = Rectangle::new([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]);
    let middle = |side: f64| [0.5 * (side - 1.0) / side, 0.5 * (side + 1.0) / side];
    let (around, hole) = ceiling.around(middle(x), middle(z));
    around.iter().for_each(|part| rig.rectangle(groups[5], wall, part, [3, 3]));
    rig.rectangle(groups[6], lamp, &hole, [2, 2]);
    groups
}
