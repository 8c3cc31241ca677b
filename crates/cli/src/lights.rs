//! Light from the command line: environment maps, skies, profiles of luminaires, units of a file's lights.
//!
//! What the user asks for becomes [`LightSettings`], which a solution file keeps in words, so that it can be lit again in
//! the same way. Files are read here, within the limits of the scene's.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use clap::ValueEnum;
use twinray::format::{self, Limits};
use twinray::scene::environment::solar;
use twinray::scene::{Environment, EnvironmentMap, LightKind, PunctualLight, Rgb, Scene, Sky, SkyLevel, SkyModel};

use crate::files;
use crate::light_args::{LightArgs, SkyArg, UnitsArg};

/// lm/W of Blender's exporter, and of white light as older versions had it.
const EFFICACY: [f64; 2] = [683.0, 177.83];
/// Punctual lights that give so many times the light of all surfaces, or so little, look as if units were mixed up.
const SUSPICIOUS: f64 = 150.0;
/// No sun is as dim, lx: an engine without units may call it 1 or π.
const DIM_SUN: f64 = 50.0;

/// How a scene is lit beside what its file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSettings {
    /// File, turn (degrees) and strength of a map.
    env: Option<(String, f64, f64)>,
    sky: Option<SkySettings>,
    /// Name of a light and file of its profile.
    ies: Vec<(String, String)>,
    units: UnitsArg,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct SkySettings {
    model: SkyArg,
    /// Elevation and azimuth, degrees.
    sun: Option<[f64; 2]>,
    turbidity: f64,
    lux: Option<f64>,
    /// False if the sun's disc is left out.
    disc: bool,
}

impl LightSettings {
    /// What the command line asks for.
    pub fn new(args: &LightArgs) -> anyhow::Result<Self> {
        let sun = match (args.sun, args.when, args.place) {
            (Some(sun), ..) => Some(sun),
            (None, Some(moment), Some([latitude, longitude])) => Some(solar::position(moment.0, latitude, longitude)),
            _ => None,
        };
        let sky = match (args.sky, sun) {
            (None, None) => None,
            (model, sun) => {
                let model = model.unwrap_or(SkyArg::Preetham);
                let turbidity = args.turbidity.unwrap_or(2.5);
                Some(SkySettings { model, sun, turbidity, lux: args.sky_lux, disc: !args.no_sun })
            }
        };
        if sky.is_none() && (args.turbidity.is_some() || args.sky_lux.is_some() || args.no_sun) {
            bail!("--turbidity, --sky-lux and --no-sun are about a sky: add --sky, --sun, or --when and --where");
        }
        if let Some(sky) = &sky {
            sky.check()?;
        }
        let env = args
            .env
            .clone()
            .map(|file| (file, args.env_rotation.unwrap_or_default(), args.env_strength.unwrap_or(1.0)));
        Ok(Self {
            env,
            sky,
            ies: args.ies.iter().map(|l| (l.0.clone(), l.1.clone())).collect(),
            units: args.units.unwrap_or_default(),
        })
    }

