//! Which sides of which meshes carry baked light: one part for each lit side of a placed mesh.
//!
//! Both sides of a two-sided sheet have light of their own, so a sheet that is lit from behind becomes two parts, which
//! are drawn one-sided. Files often call solid walls two-sided; their backs are dark, and one part is enough.

use twinray_scene::{PatchId, PatchScene, Scene, Side, TriangleSource, sources};
use twinray_solve::Solution;

/// Share of a part's light that its back must have to be drawn on its own,
const LIT_BACK: f64 = 2e-3;
/// and share of the part's mean irradiance below which a triangle of it is dark.
const DARK: f64 = 1e-4;
/// Mean diffuse reflectance below which a surface shows no irradiance: metal, clear glass.
const DIFFUSE: f64 = 1e-3;

/// A side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Of the patches' scene.
    pub triangle: u32,
    /// Vertices of the mesh, counter-clockwise in the world as seen from the part's side.
    pub corners: [u32; 3],
    /// No light reaches it: the unlit side of a sheet that is lit on both elsewhere.
    pub dark: bool,
}

/// One side of a placed mesh, with light.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Index into [`Scene::instances`].
    pub instance: usize,
    /// Which side.
    pub side: Side,
    /// The other side is a part of its own.
    pub one_sided: bool,
    /// Whether the instance's transform mirrors: there the corners of faces run clockwise in the mesh's own coordinates.
    pub mirrored: bool,
    /// Triangles in the order of the mesh.
    pub faces: Vec<Face>,
}

impl Part {
    /// Barycentric weights of vertices 1 and 2 of the scene's triangle, where a face's corners have these weights.
    pub fn place(&self, weights: [f64; 3]) -> [f64; 2] {
        match self.side {
            Side::Front => [weights[1], weights[2]],
            Side::Back => [weights[2], weights[1]],
        }
    }

    /// Corners of a face in the order in which they are drawn: counter-clockwise in the mesh's own coordinates as seen from the
    /// part's side, unless the transform mirrors.
    pub fn drawn<T: Copy>(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }
}

/// The parts of a scene that was cut into `patches`, in the order of its instances, fronts first.
///
/// Surfaces without diffuse reflection have no part: nothing of their look comes from irradiance.
pub fn parts(scene: &Scene, patches: &PatchScene, solution: &Solution) -> Vec<Part> {
    let sources = sources(scene);
    let mut found = Vec::new();
    for triangles in (0..sources.len() as u32)
        .collect::<Vec<_>>()
        .chunk_by(|&a, &b| sources[a as usize].instance == sources[b as usize].instance)
    {
        let source = sources[triangles[0] as usize];
        let instance = source.instance as usize;
        if !is_diffuse(patches, triangles) {
            continue;
        }
        let mesh = &scene.meshes[scene.instances[instance].mesh];
        let light =
            |side: Side| -> Vec<[f64; 2]> { triangles.iter().map(|&t| arriving(patches, solution, t, side)).collect() };
        let [front, back] = [light(Side::Front), light(Side::Back)];
        let power = |light: &[[f64; 2]]| light.iter().map(|l| l[0]).sum::<f64>();
        let two = power(&back) > LIT_BACK * (power(&front) + power(&back));
        let part = |side: Side, light: &[[f64; 2]]| {
            let area: f64 = light.iter().map(|l| l[1]).sum();
            let mean = power(light) / area.max(f64::MIN_POSITIVE);
            let face = |(&triangle, [power, area]): (&u32, &[f64; 2])| Face {
                triangle,
                corners: corners(mesh.triangles[sources[triangle as usize].triangle as usize], source, side),
                // Elsewhere a triangle that no ray has met yet has neighbours that know better.
                dark: two && *power <= DARK * mean * area,
            };
            Part {
                instance,
                side,
                one_sided: two,
                mirrored: source.mirrored,
                faces: triangles.iter().zip(light).map(face).collect(),
            }
        };
        found.push(part(Side::Front, &front));
        if two {
            found.push(part(Side::Back, &back));
        }
    }
    found.sort_by_key(|p| p.side == Side::Back);
    found
}

/// Corners counter-clockwise in the world as seen from a side.
fn corners([a, b, c]: [u32; 3], source: TriangleSource, side: Side) -> [u32; 3] {
    if source.mirrored == (side == Side::Front) { [a, c, b] } else { [a, b, c] }
}

/// Luminous power on one side of a triangle, and its area.
fn arriving(patches: &PatchScene, solution: &Solution, triangle: u32, side: Side) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for patch in cells(patches, triangle, side) {
        let area = patches.area(patch);
        sum[0] += area * solution.irradiance(patch).luminance();
        sum[1] += area;
    }
    sum
}

/// Patches of one side of a triangle; none on an absorbing back.
fn cells(patches: &PatchScene, triangle: u32, side: Side) -> impl Iterator<Item = PatchId> {
    let cells = patches.cells_of(triangle);
    let [u, v] = cells.centre(0);
    let first = patches.patch_at(triangle, side, u, v);
    first.into_iter().flat_map(move |first| (0..cells.count()).map(move |k| PatchId(first.0 + k)))
}

fn is_diffuse(patches: &PatchScene, triangles: &[u32]) -> bool {
    let base = |p: PatchId| patches.brdf(p).base_reflectance(1.0).max_channel();
    triangles.iter().any(|&t| cells(patches, t, Side::Front).any(|p| base(p) > DIFFUSE))
}
