//! What shines, as directions from a point: emitting patches, lights without area and the sky, sampled and with their density.
//!
//! Patches that belong together are a lamp; the sky is one too, and so is every light without area. No ray of a BRDF meets
//! the latter: their density is that of a disc of hardly any size, so that by the balance heuristic shadow rays have all
//! of the weight. A [`Choice`] among lamps is made, by power or by what was
//! learnt of a place; then a patch of the lamp by the power of its mean emission, and a point of it uniformly. What is
//! emitted there is taken at the very point. Visibility is the caller's.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, PointLight, Rgb, Side};

/// The most candidates for one shadow ray.
const MOST_CANDIDATES: u32 = 8;
/// The most lamps; where there are more, neighbours are one.
const MOST_LAMPS: usize = 256;
/// Lamps of more than this share of all power are cut in halves of no less than half so many cells, as long as there are fewer
/// than so many lamps.
const LARGE: f64 = 1.0 / 32.0;
const LEAST_CELLS: usize = 8;
const PARTS: usize = 64;
/// Density per solid angle of directions to a light without area: beside it every other vanishes in double precision.
const SHARP: f64 = 1e30;
/// Cosine between the normals of triangles that may be of one lamp.
const ALIKE: f64 = 0.99;

/// All that emits in a scene.
pub(crate) struct Lights<'a> {
    scene: &'a PatchScene,
    /// Emitting patches.
    patches: Vec<PatchId>,
    /// Running sum of their area × luminance of the mean emission.
    cumulative: Vec<f64>,
    lamps: Vec<Lamp>,
    by_power: Choice,
    /// Farther than anything from anywhere, m.
    far: f64,
}

/// What is chosen as a whole.
#[derive(Clone, Debug, PartialEq)]
enum Lamp {
    /// A range of the emitting patches.
    Patches(Range<usize>),
    /// A range of the lights without area.
    Points(Range<usize>),
    /// The surroundings, by what they send.
    Sky,
    /// One of the equal parts of all directions, evenly: windows show a few of them to a room.
    SkyPart(usize),
}

/// Parts of all directions: rows of equal height, columns of equal longitude.
const SKY_PARTS: [usize; 2] = [16, 32];
/// Density per solid angle of directions within a part.
const PART_DENSITY: f64 = (SKY_PARTS[0] * SKY_PARTS[1]) as f64 / (4.0 * PI);

/// The part that holds a direction.
fn sky_part(towards: DVec3) -> usize {
    let row = ((0.5 * (1.0 + towards.y) * SKY_PARTS[0] as f64) as usize).min(SKY_PARTS[0] - 1);
    let turn = (libm::atan2(towards.z, towards.x) / (2.0 * PI)).rem_euclid(1.0);
    row * SKY_PARTS[1] + ((turn * SKY_PARTS[1] as f64) as usize).min(SKY_PARTS[1] - 1)
}

/// A direction in a part, even by solid angle.
fn direction_in(part: usize, [s, t]: [f64; 2]) -> DVec3 {
    let (row, column) = ((part / SKY_PARTS[1]) as f64, (part % SKY_PARTS[1]) as f64);
    let y = 2.0 * (row + s) / SKY_PARTS[0] as f64 - 1.0;
    let (sin, cos) = libm::sincos(2.0 * PI * (column + t) / SKY_PARTS[1] as f64);
    let r = (1.0 - y * y).max(0.0).sqrt();
    DVec3::new(r * cos, y, r * sin)
}

/// Probabilities of the lamps.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    probability: Vec<f64>,
    cumulative: Vec<f64>,
}

impl Choice {
    /// In proportion to weights that are not negative; `None` if there is nothing to choose.
    pub fn new(weights: &[f64]) -> Option<Self> {
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let probability: Vec<f64> = weights.iter().map(|w| w / total).collect();
        let mut sum = 0.0;
        let cumulative = probability.iter().map(|p| {
            sum += p;
            sum
        });
        Some(Self { cumulative: cumulative.collect(), probability })
    }

    /// Probability of a lamp.
    pub fn probability(&self, lamp: usize) -> f64 {
        self.probability[lamp]
    }

    /// A lamp for a uniform number, and a number that is uniform given the lamp.
    fn choose(&self, u: f64) -> (usize, f64) {
        let last = self.probability.iter().rposition(|p| *p > 0.0).unwrap_or(0);
        let lamp = self.cumulative.partition_point(|&c| c <= u).min(last);
        let before = self.cumulative[lamp] - self.probability[lamp];
        (lamp, ((u - before) / self.probability[lamp]).clamp(0.0, 1.0 - f64::EPSILON))
    }
}

