//! What one camera ray of a gather sees, up to where pixels share: the first point that scatters, and the light that one
//! ray of its BRDF finds.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::brdf::{Towards, attenuated};
use twinray_scene::sample::PixelSample;
use twinray_scene::{PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use super::guide::{Aim, Guide};
use crate::direct::{Shadows, direct, is_straight, weights};
use crate::lights::Lights;
use crate::picture::first_side;
use crate::reconstruct::Reconstruction;
use crate::vertex::{Look, Step, Vertex};

/// A gather ray shorter than so many sides of the cell that it meets is not trusted to see it as even.
const SHORT: f64 = 2.0;
/// Points that scatter before a path ends in any case.
const MOST_SCATTERED: u32 = 5;
/// Surfaces that a path meets at most.
const MOST_MET: u32 = 32;
/// Densities per solid angle above which a ray tells single cells apart, and is shown them smoothed.
const NARROW: f64 = 3.0;
/// Pairs of numbers that each met surface may draw.
const PAIRS: u64 = 64;
/// Of the mean irradiance, what is expected everywhere.
const DIM: f64 = 0.05;
/// The least probability with which a lobe behind the gather ray is followed.
const LEAST_SURVIVAL: f64 = 0.05;

/// Makes samples of a picture.
pub(super) struct Estimator<'a> {
    scene: &'a PatchScene,
    solution: &'a Solution,
    reconstruction: Reconstruction<'a>,
    pub lights: Lights<'a>,
    /// Over area, luminance, W·m⁻².
    mean_irradiance: f64,
}

/// What a camera ray found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sight<'g> {
    /// Light that was seen: in mirrors and through glass too.
    pub lights: Rgb,
    /// The first point that scatters.
    pub point: Option<Point<'g>>,
    /// Nothing was met.
    pub empty: bool,
}

/// A point that scatters towards the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<'g> {
    pub vertex: Vertex,
    /// The BRDF as the eye sees it, and where light is known to come from.
    pub aim: Aim<'g>,
    /// Of the way to the eye.
    pub throughput: Rgb,
    /// What the solution expects of all gather rays together, about: by the irradiance there, and not nothing in the dark.
    pub expected: Rgb,
}

/// What the gather ray of a point found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathered {
    pub direction: DVec3,
    /// Density of the direction per solid angle.
    pub density: f64,
    /// Radiance of what emits where the ray ends, weighed against shadow rays.
    pub emitted: Rgb,
    /// The lamp that this is a part of.
    pub lamp: Option<usize>,
    /// Radiance that the far end scatters, and where: others may take it as well.
    pub scattered: Option<(Rgb, DVec3, DVec3)>,
    /// All other radiance.
    pub other: Rgb,
}

/// The last point of a path that scattered.
#[derive(Clone, Copy)]
struct Before<'s> {
    point: DVec3,
    /// The direction in which it went on.
    heading: DVec3,
    /// Density of the direction in which it went on.
    density: f64,
    /// Way since then.
    distance: f64,
    /// Whether a shadow ray from there may have found what is met next, and how such rays choose.
    lit: Option<Shadows<'s>>,
}

