//! glTF materials and textures to ours. No fault here ends the reading: each is a warning with what was used
//! instead.
//!
//! Emission is that of the front side, `emissiveFactor` × `KHR_materials_emissive_strength` × texture, also where
//! the material is double-sided: a lamp that also shone backwards would give twice the light its author set.
//! Not here: pixels (`texture`), the limit of reflectance (`reflectance`).

use std::collections::HashMap;

use twinray_scene::{Material, Opacity, Rgb, Surface, Texel, TextureRef, Transmission, Wrap};

use super::container::Buffers;
use super::json::Element;
use crate::context::Context;
use crate::error::FormatError;
use crate::reference::{data_uri, percent_decode};
use crate::reflectance::Clamp;
use crate::texture::Pictures;
use crate::warning::name_list;

/// Reads materials when they are first used.
#[derive(Default)]
pub(super) struct Materials {
    list: Vec<Material>,
    /// By index in the file; `None` is glTF's default material.
    known: HashMap<Option<usize>, usize>,
    pictures: Pictures,
    /// Picture of each image of the file, `None` if it cannot be used.
    images: HashMap<usize, Option<usize>>,
    clamp: Clamp,
    transmissive: Vec<String>,
    unread_maps: Vec<String>,
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
        report(&self.transmissive, "transmission lets light straight through, without refraction or tint");
        report(&self.unread_maps, "maps that are not read (normal, occlusion, specular, transmission)");
        (self.list, self.pictures)
    }
}

/// One material at work.
struct Reader<'r, 'c> {
    context: &'r mut Context<'c>,
    root: &'r Element<'r>,
    buffers: &'r Buffers<'r>,
    materials: &'r mut Materials,
}

impl Reader<'_, '_> {
    fn material(&mut self, element: Option<&Element<'_>>, name: String) -> Material {
        let empty = serde_json::Value::Null;
        let nothing = Element::root(self.context.file, &empty);
        let element = element.unwrap_or(&nothing);
        let pbr = element.get("pbrMetallicRoughness").unwrap_or_else(|| nothing.clone());

        let color = self.colour(&pbr, "baseColorFactor", [1.0; 4], 1.0);
        let mut base_color = Texel {
            factor: Rgb::new(color[0], color[1], color[2]),
            alpha: color[3],
            texture: self.texture(pbr.get("baseColorTexture")),
        };
        let limit = self.context.limits.max_reflectance;
        self.materials.clamp.apply(&mut base_color, &self.materials.pictures, limit, &name);

        let metallic = self.number(&pbr, "metallicFactor", 1.0, 0.0..=1.0);
        let roughness = self.number(&pbr, "roughnessFactor", 1.0, 0.0..=1.0);
        let (specular, specular_color) = match element.extension("KHR_materials_specular") {
            Some(e) => {
                let color = self.colour(&e, "specularColorFactor", [1.0; 3], f64::MAX);
                (self.number(&e, "specularFactor", 1.0, 0.0..=1.0), Rgb::from_array(color))
            }
            None => (1.0, Rgb::WHITE),
        };
        let surface = if specular == 0.0 && metallic == 0.0 {
            Surface::Lambertian { reflectance: base_color }
        } else {
            let metallic_roughness_texture = self.texture(pbr.get("metallicRoughnessTexture"));
            let ior = self.ior(element);
            Surface::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                metallic_roughness_texture,
                specular,
                specular_texture: None,
                specular_color,
                specular_color_texture: None,
                ior,
            }
        };

        let strength = element.extension("KHR_materials_emissive_strength");
        let strength = strength.map_or(1.0, |e| self.number(&e, "emissiveStrength", 1.0, 0.0..=f64::MAX));
        let emissive = self.colour(element, "emissiveFactor", [0.0; 3], f64::MAX);
        let emission = self.emission(element, Rgb::from_array(emissive) * strength);
        // The texture of a black emitter would be decoded for nothing.
        let emission_texture = if emission.is_black() { None } else { self.texture(element.get("emissiveTexture")) };
        let transmissive = self.transmits(element);
        self.note_unread(element, transmissive, &name);
        let opacity = self.opacity(element);
        let two_sided = element.flag("doubleSided");
        let transmission = transmissive.then_some(Transmission { factor: 1.0, texture: None, volume: None });
        let normal_map = None;
        Material { name, surface, emission, emission_texture, two_sided, opacity, transmission, normal_map }
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

    fn transmits(&mut self, element: &Element<'_>) -> bool {
        let Some(extension) = element.extension("KHR_materials_transmission") else { return false };
        self.number(&extension, "transmissionFactor", 0.0, 0.0..=1.0) > 0.0
    }

