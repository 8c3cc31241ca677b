//! Real scenes: they load, with the triangles and the light that were counted by other means.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::DVec3;

use twinray_format::{FormatError, Limits, Reading, read_scene};
use twinray_scene::{Material, PatchBudget, PatchOptions, PatchScene, Rgb, Scene, Surface, Texel, Volume};

use crate::support::{normal, warnings, world_triangles};

/// The folder of test scenes, which lies beside the repository or not at all.
pub fn shared_scenes() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if root.is_dir() {
        return Some(root);
    }
    println!("skipped: ../shared/scenes is not here");
    None
}

/// Files below `root` with one of `extensions`, or all, in a fixed order.
pub fn files_below(root: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![root.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
            if path.is_dir() {
                folders.push(path);
            } else if extensions.is_empty() || extensions.contains(&extension.as_str()) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// Reads a file with those beside it.
pub fn read_file(path: &Path) -> Result<Reading, FormatError> {
    let bytes = std::fs::read(path).unwrap();
    let folder = path.parent().unwrap();
    let mut resolver = |name: &str| std::fs::read(folder.join(name));
    read_scene(&path.file_name().unwrap().display().to_string(), &bytes, &mut resolver, &Limits::default())
}

/// Triangles that the warnings say were dropped.
fn dropped(reading: &Reading) -> usize {
    let counts = reading.warnings.iter().filter(|w| w.message.contains("triangles dropped"));
    counts.map(|w| w.message.split(' ').next().unwrap().parse::<usize>().unwrap()).sum()
}

/// Σ π L A over the front sides of emissive triangles, and their area.
fn emitted_flux(scene: &Scene) -> (f64, [f64; 3]) {
    let (mut area, mut flux) = (0.0, [0.0; 3]);
    let mut triangles = world_triangles(scene).into_iter();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let emission = scene.materials[mesh.material].emission;
        for _ in &mesh.triangles {
            let a = normal(triangles.next().unwrap()).length() / 2.0;
            area += if emission.is_black() { 0.0 } else { a };
            (0..3).for_each(|c| flux[c] += PI * emission[c] * a);
        }
    }
    (area, flux)
}

#[test]
fn triangles_are_those_of_the_list() {
    let Some(root) = shared_scenes() else { return };
    // Triangles, pictures, cameras; from the list beside the scenes. obj-simple has 36 triangles, not 34.
    let cases = [
        ("cornell-box/cornell-box.glb", 38, 0, 1),
        ("cornell-box/obj-simple/cornell_box.obj", 36, 0, 0),
        ("cornell-box-baked/CornellBox.glb", 36, 0, 0),
        ("sponza-crytek/sponza-crytek.glb", 279_163, 22, 1),
        ("modern-hall/modern-hall.glb", 31_167, 3, 1),
        ("grey-white-room/grey-white-room.glb", 143_163, 4, 1),
        ("veach-ajar/veach-ajar.glb", 4_546, 3, 1),
        ("veach-mis/veach-mis.glb", 6_412, 0, 1),
        ("physical-units-living-room/living_room.glb", 5_088, 0, 0),
        ("two-rooms/two_rooms.obj", 82, 0, 0),
        ("house-lightmap/house.glb", 10_497, 1, 0),
        ("hospital/hospital.glb", 53_460, 0, 0),
        ("soda-shop/soda-shop.glb", 122_628, 0, 0),
        ("zdm2/zdm2.glb", 58_772, 0, 0),
        ("mixed-lighting-baked/MixedLightingExample.gltf", 40_898, 4, 0),
        ("khronos/BoxTextured.glb", 12, 1, 0),
        ("khronos/SpecularTest.glb", 44_828, 4, 0),
        ("khronos/AttenuationTest.glb", 292, 2, 0),
        ("khronos/NormalTangentTest.glb", 7_774, 3, 0),
        ("khronos/TransmissionRoughnessTest.glb", 77_792, 5, 0),
        ("khronos/Lights.glb", 12, 0, 1),
        ("khronos/TextureTransformTest/TextureTransformTest.gltf", 24, 5, 0),
        ("khronos/Cameras/Cameras.gltf", 2, 0, 2),
    ];
    for (name, triangles, pictures, cameras) in cases {
        let reading = read_file(&root.join(name)).unwrap_or_else(|e| panic!("{e}"));
        let kept = world_triangles(&reading.scene).len();
        assert_eq!(kept + dropped(&reading), triangles, "{name}: {kept} kept\n{}", warnings(&reading));
        assert_eq!((reading.scene.images.len(), reading.scene.cameras.len()), (pictures, cameras), "{name}");
    }
}

#[test]
fn every_real_scene_loads() {
    let Some(root) = shared_scenes() else { return };
    let all = files_below(&root, &["gltf", "glb", "obj"]);
    let good: Vec<_> = all.into_iter().filter(|p| !p.starts_with(root.join("bad"))).collect();
    assert!(good.len() > 25, "{} files", good.len());
    for file in good {
        read_file(&file).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// Of the samples that Khronos made to test readers; numbers from their JSON, worked out by hand.
#[test]
fn khronos_materials_are_read() {
    let Some(root) = shared_scenes() else { return };
    let read = |name: &str| read_file(&root.join("khronos").join(name)).unwrap();
    let material = |reading: &Reading, name: &str| {
        reading.scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}")).clone()
    };
    // Nothing is said but that white is not quite white, and what cannot be had.
    let only = |reading: &Reading, allowed: &[&str]| {
        let odd = reading.warnings.iter().find(|w| !allowed.iter().any(|a| w.message.contains(a)));
        assert!(odd.is_none(), "{}", warnings(reading));
    };

    // The arrow's tip is at 7/9 of the picture, both ways; the file has markers where it belongs after each transform.
    let reading = read("TextureTransformTest/TextureTransformTest.gltf");
    only(&reading, &["brought down to 0.98"]);
    for (name, marker) in [("Rotation", [-0.07905, -0.51627]), ("Scale", [0.01854, -0.01854]), ("All", [-0.07, -0.25])]
    {
        let texture = base(&material(&reading, name)).texture.clone().unwrap();
        let [u, v] = texture.transform.apply([marker[0] + 0.5, 0.5 - marker[1]]);
        assert!((u - 0.7778).abs() < 0.035 && (v - 0.7778).abs() < 0.035, "{name}: {u} {v}");
    }
    assert_eq!(base(&material(&reading, "Offset U")).texture.as_ref().unwrap().transform.offset, [0.5, 0.0]);

    let reading = read("NormalTangentTest.glb");
    only(&reading, &["brought down to 0.98", "occlusion maps are ignored"]);
    assert_eq!(reading.scene.materials[0].normal_map.as_ref().unwrap().scale, 1.0);

    let reading = read("SpecularTest.glb");
    only(&reading, &["brought down to 0.98"]);
    for (name, factor, color) in
        [("M2_SpecTex", true, false), ("M4_whiteTex", false, true), ("M6_yellowTex", false, true)]
    {
        let Surface::MetallicRoughness { specular_texture, specular_color_texture, .. } =
            material(&reading, name).surface
        else {
            panic!("{name}")
        };
        assert_eq!((specular_texture.is_some(), specular_color_texture.is_some()), (factor, color), "{name}");
    }

    // The colour (0.1, 0.5, 0.9) after 2 m, whatever the thickness; without a volume a pane.
    let reading = read("AttenuationTest.glb");
    only(&reading, &["brought down to 0.98"]);
    let inside = |name: &str| material(&reading, name).transmission.unwrap().volume;
    let attenuation = inside("R5_Attenuation_0.50").unwrap().attenuation;
    for (c, expected) in [10f64, 2.0, 1.0 / 0.9].map(|x| x.ln() / 2.0).into_iter().enumerate() {
        assert!((attenuation[c] - expected).abs() < 1e-6, "{attenuation:?}");
    }
    assert_eq!(inside("R2_ThicknessFac_0.25"), inside("R2_ThicknessFac_2.0"));

    let reading = read("TransmissionRoughnessTest.glb");
    only(&reading, &["brought down to 0.98"]);
    let glass = material(&reading, "Mat_IOR_1.33");
    let Surface::MetallicRoughness { metallic_roughness_texture, ior, .. } = &glass.surface else { panic!() };
    assert_eq!((metallic_roughness_texture.is_some(), *ior), (true, 1.33));
    assert_eq!(
        glass.transmission.as_ref().map(|t| (t.factor, t.volume)),
        Some((1.0, Some(Volume { attenuation: Rgb::BLACK })))
    );

    let reading = read_file(&root.join("mixed-lighting-baked/MixedLightingExample.gltf")).unwrap();
    assert!(!warnings(&reading).contains("TEXCOORD") && !warnings(&reading).contains("transform"));
    let wood = material(&reading, "wood Brown");
    let transform = base(&wood).texture.as_ref().unwrap().transform;
    assert_eq!((transform.offset, transform.scale), ([-0.8635583765172254, 1.125025697811076], [3.0, 3.0]));
    assert_eq!(transform.rotation, 0.0872664675116539);
    assert_eq!(warnings(&reading).matches("KHR_materials_sheen").count(), 1);
}

/// Half of this sample's tiles are modelled spheres, the others flat with their normal map, under turned and mirrored
/// coordinates: both halves must show the same normals.
#[test]
fn mapped_normals_are_those_of_the_modelled_shape() {
    let Some(root) = shared_scenes() else { return };
    let scene = read_file(&root.join("khronos/NormalTangentTest.glb")).unwrap().scene;
    let options = PatchOptions { budget: PatchBudget::Size(f64::INFINITY), two_sided: false };
    let scene = PatchScene::new(&scene, options).unwrap();
    let normal = |x: f64, y: f64| {
        let hit = scene.trace(DVec3::new(x, y, 3.0) - scene.centre(), DVec3::NEG_Z)?;
        Some(scene.normal_at(&hit, 0.0))
    };
    // Three columns of pairs, 0.8 apart; the second tile of a pair is 0.32 to the right of the first.
    let (mut sum, mut tilted) = (0.0, 0);
    for column in [-1.11, -0.31, 0.49] {
        for (i, j) in (0..30).flat_map(|i| (0..200).map(move |j| (i, j))) {
            let [x, y] = [column + 0.3 * (f64::from(i) + 0.5) / 30.0, 1.1 - 2.0 * (f64::from(j) + 0.5) / 200.0];
            let (Some(shape), Some(map)) = (normal(x, y), normal(x + 0.32, y)) else { continue };
            if shape.z < 0.95 {
                sum += shape.dot(map);
                tilted += 1;
            }
        }
    }
    println!("{tilted} places, mean cosine {}", sum / f64::from(tilted));
    // Places that are a hundredth off are turned by a tenth on such spheres; a wrong axis turns most by a half or more.
    assert!(tilted > 1000 && sum / f64::from(tilted) > 0.98, "{tilted}: {}", sum / f64::from(tilted));
}

fn base(material: &Material) -> &Texel {
    crate::support::colour(&material.surface)
}

#[test]
fn emitters_give_the_light_that_was_counted() {
    let Some(root) = shared_scenes() else { return };
    // Emitter area and flux, scene units.
    let cases = [
        ("cornell-box/cornell-box.glb", 13650.0, [737_514.0, 492_002.0, 131_119.0]),
        ("modern-hall/modern-hall.glb", 106.923, [1081.94, 935.485, 631.778]),
        ("veach-ajar/veach-ajar.glb", 3.86072, [12128.8, 12128.8, 12128.8]),
        ("veach-mis/veach-mis.glb", 14.5214, [8015.29, 8015.29, 8015.29]),
        ("soda-shop/soda-shop.glb", 2.54551, [1592.78, 1594.97, 1600.34]),
    ];
    for (name, area, flux) in cases {
        let (a, f) = emitted_flux(&read_file(&root.join(name)).unwrap().scene);
        println!("{name}: area {a}, flux {f:?}");
        let close = |x: f64, y: f64| (x / y - 1.0).abs() < 1e-3;
        assert!(close(a, area) && (0..3).all(|c| close(f[c], flux[c])), "{name}: area {a}, flux {f:?}");
    }
    // The hospital's list counts 32 of its 64 lamp triangles although they are exact copies of the others, which
    // we drop. What is missing shines with 200,000 lm/m², the radiosity of that lamp.
    let (area, flux) = emitted_flux(&read_file(&root.join("hospital/hospital.glb")).unwrap().scene);
    for (c, listed) in [20303.2, 20200.5, 19948.6].into_iter().enumerate() {
        let missing = (listed - flux[c]) / (1.59663 - area);
        assert!((missing / 2e5 - 1.0).abs() < 1e-3, "hospital channel {c}: {missing} per m²");
    }
}
