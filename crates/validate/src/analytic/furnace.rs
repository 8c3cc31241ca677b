//! The furnace: every surface emits 1 and reflects ρ, so irradiance is 1/(1−ρ) everywhere, whatever the geometry.

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::Params;

use crate::case::{Case, Effort, Row};
use crate::rig::{REPLICAS, replicas, sequence_bias};

/// Resolution of the mean at each albedo: what is left of the warm start's noise grows with the number of bounces.
const ALBEDOS: [(f64, f64); 5] = [(0.0, 1e-3), (0.5, 1e-3), (0.8, 1e-3), (0.95, 4e-3), (0.99, 2e-2)];

/// Mean irradiance and its scatter over patches.
pub fn furnace(effort: Effort) -> Case {
    let mut rows = Vec::new();
    for (albedo, resolution) in effort.thin(&ALBEDOS) {
        let options = PatchOptions { budget: PatchBudget::Count(2000), two_sided: false };
        let scene = PatchScene::new(&builtin::furnace(albedo, 1.0), options).expect("a built-in scene");
        let params = Params::default_preset(100);
        let runs = replicas(&scene, &params, effort.rays(1 << 20), REPLICAS, |solution| {
            let mean = solution.arriving_power(&scene).luminance() / scene.total_area();
            let square = |p| scene.area(p) * (solution.irradiance(p).luminance() / mean - 1.0).powi(2);
            let spread = scene.patches().map(square).sum::<f64>() / scene.total_area();
            (mean, spread, solution.rays())
        });
        // Materials are stored in single precision, emission as well.
        let emitted = scene.emitted_power().luminance() / scene.total_area();
        let expected = emitted / (1.0 - f64::from(albedo as f32));
        let means: Vec<f64> = runs.iter().map(|r| r.0).collect();
        rows.push(Row::statistical(
            format!("ρ = {albedo}: mean irradiance"),
            expected,
            &means,
            if albedo > 0.0 { sequence_bias(albedo) * expected } else { 0.0 },
            effort.resolution(resolution),
        ));
        let rms = (runs.iter().map(|r| r.1).sum::<f64>() / runs.len() as f64).sqrt();
        // F1 for equal patches: a forward ray of power P that arrives on one of K patches leaves √(K/N).
        let bound = (scene.len() as f64 / runs[0].2 as f64).sqrt();
        rows.push(Row::at_most(format!("ρ = {albedo}: RMS over patches / mean, at most"), bound, rms));
    }
    Case {
        title: "Furnace",
        story: "Built-in scene `furnace`, a closed room with a box in it: every surface emits radiosity 1 and reflects ρ, so \
                irradiance is 1/(1−ρ) on every patch, whatever the geometry. Any leak, bias or lost ray shows. About 2000 \
                patches, 2²⁰ rays, default preset. The scatter over patches is bounded by what as many independent forward \
                rays would leave, √(K/N)."
            .to_owned(),
        quantity: "irradiance, W·m⁻²",
        rows,
    }
}
