//! Lines from the sky follow their density: direction × place on the disc across it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use twinray_scene::environment::EnvironmentLight;
use twinray_scene::sample::Stream;
use twinray_scene::{Environment, Rgb};
use twinray_testkit::chi2;

/// Cells of equal measure: 8 × 8 of direction (height, azimuth), 4 × 4 of the disc (radius², angle).
#[test]
fn lines_follow_their_density() {
    const N: usize = 1_000_000;
    let radius = 7.0;
    let sky = EnvironmentLight::new(Environment::Uniform(Rgb::WHITE), radius);
    let mut stream = Stream::new(46, 0, 0);
    let mut count = vec![0u64; 1024];
    let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    for _ in 0..N {
        let mut pair = || [stream.uniform(), stream.uniform()];
        let (origin, direction) = sky.sample_line(pair(), pair());
        let towards = -direction;
        assert!((towards.length() - 1.0).abs() < 1e-12);
        let beyond = origin.dot(towards);
        assert!(beyond > radius && beyond < 1.01 * radius, "the line starts just outside: {beyond}");
        // The density is constant: that of directions over the disc's area.
        assert!((sky.pdf_line(towards) * 4.0 * PI * PI * radius * radius - 1.0).abs() < 1e-12);
        // Axes across the direction, made in another way than by the sampler.
        let x = if towards.x.abs() < 0.5 { DVec3::X } else { DVec3::Y }.cross(towards).normalize();
        let across = [origin.dot(x) / radius, origin.dot(towards.cross(x)) / radius];
        let square = across[0] * across[0] + across[1] * across[1];
        assert!(square <= 1.0 + 1e-9, "within the disc: {square}");
        let azimuth = towards.y.atan2(towards.x) / TAU + 0.5;
        let angle = across[1].atan2(across[0]) / TAU + 0.5;
        let direction = 8 * cell(0.5 * (towards.z + 1.0), 8) + cell(azimuth, 8);
        count[16 * direction + 4 * cell(square, 4) + cell(angle, 4)] += 1;
    }
    let outcome = chi2::test(&count, &vec![N as f64 / 1024.0; 1024]);
    println!("{outcome:?}");
    assert!(outcome.p_value > 0.01, "{outcome:?}");
}
