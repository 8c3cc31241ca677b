//! What an author wrote: meshes, instances, materials, textures, cameras, lights, surroundings.
//!
//! Plain public data, filled by the readers of `twinray-format` and by `builtin`. Nothing is computed here:
//! `validate` finds faults, `patch` turns a scene into world-space patches. The solver never sees these types.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::animation::CameraAnimation;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// A whole scene. Lengths in metres unless the file says otherwise; +Y is up, as in glTF.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for messages: the file's stem or the built-in name.
    pub name: String,
    /// Triangle meshes, each of one material; they appear only through `instances`.
    pub meshes: Vec<Mesh>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Materials, by index from `Mesh::material`.
    pub materials: Vec<Material>,
    /// Decoded images, by index from `TextureRef::image`.
    pub images: Vec<Arc<TextureImage>>,
    /// Cameras in file order; may be empty.
    pub cameras: Vec<Camera>,
    /// How cameras move, in file order; may be empty. Light knows nothing of it.
    pub animations: Vec<CameraAnimation>,
    /// Light that comes from infinitely far away; `None` is black.
    pub environment: Option<Environment>,
    /// Lights without area.
    pub lights: Vec<PunctualLight>,
    /// How many patches the scene's author suggests; the command's `--patches` overrides it.
    pub suggested_patches: Option<usize>,
}

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// Vertex positions `[vertices]`.
    pub positions: Vec<[f32; 3]>,
    /// Vertex normals `[vertices]`, used for smooth display only; light is computed with geometric normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Tangents `[vertices]` for normal maps: a direction along the surface, and the sign of the bitangent,
    /// normal × tangent × sign. Without them, normal maps follow the texture coordinates.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// First set of texture coordinates `[vertices]`.
    pub texcoords: Option<Vec<[f32; 2]>>,
    /// Second set of texture coordinates `[vertices]`.
    pub second_texcoords: Option<Vec<[f32; 2]>>,
    /// Vertex indices `[triangles][3]`, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `Scene::materials`.
    pub material: usize,
}

/// One placed mesh.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name for messages: the node's or object's.
    pub name: String,
    /// Index into `Scene::meshes`.
    pub mesh: usize,
    /// Mesh to world. A negative determinant mirrors; the front side follows the mirror, as in glTF.
    pub transform: DAffine3,
}

/// How a surface looks. Both sides share it; see `two_sided`.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Scattering.
    pub surface: Surface,
    /// Emitted radiance of the front side (W·sr⁻¹·m⁻², or nit), Lambertian.
    pub emission: Rgb,
    /// Multiplies `emission`.
    pub emission_texture: Option<TextureRef>,
    /// True: the back scatters light as the front does, with a state of its own. False: the back absorbs.
    /// Emission is on the front in either case.
    pub two_sided: bool,
    /// Where the surface is absent.
    pub opacity: Opacity,
    /// How light passes through, for glass and the like; `None` if it does not.
    pub transmission: Option<Transmission>,
    /// Bumps of the visible surface; light is computed with geometric normals.
    pub normal_map: Option<NormalMap>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            surface: Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.5)) },
            emission: Rgb::BLACK,
            emission_texture: None,
            two_sided: false,
            opacity: Opacity::Opaque,
            transmission: None,
            normal_map: None,
        }
    }
}

impl Material {
    /// True if both sides meet light: light that has entered a body also leaves it.
    pub fn has_two_sides(&self) -> bool {
        self.two_sided || self.transmission.is_some()
    }

    /// Every use of an image.
    pub fn textures(&self) -> Vec<&TextureRef> {
        let surface = match &self.surface {
            Surface::Lambertian { reflectance } => [&reflectance.texture, &None, &None, &None],
            Surface::MetallicRoughness {
                base_color,
                metallic_roughness_texture,
                specular_texture,
                specular_color_texture,
                ..
            } => [&base_color.texture, metallic_roughness_texture, specular_texture, specular_color_texture],
            Surface::Phong { diffuse, .. } => [&diffuse.texture, &None, &None, &None],
        };
        let passing = self.transmission.as_ref().and_then(|t| t.texture.as_ref());
        let bumps = self.normal_map.as_ref().map(|n| &n.texture);
        surface.into_iter().flatten().chain(&self.emission_texture).chain(passing).chain(bumps).collect()
    }
}

/// A colour that may vary over the surface: `factor` × texture.
#[derive(Clone, Debug)]
pub struct Texel {
    /// Linear factor.
    pub factor: Rgb,
    /// Factor of the texture's alpha channel, in [0, 1]; it counts where [`Opacity`] asks for alpha.
    pub alpha: f64,
    /// Texture of colours, sRGB-encoded, and alpha, multiplied by the factors.
    pub texture: Option<TextureRef>,
}

