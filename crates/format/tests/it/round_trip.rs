//! What is written reads back as the same scene.

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, dvec3};
use twinray_format::{Reading, write_glb, write_obj};
use twinray_scene::{
    Camera, Environment, Instance, Material, Mesh, NormalMap, Opacity, Projection, Rgb, Scene, Surface, Texel,
    TextureImage, TextureRef, TextureTransform, Transmission, Volume, Wrap,
};

use crate::support::{colour, read, read_with, warnings, world_triangles};

/// Of very different strengths, none of which may be lost.
const ABSORBS: Rgb = Rgb { r: 0.001, g: 4500.0, b: 0.0 };

/// A scene with one of everything.
fn everything() -> Scene {
    let rgba = vec![255, 0, 0, 255, 0, 200, 0, 128, 0, 0, 100, 0, 9, 9, 9, 255];
    let image = TextureImage { name: "tiles".into(), width: 2, height: 2, rgba };
    let textured = |factor| Texel {
        factor,
        alpha: 0.75,
        texture: Some(TextureRef { wrap: [Wrap::Mirror, Wrap::Clamp], nearest: true, ..TextureRef::of(0) }),
    };
    let moved = |set, rotation| TextureRef {
        set,
        transform: TextureTransform { offset: [0.25, -3.0], rotation, scale: [2.0, -0.125] },
        ..TextureRef::of(0)
    };
    let material = |name: &str, surface| Material { name: name.into(), surface, ..Material::default() };
    let materials = vec![
        Material {
            two_sided: true,
            ..material("wall", Surface::Lambertian { reflectance: textured(Rgb::new(0.9, 0.8, 0.7)) })
        },
        Material {
            emission: Rgb::new(17.25, 11.5, 3.0),
            ..material("lamp", Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.25)) })
        },
        Material {
            emission: Rgb::new(0.5, 0.25, 0.0),
            emission_texture: textured(Rgb::WHITE).texture,
            opacity: Opacity::Mask { cutoff: 0.25 },
            transmission: Some(Transmission { factor: 0.75, texture: Some(moved(1, 0.0)), volume: None }),
            normal_map: Some(NormalMap { texture: moved(0, 0.3), scale: 0.5 }),
            ..material(
                "metal",
                Surface::MetallicRoughness {
                    base_color: textured(Rgb::grey(0.5)),
                    metallic: 0.75,
                    roughness: 0.3,
                    metallic_roughness_texture: textured(Rgb::WHITE).texture,
                    specular: 0.5,
                    specular_texture: Some(moved(1, -2.0)),
                    specular_color: Rgb::new(1.0, 0.5, 0.25),
                    specular_color_texture: Some(TextureRef { set: 1, ..TextureRef::of(0) }),
                    ior: 1.33,
                },
            )
        },
        Material {
            opacity: Opacity::Blend,
            transmission: Some(Transmission {
                factor: 1.0,
                texture: None,
                volume: Some(Volume { attenuation: ABSORBS }),
            }),
            normal_map: Some(NormalMap { texture: TextureRef::of(0), scale: 1.0 }),
            ..material("water", Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.9)) })
        },
        material(
            "gloss",
            Surface::Phong { diffuse: Texel::constant(Rgb::grey(0.4)), specular: Rgb::grey(0.3), exponent: 30.0 },
        ),
    ];
    let mesh = |name: &str, material, rich: bool| Mesh {
        name: name.into(),
        positions: vec![[0.1, 0.0, 0.0], [1.0, 0.3, 0.0], [0.0, 1.0, 0.7], [-1.0, -1.0, 1.0 / 3.0]],
        normals: rich.then(|| vec![[0.0, 0.0, 1.0]; 4]),
        tangents: rich.then(|| vec![[0.6, 0.8, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, 1.0], [0.0; 4]]),
        texcoords: rich.then(|| vec![[0.0, 0.25], [1.0, 0.0], [0.3, 1.0], [-2.0, 3.5]]),
        second_texcoords: rich.then(|| vec![[0.5, 0.25], [1.0, 7.0], [0.3, 0.1], [-2.5, 0.5]]),
        triangles: vec![[0, 1, 2], [2, 3, 0]],
        material,
    };
    let meshes =
        vec![mesh("a", 0, true), mesh("b", 1, false), mesh("c", 2, true), mesh("d", 3, true), mesh("e", 4, false)];
    let place = |name: &str, mesh, transform| Instance { name: name.into(), mesh, transform };
    let turned = DAffine3::from_scale_rotation_translation(
        dvec3(2.0, -1.0, 0.5),
        DQuat::from_axis_angle(dvec3(1.0, 2.0, 2.0) / 3.0, 0.7),
        dvec3(0.1, 0.2, 0.3),
    );
    let instances = vec![
        place("plain", 0, DAffine3::IDENTITY),
        place("mirrored", 0, turned),
        place("moved", 1, DAffine3::from_translation(dvec3(10.0, 0.0, 1e-3))),
        place("c", 2, turned),
        place("d", 3, DAffine3::IDENTITY),
        place("e", 4, DAffine3::IDENTITY),
    ];
    let mut camera = Camera::look_at("eye", dvec3(3.0, 2.0, 1.0), DVec3::ZERO, DVec3::Y, 40.0);
    camera.aspect = Some(1.5);
    let plan =
        Camera { name: "plan".into(), projection: Projection::Orthographic { half_height: 2.5 }, ..camera.clone() };
    Scene {
        name: "everything".into(),
        meshes,
        instances,
        materials,
        images: vec![Arc::new(image)],
        cameras: vec![camera, plan],
        animations: Vec::new(),
        environment: Some(Environment::Uniform(Rgb::new(1.0, 2.0, 3.5))),
        lights: Vec::new(),
        suggested_patches: Some(1234),
    }
}

