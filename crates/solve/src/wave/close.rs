//! The end of a wave: deposits are added to their patches, and what rays start from moves on.
//!
//! Bucket by bucket: each is summed by one thread (`bucket`), then entered with the wave's weights into the output, which
//! remembers everything, and into the source, which forgets. Sums of a wave live only here, so that a patch has no
//! memory for them. Where ranks share the wave, buckets are summed and entered in groups, and between the two the sums of
//! all ranks are added up (`exchange`).

use std::f64::consts::PI;

use rayon::prelude::*;
use twinray_scene::brdf::Brdf;
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb};

use super::bucket::{BucketSums, GlossySums, PatchSums};
use super::deposits::Buckets;
use super::exchange;
use super::{Wave, WaveContext};
use crate::error_bars::PatchEvidence;
use crate::fixed::Units;
use crate::glossy::GlossyPatches;
use crate::params::Representation;
use crate::source::{PackedRepresentative, Source};

const STREAM_ACCEPT: u64 = 3;

/// What one run of waves starts rays from.
#[derive(Debug)]
pub(crate) struct SourceState {
    pub sources: Vec<Source>,
    /// Per glossy patch.
    pub representatives: Vec<PackedRepresentative>,
}

/// What all runs have brought so far.
#[derive(Debug)]
pub(crate) struct OutputState {
    /// Per patch: Σ deposits, W.
    pub deposits: Vec<[f64; 3]>,
    /// Per patch, in `unit`s.
    pub evidence: Vec<PatchEvidence>,
    /// W: a power of two near the power of the scene, so that squares fit into single precision however bright it is.
    pub unit: f64,
    /// Per glossy patch: Σ deposit · albedo(ω_in).
    pub reflected: Vec<[f32; 3]>,
    /// Per glossy patch, if there is an observer: Σ deposit · lobe(ω_in, ω_eye), of light straight from emitting patches
    /// and of all other.
    pub observed: Vec<[[f32; 3]; 2]>,
}

/// Bytes of a patch in an [`OutputState`] and in two [`SourceState`]s.
pub(crate) const BYTES_PER_PATCH: usize = 24 + size_of::<PatchEvidence>() + 2 * size_of::<Source>();
/// Bytes of a glossy patch beside that, without an observer.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize = 12 + 2 * size_of::<PackedRepresentative>();
/// Bytes that an observer adds to a glossy patch.
pub(crate) const BYTES_PER_OBSERVED_PATCH: usize = 24;

impl OutputState {
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches) -> Self {
        let patches = scene.len();
        let lobes = glossy.patches().len();
        Self {
            deposits: vec![[0.0; 3]; patches],
            evidence: vec![PatchEvidence::default(); patches],
            unit: power_of_two(scene),
            reflected: vec![[0.0; 3]; lobes],
            observed: vec![[[0.0; 3]; 2]; if glossy.is_observed() { lobes } else { 0 }],
        }
    }

    /// Begins anew.
    pub(crate) fn clear(&mut self) {
        self.deposits.fill([0.0; 3]);
        self.evidence.fill(PatchEvidence::default());
        self.reflected.fill([0.0; 3]);
        self.observed.fill([[0.0; 3]; 2]);
    }
}

/// What becomes of a wave's deposits.
#[derive(Debug)]
pub(crate) struct Closing {
    pub units: Units,
    /// Rays that were shot.
    pub rays: u64,
    /// The deposits' weight in the output; 0 leaves it alone.
    pub output: f64,
    /// +1 or −1: which of two replicas this is.
    pub sign: f64,
    /// Seed of the choice among candidates for the representatives.
    pub seed: u64,
    pub update: Update,
}

/// How the source moves on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Update {
    /// A wave: the source forgets this fraction of itself for the wave's mean.
    Blend(f64),
    /// A step of the warm start: deposits times this are the light that is sent on by the next step, and what they bring
    /// is added to the source.
    Step(f64),
}

/// Power that arrived on patches, and what of it they sent on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Closed {
    pub arrived: Rgb,
    pub reflected: Rgb,
}

