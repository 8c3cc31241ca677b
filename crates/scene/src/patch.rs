//! Scene to patches: world-space triangles cut into cells, each with its area, normal and material means.
//!
//! A [`PatchScene`] is immutable and holds everything that a ray can meet. Coordinates are relative to the
//! scene's centre, in single precision where the ray kernel reads them: far from the origin f32 has no
//! millimetres left. A two-sided triangle has two sets of patches back to back, each with its own state.
//! Not here: the cells' arithmetic (`cells`), means of textures (`means`), points (`surface`), rays (`bvh`), light (solve).

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::authored::{Material, Mesh, Opacity, Scene, Surface, TextureImage};
use crate::brdf::{Brdf, Detail, Scatter, Specular};
use crate::cells::{Cells, Outline};
use crate::environment::EnvironmentLight;
use crate::geom::area_vector_2;
use crate::mips::Mips;
use crate::punctual::PointLight;
use crate::rgb::Rgb;
use crate::surface::{Appearance, without_needless_alpha};

/// How finely a scene is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchBudget {
    /// About so many patches, distributed by area; never fewer than there are triangle sides.
    Count(usize),
    /// Cells of about this side, metres; infinite gives one patch per triangle side.
    Size(f64),
}

/// Settings of [`PatchScene::new`].
#[derive(Clone, Copy, Debug)]
pub struct PatchOptions {
    /// How finely to cut.
    pub budget: PatchBudget,
    /// Treat every material as two-sided.
    pub two_sided: bool,
}

impl Default for PatchOptions {
    fn default() -> Self {
        Self { budget: PatchBudget::Count(100_000), two_sided: false }
    }
}

/// Why a scene cannot be cut into patches.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum PatchError {
    /// There is no surface at all.
    #[error(
        "the scene has no triangle with an area; expected at least one: check that the file has meshes, and that its units are not vanishingly small"
    )]
    Empty,
    /// More patches than 31 bits can number.
    #[error(
        "{0} patches are more than the limit of 2147483647: ask for fewer (--patches) or larger ones (--patch-size)"
    )]
    TooMany(f64),
    /// A size or a count that is not positive.
    #[error("a patch size of {0} makes no sense: expected a positive number of metres, or inf")]
    Size(f64),
}

/// Index of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PatchId(pub u32);

impl PatchId {
    /// As an array index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Whence the vertices are counter-clockwise.
    Front,
    /// The other.
    Back,
}

/// A world-space triangle and the place of its patches.
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    pub vertices: [[f32; 3]; 3],
    pub normal: DVec3,
    pub cells: Cells,
    pub cell_area: f64,
    pub first_patch: u32,
    pub material: u32,
    pub two_sided: bool,
    pub metallic: f32,
    pub roughness: f32,
    /// Share of the base that transmits.
    pub transmission: f32,
}

impl Triangle {
    #[inline]
    pub fn vertex(&self, i: usize) -> DVec3 {
        let [x, y, z] = self.vertices[i];
        DVec3::new(f64::from(x), f64::from(y), f64::from(z))
    }

    #[inline]
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let a = self.vertex(0);
        a + (self.vertex(1) - a) * u + (self.vertex(2) - a) * v
    }
}

/// Vertex attributes for display, beside the triangles so that the solver's memory stays compact.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attributes {
    pub normals: Option<[[f32; 3]; 3]>,
    pub texcoords: Option<[[f32; 2]; 3]>,
}

