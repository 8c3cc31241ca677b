//! The path tracer against what is known exactly, and against itself by other means.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_render::reference::{self, IrradianceOptions, PatchTracer, PathPictureOptions, PixelTracer, Technique};
use twinray_scene::brdf::Brdf;
use twinray_scene::{
    Camera, Environment, Opacity, PatchBudget, PatchId, PatchOptions, PatchScene, Projection, Rgb, Scene, Surface,
    Texel, TextureImage, TextureRef, builtin,
};
use twinray_solve::PatchLight;
use twinray_testkit::ztest::Mean;

const TECHNIQUES: [Technique; 3] = [Technique::Both, Technique::Lights, Technique::Path];
/// Form factor of `plates(1.0)`.
const FORM_FACTOR: f64 = 0.199_824_895_7;

pub(crate) fn cut(scene: &Scene, patches: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(patches), two_sided: false }).unwrap()
}

fn trace(scene: &PatchScene, paths_per_patch: u32, technique: Technique) -> PatchLight {
    reference::irradiance(scene, &IrradianceOptions { paths_per_patch, technique, ..IrradianceOptions::default() })
}

fn luminance(light: &PatchLight, patch: PatchId) -> f64 {
    Rgb::from_f32(light.irradiance[patch.index()]).luminance()
}

/// Mean irradiance, by luminance, over the area of the patches that a condition chooses; patches are independent.
pub(crate) fn mean_over(scene: &PatchScene, light: &PatchLight, which: impl Fn(PatchId) -> bool) -> Mean {
    let (mut sum, mut square, mut area) = (0.0, 0.0, 0.0);
    for p in scene.patches().filter(|&p| which(p)) {
        sum += scene.area(p) * luminance(light, p);
        square += (scene.area(p) * f64::from(light.standard_error[p.index()])).powi(2);
        area += scene.area(p);
    }
    Mean { value: sum / area, error: square.sqrt() / area }
}

/// In a furnace irradiance is 1/(1−ρ) everywhere, and the tracer's own errors say how near it comes.
#[test]
fn a_furnace_is_even() {
    for albedo in [0.5, 0.9] {
        let scene = cut(&builtin::furnace(albedo, 1.0), 300);
        let light = trace(&scene, 1000, Technique::Both);
        let expected = 1.0 / (1.0 - albedo);
        let mean = mean_over(&scene, &light, |_| true);
        println!("albedo {albedo}: {mean:?} against {expected}, p = {:.3}", mean.p_equals(expected));
        assert!(mean.p_equals(expected) > 1e-3, "albedo {albedo}: {mean:?} against {expected}");
        let z = scene.patches().map(|p| (luminance(&light, p) - expected) / f64::from(light.standard_error[p.index()]));
        let z: Vec<f64> = z.collect();
        // The largest of 300 normal deviates is above 4.6 once in 800 times.
        let worst = z.iter().fold(0.0, |m: f64, z| m.max(z.abs()));
        assert!(worst < 4.6, "albedo {albedo}: a patch is {worst} standard errors off");
        // The mean of z² is 1 with a standard deviation of √(2/300) = .082.
        let mean_square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        println!("albedo {albedo}: mean z² {mean_square:.3}, worst {worst:.2}");
        assert!((mean_square - 1.0).abs() < 4.0 * 0.082, "albedo {albedo}: mean z² {mean_square}");
    }
}

