//! A place on a page for every point of every part.
//!
//! The author's second texture coordinates are kept where all parts together fit one page by them; where only each mesh
//! is sound in itself, its charts are kept and laid out anew; elsewhere `uvunwrap` cuts and flattens. Its layout is the
//! same on every machine.

use std::collections::HashMap;

use twinray_scene::{Mesh, PatchScene, Scene, Side};
use uvunwrap::{Density, MeshInput, Options, Packing};

use crate::overlap::{self, Fault};
use crate::parts::Part;
use crate::watch::Cancelled;

/// Up to so many charts are nested into each other's gaps, which takes a tenth less of a page, and a minute for 20 000 charts;
/// more are put in rows, in seconds. The first where one page is filled by trying, the other where the density is given.
const NEST: [u32; 2] = [5_000, 15_000];

/// How fine texels are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TexelDensity {
    /// As fine as one page allows.
    OnePage,
    /// So many texels for a metre, on as many pages as it takes.
    PerMetre(f64),
}

/// Settings of [`Atlas::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtlasOptions {
    /// How fine.
    pub density: TexelDensity,
    /// Largest side of a page, texels.
    pub page_size: u32,
    /// Texels around each chart that belong to no other: as far as filters look.
    pub padding: u32,
    /// Keep the author's second texture coordinates where they are sound.
    pub keep_authored: bool,
}

impl Default for AtlasOptions {
    fn default() -> Self {
        Self { density: TexelDensity::OnePage, page_size: 2048, padding: 2, keep_authored: true }
    }
}

/// Why there is no atlas.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum AtlasError {
    /// Nothing to bake.
    #[error("no surface reflects diffusely: there is nothing to bake")]
    Nothing,
    /// Not a density.
    #[error("a density of {0} texels per metre makes no sense: expected a positive number")]
    Density(f64),
    /// The unwrapper could not.
    #[error("the surfaces cannot be unwrapped: {0}")]
    Unwrap(String),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// How texture coordinates were found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// The author's, as they are.
    Authored,
    /// New ones; so many meshes kept the author's charts. The fault is what speaks against the author's own, if there are any.
    Unwrapped {
        /// Meshes whose charts are the author's.
        kept: usize,
        /// Why not all as they are.
        fault: Option<Fault>,
    },
}

/// A vertex with its place on a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaidVertex {
    /// Vertex of the mesh.
    pub source: u32,
    /// In [0, 1]², from the first texel of the first row.
    pub uv: [f32; 2],
}

/// A part on the pages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaidPart {
    /// Vertices; those on rims of charts more than once.
    pub vertices: Vec<LaidVertex>,
    /// Triangles, in the order of the part's faces and with their corners' order.
    pub triangles: Vec<[u32; 3]>,
    /// Page of each triangle.
    pub pages: Vec<u32>,
}

/// Where everything is.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Width and height of each page, texels.
    pub pages: Vec<[u32; 2]>,
    /// One for each part.
    pub parts: Vec<LaidPart>,
    /// Texels for a metre, typical.
    pub texels_per_metre: f64,
    /// Number of charts; `None` where they are the author's.
    pub charts: Option<u32>,
    /// Share of the texels that charts cover.
    pub utilization: f64,
    /// Whence the texture coordinates.
    pub layout: Layout,
    /// A piece of a page for faces without light: its page and texels, low and high.
    pub dark: Option<(u32, [[f32; 2]; 2])>,
}

impl Atlas {
    /// Lays out the parts of a scene.
    ///
    /// # Errors
    /// If there is no part, a density is no number, or the unwrapper gives up.
    pub fn new(
        scene: &Scene,
        patches: &PatchScene,
        parts: &[Part],
        options: &AtlasOptions,
    ) -> Result<Self, AtlasError> {
        if parts.is_empty() {
            return Err(AtlasError::Nothing);
        }
        if let TexelDensity::PerMetre(d) = options.density
            && !(d > 0.0 && d.is_finite())
        {
            return Err(AtlasError::Density(d));
        }
        let mesh_of = |part: &Part| &scene.meshes[scene.instances[part.instance].mesh];
        let area = |triangle: u32| area(patches, triangle);
        let any_authored = parts.iter().any(|p| mesh_of(p).second_texcoords.is_some());
        let mut fault = None;
        if options.keep_authored && any_authored {
            let size = options.page_size;
            fault = overlap::judge(parts.iter().map(|p| (p, mesh_of(p))), area, size);
            if fault.is_none() {
                return Ok(authored(parts, mesh_of, area, size));
            }
        }
        // A mesh that is sound in itself keeps its charts; the same for all of its instances.
        let mut sound: HashMap<usize, bool> = HashMap::new();
        let keeps: Vec<bool> = parts
            .iter()
            .map(|part| {
                let judged = || {
                    options.keep_authored
                        && overlap::judge(std::iter::once((part, mesh_of(part))), area, options.page_size / 2).is_none()
                };
                *sound.entry(scene.instances[part.instance].mesh).or_insert_with(judged)
            })
            .collect();
        let kept = keeps.iter().filter(|&&k| k).count();
        unwrap(scene, patches, parts, &keeps, options, Layout::Unwrapped { kept, fault })
    }
}

