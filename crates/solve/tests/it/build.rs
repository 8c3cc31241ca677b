//! Small scenes of quadrilaterals, for tests that need a lamp here and a sensor there.

use glam::{DAffine3, DVec3};
use twinray_scene::{Instance, Material, Mesh, Rgb, Scene, Surface, Texel};

/// A Lambertian material.
pub fn matte(albedo: f64) -> Material {
    Material { surface: Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(albedo)) }, ..Material::default() }
}

/// A black lamp.
pub fn lamp(radiance: f64) -> Material {
    Material { emission: Rgb::grey(radiance), ..matte(0.0) }
}

/// Adds a parallelogram at `corner`, whose front is where `along` × `up` points, with a material of its own; answers
/// with that material's index.
pub fn quad(scene: &mut Scene, material: Material, corner: DVec3, along: DVec3, up: DVec3) -> usize {
    let places = [corner, corner + along, corner + along + up, corner + up];
    scene.materials.push(material);
    scene.meshes.push(Mesh {
        positions: places.map(|p| p.as_vec3().to_array()).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
    let mesh = scene.meshes.len() - 1;
    scene.instances.push(Instance { name: String::new(), mesh, transform: DAffine3::IDENTITY });
    scene.materials.len() - 1
}

/// The inside of the box from the origin to `size`, of six materials: −x, +x, −y, +y, −z, +z.
pub fn room(scene: &mut Scene, size: DVec3, materials: [Material; 6]) {
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let o = DVec3::ZERO;
    let walls = [(o, y, z), (x, z, y), (o, z, x), (y, x, z), (o, x, y), (z, y, x)];
    for (material, (corner, along, up)) in materials.into_iter().zip(walls) {
        quad(scene, material, corner, along, up);
    }
}

/// Moves the whole scene.
pub fn placed(mut scene: Scene, place: DAffine3) -> Scene {
    scene.instances.iter_mut().for_each(|i| i.transform = place * i.transform);
    scene
}
