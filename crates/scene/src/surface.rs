//! What a surface is like at a point: textures at full resolution, and whether there is any surface at all.
//!
//! Pictures take everything from here, so that no patch blurs a texture. Not here: means over patches (`means`),
//! filtering (`texture`, `mips`), the bent normal (`bumps`).

use glam::DVec3;

use crate::authored::{Material, Opacity, Scene, Surface, Texel, TextureRef};
use crate::brdf::{Brdf, Detail, Ggx, Passing, Phong, Scatter};
use crate::bvh::SurfaceHit;
use crate::patch::{PatchScene, Side};
use crate::rgb::Rgb;
use crate::sample::stream::{mix, to_unit};
use crate::texture::Encoding;

/// A point of a surface as a picture shows it.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Scattering with lobes as narrow as they are, and what is mirrored or passes.
    pub scatter: Scatter,
    /// Base colour, alpha left out.
    pub color: Rgb,
    /// Metalness; 0 for surfaces that are not of this kind.
    pub metallic: f64,
    /// Perceptual roughness; 1 for surfaces without such a lobe.
    pub roughness: f64,
    /// Share of the base that transmits, in [0, 1].
    pub transmission: f64,
    /// Emitted radiance on the side that was met.
    pub emission: Rgb,
    /// Unit normal for display, bumps included, on the side that was met.
    pub normal: DVec3,
}

/// What textures vary of a material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Appearance {
    pub color: Rgb,
    pub metallic: f64,
    pub roughness: f64,
    pub specular: f64,
    pub specular_color: Rgb,
    pub transmission: f64,
}

impl Appearance {
    /// The factors alone.
    pub fn of(material: &Material) -> Self {
        let color = base_texel(&material.surface).factor;
        let transmission = material.transmission.as_ref().map_or(0.0, |t| t.factor);
        let plain =
            Self { color, metallic: 0.0, roughness: 1.0, specular: 1.0, specular_color: Rgb::WHITE, transmission };
        match &material.surface {
            Surface::MetallicRoughness { metallic, roughness, specular, specular_color, .. } => Self {
                metallic: *metallic,
                roughness: *roughness,
                specular: *specular,
                specular_color: *specular_color,
                ..plain
            },
            _ => plain,
        }
    }
}

impl PatchScene {
    /// The surface at a hit, textures at full resolution.
    ///
    /// `footprint` is the length on the surface, metres, over which they are averaged; 0 takes the point itself, as
    /// is right where many rays make a pixel. Texels that it covers several of come from mip maps, which are made when
    /// first asked for.
    pub fn surface_at(&self, hit: &SurfaceHit, footprint: f64) -> SurfacePoint {
        let (triangle, u, v) = (hit.triangle, hit.u, hit.v);
        let look = self.appearance_at(triangle, u, v, footprint);
        SurfacePoint {
            scatter: self.scatter_of(triangle, &look, Detail::Picture),
            color: look.color,
            metallic: look.metallic,
            roughness: look.roughness,
            transmission: look.transmission,
            emission: self.filtered_emission(triangle, hit.side, u, v, footprint),
            normal: self.normal_at(hit, footprint),
        }
    }

    /// What a surface does with light at a point, textures at full resolution.
    pub fn scatter_at(&self, hit: &SurfaceHit, detail: Detail) -> Scatter {
        self.scatter_of(hit.triangle, &self.appearance_at(hit.triangle, hit.u, hit.v, 0.0), detail)
    }

    /// Base colour at a point of a triangle, textures at full resolution.
    pub fn color_at(&self, triangle: u32, u: f64, v: f64) -> Rgb {
        let texel = base_texel(&self.material_at(triangle).surface);
        texel.factor * self.texture_at(texel.texture.as_ref(), triangle, Encoding::Srgb, [u, v], 0.0).0
    }

    /// Emitted radiance at a point of a triangle's side, textures at full resolution.
    pub fn emission_at(&self, triangle: u32, side: Side, u: f64, v: f64) -> Rgb {
        self.filtered_emission(triangle, side, u, v, 0.0)
    }

