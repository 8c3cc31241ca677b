//! Reflectance brought below 1, so that every bounce takes light away and the solver's operator contracts.
//!
//! Files are full of 1.0: it is glTF's default. One warning names the materials concerned. Not here: the energy
//! of lobes. Called by both scene readers.

use twinray_scene::{Rgb, Texel};

use crate::context::Context;
use crate::texture::Pictures;
use crate::warning::name_list;

/// Clamps reflectances and remembers whose.
#[derive(Default)]
pub(crate) struct Clamp {
    names: Vec<String>,
}

impl Clamp {
    /// Brings `texel` into [0, `limit`] per channel. With a texture it is the factor that gives way, and only as
    /// far as the brightest texel demands.
    pub(crate) fn apply(&mut self, texel: &mut Texel, pictures: &Pictures, limit: f64, material: &str) {
        let brightest = texel.texture.as_ref().map_or([1.0; 3], |t| pictures.brightest(t.image));
        let clamped = std::array::from_fn(|c| {
            let allowed = if brightest[c] > 0.0 { limit / brightest[c] } else { f64::INFINITY };
            // A factor above 1 is outside every format's range, however dark the texture.
            texel.factor[c].clamp(0.0, allowed.min(1.0))
        });
        let clamped = Rgb::from_array(clamped);
        if clamped != texel.factor {
            self.note(material);
        }
        texel.factor = clamped;
    }

    /// Remembers that `material` had to be changed.
    pub(crate) fn note(&mut self, material: &str) {
        if self.names.last().is_none_or(|last| last != material) {
            self.names.push(material.to_owned());
        }
    }

    /// The one warning.
    pub(crate) fn report(self, context: &mut Context<'_>) {
        if self.names.is_empty() {
            return;
        }
        let (count, limit) = (self.names.len(), context.limits.max_reflectance);
        let of = if count == 1 { "1 material".to_owned() } else { format!("{count} materials") };
        let message = format!("reflectance of {of} brought down to {limit}: {}", name_list(&self.names));
        context.sum_up("materials", message);
    }
}
