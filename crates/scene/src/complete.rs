//! What a picture needs and a file may lack: a camera, and light.
//!
//! A scene without a camera gets one that an impatient person would choose: inside if the scene encloses its
//! middle, otherwise from outside at an angle. A scene without light gets a uniform sky, or, where no sky ray
//! can reach the camera's surroundings, a small lamp at the camera. Called once by the command, before the
//! scene is cut into its final patches.

use glam::{DAffine3, DVec3};

use crate::authored::{Environment, Instance, Material, Mesh, Scene, Surface, Texel};
use crate::camera::Camera;
use crate::patch::{PatchBudget, PatchError, PatchId, PatchOptions, PatchScene, Side};
use crate::rgb::Rgb;
use crate::sample::{Stream, warp};

/// What was added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addition {
    /// A camera was chosen.
    Camera,
    /// A uniform sky of radiance 1 was added.
    Sky,
    /// A lamp was added beside the camera, because no sky ray can enter.
    Lamp,
}

impl std::fmt::Display for Addition {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Camera => "the scene has no camera: one was chosen (--eye, --target, --up and --fov override it)",
            Self::Sky => "the scene has no light: a uniform sky of radiance 1 W/(sr m²) was added",
            Self::Lamp => "the scene has no light and no sky ray can enter: a small lamp was added at the camera",
        })
    }
}

/// Adds what is missing. `camera` is the one the user asked for, if any: the lamp goes there, and nothing is chosen.
///
/// # Errors
/// As [`PatchScene::new`]: a scene without surfaces has no sensible camera.
pub fn complete(scene: &mut Scene, camera: Option<&Camera>, two_sided: bool) -> Result<Vec<Addition>, PatchError> {
    let lit = scene.environment.is_some() || !scene.lights.is_empty() || emits(scene);
    if lit && (camera.is_some() || !scene.cameras.is_empty()) {
        return Ok(Vec::new());
    }
    let options = PatchOptions { budget: PatchBudget::Size(f64::INFINITY), two_sided };
    let patches = PatchScene::new(scene, options)?;
    let mut additions = Vec::new();
    if camera.is_none() && scene.cameras.is_empty() {
        scene.cameras.push(choose_camera(&patches));
        additions.push(Addition::Camera);
    }
    if !lit {
        // One of the two there is; the scene's only where the user asked for none.
        let view = camera.unwrap_or_else(|| &scene.cameras[0]).clone();
        if sky_reaches(&patches, view.eye - patches.centre()) {
            scene.environment = Some(Environment::Uniform(Rgb::WHITE));
            additions.push(Addition::Sky);
        } else {
            add_lamp(scene, &view, patches.radius());
            additions.push(Addition::Lamp);
        }
    }
    Ok(additions)
}

/// True if some placed mesh emits.
fn emits(scene: &Scene) -> bool {
    scene.instances.iter().any(|i| !scene.materials[scene.meshes[i.mesh].material].emission.is_black())
}

/// What rays around a point tell of a place to stand.
struct Surroundings {
    /// Share of directions that meet a surface that scatters.
    enclosed: f64,
    /// Share that meet an absorbing back: the point is inside a solid or behind a wall.
    behind: f64,
    /// Mean distance to what is met, and the direction with the widest view.
    openness: f64,
    /// Distance that only one direction in ten falls short of.
    clearance: f64,
    view: DVec3,
}

fn look_around(patches: &PatchScene, point: DVec3, directions: u64) -> Surroundings {
    let mut stream = Stream::new(0, 0x5EE, 0);
    let (mut met, mut behind, mut openness) = (0.0, 0.0, 0.0);
    // Horizontal sectors, weighted towards a level gaze.
    let mut sectors = [0.0; 16];
    let mut distances = Vec::new();
    for _ in 0..directions {
        let d = warp::uniform_sphere([stream.uniform(), stream.uniform()]);
        let Some(hit) = patches.trace(point, d) else { continue };
        met += 1.0;
        if patches.patch_of(&hit).is_none() {
            behind += 1.0;
            continue;
        }
        openness += hit.t;
        distances.push(hit.t);
        let sector = ((d.z.atan2(d.x) / std::f64::consts::TAU + 0.5) * 16.0).clamp(0.0, 15.0) as usize;
        if d.y.abs() < 0.5 {
            sectors[sector] += hit.t;
        }
    }
    // A view is as wide as the field of view: three neighbouring sectors.
    let width = |i: usize| sectors[(i + 15) % 16] + sectors[i] + sectors[(i + 1) % 16];
    let best = (0..16).max_by(|&a, &b| width(a).total_cmp(&width(b))).unwrap_or(0);
    let (sin, cos) = libm::sincos(((best as f64 + 0.5) / 16.0 - 0.5) * std::f64::consts::TAU);
    let n = directions as f64;
    distances.sort_by(f64::total_cmp);
    let clearance = distances.get(distances.len() / 10).copied().unwrap_or(0.0);
    Surroundings {
        enclosed: met / n,
        behind: behind / n,
        openness: openness / n,
        clearance,
        view: DVec3::new(cos, -0.08, sin),
    }
}

