//! Every fault of a scene, in one list: indices that point nowhere, numbers that mean nothing.
//!
//! Readers give sound scenes; scenes built by hand go through here before they are cut into patches.

use crate::authored::{
    Environment, LightKind, LightProfile, PunctualLight, RadianceMap, Scene, Sky, SkyLevel, SkyModel, Surface,
    TextureImage, TextureTransform,
};
use crate::rgb::Rgb;
use crate::surface::base_texel;
use crate::texture::srgb_to_linear;

/// One fault: which element, what is wrong, what was expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{element}: {problem}")]
pub struct Fault {
    /// The element, such as `mesh 3 "chair"`.
    pub element: String,
    /// What is wrong with it and what was expected.
    pub problem: String,
}

impl Scene {
    /// All faults; an empty list means that the scene can be cut into patches.
    pub fn validate(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let mut fault = |element: String, problem: String| faults.push(Fault { element, problem });
        for (i, mesh) in self.meshes.iter().enumerate() {
            let element = || format!("mesh {i} \"{}\"", mesh.name);
            let n = mesh.positions.len();
            if mesh.material >= self.materials.len() {
                fault(element(), format!("material {} of {}", mesh.material, self.materials.len()));
            }
            if let Some(k) = mesh.triangles.iter().flatten().find(|&&k| k as usize >= n) {
                fault(element(), format!("vertex index {k}, expected less than {n}"));
            }
            if mesh.positions.iter().flatten().any(|x| !x.is_finite()) {
                fault(element(), "a vertex position is not finite".into());
            }
            let lengths = [
                mesh.normals.as_ref().map(Vec::len),
                mesh.tangents.as_ref().map(Vec::len),
                mesh.texcoords.as_ref().map(Vec::len),
                mesh.second_texcoords.as_ref().map(Vec::len),
            ];
            if lengths.iter().flatten().any(|&length| length != n) {
                fault(element(), format!("attributes of another length than the {n} positions"));
            }
        }
        for (i, instance) in self.instances.iter().enumerate() {
            let element = || format!("instance {i} \"{}\"", instance.name);
            if instance.mesh >= self.meshes.len() {
                fault(element(), format!("mesh {} of {}", instance.mesh, self.meshes.len()));
            }
            if !instance.transform.is_finite() {
                fault(element(), "its transform is not finite".into());
            }
        }
        // Once a picture, however many materials use it.
        let mut brightest: Vec<Option<Rgb>> = vec![None; self.images.len()];
        for (i, material) in self.materials.iter().enumerate() {
            let element = || format!("material {i} \"{}\"", material.name);
            let colors: Vec<Rgb> = match &material.surface {
                Surface::Lambertian { reflectance } => vec![reflectance.factor],
                Surface::MetallicRoughness { base_color, .. } => vec![base_color.factor],
                Surface::Phong { diffuse, specular, .. } => {
                    let image = diffuse.texture.as_ref().map(|t| t.image).filter(|&i| i < self.images.len());
                    let brightest = image
                        .map_or(Rgb::WHITE, |i| *brightest[i].get_or_insert_with(|| brightest_texel(&self.images[i])));
                    vec![diffuse.factor * brightest + *specular, diffuse.factor, *specular]
                }
            };
            for c in colors {
                // A sum whose parts were fitted to each other may round to a little more than 1.
                if !c.is_finite() || c.min_channel() < 0.0 || c.max_channel() > 1.0 + 1e-12 {
                    fault(element(), format!("reflectance {:?}, expected 0 to 1", c.to_array()));
                }
            }
            if !is_radiance(material.emission) {
                fault(element(), format!("emission {:?}, {RADIANCE}", material.emission.to_array()));
            }
            for t in material.textures() {
                if t.image >= self.images.len() {
                    fault(element(), format!("image {} of {}", t.image, self.images.len()));
                }
                if t.set > 1 {
                    fault(element(), format!("set {} of texture coordinates, expected 0 or 1", t.set));
                }
                let TextureTransform { offset, rotation, scale } = t.transform;
                if ![offset, [rotation, 0.0], scale].iter().flatten().all(|x| x.is_finite()) {
                    fault(element(), "a texture's transform is not finite".into());
                }
            }
            let alpha = base_texel(&material.surface).alpha;
            if !(0.0..=1.0).contains(&alpha) {
                fault(element(), format!("alpha {alpha}, expected 0 to 1"));
            }
            if let Some(t) = &material.transmission {
                if !(0.0..=1.0).contains(&t.factor) {
                    fault(element(), format!("transmission {}, expected 0 to 1", t.factor));
                }
                let attenuation = t.volume.map_or(Rgb::BLACK, |v| v.attenuation);
                if !attenuation.is_finite() || attenuation.min_channel() < 0.0 {
                    fault(element(), format!("attenuation {:?}, expected 0 or more", attenuation.to_array()));
                }
            }
            if material.normal_map.as_ref().is_some_and(|n| !n.scale.is_finite()) {
                fault(element(), "the scale of its normal map is not finite".into());
            }
        }
        for (i, image) in self.images.iter().enumerate() {
            if image.rgba.len() as u64 != 4 * u64::from(image.width) * u64::from(image.height) || image.rgba.is_empty()
            {
                fault(format!("image {i} \"{}\"", image.name), "its size does not match its texels".into());
            }
        }
        for (i, light) in self.lights.iter().enumerate() {
            if let Some(problem) = light_fault(light) {
                fault(format!("light {i} \"{}\"", light.name), problem);
            }
        }
        if let Some(problem) = self.environment.as_ref().and_then(environment_fault) {
            fault("environment".into(), problem);
        }
        faults
    }
}