    /// As a solution file keeps them; files as `place` names them.
    pub fn words(&self, place: impl Fn(&str) -> String) -> Vec<(String, String)> {
        let mut words: Vec<(&str, String)> = Vec::new();
        if let Some((file, rotation, strength)) = &self.env {
            words.push(("env", place(file)));
            words.push(("env-rotation", rotation.to_string()));
            words.push(("env-strength", strength.to_string()));
        }
        if let Some(sky) = &self.sky {
            words.push(("sky", word(sky.model)));
            words.extend(sky.sun.map(|[elevation, azimuth]| ("sun", format!("{elevation},{azimuth}"))));
            words.push(("turbidity", sky.turbidity.to_string()));
            words.extend(sky.lux.map(|lux| ("sky-lux", lux.to_string())));
            words.extend((!sky.disc).then(|| ("no-sun", String::new())));
        }
        words.extend(self.ies.iter().map(|(light, file)| ("ies", format!("{light}={}", place(file)))));
        if self.units != UnitsArg::Auto {
            words.push(("units", word(self.units)));
        }
        words.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// From what a solution file keeps.
    pub fn from_words(name: &str, words: &[(String, String)], place: impl Fn(&str) -> String) -> anyhow::Result<Self> {
        let mut settings = Self::default();
        for (key, value) in words {
            let unknown = || {
                anyhow!(
                    "{name}: is lit by {key} \"{value}\", which this twinray does not know: use the one that wrote it"
                )
            };
            let number = || value.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(unknown);
            let sky = |settings: &mut Self| settings.sky.ok_or_else(unknown);
            match key.as_str() {
                "env" => settings.env = Some((place(value), 0.0, 1.0)),
                "env-rotation" => settings.env.as_mut().ok_or_else(unknown)?.1 = number()?,
                "env-strength" => settings.env.as_mut().ok_or_else(unknown)?.2 = number()?,
                "sky" => {
                    let model = SkyArg::from_str(value, false).map_err(|_| unknown())?;
                    settings.sky = Some(SkySettings { model, sun: None, turbidity: 2.5, lux: None, disc: true });
                }
                "sun" => {
                    let pair = value.split_once(',').and_then(|(e, a)| Some([e.parse().ok()?, a.parse().ok()?]));
                    settings.sky = Some(SkySettings { sun: Some(pair.ok_or_else(unknown)?), ..sky(&mut settings)? });
                }
                "turbidity" => settings.sky = Some(SkySettings { turbidity: number()?, ..sky(&mut settings)? }),
                "sky-lux" => settings.sky = Some(SkySettings { lux: Some(number()?), ..sky(&mut settings)? }),
                "no-sun" => settings.sky = Some(SkySettings { disc: false, ..sky(&mut settings)? }),
                "ies" => {
                    let (light, file) = value.split_once('=').ok_or_else(unknown)?;
                    settings.ies.push((light.to_owned(), place(file)));
                }
                "units" => settings.units = UnitsArg::from_str(value, false).map_err(|_| unknown())?,
                _ => return Err(unknown()),
            }
        }
        if let Some(sky) = &settings.sky {
            sky.check().with_context(|| format!("{name}: is lit by a sky that makes no sense"))?;
        }
        Ok(settings)
    }

    /// These settings where the command line repeats them, with files where it says that they are now.
    ///
    /// # Errors
    /// If it contradicts them: names the option.
    pub fn repeated(mut self, wish: &Self) -> Result<Self, &'static str> {
        match (&mut self.env, &wish.env) {
            (_, None) => {}
            (Some(own), Some(wish)) if own.1 == wish.1 && own.2 == wish.2 => own.0.clone_from(&wish.0),
            _ => return Err("--env"),
        }
        if wish.sky.is_some() && wish.sky != self.sky {
            return Err("--sky or --sun");
        }
        if !wish.ies.is_empty() {
            let names = |ies: &[(String, String)]| ies.iter().map(|(light, _)| light.clone()).collect::<Vec<_>>();
            if names(&self.ies) != names(&wish.ies) {
                return Err("--ies");
            }
            self.ies.clone_from(&wish.ies);
        }
        if wish.units != UnitsArg::Auto && wish.units != self.units {
            return Err("--units");
        }
        Ok(self)
    }

    /// Lights the scene; answers with what is worth a warning. Files may be as large as `limits` allow.
    pub fn apply(&self, scene: &mut Scene, limits: &Limits) -> anyhow::Result<Vec<String>> {
        let mut warnings = Vec::new();
        for (light, file) in &self.ies {
            let bytes = files::read(Path::new(file), limits.max_file_bytes).with_context(|| unreadable(file))?;
            let profile = Arc::new(format::read_ies(file, &bytes, limits).map_err(|e| anyhow!("{e}"))?);
            for light in named(scene, light)? {
                // The file's intensities, in the light's colour.
                let luminance = light.intensity.luminance();
                light.intensity = if luminance > 0.0 { light.intensity / luminance } else { Rgb::WHITE };
                light.kind = LightKind::Point;
                light.profile = Some(profile.clone());
            }
        }
        self.units.apply(&mut scene.lights);
        if let Some((file, rotation, strength)) = &self.env {
            let bytes = files::read(Path::new(file), limits.max_file_bytes).with_context(|| unreadable(file))?;
            let (map, notes) = format::read_radiance_map(file, &bytes, limits).map_err(|e| anyhow!("{e}"))?;
            warnings.extend(notes.iter().map(ToString::to_string));
            let (image, rotation) = (Arc::new(map), rotation.to_radians());
            scene.environment = Some(Environment::Map(EnvironmentMap { image, rotation, strength: *strength }));
        }
        if let Some(sky) = &self.sky {
            scene.environment = Some(Environment::Sky(sky.sky()));
        }
        if self.units == UnitsArg::Auto {
            warnings.extend(suspicion(scene));
        }
        if let Some(fault) = scene.validate().first() {
            bail!("{}: {fault}", scene.name);
        }
        Ok(warnings)
    }
}