pub(crate) fn area(patches: &PatchScene, triangle: u32) -> f64 {
    let [a, b, c] = patches.corners(triangle);
    0.5 * (b - a).cross(c - a).length()
}

/// The author's own coordinates.
fn authored<'a>(parts: &[Part], mesh_of: impl Fn(&Part) -> &'a Mesh, area: impl Fn(u32) -> f64, size: u32) -> Atlas {
    let (mut on_page, mut surface) = (0.0, 0.0);
    let laid = parts
        .iter()
        .map(|part| {
            let mesh = mesh_of(part);
            let mut laid = LaidPart::default();
            let mut number = HashMap::new();
            for face in &part.faces {
                let uv = overlap::authored(mesh, face.corners).unwrap_or_default();
                let triangle = [0, 1, 2].map(|k| {
                    *number.entry(face.corners[k]).or_insert_with(|| {
                        laid.vertices.push(LaidVertex { source: face.corners[k], uv: uv[k] });
                        laid.vertices.len() as u32 - 1
                    })
                });
                laid.triangles.push(triangle);
                laid.pages.push(0);
                let [a, b, c] = uv.map(|p| p.map(f64::from));
                on_page += 0.5 * crate::clip::cross(a, b, c).abs();
                surface += area(face.triangle);
            }
            laid
        })
        .collect();
    Atlas {
        pages: vec![[size; 2]],
        parts: laid,
        texels_per_metre: (on_page / surface).sqrt() * f64::from(size),
        charts: None,
        utilization: on_page,
        layout: Layout::Authored,
        dark: None,
    }
}

/// What the unwrapper is given of a part.
struct Input {
    positions: Vec<[f32; 3]>,
    /// Vertex of the mesh of each position.
    sources: Vec<u32>,
    indices: Vec<u32>,
    dark: Vec<bool>,
    uvs: Option<Vec<[f32; 2]>>,
}

impl Input {
    fn new(scene: &Scene, patches: &PatchScene, part: &Part, keep: bool) -> Self {
        let instance = &scene.instances[part.instance];
        let mesh = &scene.meshes[instance.mesh];
        let mut number = HashMap::new();
        let (mut positions, mut sources) = (Vec::new(), Vec::new());
        let mut indices = Vec::with_capacity(3 * part.faces.len());
        for face in &part.faces {
            let mut corners = patches.corners(face.triangle);
            if part.side == Side::Back {
                corners.swap(1, 2);
            }
            for (k, &vertex) in face.corners.iter().enumerate() {
                indices.push(*number.entry(vertex).or_insert_with(|| {
                    positions.push(corners[k].as_vec3().to_array());
                    sources.push(vertex);
                    sources.len() as u32 - 1
                }));
            }
        }
        let uvs = mesh.second_texcoords.as_ref().filter(|_| keep);
        let uvs = uvs.map(|t| sources.iter().map(|&s| t[s as usize]).collect());
        Self { positions, sources, indices, dark: part.faces.iter().map(|f| f.dark).collect(), uvs }
    }
}