/// A direction in which something shines.
pub(crate) struct LightSample {
    /// Unit, away from the point.
    pub towards: DVec3,
    /// Density of the direction per solid angle, over all lights.
    pub density: f64,
    /// Radiance that arrives, if nothing is in between.
    pub radiance: Rgb,
    /// The point that shines and its unit normal; `None` for the sky.
    pub end: Option<(DVec3, DVec3)>,
    /// Number of the lamp that should be chosen for it.
    pub lamp: usize,
    /// True if only a shadow ray can find it.
    pub is_sharp: bool,
}

impl<'a> Lights<'a> {
    /// Collects what emits.
    pub fn new(scene: &'a PatchScene) -> Self {
        let patches: Vec<PatchId> = scene.patches().filter(|&p| scene.emission(p).luminance() > 0.0).collect();
        let mut sum = 0.0;
        let cumulative = patches.iter().map(|&p| {
            sum += scene.cell_area(p) * scene.emission(p).luminance();
            sum
        });
        let cumulative: Vec<f64> = cumulative.collect();
        let mut lamps: Vec<Lamp> = ranges(scene, &patches).into_iter().map(Lamp::Patches).collect();
        lamps.extend(points(scene).into_iter().map(Lamp::Points));
        let mut this = Self {
            scene,
            patches,
            cumulative,
            lamps: Vec::new(),
            by_power: Choice { probability: Vec::new(), cumulative: Vec::new() },
            far: 4.0 * scene.radius(),
        };
        // How much gets in of what comes from far away is not known: half of the choices, and a path in the dark costs a ray
        // at most. What is near is chosen by its power.
        let of = |lamp: &Lamp| match lamp {
            Lamp::Patches(range) => (false, PI * this.power(range)),
            Lamp::Points(range) => {
                (scene.lights()[range.start].is_distant(), luminance(&scene.lights()[range.clone()]))
            }
            Lamp::Sky => (true, scene.environment().map_or(0.0, |sky| sky.power().luminance())),
            // Only who has learnt which of them are to be seen chooses parts.
            Lamp::SkyPart(_) => (true, 0.0),
        };
        if scene.environment().is_some() {
            lamps.push(Lamp::Sky);
            lamps.extend((0..SKY_PARTS[0] * SKY_PARTS[1]).map(Lamp::SkyPart));
        }
        let powers: Vec<(bool, f64)> = lamps.iter().map(of).collect();
        let total = |far: bool| powers.iter().filter(|p| p.0 == far).map(|p| p.1).sum::<f64>();
        let totals = [false, true].map(total);
        let weight = |&(far, power): &(bool, f64)| if power > 0.0 { power / totals[usize::from(far)] } else { 0.0 };
        let weights: Vec<f64> = powers.iter().map(weight).collect();
        // What is all black has no lamps.
        if let Some(choice) = Choice::new(&weights) {
            (this.lamps, this.by_power) = (lamps, choice);
        }
        this
    }

    /// Number of lamps.
    pub fn len(&self) -> usize {
        self.lamps.len()
    }

    /// The choice by power.
    pub fn by_power(&self) -> &Choice {
        &self.by_power
    }

    /// A direction from `point` about proportional to what shines there. `None` where the choice shines elsewhere: a
    /// hole, a back, or no light at all. The density then integrates to less than one.
    pub fn sample(&self, point: DVec3, choice: f64, place: [f64; 2]) -> Option<LightSample> {
        self.sample_by(&self.by_power, point, choice, place)
    }

