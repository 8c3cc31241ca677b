//! The state that a wave of rays starts from: every patch's outgoing light, frozen, and the choice among patches.
//!
//! The strategies are one density (shares sum to 1): at patches
//! λ_i(ω) = power · q_i(ω)/P + lamps · 𝓛(E_i)/P_E + area/(π A_total) + patches · w_i/(π A_i),
//! and λ_env(ω) = environment · pdf_line(ω) at the sky, so one formula of the balance heuristic covers them. Lights without
//! area are chosen by their power; no other ray finds them. The choice
//! is one sweep along the patches: a sum per four patches is kept, and rays come in order of their first number.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::geom::Frame;
use twinray_scene::sample::warp;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::glossy::GlossyPatches;
use crate::params::Representation;
use crate::patch_radiance::{Directional, Outgoing, stand_in};
use crate::select::Table;
use crate::source::{PackedRepresentative, Source};
use crate::strategies::{STRATEGIES, Shares};
use crate::transfer::Endpoint;

/// Patches of one entry of the table.
const BLOCK: usize = 4;
/// Patches of one parallel task: a multiple of [`BLOCK`].
const TASK: usize = 1 << 12;

/// Bytes of the table per patch.
pub(crate) const BYTES_PER_PATCH: usize = size_of::<f64>() / BLOCK;
/// Bytes of a glossy patch beside that.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize = size_of::<StandIn>();

/// What is derived from the sources for a wave; memory that waves take turns to use.
#[derive(Debug, Default)]
pub(crate) struct FrozenTables {
    /// Running sum of the patches' weights, after every [`BLOCK`].
    cumulative: Vec<f64>,
    /// Per glossy patch.
    stand_ins: Vec<StandIn>,
    /// Lights without area, by their power.
    lights: Table,
}

/// The non-negative stand-in of a glossy patch: coefficient of its cosine part, power of its lobe part.
#[derive(Clone, Copy, Debug, Default)]
struct StandIn {
    cosine: f32,
    lobe: f32,
}

/// A frozen state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frozen<'a> {
    start: Start<'a>,
    stand_ins: &'a [StandIn],
    cumulative: &'a [f64],
    lights: &'a Table,
    /// 𝓛 of the power of all patches' stand-ins, W.
    power: f64,
    coefficients: Coefficients,
}

/// The shares over what normalises them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coefficients {
    per_power: f64,
    per_lamp_power: f64,
    area: f64,
    patches: f64,
    environment: f64,
    points: f64,
    /// Of the points, over 𝓛 of the power of all of them.
    per_light_power: f64,
}

/// Where a ray starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// On a patch.
    Patch(PatchId),
    /// In the environment.
    Sky,
    /// At a light without area, by its number.
    Light(usize),
    /// Nowhere: nothing has a weight.
    Nothing,
}

/// What a wave is frozen from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start<'a> {
    pub scene: &'a PatchScene,
    pub glossy: &'a GlossyPatches,
    pub sources: &'a [Source],
    /// Empty if directional parts are not to be shot.
    pub representatives: &'a [PackedRepresentative],
    pub representation: Representation,
    /// Whether the sources hold the patches' emission.
    pub emits: bool,
    /// 𝓛 of the power that patches emit, W.
    pub lamp_power: f64,
    /// 𝓛 of the power of the lights without area, W.
    pub light_power: f64,
    pub total_area: f64,
}

impl<'a> Frozen<'a> {
    /// Fills the tables for a wave with these shares; what has no power gives its share to the gather. O(K).
    pub(crate) fn new(start: Start<'a>, shares: Shares, tables: &'a mut FrozenTables) -> Self {
        let FrozenTables { cumulative, stand_ins, lights } = tables;
        let power = fill_stand_ins(&start, stand_ins);
        let coefficients = Coefficients::new(&start, shares, power);
        lights.fill(start.scene.lights().iter().map(|light| light.power().luminance()));
        let mut this = Self { start, stand_ins, cumulative: &[], lights, power, coefficients };
        cumulative.resize(start.sources.len().div_ceil(BLOCK), 0.0);
        cumulative.par_iter_mut().enumerate().with_min_len(TASK / BLOCK).for_each(|(block, sum)| {
            *sum = this.block(block).map(|p| this.weight(p)).sum();
        });
        let mut sum = 0.0;
        for entry in cumulative.iter_mut() {
            sum += *entry;
            *entry = sum;
        }
        this.cumulative = cumulative;
        this
    }

    /// Luminance of the power that all patches send out, W.
    pub(crate) fn power(&self) -> f64 {
        self.power
    }

    /// Whether the sources hold the patches' emission.
    pub(crate) fn emits(&self) -> bool {
        self.start.emits
    }

