//! Bent normals against hand-made ones.

use glam::DAffine3;

use super::*;
use crate::authored::{Material, Scene, TextureRef};
use crate::patch::PatchOptions;
use crate::surface::tests::{hit, square};

/// A square all of whose texels say (x, y, z).
fn bumpy(normal: [f64; 3], scale: f64) -> Scene {
    let normal_map = Some(NormalMap { texture: TextureRef::of(0), scale });
    let [r, g, b] = normal.map(|c| ((c + 1.0) * 127.5).round() as u8);
    square(Material { normal_map, two_sided: true, ..Material::default() }, 1, |_, _| [r, g, b, 255])
}

fn normal_of(scene: &Scene) -> DVec3 {
    assert_eq!(scene.validate(), []);
    let scene = PatchScene::new(scene, PatchOptions::default()).unwrap();
    // Both triangles have the same.
    let [x, y] = (scene.centre() + DVec3::new(0.2, -0.1, 0.0)).truncate().to_array();
    let at = hit(&scene, x, y);
    let normal = scene.normal_at(&at, 0.0);
    let other = SurfaceHit { triangle: 1 - at.triangle, ..at };
    assert!((scene.normal_at(&other, 0.0) - normal).length() < 1e-6);
    let back = SurfaceHit { side: Side::Back, ..at };
    assert_eq!(scene.normal_at(&back, 0.0), -normal);
    normal
}

#[track_caller]
fn points(scene: &Scene, expected: [f64; 3]) {
    let normal = normal_of(scene);
    // Texels are rounded to 1/127.5.
    assert!((normal - DVec3::from(expected)).length() < 0.01, "{normal} instead of {expected:?}");
}

const RIGHT: [f64; 3] = [0.6, 0.0, 0.8];
const UP: [f64; 3] = [0.0, 0.6, 0.8];

/// The picture's right is where u grows, its up is where v falls: here +x and +y.
#[test]
fn without_tangents_bumps_follow_the_coordinates() {
    points(&bumpy(RIGHT, 1.0), [0.6, 0.0, 0.8]);
    points(&bumpy(UP, 1.0), [0.0, 0.6, 0.8]);
    // Mirrored coordinates turn right into left and keep up; no handedness is lost.
    for (normal, expected) in [(RIGHT, [-0.6, 0.0, 0.8]), (UP, [0.0, 0.6, 0.8])] {
        let mut scene = bumpy(normal, 1.0);
        scene.meshes[0].texcoords.as_mut().unwrap().iter_mut().for_each(|t| t[0] = 1.0 - t[0]);
        points(&scene, expected);
    }
    // u' = v and v' = -u: the picture's right is down, its up is to the right.
    for (normal, expected) in [(RIGHT, [0.0, -0.6, 0.8]), (UP, [0.6, 0.0, 0.8])] {
        let mut scene = bumpy(normal, 1.0);
        let map = scene.materials[0].normal_map.as_mut().unwrap();
        map.texture.transform.rotation = std::f64::consts::FRAC_PI_2;
        points(&scene, expected);
    }
    // Without normals too.
    let mut flat = bumpy(RIGHT, 1.0);
    flat.meshes[0].normals = None;
    points(&flat, [0.6, 0.0, 0.8]);
    // Coordinates that do not vary give no direction.
    flat.meshes[0].texcoords = Some(vec![[0.5; 2]; 4]);
    assert_eq!(normal_of(&flat), DVec3::Z);
}

/// A tangent along +y, whose bitangent is normal × tangent × sign = ∓x.
#[test]
fn tangents_of_the_file_come_first() {
    for sign in [1.0f32, -1.0] {
        let with = |normal| {
            let mut scene = bumpy(normal, 1.0);
            scene.meshes[0].tangents = Some(vec![[0.0, 1.0, 0.0, sign]; 4]);
            scene
        };
        points(&with(RIGHT), [0.0, 0.6, 0.8]);
        points(&with(UP), [-0.6 * f64::from(sign), 0.0, 0.8]);
        // Without normals, or without direction, they mean nothing.
        let mut scene = with(RIGHT);
        scene.meshes[0].normals = None;
        points(&scene, [0.6, 0.0, 0.8]);
        let mut scene = with(RIGHT);
        scene.meshes[0].tangents = Some(vec![[0.0, 0.0, 1.0, sign]; 4]);
        points(&scene, [0.6, 0.0, 0.8]);
    }
}

/// A mirrored instance shows the mirrored picture, bumps and all.
#[test]
fn mirrors_mirror_bumps() {
    for tangents in [false, true] {
        for (normal, expected) in [(RIGHT, [-0.6, 0.0, 0.8]), (UP, [0.0, 0.6, 0.8])] {
            let mut scene = bumpy(normal, 1.0);
            scene.instances[0].transform = DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
            scene.meshes[0].tangents = tangents.then(|| vec![[1.0, 0.0, 0.0, 1.0]; 4]);
            points(&scene, expected);
        }
    }
}

/// The scale acts on x and y alone; whatever the picture says, the surface is seen from its own side.
#[test]
fn scales_and_steep_bumps() {
    points(&bumpy(RIGHT, 0.0), [0.0, 0.0, 1.0]);
    points(&bumpy(RIGHT, -1.0), [-0.6, 0.0, 0.8]);
    let length = f64::hypot(1.2, 0.8);
    points(&bumpy(RIGHT, 2.0), [1.2 / length, 0.0, 0.8 / length]);
    for z in [0.0, -0.8] {
        let normal = normal_of(&bumpy([0.6, 0.0, z], 1.0));
        assert!((normal.length() - 1.0).abs() < 1e-9 && normal.x > 0.9, "{normal}");
        assert!((normal.z - LEAST).abs() < 1e-9, "{normal}");
    }
}

/// Normals that authors point the other way bend as if they did not.
#[test]
fn normals_that_point_inwards_are_turned_first() {
    let mut scene = bumpy(RIGHT, 1.0);
    scene.meshes[0].normals = Some(vec![[0.0, 0.0, -1.0]; 4]);
    points(&scene, [0.6, 0.0, 0.8]);
}