fn unwrap(
    scene: &Scene,
    patches: &PatchScene,
    parts: &[Part],
    keeps: &[bool],
    options: &AtlasOptions,
    layout: Layout,
) -> Result<Atlas, AtlasError> {
    let inputs: Vec<Input> = parts.iter().zip(keeps).map(|(p, &keep)| Input::new(scene, patches, p, keep)).collect();
    let surface: f64 = parts.iter().flat_map(|p| &p.faces).filter(|f| !f.dark).map(|f| area(patches, f.triangle)).sum();
    let mut meshes: Vec<MeshInput<'_>> = inputs
        .iter()
        .map(|i| MeshInput {
            ignored_faces: Some(&i.dark),
            existing_uvs: i.uvs.as_deref(),
            ..MeshInput::new(&i.positions, &i.indices)
        })
        .collect();
    // One small chart for all faces in the dark.
    let any_dark = parts.iter().flat_map(|p| &p.faces).any(|f| f.dark);
    let texel = match options.density {
        TexelDensity::PerMetre(d) => 1.0 / d,
        TexelDensity::OnePage => 1.5 * surface.sqrt() / f64::from(options.page_size),
    };
    let side = (3.0 * texel) as f32;
    let dark_corner = [[0.0, 0.0, 0.0], [side, 0.0, 0.0], [side, side, 0.0], [0.0, side, 0.0]];
    if any_dark {
        meshes.push(MeshInput::new(&dark_corner, &[0, 1, 2, 0, 2, 3]));
    }
    let page_size = options.page_size;
    let base =
        Options { padding: options.padding, max_chart_size: page_size - 2 * options.padding, ..Options::default() };
    let fixed = |page_size| match options.density {
        TexelDensity::OnePage => Density::Auto { page_size: options.page_size },
        TexelDensity::PerMetre(d) => Density::Fixed { texels_per_unit: d as f32, page_size },
    };
    let lay = |density, packing| {
        let found = uvunwrap::generate(&meshes, &Options { density, packing, ..base });
        found.map_err(|e| AtlasError::Unwrap(e.to_string()))
    };
    let most = NEST[usize::from(options.density != TexelDensity::OnePage)];
    let generate = |density| {
        let found = lay(density, Packing::Fast)?;
        if found.chart_count > most { Ok(found) } else { lay(density, Packing::Shape) }
    };
    // One page as small as it can be, if what there is fits one.
    let fits = |d: f64| surface * d * d < 0.75 * f64::from(page_size).powi(2);
    let mut found = match options.density {
        TexelDensity::PerMetre(d) if !fits(d) => generate(fixed(Some(page_size)))?,
        _ => generate(fixed(None))?,
    };
    if found.width.max(found.height) > page_size {
        found = generate(fixed(Some(page_size)))?;
    }

    let mut laid: Vec<LaidPart> = Vec::with_capacity(parts.len());
    let dark = any_dark.then(|| dark_place(&found));
    for ((part, input), mesh) in parts.iter().zip(&inputs).zip(&found.meshes) {
        let vertex = |v: &uvunwrap::OutputVertex| LaidVertex { source: input.sources[v.xref as usize], uv: v.uv };
        let mut out = LaidPart { vertices: mesh.vertices.iter().map(vertex).collect(), ..LaidPart::default() };
        for (face, corners) in part.faces.iter().zip(mesh.indices.as_chunks::<3>().0) {
            let page = corners.iter().find_map(|&k| mesh.vertices[k as usize].page);
            let (Some(page), false) = (page, face.dark) else {
                let (page, [low, high]) = dark.unwrap_or((0, [[0.0; 2]; 2]));
                let uv = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
                let first = out.vertices.len() as u32;
                out.vertices.extend(face.corners.map(|source| LaidVertex { source, uv }));
                out.triangles.push([first, first + 1, first + 2]);
                out.pages.push(page);
                continue;
            };
            out.triangles.push(*corners);
            out.pages.push(page);
        }
        drop_unused(&mut out);
        laid.push(out);
    }
    Ok(Atlas {
        pages: vec![[found.width, found.height]; found.page_count as usize],
        parts: laid,
        texels_per_metre: f64::from(found.texels_per_unit),
        charts: Some(found.chart_count - u32::from(any_dark)),
        utilization: f64::from(found.utilization),
        layout,
        dark,
    })
}

/// The chart of the dark: its page and corners.
fn dark_place(found: &uvunwrap::Atlas) -> (u32, [[f32; 2]; 2]) {
    let vertices = found.meshes.last().map_or(&[][..], |m| &m.vertices);
    let bound =
        |pick: fn(f32, f32) -> f32| [0, 1].map(|axis| vertices.iter().map(|v| v.uv[axis]).reduce(pick).unwrap_or(0.0));
    (vertices.iter().find_map(|v| v.page).unwrap_or(0), [bound(f32::min), bound(f32::max)])
}

/// Vertices in the order of their first use; those without any left out.
fn drop_unused(part: &mut LaidPart) {
    let mut number = vec![u32::MAX; part.vertices.len()];
    let mut used = Vec::new();
    for corner in part.triangles.iter_mut().flatten() {
        let slot = &mut number[*corner as usize];
        if *slot == u32::MAX {
            *slot = used.len() as u32;
            used.push(part.vertices[*corner as usize]);
        }
        *corner = *slot;
    }
    part.vertices = used;
}