    /// True if the patch itself emits, in this state.
    #[inline]
    pub(crate) fn is_lamp(&self, patch: PatchId) -> bool {
        self.start.emits && self.start.sources[patch.index()].emits()
    }

    /// The largest deposit that one ray can leave: radiance over the smallest density beside it, which is the sum of what
    /// the strategies give; any of them bounds it alone.
    ///
    /// A channel is at most 1/0.0722 of the luminance; a lobe's radiance may exceed its stand-in by the ratio of
    /// Fresnel terms, at most about 1/0.02.
    pub(crate) fn largest_deposit(&self) -> f64 {
        let channel = 14.0;
        let lobes = if self.stand_ins.is_empty() { 1.0 } else { 64.0 };
        let c = &self.coefficients;
        let by_power = if c.per_power > 0.0 { 1.0 / c.per_power } else { f64::INFINITY };
        let bounds = || {
            // Lobes are brighter than the mean; rays by the lamps alone have a lamp at one end.
            let extremes = Extremes::of(&self.start, self.stand_ins);
            let by = |density: f64| if density > 0.0 { extremes.brightest / density } else { f64::INFINITY };
            by(c.area).min(by(c.patches * extremes.least_gather)).min(by(c.per_lamp_power * extremes.dimmest_lamp))
        };
        let by_patches = channel * lobes * if by_power.is_finite() { by_power } else { bounds() };
        let by_sky = match self.start.scene.environment() {
            Some(e) if c.environment > 0.0 => channel * e.largest_power() / c.environment,
            _ => 0.0,
        };
        let by_lights = self.start.scene.lights().iter().map(|light| {
            let probability = c.per_light_power * light.power().luminance();
            if probability > 0.0 { channel * light.largest_carried() / probability } else { 0.0 }
        });
        let beside = by_lights.fold(by_sky, f64::max);
        let largest = if by_patches.is_finite() { by_patches.max(beside) } else { beside };
        largest * self.start.scene.largest_factor()
    }

    /// What a patch sends towards `wo`, and the density with which rays start there.
    #[inline]
    pub(crate) fn endpoint(&self, patch: PatchId, wo: DVec3) -> Endpoint {
        if self.start.representatives.is_empty() || self.start.glossy.number_of(patch).is_none() {
            let source = &self.start.sources[patch.index()];
            let radiance = source.radiance();
            return Endpoint { radiance, density: self.cosine_density(patch, source, radiance.luminance()) };
        }
        self.outgoing(patch).endpoint(self.start.scene.normal(patch), wo)
    }

    /// A direction in which a ray leaves a patch, with density ∝ λ(ω) cosθ; `None` where it falls below the horizon.
    #[inline]
    pub(crate) fn sample(&self, patch: PatchId, n: DVec3, u: [f64; 2]) -> Option<DVec3> {
        if self.start.representatives.is_empty() || self.start.glossy.number_of(patch).is_none() {
            return Some(Frame::from_normal(n).to_world(warp::cosine_hemisphere(u)));
        }
        self.outgoing(patch).sample(n, u)
    }

    /// Outgoing light of a patch.
    #[inline]
    fn outgoing(&self, patch: PatchId) -> Outgoing {
        let source = &self.start.sources[patch.index()];
        let constant = source.radiance();
        let number = match self.start.representatives {
            [] => None,
            _ => self.start.glossy.number_of(patch),
        };
        let Some(k) = number else {
            let cosine_density = self.cosine_density(patch, source, constant.luminance());
            return Outgoing { constant, directional: None, cosine_density, lobe_density: 0.0 };
        };
        let stand_in = self.stand_ins[k];
        Outgoing {
            constant,
            directional: self.start.directional(patch, k),
            cosine_density: self.cosine_density(patch, source, f64::from(stand_in.cosine)),
            lobe_density: self.coefficients.per_power * f64::from(stand_in.lobe),
        }
    }

    /// The part of λ that is the same in every direction, for a stand-in radiance of luminance `cosine`.
    #[inline]
    fn cosine_density(&self, patch: PatchId, source: &Source, cosine: f64) -> f64 {
        let c = &self.coefficients;
        let mut density = c.per_power * cosine + c.area + c.patches * source.gather();
        if c.per_lamp_power > 0.0 && source.emits() {
            density += c.per_lamp_power * self.start.scene.emission(patch).luminance();
        }
        density
    }

    /// λ of each strategy alone at a patch, shares included, in the order of [`Shares::to_array`]; `density` is all of
    /// them together.
    #[inline]
    pub(crate) fn parts(&self, patch: PatchId, density: f64) -> [f64; STRATEGIES] {
        let c = &self.coefficients;
        let source = &self.start.sources[patch.index()];
        let lamps = if c.per_lamp_power > 0.0 && source.emits() {
            c.per_lamp_power * self.start.scene.emission(patch).luminance()
        } else {
            0.0
        };
        let patches = c.patches * source.gather();
        // What is left of a density without power is a rounding, of either sign.
        let power = if c.per_power > 0.0 { (density - lamps - c.area - patches).max(0.0) } else { 0.0 };
        [power, lamps, c.area, patches, 0.0, 0.0]
    }