/// Everything a ray can meet, cut into patches.
#[derive(Debug)]
pub struct PatchScene {
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) attributes: Vec<Attributes>,
    /// Per triangle, as its mesh has them; empty if no material asks.
    pub(crate) second_texcoords: Vec<Option<[[f32; 2]; 3]>>,
    /// Per triangle: mean factor and colour of the lobe's reflectance; empty if no material has textures for it.
    pub(crate) speculars: Vec<[f32; 4]>,
    /// Per triangle, in the world, with the sign of the bitangent; empty if no material asks.
    pub(crate) tangents: Vec<Option<[[f32; 4]; 3]>>,
    pub(crate) materials: Vec<Material>,
    pub(crate) images: Vec<Arc<TextureImage>>,
    /// Per picture.
    pub(crate) mips: Vec<Mips>,
    pub(crate) kernel: twinray_rays::Bvh,
    /// Whether any material has holes, which rays must ask about.
    pub(crate) holes: bool,
    /// Whether rays of the solver go on at some surfaces.
    pub(crate) passes: bool,
    /// Whether shadow rays pass some surfaces.
    panes: bool,
    pub(crate) environment: Option<EnvironmentLight>,
    pub(crate) lights: Vec<PointLight>,
    /// Per patch: triangle × 2 + side.
    owner: Vec<u32>,
    /// Per patch: mean base colour.
    pub(crate) base_color: Vec<[f32; 3]>,
    /// Per patch: mean emitted radiance; empty if nothing emits.
    pub(crate) emission: Vec<[f32; 3]>,
    /// Per patch: share of its cell that is there; empty if no material has holes.
    pub(crate) coverage: Vec<f32>,
    centre: DVec3,
    radius: f64,
    degenerate: usize,
}

/// Largest magnitude of a coordinate that the ray kernel meets; what lies beyond must not become a patch either.
const MAX_COORDINATE: f32 = 1e18;

impl PatchScene {
    /// Cuts `scene` into patches and builds its ray kernel.
    ///
    /// Triangles without area are left out, and those with a vertex that is not a number or beyond 1e18:
    /// [`PatchScene::degenerate_triangles`]. What light passes has two sides.
    ///
    /// # Errors
    /// If there is no surface, or more patches than can be numbered.
    ///
    /// # Panics
    /// If an index of the scene is out of range: see [`Scene::validate`].
    pub fn new(scene: &Scene, options: PatchOptions) -> Result<Self, PatchError> {
        let (centre, radius) = bounds(scene).ok_or(PatchError::Empty)?;
        let mut triangles = Vec::new();
        let mut attributes = Vec::new();
        let (mut second_texcoords, mut tangents) = (Vec::new(), Vec::new());
        let [with_second, with_tangents] = rare_attributes(scene);
        let left_out = place(scene, centre, &mut |placed| {
            let Placed { mesh, corner, vertices, across, .. } = placed;
            triangles.push(Triangle {
                vertices,
                normal: across.normalize(),
                cells: Cells::Regular { m: 1 },
                cell_area: 0.5 * across.length(),
                first_patch: 0,
                material: mesh.material as u32,
                two_sided: scene.materials[mesh.material].has_two_sides() || options.two_sided,
                metallic: 0.0,
                roughness: 1.0,
                transmission: 0.0,
            });
            attributes.push(Attributes {
                normals: mesh.normals.as_ref().map(|n| {
                    corner.map(|k| (placed.normal_matrix * vec(n[k])).normalize_or_zero().as_vec3().to_array())
                }),
                texcoords: mesh.texcoords.as_ref().map(|t| corner.map(|k| t[k])),
            });
            if with_second {
                second_texcoords.push(mesh.second_texcoords.as_ref().map(|t| corner.map(|k| t[k])));
            }
            if with_tangents {
                tangents.push(mesh.tangents.as_ref().map(|t| corner.map(|k| placed.tangent(t[k]))));
            }
        });
        if triangles.is_empty() {
            return Err(PatchError::Empty);
        }
        divide(&mut triangles, options.budget)?;

        let patches = triangles.last().map_or(0, |t| t.first_patch + sides(t) * t.cells.count()) as usize;
        let mut owner = Vec::with_capacity(patches);
        for (index, t) in triangles.iter().enumerate() {
            for side in 0..sides(t) {
                owner.extend(std::iter::repeat_n(2 * index as u32 + side, t.cells.count() as usize));
            }
        }
        let kernel_input: Vec<_> = triangles.iter().map(|t| t.vertices).collect();
        let mut this = Self {
            triangles,
            attributes,
            second_texcoords,
            tangents,
            materials: without_needless_alpha(scene),
            images: scene.images.clone(),
            mips: scene.images.iter().map(|_| Mips::default()).collect(),
            speculars: Vec::new(),
            kernel: twinray_rays::Bvh::build(&kernel_input),
            holes: false,
            passes: false,
            panes: scene.materials.iter().any(|m| m.transmission.is_some()),
            environment: scene.environment.clone().map(|e| EnvironmentLight::new(e, radius)),
            lights: scene.lights.iter().map(|light| PointLight::new(light, centre, radius)).collect(),
            owner,
            base_color: Vec::new(),
            emission: Vec::new(),
            coverage: Vec::new(),
            centre,
            radius,
            degenerate: left_out,
        };
        this.holes = this.materials.iter().any(|m| m.opacity != Opacity::Opaque);
        debug_assert_eq!(this.kernel.left_out(), 0, "a patch that no ray can meet");
        this.average_materials();
        Ok(this)
    }

