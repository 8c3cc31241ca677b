//! What is near a point: a uniform grid over points.

use std::collections::HashMap;

use glam::{DVec3, IVec3};

/// Numbered points by the grid cube they lie in.
#[derive(Debug)]
pub struct Grid {
    edge: f64,
    /// Numbers of the points, sorted by cube, then by number.
    points: Vec<u32>,
    /// Range of `points` in each occupied cube.
    cubes: HashMap<IVec3, (u32, u32)>,
}

impl Grid {
    /// A grid of cubes of the given edge over `points`.
    pub fn new(edge: f64, points: &[DVec3]) -> Self {
        let cube = |p: DVec3| (p / edge).floor().as_ivec3();
        let mut numbers: Vec<u32> = (0..points.len() as u32).collect();
        numbers.sort_by_key(|&k| (cube(points[k as usize]).to_array(), k));
        let mut cubes = HashMap::new();
        for (i, &k) in numbers.iter().enumerate() {
            let range = cubes.entry(cube(points[k as usize])).or_insert((i as u32, i as u32));
            range.1 = i as u32 + 1;
        }
        Self { edge, points: numbers, cubes }
    }

    /// The points of every occupied cube, cubes in no order.
    pub fn cubes(&self) -> impl Iterator<Item = &[u32]> {
        self.cubes.values().map(|&(a, b)| &self.points[a as usize..b as usize])
    }

    /// All points that may lie within `radius` of `point`, in an order that depends on the points alone.
    pub fn near(&self, point: DVec3, radius: f64) -> impl Iterator<Item = u32> {
        let low = ((point - radius) / self.edge).floor().as_ivec3();
        let high = ((point + radius) / self.edge).floor().as_ivec3();
        let cubes = (low.x..=high.x)
            .flat_map(move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| IVec3::new(x, y, z))));
        cubes.filter_map(|c| self.cubes.get(&c)).flat_map(|&(a, b)| &self.points[a as usize..b as usize]).copied()
    }
}
