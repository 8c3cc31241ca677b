//! Patches: areas, places, sides, transforms, budgets, means.

use glam::DAffine3;

use super::*;
use crate::authored::{Instance, Mesh, Texel, TextureRef, TextureTransform, Wrap};
use crate::builtin;

fn square(transform: DAffine3, two_sided: bool) -> Scene {
    Scene {
        meshes: vec![Mesh {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            texcoords: Some(vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }],
        instances: vec![Instance { name: "square".into(), mesh: 0, transform }],
        materials: vec![Material { two_sided, ..Material::default() }],
        ..Scene::default()
    }
}

fn patches(scene: &Scene, wish: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(wish), ..PatchOptions::default() }).unwrap()
}

#[test]
fn areas_add_up_and_budgets_are_met() {
    for (name, _) in builtin::NAMES {
        let scene = builtin::by_name(name).unwrap();
        let coarse = PatchScene::new(
            &scene,
            PatchOptions { budget: PatchBudget::Size(f64::INFINITY), ..PatchOptions::default() },
        )
        .unwrap();
        assert_eq!(coarse.len(), coarse.triangle_count());
        let fine = patches(&scene, 50_000);
        assert!((fine.len() as f64 / 50_000.0 - 1.0).abs() < 0.05, "{name}: {} patches", fine.len());
        assert!((fine.total_area() / coarse.total_area() - 1.0).abs() < 1e-9);
        assert!((fine.emitted_power().g - coarse.emitted_power().g).abs() <= 1e-5 * coarse.emitted_power().g);
    }
}

/// Of every scene, and of both sides: the polygon has the cell's area and normal, its corners lie in the triangle.
#[test]
fn corners_go_round_their_cell() {
    for (name, _) in builtin::NAMES {
        let options = PatchOptions { budget: PatchBudget::Count(5_000), two_sided: true };
        let p = PatchScene::new(&builtin::by_name(name).unwrap(), options).unwrap();
        for patch in p.patches() {
            let corners = p.cell_corners(patch);
            assert!((3..=6).contains(&corners.len()), "{name}: {} corners", corners.len());
            let fan = corners[1..].windows(2).map(|w| 0.5 * area_vector_2(corners[0], w[0], w[1]));
            let expected = p.normal(patch) * p.cell_area(patch);
            // Corners are f64 mixtures of f32 vertices: rounding grows with the triangle, not with the cell.
            let triangle = p.corners(p.triangle_of(patch)).map(DVec3::length).into_iter().fold(0.0, f64::max);
            let rounding = 1e-14 * triangle * corners[0].distance(corners[1]).max(corners[0].distance(corners[2]));
            let off = (fan.sum::<DVec3>() - expected).length();
            assert!(off < 1e-11 * p.cell_area(patch) + rounding, "{name}: {off} of {expected}");
        }
    }
}

#[test]
fn every_patch_knows_its_place() {
    for two_sided in [false, true] {
        let scene = square(DAffine3::IDENTITY, two_sided);
        let p = patches(&scene, 1000);
        for patch in p.patches() {
            let t = p.triangle_of(patch);
            let cells = p.triangles[t as usize].cells;
            let [u, v] = cells.centre(p.cell_of(patch));
            assert_eq!(p.patch_at(t, p.side_of(patch), u, v), Some(patch));
            let expected = if p.side_of(patch) == Side::Front { 1.0 } else { -1.0 };
            assert_eq!(p.normal(patch).z, expected);
        }
        assert_eq!(p.patch_at(0, Side::Back, 0.2, 0.2).is_some(), two_sided);
    }
}

#[test]
fn a_mirrored_instance_keeps_its_front_outside() {
    let mirrored = square(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)), false);
    // A mirror in x leaves the front of a square in the xy plane on +z.
    assert!(patches(&mirrored, 2).normal(PatchId(0)).z > 0.99);
    let turned = square(DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)), false);
    assert!(patches(&turned, 2).normal(PatchId(0)).z < -0.99);
}

#[test]
fn rays_meet_the_patch_that_they_are_aimed_at() {
    let far = DVec3::new(1e5, -2e5, 3e5);
    for transform in [DAffine3::IDENTITY, DAffine3::from_translation(far)] {
        let p = patches(&square(transform, false), 200);
        for patch in p.patches() {
            let centre = p.cell_centre(patch);
            let hit = p.trace(centre + DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z).expect("a hit");
            assert_eq!(p.patch_of(&hit), Some(patch));
            assert!((hit.t - 3.0).abs() < 1e-5);
            let back = p.trace(centre - DVec3::new(0.0, 0.0, 3.0), DVec3::Z).expect("a hit");
            assert_eq!((back.side, p.patch_of(&back)), (Side::Back, None));
        }
    }
}

