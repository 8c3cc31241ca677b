//! Scenes for measurements: rectangles and triangles in named groups, one patch a triangle, and groups' mean irradiance.

use std::f64::consts::PI;
use std::ops::Index;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use twinray::scene::{
    Environment, Instance, Material, Mesh, PatchBudget, PatchOptions, PatchScene, Rgb, Scene, Surface, Texel,
};
use twinray::solve::{Params, PowerBalance, Shares, Solution, Solver};

use crate::factors::Range;

/// What the mean irradiance of a closed room of albedo ρ may be low by with the default preset, relative.
///
/// All rays of a solve are one low-discrepancy sequence, and the state that later rays start from follows the earlier
/// ones, so the two are not independent. In the furnace (2000 patches, 2²⁰ rays) the mean is low by 4 · 10⁻⁵ at ρ = 0.5, by
/// 1.2 · 10⁻⁴ at 0.8 and by 3.5 · 10⁻⁴ at 0.95, about 2 · 10⁻⁵/(1−ρ). It goes with the share of even starts, and is not there
/// (2 · 10⁻⁶) without them, nor where every wave is scrambled anew: but that makes the RMS error 15 % to 25 % larger. Twice
/// what was measured is allowed.
pub fn sequence_bias(albedo: f64) -> f64 {
    4e-5 / (1.0 - albedo)
}

/// Independent solves behind each number.
pub const REPLICAS: u64 = 16;

/// A rectangle: a corner and two sides; its front is the one that the cross product of the sides points out of.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// A corner, m.
    pub corner: DVec3,
    /// First side.
    pub u: DVec3,
    /// Second side.
    pub v: DVec3,
}

impl Rectangle {
    /// From corner and sides.
    pub fn new(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Self {
        Self { corner: corner.into(), u: u.into(), v: v.into() }
    }

    /// The same with its front on the other side.
    pub fn flipped(self) -> Self {
        Self { u: self.v, v: self.u, ..self }
    }

    /// The point at (`s`, `t`) of the unit square.
    pub fn at(&self, s: f64, t: f64) -> DVec3 {
        self.corner + self.u * s + self.v * t
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.u.cross(self.v).normalize()
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.u.cross(self.v).length()
    }

    /// Corners in order.
    pub fn polygon(&self) -> Vec<DVec3> {
        vec![self.at(0.0, 0.0), self.at(1.0, 0.0), self.at(1.0, 1.0), self.at(0.0, 1.0)]
    }

    /// Cut into `n` × `m` equal ones.
    pub fn cut(&self, [n, m]: [usize; 2]) -> Vec<Self> {
        let (u, v) = (self.u / n as f64, self.v / m as f64);
        let places = (0..m).flat_map(|j| (0..n).map(move |i| (i as f64, j as f64)));
        places.map(|(i, j)| Self { corner: self.corner + u * i + v * j, u, v }).collect()
    }

    /// The eight rectangles around the hole s × t (shares of the sides), and the hole.
    pub fn around(&self, s: Range, t: Range) -> (Vec<Self>, Self) {
        let steps = |r: Range| [[0.0, r[0]], r, [r[1], 1.0]];
        let part = |s: Range, t: Range| Self {
            corner: self.at(s[0], t[0]),
            u: self.u * (s[1] - s[0]),
            v: self.v * (t[1] - t[0]),
        };
        let places = (0..9).filter(|&k| k != 4).map(|k| (steps(s)[k % 3], steps(t)[k / 3]));
        // A hole at a border leaves nothing there.
        let rest = places.filter(|(s, t)| s[1] > s[0] && t[1] > t[0]).map(|(s, t)| part(s, t));
        (rest.collect(), part(s, t))
    }

    /// Mean of `f`(point, normal) over the rectangle, n × n Gauss points.
    pub fn mean(&self, n: usize, f: impl Fn(DVec3, DVec3) -> f64) -> f64 {
        crate::quadrature::mean([0.0, 1.0], [0.0, 1.0], n, |s, t| f(self.at(s, t), self.normal()))
    }
}

/// Patches whose mean irradiance is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group(usize);

/// A scene under construction.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    scene: Scene,
    /// Group of each triangle, in order.
    group_of: Vec<usize>,
    groups: usize,
}