    /// Number of patches, K.
    pub fn len(&self) -> usize {
        self.owner.len()
    }

    /// Never true: a scene without patches is refused.
    pub fn is_empty(&self) -> bool {
        self.owner.is_empty()
    }

    /// Number of triangles that rays can meet.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of triangles that were left out because, where they are placed, they have no area or no finite place.
    pub fn degenerate_triangles(&self) -> usize {
        self.degenerate
    }

    /// What to subtract from a world position to get this scene's coordinates.
    pub fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Radius of a sphere around the centre that holds every vertex, metres.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The surroundings, if they emit.
    pub fn environment(&self) -> Option<&EnvironmentLight> {
        self.environment.as_ref()
    }

    /// The lights without area, in the order of the scene.
    pub fn lights(&self) -> &[PointLight] {
        &self.lights
    }

    /// All patches.
    pub fn patches(&self) -> impl ExactSizeIterator<Item = PatchId> + use<> {
        (0..self.owner.len() as u32).map(PatchId)
    }

    /// The triangle of a patch.
    #[inline]
    pub fn triangle_of(&self, patch: PatchId) -> u32 {
        self.owner[patch.index()] >> 1
    }

    /// The side of the triangle on which a patch lies.
    #[inline]
    pub fn side_of(&self, patch: PatchId) -> Side {
        if self.owner[patch.index()] & 1 == 0 { Side::Front } else { Side::Back }
    }

    /// The cell of its triangle that a patch is.
    #[inline]
    pub fn cell_of(&self, patch: PatchId) -> u32 {
        let owner = self.owner[patch.index()];
        let t = &self.triangles[(owner >> 1) as usize];
        patch.0 - t.first_patch - (owner & 1) * t.cells.count()
    }

    /// The patch at barycentric (`u`, `v`) of one side of a triangle; `None` on the absorbing back of a one-sided one.
    #[inline]
    pub fn patch_at(&self, triangle: u32, side: Side, u: f64, v: f64) -> Option<PatchId> {
        let t = &self.triangles[triangle as usize];
        let first = match side {
            Side::Front => t.first_patch,
            Side::Back if t.two_sided => t.first_patch + t.cells.count(),
            Side::Back => return None,
        };
        Some(PatchId(first + t.cells.locate(u, v)))
    }

    /// Area, m²; of what is there, where the material has holes.
    #[inline]
    pub fn area(&self, patch: PatchId) -> f64 {
        let area = self.triangles[self.triangle_of(patch) as usize].cell_area;
        if self.coverage.is_empty() { area } else { area * f64::from(self.coverage[patch.index()]) }
    }

    /// Outward unit normal, geometric.
    #[inline]
    pub fn normal(&self, patch: PatchId) -> DVec3 {
        let owner = self.owner[patch.index()];
        let n = self.triangles[(owner >> 1) as usize].normal;
        if owner & 1 == 0 { n } else { -n }
    }