fn close(a: Rgb, b: Rgb) -> bool {
    (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-12 * (1.0 + b[c].abs()))
}

#[test]
fn glb_keeps_everything() {
    let scene = everything();
    let bytes = write_glb(&scene);
    assert_eq!(bytes, write_glb(&scene), "equal scenes, equal bytes");
    let Reading { scene: read, .. } = read("everything.glb", &bytes).unwrap();
    assert_eq!((read.name.as_str(), read.suggested_patches), ("everything", Some(1234)));
    assert_eq!(read.environment, scene.environment);
    for (a, b) in read.instances.iter().zip(&scene.instances) {
        assert_eq!(a.name, b.name);
        assert!(a.transform.abs_diff_eq(b.transform, 1e-15), "{}", a.name);
        let (a, b) = (&read.meshes[a.mesh], &scene.meshes[b.mesh]);
        assert_eq!((&a.positions, &a.triangles, &a.normals), (&b.positions, &b.triangles, &b.normals));
        assert_eq!((&a.name, &a.texcoords), (&b.name, &b.texcoords));
        assert_eq!((&a.tangents, &a.second_texcoords), (&b.tangents, &b.second_texcoords));
    }
    assert_eq!(read.instances.len(), scene.instances.len());
    assert_eq!(read.images[0].rgba, scene.images[0].rgba);
    for (a, b) in read.materials.iter().zip(&scene.materials) {
        assert_eq!((&a.name, a.two_sided, a.opacity), (&b.name, b.two_sided, b.opacity));
        assert!(close(a.emission, b.emission), "{a:?}");
        assert_eq!((&a.emission_texture, &a.normal_map), (&b.emission_texture, &b.normal_map));
        assert_eq!(format!("{:?}", a.surface), format!("{:?}", b.surface));
        let passing = |m: &Material| m.transmission.clone().map(|t| (t.factor, t.texture, t.volume.is_some()));
        assert_eq!(passing(a), passing(b));
    }
    let attenuation = read.materials[3].transmission.as_ref().unwrap().volume.unwrap().attenuation;
    assert!((0..3).all(|c| (attenuation[c] - ABSORBS[c]).abs() < 1e-12 * ABSORBS.g), "{attenuation:?}");
    for (a, b) in read.cameras.iter().zip(&scene.cameras) {
        let pairs = a.axes().into_iter().zip(b.axes());
        assert!(pairs.chain([(a.eye, b.eye)]).all(|(a, b)| (a - b).length() < 1e-12));
        assert_eq!((&a.name, a.projection, a.aspect), (&b.name, b.projection, b.aspect));
    }
    assert_eq!(read.cameras.len(), 2);
}

/// Others see a lobe that glTF knows; who changes it there gets what they see.
#[test]
fn phong_lobes_have_a_stand_in() {
    let scene = everything();
    let bytes = write_glb(&scene);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    // α = √(2/32) = 0.25, so the roughness is 0.5, and F0 = 0.04 × 7.5 = 0.3.
    assert!(text.contains("\"roughnessFactor\":0.5") && text.contains("7.5"), "{text}");
    let changed: Vec<u8> = {
        let from = b"\"roughnessFactor\":0.5";
        let at = bytes.windows(from.len()).position(|w| w == from).unwrap();
        [&bytes[..at], b"\"roughnessFactor\":0.6", &bytes[at + from.len()..]].concat()
    };
    let Surface::MetallicRoughness { base_color, metallic, roughness, specular, specular_color, .. } =
        read("a.glb", &changed).unwrap().scene.materials.swap_remove(4).surface
    else {
        panic!()
    };
    assert_eq!((base_color.factor, metallic, roughness, specular), (Rgb::grey(0.4), 0.0, 0.6, 1.0));
    assert!(close(specular_color, Rgb::grey(7.5)), "{specular_color:?}");
}