    fn note_unread(&mut self, element: &Element<'_>, transmissive: bool, name: &str) {
        if transmissive {
            self.materials.transmissive.push(name.to_owned());
        }
        let specular = element.extension("KHR_materials_specular");
        let unread = element.get("normalTexture").is_some()
            || element.get("occlusionTexture").is_some()
            || specular.is_some_and(|s| s.get("specularTexture").or(s.get("specularColorTexture")).is_some())
            || element.extension("KHR_materials_transmission").is_some_and(|t| t.get("transmissionTexture").is_some());
        if unread {
            self.materials.unread_maps.push(name.to_owned());
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

    /// The texture of a slot. Whatever is wrong with it, the factor stands alone.
    fn texture(&mut self, slot: Option<Element<'_>>) -> Option<TextureRef> {
        let slot = slot?;
        match self.try_texture(&slot) {
            Ok(texture) => texture,
            Err(error) => {
                self.context.warn(&slot.path, format!("{}: the factor is used alone", error.without_place()));
                None
            }
        }
    }

    fn try_texture(&mut self, slot: &Element<'_>) -> Result<Option<TextureRef>, FormatError> {
        let transform = slot.extension("KHR_texture_transform");
        let moved = transform.as_ref().map(|t| t.integer("texCoord")).transpose()?.flatten();
        let set = moved.or(slot.integer("texCoord")?).unwrap_or(0);
        if set != 0 {
            let message = format!("uses TEXCOORD_{set}; only TEXCOORD_0 is read: the factor is used alone");
            self.context.warn(&slot.path, message);
            return Ok(None);
        }
        if transform.is_some_and(|t| t.keys().any(|k| matches!(k, "offset" | "scale" | "rotation"))) {
            self.context.warn(&slot.path, "KHR_texture_transform is ignored: the picture lies differently");
        }
        let link = slot.require("index", "the index of a texture")?;
        let (_, texture) = link.as_link(self.root, "textures")?;
        let webp = texture.extension("EXT_texture_webp");
        let source = webp.as_ref().filter(|w| w.get("source").is_some()).unwrap_or(&texture);
        let Some((index, image)) = source.follow("source", self.root, "images")? else {
            return Err(texture.fault("no source", "the index of an image"));
        };
        let Some(picture) = self.picture(index, &image) else { return Ok(None) };
        let sampler = texture.follow("sampler", self.root, "samplers")?.map(|(_, s)| s);
        let (mut wrap, mut nearest) = ([Wrap::Repeat; 2], false);
        if let Some(sampler) = sampler {
            wrap = [wrap_mode(&sampler, "wrapS"), wrap_mode(&sampler, "wrapT")];
            nearest = matches!(sampler.integer("magFilter"), Ok(Some(9728)));
        }
        Ok(Some(TextureRef { wrap, nearest, ..TextureRef::of(picture) }))
    }

    /// Our index of image `index` of the file, decoded when first asked for.
    fn picture(&mut self, index: usize, image: &Element<'_>) -> Option<usize> {
        if let Some(known) = self.materials.images.get(&index) {
            return *known;
        }
        let picture = match self.decode(index, image) {
            Ok((picture, remark)) => {
                remark.into_iter().for_each(|r| self.context.warn(&image.path, r));
                Some(picture)
            }
            Err(message) => {
                let message = format!("{message}: materials that use it keep their factor alone");
                self.context.warn(&image.path, message);
                None
            }
        };
        self.materials.images.insert(index, picture);
        picture
    }

    fn decode(&mut self, index: usize, image: &Element<'_>) -> Result<(usize, Option<String>), String> {
        let words = |error: FormatError| error.without_place();
        let (pictures, limits) = (&mut self.materials.pictures, self.context.limits);
        if let Some(view) = self.buffers.view(self.root, image).map_err(words)? {
            return pictures.add(&image.name_or(|| format!("image {index}")), view.bytes, limits);
        }
        let uri = image.text("uri").map_err(words)?.ok_or("has neither uri nor bufferView")?;
        match data_uri(uri) {
            Some(bytes) => pictures.add(&image.name_or(|| format!("image {index}")), &bytes?, limits),
            None => {
                let path = percent_decode(uri);
                let bytes = self.context.fetch(&image.path, &path).map_err(words)?;
                pictures.add(&path, &bytes, limits)
            }
        }
    }
}

fn wrap_mode(sampler: &Element<'_>, key: &str) -> Wrap {
    match sampler.integer(key) {
        Ok(Some(33071)) => Wrap::Clamp,
        Ok(Some(33648)) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
