//! What pixels know beside their radiance.

use glam::DVec3;
use twinray_render::{AovOptions, Aovs, Crop, aovs};
use twinray_scene::{Camera, PatchId, Projection, Rgb, Surface, Texel, builtin};

use crate::reference::cut;

/// A plate of albedo .25 alone, 1 m square, seen from 3 m above: everything about it is known.
#[test]
fn a_plate_is_what_it_is() {
    let mut authored = builtin::plates(1.0);
    authored.instances.truncate(1);
    authored.materials.iter_mut().for_each(|m| {
        m.surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::new(0.25, 0.5, 0.75)) };
    });
    let scene = cut(&authored, 8);
    let normal = scene.normal(PatchId(0));
    let middle = scene.patches().map(|p| scene.cell_centre(p)).sum::<DVec3>() / scene.len() as f64 + scene.centre();
    let camera = Camera::look_at("c", middle + normal * 3.0, middle, DVec3::X, 60.0);
    let options = AovOptions { width: 40, height: 30, crop: None, samples: 4 };
    let all = aovs(&scene, &camera, &options);
    assert!(all.direct.is_none() && all.indirect.is_none() && all.error.is_none());
    let [albedo, normals] = [&all.albedo, &all.normal].map(|v| v.as_ref().unwrap());
    let (depth, patch) = (all.depth.as_ref().unwrap(), all.patch.as_ref().unwrap());

    // Two pixels around the middle, well within the plate, whose edge is 4.3 pixels away.
    for at in [15 * 40 + 20, 13 * 40 + 18] {
        assert_eq!(albedo[at], [0.25, 0.5, 0.75]);
        assert!((DVec3::from_array(normals[at].map(f64::from)) - normal).length() < 1e-6);
        // Along the axis, not along the ray: the same all over the plate.
        assert!((depth[at] - 3.0).abs() < 1e-6, "{}", depth[at]);
    }
    assert_eq!((albedo[0], normals[0], depth[0], patch[0]), ([0.0; 3], [0.0; 3], Aovs::NO_DEPTH, Aovs::NO_PATCH));
    // Pixels of the edge see the plate in part: less albedo, and the same depth.
    let edge: Vec<usize> = (0..albedo.len()).filter(|&i| albedo[i][0] > 0.0 && albedo[i][0] < 0.25).collect();
    assert!(!edge.is_empty() && edge.iter().all(|&i| (depth[i] - 3.0).abs() < 1e-6));
    let mut ids: Vec<u32> = patch.iter().copied().filter(|&p| p != Aovs::NO_PATCH).collect();
    ids.sort();
    ids.dedup();
    assert!(ids.len() == scene.len() && ids.iter().all(|&p| (p as usize) < scene.len()), "{ids:?}");

    // A fisheye has no plane of film: depth is distance. Samples lie within 1.5 pixels of the pixel's corner on the axis, and
    // a pixel is a thirtieth of a radian.
    let fisheye = Camera { projection: Projection::Fisheye { angle: 1.0 }, ..camera.clone() };
    let depths = aovs(&scene, &fisheye, &options).depth.unwrap();
    let at = |column: usize| f64::from(depths[15 * 40 + column]);
    let farthest = 3.0 / (1.5f64.hypot(1.5) / 30.0).cos();
    assert!(at(20) >= 3.0 - 1e-6 && at(20) < farthest && at(23) > at(20), "{} {}", at(20), at(23));

    let crop = Crop { x: 12, y: 7, width: 9, height: 11 };
    let part = aovs(&scene, &camera, &AovOptions { crop: Some(crop), ..options });
    for (i, index) in part.patch.unwrap().iter().enumerate() {
        let at = (7 + i / 9) * 40 + 12 + i % 9;
        assert_eq!((*index, part.albedo.as_ref().unwrap()[i]), (patch[at], albedo[at]));
    }
}

/// A mirror shows what faces it: as far behind itself as that is before it, and in its own colour.
#[test]
fn mirrors_show_what_faces_them() {
    let mut authored = builtin::plates(1.0);
    let gold = Rgb::new(0.9, 0.6, 0.3);
    let faces_up = |m: usize| authored.meshes.iter().any(|mesh| mesh.material == m && mesh.positions[0][1] < 0.5);
    let [mirror, other]: [usize; 2] = if faces_up(0) { [0, 1] } else { [1, 0] };
    authored.materials[mirror].surface = Surface::MetallicRoughness {
        base_color: Texel::constant(gold),
        metallic: 1.0,
        roughness: 0.0,
        metallic_roughness_texture: None,
        specular: 1.0,
        specular_texture: None,
        specular_color: Rgb::WHITE,
        specular_color_texture: None,
        ior: 1.5,
    };
    authored.materials[other].surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.5)) };
    let scene = cut(&authored, 8);
    let camera = Camera::look_at("c", DVec3::new(0.5, 0.4, 0.5), DVec3::new(0.5, 0.0, 0.5), DVec3::X, 10.0);
    let all = aovs(&scene, &camera, &AovOptions { width: 8, height: 8, crop: None, samples: 4 });
    for i in 0..64 {
        let normal = DVec3::from_array(all.normal.as_ref().unwrap()[i].map(f64::from));
        assert!((normal + DVec3::Y).length() < 1e-6, "{normal}");
        assert!((all.depth.as_ref().unwrap()[i] - 1.4).abs() < 1e-6);
        let patch = PatchId(all.patch.as_ref().unwrap()[i]);
        assert!(scene.normal(patch).y < 0.0);
        // Gold turns paler towards grazing incidence; this is within 8° of the normal.
        let albedo = Rgb::from_f32(all.albedo.as_ref().unwrap()[i]);
        assert!((albedo - gold * 0.5).map(f64::abs).max_channel() < 1e-3, "{albedo:?}");
    }
}