    /// The same by another choice.
    pub fn sample_by(&self, by: &Choice, point: DVec3, choice: f64, [s, t]: [f64; 2]) -> Option<LightSample> {
        if self.lamps.is_empty() {
            return None;
        }
        let (lamp, within) = by.choose(choice);
        let range = match &self.lamps[lamp] {
            Lamp::Patches(range) => range,
            Lamp::Points(range) => return self.sample_points(range, by.probability(lamp), lamp, point, within),
            Lamp::Sky | Lamp::SkyPart(_) => {
                let sky = self.scene.environment()?;
                let towards = match self.lamps[lamp] {
                    Lamp::SkyPart(part) => direction_in(part, [s, t]),
                    _ => sky.sample_direction([s, t]),
                };
                let density = self.sky_density_by(by, towards);
                let radiance = sky.radiance(towards);
                let lamp = self.sky_lamp(towards)?;
                return Some(LightSample { towards, density, radiance, end: None, lamp, is_sharp: false });
            }
        };
        let target = self.before(range) + within * self.power(range);
        let index = range.start + self.cumulative[range.clone()].partition_point(|&c| c <= target);
        let patch = self.patches[index.min(range.end - 1)];
        let triangle = self.scene.triangle_of(patch);
        let [u, v] = self.scene.cell_place_at(patch, s, t);
        if !self.scene.is_present(triangle, u, v) {
            return None;
        }
        let (end, normal) = (self.scene.point_of(triangle, u, v), self.scene.normal(patch));
        let towards = (end - point).try_normalize()?;
        let per_power = by.probability(lamp) / self.power(range);
        let density = self.solid_angle_density(per_power, point, patch, end);
        let radiance = self.scene.emission_at(triangle, Side::Front, u, v);
        let end = Some((end, normal));
        (density > 0.0).then_some(LightSample { towards, density, radiance, end, lamp, is_sharp: false })
    }

    /// One of the lights without area of a lamp that was chosen with this probability.
    fn sample_points(
        &self,
        range: &Range<usize>,
        probability: f64,
        lamp: usize,
        point: DVec3,
        within: f64,
    ) -> Option<LightSample> {
        let lights = &self.scene.lights()[range.clone()];
        let total = luminance(lights);
        let mut before = 0.0;
        let (light, power) = lights.iter().map(|light| (light, light.power().luminance())).find(|(_, power)| {
            before += power;
            within * total < before
        })?;
        let given = light.illuminate(point)?;
        let density = probability * power / total * SHARP;
        let (towards, radiance) = (given.towards, given.irradiance * SHARP);
        let end = (point + towards * given.distance.min(self.far), -towards);
        Some(LightSample { towards, density, radiance, end: Some(end), lamp, is_sharp: true })
    }

    /// Density per solid angle with which [`Lights::sample`] chooses the direction from `point` to `end` on `patch`;
    /// 0 on the back of a lamp and where nothing emits.
    pub fn density(&self, point: DVec3, patch: PatchId, end: DVec3) -> f64 {
        self.density_by(&self.by_power, point, patch, end)
    }

    /// The same of [`Lights::sample_by`].
    pub fn density_by(&self, by: &Choice, point: DVec3, patch: PatchId, end: DVec3) -> f64 {
        if self.scene.emission(patch).luminance() <= 0.0 {
            return 0.0;
        }
        let Some(lamp) = self.lamp_of(patch) else { return 0.0 };
        let Lamp::Patches(range) = &self.lamps[lamp] else { return 0.0 };
        self.solid_angle_density(by.probability(lamp) / self.power(range), point, patch, end)
    }

    /// Density per solid angle of a patch whose points are chosen with a density of luminance × `per_power` per area.
    fn solid_angle_density(&self, per_power: f64, point: DVec3, patch: PatchId, end: DVec3) -> f64 {
        let between = end - point;
        let cosine = -between.dot(self.scene.normal(patch));
        if cosine <= 0.0 {
            return 0.0;
        }
        // |between|³ since the cosine above still has the length in it.
        self.scene.emission(patch).luminance() * per_power * between.length_squared() * between.length() / cosine
    }

    /// How many candidates are worth their while where one of them is chosen: many lamps need many.
    pub fn candidates(&self) -> u32 {
        let lamps = self.lamps.iter().filter(|l| !matches!(l, Lamp::SkyPart(_))).count();
        (lamps as u32).clamp(1, MOST_CANDIDATES)
    }

    /// Density per solid angle with which [`Lights::sample`] chooses `towards` for the sky.
    pub fn sky_density(&self, towards: DVec3) -> f64 {
        self.sky_density_by(&self.by_power, towards)
    }

    /// The same of [`Lights::sample_by`].
    pub fn sky_density_by(&self, by: &Choice, towards: DVec3) -> f64 {
        let Some(sky) = self.scene.environment().filter(|_| !self.lamps.is_empty()) else { return 0.0 };
        let whole = self.first_sky();
        by.probability(whole) * sky.pdf_direction(towards)
            + by.probability(whole + 1 + sky_part(towards)) * PART_DENSITY
    }

    /// The lamp that a patch is a part of.
    pub fn lamp_of(&self, patch: PatchId) -> Option<usize> {
        let index = self.patches.binary_search(&patch).ok()?;
        let lamp = self.lamps.partition_point(|l| matches!(l, Lamp::Patches(range) if range.end <= index));
        (lamp < self.lamps.len()).then_some(lamp)
    }

