//! One number for everything that decides the light of the patches.
//!
//! Results that are stored apart from their scene carry it, so that nobody compares the light of two different
//! scenes patch by patch. It is made of the bits of the numbers that a [`PatchScene`] stores. Not in it: names,
//! cameras, vertex normals and textures beyond the patches' means (for display only), and where the scene lies in
//! the world. Called by whoever writes or checks stored light.

use crate::authored::{
    Environment, Opacity, SkyLevel, SkyModel, Surface, TextureImage, TextureTransform, Transmission,
};
use crate::cells::Cells;
use crate::patch::{PatchScene, Triangle};
use crate::rgb::Rgb;
use crate::sample::stream::mix;
use crate::surface::base_texel;

/// Raised whenever what is hashed, or its order, changes: old fingerprints then match nothing.
const VERSION: u64 = 2;

impl PatchScene {
    /// A hash of everything that decides the light of the patches and of their order: vertices, cells, sides, colours,
    /// lobes, emission, holes, surroundings. The same on every machine.
    ///
    /// A change of one stored number always changes it; two unrelated scenes share one with probability 2⁻⁶⁴.
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        let mut masks = vec![None; self.images.len()];
        hash.word(self.triangles.len() as u64);
        for (index, t) in self.triangles.iter().enumerate() {
            t.vertices.iter().for_each(|v| hash.floats(v));
            hash.word(u64::from(t.two_sided));
            hash.cells(&t.cells);
            let material = &self.materials[t.material as usize];
            hash.passing(t, material.transmission.as_ref());
            hash.lobe(t, &material.surface);
            self.speculars.get(index).iter().for_each(|s| hash.floats(*s));
            self.holes(index, t, &mut masks, &mut hash);
        }
        hash.word(self.len() as u64);
        for patch in self.patches() {
            hash.floats(&self.base_color[patch.index()]);
            hash.color(self.emission(patch));
            // Vertices and cells give the area, but for the part of it that holes leave.
            hash.double(self.area(patch));
        }
        hash.surroundings(self.environment.as_ref().map(|e| e.environment()));
        // What has no such lights keeps its fingerprint from the time before them.
        self.lights.iter().for_each(|light| light.words().for_each(|word| hash.word(word)));
        hash.0
    }

    /// Holes let rays through at full resolution: the mask itself decides where light goes, not only its mean.
    fn holes(&self, index: usize, t: &Triangle, masks: &mut [Option<u64>], hash: &mut Hash) {
        let material = &self.materials[t.material as usize];
        match material.opacity {
            Opacity::Opaque => return hash.word(0),
            Opacity::Mask { cutoff } => {
                hash.word(1);
                hash.floats(&[cutoff]);
            }
            Opacity::Blend => hash.word(2),
        }
        let texel = base_texel(&material.surface);
        hash.double(texel.alpha);
        let Some(texture) = &texel.texture else { return };
        texture.wrap.iter().for_each(|w| hash.word(*w as u64));
        hash.word(u64::from(texture.nearest));
        let TextureTransform { offset, rotation, scale } = texture.transform;
        [offset[0], offset[1], rotation, scale[0], scale[1]].iter().for_each(|x| hash.double(*x));
        self.texcoords(index as u32, texture).iter().flatten().for_each(|uv| hash.floats(uv));
        // Many triangles share a picture, which is read once.
        hash.word(*masks[texture.image].get_or_insert_with(|| mask(&self.images[texture.image])));
    }
}

/// Hash of a picture's alpha channel.
fn mask(image: &TextureImage) -> u64 {
    let mut hash = Hash::new();
    hash.word(u64::from(image.width));
    hash.word(u64::from(image.height));
    image.rgba.chunks_exact(4).for_each(|texel| hash.word(u64::from(texel[3])));
    hash.0
}