#[test]
fn glb_needs_neither_cameras_nor_pictures() {
    let mut scene = everything();
    scene.cameras.clear();
    scene.images.clear();
    scene.environment = None;
    scene.suggested_patches = None;
    scene.materials = vec![Material::default()];
    scene.meshes.iter_mut().for_each(|m| m.material = 0);
    scene.meshes.push(Mesh::default());
    let text = String::from_utf8_lossy(&write_glb(&scene)).into_owned();
    for absent in ["cameras", "images", "textures", "extras"] {
        assert!(!text.contains(absent), "{absent}");
    }
    let read = read("a.glb", &write_glb(&scene)).unwrap().scene;
    assert_eq!(read.instances.len(), 6);
    assert_eq!(read.meshes.len(), 5, "a mesh without triangles is left out");
    // Nothing but an empty file comes of nothing.
    assert!(crate::support::read("a.glb", &write_glb(&Scene::default())).is_err());
}

#[test]
fn obj_keeps_triangles_and_matt_materials() {
    let mut scene = everything();
    // The surface of glass and of metal has no equal in the format.
    scene.materials[2].surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.5)) };
    scene.materials[2].opacity = Opacity::Opaque;
    let files = write_obj(&scene);
    assert_eq!(files, write_obj(&scene), "equal scenes, equal bytes");
    assert_eq!((files.mtl_name.as_str(), files.textures.len()), ("everything.mtl", 1));
    let mut beside: Vec<(&str, &[u8])> = vec![(&files.mtl_name, &files.mtl)];
    beside.extend(files.textures.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())));
    let reading = read_with("everything.obj", &files.obj, &beside).unwrap();
    let (read, wanted) = (world_triangles(&reading.scene), world_triangles(&scene));
    assert_eq!(read.len(), wanted.len(), "{}", warnings(&reading));
    for (a, b) in read.iter().zip(&wanted) {
        // Corners may be rotated, never mirrored; single precision relative to the origin.
        let rotations = (0..3).map(|r| (0..3).map(|i| (a[(i + r) % 3] - b[i]).length()).fold(0.0, f64::max));
        let best = rotations.fold(f64::INFINITY, f64::min);
        assert!(best < 1e-5, "{a:?} {b:?}");
    }
    for (a, b) in reading.scene.materials.iter().zip(&scene.materials) {
        assert_eq!((&a.name, a.emission, a.transmission.is_some()), (&b.name, b.emission, b.transmission.is_some()));
        assert_eq!(colour(&a.surface).factor, colour(&b.surface).factor);
        assert_eq!(colour(&a.surface).texture.is_some(), colour(&b.surface).texture.is_some());
        assert!(a.two_sided);
    }
    assert_eq!(reading.scene.images[0].rgba, scene.images[0].rgba);
    // Glass keeps whether it is a body and how much passes, though not what it absorbs.
    for (i, factor, is_body) in [(2, 0.75, false), (3, 1.0, true)] {
        let read = &reading.scene.materials[i];
        let transmission = read.transmission.as_ref().unwrap();
        assert_eq!((transmission.factor, transmission.volume.is_some()), (factor, is_body));
        let scale = |m: &Material| m.normal_map.as_ref().map(|n| n.scale);
        assert_eq!(scale(read), scale(&scene.materials[i]));
    }
    let placed = &reading.scene.materials[2].normal_map.as_ref().unwrap().texture.transform;
    assert_eq!((placed.offset, placed.scale), ([0.25, -3.0], [2.0, -0.125]), "all but the turn");
    let Surface::Phong { specular, exponent, .. } = &reading.scene.materials[4].surface else { panic!() };
    assert_eq!((*specular, *exponent), (Rgb::grey(0.3), 30.0));
    assert_eq!(reading.scene.meshes[0].texcoords, scene.meshes[0].texcoords);
}

#[test]
fn obj_survives_odd_names() {
    let mut scene = everything();
    for (i, name) in ["a", "a", " two  words\\", "line\nbreak", ""].into_iter().enumerate() {
        scene.instances[i].name = name.into();
    }
    scene.materials.iter_mut().for_each(|m| m.name = "# same".into());
    scene.name = "dir/ä b".into();
    let files = write_obj(&scene);
    assert_eq!(files.mtl_name, "dir___b.mtl");
    let beside: [(&str, &[u8]); 1] = [(&files.mtl_name, &files.mtl)];
    let reading = read_with("a.obj", &files.obj, &beside).unwrap();
    let names: Vec<_> = reading.scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["a", "a.2", "two words_", "line_break", "object", "e"]);
    assert_eq!(reading.scene.materials.len(), 5);
    assert_eq!(reading.scene.materials[1].emission, scene.materials[1].emission);
}