impl SkySettings {
    fn check(&self) -> anyhow::Result<()> {
        let needs_sun = matches!(self.model, SkyArg::Clear | SkyArg::Preetham);
        match self.sun {
            None if needs_sun => {
                bail!(
                    "--sky {}: where is the sun? Add --sun ELEVATION,AZIMUTH, or --when and --where",
                    word(self.model)
                )
            }
            Some([elevation, _]) if elevation <= 0.0 && needs_sun => bail!(
                "the sun is at {elevation:.2}°, below the horizon: expected above; --sky overcast does without it, or choose another time"
            ),
            _ => Ok(()),
        }
    }

    fn sky(&self) -> Sky {
        let model = match self.model {
            SkyArg::Uniform => SkyModel::Uniform,
            SkyArg::Overcast => SkyModel::Overcast,
            SkyArg::Clear => SkyModel::Clear,
            SkyArg::Preetham => SkyModel::Preetham { turbidity: self.turbidity },
        };
        let natural = Sky::natural(model, self.sun);
        let level = self.lux.map_or(natural.level, SkyLevel::Horizontal);
        Sky { level, sun: natural.sun.filter(|_| self.disc), ..natural }
    }
}

impl UnitsArg {
    /// Brings intensities to the unit that surfaces have.
    fn apply(self, lights: &mut [PunctualLight]) {
        for light in lights.iter_mut().filter(|light| light.profile.is_none()) {
            let per_sphere = if light.kind == LightKind::Directional { 1.0 } else { 4.0 * PI };
            light.intensity = match self {
                UnitsArg::Auto | UnitsArg::Si => light.intensity,
                UnitsArg::Blender683 => light.intensity / EFFICACY[0],
                UnitsArg::Blender177 => light.intensity / EFFICACY[1],
                UnitsArg::Unitless => light.intensity / per_sphere,
            };
        }
    }
}

/// All lights of that name.
fn named<'a>(scene: &'a mut Scene, name: &str) -> anyhow::Result<Vec<&'a mut PunctualLight>> {
    let names: Vec<String> = scene.lights.iter().map(|light| format!("\"{}\"", light.name)).collect();
    let found: Vec<_> = scene.lights.iter_mut().filter(|light| light.name == name).collect();
    if found.is_empty() {
        let there = if names.is_empty() { "no lights without area".to_owned() } else { names.join(", ") };
        bail!("--ies {name}: no such light; the scene has {there}");
    }
    if found.iter().any(|light| light.kind == LightKind::Directional) {
        bail!("--ies {name}: is a directional light, which has no place; expected a point or spot light");
    }
    Ok(found)
}

/// Numbers that look as if units were mixed up.
fn suspicion(scene: &Scene) -> Option<String> {
    let power = |light: &PunctualLight| match (light.kind, &light.profile) {
        (_, Some(profile)) => light.intensity.luminance() * profile.flux(),
        (LightKind::Directional, _) => 0.0,
        (LightKind::Point, _) => 4.0 * PI * light.intensity.luminance(),
        (LightKind::Spot { outer, .. }, _) => 2.0 * PI * (1.0 - outer.cos()) * light.intensity.luminance(),
    };
    let lights: f64 = scene.lights.iter().map(power).sum();
    let surfaces: f64 = scene.instances.iter().map(|i| emitted(scene, i)).sum();
    let ratio = lights / surfaces;
    let hint = "--units blender-683 or blender-177 divides them by the exporter's lumens per watt, --units si takes all as it is";
    if lights > 0.0 && surfaces > 0.0 && ratio > SUSPICIOUS {
        return Some(format!(
            "point and spot lights give {ratio:.0} times the light of all emitting surfaces, as if they were in lumens and surfaces in watts: {hint}"
        ));
    }
    if lights > 0.0 && surfaces > 0.0 && ratio < 1.0 / SUSPICIOUS {
        return Some(format!(
            "emitting surfaces give {:.0} times the light of all point and spot lights, as if these had no unit; --units si takes all as it is",
            1.0 / ratio
        ));
    }
    let sun = scene.lights.iter().filter(|l| l.kind == LightKind::Directional);
    let sun = sun.map(|light| light.intensity.luminance()).fold(0.0, f64::max);
    let near = scene.lights.iter().any(|light| light.kind != LightKind::Directional && power(light) > 100.0);
    (sun > 0.0 && sun < DIM_SUN && near).then(|| {
        format!(
            "a directional light gives {sun:.2} lx, less than a street lamp, beside others of hundreds of lumens: a sun without unit (often 1 or π)? Real ones give 100 000 lx; --units si takes it as it is"
        )
    })
}