    fn filtered_emission(&self, triangle: u32, side: Side, u: f64, v: f64, footprint: f64) -> Rgb {
        let material = self.material_at(triangle);
        if side == Side::Back || material.emission.is_black() {
            return Rgb::BLACK;
        }
        let texture = material.emission_texture.as_ref();
        material.emission * self.texture_at(texture, triangle, Encoding::Srgb, [u, v], footprint).0
    }

    /// Scattering by a triangle's material of the given looks.
    pub(crate) fn scatter_of(&self, triangle: u32, look: &Appearance, detail: Detail) -> Scatter {
        let material = self.material_at(triangle);
        let (brdf, ior) = match &material.surface {
            Surface::Lambertian { .. } => (Brdf::Lambertian { reflectance: look.color }, 1.5),
            Surface::MetallicRoughness { ior, .. } => {
                let Appearance { color, metallic, roughness, specular, specular_color, .. } = *look;
                (Brdf::Ggx(Ggx::new(color, metallic, roughness, specular, specular_color, *ior)), *ior)
            }
            Surface::Phong { specular, exponent, .. } => {
                (Brdf::Phong(Phong::new(look.color, *specular, *exponent)), 1.5)
            }
        };
        let passing = material.transmission.as_ref().map(|x| Passing {
            share: look.transmission * (1.0 - look.metallic),
            color: look.color,
            ior,
            volume: x.volume,
        });
        Scatter::new(brdf, passing, detail)
    }

    /// Factors times textures. Which channel means what is glTF's.
    pub(crate) fn appearance_at(&self, triangle: u32, u: f64, v: f64, footprint: f64) -> Appearance {
        let material = self.material_at(triangle);
        let mut look = Appearance::of(material);
        let at = |texture: &Option<TextureRef>, encoding| {
            self.texture_at(texture.as_ref(), triangle, encoding, [u, v], footprint)
        };
        look.color = look.color * at(&base_texel(&material.surface).texture, Encoding::Srgb).0;
        if let Surface::MetallicRoughness {
            metallic_roughness_texture, specular_texture, specular_color_texture, ..
        } = &material.surface
        {
            let metal = at(metallic_roughness_texture, Encoding::Linear).0;
            look.metallic *= metal.b;
            look.roughness *= metal.g;
            look.specular *= at(specular_texture, Encoding::Linear).1;
            look.specular_color = look.specular_color * at(specular_color_texture, Encoding::Srgb).0;
        }
        if let Some(transmission) = &material.transmission {
            look.transmission *= at(&transmission.texture, Encoding::Linear).0.r;
        }
        look
    }

    /// True unless the point lies in a hole of an alpha-masked material, or is one of those that a blended material
    /// lets light and sight through.
    ///
    /// Of a blended surface each point is there or not, by a hash of its place with alpha as the probability: one ray
    /// meets it or passes, always the same way at the same place, and many rays see the mean of both. So a blended
    /// surface is one with very fine holes, and areas, densities and deposits are those of what is there.
    #[inline]
    pub fn is_present(&self, triangle: u32, u: f64, v: f64) -> bool {
        match self.material_at(triangle).opacity {
            Opacity::Opaque => true,
            Opacity::Mask { cutoff } => self.alpha_at(triangle, u, v) >= f64::from(cutoff),
            Opacity::Blend => chance_at(triangle, u, v) < self.alpha_at(triangle, u, v),
        }
    }

    /// Share of the surface around a point that is there, in [0, 1].
    pub(crate) fn presence_at(&self, triangle: u32, u: f64, v: f64) -> f64 {
        match self.material_at(triangle).opacity {
            Opacity::Blend => self.alpha_at(triangle, u, v).clamp(0.0, 1.0),
            _ => f64::from(u8::from(self.is_present(triangle, u, v))),
        }
    }

    /// Alpha of the base colour at a point.
    fn alpha_at(&self, triangle: u32, u: f64, v: f64) -> f64 {
        let texel = base_texel(&self.material_at(triangle).surface);
        texel.alpha * self.texture_at(texel.texture.as_ref(), triangle, Encoding::Srgb, [u, v], 0.0).1
    }

    #[inline]
    pub(crate) fn material_at(&self, triangle: u32) -> &Material {
        &self.materials[self.triangles[triangle as usize].material as usize]
    }

