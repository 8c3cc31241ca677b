//! MTL materials to ours: Kd to Lambertian or Phong, Ke to emission, illumination models of glass to glass.
//!
//! `d` is what its specification calls dissolving: a share of the surface that is not there. Where the illumination
//! model says glass (4 and 9, a pane; 6 and 7, a body that refracts) it is the share that does not transmit.
//! Every material is two-sided, because OBJ has no notion of sides; emission is still that of the front, the side
//! of the author's normals. Not here: text (`mtl`), pixels (`texture`).

use std::collections::HashMap;

use twinray_scene::{
    Material, NormalMap, Opacity, Rgb, Surface, Texel, TextureRef, TextureTransform, Transmission, Volume, Wrap,
};

use super::mtl::{Entry, Map};
use crate::context::Context;
use crate::reflectance::Clamp;
use crate::texture::Pictures;
use crate::warning::name_list;

/// Grey of surfaces whose material is not to be had.
const MISSING_REFLECTANCE: f64 = 0.5;

/// Turns entries into materials when faces use them.
pub(super) struct Materials {
    entries: Vec<Entry>,
    by_name: HashMap<String, usize>,
    /// Our index of each name in use; the empty name is "no material".
    known: HashMap<String, usize>,
    list: Vec<Material>,
    pictures: Pictures,
    files: HashMap<String, Option<usize>>,
    clamp: Clamp,
    /// Ks brought down so that no more light leaves than arrives.
    dimmed: Vec<String>,
    bumpy: Vec<String>,
    unknown: Vec<String>,
    from_ambient: bool,
}

impl Materials {
    pub(super) fn new(entries: Vec<Entry>) -> Self {
        // Of equal names the first counts: it is what the viewers show that look names up in order.
        let mut by_name = HashMap::new();
        for (i, entry) in entries.iter().enumerate() {
            by_name.entry(entry.name.clone()).or_insert(i);
        }
        let lit = |colour: Option<Rgb>| colour.is_some_and(|c| c.max_channel() > 0.0);
        let emits = entries.iter().any(|e| lit(e.emission) || e.emission_map.is_some());
        // Files older than Ke say "light" in the name and put the radiance into Ka.
        let from_ambient = !emits && entries.iter().any(|e| is_light(&e.name) && lit(e.ambient));
        Self {
            entries,
            by_name,
            known: HashMap::new(),
            list: Vec::new(),
            pictures: Pictures::default(),
            files: HashMap::new(),
            clamp: Clamp::default(),
            dimmed: Vec::new(),
            bumpy: Vec::new(),
            unknown: Vec::new(),
            from_ambient,
        }
    }

    /// Our index of the material `name`.
    pub(super) fn of(&mut self, context: &mut Context<'_>, name: Option<&str>) -> usize {
        let key = name.unwrap_or_default();
        if let Some(&index) = self.known.get(key) {
            return index;
        }
        let entry = self.by_name.get(key).and_then(|&i| self.entries.get(i)).cloned();
        let material = match entry {
            Some(entry) => self.material(context, &entry),
            None => {
                if let Some(name) = name {
                    self.unknown.push(name.to_owned());
                }
                let reflectance = Texel::constant(Rgb::grey(MISSING_REFLECTANCE));
                let name = name.unwrap_or("no material").to_owned();
                let surface = Surface::Lambertian { reflectance };
                Material { name, surface, two_sided: true, ..Material::default() }
            }
        };
        self.list.push(material);
        self.known.insert(key.to_owned(), self.list.len() - 1);
        self.list.len() - 1
    }

    /// Materials and pictures, after the warnings that concern many of them.
    pub(super) fn finish(self, context: &mut Context<'_>) -> (Vec<Material>, Pictures) {
        self.clamp.report(context);
        let limit = context.limits.max_reflectance;
        let mut report = |names: &[String], message: String| {
            if !names.is_empty() {
                context.sum_up("materials", format!("{message}: {}", name_list(names)));
            }
        };
        report(&self.dimmed, format!("Ks brought down so that Kd + Ks is at most {limit}"));
        report(&self.bumpy, "bump maps are ignored; normal maps (norm) are read".to_owned());
        report(&self.unknown, format!("not found in any MTL file, {MISSING_REFLECTANCE} grey is used"));
        if self.from_ambient {
            let lights = self.list.iter().filter(|m| !m.emission.is_black());
            let names: Vec<String> = lights.map(|m| m.name.clone()).collect();
            report(&names, "no material has Ke; Ka is taken as the emission of those named light".to_owned());
        }
        (self.list, self.pictures)
    }