impl Wave {
    /// Enters the deposits of the wave that was shot last. `unshot` is filled by [`Update::Step`], otherwise empty.
    pub(crate) fn close(
        &self,
        context: &WaveContext,
        closing: &Closing,
        state: &mut SourceState,
        unshot: &mut [Source],
        output: &mut OutputState,
    ) -> Closed {
        let mut parts = parts(context, state, unshot, output);
        let mut closed: Vec<Closed> = Vec::new();
        match context.among.sharing(closing.rays, context.scene.len()) {
            None => parts
                .into_par_iter()
                .map_init(BucketSums::default, |sums, mut part| {
                    sums.fill(context, closing, &self.tasks, &part);
                    part.enter(context, closing, sums)
                })
                .collect_into_vec(&mut closed),
            Some(peers) => {
                for group in parts.chunks_mut(EXCHANGED_BUCKETS) {
                    let fill = |part: &Part| {
                        let mut sums = BucketSums::default();
                        sums.fill(context, closing, &self.tasks, part);
                        sums
                    };
                    let mut sums: Vec<BucketSums> = group.par_iter().map(fill).collect();
                    exchange::add_up(peers, context.glossy.is_observed(), &mut sums);
                    let enter = |(part, sums): (&mut Part, &BucketSums)| part.enter(context, closing, sums);
                    closed.par_extend(group.par_iter_mut().zip(&sums).map(enter));
                }
            }
        }
        let mut total = Closed::default();
        for c in closed {
            total.arrived += c.arrived;
            total.reflected += c.reflected;
        }
        total
    }
}

/// Buckets whose sums ranks add up at a time: few enough for their memory not to matter beside the state's, enough for all
/// threads and for long messages.
const EXCHANGED_BUCKETS: usize = 64;

/// A bucket's own slices of the state.
pub(super) struct Part<'a> {
    pub(super) bucket: usize,
    pub(super) first: usize,
    pub(super) first_glossy: usize,
    sources: &'a mut [Source],
    unshot: &'a mut [Source],
    deposits: &'a mut [[f64; 3]],
    evidence: &'a mut [PatchEvidence],
    per_unit: f64,
    representatives: &'a mut [PackedRepresentative],
    reflected: &'a mut [[f32; 3]],
    observed: &'a mut [[[f32; 3]; 2]],
}

impl Part<'_> {
    /// Patches of the bucket, and how many of them are glossy.
    pub(super) fn sizes(&self) -> [usize; 2] {
        [self.sources.len(), self.representatives.len()]
    }
}

fn parts<'a>(
    context: &WaveContext,
    state: &'a mut SourceState,
    unshot: &'a mut [Source],
    output: &'a mut OutputState,
) -> Vec<Part<'a>> {
    let buckets = Buckets::of(context.scene.len());
    let (mut sources, mut unshot) = (&mut state.sources[..], unshot);
    let (mut deposits, mut evidence) = (&mut output.deposits[..], &mut output.evidence[..]);
    let mut representatives = &mut state.representatives[..];
    let (mut reflected, mut observed) = (&mut output.reflected[..], &mut output.observed[..]);
    let glossy = context.glossy.patches();
    let mut first_glossy = 0;
    (0..buckets.count())
        .map(|bucket| {
            let first = bucket * buckets.size();
            let end = (first + buckets.size()).min(context.scene.len());
            let end_glossy = glossy.partition_point(|p| p.index() < end);
            let (patches, lobes) = (end - first, end_glossy - first_glossy);
            let part = Part {
                bucket,
                first,
                first_glossy,
                sources: take(&mut sources, patches),
                unshot: take(&mut unshot, patches),
                deposits: take(&mut deposits, patches),
                evidence: take(&mut evidence, patches),
                per_unit: 1.0 / output.unit,
                representatives: take(&mut representatives, lobes),
                reflected: take(&mut reflected, lobes),
                observed: take(&mut observed, lobes),
            };
            first_glossy = end_glossy;
            part
        })
        .collect()
}

/// Cuts the first `count` off a slice; of what is empty, nothing.
fn take<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    rest.split_off_mut(..count.min(rest.len())).unwrap_or_default()
}