    /// Centre of the cell.
    pub fn cell_centre(&self, patch: PatchId) -> DVec3 {
        let t = &self.triangles[self.triangle_of(patch) as usize];
        t.point(t.cells.centre(self.cell_of(patch)))
    }

    /// Corners of the whole cell, holes included: three to six points, counter-clockwise as seen from the patch's side.
    ///
    /// Triangles fanned from the first corner cover the cell once: see [`Cells::corners`].
    pub fn cell_corners(&self, patch: PatchId) -> Vec<DVec3> {
        let t = &self.triangles[self.triangle_of(patch) as usize];
        let mut corners: Vec<DVec3> = t.cells.corners(self.cell_of(patch)).into_iter().map(|c| t.point(c)).collect();
        if self.side_of(patch) == Side::Back {
            corners[1..].reverse();
        }
        corners
    }

    /// Barycentric weights of vertices 1 and 2 at the centre of the cell.
    pub fn cell_place(&self, patch: PatchId) -> [f64; 2] {
        let t = &self.triangles[self.triangle_of(patch) as usize];
        t.cells.centre(self.cell_of(patch))
    }

    /// Point of the cell at (`s`, `t`) in the unit square, uniform by area.
    #[inline]
    pub fn cell_point(&self, patch: PatchId, s: f64, t: f64) -> DVec3 {
        let triangle = &self.triangles[self.triangle_of(patch) as usize];
        triangle.point(triangle.cells.point(self.cell_of(patch), s, t))
    }

    /// A point of the patch that is there: like [`PatchScene::cell_point`], but holes are drawn again with `redraw`.
    #[inline]
    pub fn sample_point(&self, patch: PatchId, s: f64, t: f64, redraw: impl FnMut() -> f64) -> DVec3 {
        let place = self.sample_place(patch, s, t, redraw);
        self.triangles[self.triangle_of(patch) as usize].point(place)
    }

    /// Barycentric weights of vertices 1 and 2 at the point of [`PatchScene::sample_point`].
    #[inline]
    pub fn sample_place(&self, patch: PatchId, s: f64, t: f64, mut redraw: impl FnMut() -> f64) -> [f64; 2] {
        let index = self.triangle_of(patch);
        let triangle = &self.triangles[index as usize];
        let cell = self.cell_of(patch);
        let mut place = triangle.cells.point(cell, s, t);
        if !self.coverage.is_empty() {
            // 64 tries leave fewer than 2 % of the draws outside where a sixteenth of the cell is there. Of a blended
            // surface those are points of the cell like others, since nothing but a hash tells them apart.
            for _ in 0..64 {
                if self.is_present(index, place[0], place[1]) {
                    break;
                }
                place = triangle.cells.point(cell, redraw(), redraw());
            }
        }
        place
    }

    /// Area of the whole cell, m², holes included.
    #[inline]
    pub fn cell_area(&self, patch: PatchId) -> f64 {
        self.triangles[self.triangle_of(patch) as usize].cell_area
    }

    /// Barycentric weights of vertices 1 and 2 at (`s`, `t`) of the whole cell, holes included; uniform by area.
    #[inline]
    pub fn cell_place_at(&self, patch: PatchId, s: f64, t: f64) -> [f64; 2] {
        self.triangles[self.triangle_of(patch) as usize].cells.point(self.cell_of(patch), s, t)
    }

    /// Emitted radiance, mean over the patch.
    #[inline]
    pub fn emission(&self, patch: PatchId) -> Rgb {
        if self.emission.is_empty() { Rgb::BLACK } else { Rgb::from_f32(self.emission[patch.index()]) }
    }

    /// True if any patch emits.
    pub fn has_emitters(&self) -> bool {
        !self.emission.is_empty()
    }