/// A chain of bijections: each word enters by a sum and is mixed, so that one changed word cannot be undone by the
/// same words after it.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(mix(VERSION))
    }

    fn word(&mut self, word: u64) {
        // Without the inner mix, a small change here and one in the next word could cancel by design.
        self.0 = mix(self.0.rotate_left(23) ^ mix(word.wrapping_add(0x9E37_79B9_7F4A_7C15)));
    }

    fn double(&mut self, value: f64) {
        self.word(value.to_bits());
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|v| self.word(u64::from(v.to_bits())));
    }

    fn color(&mut self, color: Rgb) {
        color.to_array().iter().for_each(|c| self.double(*c));
    }

    fn cells(&mut self, cells: &Cells) {
        match *cells {
            Cells::Regular { m } => {
                self.word(0);
                self.word(u64::from(m));
            }
            Cells::Strips { columns, rows, first, foot } => {
                self.word(1);
                [u64::from(columns), u64::from(rows), u64::from(first)].iter().for_each(|n| self.word(*n));
                self.double(foot);
            }
        }
    }

    fn surroundings(&mut self, environment: Option<&Environment>) {
        match environment {
            None => self.word(0),
            Some(Environment::Uniform(radiance)) => {
                self.word(1);
                self.color(*radiance);
            }
            Some(Environment::Map(map)) => {
                self.word(2);
                self.word(u64::from(map.image.width));
                map.image.pixels.iter().for_each(|p| self.floats(p));
                self.double(map.rotation);
                self.double(map.strength);
            }
            Some(Environment::Sky(sky)) => {
                self.word(3);
                let (model, turbidity) = match sky.model {
                    SkyModel::Uniform => (0, 0.0),
                    SkyModel::Overcast => (1, 0.0),
                    SkyModel::Clear => (2, 0.0),
                    SkyModel::Preetham { turbidity } => (3, turbidity),
                };
                self.word(model);
                self.double(turbidity);
                sky.towards_sun.to_array().iter().for_each(|x| self.double(*x));
                let (kind, value) = match sky.level {
                    SkyLevel::Zenith(luminance) => (0, luminance),
                    SkyLevel::Horizontal(illuminance) => (1, illuminance),
                };
                self.word(kind);
                self.double(value);
                self.color(sky.sun.unwrap_or(Rgb::BLACK));
                self.color(sky.ground);
            }
        }
    }

    /// What passes a material; nothing where light does not.
    fn passing(&mut self, t: &Triangle, transmission: Option<&Transmission>) {
        let Some(transmission) = transmission else { return };
        // No kind of lobe has this number: what follows cannot be taken for one.
        self.word(3);
        self.floats(&[t.transmission]);
        self.word(u64::from(transmission.volume.is_some()));
        self.color(transmission.volume.map_or(Rgb::BLACK, |v| v.attenuation));
    }

    /// What a material does beside its base colour, which the patches hold.
    fn lobe(&mut self, t: &Triangle, surface: &Surface) {
        match surface {
            Surface::Lambertian { .. } => self.word(0),
            Surface::MetallicRoughness { specular, specular_color, ior, .. } => {
                self.word(1);
                self.floats(&[t.metallic, t.roughness]);
                self.double(*specular);
                self.color(*specular_color);
                self.double(*ior);
            }
            Surface::Phong { specular, exponent, .. } => {
                self.word(2);
                self.color(*specular);
                self.double(*exponent);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::animation::{CameraAnimation, Joint};
    use crate::authored::{
        EnvironmentMap, LightKind, LightProfile, PunctualLight, RadianceMap, Scene, Sky, Texel, TextureRef,
    };
    use crate::builtin;
    use crate::patch::{PatchBudget, PatchOptions};

    fn fingerprint(scene: &Scene, patches: usize) -> u64 {
        let options = PatchOptions { budget: PatchBudget::Count(patches), two_sided: false };
        PatchScene::new(scene, options).unwrap().fingerprint()
    }

    /// A change that must show.
    fn shows(what: &str, base: &Scene, change: impl FnOnce(&mut Scene)) {
        let mut changed = base.clone();
        change(&mut changed);
        assert_ne!(fingerprint(base, 500), fingerprint(&changed, 500), "{what} does not show");
    }

    /// A change that must not.
    fn hides(what: &str, base: &Scene, change: impl FnOnce(&mut Scene)) {
        let mut changed = base.clone();
        change(&mut changed);
        assert_eq!(fingerprint(base, 500), fingerprint(&changed, 500), "{what} shows");
    }

    #[test]
    fn what_decides_light_shows_and_names_do_not() {
        let base = builtin::cornell(false);
        assert_eq!(fingerprint(&base, 500), fingerprint(&base, 500));
        assert_ne!(fingerprint(&base, 500), fingerprint(&base, 1000), "the patch budget");
        shows("one vertex", &base, |s| s.meshes[1].positions[0][0] += 1e-4);
        shows("a placing", &base, |s| {
            s.instances[1].transform = DAffine3::from_rotation_y(1e-3) * s.instances[1].transform
        });
        shows("the order of instances", &base, |s| s.instances.swap(0, 1));
        shows("the sky", &base, |s| s.environment = Some(Environment::Uniform(Rgb::grey(1.0))));
        let (high, low) =
            (Sky::natural(SkyModel::Clear, Some([50.0, 90.0])), Sky::natural(SkyModel::Clear, Some([40.0, 90.0])));
        let mut under_the_sky = base.clone();
        under_the_sky.environment = Some(Environment::Sky(high.clone()));
        shows("the sun's place", &under_the_sky, |s| s.environment = Some(Environment::Sky(low)));
        shows("the ground", &under_the_sky, |s| {
            s.environment = Some(Environment::Sky(Sky { ground: Rgb::BLACK, ..high }))
        });
        let map = |green: f32, rotation: f64| {
            let pixels = vec![[1.0, green, 0.5]; 2];
            let image = Arc::new(RadianceMap { name: String::new(), width: 2, height: 1, pixels });
            Some(Environment::Map(EnvironmentMap { image, rotation, strength: 1.0 }))
        };
        under_the_sky.environment = map(1.0, 0.0);
        shows("a pixel of the map", &under_the_sky, |s| s.environment = map(0.9, 0.0));
        shows("the map's turn", &under_the_sky, |s| s.environment = map(1.0, 0.1));
        let light = |x: f64, candela: f32, kind| PunctualLight {
            name: "x".into(),
            kind,
            intensity: Rgb::WHITE,
            transform: DAffine3::from_translation(DVec3::new(x, 0.2, 0.3)),
            profile: (kind == LightKind::Point).then(|| {
                let (vertical, horizontal) = (vec![0.0, 180.0], vec![0.0]);
                Arc::new(LightProfile { name: String::new(), vertical, horizontal, candela: vec![candela, 1.0] })
            }),
        };
        let spot = |inner| LightKind::Spot { inner, outer: 0.5 };
        let mut lit = base.clone();
        lit.lights = vec![light(0.1, 2.0, LightKind::Point), light(0.1, 2.0, spot(0.2))];
        shows("lights", &base, |s| s.lights = lit.lights.clone());
        shows("a light's place", &lit, |s| s.lights[0].transform.translation.x += 1e-9);
        shows("a light's turn", &lit, |s| s.lights[1].transform.matrix3 = DAffine3::from_rotation_x(0.1).matrix3);
        shows("a light's colour", &lit, |s| s.lights[1].intensity.r = 0.9);
        shows("a profile", &lit, |s| s.lights[0] = light(0.1, 2.5, LightKind::Point));
        shows("a cone", &lit, |s| s.lights[1] = light(0.1, 2.0, spot(0.3)));
        hides("a light's name", &lit, |s| s.lights[0].name = "y".into());
        shows("the second side", &base, |s| s.materials[0].two_sided = true);
        for (k, m) in base.materials.iter().enumerate() {
            let other = Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.123)) };
            shows(&format!("the colour of {}", m.name), &base, |s| s.materials[k].surface = other);
            shows(&format!("the emission of {}", m.name), &base, |s| s.materials[k].emission.b += 0.1);
        }
        hides("names", &base, |s| {
            s.name = "x".into();
            s.meshes.iter_mut().for_each(|m| m.name = "x".into());
            s.instances.iter_mut().for_each(|m| m.name = "x".into());
            s.materials.iter_mut().for_each(|m| m.name = "x".into());
        });
        hides("cameras", &base, |s| s.cameras.clear());
        hides("motion of cameras", &base, |s| {
            let joints = vec![Joint::Fixed(DAffine3::from_translation(DVec3::X))];
            s.animations.push(CameraAnimation { name: "fly".into(), camera: 0, joints });
        });
        hides("the order of materials", &base, |s| {
            s.materials.swap(0, 1);
            s.meshes.iter_mut().filter(|m| m.material < 2).for_each(|m| m.material = 1 - m.material);
        });
        // A step that every coordinate can take without rounding.
        hides("the place in the world", &builtin::cube(0.5), |s| {
            let step = DAffine3::from_translation(DVec3::new(64.0, 0.0, -32.0));
            s.instances.iter_mut().for_each(|i| i.transform = step * i.transform);
        });
    }

    #[test]
    fn lobes_show() {
        let mut base = builtin::cube(0.5);
        let texel = || Texel::constant(Rgb::grey(0.5));
        base.materials[0].surface = Surface::Phong { diffuse: texel(), specular: Rgb::grey(0.2), exponent: 30.0 };
        let phong = |specular, exponent| Surface::Phong { diffuse: texel(), specular, exponent };
        shows("the exponent", &base, |s| s.materials[0].surface = phong(Rgb::grey(0.2), 31.0));
        shows("the lobe's colour", &base, |s| s.materials[0].surface = phong(Rgb::grey(0.21), 30.0));
        let metal = |metallic, roughness, ior| Surface::MetallicRoughness {
            base_color: texel(),
            metallic,
            roughness,
            metallic_roughness_texture: None,
            specular_texture: None,
            specular_color_texture: None,
            specular: 1.0,
            specular_color: Rgb::WHITE,
            ior,
        };
        base.materials[0].surface = metal(0.0, 0.5, 1.5);
        shows("roughness", &base, |s| s.materials[0].surface = metal(0.0, 0.51, 1.5));
        shows("metalness", &base, |s| s.materials[0].surface = metal(0.1, 0.5, 1.5));
        shows("refraction", &base, |s| s.materials[0].surface = metal(0.0, 0.5, 1.6));
    }

    #[test]
    fn holes_show_even_where_the_means_agree() {
        let picture = |rgba: Vec<u8>| TextureImage { name: "mask".into(), width: 2, height: 1, rgba };
        let mut base = builtin::cube(0.5);
        base.images = vec![Arc::new(picture(vec![255, 255, 255, 255, 255, 255, 255, 0]))];
        let texture = Some(TextureRef { nearest: true, ..TextureRef::of(0) });
        base.meshes.iter_mut().for_each(|m| m.texcoords = Some(m.positions.iter().map(|p| [p[0], p[1]]).collect()));
        for material in &mut base.materials {
            material.surface = Surface::Lambertian {
                reflectance: Texel { factor: Rgb::grey(0.5), alpha: 1.0, texture: texture.clone() },
            };
            material.opacity = Opacity::Mask { cutoff: 0.5 };
        }
        shows("the mask", &base, |s| s.images[0] = Arc::new(picture(vec![255, 255, 255, 0, 255, 255, 255, 255])));
        shows("the cutoff", &base, |s| s.materials[0].opacity = Opacity::Mask { cutoff: 0.4 });
        shows("blending", &base, |s| s.materials[0].opacity = Opacity::Blend);
        let alpha = |s: &mut Scene, alpha| {
            s.materials[0].opacity = Opacity::Blend;
            let Surface::Lambertian { reflectance } = &mut s.materials[0].surface else { panic!() };
            reflectance.alpha = alpha;
        };
        let mut blended = base.clone();
        alpha(&mut blended, 0.5);
        // The thinner surface has other areas already; here both are as good as absent.
        shows("alpha", &blended, |s| alpha(s, 0.25));
        shows("where the mask lies", &base, |s| {
            let Surface::Lambertian { reflectance } = &mut s.materials[0].surface else { panic!() };
            reflectance.texture.as_mut().unwrap().transform.offset = [1.0, 0.0];
        });
        shows("no holes", &base, |s| s.materials.iter_mut().for_each(|m| m.opacity = Opacity::Opaque));
    }

    /// The bits of stored numbers and integer arithmetic alone decide it: a value on one machine is that of all. If
    /// this fails, either the scene, its cells or the hash has changed: raise `VERSION` only for the last.
    #[test]
    fn the_value_is_the_same_everywhere() {
        assert_eq!(format!("{:016x}", fingerprint(&builtin::cube(0.5), 100)), "7e64568590eab4b1");
    }
}