    /// Colour and alpha of a texture at a point; white where there is none, or no coordinates for it.
    pub(crate) fn texture_at(
        &self,
        texture: Option<&TextureRef>,
        triangle: u32,
        encoding: Encoding,
        [u, v]: [f64; 2],
        footprint: f64,
    ) -> (Rgb, f64) {
        let Some((texture, t)) = texture.and_then(|t| Some((t, self.texcoords(triangle, t)?))) else {
            return (Rgb::WHITE, 1.0);
        };
        let at = |k: usize| f64::from(t[0][k]) * (1.0 - u - v) + f64::from(t[1][k]) * u + f64::from(t[2][k]) * v;
        let image = &self.images[texture.image];
        let level = self.level(triangle, texture, footprint);
        self.mips[texture.image].lookup(image, texture, encoding, [at(0), at(1)], level)
    }

    /// The mip level whose texels are as large as `footprint`.
    fn level(&self, triangle: u32, texture: &TextureRef, footprint: f64) -> f64 {
        if footprint <= 0.0 {
            return 0.0;
        }
        let (t, image) = (&self.triangles[triangle as usize], &self.images[texture.image]);
        let texels = f64::from(image.width) * f64::from(image.height);
        let shown = self.uv_area(triangle, texture).unwrap_or(0.0) * texels;
        let area = t.cell_area * f64::from(t.cells.count());
        libm::log2(footprint * (shown / area).sqrt())
    }

    /// The triangle's texture coordinates of the set that `texture` names, if it has them.
    pub(crate) fn texcoords(&self, triangle: u32, texture: &TextureRef) -> Option<[[f32; 2]; 3]> {
        let triangle = triangle as usize;
        if texture.set == 0 {
            return self.attributes[triangle].texcoords;
        }
        self.second_texcoords.get(triangle).copied().flatten()
    }

    /// How much of its picture, or of how many copies of it, `texture` shows on a triangle.
    pub(crate) fn uv_area(&self, triangle: u32, texture: &TextureRef) -> Option<f64> {
        let t = self.texcoords(triangle, texture)?;
        let d = |i: usize, k: usize| f64::from(t[i][k] - t[0][k]);
        let [a, b] = texture.transform.scale;
        Some(0.5 * (d(1, 0) * d(2, 1) - d(1, 1) * d(2, 0)).abs() * (a * b).abs())
    }
}

pub(crate) fn base_texel(surface: &Surface) -> &Texel {
    match surface {
        Surface::Lambertian { reflectance } => reflectance,
        Surface::MetallicRoughness { base_color, .. } => base_color,
        Surface::Phong { diffuse, .. } => diffuse,
    }
}

/// A number in [0, 1) that belongs to a point of a triangle.
fn chance_at(triangle: u32, u: f64, v: f64) -> f64 {
    let bits = mix(mix(u64::from(triangle).wrapping_add(PLACES) ^ mix(u.to_bits())) ^ v.to_bits());
    to_unit(mix(bits))
}

/// Keeps the hash of points apart from those of random streams.
const PLACES: u64 = 0x7477_696e_2061_6c70;

/// The materials, where masks and blending without a transparent texel are none: rays need not ask for them.
pub(crate) fn without_needless_alpha(scene: &Scene) -> Vec<Material> {
    let mut least: Vec<Option<f64>> = vec![None; scene.images.len()];
    let mut least_of = |texture: &TextureRef| {
        let alphas = || scene.images[texture.image].rgba.chunks_exact(4).map(|t| t[3]);
        *least[texture.image].get_or_insert_with(|| f64::from(alphas().min().unwrap_or(255)) / 255.0)
    };
    let mut materials = scene.materials.clone();
    for material in materials.iter_mut().filter(|m| m.opacity != Opacity::Opaque) {
        let texel = base_texel(&material.surface);
        let alpha = texel.alpha * texel.texture.as_ref().map_or(1.0, &mut least_of);
        let needed = if let Opacity::Mask { cutoff } = material.opacity { f64::from(cutoff) } else { 1.0 };
        if alpha >= needed {
            material.opacity = Opacity::Opaque;
        }
    }
    materials
}

#[cfg(test)]
pub(crate) mod tests;