#[test]
fn textures_are_averaged_and_holes_shrink_patches() {
    let mut scene = square(DAffine3::IDENTITY, false);
    // Left half white and opaque, right half black and absent.
    scene.images = vec![Arc::new(TextureImage {
        name: "halves".into(),
        width: 2,
        height: 1,
        rgba: vec![255, 255, 255, 255, 0, 0, 0, 0],
    })];
    let texture = TextureRef { wrap: [Wrap::Clamp; 2], nearest: true, ..TextureRef::of(0) };
    scene.materials[0].surface =
        Surface::Lambertian { reflectance: Texel { factor: Rgb::grey(0.8), alpha: 1.0, texture: Some(texture) } };
    let opaque = patches(&scene, 512);
    let mean = opaque.mean_albedo().g;
    assert!((mean - 0.4).abs() < 0.01, "{mean}");
    scene.materials[0].opacity = Opacity::Mask { cutoff: 0.5 };
    let masked = patches(&scene, 512);
    assert!((masked.total_area() - 0.5).abs() < 0.02, "{}", masked.total_area());
    let centre = masked.centre();
    assert!(masked.trace(DVec3::new(0.75, 0.5, 1.0) - centre, DVec3::NEG_Z).is_none());
    assert!(masked.trace(DVec3::new(0.25, 0.5, 1.0) - centre, DVec3::NEG_Z).is_some());
}

/// A square whose left half is white and dense, the right black and thin.
fn veil(alpha: f64) -> Scene {
    let mut scene = square(DAffine3::IDENTITY, false);
    // Sixteen texels in a row, so that means are taken over 64 points.
    let rgba = (0..256).flat_map(|i| if i % 16 < 8 { [255, 255, 255, 255] } else { [0, 0, 0, 51] }).collect();
    scene.images = vec![Arc::new(TextureImage { name: "veil".into(), width: 16, height: 16, rgba })];
    let texture = Some(TextureRef { wrap: [Wrap::Clamp; 2], nearest: true, ..TextureRef::of(0) });
    scene.materials[0].surface =
        Surface::Lambertian { reflectance: Texel { factor: Rgb::grey(0.9), alpha, texture: texture.clone() } };
    scene.materials[0].emission = Rgb::WHITE;
    scene.materials[0].emission_texture = texture;
    scene.materials[0].opacity = Opacity::Blend;
    scene
}

/// Alpha is 0.8 on the left and 0.16 on the right: rays meet the surface so often, points are drawn in this ratio,
/// and what is there is white by 5 in 6.
#[test]
fn blended_surfaces_are_there_as_often_as_alpha_says() {
    const N: u32 = 20_000;
    let scene = veil(0.8);
    let p = patches(&scene, 2048);
    assert!((p.total_area() - 0.48).abs() < 0.005, "{}", p.total_area());
    // What is there on the left shines: half of the square × 0.8.
    let light = p.patches().map(|k| p.area(k) * p.emission(k).g).sum::<f64>();
    assert!((light - 0.4).abs() < 0.005, "{light}");
    let p = patches(&scene, 2);
    assert_eq!(p.len(), 2);
    let mut random = crate::sample::Stream::new(1, 2, 3);
    let (mut met, mut drawn) = ([0u32; 2], [0u32; 2]);
    for _ in 0..N {
        let [x, y] = [0; 2].map(|_| random.uniform());
        let right = usize::from(x >= 0.5);
        let origin = DVec3::new(x, y, 1.0) - p.centre();
        let hit = p.trace(origin, DVec3::NEG_Z);
        met[right] += u32::from(hit.is_some());
        assert_eq!(hit.map(|h| h.u), p.trace(origin, DVec3::NEG_Z).map(|h| h.u), "a place that changes its mind");
        let patch = PatchId(u32::from(y > x));
        let point = p.sample_point(patch, x, y, || random.uniform()) + p.centre();
        drawn[usize::from(point.x >= 0.5)] += 1;
    }
    let half = f64::from(N) / 2.0;
    for (count, alpha) in [(met[0], 0.8), (met[1], 0.16)] {
        // Binomial, given a random number of tries: 5 standard deviations, a false alarm in 10⁶.
        let z = (f64::from(count) - half * alpha) / (half * alpha).sqrt();
        assert!(z.abs() < 5.0, "{met:?}, z {z}");
    }
    // Half of the draws are from each triangle. By area 3/4 of one and 1/4 of the other are on the left, so that
    // 0.8 a / (0.8 a + 0.16 (1 - a)) of the points on it are: 15/16 and 5/8.
    let left = f64::from(drawn[0]) / f64::from(N);
    let z = (left - 0.5 * (15.0 / 16.0 + 5.0 / 8.0)) / (0.25 / f64::from(N)).sqrt();
    assert!(z.abs() < 5.0, "{drawn:?}, z {z}");
}

