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
    /// Occupied cubes in order.
    occupied: Vec<IVec3>,
}

impl Grid {
    /// A grid of cubes of the given edge over `points`.
    pub fn new(edge: f64, points: &[DVec3]) -> Self {
        let cube = |p: DVec3| (p / edge).floor().as_ivec3();
        let mut numbers: Vec<u32> = (0..points.len() as u32).collect();
        numbers.sort_by_key(|&k| (cube(points[k as usize]).to_array(), k));
        let (mut cubes, mut occupied) = (HashMap::new(), Vec::new());
        for (i, &k) in numbers.iter().enumerate() {
            let place = cube(points[k as usize]);
            let range = cubes.entry(place).or_insert_with(|| {
                occupied.push(place);
                (i as u32, i as u32)
            });
            range.1 = i as u32 + 1;
        }
        Self { edge, points: numbers, cubes, occupied }
    }

    /// The points of every occupied cube, cubes in no order.
    pub fn cubes(&self) -> impl Iterator<Item = &[u32]> {
        self.cubes.values().map(|&(a, b)| &self.points[a as usize..b as usize])
    }

    /// All points that may lie within `radius` of `point`, in an order that depends on the points alone.
    pub fn near(&self, point: DVec3, radius: f64) -> impl Iterator<Item = u32> {
        let low = ((point - radius) / self.edge).floor().as_ivec3();
        let high = ((point + radius) / self.edge).floor().as_ivec3();
        let sides = (high - low).as_dvec3() + 1.0;
        // Where a large radius meets few points, most cubes are empty. The order is the same.
        let is_sparse = sides.element_product() > self.occupied.len() as f64;
        let few = is_sparse.then(|| self.occupied.iter().copied()).into_iter().flatten();
        let all =
            (!is_sparse).then_some((low.x..=high.x).flat_map(move |x| {
                (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| IVec3::new(x, y, z)))
            }));
        let cubes = few.filter(move |c| c.cmpge(low).all() && c.cmple(high).all()).chain(all.into_iter().flatten());
        cubes.filter_map(|c| self.cubes.get(&c)).flat_map(|&(a, b)| &self.points[a as usize..b as usize]).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All that is near is found, once, and in the order of the cubes, whether these are looked at or those that have points.
    #[test]
    fn near_points_are_found_in_order() {
        let points: Vec<DVec3> =
            (0..200u32).map(|k| DVec3::new(0.754_877, 0.569_84, 0.31).map(|s| (f64::from(k) * s).fract())).collect();
        let grid = Grid::new(0.2, &points);
        for radius in [0.05, 0.3, 40.0] {
            let found: Vec<u32> = grid.near(DVec3::splat(0.4), radius).collect();
            let near = (0..200).filter(|&k: &u32| points[k as usize].distance(DVec3::splat(0.4)) < radius);
            assert!(near.clone().all(|k| found.contains(&k)), "{radius}");
            let order = |k: u32| ((points[k as usize] / 0.2).floor().as_ivec3().to_array(), k);
            assert!(found.windows(2).all(|w| order(w[0]) < order(w[1])), "{radius}");
        }
        assert_eq!(grid.near(DVec3::splat(0.4), 40.0).count(), 200);
    }
}
