//! Form factors in closed form, the truth that scenes are compared with. Numbers in, numbers out: no scene, no ray.
//!
//! Point to polygon by Lambert's contour integral, which also does clipping and shadows exactly; rectangles and
//! discs by their textbook formulas (J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, entries
//! C-11, C-13 to C-15, C-41). The tests hold each against quadrature that shares no formula with it.

use std::f64::consts::PI;

use glam::DVec3;

/// Corners of a plane convex polygon, in order.
pub type Polygon = Vec<DVec3>;

/// Configuration factor from a small element at `point` with unit `normal` to a polygon: E/(πL) if the polygon has
/// radiance L. What is behind the element's plane is cut off. Which way the polygon faces does not matter.
///
/// J. H. Lambert, *Photometria*, 1760: F = |Σ Γ·n|/2π over edges, Γ the angle of the edge along its plane's normal.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let visible = clip(polygon, point, normal);
    let sum: f64 = edges(&visible)
        .map(|(a, b)| {
            let (a, b) = (a - point, b - point);
            let across = a.cross(b);
            let length = across.length();
            if length > 0.0 { libm::atan2(length, a.dot(b)) * across.dot(normal) / length } else { 0.0 }
        })
        .sum();
    sum.abs() / (2.0 * PI)
}

/// The part of `polygon` on the side of the plane through `point` to which `normal` points
/// (Sutherland and Hodgman 1974, one plane).
pub fn clip(polygon: &[DVec3], point: DVec3, normal: DVec3) -> Polygon {
    let height = |p: DVec3| (p - point).dot(normal);
    let mut kept = Polygon::new();
    for (a, b) in edges(polygon) {
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
            kept.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    kept
}

/// The part of `polygon` that an eye sees through `frame`, a convex polygon in front of it or behind it: the polygon
/// cut by the frame's pyramid of sight. Where the frame is an obstacle, this is what it hides.
pub fn through(eye: DVec3, polygon: &[DVec3], frame: &[DVec3]) -> Polygon {
    let Some(centre) = mean(frame) else { return Polygon::new() };
    edges(frame).fold(polygon.to_vec(), |rest, (a, b)| {
        let inward = (a - eye).cross(b - eye);
        clip(&rest, eye, if inward.dot(centre - eye) < 0.0 { -inward } else { inward })
    })
}

fn mean(polygon: &[DVec3]) -> Option<DVec3> {
    (!polygon.is_empty()).then(|| polygon.iter().sum::<DVec3>() / polygon.len() as f64)
}

fn edges(polygon: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]))
}

/// Form factor between directly opposed rectangles a × b at distance c.
pub fn opposed_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = libm::log(p * q / (1.0 + x * x + y * y).sqrt());
    let slants = x * q * libm::atan(x / q) + y * p * libm::atan(y / p);
    2.0 / (PI * x * y) * (logarithm + slants - x * libm::atan(x) - y * libm::atan(y))
}

/// Form factor from a disc of radius `from` to a coaxial parallel one of radius `to` at `distance`.
pub fn coaxial_discs(from: f64, to: f64, distance: f64) -> f64 {
    let (r1, r2) = (from / distance, to / distance);
    let s = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    0.5 * (s - (s * s - 4.0 * (to / from).powi(2)).sqrt())
}

/// Configuration factor from an element to a parallel a × b rectangle at distance c, one of whose corners is straight
/// above the element.
pub fn below_corner(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * libm::atan(y / p) + y / q * libm::atan(x / q)) / (2.0 * PI)
}

/// An interval.
pub type Range = [f64; 2];

/// Form factor from the rectangle x × y to the rectangle ξ × η of a parallel plane at `distance`.
pub fn parallel_rectangles(x: Range, y: Range, xi: Range, eta: Range, distance: f64) -> f64 {
    let z2 = distance * distance;
    let slant = |u: f64, v: f64| {
        let root = (v * v + z2).sqrt();
        u * root * libm::atan(u / root)
    };
    alternating(x, y, xi, eta, |x, y, xi, eta| {
        let (u, v) = (x - xi, y - eta);
        (slant(v, u) + slant(u, v) - 0.5 * z2 * libm::log(u * u + v * v + z2)) / (2.0 * PI)
    }) / area(x, y)
}