/// What is wrong with a light without area.
fn light_fault(light: &PunctualLight) -> Option<String> {
    if !light.transform.is_finite() {
        return Some("its transform is not finite".into());
    }
    if !is_radiance(light.intensity) {
        return Some(format!("intensity {:?}, {RADIANCE}", light.intensity.to_array()));
    }
    if let LightKind::Spot { inner, outer } = light.kind
        && !(0.0 <= inner && inner < outer && outer <= std::f64::consts::FRAC_PI_2 + 1e-9)
    {
        return Some(format!("cones of {inner} and {outer}, expected 0 ≤ inner < outer ≤ π/2"));
    }
    let Some(profile) = &light.profile else { return None };
    if light.kind != LightKind::Point {
        return Some("a profile on a light that is no point".into());
    }
    let LightProfile { vertical, horizontal, candela, .. } = &**profile;
    let ascends = |angles: &[f32], most: f32| {
        let within = angles.iter().all(|a| (0.0..=most).contains(a));
        within && !angles.is_empty() && angles.windows(2).all(|pair| pair[0] < pair[1])
    };
    if !(ascends(vertical, 180.0) && ascends(horizontal, 360.0)) {
        return Some("angles of its profile that do not ascend within 0 to 180° (γ) and 0 to 360° (C)".into());
    }
    let around = [horizontal[0], horizontal[horizontal.len() - 1]];
    if around != [0.0; 2] && around != [0.0, 360.0] {
        return Some(format!("a profile from C = {} to {}, expected 0 alone, or 0 to 360", around[0], around[1]));
    }
    if candela.len() != vertical.len() * horizontal.len() || !candela.iter().all(|c| *c >= 0.0 && c.is_finite()) {
        return Some("candela values that are not a finite, positive number for every pair of angles".into());
    }
    None
}

/// What is wrong with an environment.
fn environment_fault(environment: &Environment) -> Option<String> {
    match environment {
        Environment::Uniform(radiance) => {
            (!is_radiance(*radiance)).then(|| format!("radiance {:?}, {RADIANCE}", radiance.to_array()))
        }
        Environment::Map(map) => {
            let RadianceMap { name, width, height, pixels } = &*map.image;
            if pixels.is_empty() || pixels.len() as u64 != u64::from(*width) * u64::from(*height) {
                return Some(format!("the size of the map \"{name}\" does not match its pixels"));
            }
            if !(map.rotation.is_finite() && map.strength.is_finite() && map.strength >= 0.0) {
                let (rotation, strength) = (map.rotation, map.strength);
                return Some(format!(
                    "rotation {rotation} and strength {strength}, expected numbers, the latter at least 0"
                ));
            }
            let wrong = pixels.iter().position(|p| !is_radiance(Rgb::from_f32(*p) * map.strength));
            wrong.map(|k| {
                let (x, y) = (k % *width as usize, k / *width as usize);
                format!("pixel ({x}, {y}) of the map \"{name}\" is {:?}, {RADIANCE}", pixels[k])
            })
        }
        Environment::Sky(sky) => sky_fault(sky),
    }
}