impl<'a> Estimator<'a> {
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        let lights = Lights::new(scene);
        let mean_irradiance = solution.arriving_power(scene).luminance() / scene.total_area();
        Self { scene, solution, reconstruction: Reconstruction::new(scene, solution), lights, mean_irradiance }
    }

    /// How lamps are chosen where nothing is known of a place.
    pub fn shadows(&self) -> Shadows<'_> {
        Shadows { choice: self.lights.by_power(), candidates: self.lights.candidates() }
    }

    /// Follows a camera ray of the world through mirrors and glass.
    pub fn look<'g>(
        &self,
        origin: DVec3,
        direction: DVec3,
        guide: Option<&'g Guide>,
        numbers: &mut PixelSample,
    ) -> Sight<'g> {
        let scene = self.scene;
        let mut sight = Sight::default();
        let sky = |towards| scene.environment().map_or(Rgb::BLACK, |e| e.radiance(towards));
        let Some((mut hit, mut patch)) = first_side(scene, origin - scene.centre(), direction) else {
            return Sight { lights: sky(direction), empty: true, ..sight };
        };
        let (mut direction, mut throughput, mut medium) = (direction, Rgb::WHITE, None);
        for met in 0..MOST_MET {
            numbers.jump(PAIRS * u64::from(met + 1));
            let wo = -direction;
            if let Some(coefficient) = scene.medium_before(&hit, medium) {
                throughput = throughput * attenuated(coefficient, hit.t);
            }
            sight.lights += throughput * scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            let vertex = Vertex::new(scene, &hit, patch, wo, Look::Display);
            let event = numbers.single();
            let way = match vertex.step(wo, event, || numbers.pair()) {
                Step::End => break,
                Step::Scatter(factor) => {
                    let brdf = vertex.scatter.brdf.towards(vertex.normal, wo);
                    let throughput = throughput * factor;
                    let expected = self.solution.irradiance(patch).luminance().max(DIM * self.mean_irradiance) / PI;
                    let expected = throughput * vertex.scatter.brdf.albedo(vertex.normal.dot(wo).max(0.0)) * expected;
                    sight.point = Some(Point { vertex, aim: Aim { brdf, guide }, throughput, expected });
                    break;
                }
                Step::On(way) => way,
            };
            (throughput, medium) = (throughput * way.factor, way.medium);
            let Some(next) = vertex.next(scene, way.beyond, way.direction) else {
                sight.lights += throughput * sky(way.direction);
                break;
            };
            let Some(there) = scene.patch_of(&next) else { break };
            (hit, patch, direction) = (next, there, way.direction);
        }
        sight
    }

    /// Light straight from what emits that a point reflects to the eye, and the lamp that it comes from.
    pub fn lit(&self, point: &Point, shadows: Shadows, numbers: &mut PixelSample) -> (Rgb, Option<usize>) {
        Self::jump_to_shadow_rays(numbers);
        let Point { vertex, aim, throughput, .. } = point;
        let own = |towards| aim.pdf(towards);
        let (light, lamp) = direct(self.scene, &self.lights, vertex, &aim.brdf, own, shadows, || numbers.pair());
        (*throughput * light, lamp)
    }

    /// Traces the gather ray of a point; `u` chooses its direction. `None` where the BRDF's choice is below the surface.
    pub fn gather(&self, point: &Point, u: [f64; 2], shadows: Shadows, numbers: &mut PixelSample) -> Option<Gathered> {
        let Vertex { geometric, normal, .. } = &point.vertex;
        let direction = point.aim.sample(u)?;
        let density = point.aim.pdf(direction);
        if !(normal.dot(direction) > 0.0 && density > 0.0 && geometric.dot(direction) > 0.0) {
            return None;
        }
        let mut gathered =
            Gathered { direction, density, emitted: Rgb::BLACK, lamp: None, scattered: None, other: Rgb::BLACK };
        let before =
            Before { point: point.vertex.point, heading: direction, density, distance: 0.0, lit: Some(shadows) };
        self.follow(Some(point.vertex), before, direction, numbers, &mut gathered);
        Some(gathered)
    }

    /// Radiance that arrives at a free point from `direction`, which was chosen with `density` per solid angle among rays
    /// that have a shadow ray each.
    pub fn arriving(&self, point: DVec3, direction: DVec3, density: f64, numbers: &mut PixelSample) -> Rgb {
        let mut gathered =
            Gathered { direction, density, emitted: Rgb::BLACK, lamp: None, scattered: None, other: Rgb::BLACK };
        let before = Before { point, heading: direction, density, distance: 0.0, lit: Some(self.shadows()) };
        self.follow(None, before, direction, numbers, &mut gathered);
        gathered.emitted + gathered.scattered.map_or(Rgb::BLACK, |s| s.0) + gathered.other
    }

    /// Draws on from the pairs of shadow rays.
    pub fn jump_to_shadow_rays(numbers: &mut PixelSample) {
        numbers.jump(PAIRS * u64::from(MOST_MET + 1));
    }

    /// Follows a path from `vertex`, which scattered it into `direction`, or without one from the free point before, and
    /// adds up the radiance that comes back.
    fn follow(
        &self,
        vertex: Option<Vertex>,
        before: Before<'_>,
        direction: DVec3,
        numbers: &mut PixelSample,
        gathered: &mut Gathered,
    ) {
        let scene = self.scene;
        let own = self.shadows();
        let (mut before, mut direction, mut throughput) = (before, direction, Rgb::WHITE);
        let (mut from, mut beyond) = (vertex, false);
        let (mut count, mut medium) = (1, None);
        // Whatever is found behind the first surface is its scattered light, if it scatters at all.
        let mut first: Option<(DVec3, DVec3)> = None;
        let mut radiance = Rgb::BLACK;
        for met in 0..MOST_MET {
            numbers.jump(PAIRS * u64::from(MOST_MET + 2 + met));
            let met_next = match &from {
                Some(vertex) => vertex.next(scene, beyond, direction),
                None => scene.trace(before.point, direction),
            };
            let Some(hit) = met_next else {
                if let Some(sky) = scene.environment() {
                    let weight = self.weight(&before, direction, |by| self.lights.sky_density_by(by.choice, direction));
                    let light = throughput * sky.radiance(direction) * weight;
                    if met == 0 {
                        gathered.lamp = self.lights.sky_lamp(direction);
                    }
                    *(if met == 0 { &mut gathered.emitted } else { &mut radiance }) += light;
                }
                break;
            };
            let Some(patch) = scene.patch_of(&hit) else { break };
            before.distance += hit.t;
            if let Some(coefficient) = scene.medium_before(&hit, medium) {
                throughput = throughput * attenuated(coefficient, hit.t);
            }
            let wo = -direction;
            // Behind a wide spread of directions only means count.
            let look = if before.density > NARROW { Look::Plain } else { Look::Patch };
            let vertex = Vertex::new(scene, &hit, patch, wo, look);
            let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            if !emitted.is_black() {
                let density = |by: Shadows| self.lights.density_by(by.choice, before.point, patch, vertex.point);
                let light = throughput * emitted * self.weight(&before, direction, density);
                if met == 0 {
                    gathered.lamp = self.lights.lamp_of(patch);
                }
                *(if met == 0 { &mut gathered.emitted } else { &mut radiance }) += light;
            }
            let event = numbers.pair();
            match vertex.step(wo, event[0], || numbers.pair()) {
                Step::End => break,
                Step::On(way) => {
                    throughput = throughput * way.factor;
                    before.lit = before.lit.filter(|_| way.clear);
                    (direction, beyond, medium) = (way.direction, way.beyond, way.medium);
                }
                Step::Scatter(factor) => {
                    throughput *= factor;
                    if met == 0 {
                        first = Some((vertex.point, vertex.geometric));
                    }
                    let read = self.read(&vertex, &hit, wo, &before, count, event[1]);
                    radiance += throughput * read.radiance;
                    let Some((brdf, factor)) = read.traced else { break };
                    throughput *= factor;
                    let u = numbers.pair();
                    let (light, _) =
                        direct(scene, &self.lights, &vertex, &brdf, |d| brdf.pdf(d), own, || numbers.pair());
                    radiance += throughput * light;
                    let Vertex { geometric, normal, .. } = &vertex;
                    let Some(next) = brdf.sample(u) else { break };
                    let (cosine, density) = (normal.dot(next), brdf.pdf(next));
                    if !(cosine > 0.0 && density > 0.0 && geometric.dot(next) > 0.0) {
                        break;
                    }
                    throughput = throughput * brdf.eval(next) * (cosine / density);
                    count += 1;
                    before = Before { point: vertex.point, heading: next, density, distance: 0.0, lit: Some(own) };
                    (direction, beyond, medium) = (next, false, None);
                }
            }
            if throughput.is_black() {
                break;
            }
            from = Some(vertex);
        }
        match first {
            Some((point, normal)) => gathered.scattered = Some((radiance, point, normal)),
            None => gathered.other = radiance,
        }
    }

    /// Weight of what a path met that a shadow ray could have found with density `light`.
    fn weight(&self, before: &Before, direction: DVec3, light: impl Fn(Shadows) -> f64) -> f64 {
        match before.lit {
            Some(by) if is_straight(before.heading, direction) => {
                weights(f64::from(by.candidates) * light(by), before.density)[1]
            }
            _ => 1.0,
        }
    }

    /// What the solution tells of a point, and which part of the BRDF is to be traced: all of it where the point is too
    /// near for patches to look even. Elsewhere the base's reflection is the solution's, and the lobe's is traced, with
    /// the probability of its share.
    fn read(&self, vertex: &Vertex, hit: &SurfaceHit, wo: DVec3, before: &Before, count: u32, u: f64) -> Read {
        let last = count >= MOST_SCATTERED;
        let side = self.scene.cell_area(vertex.patch).sqrt();
        if before.distance < SHORT * side && !last {
            return Read { radiance: Rgb::BLACK, traced: Some((vertex.scatter.brdf.towards(vertex.normal, wo), 1.0)) };
        }
        let brdf = &vertex.scatter.brdf;
        let cosine = vertex.normal.dot(wo).max(0.0);
        let irradiance = match before.density > NARROW {
            true => self.reconstruction.smooth(vertex.patch, hit).irradiance,
            false => self.irradiance(vertex.patch),
        };
        let lobe = brdf.lobe_albedo(cosine);
        let base = brdf.base_reflectance(cosine);
        let radiance = irradiance * (if last { base + lobe } else { base }) / PI;
        if last || lobe.is_black() {
            return Read { radiance, traced: None };
        }
        let survival = lobe.max_channel().clamp(LEAST_SURVIVAL, 1.0);
        let traced = (u < survival).then(|| (brdf.lobe_towards(vertex.normal, wo), 1.0 / survival));
        Read { radiance, traced }
    }

    fn irradiance(&self, patch: PatchId) -> Rgb {
        self.solution.irradiance(patch)
    }
}

/// What is read of the solution, and the part of a BRDF that is traced, with one over the probability of that.
struct Read {
    radiance: Rgb,
    traced: Option<(Towards, f64)>,
}