    /// What a patch does with light by its mean base colour, as the solver sees it.
    #[inline]
    pub fn scatter(&self, patch: PatchId) -> Scatter {
        let color = Rgb::from_f32(self.base_color[patch.index()]);
        let triangle = self.triangle_of(patch);
        let t = &self.triangles[triangle as usize];
        let material = &self.materials[t.material as usize];
        // Most materials by far.
        if let (Surface::Lambertian { .. }, None) = (&material.surface, &material.transmission) {
            return Scatter { brdf: Brdf::Lambertian { reflectance: color }, specular: None };
        }
        let mut look = Appearance {
            color,
            metallic: f64::from(t.metallic),
            roughness: f64::from(t.roughness),
            transmission: f64::from(t.transmission),
            ..Appearance::of(material)
        };
        if let Some(&[specular, r, g, b]) = self.speculars.get(triangle as usize) {
            (look.specular, look.specular_color) = (f64::from(specular), Rgb::from_f32([r, g, b]));
        }
        self.scatter_of(triangle, &look, Detail::Patches)
    }

    /// The BRDF of a patch, as the solver sees it.
    #[inline]
    pub fn brdf(&self, patch: PatchId) -> Brdf {
        self.scatter(patch).brdf
    }

    /// What goes on sharply at a patch: mirrored or transmitted.
    #[inline]
    pub fn specular(&self, patch: PatchId) -> Option<Specular> {
        if self.passes { self.scatter(patch).specular } else { None }
    }

    /// True if the patch has what a single number does not tell of it: a lobe, or a base under a coat.
    #[inline]
    pub fn is_glossy(&self, patch: PatchId) -> bool {
        let t = &self.triangles[self.triangle_of(patch) as usize];
        !matches!(self.materials[t.material as usize].surface, Surface::Lambertian { .. })
    }

    /// True if a straight line of sight may pass some panes or bodies of glass.
    #[inline]
    pub fn has_clear_glass(&self) -> bool {
        self.panes
    }

    /// True if rays of the solver go on at some surfaces: mirrors, glass.
    #[inline]
    pub fn has_specular(&self) -> bool {
        self.passes
    }

    /// The material of a patch.
    pub fn material(&self, patch: PatchId) -> &Material {
        &self.materials[self.triangles[self.triangle_of(patch) as usize].material as usize]
    }

    /// Index of a patch's material among the authored ones.
    pub fn material_of(&self, patch: PatchId) -> usize {
        self.triangles[self.triangle_of(patch) as usize].material as usize
    }

    /// Number of sides of a triangle that have patches: 2 where it has two sides.
    pub fn sides_of(&self, triangle: u32) -> u32 {
        sides(&self.triangles[triangle as usize])
    }

    /// How a triangle is cut.
    pub fn cells_of(&self, triangle: u32) -> Cells {
        self.triangles[triangle as usize].cells
    }

    /// Index of a triangle's material.
    pub fn material_index(&self, triangle: u32) -> usize {
        self.triangles[triangle as usize].material as usize
    }

    /// All materials, in the order of the scene.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Pictures of all textures, in the order of the scene.
    pub fn images(&self) -> &[Arc<TextureImage>] {
        &self.images
    }

    /// Texture coordinates at a triangle's vertices, of set 0 or 1; `None` if its mesh has none.
    pub fn vertex_texcoords(&self, triangle: u32, set: u8) -> Option<[[f32; 2]; 3]> {
        match set {
            0 => self.attributes[triangle as usize].texcoords,
            _ => self.second_texcoords.get(triangle as usize).copied().flatten(),
        }
    }