/// Σ π L A of an instance, luminance.
fn emitted(scene: &Scene, instance: &twinray::scene::Instance) -> f64 {
    let mesh = &scene.meshes[instance.mesh];
    let radiance = scene.materials[mesh.material].emission.luminance();
    if radiance == 0.0 {
        return 0.0;
    }
    let place = |k: u32| instance.transform.transform_point3(glam::Vec3::from(mesh.positions[k as usize]).as_dvec3());
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(place);
        0.5 * (b - a).cross(c - a).length()
    };
    PI * radiance * mesh.triangles.iter().map(area).sum::<f64>()
}

fn unreadable(file: &str) -> String {
    format!("{file}: cannot be read")
}

/// An option's value as the user writes it.
fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        light: LightArgs,
    }

    fn settings(line: &str) -> anyhow::Result<LightSettings> {
        let words = std::iter::once("x").chain(line.split_whitespace());
        LightSettings::new(&Line::try_parse_from(words)?.light)
    }

    #[test]
    fn words_hold_all_of_it() {
        for line in [
            "",
            "--env a.hdr",
            "--env a.hdr --env-rotation -33.3 --env-strength 0.1",
            "--sky overcast",
            "--sun 30.1,200.7 --turbidity 3 --no-sun",
            "--sky clear --when 2026-06-21T12:00+02:00 --where 52.5,13.4 --sky-lux 9000",
            "--ies a=b.ies --ies c=d=e.ies --units blender-683",
        ] {
            let settings = settings(line).unwrap();
            let words = settings.words(|file| format!("<{file}"));
            let again = LightSettings::from_words("x", &words, |file| file[1..].to_owned()).unwrap();
            assert_eq!(again, settings, "{line}: {words:?}");
        }
        let words = [("moon".to_owned(), "1".to_owned())];
        assert!(LightSettings::from_words("x.twin", &words, str::to_owned).unwrap_err().to_string().contains("moon"));
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for (line, words) in [
            ("--sky clear", "where is the sun"),
            ("--sun -3,100", "below the horizon"),
            ("--when 2026-01-01T00:00Z --where 52,13", "below the horizon"),
            ("--turbidity 3", "add --sky"),
        ] {
            let error = settings(line).unwrap_err().to_string();
            assert!(error.contains(words), "{line}: {error}");
        }
        // Under clouds there may be night.
        assert!(settings("--sky overcast --sun -3,100").is_ok());
    }

    #[test]
    fn repeating_is_allowed_and_contradicting_is_not() {
        let stored = || settings("--env a.hdr --env-rotation 10 --ies l=a.ies").unwrap();
        let again = |line: &str| stored().repeated(&settings(line).unwrap());
        assert_eq!(again(""), Ok(stored()));
        assert_eq!(again("--env b.hdr --env-rotation 10").unwrap().env.unwrap().0, "b.hdr");
        assert_eq!(again("--ies l=b.ies").unwrap().ies[0].1, "b.ies");
        for (line, option) in [
            ("--env a.hdr", "--env"),
            ("--ies k=a.ies", "--ies"),
            ("--sky overcast", "--sky or --sun"),
            ("--units si", "--units"),
        ] {
            assert_eq!(again(line).err(), Some(option));
        }
    }
}
