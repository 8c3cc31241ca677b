//! glTF materials to ours. No fault here ends the reading: each is a warning with what was used instead.
//!
//! Emission is that of the front side, `emissiveFactor` × `KHR_materials_emissive_strength` × texture, also where
//! the material is double-sided: a lamp that also shone backwards would give twice the light its author set.
//! Not here: what a slot for a texture says (`slot`), pixels (`texture`), the limit of reflectance (`reflectance`).

use std::collections::{BTreeMap, HashMap};

use twinray_scene::{Material, NormalMap, Opacity, Rgb, Surface, Texel, TextureRef, Transmission, Volume};

use super::container::Buffers;
use super::json::Element;
use crate::context::Context;
use crate::error::FormatError;
use crate::reflectance::Clamp;
use crate::texture::Pictures;
use crate::warning::name_list;

/// Extensions of materials that change how they look and are not read; each gets one warning with the materials.
pub(super) const IGNORED: [&str; 8] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_unlit",
    "KHR_materials_volume_scatter",
];

/// What passes a length of the attenuation distance at least: a channel of 0 would have no coefficient.
const DARKEST: f64 = 1e-6;

/// The largest coefficient of attenuation, 1/m: light ends within a nanometre.
const DENSEST: f64 = 1e10;

/// Reads materials when they are first used.
#[derive(Default)]
pub(super) struct Materials {
    list: Vec<Material>,
    /// By index in the file; `None` is glTF's default material.
    known: HashMap<Option<usize>, usize>,
    pub(super) pictures: Pictures,
    /// Picture of each image of the file, `None` if it cannot be used.
    pub(super) images: HashMap<usize, Option<usize>>,
    clamp: Clamp,
    occluded: Vec<String>,
    converted: Vec<String>,
    ignored: BTreeMap<&'static str, Vec<String>>,
}

impl Materials {
    /// Our index of the material that `primitive` names.
    pub(super) fn of(
        &mut self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        buffers: &Buffers<'_>,
        primitive: &Element<'_>,
    ) -> Result<usize, FormatError> {
        let link = primitive.follow("material", root, "materials")?;
        let key = link.as_ref().map(|(index, _)| *index);
        if let Some(&index) = self.known.get(&key) {
            return Ok(index);
        }
        let name = match &link {
            Some((i, element)) => element.name_or(|| format!("material {i}")),
            None => "glTF default".to_owned(),
        };
        let mut reader = Reader { context, root, buffers, materials: self };
        let element = link.map(|(_, element)| element);
        let material = reader.material(element.as_ref(), name);
        self.list.push(material);
        self.known.insert(key, self.list.len() - 1);
        Ok(self.list.len() - 1)
    }

    /// Materials and pictures, after the warnings that concern many of them.
    pub(super) fn finish(self, context: &mut Context<'_>) -> (Vec<Material>, Pictures) {
        self.clamp.report(context);
        let mut report = |names: &[String], message: &str| {
            if !names.is_empty() {
                context.sum_up("materials", format!("{message}: {}", name_list(names)));
            }
        };
        report(&self.occluded, "occlusion maps are ignored, since light finds the corners itself");
        report(&self.converted, "KHR_materials_pbrSpecularGlossiness is read as the lobe of the same reflectance");
        for (extension, names) in &self.ignored {
            report(names, &format!("{extension} is ignored"));
        }
        (self.list, self.pictures)
    }
}

/// One material at work.
pub(super) struct Reader<'r, 'c> {
    pub(super) context: &'r mut Context<'c>,
    pub(super) root: &'r Element<'r>,
    pub(super) buffers: &'r Buffers<'r>,
    pub(super) materials: &'r mut Materials,
}