    /// Triangle corners, in this scene's coordinates.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        [0, 1, 2].map(|i| self.triangles[triangle as usize].vertex(i))
    }

    /// Point of a triangle from barycentric weights.
    pub fn point_of(&self, triangle: u32, u: f64, v: f64) -> DVec3 {
        self.triangles[triangle as usize].point([u, v])
    }

    /// Bytes of the ray kernel and of the patches' constants.
    pub fn bytes(&self) -> [usize; 2] {
        let rare = size_of_val(self.second_texcoords.as_slice())
            + size_of_val(self.tangents.as_slice())
            + size_of_val(self.speculars.as_slice());
        let per_triangle = size_of::<Triangle>() + size_of::<Attributes>();
        let per_patch =
            4 + 12 + if self.emission.is_empty() { 0 } else { 12 } + if self.coverage.is_empty() { 0 } else { 4 };
        [self.kernel.bytes(), self.triangles.len() * per_triangle + rare + self.len() * per_patch]
    }
}

pub(crate) fn sides(t: &Triangle) -> u32 {
    1 + u32::from(t.two_sided)
}

pub(crate) fn vec(p: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// Normals transform by the inverse transpose; its sign under mirrors is settled by the winding.
fn normal_matrix(m: DMat3) -> DMat3 {
    let inverse = m.inverse().transpose();
    if inverse.is_finite() { inverse } else { m }
}

/// Centre of the bounding box of all placed vertices, and the largest distance from it.
pub(crate) fn bounds(scene: &Scene) -> Option<(DVec3, f64)> {
    let points = || {
        scene.instances.iter().flat_map(|i| {
            let mesh = &scene.meshes[i.mesh];
            mesh.triangles.iter().flatten().map(move |&k| i.transform.transform_point3(vec(mesh.positions[k as usize])))
        })
    };
    let (low, high) = points()
        .filter(|p| p.is_finite())
        .fold(None, |b: Option<(DVec3, DVec3)>, p| Some(b.map_or((p, p), |(l, h)| (l.min(p), h.max(p)))))?;
    let centre = 0.5 * (low + high);
    let radius = points().filter(|p| p.is_finite()).map(|p| p.distance(centre)).fold(0.0, f64::max);
    Some((centre, radius))
}

/// Whether any placed mesh has a second set of texture coordinates, and tangents, that its material asks for.
pub(crate) fn rare_attributes(scene: &Scene) -> [bool; 2] {
    let any = |wanted: &dyn Fn(&Mesh, &Material) -> bool| {
        scene.instances.iter().any(|i| {
            let mesh = &scene.meshes[i.mesh];
            wanted(mesh, &scene.materials[mesh.material])
        })
    };
    [
        any(&|mesh, m| mesh.second_texcoords.is_some() && m.textures().iter().any(|t| t.set == 1)),
        any(&|mesh, m| mesh.tangents.is_some() && m.normal_map.is_some()),
    ]
}

/// Where the triangles of a scene's [`PatchScene`] come from, in their order.
pub fn sources(scene: &Scene) -> Vec<TriangleSource> {
    let mut found = Vec::new();
    if let Some((centre, _)) = bounds(scene) {
        place(scene, centre, &mut |placed| found.push(placed.source));
    }
    found
}

/// Where a triangle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleSource {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into the triangles of its mesh.
    pub triangle: u32,
    /// Whether its last two corners are exchanged: those of the mesh run clockwise where it stands.
    pub mirrored: bool,
}

/// A triangle where it stands.
pub(crate) struct Placed<'a> {
    pub mesh: &'a Mesh,
    pub source: TriangleSource,
    /// Its vertices in the mesh, counter-clockwise from the front in the world.
    pub corner: [usize; 3],
    /// Its vertices relative to the scene's centre.
    pub vertices: [[f32; 3]; 3],
    /// Twice its area vector.
    pub across: DVec3,
    normal_matrix: DMat3,
    matrix: DMat3,
}

impl Placed<'_> {
    /// A tangent in the world. The cross product turns round under a mirror, so the sign of the bitangent does too.
    fn tangent(&self, [x, y, z, sign]: [f32; 4]) -> [f32; 4] {
        let [x, y, z] = (self.matrix * vec([x, y, z])).normalize_or_zero().as_vec3().to_array();
        [x, y, z, if self.matrix.determinant() < 0.0 { -sign } else { sign }]
    }

    pub fn corners(&self) -> [DVec3; 3] {
        self.vertices.map(vec)
    }
}

