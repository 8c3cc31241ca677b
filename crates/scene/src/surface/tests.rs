//! Points at full resolution: which channel is which, and what filtering does.

use std::sync::Arc;

use glam::DAffine3;

use super::*;
use crate::authored::{Instance, Mesh, TextureImage, Transmission};
use crate::patch::{PatchId, PatchOptions};

/// A unit square in the plane z = 0 that faces +z, with one picture of `width` × `width` texels; its u runs along x, its v
/// against y.
pub(crate) fn square(material: Material, width: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Scene {
    let rgba = (0..width * width).flat_map(|i| texel(i % width, i / width)).collect();
    Scene {
        meshes: vec![Mesh {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            normals: Some(vec![[0.0, 0.0, 1.0]; 4]),
            texcoords: Some(vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }],
        instances: vec![Instance { name: "square".into(), mesh: 0, transform: DAffine3::IDENTITY }],
        materials: vec![material],
        images: vec![Arc::new(TextureImage { name: "p".into(), width, height: width, rgba })],
        ..Scene::default()
    }
}

/// What a ray along −z meets at (`x`, `y`) of the world.
pub(crate) fn hit(scene: &PatchScene, x: f64, y: f64) -> SurfaceHit {
    scene.trace(DVec3::new(x, y, 1.0) - scene.centre(), DVec3::NEG_Z).unwrap()
}

fn glossy(texture: &TextureRef) -> Material {
    let texture = || Some(texture.clone());
    Material {
        surface: Surface::MetallicRoughness {
            base_color: Texel { texture: texture(), ..Texel::constant(Rgb::grey(0.5)) },
            metallic: 0.5,
            roughness: 0.9,
            metallic_roughness_texture: texture(),
            specular: 0.8,
            specular_texture: texture(),
            specular_color: Rgb::new(1.0, 0.5, 0.25),
            specular_color_texture: texture(),
            ior: 1.5,
        },
        emission: Rgb::new(1.0, 2.0, 3.0),
        emission_texture: texture(),
        transmission: Some(Transmission { factor: 0.5, texture: texture(), volume: None }),
        ..Material::default()
    }
}

/// One picture in every slot, of two halves: each slot takes the channels that glTF gives it, decoded as it says.
#[test]
fn every_slot_takes_its_channels() {
    let texture = TextureRef { nearest: true, ..TextureRef::of(0) };
    let left = [51, 102, 153, 204];
    let scene = square(glossy(&texture), 16, |x, _| if x < 8 { left } else { [255; 4] });
    let scene = PatchScene::new(&scene, PatchOptions::default()).unwrap();
    let decode = |b: u8| crate::texture::srgb_to_linear(f64::from(b) / 255.0);
    let color = Rgb::new(decode(51), decode(102), decode(153));
    let close = |a: Rgb, b: Rgb| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-7);

    let point = hit(&scene, 0.25, 0.4);
    let at = scene.surface_at(&point, 0.0);
    assert!(close(at.color, color * 0.5) && close(at.emission, Rgb::new(1.0, 2.0, 3.0) * color), "{at:?}");
    for (found, expected) in [(at.metallic, 0.5 * 0.6), (at.roughness, 0.9 * 0.4), (at.transmission, 0.5 * 0.2)] {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    let look = scene.appearance_at(point.triangle, point.u, point.v, 0.0);
    assert!((look.specular - 0.8 * 0.8).abs() < 1e-12);
    assert!(close(look.specular_color, Rgb::new(1.0, 0.5, 0.25) * color));
    assert_eq!(scene.surface_at(&SurfaceHit { side: Side::Back, ..point }, 0.0).emission, Rgb::BLACK);

    // The other half is white: factors alone, with which scattering agrees.
    let at = scene.surface_at(&hit(&scene, 0.75, 0.4), 0.0);
    assert_eq!((at.metallic, at.roughness, at.transmission), (0.5, 0.9, 0.5));
    let alone = scene.scatter_of(0, &Appearance::of(scene.material(PatchId(0))), Detail::Picture);
    assert!(close(at.scatter.brdf.mean_albedo(), alone.brdf.mean_albedo()));
}

/// The triangle with more of the white half has means nearer to it: 3/4 of one and 1/4 of the other is left.
#[test]
fn patches_have_means_of_what_points_have() {
    let texture = TextureRef { nearest: true, ..TextureRef::of(0) };
    let scene = square(glossy(&texture), 16, |x, _| if x < 8 { [0, 0, 0, 0] } else { [255; 4] });
    let options = PatchOptions { budget: crate::PatchBudget::Size(f64::INFINITY), two_sided: false };
    let scene = PatchScene::new(&scene, options).unwrap();
    for (triangle, white) in [(0, 0.75), (1, 0.25)] {
        let t = &scene.triangles[triangle];
        let [specular, red, ..] = scene.speculars[triangle];
        for (mean, factor) in [
            (t.metallic, 0.5),
            (t.roughness, 0.9),
            (t.transmission, 0.5),
            (specular, 0.8),
            (red, 1.0),
            (scene.base_color[2 * triangle][0], 0.5),
        ] {
            // Of 64 points two may be on the wrong side of the edge.
            let share = mean / factor;
            assert!((share - white).abs() < 2.5 / 64.0, "triangle {triangle}: {share} for {white}");
        }
    }
}

/// Over a footprint as large as the square any point has the mean colour; over none it has its own.
#[test]
fn footprints_average() {
    let texture = TextureRef { nearest: true, ..TextureRef::of(0) };
    let surface = Surface::Lambertian {
        reflectance: Texel { texture: Some(texture.clone()), ..Texel::constant(Rgb::grey(0.8)) },
    };
    let checks = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [255; 4] } else { [0, 0, 0, 255] };
    let authored = square(Material { surface, ..Material::default() }, 64, checks);
    let scene = PatchScene::new(&authored, PatchOptions::default()).unwrap();
    let point = hit(&scene, 0.6, 0.3);
    let sharp = scene.surface_at(&point, 0.0).color.g;
    assert!(sharp == 0.0 || (sharp - 0.8).abs() < 1e-12, "{sharp}");
    // A texel is 1/64 of a metre wide; half of one is still the picture itself, four are level 2.
    assert_eq!(scene.surface_at(&point, 0.5 / 64.0).color.g, sharp);
    for footprint in [4.0 / 64.0, 1.0, 1e9] {
        assert!((scene.surface_at(&point, footprint).color.g - 0.4).abs() < 1e-4);
    }
    // Twice as many copies on the same square: level 1 is reached at half of the footprint.
    let scaled = scene.level(point.triangle, &texture, 1.0 / 32.0);
    let mut doubled = texture;
    doubled.transform.scale = [2.0, -2.0];
    assert!((scaled - 1.0).abs() < 1e-6 && (scene.level(point.triangle, &doubled, 1.0 / 64.0) - 1.0).abs() < 1e-6);
}
