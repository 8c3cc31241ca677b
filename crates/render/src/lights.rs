//! What shines, as directions from a point: emitting patches and the sky, sampled and with their density.
//!
//! A patch is chosen by the power of its mean emission and a point of it uniformly; what is emitted there is taken
//! at the very point. Visibility is the caller's.

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, Rgb, Side};

/// The most candidates for one shadow ray.
const MOST_CANDIDATES: u32 = 8;

/// All that emits in a scene.
pub(crate) struct Lights<'a> {
    scene: &'a PatchScene,
    /// Emitting patches.
    patches: Vec<PatchId>,
    /// Running sum of their area × luminance of the mean emission.
    cumulative: Vec<f64>,
    /// Probability of choosing the sky.
    sky_share: f64,
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
        let cumulative = cumulative.collect();
        // Half and half: how much of the sky gets in is not known, and a path in the dark costs a ray at most.
        let sky_share = match (scene.environment().is_some(), patches.is_empty()) {
            (true, true) => 1.0,
            (true, false) => 0.5,
            (false, _) => 0.0,
        };
        Self { scene, patches, cumulative, sky_share }
    }

    /// A direction from `point` about proportional to what shines there. `None` where the choice shines elsewhere: a
    /// hole, a back, or no light at all. The density then integrates to less than one.
    pub fn sample(&self, point: DVec3, choice: f64, [s, t]: [f64; 2]) -> Option<LightSample> {
        if choice < self.sky_share {
            let sky = self.scene.environment()?;
            let towards = sky.sample_direction([s, t]);
            let density = self.sky_density(towards);
            return Some(LightSample { towards, density, radiance: sky.radiance(towards), end: None });
        }
        let total = *self.cumulative.last()?;
        let within = (choice - self.sky_share) / (1.0 - self.sky_share) * total;
        let index = self.cumulative.partition_point(|&c| c <= within).min(self.patches.len() - 1);
        let patch = self.patches[index];
        let triangle = self.scene.triangle_of(patch);
        let [u, v] = self.scene.cell_place_at(patch, s, t);
        if !self.scene.is_present(triangle, u, v) {
            return None;
        }
        let (end, normal) = (self.scene.point_of(triangle, u, v), self.scene.normal(patch));
        let towards = (end - point).try_normalize()?;
        let density = self.density(point, patch, end);
        let radiance = self.scene.emission_at(triangle, Side::Front, u, v);
        (density > 0.0).then_some(LightSample { towards, density, radiance, end: Some((end, normal)) })
    }

    /// Density per solid angle with which [`Lights::sample`] chooses the direction from `point` to `end` on `patch`;
    /// 0 on the back of a lamp and where nothing emits.
    pub fn density(&self, point: DVec3, patch: PatchId, end: DVec3) -> f64 {
        let luminance = self.scene.emission(patch).luminance();
        let between = end - point;
        let cosine = -between.dot(self.scene.normal(patch));
        if luminance <= 0.0 || cosine <= 0.0 {
            return 0.0;
        }
        let total = self.cumulative.last().copied().unwrap_or(f64::INFINITY);
        // Per area it is luminance / total; |between|³ since the cosine above still has the length in it.
        (1.0 - self.sky_share) * luminance / total * between.length_squared() * between.length() / cosine
    }

    /// How many candidates are worth their while where one of them is chosen: many lamps need many.
    pub fn candidates(&self) -> u32 {
        let mut triangles: Vec<u32> = self.patches.iter().map(|&p| self.scene.triangle_of(p)).collect();
        triangles.dedup();
        let lamps = triangles.len() as u32 / 2 + u32::from(self.sky_share > 0.0);
        lamps.clamp(1, MOST_CANDIDATES)
    }

    /// Density per solid angle with which [`Lights::sample`] chooses `towards` for the sky.
    pub fn sky_density(&self, towards: DVec3) -> f64 {
        self.scene.environment().map_or(0.0, |sky| self.sky_share * sky.pdf_direction(towards))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::Stream;
    use twinray_scene::{Environment, PatchOptions, Rgb, builtin};
    use twinray_testkit::chi2;

    /// Samples from a point in the cube, all of whose faces shine, some under a sky as well, against the density of
    /// what a ray meets in each direction. 3 tests, each with a false-alarm rate of 1 %.
    #[test]
    fn samples_follow_their_density() {
        for (sky, open) in [(false, false), (true, true), (true, false)] {
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
            let mut random = Stream::new(3, 0, 0);
            let samples = (0..400_000).map(|_| {
                let [choice, s, t] = std::array::from_fn(|_| random.uniform());
                let sample = lights.sample(point, choice, [s, t])?;
                // A sky behind walls is sampled too; the density below is that of what a ray meets.
                let hit = scene.trace(point, sample.towards);
                (hit.is_none() == sample.end.is_none()).then(|| sample.towards.to_array())
            });
            let density = |d: [f64; 3]| {
                let d = DVec3::from_array(d);
                scene.trace(point, d).map_or(lights.sky_density(d), |hit| {
                    let patch = scene.patch_of(&hit).expect("only fronts are seen from within");
                    lights.density(point, patch, scene.point_of(hit.triangle, hit.u, hit.v))
                })
            };
            let p = chi2::sphere(samples, density, 10, 20).p_value;
            println!("sky {sky}, open {open}: p = {p:.3}");
            assert!(p > 0.01, "sky {sky}, open {open}: p = {p}");
        }
    }
}