    /// Probability with which a patch is chosen, but for the rounding of all of them.
    #[inline]
    fn weight(&self, patch: PatchId) -> f64 {
        let source = &self.start.sources[patch.index()];
        let (cosine, lobe) = match self.start.representatives {
            [] => (source.radiance().luminance(), 0.0),
            _ => match self.start.glossy.number_of(patch) {
                Some(k) => (f64::from(self.stand_ins[k].cosine), f64::from(self.stand_ins[k].lobe)),
                None => (source.radiance().luminance(), 0.0),
            },
        };
        let radiosity = PI * self.cosine_density(patch, source, cosine) + self.coefficients.per_power * lobe;
        // Late in the warm start most patches have nothing left to send: their area need not be looked up.
        if radiosity == 0.0 { 0.0 } else { radiosity * self.start.scene.area(patch) }
    }

    fn block(&self, block: usize) -> impl Iterator<Item = PatchId> + use<> {
        let end = (BLOCK * (block + 1)).min(self.start.sources.len());
        (BLOCK * block..end).map(|i| PatchId(i as u32))
    }

    /// Where a ray starts, for uniform `u`. `cursor` is where the last patch
    /// was found (0 at first): rays in order of u cost O(1), rays in any order O(log K).
    #[inline]
    pub(crate) fn select(&self, u: f64, cursor: &mut usize) -> Choice {
        let Coefficients { environment, points, .. } = self.coefficients;
        if u < environment {
            return Choice::Sky;
        }
        let before = environment + points;
        if u < before {
            return Choice::Light(self.lights.select(((u - environment) / points).min(1.0 - f64::EPSILON)));
        }
        let Some(&total) = self.cumulative.last() else { return Choice::Nothing };
        let target = ((u - before) / (1.0 - before)).min(1.0 - f64::EPSILON) * total;
        *cursor = gallop(self.cumulative, target, *cursor);
        let mut before = if *cursor == 0 { 0.0 } else { self.cumulative[*cursor - 1] };
        // Rounding may leave the target beyond the last weight: then the last patch that has one.
        let mut chosen = None;
        for patch in self.block(*cursor) {
            let weight = self.weight(patch);
            if weight > 0.0 {
                chosen = Some(patch);
            }
            before += weight;
            if before > target && chosen.is_some() {
                break;
            }
        }
        chosen.map_or(Choice::Nothing, Choice::Patch)
    }

    /// A light without area as the start of a ray: what the ray carries, and the probability of the choice. Nothing weighs
    /// against it, since no ray can meet a light.
    #[inline]
    pub(crate) fn light(&self, number: usize, direction: DVec3) -> Endpoint {
        let light = &self.start.scene.lights()[number];
        let density = self.coefficients.per_light_power * light.power().luminance();
        Endpoint { radiance: light.carried(direction), density }
    }

    /// What the environment brings to a ray that leaves the scene in `towards`; black if it does not shine now.
    #[inline]
    pub(crate) fn sky(&self, towards: DVec3) -> Endpoint {
        match self.start.scene.environment() {
            Some(e) if self.coefficients.environment > 0.0 => {
                Endpoint { radiance: e.radiance(towards), density: self.coefficients.environment * e.pdf_line(towards) }
            }
            _ => Endpoint { radiance: Rgb::BLACK, density: 0.0 },
        }
    }
}

/// The first entry above `target`, sought from `near` with growing steps.
#[inline]
fn gallop(cumulative: &[f64], target: f64, near: usize) -> usize {
    let last = cumulative.len() - 1;
    let near = near.min(last);
    let (mut low, mut high);
    if cumulative[near] > target {
        // Backwards: entries from `high` on are above the target.
        high = near;
        let mut step = 1;
        loop {
            if high < step {
                low = 0;
                break;
            }
            if cumulative[high - step] <= target {
                low = high - step + 1;
                break;
            }
            high -= step;
            step *= 2;
        }
    } else {
        // Forwards: entries before `low` are not above it.
        low = near + 1;
        let mut step = 1;
        loop {
            if low + step > last {
                high = last;
                break;
            }
            if cumulative[low + step - 1] > target {
                high = low + step - 1;
                break;
            }
            low += step;
            step *= 2;
        }
    }
    while low < high {
        let middle = low + (high - low) / 2;
        if cumulative[middle] > target { high = middle } else { low = middle + 1 }
    }
    low.min(last)
}

