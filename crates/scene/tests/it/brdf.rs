//! Every BRDF over a grid of widths and angles, a million samples each: chi² against the density, and energy.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::Rgb;
use twinray_scene::brdf::{Brdf, Ggx, Phong};
use twinray_scene::sample::Stream;
use twinray_testkit::chi2;
use twinray_testkit::ztest::Mean;

const SAMPLES: u64 = 1_000_000;
/// The horizon of +Z is a border of cells, so that quadrature and samples agree there.
const NORMAL: DVec3 = DVec3::Z;
const COSINES: [f64; 3] = [0.95, 0.5, 0.1];

/// White wherever there is a choice: any energy too much shows.
fn cases() -> Vec<(String, Brdf)> {
    let mut cases = vec![("lambertian".to_owned(), Brdf::Lambertian { reflectance: Rgb::WHITE })];
    for metallic in [0.0, 1.0] {
        for roughness in [0.2, 0.35, 0.6, 1.0] {
            let ggx = Ggx::new(Rgb::WHITE, metallic, roughness, 1.0, Rgb::WHITE, 1.5);
            cases.push((format!("metalness {metallic}, roughness {roughness}"), Brdf::Ggx(ggx)));
        }
    }
    for exponent in [1.0, 10.0, 100.0, 1000.0] {
        let phong = Phong::new(Rgb::grey(0.4), Rgb::grey(0.6), exponent);
        cases.push((format!("exponent {exponent}"), Brdf::Phong(phong)));
    }
    cases
}

#[test]
fn a_million_samples_follow_the_density_and_carry_no_more_than_arrives() {
    let cases = cases();
    let all: Vec<(&str, &Brdf, f64)> =
        cases.iter().flat_map(|(name, brdf)| COSINES.map(|cosine| (name.as_str(), brdf, cosine))).collect();
    // Šidák: with fresh seeds all of them together would fail one time in a hundred.
    let threshold = 1.0 - 0.99f64.powf(1.0 / all.len() as f64);
    let outcomes: Vec<(f64, Mean)> =
        all.par_iter().enumerate().map(|(i, (_, brdf, cosine))| sample(brdf, *cosine, i as u64)).collect();
    let (mut least, mut most) = (1.0f64, 0.0f64);
    for ((name, brdf, cosine), (p, energy)) in all.iter().zip(&outcomes) {
        println!("{name}, cosine {cosine}: p = {p:.4}, energy {:.4} ± {:.4}", energy.value, energy.error);
        assert!(*p > threshold, "{name}, cosine {cosine}: p = {p}, threshold {threshold}");
        assert!(energy.value < 1.01, "{name}, cosine {cosine}: reflects {energy:?}");
        // Four standard errors, and the table's interpolation, which is good to a thousandth.
        let albedo = brdf.albedo(*cosine).g;
        assert!((energy.value - albedo).abs() < 4.0 * energy.error + 0.001, "{name}: {energy:?} against {albedo}");
        (least, most) = (least.min(*p), most.max(energy.value));
    }
    println!("{} cases: least p {least:.5}, threshold {threshold:.5}, most energy {most:.4}", all.len());
}

/// The p-value of a chi² test, and the share of the light that is reflected, both from the same samples.
fn sample(brdf: &Brdf, cosine: f64, number: u64) -> (f64, Mean) {
    let sine = (1.0 - cosine * cosine).sqrt();
    let wi = DVec3::new(0.6 * sine, 0.8 * sine, cosine);
    let mut stream = Stream::new(47, number, 0);
    let mut weights = Vec::with_capacity(SAMPLES as usize);
    let samples: Vec<Option<[f64; 3]>> = (0..SAMPLES)
        .map(|_| {
            let wo = brdf.sample(NORMAL, wi, [stream.uniform(), stream.uniform()]);
            let weight = |wo| brdf.eval(NORMAL, wi, wo).g * NORMAL.dot(wo) / brdf.pdf(NORMAL, wi, wo);
            weights.push(wo.map_or(0.0, weight));
            wo.map(|wo| wo.to_array())
        })
        .collect();
    let density = |d: [f64; 3]| if d[2] > 0.0 { brdf.pdf(NORMAL, wi, DVec3::from_array(d)) } else { 0.0 };
    let p = chi2::sphere(samples.into_iter(), density, 24, 48).p_value;
    (p, Mean::of(&weights))
}
