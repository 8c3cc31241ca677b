//! Means of textures over patches, for the solver: colour, emission, the share that is there.
//!
//! Colours are those of patches, so that colour bleeding keeps its energy; what shapes a lobe is a triangle's, since the
//! solver packs it so. Called once, when a scene has been cut. Not here: single points (`surface`).

use rayon::prelude::*;

use crate::authored::{Material, Surface, TextureRef};
use crate::cells::Cells;
use crate::patch::{PatchScene, Side, sides};
use crate::rgb::Rgb;
use crate::surface::{Appearance, base_texel};

/// What one triangle's patches are like; lists of one entry hold for all of its cells.
pub(crate) struct TriangleMeans {
    color: Vec<[f32; 3]>,
    emission: Vec<[f32; 3]>,
    coverage: Vec<f32>,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    /// Factor and colour of the lobe's reflectance.
    specular: [f32; 4],
}

impl PatchScene {
    /// Fills the patches' means of textures: colour, emission, coverage; and the triangles' metalness and roughness.
    pub(crate) fn average_materials(&mut self) {
        let texels = self.images.iter().map(|i| f64::from(i.width) * f64::from(i.height)).fold(0.0, f64::max);
        let means: Vec<TriangleMeans> =
            (0..self.triangles.len() as u32).into_par_iter().map(|i| self.triangle_means(i, texels)).collect();
        let holes = self.holes;
        let emits = self.materials.iter().any(|m| !m.emission.is_black());
        if self.materials.iter().any(has_specular_textures) {
            self.speculars = means.iter().map(|m| m.specular).collect();
        }
        for (t, means) in self.triangles.iter_mut().zip(means) {
            (t.metallic, t.roughness, t.transmission) = (means.metallic, means.roughness, means.transmission);
            let count = t.cells.count() as usize;
            for side in 0..sides(t) {
                let cell = |values: &[[f32; 3]], k: usize| values[if values.len() == 1 { 0 } else { k }];
                self.base_color.extend((0..count).map(|k| cell(&means.color, k)));
                if emits {
                    let on = side == 0;
                    self.emission.extend((0..count).map(|k| if on { cell(&means.emission, k) } else { [0.0; 3] }));
                }
                if holes {
                    self.coverage
                        .extend((0..count).map(|k| means.coverage[if means.coverage.len() == 1 { 0 } else { k }]));
                }
            }
        }
        if self.emission.iter().all(|e| *e == [0.0; 3]) {
            self.emission = Vec::new();
        }
        self.passes = self.patches().any(|p| self.scatter(p).specular.is_some());
    }

    /// Means over a triangle's cells; `texels` are those of the largest picture.
    fn triangle_means(&self, triangle: u32, texels: f64) -> TriangleMeans {
        let t = &self.triangles[triangle as usize];
        let material = &self.materials[t.material as usize];
        let texel = base_texel(&material.surface);
        let usable = |t: &&TextureRef| self.texcoords(triangle, t).is_some();
        let look = self.mean_look(triangle, texels);
        let mut means = TriangleMeans {
            color: vec![texel.factor.to_f32()],
            emission: vec![material.emission.to_f32()],
            coverage: Vec::new(),
            metallic: look.metallic as f32,
            roughness: look.roughness as f32,
            transmission: look.transmission as f32,
            specular: specular_of(&look),
        };
        let textures: Vec<_> = texel.texture.iter().chain(&material.emission_texture).filter(usable).collect();
        if textures.is_empty() {
            means.coverage = vec![least_coverage(self.presence_at(triangle, 0.25, 0.25))];
            return means;
        }
        let count = t.cells.count();
        let n = self.samples_per_cell(triangle, &textures, count, texels);
        let (mut colors, mut emissions, mut coverages) = (Vec::new(), Vec::new(), Vec::new());
        for cell in 0..count {
            let (mut color, mut emission, mut present) = (Rgb::BLACK, Rgb::BLACK, 0.0);
            for k in 0..n {
                let [u, v] = spread_point(&t.cells, cell, k);
                // What is there reflects and emits: where less is there, its colour counts for less.
                let presence = self.presence_at(triangle, u, v);
                if presence > 0.0 {
                    present += presence;
                    color += self.color_at(triangle, u, v) * presence;
                    emission += self.emission_at(triangle, Side::Front, u, v) * presence;
                }
            }
            let there = if present > 0.0 { present } else { 1.0 };
            colors.push((color / there).to_f32());
            emissions.push((emission / there).to_f32());
            coverages.push(least_coverage(present / f64::from(n)));
        }
        (means.color, means.emission, means.coverage) = (colors, emissions, coverages);
        means
    }

