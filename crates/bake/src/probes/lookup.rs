//! A volume read at any point, as consumers of the neutral file are to: trilinear among the eight probes around it, but
//! without those that a wall hides from it.

use glam::DVec3;
use twinray_scene::Rgb;

use super::ProbeVolume;
use super::harmonics::Harmonics;

/// Shares of the free distance over which a probe fades out before a wall.
const FADE: f32 = 0.1;

impl ProbeVolume {
    /// Irradiance, W·m⁻² (or lux), at a point of the world on a surface with this unit normal.
    pub fn irradiance(&self, point: DVec3, normal: DVec3) -> Rgb {
        self.at(point).irradiance(normal)
    }

    /// The light at a point of the world; outside of the grid that at its rim.
    pub fn at(&self, point: DVec3) -> Harmonics {
        let grid = &self.grid;
        let place = ((point - DVec3::from_array(grid.low)) / DVec3::from_array(grid.cell) - 0.5)
            .clamp(DVec3::ZERO, DVec3::from_array(grid.counts.map(|n| f64::from(n - 1))));
        let first = place.floor();
        let mut sums = (Harmonics::default(), 0.0);
        let (mut best, mut most) = (None, 0.0);
        for corner in 0..8u8 {
            let step = DVec3::from_array([0, 1, 2].map(|axis| f64::from(corner >> axis & 1)));
            let Some(probe) = grid.probe_at((first + step).to_array().map(|c| c as i64)) else { continue };
            let away = place - (first + step);
            let trilinear = ((1.0 - away.x.abs()) * (1.0 - away.y.abs()) * (1.0 - away.z.abs())) as f32;
            let weight = trilinear * self.validity[probe];
            if weight <= 0.0 {
                continue;
            }
            // From where the light was taken.
            let moved = DVec3::from_array(self.offset[probe].map(f64::from)) / DVec3::from_array(grid.cell);
            let way = self.way_to_wall(probe, away - moved);
            // 0 at the wall and behind it; 1 wherever the point is nearer than most of the way to it.
            let clear = ((1.0 - way) / FADE).clamp(0.0, 1.0);
            sums.0.add(&self.radiance[probe], weight * clear);
            sums.1 += weight * clear;
            // Whoever is in reach of none takes the one that comes nearest.
            let reach = weight / way.max(1.0).powi(8);
            if reach > most {
                (best, most) = (Some(probe), reach);
            }
        }
        if sums.1 > 0.0 {
            let mut light = Harmonics::default();
            light.add(&sums.0, 1.0 / sums.1);
            return light;
        }
        // Nothing valid around: what the nearest probe was filled with.
        let nearest = place.round().to_array().map(|c| c as i64);
        best.or_else(|| grid.probe_at(nearest)).map_or(Harmonics::default(), |probe| self.radiance[probe])
    }

    /// The way from a probe to a point that is `away` of it, in boxes, over the free distance in that direction.
    fn way_to_wall(&self, probe: usize, away: DVec3) -> f32 {
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| away[b].abs().total_cmp(&away[a].abs()));
        // The direction is a mixture of those to a face's, an edge's and a corner's neighbour.
        let mut step = [0; 3];
        let mut sum = 0.0;
        for (k, &axis) in order.iter().enumerate() {
            step[axis] = if away[axis] < 0.0 { -1 } else { 1 };
            let next = order.get(k + 1).map_or(0.0, |&n| away[n].abs());
            sum += (away[axis].abs() - next) as f32 * self.nearness[probe][number(step)];
        }
        sum
    }
}

/// Number of a step among the neighbours.
fn number(step: [i32; 3]) -> usize {
    let k = (step[0] + 1) + 3 * (step[1] + 1) + 9 * (step[2] + 1);
    (if k < 13 { k } else { k - 1 }) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probes::neighbours;

    #[test]
    fn steps_know_their_numbers() {
        for (k, step) in neighbours().into_iter().enumerate() {
            assert_eq!(number(step), k);
        }
    }
}