/// A furnace seen by a camera: emission and what is reflected give the same radiance everywhere.
#[test]
fn a_furnace_looks_even() {
    let authored = builtin::furnace(0.9, 1.0);
    let scene = cut(&authored, 300);
    let options = PathPictureOptions { width: 24, height: 24, samples: 200, ..PathPictureOptions::default() };
    let (picture, variance) = reference::picture(&scene, &authored.cameras[0], &options);
    let expected = 1.0 / (PI * 0.1);
    let z = picture.image.pixels.iter().zip(&variance);
    let z: Vec<f64> = z.map(|(c, v)| (f64::from(c[1]) - expected) / f64::from(*v).sqrt()).collect();
    let n = z.len() as f64;
    let (sum, square) = (z.iter().sum::<f64>() / n.sqrt(), z.iter().map(|z| z * z).sum::<f64>() / n);
    println!("sum of z over √n {sum:.2}, mean z² {square:.3}");
    // The standard error grows with the mean of skewed samples, which moves mean z by about −skewness/(2√samples),
    // here −.07, and their sum over √n by −1.7: the two-sided limit of 5 has that in it.
    assert!(sum.abs() < 5.0, "{sum}");
    assert!((square - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{square}");
    assert!(picture.lights.iter().all(|(l, covered)| *covered == 1.0 && (f64::from(l[1]) - 1.0 / PI).abs() < 1e-6));
}

#[test]
fn parallel_plates_exchange_their_form_factor() {
    let scene = cut(&builtin::plates(1.0), 16);
    for technique in TECHNIQUES {
        let dark = mean_over(&scene, &trace(&scene, 20_000, technique), |p| scene.emission(p).is_black());
        println!("{technique:?}: {dark:?}, p = {:.3}", dark.p_equals(FORM_FACTOR));
        assert!(dark.p_equals(FORM_FACTOR) > 1e-3, "{technique:?}: {dark:?}");
        assert!(dark.error < 2e-3 * FORM_FACTOR * 4.0, "{technique:?}: {dark:?}");
    }
}

/// Plates under an even sky, which do not shine: each sees 1 − F of the sky and a black plate besides.
#[test]
fn plates_under_a_sky() {
    let mut authored = builtin::plates(1.0);
    authored.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
    authored.environment = Some(Environment::Uniform(Rgb::WHITE));
    let scene = cut(&authored, 16);
    for technique in TECHNIQUES {
        let mean = mean_over(&scene, &trace(&scene, 20_000, technique), |_| true);
        let expected = PI * (1.0 - FORM_FACTOR);
        println!("{technique:?}: {mean:?}, p = {:.3}", mean.p_equals(expected));
        assert!(mean.p_equals(expected) > 1e-3, "{technique:?}: {mean:?} against {expected}");
    }
    // One plate alone sees nothing but the sky, half of whose directions are below it: π exactly, by the path.
    authored.instances.truncate(1);
    let scene = cut(&authored, 4);
    let alone = trace(&scene, 1000, Technique::Path);
    assert!(scene.patches().all(|p| (luminance(&alone, p) - PI).abs() < 1e-5));
}

/// Unit cube, floor emitting radiosity 1, every face of albedo ρ: mean radiosities of the continuous solution, which
/// are known to about 1e-5.
#[test]
fn unit_cube() {
    for (albedo, means) in [(0.5, [1.10433, 0.17122, 0.18111]), (0.8, [1.58740, 0.66099, 0.68790])] {
        let scene = cut(&builtin::cube(albedo), 12);
        let light = trace(&scene, 40_000, Technique::Both);
        let y = |p: PatchId| scene.normal(p).y;
        let faces: [(&str, &dyn Fn(PatchId) -> bool); 3] =
            [("floor", &|p| y(p) > 0.5), ("ceiling", &|p| y(p) < -0.5), ("walls", &|p| y(p).abs() < 0.5)];
        for ((name, which), radiosity) in faces.into_iter().zip(means) {
            let expected = (radiosity - if name == "floor" { 1.0 } else { 0.0 }) / albedo;
            let mean = mean_over(&scene, &light, which);
            println!("albedo {albedo}, {name}: {mean:?} against {expected:.5}, p = {:.3}", mean.p_equals(expected));
            // 6 tests: a false-alarm rate of .6 %.
            assert!(mean.p_equals(expected) > 1e-3, "albedo {albedo}, {name}: {mean:?} against {expected}");
        }
    }
}

fn ggx(base_color: Rgb, metallic: f64, roughness: f64) -> Surface {
    Surface::MetallicRoughness {
        base_color: Texel::constant(base_color),
        metallic,
        roughness,
        metallic_roughness_texture: None,
        specular_texture: None,
        specular_color_texture: None,
        specular: 1.0,
        specular_color: Rgb::WHITE,
        ior: 1.5,
    }
}

/// A plate alone under an even sky reflects its directional albedo: this checks sampling, density and evaluation of
/// glossy materials in a path, base and lobe together.
#[test]
fn glossy_plates_reflect_their_albedo() {
    let gold = Rgb::new(0.9, 0.6, 0.3);
    let phong =
        Surface::Phong { diffuse: Texel::constant(Rgb::grey(0.4)), specular: Rgb::new(0.5, 0.4, 0.2), exponent: 30.0 };
    for surface in [ggx(gold, 0.0, 0.3), ggx(gold, 1.0, 0.5), phong] {
        let mut authored = builtin::plates(1.0);
        authored.instances.truncate(1);
        authored.materials[0].emission = Rgb::BLACK;
        authored.materials[0].surface = surface;
        authored.environment = Some(Environment::Uniform(Rgb::WHITE));
        let scene = cut(&authored, 2);
        let brdf: Brdf = scene.brdf(PatchId(0));
        for cosine in [0.9, 0.4f64] {
            // Parallel rays: one direction for all pixels, which lie well within the plate.
            let back = DVec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
            let camera = Camera {
                name: String::new(),
                eye: DVec3::new(0.5, 0.0, 0.5) + back * 2.0,
                forward: -back,
                up: DVec3::Z,
                projection: Projection::Orthographic { half_height: 0.1 },
                lens: None,
                aspect: None,
            };
            for technique in TECHNIQUES {
                let options =
                    PathPictureOptions { width: 16, height: 16, samples: 400, technique, ..Default::default() };
                let (picture, variance) = reference::picture(&scene, &camera, &options);
                let n = variance.len() as f64;
                let value = picture.image.pixels.iter().map(|c| Rgb::from_f32(*c).luminance()).sum::<f64>() / n;
                let error = variance.iter().map(|v| f64::from(*v)).sum::<f64>().sqrt() / n;
                let albedo = brdf.albedo(cosine).luminance();
                println!("{technique:?}, cosine {cosine}: {value:.4} ± {error:.4} against {albedo:.4}");
                // Four standard errors, and the interpolation error of the albedo's table (see the tests of `brdf`).
                assert!((value - albedo).abs() < 4.0 * error + 0.004, "{technique:?}, cosine {cosine}: {value}");
            }
        }
    }
}

/// Plates with a coloured picture on the lamp and holes in both, where the picture shines as well.
fn textured_plates() -> Scene {
    let mut authored = builtin::plates(0.5);
    for mesh in &mut authored.meshes {
        mesh.texcoords = Some(mesh.positions.iter().map(|p| [p[0], p[2]]).collect());
    }
    let texel =
        |x: u32, y: u32| if (x / 2 + y / 2).is_multiple_of(2) { [255, 200, 40, 255] } else { [90, 160, 255, 0] };
    authored.images.push(std::sync::Arc::new(TextureImage {
        name: "checks".into(),
        width: 8,
        height: 8,
        rgba: (0..64).flat_map(|i| texel(i % 8, i / 8)).collect(),
    }));
    let texture = TextureRef { nearest: true, ..TextureRef::of(0) };
    authored.materials[0].emission = Rgb::grey(1.0);
    authored.materials[0].emission_texture = Some(texture.clone());
    // The alpha channel of the base colour decides where a surface is, also where the base colour is all it has.
    for material in &mut authored.materials {
        material.opacity = Opacity::Mask { cutoff: 0.5 };
        material.surface = Surface::Lambertian {
            reflectance: Texel { factor: Rgb::grey(0.9), alpha: 1.0, texture: Some(texture.clone()) },
        };
    }
    authored.environment = Some(Environment::Uniform(Rgb::grey(0.05)));
    authored
}

/// The same with veils where the holes were, of alpha 0.8 and 0.2.
pub fn blended_plates() -> Scene {
    let mut authored = textured_plates();
    let image = std::sync::Arc::make_mut(&mut authored.images[0]);
    image.rgba.iter_mut().skip(3).step_by(4).for_each(|a| *a = (*a).max(64));
    for material in &mut authored.materials {
        material.opacity = Opacity::Blend;
        let Surface::Lambertian { reflectance } = &mut material.surface else { panic!() };
        reflectance.alpha = 0.8;
    }
    authored.name = "blended".into();
    authored
}

/// Shadow rays, paths and both together have one mean: with a small lamp, with sky and lamp, with glossy surfaces, and
/// with textures and holes on the lamp itself. Lamps of these scenes touch nothing that they light: where they do, as
/// in the hall, shadow rays alone have no variance, since 1/distance² is not square-integrable there.
#[test]
fn techniques_agree() {
    let mut open = builtin::cornell(false);
    open.environment = Some(Environment::Uniform(Rgb::new(0.2, 0.4, 0.9)));
    let mut glossy = builtin::cornell(false);
    glossy.materials[0].surface = ggx(Rgb::new(0.7, 0.6, 0.5), 0.5, 0.3);
    let scenes = [("cornell", builtin::cornell(false), 300), ("open", open, 300), ("glossy", glossy, 300)];
    let textured = [("textured", textured_plates(), 10_000), ("blended", blended_plates(), 10_000)];
    for (name, authored, paths) in scenes.into_iter().chain(textured) {
        let scene = cut(&authored, if paths > 1000 { 16 } else { 400 });
        let lights = TECHNIQUES.map(|technique| {
            // Other seeds: the first numbers of a path are those of its start, which would tie the estimates.
            let seed = 1 + technique as u64;
            reference::irradiance(&scene, &IrradianceOptions { paths_per_patch: paths, seed, technique })
        });
        for material in &authored.materials {
            let of = |p: PatchId| scene.material(p).name == material.name;
            let [both, by_light, by_path] = lights.each_ref().map(|l| mean_over(&scene, l, of));
            let text = format!("{name}, {}: {both:?}, {by_light:?}, {by_path:?}", material.name);
            println!("{text}");
            // 38 tests: a false-alarm rate of .4 %.
            assert!(both.p_agrees(&by_light) > 1e-4 && both.p_agrees(&by_path) > 1e-4, "{text}");
        }
    }
}

/// One-sided backs take what meets them, but cameras look through them.
#[test]
fn backs_absorb_and_are_not_seen() {
    let authored = builtin::plates(1.0);
    let scene = cut(&authored, 2);
    let above = Camera::look_at("above", DVec3::new(0.5, 3.0, 0.5), DVec3::new(0.5, 0.0, 0.5), DVec3::X, 5.0);
    let options = PathPictureOptions { width: 4, height: 4, samples: 4, ..PathPictureOptions::default() };
    let (picture, variance) = reference::picture(&scene, &above, &options);
    assert!(picture.image.pixels.iter().all(|c| (f64::from(c[1]) - 1.0 / PI).abs() < 1e-6));
    assert!(variance.iter().all(|&v| v < 1e-12));
    // The same plate, turned over: its front looks away from the lamp, and its back takes the light.
    let mut turned = authored;
    for mesh in turned.meshes.iter_mut().filter(|m| m.material == 1) {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    turned
        .materials
        .iter_mut()
        .for_each(|m| m.surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.9)) });
    let scene = cut(&turned, 2);
    for technique in TECHNIQUES {
        let light = trace(&scene, 1000, technique);
        assert!(light.irradiance.iter().all(|e| *e == [0.0; 3]), "{technique:?}: {light:?}");
    }
}