impl Reader<'_, '_> {
    fn material(&mut self, element: Option<&Element<'_>>, name: String) -> Material {
        let empty = serde_json::Value::Null;
        let nothing = Element::root(self.context.file, &empty);
        let element = element.unwrap_or(&nothing);
        let transmission = self.transmission(element);
        let surface = match element.extension("KHR_materials_pbrSpecularGlossiness") {
            Some(extension) => self.specular_glossiness(&extension, &name),
            None => {
                let pbr = element.get("pbrMetallicRoughness").unwrap_or_else(|| nothing.clone());
                self.metallic_roughness(element, &pbr, &name, transmission.as_ref())
            }
        };

        let strength = element.extension("KHR_materials_emissive_strength");
        let strength = strength.map_or(1.0, |e| self.number(&e, "emissiveStrength", 1.0, 0.0..=f64::MAX));
        let emissive = self.colour(element, "emissiveFactor", [0.0; 3], f64::MAX);
        let emission = self.emission(element, Rgb::from_array(emissive) * strength);
        // The texture of a black emitter would be decoded for nothing.
        let emission_texture = if emission.is_black() { None } else { self.texture(element.get("emissiveTexture")) };
        let normal_map = self.normal_map(element);
        self.note_ignored(element, &name);
        let opacity = self.opacity(element);
        let two_sided = element.flag("doubleSided");
        Material { name, surface, emission, emission_texture, two_sided, opacity, transmission, normal_map }
    }

    fn metallic_roughness(
        &mut self,
        element: &Element<'_>,
        pbr: &Element<'_>,
        name: &str,
        transmission: Option<&Transmission>,
    ) -> Surface {
        let metallic = self.number(pbr, "metallicFactor", 1.0, 0.0..=1.0);
        let clear = transmission.is_some_and(|t| t.factor == 1.0 && t.texture.is_none());
        // A base that transmits everything reflects nothing, and clear glass is no grey one.
        let most = if clear && metallic == 0.0 { 1.0 } else { self.context.limits.max_reflectance };
        let base_color = self.base_color(pbr, ["baseColorFactor", "baseColorTexture"], most, name);
        let roughness = self.number(pbr, "roughnessFactor", 1.0, 0.0..=1.0);
        let extension = element.extension("KHR_materials_specular");
        let (specular, specular_color) = match &extension {
            Some(e) => {
                let color = self.colour(e, "specularColorFactor", [1.0; 3], f64::MAX);
                (self.number(e, "specularFactor", 1.0, 0.0..=1.0), Rgb::from_array(color))
            }
            None => (1.0, Rgb::WHITE),
        };
        if let Some(phong) = self.phong(element, &base_color, roughness, specular_color) {
            return phong;
        }
        // Where light passes, roughness means something without a lobe, too.
        if specular == 0.0 && metallic == 0.0 && (transmission.is_none() || roughness == 0.0) {
            return Surface::Lambertian { reflectance: base_color };
        }
        Surface::MetallicRoughness {
            base_color,
            metallic,
            roughness,
            metallic_roughness_texture: self.texture(pbr.get("metallicRoughnessTexture")),
            specular,
            specular_texture: self.texture(extension.as_ref().and_then(|e| e.get("specularTexture"))),
            specular_color,
            specular_color_texture: self.texture(extension.as_ref().and_then(|e| e.get("specularColorTexture"))),
            ior: self.ior(element),
        }
    }

    /// Factor and texture of a base colour, below the limit of reflectance.
    fn base_color(&mut self, owner: &Element<'_>, [factor, texture]: [&str; 2], limit: f64, name: &str) -> Texel {
        let color = self.colour(owner, factor, [1.0; 4], 1.0);
        let mut texel = Texel {
            factor: Rgb::new(color[0], color[1], color[2]),
            alpha: color[3],
            texture: self.texture(owner.get(texture)),
        };
        self.materials.clamp.apply(&mut texel, &self.materials.pictures, limit, name);
        texel
    }

