//! Probes of scenes whose light is known.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use twinray_bake::probes::{HARMONICS, NEIGHBOURS};
use twinray_bake::{ProbeError, ProbeOptions, ProbeSpacing, ProbeVolume, bake_probes};
use twinray_render::reference::{self, PathPictureOptions};
use twinray_render::walk::basis;
use twinray_scene::{Camera, LightKind, PatchScene, Projection, PunctualLight, Rgb, Scene, builtin};
use twinray_solve::Solution;

use crate::scenes::{Boxes, cut, solve};

fn baked(patches: &PatchScene, solution: &Solution, spacing: ProbeSpacing, rays: u32) -> ProbeVolume {
    bake_probes(patches, solution, &ProbeOptions { spacing, rays, ..ProbeOptions::default() }, &mut |_, _| Ok(()))
        .expect("probes")
}

/// Even directions.
fn normals(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (sin, cos) = (2.399_963_229_728_653 * f64::from(k)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, z, r * sin)
    })
}

/// Wherever one is in a furnace, all directions have the same radiance L = 𝓛ᵉ / (1 − a), so that Y00 has the factor √(4π) L, the
/// others 0, and any surface the irradiance πL. Probes within the box that stands in it are filled with the same.
#[test]
fn in_a_furnace_light_is_even() {
    let patches = cut(&builtin::furnace(0.5, 1.0), 0.2);
    let solution = solve(&patches, 1_000_000);
    let volume = baked(&patches, &solution, ProbeSpacing::Metres(0.5), 2048);
    let radiance = 1.0 / PI / (1.0 - 0.5);
    assert!(volume.validity.iter().filter(|v| **v == 0.0).count() < volume.grid.len() / 4);
    let scale = (4.0 * PI).sqrt() * radiance;
    for k in 0..HARMONICS {
        let expected = if k == 0 { 1.0 } else { 0.0 };
        let found: Vec<f64> = volume.radiance.iter().map(|light| f64::from(light.0[k][1]) / scale - expected).collect();
        let n = found.len() as f64;
        let mean = found.iter().sum::<f64>() / n;
        let deviation = (found.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!("harmonic {k}: {mean:.5} ± {:.5}, one probe {deviation:.5}", deviation / n.sqrt());
        // Noise of a probe's rays; and the mean of all probes, with an error of the solution.
        assert!(deviation < 0.01 && mean.abs() < 4.0 * deviation / n.sqrt() + 0.001, "harmonic {k}");
    }
    for (probe, light) in volume.radiance.iter().enumerate() {
        for normal in normals(40) {
            // Five deviations.
            let found = light.irradiance(normal).g / (PI * radiance);
            assert!((found - 1.0).abs() < 0.05, "probe {probe}: {found}");
        }
    }
}

/// Irradiance, over that at right angles, which nine harmonics make of a small lamp at an angle of cosine `c`.
fn of_a_lamp(c: f64) -> f64 {
    0.25 + 0.5 * c + 5.0 / 32.0 * (3.0 * c * c - 1.0)
}

/// A lamp of 10 cm, 5 m away, found by shadow rays and by chance; and a light without area.
#[test]
fn a_small_lamp_follows_the_cosine_law() {
    for with_area in [true, false] {
        let mut scene = Boxes::new();
        let (black, lamp) = (scene.material(0.0, 0.0), scene.material(0.0, 1000.0));
        scene.add([0.0, 0.0, 0.0], [0.1, 0.1, 0.1], black, false);
        let corner = [5.0f32, 3.0, 1.0];
        scene.add(corner, corner.map(|c| c + 0.1), if with_area { lamp } else { black }, false);
        let centre = DVec3::from_array(corner.map(f64::from)) + 0.05;
        let mut scene = scene.0;
        if !with_area {
            scene.lights.push(PunctualLight {
                name: "lamp".into(),
                kind: LightKind::Point,
                intensity: Rgb::grey(7.0),
                transform: DAffine3::from_translation(centre - 0.06 * DVec3::X),
                profile: None,
            });
        }
        let patches = cut(&scene, 0.1);
        let solution = solve(&patches, 10_000);
        let volume = baked(&patches, &solution, ProbeSpacing::Counts([5, 3, 2]), 1024);
        let probe = 1;
        let place = volume.grid.point(probe);
        let way = scene.lights.first().map_or(centre, |l| l.transform.translation) - place;
        let towards = way.normalize();
        let across = if with_area {
            // Radiance times solid angle of a box: what its faces show.
            1000.0 * 0.01 * towards.abs().element_sum() / way.length_squared()
        } else {
            7.0 / way.length_squared()
        };
        let light = volume.radiance[probe];
        // Degree 1 points to the lamp: factors of y, z, x.
        let [y, z, x] = [1, 2, 3].map(|k| f64::from(light.0[k][0]));
        let direction = DVec3::new(x, y, z);
        assert!(direction.normalize().dot(towards) > 0.999_9, "{direction} against {towards}");
        assert!((direction.length() / (0.488_602_5 * across) - 1.0).abs() < 0.01);
        for normal in normals(100) {
            let cosine = normal.dot(towards);
            let found = light.irradiance(normal).r / across;
            assert!((found - of_a_lamp(cosine).max(0.0)).abs() < 0.01, "{cosine}: {found}");
            // What nine harmonics can know of a cosine.
            assert!((found - cosine.max(0.0)).abs() < 0.105, "{cosine}: {found}");
        }
        // Whoever lights objects with such lights by himself has them once.
        let options =
            ProbeOptions { spacing: ProbeSpacing::Counts([5, 3, 2]), punctual: false, ..ProbeOptions::default() };
        let without = bake_probes(&patches, &solution, &options, &mut |_, _| Ok(())).expect("probes").radiance[probe];
        assert_eq!(without.0[0][0] > 0.0, with_area);
    }
}

/// Two rooms with a wall between them from `from` to `to`, lit on the near side alone.
fn parted(from: f32, to: f32) -> Scene {
    let mut room = Boxes::new();
    let (white, lamp) = (room.material(0.7, 0.0), room.material(0.0, 30.0));
    // Solid all around.
    room.add([-0.1, -0.1, -0.1], [4.1, 2.6, 3.1], white, false);
    // Not one room that is parted: no patch is to lie in both.
    room.add([0.0, 0.0, 0.0], [from, 2.5, 3.0], white, true);
    room.add([to, 0.0, 0.0], [4.0, 2.5, 3.0], white, true);
    room.add([0.4, 2.0, 1.0], [0.8, 2.1, 1.6], lamp, false);
    room.0
}

/// Light stays on its side of a wall, wherever the wall is between probes or through them, or if probes are within.
#[test]
fn light_does_not_pass_walls() {
    for (from, to) in [(1.9, 1.93), (1.7, 1.76), (1.99, 2.0), (2.13, 2.14), (1.2, 2.8)] {
        let patches = cut(&parted(from, to), 0.2);
        let solution = solve(&patches, 300_000);
        let volume = baked(&patches, &solution, ProbeSpacing::Metres(0.5), 128);
        let mut random = 1u64;
        let mut uniform = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1u64 << 53) as f64
        };
        let blind = ProbeVolume { nearness: vec![[0.0; NEIGHBOURS]; volume.grid.len()], ..volume.clone() };
        let mut mean = |volume: &ProbeVolume, x: [f64; 2]| {
            let count = 4000;
            let light = (0..count).map(|_| {
                let point = DVec3::new(x[0] + (x[1] - x[0]) * uniform(), 2.5 * uniform(), 3.0 * uniform());
                volume.irradiance(point, DVec3::Y).g
            });
            light.sum::<f64>() / f64::from(count)
        };
        let (from, to) = (f64::from(from), f64::from(to));
        let lit = mean(&volume, [0.0, from]);
        let (dark, leaking) = (mean(&volume, [to + 1e-4, 4.0]), mean(&blind, [to + 1e-4, 4.0]));
        println!("wall {from}–{to}: lit {lit:.2}, dark {dark:.2e}, without visibility {leaking:.2e}");
        assert!(lit > 0.5);
        assert!(dark == 0.0, "{dark}");
        assert!(to - from > 0.5 || leaking > 1e-3 * lit, "the test would see nothing: {leaking}");
        // Probes, where they took their light.
        for (probe, light) in volume.radiance.iter().enumerate() {
            let x = volume.grid.point(probe).x + f64::from(volume.offset[probe][0]);
            if volume.validity[probe] > 0.0 {
                assert_eq!(x > to, light.0[0][1] == 0.0, "probe at {x}");
                assert!(x < from || x > to);
            } else {
                // Of their own side.
                assert!(x > from && x < to);
                let middle = 0.5 * (from + to);
                assert!((x - middle).abs() < 0.01 || (x > middle) == (light.0[0][1] == 0.0), "filled at {x}");
            }
        }
    }
}

