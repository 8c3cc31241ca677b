//! What light meets, from outside: rays over patches, odd geometry, samplers over whole grids, laws for any input.

mod brdf;
mod coplanar;
mod degenerate;
mod gaps;
mod laws;
mod sky_lines;
mod watertight;

use glam::{DAffine3, DQuat, DVec3};
use twinray_scene::sample::{Stream, warp};
use twinray_scene::{Instance, Material, Mesh, PatchBudget, PatchOptions, PatchScene, Scene};

/// A scene of one mesh of the default material.
fn scene_of(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, transform: DAffine3) -> Scene {
    Scene {
        meshes: vec![Mesh { positions, triangles, ..Mesh::default() }],
        instances: vec![Instance { name: "it".into(), mesh: 0, transform }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

fn cut(scene: &Scene, patches: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(patches), two_sided: false }).unwrap()
}

/// Any rotation.
fn rotation(stream: &mut Stream) -> DQuat {
    let axis = warp::uniform_sphere([stream.uniform(), stream.uniform()]);
    DQuat::from_axis_angle(axis, std::f64::consts::TAU * stream.uniform())
}

/// One of `n`.
fn below(stream: &mut Stream, n: usize) -> usize {
    ((stream.uniform() * n as f64) as usize).min(n - 1)
}

/// A unit direction `sine` above the plane of the unit vector `n`.
fn grazing(stream: &mut Stream, n: DVec3, sine: f64) -> DVec3 {
    let (sin, cos) = (std::f64::consts::TAU * stream.uniform()).sin_cos();
    let flat = (1.0 - sine * sine).sqrt();
    twinray_scene::geom::Frame::from_normal(n).to_world(DVec3::new(flat * cos, flat * sin, sine))
}
