//! Charts: pieces of a mesh that hang together on the lightmap.

use std::collections::HashMap;

use crate::authored::Mesh;

/// Per triangle the number of its chart: the lowest of its triangles. Triangles hang together where they share an edge in
/// space and on the lightmap; vertices that are there twice for the sake of normals are one.
pub fn charts(mesh: &Mesh) -> Vec<u32> {
    let Some(uvs) = mesh.second_texcoords.as_ref() else { return Vec::new() };
    let key = |k: u32| {
        let ([x, y, z], [u, v]) = (mesh.positions[k as usize], uvs[k as usize]);
        [x, y, z, u, v].map(|c| (c + 0.0).to_bits())
    };
    let mut chart: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let mut edges = HashMap::new();
    for (t, corners) in (0u32..).zip(&mesh.triangles) {
        for k in 0..3 {
            let (a, b) = (key(corners[k]), key(corners[(k + 1) % 3]));
            let first = *edges.entry((a.min(b), a.max(b))).or_insert(t);
            let (a, b) = (root(&mut chart, first), root(&mut chart, t));
            chart[a.max(b) as usize] = a.min(b);
        }
    }
    (0..chart.len() as u32).map(|t| root(&mut chart, t)).collect()
}

fn root(chart: &mut [u32], mut t: u32) -> u32 {
    while chart[t as usize] != t {
        chart[t as usize] = chart[chart[t as usize] as usize];
        t = chart[t as usize];
    }
    t
}