    /// The lamp that should be chosen for a direction of the sky: a part of it, but for the sun and its like, which are too
    /// small to be found within a part.
    pub fn sky_lamp(&self, towards: DVec3) -> Option<usize> {
        let sky = self.scene.environment().filter(|_| !self.lamps.is_empty())?;
        let whole = self.first_sky();
        let is_peak = sky.pdf_direction(towards) > PART_DENSITY;
        Some(if is_peak { whole } else { whole + 1 + sky_part(towards) })
    }

    /// Number of the lamp that is the sky as a whole; its parts follow.
    fn first_sky(&self) -> usize {
        self.lamps.len() - 1 - SKY_PARTS[0] * SKY_PARTS[1]
    }

    fn before(&self, range: &Range<usize>) -> f64 {
        if range.start == 0 { 0.0 } else { self.cumulative[range.start - 1] }
    }

    /// Area × luminance of the patches in a range.
    fn power(&self, range: &Range<usize>) -> f64 {
        self.cumulative[range.end - 1] - self.before(range)
    }
}

/// Emitting patches by lamp: those of one flat face together, and neighbours where there are very many.
fn ranges(scene: &PatchScene, patches: &[PatchId]) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for (k, &patch) in patches.iter().enumerate() {
        let joins = k > 0 && {
            let last = patches[k - 1];
            let same = scene.triangle_of(last) == scene.triangle_of(patch);
            let next = scene.triangle_of(last) + 1 == scene.triangle_of(patch)
                && scene.normal(last).dot(scene.normal(patch)) > ALIKE
                && share_an_edge(scene, scene.triangle_of(last), scene.triangle_of(patch));
            same || next
        };
        match ranges.last_mut() {
            Some(range) if joins => range.end = k + 1,
            _ => ranges.push(k..k + 1),
        }
    }
    while ranges.len() > MOST_LAMPS {
        ranges = ranges.chunks(2).map(|pair| pair[0].start..pair[pair.len() - 1].end).collect();
    }
    // Large lamps are seen in part from many places.
    let power = |range: &Range<usize>| -> f64 {
        patches[range.clone()].iter().map(|&p| scene.cell_area(p) * scene.emission(p).luminance()).sum()
    };
    let total = power(&(0..patches.len()));
    while ranges.len() < PARTS {
        let is_large = |r: &Range<usize>| r.len() >= LEAST_CELLS && power(r) > LARGE * total;
        if !ranges.iter().any(is_large) {
            break;
        }
        let halves = |r: Range<usize>| match is_large(&r) {
            true => vec![r.start..r.start + r.len() / 2, r.start + r.len() / 2..r.end],
            false => vec![r],
        };
        ranges = ranges.into_iter().flat_map(halves).collect();
    }
    ranges
}

/// True if two triangles have two corners in common.
fn share_an_edge(scene: &PatchScene, a: u32, b: u32) -> bool {
    let (a, b) = (scene.corners(a), scene.corners(b));
    a.iter().filter(|p| b.contains(p)).count() == 2
}

/// Luminance of the power of lights, W.
fn luminance(lights: &[PointLight]) -> f64 {
    lights.iter().map(|light| light.power().luminance()).sum()
}

