//! The paper's schedule: iterations of one ray (or a batch), each changing the state that the next starts from.
//!
//! State per patch: the main part × n, one representative, C × n; selection by the power tree of §2.2. Nothing is
//! divided by n until it is read. Emission alone at n = 0. Pictures of a fixed camera average the directional part
//! over all iterations, exactly and lazily: between two hits a patch's picture only scales as C/n, and Σ 1/m over
//! the iterations between is a difference of harmonic numbers.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::passing::End;
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::error_bars::{Evidence, Noise, PatchNoise};
use crate::glossy::GlossyPatches;
use crate::params::{Params, Representation};
use crate::patch_radiance::{Directional, Outgoing, stand_in};
use crate::record::{GlossyRecord, RecordError, SequentialRecord};
use crate::representative::Representative;
use crate::select::PowerTree;
use crate::shoot::{Shot, shoot};
use crate::solution::{GlossySolution, Solution};
use crate::sums::cell;
use crate::tally::Tally;
use crate::transfer::transfer;
use crate::waves::balance;

const STREAM_RAY: u64 = 16;
const STREAM_ACCEPT: u64 = 17;

/// Updates after which the tree's sums are built anew.
const REBUILD: u64 = 1 << 20;

/// State of the paper's schedule.
#[derive(Debug)]
pub(crate) struct Sequential {
    n: u64,
    updates: u64,
    emitted: Rgb,
    tree: PowerTree,
    patches: Vec<PatchState>,
    glossy: Vec<GlossyState>,
    tally: Tally,
    /// Deposits of the current batch.
    pending: Vec<Pending>,
}

/// What every patch has, side by side: a ray touches two of them anywhere in memory.
#[derive(Clone, Copy, Debug, Default)]
struct PatchState {
    /// Σ I, W·m⁻².
    irradiance_n: [f64; 3],
    evidence: Evidence,
}

#[derive(Clone, Debug, Default)]
struct GlossyState {
    /// Σ I·a(ω)/π.
    main_part_n: Rgb,
    /// Σ l.
    importance_n: f64,
    representative: Representative,
    /// Σ over iterations of the directional part's radiance to the eye, up to iteration `seen`.
    observed_n: Rgb,
    seen: u64,
}

impl GlossyState {
    fn record(&self) -> GlossyRecord {
        let [r, g, b] = self.main_part_n.to_array();
        let sample = &self.representative;
        let ([ir, ig, ib], [x, y, z]) = (sample.irradiance.to_array(), sample.wi.to_array());
        [r, g, b, self.importance_n, ir, ig, ib, x, y, z, sample.importance, sample.rival]
    }

    fn resume(&[r, g, b, importance_n, ir, ig, ib, x, y, z, importance, rival]: &GlossyRecord) -> Self {
        let (irradiance, wi) = (Rgb::new(ir, ig, ib), DVec3::new(x, y, z));
        let representative = Representative { irradiance, wi, importance, rival };
        Self { main_part_n: Rgb::new(r, g, b), importance_n, representative, ..Self::default() }
    }
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    patch: PatchId,
    deposit: Rgb,
    wi: DVec3,
    end: u64,
}