/// A camera for a scene without one.
pub fn choose_camera(patches: &PatchScene) -> Camera {
    let (low, high) = patches.bounding_box();
    let size = high - low;
    let eye_level = |y: f64| low.y + size.y * y;
    // Candidate standpoints on a grid at three heights; inside means: surrounded, and not by backs.
    let mut best: Option<(f64, DVec3, DVec3)> = None;
    for y in [0.35, 0.5, 0.65] {
        for i in 0..7 {
            for j in 0..7 {
                let place = |k: i32| (f64::from(k) + 0.5) / 7.0;
                let p = DVec3::new(low.x + size.x * place(i), eye_level(y), low.z + size.z * place(j));
                let around = look_around(patches, p, 256);
                if around.enclosed > 0.9 && around.behind < 0.02 {
                    let score = around.openness * around.clearance.sqrt() * if y == 0.5 { 1.05 } else { 1.0 };
                    if best.as_ref().is_none_or(|b| score > b.0) {
                        best = Some((score, p, around.view));
                    }
                }
            }
        }
    }
    let (eye, target, fov) = match best {
        Some((_, eye, view)) => {
            // Step back from the view as far as the room allows, to see more of it.
            let back = patches.trace(eye, -view).map_or(0.0, |hit| 0.7 * hit.t);
            let eye = eye - view * back.min(0.45 * size.max_element());
            (eye, eye + view, 65.0)
        }
        None => {
            let direction = DVec3::new(0.7, 0.45, 1.0).normalize();
            (direction * patches.radius() * 2.6, DVec3::ZERO, 45.0)
        }
    };
    let centre = patches.centre();
    Camera::look_at("chosen", eye + centre, target + centre, DVec3::Y, fov)
}

/// True if light from the sky can reach what is seen from `eye`, directly or after some bounces.
fn sky_reaches(patches: &PatchScene, eye: DVec3) -> bool {
    let mut stream = Stream::new(0, 0x5C7, 0);
    for _ in 0..2048 {
        let first = warp::uniform_sphere([stream.uniform(), stream.uniform()]);
        let (mut next, mut bounces) = (patches.trace(eye, first), 0);
        loop {
            let Some(hit) = next else { return true };
            let Some(patch) = patches.patch_of(&hit) else { break };
            bounces += 1;
            if bounces > 16 {
                break;
            }
            let local = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
            let direction = crate::geom::Frame::from_normal(patches.normal(patch)).to_world(local);
            next = patches.trace_from(patch, patches.point_of(hit.triangle, hit.u, hit.v), direction);
        }
    }
    false
}

