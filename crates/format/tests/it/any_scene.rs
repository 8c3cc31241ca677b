//! Any small scene survives being written as binary glTF and read again.

use glam::{DAffine3, DQuat, DVec3};
use proptest::array::uniform3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use twinray_format::write_glb;
use twinray_scene::{Instance, Material, Mesh, Opacity, Rgb, Scene, Surface, Texel, Transmission, Volume};

use crate::support::{read, warnings};

fn rgb(most: f64) -> impl Strategy<Value = Rgb> {
    uniform3(0.0..most).prop_map(Rgb::from_array)
}

/// At least one character: what has no name gets one.
fn name() -> impl Strategy<Value = String> {
    prop::collection::vec(any::<char>(), 1..6).prop_map(|c| c.into_iter().collect())
}

fn texel() -> impl Strategy<Value = Texel> {
    (rgb(0.98), 0.0..=1.0f64).prop_map(|(factor, alpha)| Texel { alpha, ..Texel::constant(factor) })
}

fn surface() -> impl Strategy<Value = Surface> {
    let coated = (texel(), 0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64, rgb(1.0), 1.0..3.0f64).prop_map(
        |(base_color, metallic, roughness, specular, specular_color, ior)| Surface::MetallicRoughness {
            base_color,
            metallic,
            roughness,
            metallic_roughness_texture: None,
            specular_texture: None,
            specular_color_texture: None,
            specular,
            specular_color,
            ior,
        },
    );
    prop_oneof![
        texel().prop_map(|reflectance| Surface::Lambertian { reflectance }),
        coated.prop_filter("a surface without lobe is read as Lambertian", |s| {
            !matches!(s, Surface::MetallicRoughness { specular, metallic, .. } if *specular == 0.0 && *metallic == 0.0)
        }),
    ]
}

fn opacity() -> impl Strategy<Value = Opacity> {
    prop_oneof![Just(Opacity::Opaque), Just(Opacity::Blend), (0.0..2.0f32).prop_map(|cutoff| Opacity::Mask { cutoff })]
}

fn material() -> impl Strategy<Value = Material> {
    let emission = prop_oneof![Just(Rgb::BLACK), rgb(1.0), rgb(1e6)];
    let volume = prop::option::of(rgb(1e4).prop_map(|attenuation| Volume { attenuation }));
    let transmission = prop::option::of((0.001..=1.0f64, volume).prop_map(|(factor, volume)| Transmission {
        factor,
        texture: None,
        volume,
    }));
    (name(), surface(), emission, any::<bool>(), transmission, opacity()).prop_map(
        |(name, surface, emission, two_sided, transmission, opacity)| Material {
            name,
            surface,
            emission,
            two_sided,
            transmission,
            opacity,
            ..Material::default()
        },
    )
}

/// Triangles with an area, no two of them alike, every vertex used.
fn mesh(materials: usize) -> impl Strategy<Value = Mesh> {
    let triangle = (uniform3(-1e3..1e3f32), uniform3(0.5..2.0f32), 0usize..3);
    let attributes = prop::collection::vec(any::<bool>(), 4);
    (name(), prop::collection::vec(triangle, 1..5), attributes, 0..materials).prop_map(
        |(name, triangles, attributes, material)| {
            let corners = |(a, size, axis): &([f32; 3], [f32; 3], usize)| {
                let (mut b, mut c) = (*a, *a);
                b[*axis] += size[0];
                c[(*axis + 1) % 3] += size[1];
                [*a, b, c]
            };
            let positions: Vec<[f32; 3]> = triangles.iter().flat_map(corners).collect();
            let n = positions.len();
            Mesh {
                name,
                normals: attributes[0].then(|| vec![[0.0, 0.6, 0.8]; n]),
                tangents: attributes[1].then(|| vec![[1.0, 0.0, 0.0, -1.0]; n]),
                texcoords: attributes[2].then(|| (0..n).map(|i| [i as f32 * 0.25, -0.5]).collect()),
                second_texcoords: attributes[3].then(|| (0..n).map(|i| [0.5, i as f32 * 0.3]).collect()),
                triangles: (0..n as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                positions,
                material,
            }
        },
    )
}

fn transform() -> impl Strategy<Value = DAffine3> {
    (uniform3(0.1..3.0f64), uniform3(-3.0..3.0f64), uniform3(-1e6..1e6f64), any::<bool>()).prop_map(
        |(scale, turn, place, mirrored)| {
            let scale = DVec3::from_array(scale) * DVec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
            DAffine3::from_scale_rotation_translation(
                scale,
                DQuat::from_scaled_axis(DVec3::from_array(turn)),
                DVec3::from_array(place),
            )
        },
    )
}

fn scene() -> impl Strategy<Value = Scene> {
    (1usize..4, 1usize..4).prop_flat_map(|(materials, meshes)| {
        let instances = prop::collection::vec((name(), 0..meshes, transform()), 1..5);
        (prop::collection::vec(material(), materials), prop::collection::vec(mesh(materials), meshes), instances)
            .prop_map(|(materials, meshes, instances)| Scene {
                materials,
                meshes,
                instances: instances
                    .into_iter()
                    .map(|(name, mesh, transform)| Instance { name, mesh, transform })
                    .collect(),
                ..Scene::default()
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_read(scene in scene()) {
        prop_assert_eq!(scene.validate(), []);
        let bytes = write_glb(&scene);
        let reading = read("a.glb", &bytes).unwrap();
        prop_assert!(reading.warnings.is_empty(), "{}", warnings(&reading));
        let again = &reading.scene;
        prop_assert_eq!(again.instances.len(), scene.instances.len());
        for (a, b) in again.instances.iter().zip(&scene.instances) {
            prop_assert_eq!(&a.name, &b.name);
            let size = b.transform.translation.abs().max_element().max(1.0);
            prop_assert!(a.transform.abs_diff_eq(b.transform, 1e-15 * size), "{:?} {:?}", a.transform, b.transform);
            let (m, n) = (&again.meshes[a.mesh], &scene.meshes[b.mesh]);
            prop_assert_eq!((&m.name, &m.positions, &m.triangles), (&n.name, &n.positions, &n.triangles));
            prop_assert_eq!((&m.normals, &m.texcoords), (&n.normals, &n.texcoords));
            prop_assert_eq!((&m.tangents, &m.second_texcoords), (&n.tangents, &n.second_texcoords));
            let (m, n) = (&again.materials[m.material], &scene.materials[n.material]);
            prop_assert_eq!((&m.name, m.two_sided, m.opacity), (&n.name, n.two_sided, n.opacity));
            let factor = |m: &Material| m.transmission.as_ref().map(|t| (t.factor, t.volume.is_some()));
            prop_assert_eq!(factor(m), factor(n));
            let inside = |m: &Material| m.transmission.as_ref().and_then(|t| t.volume).map_or(Rgb::BLACK, |v| v.attenuation);
            let (a, b) = (inside(m), inside(n));
            prop_assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-14 * b.max_channel()), "{:?} {:?}", a, b);
            for c in 0..3 {
                prop_assert!((m.emission[c] - n.emission[c]).abs() <= 1e-12 * n.emission[c], "{:?} {:?}", m.emission, n.emission);
            }
            prop_assert_eq!(format!("{:?}", m.surface), format!("{:?}", n.surface));
        }
    }
}
