//! Polygons to triangles: fans where that is right, ears where a corner points inwards.
//!
//! Not here: which polygons there are (`parse`). The work is bounded: a file of huge star-shaped polygons falls
//! back to fans instead of taking minutes.

use glam::{DVec2, DVec3};

/// Triangulates polygons, counting the work.
pub(super) struct Triangulator {
    /// Corner tests left before concave polygons are fanned.
    work: u64,
    /// Concave polygons that had to be fanned.
    pub(super) fanned: usize,
}

impl Default for Triangulator {
    fn default() -> Self {
        // About a second; a scan of 100,000 concave hexagons needs a hundredth of it.
        Self { work: 300_000_000, fanned: 0 }
    }
}

impl Triangulator {
    /// Memory that a polygon takes while it is split: its points, flat points, the corners left, the triangles.
    pub(super) fn bytes(&self, corners: usize) -> u64 {
        corners as u64 * 72
    }

    /// Calls `emit` with the corners of each triangle of the polygon `points`, `points.len() − 2` times, in the
    /// polygon's orientation.
    pub(super) fn split(&mut self, points: &[DVec3], mut emit: impl FnMut([usize; 3])) {
        let fan = |emit: &mut dyn FnMut([usize; 3])| (2..points.len()).for_each(|i| emit([0, i - 1, i]));
        if points.len() <= 3 {
            return fan(&mut emit);
        }
        let flat = project(points);
        if is_convex(&flat) {
            return fan(&mut emit);
        }
        let Some(ears) = self.cut_ears(&flat) else {
            self.fanned += 1;
            return fan(&mut emit);
        };
        ears.into_iter().for_each(emit);
    }

    /// Ear clipping; `None` if the work runs out.
    fn cut_ears(&mut self, flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
        let mut left: Vec<usize> = (0..flat.len()).collect();
        let mut triangles = Vec::with_capacity(flat.len() - 2);
        while left.len() > 3 {
            let n = left.len();
            let mut ear = None;
            for i in 0..n {
                self.work = self.work.checked_sub(n as u64)?;
                let corners = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
                if is_ear(flat, &left, corners) {
                    ear = Some((i, corners));
                    break;
                }
            }
            // A polygon that crosses itself may have no ear: any corner will do, its area is undefined anyway.
            let (i, corners) = ear.unwrap_or((1, [left[0], left[1], left[2]]));
            triangles.push(corners);
            left.remove(i);
        }
        triangles.push([left[0], left[1], left[2]]);
        Some(triangles)
    }
}

/// `points` along the axis in which the polygon is widest, counter-clockwise.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    // Newell's normal: exact for planar polygons, the best plane for bent ones.
    let origin = points[0];
    let next = points.iter().cycle().skip(1);
    let normal: DVec3 = points.iter().zip(next).map(|(a, b)| (*a - origin).cross(*b - origin)).sum();
    let a = normal.abs();
    let (axis, sign) = match a {
        _ if a.x >= a.y && a.x >= a.z => (0, normal.x),
        _ if a.y >= a.z => (1, normal.y),
        _ => (2, normal.z),
    };
    let flat = |p: &DVec3| {
        let d = *p - origin;
        let (u, v) = match axis {
            0 => (d.y, d.z),
            1 => (d.z, d.x),
            _ => (d.x, d.y),
        };
        if sign < 0.0 { DVec2::new(-u, v) } else { DVec2::new(u, v) }
    };
    points.iter().map(flat).collect()
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// True if no corner turns inwards. Polygons that wind twice round would pass, and fan no worse than anything else.
fn is_convex(flat: &[DVec2]) -> bool {
    let n = flat.len();
    (0..n).all(|i| turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) >= 0.0)
}

/// True if the triangle `corners` turns left and no other corner of the polygon lies in it.
fn is_ear(flat: &[DVec2], left: &[usize], corners: [usize; 3]) -> bool {
    let [a, b, c] = corners.map(|i| flat[i]);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    left.iter().filter(|i| !corners.contains(i)).all(|&i| {
        let p = flat[i];
        // A corner that only repeats one of the ear's (a slit to a hole) is not in the way.
        p == a || p == b || p == c || turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(points: &[DVec3]) -> (usize, f64, f64) {
        let (mut count, mut signed, mut absolute) = (0, 0.0, 0.0);
        let mut triangulator = Triangulator::default();
        triangulator.split(points, |t| {
            let [a, b, c] = t.map(|i| points[i]);
            let twice = (b - a).cross(c - a).z;
            count += 1;
            signed += twice / 2.0;
            absolute += twice.abs() / 2.0;
        });
        assert_eq!(triangulator.fanned, 0);
        (count, signed, absolute)
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        // An arrow: the corner at (1, 1) points inwards, and a fan from the first corner would cover 6, not 4.
        let arrow = [[0.0, 0.0], [4.0, 1.0], [0.0, 2.0], [1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 5.0));
        for start in 0..4 {
            let mut rotated = arrow;
            rotated.rotate_left(start);
            // Shoelace: area 3, counter-clockwise.
            let (count, signed, absolute) = areas(&rotated);
            assert_eq!(count, 2);
            assert!((signed - 3.0).abs() < 1e-12 && (absolute - 3.0).abs() < 1e-12, "{start}: {signed} {absolute}");
            rotated.reverse();
            assert!((areas(&rotated).1 + 3.0).abs() < 1e-12);
        }
    }

    #[test]
    fn polygons_without_area_still_end() {
        let line: Vec<DVec3> = (0..6).map(|i| DVec3::X * f64::from(i % 3)).collect();
        assert_eq!(areas(&line).0, 4);
        assert_eq!(areas(&[DVec3::splat(f64::NAN); 5]).0, 3);
    }
}