impl Sequential {
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches) -> Self {
        let emitted = scene.patches().map(|p| PI * scene.area(p) * scene.emission(p).luminance());
        Self {
            n: 0,
            updates: 0,
            emitted: scene.emitted_power(),
            tree: PowerTree::new(emitted),
            patches: vec![PatchState::default(); scene.len()],
            glossy: vec![GlossyState::default(); glossy.patches().len()],
            tally: Tally::default(),
            pending: Vec::new(),
        }
    }

    /// Goes on from what was written down, whose arrays are checked and of this scene.
    pub(crate) fn resume(
        scene: &PatchScene,
        glossy: &GlossyPatches,
        record: &SequentialRecord,
    ) -> Result<Self, RecordError> {
        let mut this = Self::new(scene, glossy);
        (this.n, this.updates, this.tally) = (record.rays, record.updates, record.tally);
        this.tree.set_reflected(&record.tree);
        let sums = record.irradiance.iter().zip(record.squares.iter()).zip(record.hits.iter());
        for (state, ((&irradiance_n, &squares), &hits)) in this.patches.iter_mut().zip(sums) {
            *state = PatchState { irradiance_n, evidence: Evidence { squares, hits } };
        }
        for (state, record) in this.glossy.iter_mut().zip(record.memory.iter()) {
            *state = GlossyState::resume(record);
            // Nobody looked at these iterations: an observer's mean would miss them.
            state.seen = this.n;
        }
        Ok(this)
    }

    /// Writes everything down but what an observer was sent.
    pub(crate) fn record(&self, glossy: &GlossyPatches) -> SequentialRecord<'_> {
        SequentialRecord {
            rays: self.n,
            updates: self.updates,
            tally: self.tally,
            irradiance: self.patches.iter().map(|p| p.irradiance_n).collect(),
            squares: self.patches.iter().map(|p| p.evidence.squares).collect(),
            hits: self.patches.iter().map(|p| p.evidence.hits).collect(),
            tree: self.tree.reflected().collect(),
            glossy: glossy.patches().iter().map(|p| p.0).collect(),
            memory: self.glossy.iter().map(GlossyState::record).collect(),
        }
    }

    pub(crate) fn rays(&self) -> u64 {
        self.n
    }

    /// Total power that the tree holds, W: emitted + reflected/n, luminance.
    pub(crate) fn power(&self) -> f64 {
        self.tree.total(self.n)
    }

    /// `rays` iterations, in batches against one state.
    pub(crate) fn advance(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        params: &Params,
        rays: u64,
        batch: u64,
    ) {
        let mut done = 0;
        while done < rays {
            // Whole batches, whoever looks in between.
            let size = batch;
            for k in 0..size {
                self.ray(scene, glossy, params, self.n + k);
            }
            self.close(scene, glossy, params, size);
            done += size;
        }
    }

    fn ray(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, index: u64) {
        self.tally.rays += 1;
        let mut random = Stream::new(params.seed, STREAM_RAY, index);
        let mut pair = || [random.uniform(), random.uniform()];
        let ([choice, _], place, direction) = (pair(), pair(), pair());
        let shooter = PatchId(self.tree.select(choice, self.n) as u32);
        let outgoing = self.outgoing(scene, glossy, params, shooter);
        let Some(shot) = shoot(scene, shooter, &outgoing, place, direction, || random.uniform()) else {
            return;
        };
        let Shot { direction, arrival, stop } = shot;
        let here = outgoing.endpoint(scene.normal(shooter), direction);
        match arrival.end {
            End::Patch(hit) => {
                let away = -arrival.direction;
                let there = self.outgoing(scene, glossy, params, hit).endpoint(scene.normal(hit), away);
                let d = transfer(
                    params.estimator,
                    &here.stopping(arrival.stop),
                    &there.stopping(stop).seen_through(arrival.index_ratio),
                );
                let [on_hit, on_shooter] = [d.on_hit, d.on_shooter].map(|d| d * arrival.factor);
                self.pending.push(Pending { patch: hit, deposit: on_hit, wi: away, end: 2 * index });
                self.pending.push(Pending { patch: shooter, deposit: on_shooter, wi: direction, end: 2 * index + 1 });
            }
            End::Back | End::Lost => self.tally.lost += here.radiance * arrival.factor / here.density,
            End::Sky => self.tally.escaped += here.radiance * arrival.factor / here.density,
        }
    }

    /// Deposits a batch and moves on by its iterations.
    fn close(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, size: u64) {
        let before = self.n;
        self.n += size;
        for pending in std::mem::take(&mut self.pending) {
            self.deposit(scene, glossy, params, pending, before);
        }
        if self.updates >= REBUILD {
            self.updates = 0;
            self.tree.rebuild();
        }
    }

    fn deposit(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, p: Pending, before: u64) {
        if p.deposit.is_black() {
            return;
        }
        if !p.deposit.is_finite() {
            self.tally.invalid += 1;
            return;
        }
        let (area, n) = (scene.area(p.patch), scene.normal(p.patch));
        let brdf = scene.brdf(p.patch);
        let irradiance = p.deposit / area;
        let albedo = brdf.albedo(n.dot(p.wi));
        self.tally.arrived += p.deposit;
        self.tally.absorbed += p.deposit * (Rgb::WHITE - albedo - scene.passed_share(p.patch, p.wi));
        let state = &mut self.patches[p.patch.index()];
        state.evidence.squares += p.deposit.luminance().powi(2);
        state.evidence.hits = state.evidence.hits.saturating_add(1);
        state.irradiance_n = (Rgb::from_array(state.irradiance_n) + irradiance).to_array();
        self.tree.add_reflected(p.patch.index(), (p.deposit * albedo).luminance());
        self.updates += 1;

        let Some(k) = glossy.number_of(p.patch) else { return };
        self.observe(scene, glossy, params, p.patch, k, before);
        let state = &mut self.glossy[k];
        state.main_part_n += irradiance * albedo / PI;
        if params.representation == Representation::Main {
            return;
        }
        let weight = match params.representation {
            Representation::Sample => albedo,
            _ => brdf.lobe_albedo(n.dot(p.wi)),
        };
        let importance = (irradiance * weight).luminance();
        state.importance_n += importance;
        let u = match params.representation {
            Representation::Last => 0.0,
            _ => Stream::new(params.seed, STREAM_ACCEPT, p.end).uniform(),
        };
        state.representative.offer(irradiance, p.wi, importance, importance, u);
    }

    /// Brings a glossy patch's picture sum up to iteration `until`, through which its state has not changed.
    fn observe(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        params: &Params,
        patch: PatchId,
        k: usize,
        until: u64,
    ) {
        let state = &self.glossy[k];
        if let (Some(eye), Some(unscaled)) = (glossy.to_eye(k), self.directional(scene, params, patch, k, 1)) {
            let radiance = unscaled.irradiance
                * (unscaled.brdf.eval(scene.normal(patch), unscaled.wi, eye) - unscaled.main_reflectance);
            let observed = radiance * (harmonic(until) - harmonic(state.seen));
            self.glossy[k].observed_n += observed;
        }
        self.glossy[k].seen = until;
    }

    /// The directional part at iteration `n`.
    fn directional(
        &self,
        scene: &PatchScene,
        params: &Params,
        patch: PatchId,
        k: usize,
        n: u64,
    ) -> Option<Directional> {
        let state = &self.glossy[k];
        if state.representative.importance <= 0.0 || params.representation == Representation::Main {
            return None;
        }
        let brdf = scene.brdf(patch);
        let wi = state.representative.wi;
        let main_reflectance = match params.representation {
            Representation::Sample => Rgb::BLACK,
            _ => brdf.albedo(scene.normal(patch).dot(wi)) / PI,
        };
        let irradiance = state.representative.scaled(state.importance_n / n as f64);
        Some(Directional { irradiance, wi, brdf, main_reflectance })
    }

    fn main_part(&self, scene: &PatchScene, glossy: &GlossyPatches, patch: PatchId) -> Rgb {
        if self.n == 0 {
            return Rgb::BLACK;
        }
        let main_part_n = match glossy.number_of(patch) {
            Some(k) => self.glossy[k].main_part_n,
            None => Rgb::from_array(self.patches[patch.index()].irradiance_n) * scene.brdf(patch).mean_albedo() / PI,
        };
        main_part_n / self.n as f64
    }

    fn outgoing(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, patch: PatchId) -> Outgoing {
        let emitted = scene.emission(patch);
        let mut main_part = self.main_part(scene, glossy, patch);
        let density = self.tree.power(patch.index(), self.n) / (self.tree.total(self.n) * scene.area(patch));
        let directional = match glossy.number_of(patch) {
            Some(k) if self.n > 0 => self.directional(scene, params, patch, k, self.n),
            _ => None,
        };
        let Some(d) = directional else {
            return Outgoing {
                constant: emitted + main_part,
                directional: None,
                cosine_density: density / PI,
                lobe_density: 0.0,
            };
        };
        if params.representation == Representation::Sample {
            main_part = Rgb::BLACK;
        }
        let cosine = scene.normal(patch).dot(d.wi);
        let lobe = d.brdf.lobe_albedo(cosine);
        let (c, l) = stand_in(emitted, main_part, Some((d.irradiance, lobe, d.brdf.albedo(cosine) - lobe)));
        let total = PI * c + l;
        // The tree's power chooses the patch; the stand-in shares it out over directions.
        let (c, l) = if total > 0.0 { (c / total, l / total) } else { (1.0 / PI, 0.0) };
        Outgoing {
            constant: emitted + main_part,
            directional: Some(d),
            cosine_density: density * c,
            lobe_density: density * l,
        }
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        self.noise(scene).relative_error()
    }

    fn irradiance(&self, patch: PatchId) -> Rgb {
        Rgb::from_array(self.patches[patch.index()].irradiance_n) / self.n.max(1) as f64
    }

    fn noise<'a>(&'a self, scene: &'a PatchScene) -> Noise<impl Fn(PatchId) -> PatchNoise + use<'a>> {
        noise(self.n, self.patches.len(), |p| {
            let PatchState { irradiance_n, evidence } = self.patches[p.index()];
            let (area, emits) = cell(scene, p);
            (area, emits, irradiance_n, evidence.squares, evidence.hits)
        })
    }

    pub(crate) fn solution(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Solution {
        let n = self.n.max(1) as f64;
        let irradiance: Vec<[f32; 3]> = scene.patches().map(|p| self.irradiance(p).to_f32()).collect();
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &patch)| {
            let state = &self.glossy[k];
            let main_part = self.main_part(scene, glossy, patch);
            let directional = self.directional(scene, params, patch, k, self.n.max(1));
            let observed_lobe = glossy.to_eye(k).filter(|_| params.representation != Representation::Main).map(|eye| {
                // What is left of the interval since the last hit, then the mean over all iterations.
                let rest = directional.map_or(Rgb::BLACK, |d| {
                    d.irradiance
                        * (d.brdf.eval(scene.normal(patch), d.wi, eye) - d.main_reflectance)
                        * (n * (harmonic(self.n) - harmonic(state.seen)))
                });
                let base = base_radiance(scene, patch, Rgb::from_f32(irradiance[patch.index()]), eye);
                let constant = if params.representation == Representation::Sample { Rgb::BLACK } else { main_part };
                [Rgb::BLACK, constant + (state.observed_n + rest) / n - base]
            });
            GlossySolution { main_part, directional, observed_lobe }
        });
        let glossy_light = glossy_light.collect();
        Solution {
            rays: self.n,
            irradiance,
            glossy: glossy.clone(),
            glossy_light,
            balance: balance(&self.tally, self.emitted, n),
            standard_error: self.noise(scene).standard_errors(),
            hits: self.patches.iter().map(|p| p.evidence.hits).collect(),
            relative_error: self.relative_error(scene),
            tally: self.tally,
            splits_direct_light: false,
        }
    }
}

