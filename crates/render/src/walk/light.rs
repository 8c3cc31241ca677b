//! The light of nodes, anew for every solution: surfaces are searched once.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::{PatchScene, Rgb};
use twinray_solve::Solution;

use super::lobes::{BASIS, Lobes, Moments, basis};
use super::nodes::Nodes;
use crate::lights::Lights;
use crate::reconstruct::{Reconstruction, Surfaces};

/// What a viewer is told of the light.
#[derive(Clone, Debug)]
pub struct NodeLight {
    /// Per node: irradiance, W·m⁻² (or lux), smooth over the surface.
    pub irradiance: Vec<[f32; 3]>,
    /// Per node: relative standard error of the irradiance of its cell, luminance; infinite where no light arrived.
    pub error: Vec<f32>,
    /// Per glossy node: radiance of all directions as the factors of [`super::basis`], W·sr⁻¹·m⁻² (or nit).
    pub radiance: Vec<[[f32; 3]; BASIS]>,
    /// Per glossy node: light straight from what emits.
    pub lamps: Vec<Lamp>,
}

/// Light straight from all that emits, as if it came from about one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lamp {
    /// Radiance over all directions, W·m⁻² (or lux): irradiance of a surface that faces it.
    pub radiance: [f32; 3],
    /// Mean direction by luminance: a unit vector times how much directions agree, 1 where all are the same.
    pub towards: [f32; 3],
}

/// The remembered sample of a glossy cell, scaled so that its reflection is right in the mean over solutions.
/// Paper: §2.1, the representative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Irradiance, W·m⁻² (or lux); black without a sample.
    pub irradiance: [f32; 3],
    /// Unit vector to where it came from.
    pub direction: [f32; 3],
}

/// Makes nodes' light of solutions of one scene.
#[derive(Debug)]
pub struct WalkLight<'a> {
    scene: &'a PatchScene,
    nodes: &'a Nodes,
    /// `None` only while a reconstruction has them.
    surfaces: Option<Surfaces>,
    lobes: Lobes,
}

impl<'a> WalkLight<'a> {
    /// Of the nodes of a scene.
    pub fn new(scene: &'a PatchScene, nodes: &'a Nodes) -> Self {
        Self { scene, nodes, surfaces: None, lobes: Lobes::default() }
    }

    /// A first light, at once: every node has that of its own cell, and glossy ones see the same from all sides.
    pub fn rough(&self, solution: &Solution) -> NodeLight {
        let places = &self.nodes.places;
        let irradiance: Vec<[f32; 3]> = places.iter().map(|p| solution.irradiance(p.patch).to_f32()).collect();
        // The only factor of evenly distributed light is E/π over Y00.
        let even = (1.0 / (std::f64::consts::PI * basis(DVec3::Z)[0])) as f32;
        let radiance = irradiance[..self.nodes.glossy_nodes].iter().map(|e| {
            let mut moments = [[0.0; 3]; BASIS];
            moments[0] = e.map(|c| c * even);
            moments
        });
        let (radiance, lamps) = (radiance.collect(), vec![Lamp::default(); self.nodes.glossy_nodes]);
        NodeLight { radiance, lamps, error: self.errors(solution), irradiance }
    }

    /// The light of a solution. Radiance at glossy nodes is the mean over `rounds` gathers from this solution and those
    /// before, each weighed by its rays: what is less exact counts less.
    pub fn of(&mut self, solution: &Solution, rounds: u32) -> NodeLight {
        let surfaces = self.surfaces.take().unwrap_or_else(|| Surfaces::new(self.scene));
        let reconstruction = Reconstruction::over(self.scene, solution, surfaces);
        let places = &self.nodes.places;
        let irradiance =
            places.par_iter().map(|p| reconstruction.smooth(p.patch, &p.hit).irradiance.to_f32()).collect();
        self.surfaces = Some(reconstruction.into_surfaces());
        if self.nodes.glossy_nodes > 0 {
            let lights = Lights::new(self.scene);
            for _ in 0..rounds {
                self.lobes.gather(self.scene, &lights, self.nodes, solution, solution.rays().max(1) as f64);
            }
        }
        let radiance = self.lobes.means().map(|moments| moments.radiance.map(Rgb::to_f32)).collect();
        let lamp = |m: Moments| {
            let luminance = m.lamps.luminance();
            let towards = if luminance > 0.0 { m.towards / luminance } else { DVec3::ZERO };
            Lamp { radiance: m.lamps.to_f32(), towards: towards.to_array().map(|x| x as f32) }
        };
        let lamps = self.lobes.means().map(lamp).collect();
        NodeLight { irradiance, error: self.errors(solution), radiance, lamps }
    }

    fn errors(&self, solution: &Solution) -> Vec<f32> {
        let error =
            |patch| solution.standard_error(patch) / solution.irradiance(patch).luminance().max(f64::MIN_POSITIVE);
        self.nodes.places.iter().map(|p| error(p.patch) as f32).collect()
    }

    /// What the glossy cells remember in a solution, in the order of [`Nodes::first_cells`].
    pub fn samples(&self, solution: &Solution) -> Vec<Sample> {
        let sample = |patch| match solution.representative(patch) {
            Some((irradiance, towards)) => {
                Sample { irradiance: irradiance.to_f32(), direction: DVec3::to_array(&towards).map(|x| x as f32) }
            }
            None => Sample::default(),
        };
        self.nodes.glossy_patches.iter().map(|&p| sample(p)).collect()
    }
}