#[test]
fn alpha_factors_count_and_dense_surfaces_have_no_holes() {
    let mut scene = veil(0.8);
    assert!(patches(&scene, 2).holes);
    scene.materials[0].opacity = Opacity::Mask { cutoff: 0.5 };
    assert!((patches(&scene, 512).total_area() - 0.5).abs() < 0.02);
    // 0.8 × 51/255 = 0.16 passes a cutoff of 0.15; then nothing is cut, and rays need not ask.
    scene.materials[0].opacity = Opacity::Mask { cutoff: 0.15 };
    assert!(!patches(&scene, 2).holes);
    // Without a picture, or without coordinates, the factor is all there is.
    let plain = |alpha| Surface::Lambertian { reflectance: Texel { alpha, ..Texel::constant(Rgb::grey(0.5)) } };
    scene.materials[0].opacity = Opacity::Blend;
    scene.materials[0].surface = plain(0.25);
    assert!((patches(&scene, 512).total_area() - 0.25).abs() < 1e-6);
    scene.materials[0].surface = plain(1.0);
    assert!(!patches(&scene, 2).holes);
    scene.materials[0].opacity = Opacity::Mask { cutoff: 0.5 };
    scene.materials[0].surface = plain(0.25);
    let p = patches(&scene, 2);
    assert!(p.total_area() < 1e-2 && p.trace(DVec3::new(0.1, 0.2, 1.0), DVec3::NEG_Z).is_none());
    scene.materials[0].surface = plain(1.5);
    assert_eq!(scene.validate().len(), 1);
}

/// The second set of coordinates is the first one turned by a right angle, so that the halves are top and bottom; a
/// transform that turns them back makes them left and right again.
#[test]
fn the_second_set_and_transforms_count_in_points_and_means() {
    let mut scene = square(DAffine3::IDENTITY, false);
    let rgba = vec![255, 255, 255, 255, 0, 0, 0, 255];
    scene.images = vec![Arc::new(TextureImage { name: "halves".into(), width: 2, height: 1, rgba })];
    let mesh = &mut scene.meshes[0];
    mesh.texcoords = None;
    mesh.second_texcoords = Some(mesh.positions.iter().map(|p| [p[1], 1.0 - p[0]]).collect());
    let texture = TextureRef { wrap: [Wrap::Clamp; 2], nearest: true, set: 1, ..TextureRef::of(0) };
    // u = y, v = 1 - x; turned counter-clockwise by a right angle: u' = v = 1 - x, v' = -u.
    let turned = TextureTransform { rotation: std::f64::consts::FRAC_PI_2, ..TextureTransform::default() };
    for (transform, white) in [(TextureTransform::default(), [0.7, 0.2]), (turned, [0.7, 0.8])] {
        let texture = TextureRef { transform, ..texture.clone() };
        let reflectance = Texel { factor: Rgb::grey(0.8), alpha: 1.0, texture: Some(texture) };
        scene.materials[0].surface = Surface::Lambertian { reflectance };
        assert_eq!(scene.validate(), []);
        let p = patches(&scene, 512);
        let mean = p.mean_albedo().g;
        assert!((mean - 0.4).abs() < 0.01, "{mean}");
        for (at, expected) in [(white, 0.8), ([1.0 - white[0], 1.0 - white[1]], 0.0)] {
            let hit = p.trace(DVec3::new(at[0], at[1], 1.0) - p.centre(), DVec3::NEG_Z).unwrap();
            assert_eq!(p.color_at(hit.triangle, hit.u, hit.v).g, expected, "{at:?}");
        }
    }
}

#[test]
fn nothing_to_cut_is_an_error() {
    assert_eq!(PatchScene::new(&Scene::default(), PatchOptions::default()).unwrap_err(), PatchError::Empty);
    let size = PatchOptions { budget: PatchBudget::Size(-1.0), ..PatchOptions::default() };
    assert!(matches!(PatchScene::new(&square(DAffine3::IDENTITY, false), size), Err(PatchError::Size(_))));
}