/// Calls `each` with every triangle that a ray can meet, in order; returns the number of those left out.
pub(crate) fn place(scene: &Scene, centre: DVec3, each: &mut dyn FnMut(Placed)) -> usize {
    let mut left_out = 0;
    for (number, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh];
        let place = instance.transform;
        // Mirrored instances keep their front side outside: the winding follows the determinant (glTF 2.0, 3.5.2).
        let mirrored = place.matrix3.determinant() < 0.0;
        let normal_matrix = normal_matrix(place.matrix3);
        let world: Vec<DVec3> = mesh.positions.iter().map(|p| place.transform_point3(vec(*p)) - centre).collect();
        for (triangle, corner) in mesh.triangles.iter().enumerate() {
            let order = if mirrored { [0, 2, 1] } else { [0, 1, 2] };
            let corner = order.map(|k| corner[k] as usize);
            let vertices = corner.map(|k| world[k].as_vec3().to_array());
            let [a, b, c] = vertices.map(vec);
            let across = area_vector_2(a, b, c);
            let in_range = vertices.iter().flatten().all(|x| x.abs() <= MAX_COORDINATE);
            if !(in_range && across.length() > 0.0) {
                left_out += 1;
                continue;
            }
            let source = TriangleSource { instance: number as u32, triangle: triangle as u32, mirrored };
            each(Placed { mesh, source, corner, vertices, across, normal_matrix, matrix: place.matrix3 });
        }
    }
    left_out
}

/// Chooses every triangle's cells and numbers the patches.
fn divide(triangles: &mut [Triangle], budget: PatchBudget) -> Result<(), PatchError> {
    let vertices = |t: &Triangle| [t.vertex(0), t.vertex(1), t.vertex(2)];
    let outlines: Vec<_> = triangles.par_iter().map(|t| (Outline::of(vertices(t)), sides(t))).collect();
    let (area, _) = cell_area(&outlines, budget)?;
    let mut next = 0;
    for t in triangles.iter_mut() {
        t.cells = Cells::of_area(vertices(t), area);
        t.cell_area /= f64::from(t.cells.count());
        t.first_patch = next;
        next += sides(t) * t.cells.count();
    }
    Ok(())
}

/// The area of a cell that keeps to `budget`, and the number of patches that it gives. Outlines come with the number
/// of their triangle's sides.
pub(crate) fn cell_area(outlines: &[(Outline, u32)], budget: PatchBudget) -> Result<(f64, u64), PatchError> {
    let count = |area: f64| -> u64 { outlines.par_iter().map(|(o, s)| u64::from(o.count(area)) * u64::from(*s)).sum() };
    let area = match budget {
        PatchBudget::Size(size) if size > 0.0 => size * size,
        PatchBudget::Size(size) => return Err(PatchError::Size(size)),
        PatchBudget::Count(wish) => {
            // The number of cells falls with their area: bisection on the logarithm of the area. Where there are more
            // triangles than the wish, large ones are still cut, to cells as large as the mean triangle.
            let wish = wish.max(1) as f64;
            let total: f64 = outlines.iter().map(|(o, s)| o.area() * f64::from(*s)).sum();
            let all_sides: f64 = outlines.iter().map(|(_, s)| f64::from(*s)).sum();
            let (mut small, mut large) = (total / wish * 1e-3, 2.0 * total / wish.max(all_sides));
            let mut best = (f64::INFINITY, large);
            for _ in 0..32 {
                let middle = (small * large).sqrt();
                let n = count(middle) as f64;
                if (n - wish).abs() < best.0 {
                    best = ((n - wish).abs(), middle);
                }
                if n > wish { small = middle } else { large = middle }
            }
            best.1
        }
    };
    let total = count(area);
    if total > i32::MAX as u64 {
        return Err(PatchError::TooMany(total as f64));
    }
    Ok((area, total))
}

#[cfg(test)]
mod tests;