/// The claimed variance is the variance over seeds, for patches and for pixels.
#[test]
fn standard_errors_are_right() {
    const SEEDS: u64 = 24;
    let authored = builtin::cornell(false);
    let scene = cut(&authored, 150);
    let patches = |seed| {
        let options = IrradianceOptions { paths_per_patch: 64, seed, technique: Technique::Both };
        let light = reference::irradiance(&scene, &options);
        scene.patches().map(|p| (luminance(&light, p), f64::from(light.standard_error[p.index()]).powi(2))).collect()
    };
    let pixels = |seed| {
        let options = PathPictureOptions { width: 12, height: 12, samples: 64, seed, ..PathPictureOptions::default() };
        let (picture, variance) = reference::picture(&scene, &authored.cameras[0], &options);
        let luminances = picture.image.pixels.iter().map(|c| Rgb::from_f32(*c).luminance());
        luminances.zip(variance).map(|(l, v)| (l, f64::from(v))).collect()
    };
    let patches: Vec<Vec<(f64, f64)>> = (0..SEEDS).map(patches).collect();
    let pixels: Vec<Vec<(f64, f64)>> = (0..SEEDS).map(pixels).collect();
    for (name, runs) in [("patches", patches), ("pixels", pixels)] {
        let ratio = (0..runs[0].len()).filter_map(|i| {
            let values: Vec<f64> = runs.iter().map(|r| r[i].0).collect();
            let claimed = runs.iter().map(|r| r[i].1).sum::<f64>() / SEEDS as f64;
            (claimed > 0.0).then(|| Mean::of(&values).error.powi(2) * SEEDS as f64 / claimed)
        });
        let ratio = Mean::of(&ratio.collect::<Vec<f64>>());
        println!("{name}: variance over seeds relative to the claim {ratio:?}");
        // A ratio of independent estimates of one variance: its mean is 1, and its spread over patches says how sure
        // that is; p > 1e-3 with an error below 4 % leaves no room for a wrong divisor.
        assert!(ratio.p_equals(1.0) > 1e-3 && ratio.error < 0.04, "{name}: {ratio:?}");
    }
}