/// The light that probes have is that which paths find, within noise.
#[test]
fn probes_agree_with_paths() {
    let scene = builtin::cornell(true);
    let patches = cut(&scene, 0.05);
    let solution = solve(&patches, 3_000_000);
    let spacing = ProbeSpacing::Counts([3, 3, 3]);
    let many: Vec<ProbeVolume> = (0..8)
        .map(|seed| {
            let options = ProbeOptions { spacing, rays: 256, seed, ..ProbeOptions::default() };
            bake_probes(&patches, &solution, &options, &mut |_, _| Ok(())).expect("probes")
        })
        .collect();
    for probe in [4, 15, 22] {
        let place = many[0].grid.point(probe) + DVec3::from_array(many[0].offset[probe].map(f64::from));
        let camera = Camera {
            projection: Projection::Panorama,
            ..Camera::look_at("probe", place, place - DVec3::Z, DVec3::Y, 90.0)
        };
        let (width, height) = (96u32, 48u32);
        let options = PathPictureOptions { width, height, samples: 64, ..PathPictureOptions::default() };
        let (picture, variance) = reference::picture(&patches, &camera, &options);
        let (mut expected, mut squares) = ([0.0; HARMONICS], [0.0; HARMONICS]);
        for (index, pixel) in picture.image.pixels.iter().enumerate() {
            let [column, row] = [index as u32 % width, index as u32 / width].map(f64::from);
            let (x, y) = ((column + 0.5) / f64::from(width), (row + 0.5) / f64::from(height));
            let (_, towards) = camera.ray(x, y, 2.0, [0.0; 2]).expect("a direction");
            let edge = |row: f64| (PI * (0.5 - row / f64::from(height))).sin();
            let solid_angle = 2.0 * PI / f64::from(width) * (edge(row) - edge(row + 1.0));
            for (k, b) in basis(towards).into_iter().enumerate() {
                expected[k] += solid_angle * b * Rgb::from_f32(*pixel).luminance();
                squares[k] += (solid_angle * b).powi(2) * f64::from(variance[index]);
            }
        }
        for k in 0..HARMONICS {
            let of = |v: &ProbeVolume| Rgb::from_f32(v.radiance[probe].0[k]).luminance();
            let n = many.len() as f64;
            let mean = many.iter().map(of).sum::<f64>() / n;
            let noise = many.iter().map(|v| (of(v) - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
            let error = (noise + squares[k]).sqrt();
            let z = (mean - expected[k]) / error;
            println!("probe {probe}, harmonic {k}: {mean:.4} against {:.4}, z = {z:.1}", expected[k]);
            // The solution has an error of its own, and pixels are not points.
            assert!((mean - expected[k]).abs() < 4.0 * error + 0.006 * expected[0], "z = {z}");
            assert!(error < 0.02 * expected[0]);
        }
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let patches = cut(&builtin::cornell(false), 0.1);
    let solution = solve(&patches, 50_000);
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| baked(&patches, &solution, ProbeSpacing::Counts([4, 5, 4]), 64))
    };
    let one = of(1);
    for threads in [2, 7] {
        assert!(of(threads) == one);
    }
    assert!(baked(&patches, &solution, ProbeSpacing::Counts([4, 5, 4]), 65) != one);
}

#[test]
fn senseless_grids_are_refused() {
    let patches = cut(&builtin::cornell(false), 0.5);
    let solution = solve(&patches, 1000);
    let error = |spacing| {
        bake_probes(&patches, &solution, &ProbeOptions { spacing, ..ProbeOptions::default() }, &mut |_, _| Ok(())).err()
    };
    for spacing in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(error(ProbeSpacing::Metres(spacing)), Some(ProbeError::Spacing(spacing)));
    }
    assert!(matches!(error(ProbeSpacing::Metres(f64::NAN)), Some(ProbeError::Spacing(_))));
    assert!(matches!(error(ProbeSpacing::Metres(1e-6)), Some(ProbeError::TooMany { .. })));
    assert_eq!(error(ProbeSpacing::Counts([1, 0, 1])), Some(ProbeError::Empty));
    assert!(matches!(error(ProbeSpacing::Counts([u32::MAX; 3])), Some(ProbeError::TooMany { .. })));
    assert!(error(ProbeSpacing::Default).is_none());
}
