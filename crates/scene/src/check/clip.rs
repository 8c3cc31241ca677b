//! Triangles of the plane: what two of them share, and how far apart they are.

pub type Point = [f64; 2];

/// Twice the area, positive counter-clockwise.
pub fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// What two triangles share: its area, and twice that over its perimeter, which tells slivers of rounding from overlaps.
pub fn shared(a: [Point; 3], b: [Point; 3]) -> Shared {
    let turned = |[p, q, r]: [Point; 3]| if cross(p, q, r) < 0.0 { [p, r, q] } else { [p, q, r] };
    let (a, b) = (turned(a), turned(b));
    // Sutherland and Hodgman: a is cut by every edge of b.
    let mut polygon = a.to_vec();
    for k in 0..3 {
        let (p, q) = (b[k], b[(k + 1) % 3]);
        let mut cut = Vec::with_capacity(polygon.len() + 1);
        for i in 0..polygon.len() {
            let (s, e) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (ds, de) = (cross(p, q, s), cross(p, q, e));
            if ds >= 0.0 {
                cut.push(s);
            }
            if (ds > 0.0 && de < 0.0) || (ds < 0.0 && de > 0.0) {
                let t = ds / (ds - de);
                cut.push([s[0] + t * (e[0] - s[0]), s[1] + t * (e[1] - s[1])]);
            }
        }
        polygon = cut;
        if polygon.len() < 3 {
            return Shared::default();
        }
    }
    let n = polygon.len();
    let area: f64 = (1..n - 1).map(|k| 0.5 * cross(polygon[0], polygon[k], polygon[k + 1])).sum();
    let perimeter: f64 = (0..n).map(|k| distance(polygon[k], polygon[(k + 1) % n])).sum();
    let middle = [0, 1].map(|k| polygon.iter().map(|p| p[k]).sum::<f64>() / n as f64);
    Shared { area: area.max(0.0), width: if perimeter > 0.0 { 2.0 * area / perimeter } else { 0.0 }, middle }
}

/// What two triangles share.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shared {
    pub area: f64,
    /// About how wide it is.
    pub width: f64,
    pub middle: Point,
}

fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Distance of two triangles that do not overlap: of a corner of one to an edge of the other.
pub fn gap(a: [Point; 3], b: [Point; 3]) -> f64 {
    let to =
        |t: [Point; 3], p: Point| (0..3).map(|k| to_segment(p, t[k], t[(k + 1) % 3])).fold(f64::INFINITY, f64::min);
    a.iter().map(|&p| to(b, p)).chain(b.iter().map(|&p| to(a, p))).fold(f64::INFINITY, f64::min)
}

fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / length;
    let t = if length > 0.0 { t.clamp(0.0, 1.0) } else { 0.0 };
    distance(p, [a[0] + t * along[0], a[1] + t * along[1]])
}