/// Form factor from the rectangle x × y to the rectangle ξ × η of a perpendicular plane: x and ξ are distances from the
/// planes' common line, y and η lie along it.
pub fn perpendicular_rectangles(x: Range, y: Range, xi: Range, eta: Range) -> f64 {
    alternating(x, y, xi, eta, |x, y, xi, eta| {
        let (v, square) = (y - eta, x * x + xi * xi);
        let root = square.sqrt();
        let angle = if root > 0.0 { v * root * libm::atan(v / root) } else { 0.0 };
        // ¼ (x² + ξ²)(1 − K²) ln((x² + ξ²)(1 + K²)) with K = v/√(x² + ξ²), multiplied out so that K may be infinite.
        let sum = square + v * v;
        let logarithm = if sum > 0.0 { 0.25 * (square - v * v) * libm::log(sum) } else { 0.0 };
        (angle - logarithm) / (2.0 * PI)
    }) / area(x, y)
}

fn area(x: Range, y: Range) -> f64 {
    (x[1] - x[0]) * (y[1] - y[0])
}

/// Σ (−1)^(i+j+k+l) g(x_i, y_j, ξ_k, η_l).
fn alternating(x: Range, y: Range, xi: Range, eta: Range, g: impl Fn(f64, f64, f64, f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for corner in 0..16usize {
        let bit = |k: usize| corner >> k & 1;
        let sign = if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * g(x[bit(0)], y[bit(1)], xi[bit(2)], eta[bit(3)]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> Polygon {
        vec![corner, corner + u, corner + u + v, corner + v]
    }

    /// ∫ cosθ/π over directions that meet `first` and are not stopped by `before`: midpoints of a grid of the unit
    /// disc's polar coordinates, where directions are uniform by projected solid angle. Shares nothing with the
    /// formulas but the meaning. n × n points leave errors of the order of the border's share of cells, 1/n.
    fn by_directions(point: DVec3, normal: DVec3, first: &[DVec3], before: &[&[DVec3]]) -> f64 {
        let n = 1500;
        let side = if normal.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        let tangent = normal.cross(side).normalize();
        let bitangent = normal.cross(tangent);
        let mut met = 0usize;
        for i in 0..n {
            let s = ((i as f64 + 0.5) / n as f64).sqrt();
            for j in 0..n {
                let (sin, cos) = (((j as f64 + 0.5) / n as f64) * 2.0 * PI).sin_cos();
                let d = tangent * (s * cos) + bitangent * (s * sin) + normal * (1.0 - s * s).sqrt();
                met += usize::from(meets(point, d, first) && !before.iter().any(|b| meets(point, d, b)));
            }
        }
        met as f64 / (n * n) as f64
    }

    /// True if the ray meets the convex polygon: its foot on the plane is on one side of all edges.
    fn meets(point: DVec3, d: DVec3, polygon: &[DVec3]) -> bool {
        let plane = (polygon[1] - polygon[0]).cross(polygon[2] - polygon[0]);
        let t = (polygon[0] - point).dot(plane) / d.dot(plane);
        let foot = point + d * t;
        t > 0.0 && edges(polygon).all(|(a, b)| (b - a).cross(foot - a).dot(plane) >= 0.0)
    }

    #[test]
    fn polygons_of_every_kind_against_directions() {
        let point = DVec3::new(0.3, 0.2, 0.0);
        let above = rectangle(DVec3::new(-0.2, 0.1, 1.0), DVec3::X * 1.5, DVec3::new(0.0, 0.8, 0.3));
        let wall = rectangle(DVec3::new(1.0, -0.5, -1.0), DVec3::Y * 2.0, DVec3::Z * 2.5);
        for normal in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(1.0, 2.0, -0.5).normalize()] {
            for polygon in [&above, &wall] {
                let (formula, counted) =
                    (point_to_polygon(point, normal, polygon), by_directions(point, normal, polygon, &[]));
                assert!((formula - counted).abs() < 1e-3, "{normal}: {formula} against {counted}");
            }
        }
    }

    #[test]
    fn shadows_against_directions() {
        let (point, normal) = (DVec3::new(0.3, 0.2, 0.0), DVec3::new(0.0, 0.6, 0.8));
        let lamp = rectangle(DVec3::new(-1.0, 0.0, 2.0), DVec3::X * 3.0, DVec3::Y * 2.0);
        let screen = rectangle(DVec3::new(0.2, 0.4, 1.0), DVec3::X * 2.0, DVec3::new(0.0, 0.3, 0.2));
        let hidden = point_to_polygon(point, normal, &through(point, &lamp, &screen));
        assert!(hidden > 0.02, "the screen must stand before the lamp");
        let formula = point_to_polygon(point, normal, &lamp) - hidden;
        let counted = by_directions(point, normal, &lamp, &[&screen]);
        assert!((formula - counted).abs() < 1e-3, "{formula} against {counted}");
    }

    #[test]
    fn rectangles_by_two_routes() {
        // The contour integral averaged over the first rectangle, 24 Gauss points per axis.
        let (x, y, xi, eta) = ([0.1, 0.9], [-0.3, 0.8], [0.2, 1.4], [0.0, 0.5]);
        let mean = |normal: DVec3, target: &[DVec3]| {
            crate::quadrature::mean(x, y, 24, |x, y| point_to_polygon(DVec3::new(x, y, 0.0), normal, target))
        };
        let target = rectangle(DVec3::new(xi[0], eta[0], 0.7), DVec3::X * 1.2, DVec3::Y * 0.5);
        let parallel = parallel_rectangles(x, y, xi, eta, 0.7);
        assert!((parallel - mean(DVec3::Z, &target)).abs() < 1e-9, "{parallel}");
        // ξ runs along z in the plane x = 0, the first rectangle's normal is +z.
        let target = rectangle(DVec3::new(0.0, eta[0], xi[0]), DVec3::Z * 1.2, DVec3::Y * 0.5);
        let perpendicular = perpendicular_rectangles(x, y, xi, eta);
        assert!((perpendicular - mean(DVec3::Z, &target)).abs() < 1e-9, "{perpendicular}");
    }

    #[test]
    fn textbook_numbers() {
        for (c, expected) in [(0.5, 0.4152532836), (1.0, 0.1998248957), (2.0, 0.0685895888), (5.0, 0.0124039773)] {
            assert!((opposed_rectangles(1.0, 1.0, c) - expected).abs() < 1e-9);
            assert!((parallel_rectangles([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0], c) - expected).abs() < 1e-9);
        }
        let unit = [0.0, 1.0];
        let corner = perpendicular_rectangles(unit, unit, unit, unit);
        assert!((corner - 0.2000437761).abs() < 1e-9);
        assert!((opposed_rectangles(1.0, 1.0, 1.0) + 4.0 * corner - 1.0).abs() < 1e-12);
        assert!((coaxial_discs(1.0, 1.0, 1.0) - 0.3819660113).abs() < 1e-9);
        assert!((coaxial_discs(1.0, 2.0, 1.0) - 0.7639320225).abs() < 1e-9);
        assert!((below_corner(1.0, 1.0, 1.0) - 0.1385316060).abs() < 1e-9);
        let square = rectangle(DVec3::Z, DVec3::X, DVec3::Y);
        assert!((point_to_polygon(DVec3::ZERO, DVec3::Z, &square) - 0.1385316060).abs() < 1e-9);
        let wall = rectangle(DVec3::X, DVec3::Y, DVec3::Z);
        assert!((point_to_polygon(DVec3::ZERO, DVec3::Z, &wall) - 0.0557341970).abs() < 1e-9);
    }
}
