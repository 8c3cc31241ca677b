//! Laws that hold for any input: cells, frames, cameras, textures, streams, BRDFs.

use glam::DVec3;
use proptest::array::uniform3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use twinray_scene::brdf::{Brdf, Ggx, Phong};
use twinray_scene::cells::Cells;
use twinray_scene::geom::{Frame, area_vector_2};
use twinray_scene::sample::{Sobol, Stream, warp};
use twinray_scene::texture::{Encoding, lookup};
use twinray_scene::{Camera, Projection, Rgb, TextureImage, TextureRef, Wrap};

fn config() -> ProptestConfig {
    ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

/// A number in [0, 1), the ends among them.
fn unit() -> impl Strategy<Value = f64> {
    prop_oneof![8 => 0.0..1.0f64, 1 => Just(0.0), 1 => Just(1.0 - f64::EPSILON / 2.0)]
}

fn point() -> impl Strategy<Value = DVec3> {
    uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
}

/// Any direction; poles and axes, and their neighbours, are not rare.
fn direction() -> impl Strategy<Value = DVec3> {
    let near_axis = (0usize..3, any::<bool>(), uniform3(-1e-9..1e-9f64));
    prop_oneof![
        3 => [unit(), unit()].prop_map(warp::uniform_sphere),
        1 => near_axis.prop_map(|(axis, negative, off)| {
            let mut d = DVec3::from_array(off);
            d[axis] += if negative { -1.0 } else { 1.0 };
            d.normalize()
        }),
        1 => (0usize..3, any::<bool>()).prop_map(|(axis, negative)| DVec3::AXES[axis] * if negative { -1.0 } else { 1.0 }),
    ]
}

/// A triangle of any shape: lengths and heights over six decades.
fn triangle() -> impl Strategy<Value = [DVec3; 3]> {
    (direction(), direction(), -3.0..3.0f64, -6.0..0.0f64, -0.5..1.5f64, 0usize..3).prop_filter_map(
        "two different directions",
        |(along, across, length, height, foot, turn)| {
            let across = (across - along * across.dot(along)).try_normalize()?;
            let length = 10f64.powf(length);
            let corners =
                [DVec3::ZERO, along * length, along * (length * foot) + across * (length * 10f64.powf(height))];
            Some([0, 1, 2].map(|i| corners[(i + turn) % 3]))
        },
    )
}

fn brdf() -> impl Strategy<Value = Brdf> {
    let rgb = || uniform3(0.0..1.0f64).prop_map(Rgb::from_array);
    let ggx =
        (rgb(), unit(), unit(), unit(), rgb(), 1.0..3.0f64).prop_map(|(base, metal, rough, specular, color, ior)| {
            Brdf::Ggx(Ggx::new(base, metal, rough, specular, color, ior))
        });
    let phong = (rgb(), rgb(), 0.0..4.0f64, unit())
        .prop_map(|(d, s, n, share)| Brdf::Phong(Phong::new(d * share, s * (1.0 - share), 10f64.powf(n) - 1.0)));
    prop_oneof![1 => rgb().prop_map(|reflectance| Brdf::Lambertian { reflectance }), 3 => ggx, 2 => phong]
}

proptest! {
    #![proptest_config(config())]

    /// Cells are numbered without gaps, a point of a cell is found in it, and lies in the triangle.
    #[test]
    fn cells_partition_any_triangle(
        corners in triangle(), cells in 1.0..5000.0f64, places in prop::collection::vec((unit(), 1e-3..0.999f64, 1e-3..0.999f64), 20),
    ) {
        let area = 0.5 * area_vector_2(corners[0], corners[1], corners[2]).length();
        let division = Cells::of_area(corners, area / cells);
        let count = division.count();
        prop_assert!(count >= 1 && f64::from(count) < 4.0 * cells + 4.0, "{count} of {cells} wanted");
        for (which, s, t) in places {
            let cell = ((which * f64::from(count)) as u32).min(count - 1);
            for [u, v] in [division.point(cell, s, t), division.centre(cell)] {
                prop_assert!(u >= -1e-12 && v >= -1e-12 && u + v <= 1.0 + 1e-12, "({u}, {v}) of {division:?}");
                prop_assert_eq!(division.locate(u, v), cell, "({}, {}) of {:?}", u, v, division);
            }
        }
        // Any point of the triangle, and points slightly outside, have a cell.
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (-1e-7, 0.3), (0.7, 0.3 + 1e-7), (1.0 + 1e-7, 0.0)] {
            prop_assert!(division.locate(u, v) < count);
        }
    }

    #[test]
    fn frames_are_orthonormal_for_any_normal(n in direction(), v in point()) {
        let f = Frame::from_normal(n);
        prop_assert!((f.x.cross(f.y) - f.z).length() < 1e-12 && f.x.dot(f.y).abs() < 1e-12, "{f:?}");
        prop_assert!((f.to_local(f.to_world(v)) - v).length() < 1e-12);
    }

    /// Rays are of unit length, the middle of the film looks forward, and right is to the right.
    #[test]
    fn cameras_of_any_pose_have_rays(
        eye in point(), forward in direction(), up in direction(), fov in 0.01..3.1f64, x in unit(), y in unit(),
        aspect in 0.1..10.0f64, which in 0usize..4,
    ) {
        let projection = [
            Projection::Orthographic { half_height: fov },
            Projection::Perspective { vertical_fov: fov },
            Projection::Panorama,
            Projection::Fisheye { angle: fov },
        ][which];
        let (name, eye, forward_7) = (String::new(), eye * 1e3, forward * 7.0);
        let camera = Camera { name, eye, forward: forward_7, up, projection, lens: None, aspect: None };
        let [right, above, ahead] = camera.axes();
        prop_assert!((right.cross(above) + ahead).length() < 1e-9, "{right} {above} {ahead}");
        let ray = |x: f64, y: f64| camera.ray(x, y, aspect, [0.0; 2]);
        if let Some((origin, d)) = ray(x, y) {
            prop_assert!((d.length() - 1.0).abs() < 1e-12 && origin.is_finite());
        }
        let (from, middle) = ray(0.5, 0.5).unwrap();
        prop_assert!((middle - forward).length() < 1e-9 && (from - camera.eye).length() < 1e-9);
        let place = |(o, d): (DVec3, DVec3)| (o - camera.eye).dot(right) + d.dot(right);
        // At the poles of a panorama there is no right.
        let y = y.clamp(0.01, 0.99);
        if let (Some(more), Some(less)) = (ray(0.75, y), ray(0.25, y)) {
            prop_assert!(place(more) > place(less));
        }
    }

    /// Whatever the coordinates, a look-up lies within the range of the texels.
    #[test]
    fn textures_stay_in_range(
        size in (1u32..5, 1u32..5), bytes in prop::collection::vec(any::<u8>(), 64), u in any::<f64>(), v in -3.0..3.0f64,
        nearest in any::<bool>(), wraps in [0usize..3, 0usize..3], linear in any::<bool>(),
    ) {
        let texels = (size.0 * size.1) as usize;
        let image = TextureImage { name: String::new(), width: size.0, height: size.1, rgba: bytes[..4 * texels].to_vec() };
        let wrap = wraps.map(|w| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][w]);
        let encoding = if linear { Encoding::Linear } else { Encoding::Srgb };
        for (u, v) in [(u, v), (v, u), (v, v)] {
            let (color, alpha) = lookup(&image, &TextureRef { wrap, nearest, ..TextureRef::of(0) }, encoding, u, v);
            let range = -1e-12..=1.0 + 1e-12;
            for c in color.to_array().into_iter().chain([alpha]) {
                prop_assert!(range.contains(&c), "{c} at ({u}, {v})");
            }
            if v.is_finite() && u.is_finite() {
                let texel = |c: usize| bytes[..4 * texels].iter().skip(c).step_by(4);
                let (low, high) = (*texel(3).min().unwrap(), *texel(3).max().unwrap());
                prop_assert!(alpha >= f64::from(low) / 255.0 - 1e-9 && alpha <= f64::from(high) / 255.0 + 1e-9);
            }
        }
    }

    #[test]
    fn random_numbers_lie_in_the_unit_interval(seed in any::<u64>(), purpose in any::<u64>(), index in any::<u64>()) {
        let mut stream = Stream::new(seed, purpose, index);
        prop_assert!((0..20).all(|_| (0.0..1.0).contains(&stream.uniform())));
    }

    /// Reciprocal to rounding; the albedo no more than 1 where the parameters allow; samples above the horizon with
    /// a density that is positive there.
    #[test]
    fn brdfs_of_any_parameters_are_physical(brdf in brdf(), n in direction(), a in [unit(), unit()], b in [unit(), unit()]) {
        let frame = Frame::from_normal(n);
        let [wi, wo] = [a, b].map(|u| frame.to_world(warp::cosine_hemisphere(u)));
        let (ab, ba) = (brdf.eval(n, wi, wo), brdf.eval(n, wo, wi));
        for c in 0..3 {
            prop_assert!(ab[c].is_finite() && ab[c] >= 0.0, "{ab:?}");
            // Far from normal incidence a lobe's value is steep in the cosines, whose rounding it inherits.
            prop_assert!((ab[c] - ba[c]).abs() <= 1e-7 * ab[c].max(1e-3), "{ab:?} {ba:?}");
        }
        for cosine in [1.0, n.dot(wi).max(0.0), 0.0] {
            let (albedo, lobe) = (brdf.albedo(cosine), brdf.lobe_albedo(cosine));
            prop_assert!(albedo.max_channel() <= 1.0 + 1e-9 && albedo.min_channel() >= 0.0, "{albedo:?} at {cosine}");
            prop_assert!((albedo - lobe).min_channel() >= -1e-9, "{lobe:?} of {albedo:?}");
        }
        let pdf = brdf.pdf(n, wi, wo);
        prop_assert!(pdf.is_finite() && pdf >= 0.0);
        if n.dot(wi) > 0.0 && let Some(d) = brdf.sample(n, wi, b) {
            prop_assert!((d.length() - 1.0).abs() < 1e-9 && n.dot(d) >= -1e-12, "{d}");
            prop_assert!(n.dot(d) <= 1e-9 || brdf.pdf(n, wi, d) > 0.0, "a sample without density");
        }
    }
}

/// Points of the sequence in any of its 2⁶⁴ places.
#[test]
fn sobol_points_lie_in_the_unit_cube() {
    let mut stream = Stream::new(48, 0, 0);
    for _ in 0..50 {
        let sobol = Sobol::new(stream.bits());
        for index in (0..200).map(|_| stream.bits()).chain([0, u64::MAX, 1 << 32, (1 << 32) - 1]) {
            assert!(sobol.point(index).iter().all(|x| (0.0..1.0).contains(x)));
        }
    }
}