fn sky_fault(sky: &Sky) -> Option<String> {
    let sun = sky.towards_sun;
    if !sun.is_finite() || (sun.length() - 1.0).abs() > 1e-9 {
        return Some(format!("the direction {sun} of the sun, expected a unit vector"));
    }
    if sun.y <= 0.0 && (sky.sun.is_some() || matches!(sky.model, SkyModel::Clear | SkyModel::Preetham { .. })) {
        return Some("the sun is below the horizon; expected above it, or an overcast sky without it".into());
    }
    if let SkyModel::Preetham { turbidity } = sky.model
        && !(1.7..=10.0).contains(&turbidity)
    {
        return Some(format!("turbidity {turbidity}, expected 1.7 to 10"));
    }
    let (SkyLevel::Zenith(level) | SkyLevel::Horizontal(level)) = sky.level;
    if !(0.0..1e12).contains(&level) {
        return Some(format!("a sky of {level} nit or lx, {RADIANCE}"));
    }
    let ground = sky.ground;
    if !(ground.min_channel() >= 0.0 && ground.max_channel() <= 1.0) {
        return Some(format!("the ground's albedo {:?}, expected 0 to 1", ground.to_array()));
    }
    let sunlight = sky.sun.unwrap_or(Rgb::BLACK);
    (!(sunlight.min_channel() >= 0.0 && sunlight.max_channel() < 1e12))
        .then(|| format!("sunlight of {:?} lx, {RADIANCE}", sunlight.to_array()))
}

const RADIANCE: &str = "expected 0 or more, and no more than single precision can hold";

fn is_radiance(radiance: Rgb) -> bool {
    radiance.min_channel() >= 0.0 && radiance.to_f32().iter().all(|c| c.is_finite())
}