/// A small emitting octahedron just above and behind the eye, of a power that gives the room a radiance near 1.
fn add_lamp(scene: &mut Scene, view: &Camera, radius: f64) {
    let [_, up, forward] = view.axes();
    let size = 0.004 * radius;
    let place = view.eye + (up - 0.5 * forward) * 3.0 * size;
    let positions: Vec<[f32; 3]> = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
        .map(|d| (d * size).as_vec3().to_array())
        .to_vec();
    let mut triangles = Vec::new();
    for x in [0u32, 1] {
        for y in [2u32, 3] {
            for z in [4u32, 5] {
                // One reflection turns the winding round.
                let flipped = (x + y + z) % 2 == 1;
                triangles.push(if flipped { [x, z, y] } else { [x, y, z] });
            }
        }
    }
    scene.materials.push(Material {
        name: "lamp at the camera".into(),
        surface: Surface::Lambertian { reflectance: Texel::constant(Rgb::BLACK) },
        emission: Rgb::grey(radius * radius / (size * size)),
        ..Material::default()
    });
    scene.meshes.push(Mesh {
        name: "lamp at the camera".into(),
        positions,
        triangles,
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
    scene.instances.push(Instance {
        name: "lamp at the camera".into(),
        mesh: scene.meshes.len() - 1,
        transform: DAffine3::from_translation(place),
    });
}

/// How closed a scene is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closedness {
    /// Edges that exactly two triangles share, as a share of all edges (vertices welded by position).
    pub shared_edges: f64,
    /// Share of cosine-distributed rays from the patches that escape.
    pub escaping_rays: f64,
}

impl PatchScene {
    /// Corners of the box around all vertices, in this scene's coordinates.
    pub fn bounding_box(&self) -> (DVec3, DVec3) {
        let corners = || (0..self.triangle_count() as u32).flat_map(|t| self.corners(t));
        corners().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
    }

    /// Measures how closed the scene is, with `rays` random rays.
    pub fn closedness(&self, rays: u64) -> Closedness {
        let mut edges = std::collections::HashMap::new();
        let key = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
        for t in &self.triangles {
            for i in 0..3 {
                let (a, b) = (key(t.vertices[i]), key(t.vertices[(i + 1) % 3]));
                *edges.entry((a.min(b), a.max(b))).or_insert(0u32) += 1;
            }
        }
        let shared = edges.values().filter(|&&n| n == 2).count() as f64 / edges.len().max(1) as f64;
        let mut stream = Stream::new(0, 0xC105, 0);
        let mut escaped = 0;
        // Patches have about equal areas, so a uniform choice among them is about uniform by area.
        for _ in 0..rays {
            let patch = PatchId(((stream.uniform() * self.len() as f64) as u32).min(self.len() as u32 - 1));
            let point = self.cell_point(patch, stream.uniform(), stream.uniform());
            let local = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
            let direction = crate::geom::Frame::from_normal(self.normal(patch)).to_world(local);
            escaped += u64::from(self.trace_from(patch, point, direction).is_none());
        }
        Closedness { shared_edges: shared, escaping_rays: escaped as f64 / rays.max(1) as f64 }
    }

    /// Emitted power of all patches, W (or lumen where radiance is in nit): Σ π A L.
    pub fn emitted_power(&self) -> Rgb {
        self.patches().map(|p| self.emission(p) * (std::f64::consts::PI * self.area(p))).sum()
    }

    /// Power of all lights without area, W (or lumen); of directional ones what comes through the disc around the scene.
    pub fn lights_power(&self) -> Rgb {
        self.lights.iter().map(|light| light.power()).sum()
    }

    /// The same without directional lights: power that is spent within or beside the scene, whatever its size.
    pub fn near_lights_power(&self) -> Rgb {
        self.lights.iter().filter(|light| !light.is_distant()).map(|light| light.power()).sum()
    }

    /// Area of all patches, m²; both sides of two-sided surfaces.
    pub fn total_area(&self) -> f64 {
        self.patches().map(|p| self.area(p)).sum()
    }

    /// Area-weighted mean albedo under uniform illumination.
    pub fn mean_albedo(&self) -> Rgb {
        let sum: Rgb = self.patches().map(|p| self.brdf(p).mean_albedo() * self.area(p)).sum();
        sum / self.total_area()
    }

    /// Number of patches that emit.
    pub fn emitter_count(&self) -> usize {
        self.patches().filter(|&p| !self.emission(p).is_black()).count()
    }

    /// Area of the front sides of a triangle, m².
    pub fn triangle_area(&self, triangle: u32) -> f64 {
        let t = &self.triangles[triangle as usize];
        t.cell_area * f64::from(t.cells.count())
    }

    /// True if the point sits on a side that scatters light.
    pub fn has_side(&self, triangle: u32, side: Side) -> bool {
        side == Side::Front || self.triangles[triangle as usize].two_sided
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;

    #[test]
    fn a_closed_room_without_light_gets_a_lamp_and_a_camera_inside() {
        let mut scene = builtin::furnace(0.5, 0.0);
        scene.cameras.clear();
        let added = complete(&mut scene, None, false).unwrap();
        assert_eq!(added, [Addition::Camera, Addition::Lamp]);
        let patches = PatchScene::new(&scene, PatchOptions::default()).unwrap();
        let eye = scene.cameras[0].eye - patches.centre();
        let around = look_around(&patches, eye, 1000);
        assert!(around.enclosed > 0.999 && around.behind == 0.0);
        assert!(patches.emitted_power().g > 0.0);
    }

    #[test]
    fn an_open_scene_without_light_gets_a_sky() {
        let mut scene = builtin::cornell(false);
        scene.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
        assert_eq!(complete(&mut scene, None, false).unwrap(), [Addition::Sky]);
        assert_eq!(complete(&mut scene, None, false).unwrap(), []);
    }

    /// As `--eye` and `--target` do for a file that has neither cameras nor light.
    #[test]
    fn a_wanted_camera_needs_none_of_the_scene() {
        let mut scene = builtin::cornell(false);
        let camera = scene.cameras.remove(0);
        scene.cameras.clear();
        scene.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
        assert_eq!(complete(&mut scene, Some(&camera), false).unwrap(), [Addition::Sky]);
    }
}
