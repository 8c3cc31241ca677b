//! Lights without area: `KHR_lights_punctual` and `EXT_lights_ies`. No fault here ends the reading: each is a warning, and
//! the light is left out.
//!
//! Intensities are as the file has them: cd, and lx of directional lights. `range`, which cuts light off, is not read.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

use twinray_scene::{LightKind, LightProfile, PunctualLight, Rgb};

use super::container::Buffers;
use super::json::Element;
use super::node::Placed;
use crate::context::Context;
use crate::error::FormatError;
use crate::ies::read_ies;
use crate::reference::{data_uri, percent_decode};

/// Memory of a light beside its name.
const LIGHT_BYTES: u64 = 2 * size_of::<PunctualLight>() as u64;

/// Reads lights, and profiles once each.
#[derive(Default)]
pub(super) struct Lights {
    profiles: HashMap<usize, Option<Arc<LightProfile>>>,
}

impl Lights {
    /// The lights that stand at a node.
    pub(super) fn at(
        &mut self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        buffers: &Buffers<'_>,
        place: &Placed<'_>,
    ) -> Result<Vec<PunctualLight>, FormatError> {
        let mut lights = Vec::new();
        if let Some(link) = place.node.extension("KHR_lights_punctual") {
            let light = punctual(context, root, place, &link);
            lights.extend(kept(context, place, light));
        }
        if let Some(link) = place.node.extension("EXT_lights_ies") {
            let light = self.measured(context, root, buffers, place, &link);
            lights.extend(kept(context, place, light));
        }
        for light in &lights {
            context.charge(LIGHT_BYTES + light.name.len() as u64, &place.node.path)?;
        }
        Ok(lights)
    }

    fn measured(
        &mut self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        buffers: &Buffers<'_>,
        place: &Placed<'_>,
        link: &Element<'_>,
    ) -> Result<PunctualLight, FormatError> {
        let extension = root.extension("EXT_lights_ies");
        let extension =
            extension.ok_or_else(|| link.fault("no list of profiles", "extensions.EXT_lights_ies.lights"))?;
        let link_to = link.require("light", "the index of a light profile")?;
        let (index, element) = link_to.as_link(&extension, "lights")?;
        let known = self.profiles.entry(index).or_insert_with(|| {
            let read = profile(context, root, buffers, &element);
            if let Err(error) = &read {
                context.warn(&element.path, format!("the profile cannot be used: {error}"));
            }
            read.ok().map(Arc::new)
        });
        let Some(profile) = known.clone() else {
            return Err(link_to.fault("a profile that cannot be used", "a sound one"));
        };
        let multiplier = link.number("multiplier")?.unwrap_or(1.0);
        let name = place.node.name_or(|| element.name_or(|| format!("light profile {index}")));
        Ok(PunctualLight {
            name,
            kind: LightKind::Point,
            intensity: colour(link)? * multiplier,
            transform: place.to_world,
            profile: Some(profile),
        })
    }
}

fn punctual(
    context: &mut Context<'_>,
    root: &Element<'_>,
    place: &Placed<'_>,
    link: &Element<'_>,
) -> Result<PunctualLight, FormatError> {
    let extension = root.extension("KHR_lights_punctual");
    let extension =
        extension.ok_or_else(|| link.fault("no list of lights", "extensions.KHR_lights_punctual.lights"))?;
    let (index, light) = link.require("light", "the index of a light")?.as_link(&extension, "lights")?;
    let kind = match light.text("type")? {
        Some("point") => LightKind::Point,
        Some("directional") => LightKind::Directional,
        Some("spot") => spot(context, &light)?,
        _ => return Err(light.fault("no known type", "\"point\", \"spot\" or \"directional\"")),
    };
    if light.get("range").is_some() {
        context.warn(&light.path, "its range is ignored: light falls off with the square of the distance, without end");
    }
    let intensity = colour(&light)? * light.number("intensity")?.unwrap_or(1.0);
    // Exporters give lights the author's names, and nodes others.
    let name = light.name_or(|| place.node.name_or(|| format!("light {index}")));
    Ok(PunctualLight { name, kind, intensity, transform: place.to_world, profile: None })
}

fn spot(context: &mut Context<'_>, light: &Element<'_>) -> Result<LightKind, FormatError> {
    let Some(spot) = light.get("spot") else { return Err(light.fault("no cones", "an object \"spot\"")) };
    let mut inner = spot.number("innerConeAngle")?.unwrap_or(0.0);
    let mut outer = spot.number("outerConeAngle")?.unwrap_or(FRAC_PI_4);
    if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6) {
        let found = format!("cones of {inner} and {outer}");
        outer = outer.clamp(1e-3, FRAC_PI_2);
        inner = inner.clamp(0.0, 0.999 * outer);
        let message = format!("{found} are taken as {inner} and {outer}: 0 ≤ inner < outer ≤ π/2 is expected");
        context.warn(&spot.path, message);
    }
    // A hard edge is a ramp of no width, which no number can tell.
    Ok(LightKind::Spot { inner: inner.min(0.9999 * outer), outer: outer.min(FRAC_PI_2) })
}

fn colour(element: &Element<'_>) -> Result<Rgb, FormatError> {
    Ok(Rgb::from_array(element.numbers::<3>("color")?.unwrap_or([1.0; 3])))
}

/// The light, if it can be used; a warning otherwise.
fn kept(
    context: &mut Context<'_>,
    place: &Placed<'_>,
    light: Result<PunctualLight, FormatError>,
) -> Option<PunctualLight> {
    let path = &place.node.path;
    let light = match light {
        Ok(light) => light,
        Err(error) => {
            context.warn(path, format!("the light is ignored: {}", error.without_place()));
            return None;
        }
    };
    let (intensity, most) = (light.intensity, context.limits.max_radiance);
    if !(intensity.min_channel() >= 0.0 && intensity.max_channel() <= most) {
        let message = format!(
            "light \"{}\" is ignored: intensity {:?}, expected 0 to {most:e}",
            light.name,
            intensity.to_array()
        );
        context.warn(path, message);
        return None;
    }
    let limit = context.limits.max_coordinate;
    if !light.transform.is_finite() || light.transform.translation.abs().max_element() > limit {
        context.warn(path, format!("light \"{}\" is ignored: it stands farther away than {limit:e}", light.name));
        return None;
    }
    Some(light)
}

fn profile(
    context: &mut Context<'_>,
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    element: &Element<'_>,
) -> Result<LightProfile, FormatError> {
    let file = context.file;
    let read = |context: &mut Context<'_>, name: &str, bytes: &[u8]| {
        let profile = read_ies(name, bytes, context.limits)?;
        let numbers = profile.candela.len() + profile.vertical.len() + profile.horizontal.len();
        context.charge(4 * numbers as u64, &element.path)?;
        Ok(profile)
    };
    let name = format!("{file}: {}", element.path);
    match element.text("uri")? {
        Some(uri) => match data_uri(uri) {
            Some(Ok(bytes)) => read(context, &name, &bytes),
            Some(Err(detail)) => Err(element.fault(detail, "base64 data")),
            None => {
                let path = percent_decode(uri);
                let bytes = context.fetch(&element.path, &path)?;
                read(context, &path, &bytes)
            }
        },
        None => match buffers.view(root, element)? {
            Some(view) => read(context, &name, view.bytes),
            None => Err(element.fault("neither uri nor bufferView", "one of them")),
        },
    }
}