impl Rig {
    /// A one-sided Lambertian material; `exitance` is the emitted radiosity, W·m⁻².
    pub fn material(&mut self, albedo: f64, exitance: f64) -> usize {
        self.scene.materials.push(Material {
            surface: Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(albedo)) },
            emission: Rgb::grey(exitance / PI),
            ..Material::default()
        });
        self.scene.materials.len() - 1
    }

    /// A new group.
    pub fn group(&mut self) -> Group {
        self.groups += 1;
        Group(self.groups - 1)
    }

    /// A uniform sky of the given radiance all around.
    pub fn sky(&mut self, radiance: f64) {
        self.scene.environment = Some(Environment::Uniform(Rgb::grey(radiance)));
    }

    /// Adds triangles, counter-clockwise seen from the front; each becomes one patch.
    pub fn triangles(&mut self, group: Group, material: usize, positions: &[DVec3], triangles: &[[u32; 3]]) {
        self.group_of.extend(std::iter::repeat_n(group.0, triangles.len()));
        let mesh = self.scene.meshes.len();
        self.scene.meshes.push(Mesh {
            positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
            triangles: triangles.to_vec(),
            material,
            ..Mesh::default()
        });
        self.scene.instances.push(Instance { name: String::new(), mesh, transform: DAffine3::IDENTITY });
    }

    /// Adds a rectangle as `cuts` rectangles of two triangles each.
    pub fn rectangle(&mut self, group: Group, material: usize, rectangle: &Rectangle, cuts: [usize; 2]) {
        let [n, m] = cuts;
        let share = |i: usize, n: usize| i as f64 / n as f64;
        let positions: Vec<DVec3> = (0..=m)
            .flat_map(|j| (0..=n).map(move |i| (share(i, n), share(j, m))))
            .map(|(s, t)| rectangle.at(s, t))
            .collect();
        let mut triangles = Vec::new();
        for j in 0..m {
            for i in 0..n {
                let a = (j * (n + 1) + i) as u32;
                let (b, c, d) = (a + 1, a + n as u32 + 2, a + n as u32 + 1);
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        self.triangles(group, material, &positions, &triangles);
    }

    /// The scene, one patch a triangle.
    ///
    /// # Panics
    /// If it is empty, or a triangle has no area: its group would belong to another.
    pub fn cut(&self) -> PatchScene {
        let options = PatchOptions { budget: PatchBudget::Size(f64::INFINITY), two_sided: false };
        let scene = PatchScene::new(&self.scene, options).expect("a rig has triangles");
        assert_eq!(scene.len(), self.group_of.len(), "a triangle without an area");
        scene
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.group_of.len()
    }

    /// True before anything was added.
    pub fn is_empty(&self) -> bool {
        self.group_of.is_empty()
    }

    /// Areas of the groups, m².
    pub fn areas(&self) -> Areas {
        let scene = self.cut();
        let mut areas = vec![0.0; self.groups];
        scene.patches().for_each(|p| areas[self.group_of[p.index()]] += scene.area(p));
        Areas(areas)
    }

    /// Mean irradiance of each group in independent solves with `params`, whose seed is that of the first.
    pub fn measure(&self, params: &Params, rays: u64) -> Measured {
        let scene = self.cut();
        let runs = replicas(&scene, params, rays, REPLICAS, |solution| {
            let mut sums = vec![(0.0, 0.0); self.groups];
            for p in scene.patches() {
                let (power, area) = &mut sums[self.group_of[p.index()]];
                *power += scene.area(p) * solution.irradiance(p).luminance();
                *area += scene.area(p);
            }
            let means: Vec<f64> = sums.iter().map(|(power, area)| power / area).collect();
            (means, solution.balance())
        });
        Measured {
            means: (0..self.groups).map(|g| runs.iter().map(|run| run.0[g]).collect()).collect(),
            balances: runs.iter().map(|run| run.1).collect(),
        }
    }
}

/// What `look` makes of independent solves; seeds follow on that of `params`.
pub fn replicas<T: Send>(
    scene: &PatchScene,
    params: &Params,
    rays: u64,
    count: u64,
    look: impl Fn(&Solution) -> T + Sync,
) -> Vec<T> {
    let run = |k: u64| {
        let params = Params { seed: params.seed + k, ..params.clone() };
        let mut solver = Solver::new(scene, params, None).expect("validation scenes have light");
        solver.run(rays.max(1));
        look(&solver.solution())
    };
    (0..count).into_par_iter().map(run).collect()
}

/// Settings for sensors: most rays start evenly, so that small patches get their share, and no warm start, which
/// shoots by power alone and would leave its noise there. The estimators are the same.
///
/// Without a warm start the first wave knows emission (and sky) only: see [`unreflected_share`].
pub fn sensor_params(seed: u64) -> Params {
    Params { shares: Some(Shares::even(0.9, 0.05)), warm_start: 0.0, ..Params::default_preset(seed) }
}

/// Share of the light of one reflection that is missing after `rays` rays with [`sensor_params`]: a solve is two
/// replicas with half of the rays each, whose first wave is half as many rays as there are patches, at least 1024, and
/// starts from emission alone. All later waves know what was reflected.
pub fn unreflected_share(patches: usize, rays: u64) -> f64 {
    (patches as f64 / 2.0).max(1024.0) / (rays as f64 / 2.0)
}

/// Areas by group.
#[derive(Clone, Debug)]
pub struct Areas(Vec<f64>);

impl Index<Group> for Areas {
    type Output = f64;
    fn index(&self, group: Group) -> &f64 {
        &self.0[group.0]
    }
}

/// Mean irradiance by group and replica.
#[derive(Clone, Debug)]
pub struct Measured {
    means: Vec<Vec<f64>>,
    balances: Vec<PowerBalance>,
}

impl Measured {
    /// Where the light went, per replica.
    pub fn balances(&self) -> &[PowerBalance] {
        &self.balances
    }

    /// Area-weighted means over several groups, per replica.
    pub fn mean_of(&self, groups: &[Group], areas: &Areas) -> Vec<f64> {
        let total: f64 = groups.iter().map(|&g| areas[g]).sum();
        (0..REPLICAS as usize).map(|k| groups.iter().map(|&g| self[g][k] * areas[g]).sum::<f64>() / total).collect()
    }
}

impl Index<Group> for Measured {
    type Output = [f64];
    fn index(&self, group: Group) -> &[f64] {
        &self.means[group.0]
    }
}