    /// Mean over a triangle of what shapes its lobe and of what it transmits; not of its colour.
    fn mean_look(&self, triangle: u32, texels: f64) -> Appearance {
        let material = self.material_at(triangle);
        let mut look = Appearance::of(material);
        let mut textures: Vec<&TextureRef> = material.transmission.iter().filter_map(|t| t.texture.as_ref()).collect();
        if let Surface::MetallicRoughness {
            metallic_roughness_texture, specular_texture, specular_color_texture, ..
        } = &material.surface
        {
            textures
                .extend([metallic_roughness_texture, specular_texture, specular_color_texture].into_iter().flatten());
        }
        textures.retain(|t| self.texcoords(triangle, t).is_some());
        if textures.is_empty() {
            return look;
        }
        let n = self.samples_per_cell(triangle, &textures, 1, texels);
        let mut sum = Appearance { specular_color: Rgb::BLACK, ..look };
        [sum.metallic, sum.roughness, sum.specular, sum.transmission] = [0.0; 4];
        for k in 0..n {
            let [u, v] = spread_point(&Cells::Regular { m: 1 }, 0, k);
            let at = self.appearance_at(triangle, u, v, 0.0);
            sum.metallic += at.metallic;
            sum.roughness += at.roughness;
            sum.specular += at.specular;
            sum.specular_color += at.specular_color;
            sum.transmission += at.transmission;
        }
        let share = 1.0 / f64::from(n);
        look.metallic = sum.metallic * share;
        look.roughness = sum.roughness * share;
        look.specular = sum.specular * share;
        look.specular_color = sum.specular_color * share;
        look.transmission = sum.transmission * share;
        look
    }

    /// Sample points for a cell's mean of `textures`: about one per texel, between 4 and 64.
    fn samples_per_cell(&self, triangle: u32, textures: &[&TextureRef], cells: u32, texels: f64) -> u32 {
        let area = |texture: &&TextureRef| self.uv_area(triangle, texture).unwrap_or(0.0);
        let uv_area = textures.iter().map(area).fold(0.0, f64::max);
        ((uv_area * texels / f64::from(cells)).ceil() as u32).clamp(4, 64)
    }
}

/// True if the reflectance of the lobe varies with a texture of its own.
pub(crate) fn has_specular_textures(material: &Material) -> bool {
    let Surface::MetallicRoughness { specular_texture, specular_color_texture, .. } = &material.surface else {
        return false;
    };
    specular_texture.is_some() || specular_color_texture.is_some()
}

fn specular_of(look: &Appearance) -> [f32; 4] {
    let [r, g, b] = look.specular_color.to_f32();
    [look.specular as f32, r, g, b]
}

/// A ray can still meet what no sample met: the area must not be zero.
fn least_coverage(share: f64) -> f32 {
    if share > 0.0 { share as f32 } else { 1e-3 }
}

/// Point `k` of a cell's additive recurrence (Roberts's R2 sequence): even for any number of points, and on no
/// lattice line of the cell.
fn spread_point(cells: &Cells, cell: u32, k: u32) -> [f64; 2] {
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let [s, t] = STEP.map(|a| (0.5 + a * f64::from(k)).fract());
    cells.point(cell, s, t)
}
