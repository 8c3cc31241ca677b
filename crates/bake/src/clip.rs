//! A triangle cut by a texel: Sutherland and Hodgman ("Reentrant polygon clipping", CACM 17(1), 1974) for four axis-parallel lines.

use std::ops::Range;

/// Corners of the piece of a triangle within the texel whose lowest corner is (`x`, `y`), and their number: none, or three to seven.
pub fn clip(triangle: [[f64; 2]; 3], x: f64, y: f64) -> ([[f64; 2]; 8], usize) {
    let mut polygon = [[0.0; 2]; 8];
    polygon[..3].copy_from_slice(&triangle);
    let mut count = 3;
    for (axis, limit, sign) in [(0, x, 1.0), (0, x + 1.0, -1.0), (1, y, 1.0), (1, y + 1.0, -1.0)] {
        let mut next = [[0.0; 2]; 8];
        let mut kept = 0;
        for k in 0..count {
            let (a, b) = (polygon[k], polygon[(k + 1) % count]);
            let [from, to] = [a, b].map(|p| sign * (p[axis] - limit));
            if from >= 0.0 {
                next[kept] = a;
                kept += 1;
            }
            if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
                let t = from / (from - to);
                next[kept] = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                next[kept][axis] = limit;
                kept += 1;
            }
        }
        (polygon, count) = (next, kept);
        if count < 3 {
            return (polygon, 0);
        }
    }
    (polygon, count)
}

/// Twice the signed area of a triangle.
pub fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Columns and rows of the texels that a triangle, in texels, may cover a piece of.
pub fn range(triangle: [[f64; 2]; 3], size: [u32; 2]) -> [Range<u32>; 2] {
    let bound =
        |axis: usize, pick: fn(f64, f64) -> f64| triangle.map(|p| p[axis]).into_iter().reduce(pick).unwrap_or(0.0);
    [0, 1].map(|axis| {
        let low = bound(axis, f64::min).floor().clamp(0.0, f64::from(size[axis]));
        let high = bound(axis, f64::max).ceil().clamp(0.0, f64::from(size[axis]));
        low as u32..high as u32
    })
}

/// Calls `each` with every texel of some columns and rows that a triangle, in texels, covers a piece of: its column and
/// row, and the piece's corners.
pub fn texels_of(
    triangle: [[f64; 2]; 3],
    [columns, rows]: [Range<u32>; 2],
    mut each: impl FnMut(u32, u32, &[[f64; 2]]),
) {
    for y in rows {
        for x in columns.clone() {
            let (polygon, count) = clip(triangle, f64::from(x), f64::from(y));
            if count > 0 {
                each(x, y, &polygon[..count]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the triangle, its pieces have its area together, and none leaves its texel.
    #[test]
    fn pieces_add_up_to_the_triangle() {
        let mut x = 1u64;
        let mut random = || {
            x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (x >> 11) as f64 / (1u64 << 53) as f64
        };
        for case in 0..500 {
            let scale = [0.3, 3.0, 14.0][case % 3];
            let mut t = [[0.0; 2]; 3].map(|_| [1.0 + scale * random(), 1.0 + scale * random()]);
            if case % 7 == 0 {
                // Sides along the lines between texels.
                t = t.map(|p| p.map(f64::round));
            }
            if cross(t[0], t[1], t[2]) < 0.0 {
                t.swap(1, 2);
            }
            let mut area = 0.0;
            texels_of(t, range(t, [16, 16]), |x, y, piece| {
                for k in 1..piece.len() - 1 {
                    let part = cross(piece[0], piece[k], piece[k + 1]);
                    assert!(part > -1e-12);
                    area += part;
                }
                for p in piece {
                    assert!(p[0] >= f64::from(x) && p[0] <= f64::from(x + 1));
                    assert!(p[1] >= f64::from(y) && p[1] <= f64::from(y + 1));
                }
            });
            assert!((area - cross(t[0], t[1], t[2])).abs() < 1e-9, "{t:?}: {area}");
        }
    }
}