    fn material(&mut self, context: &mut Context<'_>, entry: &Entry) -> Material {
        let mut emission = entry.emission.unwrap_or(Rgb::BLACK).map(|c| c.max(0.0));
        if self.from_ambient && is_light(&entry.name) {
            emission = entry.ambient.unwrap_or(Rgb::BLACK).map(|c| c.max(0.0));
        }
        let emission_texture = entry.emission_map.as_ref().and_then(|map| self.texture(context, map));
        if emission.is_black() && emission_texture.is_some() {
            emission = Rgb::WHITE;
        }
        let most = context.limits.max_radiance;
        if emission.max_channel() > most {
            let element = format!("material \"{}\"", entry.name);
            context.warn(element, format!("emission {:?} is brought down to {most:e}", emission.to_array()));
            emission = emission.map(|c| c.min(most));
        }
        if entry.bump_map.is_some() {
            self.bumpy.push(entry.name.clone());
        }
        let normal_map = entry
            .normal_map
            .as_ref()
            .and_then(|map| Some(NormalMap { texture: self.texture(context, map)?, scale: map.strength }));
        let glass = glass(entry);
        let mut surface = match &glass {
            Some(glass) => self.glass_surface(entry, glass),
            None => self.surface(context, entry, emission),
        };
        let opacity = self.opacity(context, entry, &mut surface, glass.is_some());
        Material {
            name: entry.name.clone(),
            surface,
            emission,
            emission_texture,
            two_sided: true,
            opacity,
            transmission: glass.map(|g| g.transmission),
            normal_map,
        }
    }

    /// Glass reflects by its index of refraction, and what passes has the colour of Tf.
    fn glass_surface(&mut self, entry: &Entry, glass: &Glass) -> Surface {
        let mut base_color = Texel::constant(entry.filter.unwrap_or(Rgb::WHITE).map(|c| c.max(0.0)));
        // What does not transmit has Kd: the two share one base.
        if glass.transmission.factor < 1.0 && entry.filter.is_none() {
            base_color = Texel::constant(entry.diffuse.unwrap_or(Rgb::WHITE));
        }
        base_color.factor = base_color.factor.map(|c| c.clamp(0.0, 1.0));
        Surface::MetallicRoughness {
            base_color,
            metallic: 0.0,
            roughness: glass.roughness,
            metallic_roughness_texture: None,
            specular: 1.0,
            specular_texture: None,
            specular_color: Rgb::WHITE,
            specular_color_texture: None,
            ior: glass.ior,
        }
    }

    fn surface(&mut self, context: &mut Context<'_>, entry: &Entry, emission: Rgb) -> Surface {
        let limit = context.limits.max_reflectance;
        let texture = entry.diffuse_map.as_ref().and_then(|map| self.texture(context, map));
        // Without Kd: the picture as it is, black for lamps, grey otherwise.
        let default = match (&texture, emission.is_black()) {
            (Some(_), _) => Rgb::WHITE,
            (None, true) => Rgb::grey(MISSING_REFLECTANCE),
            (None, false) => Rgb::BLACK,
        };
        let mut diffuse = Texel { factor: entry.diffuse.unwrap_or(default), alpha: 1.0, texture };
        self.clamp.apply(&mut diffuse, &self.pictures, limit, &entry.name);

        let (specular, exponent) = (entry.specular.unwrap_or(Rgb::BLACK), entry.exponent.unwrap_or(0.0));
        // Illumination models 0 and 1 have no highlight, whatever Ks says.
        let glossy = entry.illumination.is_none_or(|i| i >= 2.0) && specular.max_channel() > 0.0;
        if !glossy || exponent.is_nan() || exponent <= 0.0 {
            return Surface::Lambertian { reflectance: diffuse };
        }
        // Kd keeps its value, it is what authors see; Ks takes what is left of the energy.
        let brightest = diffuse.texture.as_ref().map_or([1.0; 3], |t| self.pictures.brightest(t.image));
        let room: [f64; 3] = std::array::from_fn(|c| (limit - diffuse.factor[c] * brightest[c]).max(0.0));
        let kept = Rgb::from_array(std::array::from_fn(|c| specular[c].clamp(0.0, room[c])));
        if kept != specular {
            self.dimmed.push(entry.name.clone());
        }
        if kept.is_black() {
            return Surface::Lambertian { reflectance: diffuse };
        }
        Surface::Phong { diffuse, specular: kept, exponent: exponent.min(1e6) }
    }

