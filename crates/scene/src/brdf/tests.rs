//! Every BRDF: samples follow their densities, albedos are the integrals they claim, energy and reciprocity hold.

use twinray_testkit::chi2;

use super::*;
use crate::sample::Stream;

fn cases() -> Vec<(&'static str, Brdf)> {
    let ggx =
        |metallic, roughness| Brdf::Ggx(Ggx::new(Rgb::new(0.9, 0.6, 0.3), metallic, roughness, 1.0, Rgb::WHITE, 1.5));
    let phong = |n| Brdf::Phong(Phong::new(Rgb::new(0.3, 0.2, 0.1), Rgb::grey(0.5), n));
    vec![
        ("lambertian", Brdf::Lambertian { reflectance: Rgb::grey(0.7) }),
        ("dielectric .3", ggx(0.0, 0.3)),
        ("dielectric .6", ggx(0.0, 0.6)),
        ("dielectric 1", ggx(0.0, 1.0)),
        ("metal .5", ggx(1.0, 0.5)),
        ("half metal .8", ggx(0.5, 0.8)),
        ("phong 5", phong(5.0)),
        ("phong 30", phong(30.0)),
        ("phong 100", phong(100.0)),
    ]
}

const NORMAL: DVec3 = DVec3::new(0.6, 0.48, 0.64);
const COSINES: [f64; 4] = [0.999, 0.8, 0.4, 0.1];

fn direction(cosine: f64) -> DVec3 {
    let frame = crate::geom::Frame::from_normal(NORMAL);
    let s = (1.0 - cosine * cosine).sqrt();
    frame.to_world(DVec3::new(s * 0.6, s * 0.8, cosine))
}

#[test]
fn samples_follow_their_density() {
    for (name, brdf) in cases() {
        for (i, cosine) in COSINES.into_iter().enumerate() {
            let wi = direction(cosine);
            let mut stream = Stream::new(21, i as u64, 0);
            let samples = (0..200_000)
                .map(|_| brdf.sample(NORMAL, wi, [stream.uniform(), stream.uniform()]).map(|d| d.to_array()));
            let outcome = chi2::sphere(samples, |d| brdf.pdf(NORMAL, wi, DVec3::from_array(d)), 24, 48);
            // 36 tests at .1 %: a false-alarm rate of 3.5 % for fresh seeds.
            assert!(outcome.p_value > 1e-3, "{name}, cosine {cosine}: {outcome:?}");
        }
    }
}

#[test]
fn albedo_is_the_integral_of_the_brdf() {
    for (name, brdf) in cases() {
        for cosine in COSINES {
            let wi = direction(cosine);
            let mut stream = Stream::new(22, 0, 0);
            let samples: Vec<f64> = (0..100_000)
                .map(|_| {
                    brdf.sample(NORMAL, wi, [stream.uniform(), stream.uniform()])
                        .map_or(0.0, |wo| brdf.eval(NORMAL, wi, wo).g * NORMAL.dot(wo) / brdf.pdf(NORMAL, wi, wo))
                })
                .collect();
            let mean = twinray_testkit::ztest::Mean::of(&samples);
            let albedo = brdf.albedo(cosine).g;
            // Four standard errors of the estimate and the table's own interpolation error.
            let tolerance = 4.0 * mean.error + 0.004;
            assert!((mean.value - albedo).abs() < tolerance, "{name}, cosine {cosine}: {mean:?} against {albedo}");
        }
    }
}

#[test]
fn no_brdf_creates_energy_and_all_are_reciprocal() {
    let white = Brdf::Ggx(Ggx::new(Rgb::WHITE, 0.0, 0.3, 1.0, Rgb::WHITE, 1.5));
    for (name, brdf) in cases().into_iter().chain([("white", white)]) {
        for i in 1..=50 {
            let albedo = brdf.albedo(f64::from(i) / 50.0).max_channel();
            assert!(albedo <= 1.0 + 1e-9, "{name}: albedo {albedo}");
        }
        let mut stream = Stream::new(23, 0, 0);
        for _ in 0..1000 {
            let mut any = || {
                let local = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
                crate::geom::Frame::from_normal(NORMAL).to_world(local)
            };
            let (a, b) = (any(), any());
            let (ab, ba) = (brdf.eval(NORMAL, a, b), brdf.eval(NORMAL, b, a));
            assert!((ab.g - ba.g).abs() <= 1e-9 * ab.g.max(1.0), "{name}: {ab:?} {ba:?}");
        }
    }
}

#[test]
fn a_specular_factor_of_zero_is_lambertian() {
    let brdf = Brdf::Ggx(Ggx::new(Rgb::grey(0.6), 0.0, 0.5, 0.0, Rgb::WHITE, 1.5));
    let value = brdf.eval(NORMAL, direction(0.9), direction(0.2)).g;
    assert!((value - 0.6 / PI).abs() < 1e-12);
    assert!((brdf.mean_albedo().g - 0.6).abs() < 1e-12);
}
