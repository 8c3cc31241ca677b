//! Charts continued beyond their rims, as far as filters look.

use crate::page::Page;

/// Gives texels without light that of their neighbours, in rings around what is known: `rings` of them everywhere, and as
/// many as it takes where `inner` says that a chart lies there whose light is not known (under what stands on it), from that chart
/// alone: a chart of which nothing is known stays dark.
pub fn dilate(page: &mut Page, inner: &[bool], rings: u32) {
    let (width, height) = (page.width as usize, page.height as usize);
    let mut known: Vec<bool> = page.coverage.iter().map(|&c| c > 0.0).collect();
    let mut waiting: Vec<usize> = (0..known.len()).filter(|&i| !known[i]).collect();
    for ring in 0.. {
        if ring == rings {
            waiting.retain(|&i| inner[i]);
        }
        let fill = |&i: &usize| -> Option<(usize, [f32; 3])> {
            let (x, y) = (i % width, i / width);
            let (mut sum, mut total) = ([0.0f64; 3], 0.0);
            for dy in -1..=1i64 {
                for dx in -1..=1i64 {
                    let (nx, ny) = (x as i64 + dx, y as i64 + dy);
                    if nx < 0 || ny < 0 || nx >= width as i64 || ny >= height as i64 {
                        continue;
                    }
                    let n = ny as usize * width + nx as usize;
                    if known[n] && (ring < rings || inner[n]) {
                        let weight = if dx != 0 && dy != 0 { 0.5 } else { 1.0 };
                        (0..3).for_each(|c| sum[c] += weight * f64::from(page.irradiance[n][c]));
                        total += weight;
                    }
                }
            }
            (total > 0.0).then(|| (i, sum.map(|s| (s / total) as f32)))
        };
        let filled: Vec<_> = waiting.iter().filter_map(fill).collect();
        if filled.is_empty() {
            return;
        }
        for (i, light) in filled {
            page.irradiance[i] = light;
            known[i] = true;
        }
        waiting.retain(|&i| !known[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rims_go_on_as_far_as_asked_and_holes_are_filled() {
        let mut page = Page::new([16, 16]);
        let mut inner = vec![false; 256];
        for y in 4..12 {
            for x in 4..12 {
                let i = y * 16 + x;
                inner[i] = true;
                // A hole of 4 × 4 in the middle.
                if !(6..10).contains(&x) || !(6..10).contains(&y) {
                    (page.irradiance[i], page.coverage[i]) = ([2.0, 1.0, 0.5], 1.0);
                }
            }
        }
        // Another chart, of which nothing is known.
        (0..3).for_each(|x| inner[15 * 16 + x] = true);
        dilate(&mut page, &inner, 1);
        for y in 0..16 {
            for x in 0..16 {
                let lit = (3..13).contains(&x) && (3..13).contains(&y);
                let expected = if lit { [2.0, 1.0, 0.5] } else { [0.0; 3] };
                assert_eq!(page.irradiance[y * 16 + x], expected, "({x}, {y})");
            }
        }
    }
}