/// Largest value of each channel: two lobes share a surface's light, and a dark texture leaves room for the other.
fn brightest_texel(image: &TextureImage) -> Rgb {
    let mut brightest = [0u8; 3];
    for texel in image.rgba.chunks_exact(4) {
        brightest.iter_mut().zip(texel).for_each(|(most, &t)| *most = t.max(*most));
    }
    Rgb::from_array(brightest.map(|b| srgb_to_linear(f64::from(b) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authored::{EnvironmentMap, Instance, Material, Mesh, Texel, TextureRef};
    use glam::DAffine3;
    use std::sync::Arc;

    #[test]
    fn every_fault_is_listed() {
        let scene = Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0; 3], [f32::NAN; 3]],
                triangles: vec![[0, 1, 2]],
                material: 7,
                ..Mesh::default()
            }],
            instances: vec![Instance { name: "a".into(), mesh: 3, transform: DAffine3::IDENTITY }],
            materials: vec![Material { emission: Rgb::grey(-1.0), ..Material::default() }],
            ..Scene::default()
        };
        let faults: Vec<String> = scene.validate().iter().map(|f| f.element.clone()).collect();
        assert_eq!(faults.iter().filter(|f| f.starts_with("mesh 0")).count(), 3);
        assert_eq!(faults.iter().filter(|f| f.starts_with("instance 0")).count(), 1);
        assert_eq!(faults.iter().filter(|f| f.starts_with("material 0")).count(), 1);
    }

    #[test]
    fn faults_of_lights_are_named() {
        let light = |kind, profile: Option<LightProfile>| PunctualLight {
            name: "l".into(),
            kind,
            intensity: Rgb::WHITE,
            transform: DAffine3::IDENTITY,
            profile: profile.map(Arc::new),
        };
        let profile = |vertical: &[f32], horizontal: &[f32], candela: &[f32]| {
            let (vertical, horizontal, candela) = (vertical.to_vec(), horizontal.to_vec(), candela.to_vec());
            Some(LightProfile { name: "p".into(), vertical, horizontal, candela })
        };
        let good = || profile(&[0.0, 90.0], &[0.0], &[1.0, 0.0]);
        let spot = |inner, outer| LightKind::Spot { inner, outer };
        let wrong = [
            (PunctualLight { intensity: Rgb::grey(-1.0), ..light(LightKind::Point, None) }, "intensity"),
            (light(spot(0.5, 0.5), None), "cones"),
            (light(spot(0.5, 2.0), None), "cones"),
            (light(LightKind::Directional, good()), "no point"),
            (light(LightKind::Point, profile(&[90.0, 0.0], &[0.0], &[1.0, 0.0])), "ascend"),
            (light(LightKind::Point, profile(&[0.0, 90.0], &[0.0, 90.0], &[1.0; 4])), "C = 0 to 90"),
            (light(LightKind::Point, profile(&[0.0, 90.0], &[0.0], &[1.0])), "candela"),
            (light(LightKind::Point, profile(&[0.0, 90.0], &[0.0], &[1.0, -1.0])), "candela"),
        ];
        for (light, word) in wrong {
            let faults = Scene { lights: vec![light], ..Scene::default() }.validate();
            assert!(faults.len() == 1 && faults[0].problem.contains(word), "{word}: {faults:?}");
        }
        let lights =
            vec![light(LightKind::Point, good()), light(spot(0.0, 1.5), None), light(LightKind::Directional, None)];
        assert_eq!(Scene { lights, ..Scene::default() }.validate(), []);
    }

    #[test]
    fn faults_of_environments_are_named() {
        let sky = Sky::natural(SkyModel::Preetham { turbidity: 2.5 }, Some([40.0, 90.0]));
        let map = |pixels: Vec<[f32; 3]>, strength| {
            let image = Arc::new(RadianceMap { name: "m".into(), width: 2, height: 1, pixels });
            Environment::Map(EnvironmentMap { image, rotation: 0.0, strength })
        };
        let low = Sky::natural(SkyModel::Clear, Some([-3.0, 90.0]));
        let wrong = [
            (Environment::Uniform(Rgb::grey(f64::NAN)), "radiance"),
            (map(vec![[1.0; 3]], 1.0), "size"),
            (map(vec![[1.0; 3]; 2], -1.0), "strength"),
            (map(vec![[1.0; 3], [f32::INFINITY; 3]], 1.0), "pixel (1, 0)"),
            (Environment::Sky(low), "below the horizon"),
            (Environment::Sky(Sky { model: SkyModel::Preetham { turbidity: 1.0 }, ..sky.clone() }), "turbidity"),
            (Environment::Sky(Sky { level: SkyLevel::Zenith(-1.0), ..sky.clone() }), "nit"),
            (Environment::Sky(Sky { ground: Rgb::grey(1.5), ..sky.clone() }), "albedo"),
            (Environment::Sky(Sky { sun: Some(Rgb::grey(f64::NAN)), ..sky.clone() }), "sunlight"),
            (Environment::Sky(Sky { towards_sun: 2.0 * sky.towards_sun, ..sky.clone() }), "unit vector"),
        ];
        for (environment, word) in wrong {
            let faults = Scene { environment: Some(environment), ..Scene::default() }.validate();
            assert!(faults.len() == 1 && faults[0].problem.contains(word), "{word}: {faults:?}");
        }
        for environment in [Environment::Sky(sky), map(vec![[0.0; 3]; 2], 0.0)] {
            assert_eq!(Scene { environment: Some(environment), ..Scene::default() }.validate(), []);
        }
    }

    /// A factor of 1 and a lobe of 0.5 are too much, unless the texture is dark.
    #[test]
    fn two_lobes_share_the_light_of_the_brightest_texel() {
        let texture = TextureRef { nearest: true, ..TextureRef::of(0) };
        let diffuse = Texel { factor: Rgb::WHITE, alpha: 1.0, texture: Some(texture) };
        let surface = Surface::Phong { diffuse, specular: Rgb::grey(0.5), exponent: 10.0 };
        for (byte, faults) in [(100u8, 0), (255, 1)] {
            let rgba = vec![byte, byte, byte, 255];
            let scene = Scene {
                images: vec![Arc::new(TextureImage { name: "t".into(), width: 1, height: 1, rgba })],
                materials: vec![Material { surface: surface.clone(), ..Material::default() }],
                ..Scene::default()
            };
            assert_eq!(scene.validate().len(), faults, "{:?}", scene.validate());
        }
    }

    #[test]
    fn built_in_scenes_have_no_faults() {
        for (name, _) in crate::builtin::NAMES {
            assert_eq!(crate::builtin::by_name(name).expect(name).validate(), [], "{name}");
        }
    }
}