    /// The older way to say what reflects: colour of the base, colour of the lobe, glossiness (1 − roughness). An index
    /// of refraction of 0 makes the lobe's colour its reflectance at normal incidence, and the base gets what is left,
    /// as that extension has it.
    fn specular_glossiness(&mut self, extension: &Element<'_>, name: &str) -> Surface {
        self.materials.converted.push(name.to_owned());
        let limit = self.context.limits.max_reflectance;
        let base_color = self.base_color(extension, ["diffuseFactor", "diffuseTexture"], limit, name);
        let specular = Rgb::from_array(self.colour(extension, "specularFactor", [1.0; 3], 1.0));
        let glossiness = self.number(extension, "glossinessFactor", 1.0, 0.0..=1.0);
        let texture = self.texture(extension.get("specularGlossinessTexture"));
        let mut lobe = Texel { texture, ..Texel::constant(specular) };
        self.materials.clamp.apply(&mut lobe, &self.materials.pictures, limit, name);
        // Glossiness is in the alpha channel; roughness has to be in a green one.
        let rough = |[_, _, _, alpha]: [u8; 4]| {
            let roughness = 255.0 - glossiness * f64::from(alpha);
            [0, roughness.round() as u8, 0, 255]
        };
        let (pictures, limits) = (&mut self.materials.pictures, self.context.limits);
        let derived = lobe.texture.as_ref().and_then(|t| {
            let image = pictures.derive(t.image, "roughness of ", limits, rough)?;
            Some(TextureRef { image, ..t.clone() })
        });
        Surface::MetallicRoughness {
            base_color,
            metallic: 0.0,
            roughness: if derived.is_some() { 1.0 } else { 1.0 - glossiness },
            metallic_roughness_texture: derived,
            specular: 1.0,
            specular_texture: None,
            specular_color: lobe.factor,
            specular_color_texture: lobe.texture,
            ior: 0.0,
        }
    }