#[test]
fn threads_and_passes_do_not_change_a_bit() {
    let authored = builtin::hall();
    let scene = cut(&authored, 3000);
    let run = |threads: usize, passes: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let options = PathPictureOptions { width: 16, height: 9, samples: 0, ..PathPictureOptions::default() };
            let mut pixels = PixelTracer::new(&scene, &authored.cameras[0], &options);
            let mut patches = PatchTracer::new(&scene, 7, Technique::Both);
            for &n in passes {
                pixels.advance(n);
                patches.advance(n);
                let _ = (pixels.relative_error(), patches.relative_error());
            }
            assert_eq!((pixels.invalid(), patches.invalid()), (0, 0));
            (format!("{:?}{:?}", pixels.picture(), pixels.variance()), patches.light())
        })
    };
    let one = run(1, &[8]);
    for (threads, passes) in [(2, &[8][..]), (3, &[3, 5]), (8, &[1, 1, 6])] {
        assert!(run(threads, passes) == one, "{threads} threads in passes of {passes:?} differ from 1");
    }
}

/// Paths of a closed room that reflects all but a thousandth end, and their mean is right.
#[test]
fn bright_rooms_end() {
    let scene = cut(&builtin::furnace(0.99, 1.0), 40);
    let mean = mean_over(&scene, &trace(&scene, 2000, Technique::Both), |_| true);
    println!("{mean:?}, p = {:.3}", mean.p_equals(100.0));
    assert!(mean.p_equals(100.0) > 1e-3, "{mean:?}");
    // An albedo of 1 has no answer in a closed room, but the paths end.
    let scene = cut(&builtin::furnace(1.0, 1.0), 12);
    assert!(trace(&scene, 4, Technique::Both).irradiance.iter().flatten().all(|e| e.is_finite()));
}

#[test]
fn nothing_shines_in_the_dark() {
    let mut authored = builtin::cornell(true);
    authored.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
    let scene = cut(&authored, 50);
    let mut tracer = PatchTracer::new(&scene, 1, Technique::Both);
    assert_eq!(tracer.relative_error(), f64::INFINITY);
    tracer.advance(4);
    assert_eq!(tracer.relative_error(), 0.0);
    assert!(tracer.light().irradiance.iter().all(|e| *e == [0.0; 3]));
}