impl Texel {
    /// The same colour everywhere.
    pub fn constant(factor: Rgb) -> Self {
        Self { factor, alpha: 1.0, texture: None }
    }
}

/// Families of scattering.
#[derive(Clone, Debug)]
pub enum Surface {
    /// Perfectly diffuse.
    Lambertian {
        /// Reflectance in [0, 1).
        reflectance: Texel,
    },
    /// glTF 2.0 metallic-roughness (appendix B of its specification), GGX lobe over a Lambertian base.
    MetallicRoughness {
        /// Diffuse reflectance of the dielectric, F0 of the metal.
        base_color: Texel,
        /// Metalness factor in [0, 1].
        metallic: f64,
        /// Perceptual roughness factor in [0, 1]; α = roughness².
        roughness: f64,
        /// Linear texture: G multiplies roughness, B multiplies metalness.
        metallic_roughness_texture: Option<TextureRef>,
        /// `KHR_materials_specular` factor (1 without the extension; 0 is purely Lambertian).
        specular: f64,
        /// Linear texture whose alpha multiplies that factor.
        specular_texture: Option<TextureRef>,
        /// `KHR_materials_specular` colour factor.
        specular_color: Rgb,
        /// Texture of colours, sRGB-encoded, multiplied by that.
        specular_color_texture: Option<TextureRef>,
        /// Index of refraction (1.5 without `KHR_materials_ior`).
        ior: f64,
    },
    /// Normalised, reciprocal Phong lobe over a Lambertian base (Lafortune and Willems 1994).
    Phong {
        /// Diffuse reflectance.
        diffuse: Texel,
        /// Reflectance of the lobe at normal incidence.
        specular: Rgb,
        /// Phong exponent.
        exponent: f64,
    },
}

/// Light that passes a surface instead of reaching its diffuse base: `KHR_materials_transmission` and
/// `KHR_materials_volume`. The surface's lobe reflects what is left, and its roughness blurs what passes.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// The share of the base that transmits, in [0, 1]; what passes is multiplied by the base colour.
    pub factor: f64,
    /// Linear texture whose R multiplies the factor.
    pub texture: Option<TextureRef>,
    /// What the surface encloses; `None` for a thin pane, which does not refract.
    pub volume: Option<Volume>,
}

/// The inside of a closed body that light passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Attenuation coefficient, 1/m: what passes a length d is multiplied by exp(-d × this), per channel.
    pub attenuation: Rgb,
}

/// A tangent-space normal map, as glTF has it.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Linear texture of normals, 0 to 1 for -1 to 1.
    pub texture: TextureRef,
    /// Multiplies x and y.
    pub scale: f64,
}

/// Where a surface is absent, from the alpha channel of its base colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Opacity {
    /// Present everywhere; alpha is ignored.
    #[default]
    Opaque,
    /// Present where alpha ≥ the cutoff.
    Mask {
        /// Alpha threshold, 0.5 by default in glTF.
        cutoff: f32,
    },
    /// Present by chance, with alpha as the probability: what is behind shows through. Many rays see the mean.
    Blend,
}

/// A use of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into `Scene::images`.
    pub image: usize,
    /// What happens outside [0, 1], for u and v.
    pub wrap: [Wrap; 2],
    /// True: nearest texel; false: bilinear.
    pub nearest: bool,
    /// Which of the mesh's sets of texture coordinates: 0 or 1.
    pub set: u8,
    /// Where the picture lies on the surface.
    pub transform: TextureTransform,
}

impl TextureRef {
    /// The picture `image` as it is: tiled, bilinear, by the first set of texture coordinates.
    pub fn of(image: usize) -> Self {
        Self { image, wrap: [Wrap::Repeat; 2], nearest: false, set: 0, transform: TextureTransform::default() }
    }
}

/// Texture coordinates to those of the look-up, as `KHR_texture_transform` has it: scaled, turned, moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureTransform {
    /// Added last; in units of the picture's size.
    pub offset: [f64; 2],
    /// Turns the coordinates counter-clockwise as seen on the picture, whose v points down; radians.
    pub rotation: f64,
    /// Multiplies u and v, first.
    pub scale: [f64; 2],
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