impl Coefficients {
    fn new(start: &Start, shares: Shares, power: f64) -> Self {
        let mut s = shares;
        let mut freed = 0.0;
        if start.scene.environment().is_none() {
            freed += std::mem::take(&mut s.environment);
        }
        if !(start.emits && start.lamp_power > 0.0) {
            freed += std::mem::take(&mut s.lamps);
        }
        if !(start.emits && start.light_power > 0.0) {
            freed += std::mem::take(&mut s.points);
        }
        if power > 0.0 {
            s.power += freed;
        } else {
            let freed = 0.5 * (freed + std::mem::take(&mut s.power));
            s.area += freed;
            s.patches += freed;
        }
        let per = |share: f64, whole: f64| if share > 0.0 { share / whole } else { 0.0 };
        Self {
            per_power: per(s.power, power),
            per_lamp_power: per(s.lamps, start.lamp_power),
            area: s.area / (PI * start.total_area),
            patches: s.patches,
            environment: s.environment,
            points: s.points,
            per_light_power: per(s.points, start.light_power),
        }
    }
}

impl<'a> Start<'a> {
    #[inline]
    fn directional(&self, patch: PatchId, k: usize) -> Option<Directional> {
        self.representatives[k].directional(self.scene, patch, self.representation)
    }
}

/// What bounds deposits where no ray is shot by power. O(K).
struct Extremes {
    /// Largest luminance of a radiance, or of the mean radiance of a lobe.
    brightest: f64,
    least_gather: f64,
    /// Smallest luminance of an emission.
    dimmest_lamp: f64,
}

impl Extremes {
    fn of(start: &Start, stand_ins: &[StandIn]) -> Self {
        let mut this = Self { brightest: 0.0, least_gather: f64::INFINITY, dimmest_lamp: f64::INFINITY };
        for (i, source) in start.sources.iter().enumerate() {
            this.brightest = this.brightest.max(source.radiance().luminance());
            this.least_gather = this.least_gather.min(source.gather());
            if source.emits() {
                let emitted = start.scene.emission(PatchId(i as u32)).luminance();
                this.dimmest_lamp = this.dimmest_lamp.min(emitted);
            }
        }
        for s in stand_ins {
            this.brightest = this.brightest.max(f64::from(s.cosine) + f64::from(s.lobe));
        }
        this
    }
}

/// Computes the glossy patches' stand-ins; returns the power of all patches' stand-ins.
fn fill_stand_ins(start: &Start, stand_ins: &mut Vec<StandIn>) -> f64 {
    stand_ins.resize(start.representatives.len(), StandIn::default());
    let patches = start.glossy.patches();
    stand_ins.par_iter_mut().enumerate().with_min_len(256).for_each(|(k, stand_in_of)| {
        let patch = patches[k];
        let emitted = if start.emits { start.scene.emission(patch) } else { Rgb::BLACK };
        let main_part = start.sources[patch.index()].radiance() - emitted;
        let parts = start.directional(patch, k).map(|d| {
            let cosine = start.scene.normal(patch).dot(d.wi);
            let lobe = d.brdf.lobe_albedo(cosine);
            (d.irradiance, lobe, d.brdf.albedo(cosine) - lobe)
        });
        let (cosine, lobe) = stand_in(emitted, main_part, parts);
        *stand_in_of = StandIn { cosine: cosine as f32, lobe: lobe as f32 };
    });
    let power = |i: usize, source: &Source| {
        let patch = PatchId(i as u32);
        let glossy = if stand_ins.is_empty() { None } else { start.glossy.number_of(patch) };
        let radiosity = match glossy {
            Some(k) => PI * f64::from(stand_ins[k].cosine) + f64::from(stand_ins[k].lobe),
            None => PI * source.radiance().luminance(),
        };
        if radiosity == 0.0 { 0.0 } else { radiosity * start.scene.area(patch) }
    };
    // Chunks in order: floating-point sums must not depend on the number of threads.
    let chunk = |(c, sources): (usize, &[Source])| (TASK * c..).zip(sources).map(|(i, s)| power(i, s)).sum::<f64>();
    let sums: Vec<f64> = start.sources.par_chunks(TASK).enumerate().map(chunk).collect();
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn galloping_finds_what_a_scan_finds() {
        let cumulative = [0.0, 0.5, 0.5, 1.25, 2.0, 2.0, 2.0, 7.0, 7.5, 9.0];
        for near in 0..cumulative.len() + 2 {
            for k in 0..90 {
                let target = f64::from(k) * 0.1;
                let expected = cumulative.iter().position(|&c| c > target).unwrap_or(9);
                assert_eq!(gallop(&cumulative, target, near), expected, "{target} from {near}");
            }
        }
    }
}