    /// `map_d` as a mask, else `d` as the share that is there. A mask from another file than `map_Kd` is put into the
    /// alpha channel of that picture, or of a white one.
    fn opacity(&mut self, context: &mut Context<'_>, entry: &Entry, surface: &mut Surface, is_glass: bool) -> Opacity {
        let base = match surface {
            Surface::Lambertian { reflectance } => reflectance,
            Surface::MetallicRoughness { base_color, .. } => base_color,
            Surface::Phong { diffuse, .. } => diffuse,
        };
        let dissolved = entry.opacity.filter(|d| *d < 1.0 && !is_glass).map(|d| d.max(0.0));
        if let Some(map) = &entry.opacity_map {
            let same = entry.diffuse_map.as_ref().is_some_and(|d| d.file == map.file);
            if same && base.texture.is_some() || self.masked(context, entry, map, base) {
                base.alpha = 1.0;
                return Opacity::Mask { cutoff: 0.5 };
            }
        }
        let Some(alpha) = dissolved else { return Opacity::Opaque };
        base.alpha = alpha;
        Opacity::Blend
    }

    /// Gives `base` the mask `map`; false, with a warning, if that cannot be.
    fn masked(&mut self, context: &mut Context<'_>, entry: &Entry, map: &Map, base: &mut Texel) -> bool {
        let Some(mask) = self.texture(context, map) else { return false };
        let lies_alike = base.texture.as_ref().is_none_or(|t| (t.wrap, t.transform) == (mask.wrap, mask.transform));
        let colour = base.texture.as_ref().map(|t| t.image);
        let image = if lies_alike { self.pictures.with_mask(colour, mask.image, context.limits) } else { None };
        if let Some(image) = image {
            base.texture = Some(TextureRef { image, ..mask });
            return true;
        }
        let element = format!("material \"{}\"", entry.name);
        context.warn(element, "map_d is ignored: it is of another size than map_Kd, lies differently, or is too large");
        false
    }

    fn texture(&mut self, context: &mut Context<'_>, map: &Map) -> Option<TextureRef> {
        if !self.files.contains_key(&map.file) {
            let picture = self.load(context, map);
            self.files.insert(map.file.clone(), picture);
        }
        let image = self.files.get(&map.file).copied().flatten()?;
        let wrap = [if map.clamp { Wrap::Clamp } else { Wrap::Repeat }; 2];
        // OBJ counts v from below: 1 - v' = s (1 - v) + o.
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        let transform = TextureTransform { offset: [ou, 1.0 - sv - ov], rotation: 0.0, scale: [su, sv] };
        Some(TextureRef { wrap, transform, ..TextureRef::of(image) })
    }

    fn load(&mut self, context: &mut Context<'_>, map: &Map) -> Option<usize> {
        let element = format!("texture \"{}\"", map.file.chars().take(200).collect::<String>());
        let bytes = context.fetch(&element, &map.file).map_err(|error| error.without_place());
        match bytes.and_then(|bytes| self.pictures.add(&map.file, &bytes, context.limits)) {
            Ok((picture, remark)) => {
                remark.into_iter().for_each(|r| context.warn(&element, r));
                Some(picture)
            }
            Err(message) => {
                context.warn(element, format!("{message}: materials that use it keep their colour alone"));
                None
            }
        }
    }
}

/// What makes a material glass.
struct Glass {
    transmission: Transmission,
    ior: f64,
    roughness: f64,
}

/// Illumination models 6 and 7 refract; 4 and 9 are called glass, but exporters write them for anything, so that `d` or
/// `Tf` has to say so, too.
fn glass(entry: &Entry) -> Option<Glass> {
    let model = entry.illumination?;
    let opacity = entry.opacity.unwrap_or(1.0).clamp(0.0, 1.0);
    let filters = entry.filter.is_some_and(|f| f.max_channel() > 0.0);
    let refracts = model == 6.0 || model == 7.0;
    if !refracts && !((model == 4.0 || model == 9.0) && (opacity < 1.0 || filters)) {
        return None;
    }
    // An index of 1 bends nothing: what lies behind such a surface is not its inside.
    let ior = entry.ior.filter(|n| (1.0..=4.0).contains(n)).unwrap_or(1.5);
    let volume = (refracts && ior > 1.0).then_some(Volume { attenuation: Rgb::BLACK });
    let factor = if opacity < 1.0 { 1.0 - opacity } else { 1.0 };
    // α = √(2/(n + 2)) and α = roughness²; below a width that anybody sees, glass is smooth.
    let roughness = match entry.exponent {
        Some(n) if (0.0..ROUGHEST_SMOOTH).contains(&n) && n > 0.0 => (2.0 / (n + 2.0)).powf(0.25),
        _ => 0.0,
    };
    Some(Glass { transmission: Transmission { factor, texture: None, volume }, ior, roughness })
}

/// Phong exponent from which on glass is smooth. Exporters leave defaults of some hundred where nobody meant anything.
const ROUGHEST_SMOOTH: f64 = 60.0;

fn is_light(name: &str) -> bool {
    name.to_ascii_lowercase().contains("light")
}