impl TextureTransform {
    /// The coordinates of the look-up for those of the mesh.
    #[inline]
    pub fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [u, v] = self.turned([self.scale[0] * u, self.scale[1] * v]);
        [u + self.offset[0], v + self.offset[1]]
    }

    /// How far the look-up moves where the mesh's coordinates move by `step`.
    pub fn apply_to_step(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.turned([self.scale[0] * u, self.scale[1] * v])
    }

    fn turned(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        if self.rotation == 0.0 {
            return [u, v];
        }
        let (sin, cos) = libm::sincos(self.rotation);
        [cos * u + sin * v, cos * v - sin * u]
    }
}

/// Texture addressing outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Tile.
    #[default]
    Repeat,
    /// Tile, every second copy mirrored.
    Mirror,
    /// Repeat the border texel.
    Clamp,
}

/// An 8-bit RGBA image `[height, width, 4]`, first row on top (v = 0), not premultiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureImage {
    /// Name for messages.
    pub name: String,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width × height × 4` bytes.
    pub rgba: Vec<u8>,
}

/// Light from infinitely far away.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from every direction.
    Uniform(Rgb),
    /// A picture of all directions.
    Map(EnvironmentMap),
    /// The sky of a formula, with or without the sun.
    Sky(Sky),
}

/// A picture of all directions, as light.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// The picture.
    pub image: Arc<RadianceMap>,
    /// Turn about +Y, radians, counter-clockwise as seen from above. Without one, the picture's middle lies in +X, what is
    /// right of it towards +Z, its upper edge in +Y.
    pub rotation: f64,
    /// Factor to radiance.
    pub strength: f64,
}

/// Radiance in all directions, equirectangular: columns are even in azimuth, rows in the angle from the zenith.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMap {
    /// Name for messages.
    pub name: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `[height × width]`, first row at the zenith: linear Rec. 709, finite and at least 0.
    pub pixels: Vec<[f32; 3]>,
}

/// The sky of a formula above a horizon, and the ground below it. Radiance is luminance, in nit.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// How radiance is distributed.
    pub model: SkyModel,
    /// Unit, towards the sun; north is −Z, east +X. Must be above the horizon unless the model does without.
    pub towards_sun: DVec3,
    /// How bright it is.
    pub level: SkyLevel,
    /// Illuminance that the sun gives to what faces it, lx; `None` where clouds hide it.
    pub sun: Option<Rgb>,
    /// Albedo of the ground below the horizon, which sky and sun illuminate.
    pub ground: Rgb,
}

/// Distributions of radiance over the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyModel {
    /// The same everywhere.
    Uniform,
    /// CIE standard overcast sky.
    Overcast,
    /// CIE standard clear sky.
    Clear,
    /// Preetham, Shirley, Smits 1999, with colours.
    Preetham {
        /// Haze: 2 is very clear, 10 hazy.
        turbidity: f64,
    },
}

/// What scales a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyLevel {
    /// Luminance of the zenith, nit.
    Zenith(f64),
    /// Illuminance of unobstructed level ground by the sky without the sun, lx.
    Horizontal(f64),
}

/// A light without area.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// Name for messages and for the command line.
    pub name: String,
    /// Where it shines.
    pub kind: LightKind,
    /// Luminous intensity, cd (W·sr⁻¹); of directional lights illuminance across their direction, lx (W·m⁻²). A factor to
    /// the profile, if there is one.
    pub intensity: Rgb,
    /// Light to world. Light leaves along −Z; scale means nothing.
    pub transform: DAffine3,
    /// How intensity depends on the direction, instead of the kind, which must then be a point.
    pub profile: Option<Arc<LightProfile>>,
}

/// Kinds of lights without area, as `KHR_lights_punctual` has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Evenly in all directions.
    Point,
    /// Evenly within a cone, then falling off to a wider one.
    Spot {
        /// Half the angle of the cone that is fully lit, radians.
        inner: f64,
        /// Half the angle beyond which there is no light, radians; larger than the inner one and at most π/2.
        outer: f64,
    },
    /// From infinitely far away, the same everywhere.
    Directional,
}

/// Measured luminous intensity of a luminaire, type C photometry: γ from the nadir (−Z of the light), C around it, from +X
/// towards +Y.
#[derive(Clone, Debug, PartialEq)]
pub struct LightProfile {
    /// Name for messages.
    pub name: String,
    /// γ, degrees, ascending, within 0 to 180; no light beyond the first and the last.
    pub vertical: Vec<f32>,
    /// C, degrees, ascending: 0 alone if there is no dependence, else from 0 to 360.
    pub horizontal: Vec<f32>,
    /// `[horizontal][vertical]`, cd, at least 0.
    pub candela: Vec<f32>,
}