/// The noise of `n` iterations, from each patch's area, whether it emits, Σ I, Σ 𝓛(deposit)² and number of deposits.
///
/// The paper's rays are independent, so their squares need no calibration; what noise adds by being reflected is
/// small beside the noise of a patch's own rays.
pub(crate) fn noise<C: Fn(PatchId) -> (f64, bool, [f64; 3], f64, u32)>(
    n: u64,
    patches: usize,
    cell: C,
) -> Noise<impl Fn(PatchId) -> PatchNoise> {
    let n = n.max(1) as f64;
    let of = move |p: PatchId| {
        let (area, emits, irradiance_n, squares, hits) = cell(p);
        let irradiance = (Rgb::from_array(irradiance_n) / n).luminance();
        PatchNoise { area, emits, irradiance, evidence: Evidence { squares, hits }, half_difference: None }
    };
    Noise { rays: n, patches, of }
}

/// What the display shows of a glossy patch's base: the rest is its lobe.
fn base_radiance(scene: &PatchScene, patch: PatchId, irradiance: Rgb, eye: DVec3) -> Rgb {
    irradiance * scene.brdf(patch).base_reflectance(scene.normal(patch).dot(eye)) / PI
}

/// Bytes of the state of the paper's schedule: sums, and a tree of two powers a node.
pub(crate) fn state_bytes(patches: usize, glossy: usize) -> usize {
    let tree = 2 * size_of::<[f64; 2]>() * patches.next_power_of_two();
    let number = if glossy > 0 { GlossyPatches::BYTES_PER_PATCH * patches } else { 0 };
    size_of::<PatchState>() * patches + size_of::<GlossyState>() * glossy + tree + number
}

/// H(n) = Σ 1/m for m ≤ n; exact sums up to 128, beyond them the asymptotic series (error below 1e-14).
fn harmonic(n: u64) -> f64 {
    if n <= 128 {
        return (1..=n).map(|m| 1.0 / m as f64).sum();
    }
    let x = n as f64;
    const EULER: f64 = 0.577_215_664_901_532_9;
    let inverse_square = 1.0 / (x * x);
    libm::log(x) + EULER + 0.5 / x - inverse_square / 12.0 + inverse_square * inverse_square / 120.0
}

#[cfg(test)]
mod tests {
    use super::harmonic;

    #[test]
    fn harmonic_numbers() {
        let mut sum = 0.0;
        for n in 1..=1000u64 {
            sum += 1.0 / n as f64;
            assert!((harmonic(n) - sum).abs() < 1e-12, "{n}");
        }
        assert_eq!(harmonic(0), 0.0);
    }
}