    /// What `write_glb` notes of a Phong lobe, as long as the lobe that stands beside it is still the one it wrote.
    fn phong(&self, element: &Element<'_>, diffuse: &Texel, roughness: f64, color: Rgb) -> Option<Surface> {
        let noted = element.get("extras")?.get("twinray_phong")?;
        let specular = Rgb::from_array(noted.numbers("specular").ok()??);
        let exponent = noted.number("exponent").ok()??;
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + b.abs());
        let [wanted_roughness, wanted_color] = [super::write::phong_roughness(exponent), 1.0 / super::write::PHONG_F0];
        let same = close(roughness, wanted_roughness) && (0..3).all(|c| close(color[c], specular[c] * wanted_color));
        let room = specular.min_channel() >= 0.0 && (diffuse.factor + specular).max_channel() <= 1.0;
        (same && room && exponent >= 0.0).then(|| Surface::Phong { diffuse: diffuse.clone(), specular, exponent })
    }

    /// `emission` within the limits; a factor times a strength may also be no number at all.
    fn emission(&mut self, element: &Element<'_>, emission: Rgb) -> Rgb {
        let most = self.context.limits.max_radiance;
        let kept = emission.map(|c| if c <= most { c } else { most });
        if kept != emission {
            self.context.warn(&element.path, format!("emission {:?} is brought down to {most:e}", emission.to_array()));
        }
        kept
    }

    fn ior(&mut self, element: &Element<'_>) -> f64 {
        let Some(extension) = element.extension("KHR_materials_ior") else { return 1.5 };
        let ior = self.number(&extension, "ior", 1.5, 0.0..=f64::MAX);
        // 0 is glTF's way to say "reflects everything at grazing and at normal incidence".
        if ior >= 1.0 || ior == 0.0 {
            return ior;
        }
        self.context.warn(&extension.path, format!("ior {ior} is below 1; 1.5 is used"));
        1.5
    }

    fn opacity(&mut self, element: &Element<'_>) -> Opacity {
        match element.text("alphaMode") {
            Ok(None | Some("OPAQUE")) => Opacity::Opaque,
            Ok(Some("MASK")) => {
                Opacity::Mask { cutoff: self.number(element, "alphaCutoff", 0.5, 0.0..=f64::MAX) as f32 }
            }
            Ok(Some("BLEND")) => Opacity::Blend,
            Ok(Some(_)) | Err(_) => {
                self.context.warn(&element.path, "alphaMode is none of OPAQUE, MASK and BLEND; read as OPAQUE");
                Opacity::Opaque
            }
        }
    }

    fn transmission(&mut self, element: &Element<'_>) -> Option<Transmission> {
        let extension = element.extension("KHR_materials_transmission")?;
        let factor = self.number(&extension, "transmissionFactor", 0.0, 0.0..=1.0);
        if factor == 0.0 {
            return None;
        }
        let texture = self.texture(extension.get("transmissionTexture"));
        Some(Transmission { factor, texture, volume: self.volume(element) })
    }

    /// What the surface encloses. The thickness itself is for those who do not trace rays: only whether it is 0 counts.
    fn volume(&mut self, element: &Element<'_>) -> Option<Volume> {
        let extension = element.extension("KHR_materials_volume")?;
        if self.number(&extension, "thicknessFactor", 0.0, 0.0..=f64::MAX) == 0.0 {
            return None;
        }
        let color = self.colour(&extension, "attenuationColor", [1.0; 3], 1.0);
        let distance = self.number(&extension, "attenuationDistance", f64::INFINITY, 0.0..=f64::INFINITY);
        if distance == 0.0 {
            self.context.warn(format!("{}.attenuationDistance", extension.path), "0 is no distance; ignored");
            return Some(Volume { attenuation: Rgb::BLACK });
        }
        let coefficient = |c: f64| (-c.max(DARKEST).ln() / distance).clamp(0.0, DENSEST);
        Some(Volume { attenuation: Rgb::from_array(color.map(coefficient)) })
    }

    fn normal_map(&mut self, element: &Element<'_>) -> Option<NormalMap> {
        let slot = element.get("normalTexture")?;
        let scale = self.number(&slot, "scale", 1.0, f64::MIN..=f64::MAX);
        let texture = self.texture(Some(slot))?;
        Some(NormalMap { texture, scale })
    }

    fn note_ignored(&mut self, element: &Element<'_>, name: &str) {
        if element.get("occlusionTexture").is_some() {
            self.materials.occluded.push(name.to_owned());
        }
        for extension in IGNORED.into_iter().filter(|e| element.extension(e).is_some()) {
            self.materials.ignored.entry(extension).or_default().push(name.to_owned());
        }
    }

    /// The number `key`, brought into `range`; `default` where it is absent or no number.
    fn number(&mut self, e: &Element<'_>, key: &str, default: f64, range: std::ops::RangeInclusive<f64>) -> f64 {
        let value = match e.number(key) {
            Ok(value) => value.unwrap_or(default),
            Err(error) => return self.replaced(&format!("{}.{key}", e.path), &error, default),
        };
        let kept = value.clamp(*range.start(), *range.end());
        if kept != value {
            self.context.warn(format!("{}.{key}", e.path), format!("{value} is out of range; {kept} is used"));
        }
        kept
    }

    /// The colour `key`, each channel brought into [0, `highest`]; `default` where it is absent or no colour.
    fn colour<const N: usize>(&mut self, e: &Element<'_>, key: &str, default: [f64; N], highest: f64) -> [f64; N] {
        let value = match e.numbers(key) {
            Ok(value) => value.unwrap_or(default),
            Err(error) => return self.replaced(&format!("{}.{key}", e.path), &error, default),
        };
        let kept = value.map(|v: f64| v.clamp(0.0, highest));
        if kept != value {
            self.context.warn(format!("{}.{key}", e.path), format!("{value:?} is out of range; {kept:?} is used"));
        }
        kept
    }

    fn replaced<T: std::fmt::Debug>(&mut self, element: &str, error: &FormatError, default: T) -> T {
        self.context.warn(element, format!("{}; {default:?} is used", error.without_place()));
        default
    }
}