/// Lights without area by lamp: each one alone, and neighbours in the list where there are very many; never near and far
/// ones together.
fn points(scene: &PatchScene) -> Vec<Range<usize>> {
    let lights = scene.lights();
    let size = lights.len().div_ceil(MOST_LAMPS).max(1);
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for (k, light) in lights.iter().enumerate() {
        match ranges.last_mut() {
            Some(last) if last.len() < size && lights[last.start].is_distant() == light.is_distant() => {
                last.end = k + 1
            }
            _ => ranges.push(k..k + 1),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use twinray_scene::sample::Stream;
    use twinray_scene::{Environment, LightKind, PatchOptions, PunctualLight, Rgb, builtin};
    use twinray_testkit::chi2;

    /// Shadow rays to lights without area: the mean of radiance / density over choices is what all of them give to a point,
    /// ten of them beside a lamp and a sky; five standard errors.
    #[test]
    fn lights_without_area_give_what_they_should() {
        let mut authored = builtin::cube(0.5);
        let place = |k: usize| DVec3::new(0.1 * k as f64 - 0.5, 0.3, 0.2);
        authored.lights = (0..10)
            .map(|k| PunctualLight {
                name: format!("{k}"),
                kind: match k % 3 {
                    0 => LightKind::Point,
                    1 => LightKind::Spot { inner: 0.5, outer: 1.5 },
                    _ => LightKind::Directional,
                },
                intensity: Rgb::grey(1.0 + k as f64),
                transform: DAffine3::from_translation(place(k)) * DAffine3::from_rotation_x(-1.0),
                profile: None,
            })
            .collect();
        authored.environment = Some(Environment::Uniform(Rgb::WHITE));
        let scene = PatchScene::new(&authored, PatchOptions::default()).unwrap();
        let lights = Lights::new(&scene);
        let point = DVec3::new(0.13, -0.21, 0.08);
        let expected: f64 = scene.lights().iter().map(|l| l.illuminate(point).unwrap().irradiance.g).sum();
        let mut random = Stream::new(4, 0, 0);
        let (mut sum, mut squares) = (0.0, 0.0);
        let n = 100_000;
        for _ in 0..n {
            let [choice, s, t] = std::array::from_fn(|_| random.uniform());
            let Some(light) = lights.sample(point, choice, [s, t]).filter(|l| l.is_sharp) else { continue };
            // A ray of a BRDF has no part in it.
            assert_eq!(light.density / (light.density + 1e6), 1.0);
            let gives = light.radiance.g / light.density;
            (sum, squares) = (sum + gives, squares + gives * gives);
        }
        let n = f64::from(n);
        let error = ((squares / n - (sum / n).powi(2)) / n).sqrt();
        assert!(
            (sum / n - expected).abs() < 5.0 * error && error < 0.02 * expected,
            "{} ± {error}, {expected}",
            sum / n
        );
        // Nothing is chosen where all of it is black.
        authored.lights.truncate(1);
        authored.lights[0].intensity = Rgb::BLACK;
        authored.environment = Some(Environment::Uniform(Rgb::BLACK));
        authored.materials.iter_mut().for_each(|m| m.emission = Rgb::BLACK);
        let dark = PatchScene::new(&authored, PatchOptions::default()).unwrap();
        let lights = Lights::new(&dark);
        assert!(lights.sample(point, 0.5, [0.5; 2]).is_none() && lights.sky_density(DVec3::Y) == 0.0);
    }

    /// Samples from a point in the cube, all of whose faces shine, some under a sky as well, against the density of
    /// what a ray meets in each direction. 5 tests, each with a false-alarm rate of 1 %.
    #[test]
    fn samples_follow_their_density() {
        for (sky, open, even) in
            [(false, false, false), (true, true, false), (true, false, false), (false, false, true), (true, true, true)]
        {
            let mut authored = builtin::cube(0.5);
            for (i, material) in authored.materials.iter_mut().enumerate() {
                material.emission = Rgb::grey(1.0 + i as f64);
            }
            if open {
                // Without the mesh of the sides, the sky shines in between floor and ceiling.
                authored.instances.retain(|i| authored.materials[authored.meshes[i.mesh].material].name != "side");
            }
            authored.environment = sky.then_some(Environment::Uniform(Rgb::WHITE));
            let scene = PatchScene::new(&authored, PatchOptions::default()).unwrap();
            let lights = Lights::new(&scene);
            let point = DVec3::new(0.13, -0.21, 0.08);
            // As places choose that have learnt: parts of the sky beside the whole of it.
            let evenly = Choice::new(&vec![1.0; lights.len()]).unwrap();
            let by = if even { &evenly } else { lights.by_power() };
            let mut random = Stream::new(3, 0, 0);
            let samples = (0..400_000).map(|_| {
                let [choice, s, t] = std::array::from_fn(|_| random.uniform());
                let sample = lights.sample_by(by, point, choice, [s, t])?;
                // A sky behind walls is sampled too; the density below is that of what a ray meets.
                let hit = scene.trace(point, sample.towards);
                (hit.is_none() == sample.end.is_none()).then(|| sample.towards.to_array())
            });
            let density = |d: [f64; 3]| {
                let d = DVec3::from_array(d);
                scene.trace(point, d).map_or(lights.sky_density_by(by, d), |hit| {
                    let patch = scene.patch_of(&hit).expect("only fronts are seen from within");
                    lights.density_by(by, point, patch, scene.point_of(hit.triangle, hit.u, hit.v))
                })
            };
            let p = chi2::sphere(samples, density, 10, 20).p_value;
            println!("sky {sky}, open {open}, even {even}: p = {p:.3}");
            assert!(p > 0.01, "sky {sky}, open {open}, even {even}: p = {p}");
        }
    }
}
