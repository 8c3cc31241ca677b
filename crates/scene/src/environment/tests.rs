//! All kinds of environments: samplers against densities, power against quadrature, light where maps have it.

use std::sync::Arc;

use twinray_testkit::chi2;

use super::*;
use crate::authored::{EnvironmentMap, RadianceMap, Sky, SkyModel};
use crate::sample::Stream;

/// A map of 16 × 8 pixels, dark but for a gradient and one bright pixel.
fn map(rotation: f64) -> Environment {
    let pixel = |k: usize| match (k % 16, k / 16) {
        (11, 2) => [300.0, 200.0, 100.0],
        (_, row) if row < 4 => [1.0, 1.0 + k as f32 * 0.02, 3.0],
        _ => [0.0; 3],
    };
    let image = RadianceMap { name: "test".into(), width: 16, height: 8, pixels: (0..128).map(pixel).collect() };
    Environment::Map(EnvironmentMap { image: Arc::new(image), rotation, strength: 0.5 })
}

fn all() -> Vec<(&'static str, Environment)> {
    let sun = Some([35.0, 200.0]);
    let sky = |model, sun| Environment::Sky(Sky::natural(model, sun));
    vec![
        ("uniform", Environment::Uniform(Rgb::new(0.5, 1.0, 2.0))),
        ("map", map(0.0)),
        ("turned map", map(2.0)),
        ("uniform sky", sky(SkyModel::Uniform, None)),
        ("overcast", sky(SkyModel::Overcast, None)),
        ("clear", sky(SkyModel::Clear, sun)),
        ("Preetham", sky(SkyModel::Preetham { turbidity: 3.0 }, sun)),
    ]
}

/// 7 tests, each with a false-alarm rate of 1 %. The sun's disc is far smaller than a cell: its samples are counted apart.
#[test]
fn samples_follow_their_density() {
    for (name, environment) in all() {
        let light = EnvironmentLight::new(environment, 3.0);
        let mut stream = Stream::new(31, 0, 0);
        let mut on_disc = 0u32;
        const N: u32 = 400_000;
        let share = light.sun.map_or(0.0, |sun| sun.share);
        let samples = (0..N).map(|_| {
            let d = light.sample_direction([stream.uniform(), stream.uniform()]);
            assert!((d.length() - 1.0).abs() < 1e-12 && light.pdf_direction(d) > 0.0);
            let covered = light.sun.is_some_and(|sun| sun.covers(d));
            on_disc += u32::from(covered);
            (!covered).then_some(d.to_array())
        });
        let body = |d: [f64; 3]| (1.0 - share) * light.body.pdf(DVec3::from_array(d));
        let outcome = chi2::sphere(samples, body, 32, 64);
        println!("{name}: {outcome:?}");
        assert!(outcome.p_value > 0.01, "{name}: {outcome:?}");
        // Five standard deviations; what the sky itself puts on the disc is less.
        let (expected, deviation) = (share * f64::from(N), (share * f64::from(N)).sqrt());
        assert!((f64::from(on_disc) - expected).abs() <= 5.0 * deviation, "{name}: {on_disc} of {expected}");
    }
}

/// ∫ L dω πR² by a midpoint rule that is finer than anything in the sky, and by the mean of L/pdf over samples. The sun is added
/// to the quadrature by itself.
#[test]
fn power_is_the_integral_of_radiance_and_bounds_what_rays_carry() {
    for (name, environment) in all() {
        let light = EnvironmentLight::new(environment, 2.0);
        let (rows, columns) = (1024, 1024);
        let mut sum = Rgb::BLACK;
        for row in 0..rows {
            let z = 1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(rows);
            for column in 0..columns {
                let d = direction_of([z, (f64::from(column) + 0.5) / f64::from(columns)]);
                let sun = light.sun.filter(|sun| sun.covers(d)).map_or(Rgb::BLACK, |sun| sun.radiance);
                sum += light.radiance(d) - sun;
            }
        }
        let mut expected = sum * (4.0 * PI / f64::from(rows * columns));
        if let Some(sun) = light.sun {
            expected += sun.radiance * solar::DISC_SOLID_ANGLE;
        }
        expected *= 4.0 * PI;
        let found = light.power();
        for channel in 0..3 {
            let error = (found[channel] / expected[channel] - 1.0).abs();
            // Pixels of the small map are 22° high: their mean over rows weighs the poles differently.
            let allowed = if name.contains("map") { 0.02 } else { 1e-3 };
            assert!(error < allowed, "{name}: {found:?} {expected:?}");
        }
        let mut stream = Stream::new(32, 0, 0);
        let (mut mean, mut most) = (0.0, 0.0f64);
        const N: u32 = 200_000;
        for _ in 0..N {
            let d = light.sample_direction([stream.uniform(), stream.uniform()]);
            let carried = light.radiance(d).luminance() / light.pdf_line(d);
            mean += carried / f64::from(N);
            most = most.max(carried);
        }
        assert!((mean / expected.luminance() - 1.0).abs() < 0.02, "{name}: {mean} {expected:?}");
        assert!(most <= light.largest_power() * (1.0 + 1e-12), "{name}: {most} > {}", light.largest_power());
    }
}

/// The bright pixel, 3.5 of 16 columns right of the middle and 2.5 of 8 rows down, turned counter-clockwise.
#[test]
fn maps_lie_and_turn_as_they_should() {
    let angle = TAU * 3.5 / 16.0;
    let at = |azimuth: f64| {
        let (sine, cosine) = (2.5 / 8.0 * PI).sin_cos();
        DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin())
    };
    // Right of the middle is towards +Z; a turn counter-clockwise, seen from above, leads from +Z to +X.
    for rotation in [0.0, 0.4, -2.0] {
        let light = EnvironmentLight::new(map(rotation), 1.0);
        let found = light.radiance(at(angle - rotation));
        assert!((found - Rgb::new(150.0, 100.0, 50.0)).map(f64::abs).max_channel() < 1e-3, "{rotation}: {found:?}");
    }
    let light = EnvironmentLight::new(map(0.0), 1.0);
    // Half-way to the left neighbour both count alike.
    let between = light.radiance(at(TAU * 3.0 / 16.0));
    assert!((between.r - 0.5 * 150.5).abs() < 1e-3, "{between:?}");
    assert_eq!(light.radiance(DVec3::NEG_Y), Rgb::BLACK);
}

/// The sun gives its illuminance to what faces it.
#[test]
fn the_sun_is_as_bright_as_the_author_says() {
    let sky = Sky::natural(SkyModel::Clear, Some([50.0, 90.0]));
    let illuminance = sky.sun.unwrap();
    let (towards, light) = (sky.towards_sun, EnvironmentLight::new(Environment::Sky(sky), 1.0));
    let sun = light.sun.unwrap();
    assert!((sun.radiance * solar::DISC_SOLID_ANGLE - illuminance).map(f64::abs).max_channel() < 1e-6);
    let off = |angle: f64| light.radiance((towards + angle.to_radians() * DVec3::Z).normalize()).luminance();
    assert!(off(0.26) > 1e8 && off(0.27) < 1e6, "{} {}", off(0.26), off(0.27));
}