impl Part<'_> {
    /// Enters the sums into the state.
    fn enter(&mut self, context: &WaveContext, closing: &Closing, sums: &BucketSums) -> Closed {
        let scene = context.scene;
        let units = closing.units;
        let mut closed = Closed::default();
        for (i, sum) in sums.patches.iter().enumerate() {
            let patch = PatchId((self.first + i) as u32);
            // Late in the warm start most patches get nothing: nothing need be looked up.
            if sum.hits == 0 && matches!(closing.update, Update::Step(_)) {
                self.unshot[i].constant = [0.0; 3];
                continue;
            }
            let arrived = sum.deposits.value(units.deposit);
            let number = context.glossy.number_of(patch).map(|k| k - self.first_glossy);
            let reflected = match number {
                Some(k) => sums.glossy[k].reflected.value(units.deposit),
                None => arrived * diffuse_albedo(scene, patch),
            };
            closed.arrived += arrived;
            closed.reflected += reflected;
            self.output(closing, i, sum, arrived);
            if let Some(k) = number {
                self.output_lobe(closing, k, &sums.glossy[k], reflected);
                self.remember(context, closing, patch, k, &sums.glossy[k]);
            }
            self.move_on(context, closing, patch, i, number, reflected);
        }
        closed
    }

    fn output(&mut self, closing: &Closing, i: usize, sum: &PatchSums, arrived: Rgb) {
        if closing.output == 0.0 || sum.hits == 0 {
            return;
        }
        let entered = arrived * closing.output;
        self.deposits[i] = (Rgb::from_array(self.deposits[i]) + entered).to_array();
        let (scale, per_unit) = (closing.output, self.per_unit);
        let squares = sum.squares as f64 * closing.units.square.value() * scale * scale * per_unit * per_unit;
        let evidence = &mut self.evidence[i];
        evidence.squares += squares as f32;
        evidence.difference += (closing.sign * entered.luminance() * per_unit) as f32;
        evidence.hits = evidence.hits.saturating_add(u32::try_from(sum.hits).unwrap_or(u32::MAX));
    }

    fn output_lobe(&mut self, closing: &Closing, k: usize, sum: &GlossySums, reflected: Rgb) {
        if closing.output == 0.0 {
            return;
        }
        let add = |to: &mut [f32; 3], value: Rgb| *to = (Rgb::from_f32(*to) + value * closing.output).to_f32();
        add(&mut self.reflected[k], reflected);
        if let Some(observed) = self.observed.get_mut(k) {
            for (to, part) in observed.iter_mut().zip(&sum.observed) {
                add(to, part.value(closing.units.deposit));
            }
        }
    }

    /// One acceptance or rejection per patch and wave, on the wave's total: the chain runs over waves, and no thread
    /// can change it.
    fn remember(&mut self, context: &WaveContext, closing: &Closing, patch: PatchId, k: usize, sum: &GlossySums) {
        let representative = &mut self.representatives[k];
        let area = context.scene.area(patch);
        let importance = sum.importance as f64 * closing.units.deposit.value() / area;
        let before = f64::from(representative.importance);
        representative.importance = match closing.update {
            Update::Blend(fraction) => before + fraction * (importance / closing.rays as f64 - before),
            Update::Step(per) => before + importance * per,
        } as f32;
        if let Some(best) = sum.best {
            let u = match context.representation {
                Representation::Last => 0.0,
                _ => Stream::new(closing.seed, STREAM_ACCEPT, (self.first_glossy + k) as u64).uniform(),
            };
            representative.offer(best.power / area, best.from, importance / closing.rays as f64, u);
        }
    }

    fn move_on(
        &mut self,
        context: &WaveContext,
        closing: &Closing,
        patch: PatchId,
        i: usize,
        number: Option<usize>,
        reflected: Rgb,
    ) {
        let per_area = 1.0 / (PI * context.scene.area(patch));
        let emitted = context.scene.emission(patch);
        // The sample alone stands for all reflected light, once there is one.
        let sample = context.representation == Representation::Sample
            && number.is_some_and(|k| self.representatives[k].is_there());
        let source = &mut self.sources[i];
        let now = source.radiance();
        let next = match closing.update {
            Update::Blend(fraction) => {
                let mean = emitted + reflected * (per_area / closing.rays as f64);
                now + (mean - now) * fraction
            }
            Update::Step(per) => {
                let sent_on = reflected * (per_area * per);
                self.unshot[i].constant = sent_on.to_f32();
                now + sent_on
            }
        };
        source.constant = if sample { emitted } else { next }.to_f32();
    }
}

/// The largest power of two that is not above the power of lamps, lights and sky. As a unit it changes no digit.
fn power_of_two(scene: &PatchScene) -> f64 {
    let sky = scene.environment().map_or(0.0, |e| e.power().luminance());
    let power = (scene.emitted_power() + scene.lights_power()).luminance() + sky;
    if power > 0.0 && power.is_finite() { libm::scalbn(1.0, libm::ilogb(power).clamp(-400, 400)) } else { 1.0 }
}

/// Albedo of a diffuse patch.
#[inline]
fn diffuse_albedo(scene: &PatchScene, patch: PatchId) -> Rgb {
    match scene.brdf(patch) {
        Brdf::Lambertian { reflectance } => reflectance,
        other => other.mean_albedo(),
    }
}
