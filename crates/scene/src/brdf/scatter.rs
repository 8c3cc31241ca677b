//! All that a surface does with light: its BRDF beside what goes on sharply.
//!
//! How narrow a lobe may be for a BRDF depends on who asks: patches cannot hold narrow lobes, pictures can.

use super::{Brdf, MIN_ALPHA, Specular};
use crate::authored::Volume;
use crate::rgb::Rgb;

/// Who asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The solver: lobes of roughness below 0.1 are mirrors, others no narrower than [`MIN_ALPHA`].
    Patches,
    /// A picture: lobes as they are, mirrors below a roughness of 0.02.
    Picture,
}

impl Detail {
    /// α below which a lobe is a mirror's.
    fn mirror(self) -> f64 {
        match self {
            Detail::Patches => 0.1 * 0.1,
            Detail::Picture => 0.02 * 0.02,
        }
    }

    /// The narrowest lobe that is none.
    fn least(self) -> f64 {
        match self {
            Detail::Patches => MIN_ALPHA,
            Detail::Picture => 0.02 * 0.02,
        }
    }
}

/// A BRDF, and what goes on.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// What scatters.
    pub brdf: Brdf,
    /// What is reflected as by a mirror, or passes; `None` for most surfaces.
    pub specular: Option<Specular>,
}

/// What passes a surface.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// The share of the base that transmits, in [0, 1].
    pub share: f64,
    /// Colour of what passes.
    pub color: Rgb,
    /// Index of refraction.
    pub ior: f64,
    /// What the surface encloses.
    pub volume: Option<Volume>,
}

impl Scatter {
    /// A BRDF of any narrowness, of whose base a part may transmit.
    pub fn new(brdf: Brdf, passing: Option<Passing>, detail: Detail) -> Self {
        let share = passing.map_or(0.0, |p| p.share);
        let alpha = match brdf {
            Brdf::Lambertian { .. } => 0.0,
            Brdf::Ggx(g) => g.alpha(),
            Brdf::Phong(p) => p.alpha(),
        };
        let is_sharp = alpha < detail.mirror();
        let brdf = match brdf {
            Brdf::Lambertian { reflectance } => Brdf::Lambertian { reflectance: reflectance * (1.0 - share) },
            Brdf::Ggx(g) if is_sharp => Brdf::Ggx(g.without(share).sharp()),
            Brdf::Ggx(g) => Brdf::Ggx(g.without(share).at_least(detail.least())),
            Brdf::Phong(p) if is_sharp => Brdf::Phong(p.without(share).sharp()),
            Brdf::Phong(p) => Brdf::Phong(p.without(share).at_least(detail.least())),
        };
        let mirror = match brdf {
            Brdf::Ggx(g) if is_sharp => g.fresnel(),
            Brdf::Phong(p) if is_sharp => [p.reflectance(); 2],
            _ => [Rgb::BLACK; 2],
        };
        if share <= 0.0 && mirror.iter().all(|m| m.is_black()) {
            return Self { brdf, specular: None };
        }
        let coat = if let Brdf::Ggx(g) = brdf { Some(g) } else { None };
        let specular = Specular {
            mirror,
            coat,
            transmittance: passing.map_or(Rgb::BLACK, |p| p.color * p.share),
            ior: passing.map_or(1.5, |p| p.ior.max(1.0)),
            volume: passing.and_then(|p| p.volume),
            alpha: if is_sharp { 0.0 } else { alpha },
        };
        Self { brdf, specular: Some(specular) }
    }
}
