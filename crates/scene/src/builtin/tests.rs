//! The built-in scenes are what they claim: sealed, one-sided, nothing covered, lamps of the stated power.

use std::collections::{HashMap, HashSet};
use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{NAMES, by_name, plates};
use crate::authored::{Scene, Surface};
use crate::rgb::Rgb;

/// Scenes that no light leaves, and the volume of air in each, m³, where it is known.
const CLOSED: &[(&str, Option<f64>)] = &[
    ("furnace", Some(3.0 * 2.4 * 2.0 - 0.8 * 1.2 * 0.6)),
    ("cube", Some(1.0)),
    ("cornell-closed", None),
    ("doorway", None),
    ("hall", None),
    ("uneven", Some(4.0 * 2.6 * 5.0)),
];

fn scene(name: &str) -> Scene {
    by_name(name).unwrap_or_else(|| panic!("no scene {name}"))
}

/// World-space corners of every triangle, with its material.
fn triangles(scene: &Scene) -> Vec<([DVec3; 3], usize)> {
    scene
        .instances
        .iter()
        .flat_map(|instance| {
            let mesh = &scene.meshes[instance.mesh];
            mesh.triangles.iter().map(move |triangle| {
                let corner = |&i: &u32| {
                    instance.transform.transform_point3(DVec3::from(mesh.positions[i as usize].map(f64::from)))
                };
                ([corner(&triangle[0]), corner(&triangle[1]), corner(&triangle[2])], mesh.material)
            })
        })
        .collect()
}

/// Half the cross product of two edges: area times normal.
fn vector_area([a, b, c]: [DVec3; 3]) -> DVec3 {
    0.5 * (b - a).cross(c - a)
}

/// The nearest hit (distance, triangle index, whether its front was hit), by Möller and Trumbore.
fn nearest(triangles: &[([DVec3; 3], usize)], origin: DVec3, direction: DVec3) -> Option<(f64, usize, bool)> {
    let mut best: Option<(f64, usize, bool)> = None;
    for (index, ([a, b, c], _)) in triangles.iter().enumerate() {
        let (ab, ac) = (*b - *a, *c - *a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            continue;
        }
        let s = (origin - *a) / determinant;
        let u = s.dot(p);
        let q = s.cross(ab);
        let v = direction.dot(q);
        let t = ac.dot(q);
        // A hair beyond the edges, so that f32 corners leave no gap between neighbours.
        let slack = -1e-9;
        if u >= slack && v >= slack && u + v <= 1.0 - slack && t > 1e-6 && best.is_none_or(|(d, ..)| t < d) {
            best = Some((t, index, determinant > 0.0));
        }
    }
    best
}

/// A number in [0, 1) per call (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let (sin, cos) = (TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// π · radiance · area, summed over the triangles of emitting materials.
fn emitted_power(scene: &Scene) -> Rgb {
    triangles(scene).iter().map(|(t, m)| scene.materials[*m].emission * (PI * vector_area(*t).length())).sum()
}

#[test]
fn every_name_is_a_scene() {
    for (name, description) in NAMES {
        let scene = scene(name);
        assert_eq!(&scene.name, name);
        assert!(!description.is_empty());
        assert!(!scene.cameras.is_empty() && scene.cameras.iter().all(|camera| camera.aspect.is_some()), "{name}");
        let used: HashSet<usize> = scene.meshes.iter().map(|mesh| mesh.material).collect();
        assert_eq!(used.len(), scene.materials.len(), "{name}: unused materials");
        for mesh in &scene.meshes {
            assert!(mesh.normals.as_ref().is_none_or(|normals| normals.len() == mesh.positions.len()));
            assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
        }
        let names: HashSet<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
        assert_eq!(names.len(), scene.materials.len(), "{name}: material names");
    }
    assert!(by_name("no such scene").is_none());
}

#[test]
fn triangles_are_neither_degenerate_nor_doubled() {
    for (name, _) in NAMES {
        let mut seen = HashSet::new();
        for (t, _) in triangles(&scene(name)) {
            let longest = (0..3).map(|i| t[i].distance(t[(i + 1) % 3])).fold(0.0, f64::max);
            assert!(vector_area(t).length() > 1e-5 * longest * longest, "{name}: sliver {t:?}");
            let mut corners = t.map(|p| p.to_array().map(f64::to_bits));
            corners.sort_unstable();
            assert!(seen.insert(corners), "{name}: twice {t:?}");
        }
    }
}

/// The vector area of a closed surface vanishes, and its divergence theorem volume is minus the air's, because
/// fronts look inwards.
#[test]
fn closed_scenes_are_closed() {
    for (name, volume) in CLOSED {
        let triangles = triangles(&scene(name));
        let area: f64 = triangles.iter().map(|(t, _)| vector_area(*t).length()).sum();
        let sum: DVec3 = triangles.iter().map(|(t, _)| vector_area(*t)).sum();
        assert!(sum.length() < 1e-6 * area, "{name}: vector area {sum}");
        let enclosed: f64 = triangles.iter().map(|(t, _)| t[0].dot(vector_area(*t)) / 3.0).sum();
        assert!(enclosed < 0.0, "{name}: volume {enclosed}");
        if let Some(volume) = volume {
            assert!((enclosed + volume).abs() < 1e-5 * volume, "{name}: volume {enclosed}, not {volume}");
        }
    }
}

/// Every edge of a triangle is covered once in each sense, counting parts: of all edges on one line, those that
/// run forwards and those that run backwards are equally long. A hole of any size fails this.
#[test]
fn closed_scenes_have_no_open_edge() {
    for (name, _) in CLOSED {
        let triangles = triangles(&scene(name));
        // Work on edges cut at every vertex that lies on them, so that T-junctions compare piece by piece.
        let mut vertices: Vec<DVec3> = triangles.iter().flat_map(|(t, _)| *t).collect();
        vertices.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
        vertices.dedup();
        let id = |p: DVec3| {
            vertices
                .partition_point(|q| q.x.total_cmp(&p.x).then(q.y.total_cmp(&p.y)).then(q.z.total_cmp(&p.z)).is_lt())
        };
        let mut balance = HashMap::<(usize, usize), i32>::new();
        for (t, _) in &triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                let along = b - a;
                let mut stops: Vec<(f64, usize)> = vec![(0.0, id(a)), (1.0, id(b))];
                let (low, high) = (a.min(b), a.max(b));
                let first = vertices.partition_point(|q| q.x < low.x - 1e-6);
                for (k, q) in vertices.iter().enumerate().skip(first).take_while(|(_, q)| q.x <= high.x + 1e-6) {
                    let s = (q - a).dot(along) / along.length_squared();
                    let off = (q - a - along * s).length();
                    if s > 1e-9 && s < 1.0 - 1e-9 && off < 2e-7 {
                        stops.push((s, k));
                    }
                }
                stops.sort_by(|p, q| p.0.total_cmp(&q.0));
                stops.dedup_by_key(|(_, k)| *k);
                for pair in stops.windows(2) {
                    let (p, q) = (pair[0].1, pair[1].1);
                    *balance.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
                }
            }
        }
        let open: Vec<_> = balance.iter().filter(|(_, n)| **n != 0).take(4).collect();
        let show = |k: usize| vertices[k];
        assert!(
            open.is_empty(),
            "{name}: open edges {:?}",
            open.iter().map(|((p, q), n)| (show(*p), show(*q), **n)).collect::<Vec<_>>()
        );
    }
}

#[test]
fn cameras_of_closed_scenes_see_only_fronts() {
    for (name, _) in CLOSED {
        let scene = scene(name);
        let triangles = triangles(&scene);
        let mut numbers = Numbers(1);
        for camera in &scene.cameras {
            for _ in 0..3000 {
                let direction = numbers.direction();
                let hit = nearest(&triangles, camera.eye, direction);
                assert!(hit.is_some_and(|(_, _, front)| front), "{name} {}: {direction} {hit:?}", camera.name);
            }
        }
    }
}

/// From points spread over all surfaces, light meets fronts only: nothing is covered, nothing lies inside a solid.
#[test]
fn surfaces_of_closed_scenes_see_only_fronts() {
    for (name, _) in CLOSED {
        let triangles = triangles(&scene(name));
        let mut numbers = Numbers(2);
        let total: f64 = triangles.iter().map(|(t, _)| vector_area(*t).length()).sum();
        for (t, _) in &triangles {
            let area = vector_area(*t);
            let rays = 1 + (4000.0 * area.length() / total) as usize;
            let normal = area.normalize();
            for _ in 0..rays {
                let (root, v) = (numbers.next().sqrt(), numbers.next());
                let origin = t[0] * (1.0 - root) + t[1] * (root * (1.0 - v)) + t[2] * (root * v) + normal * 1e-5;
                let direction = (normal + 0.99 * numbers.direction()).normalize();
                let hit = nearest(&triangles, origin, direction);
                assert!(hit.is_some_and(|(_, _, front)| front), "{name}: from {origin} to {direction}: {hit:?}");
            }
        }
    }
}

#[test]
fn cornell_emits_what_was_measured() {
    for name in ["cornell", "cornell-closed"] {
        let power = emitted_power(&scene(name));
        let stated = Rgb::new(737_514.0, 492_002.0, 131_119.0) / 1e6;
        for channel in 0..3 {
            assert!((power[channel] / stated[channel] - 1.0).abs() < 1e-3, "{name}: {power:?}");
        }
    }
}

/// The floor less both footprints: 252 971.54 mm² by the shoelace formula.
#[test]
fn cornell_floor_is_cut_around_the_boxes() {
    let floor: f64 = triangles(&scene("cornell"))
        .iter()
        .filter(|(t, _)| t.iter().all(|p| p.y == 0.0))
        .map(|(t, _)| vector_area(*t).y)
        .sum();
    assert!((floor - 0.252_971_54).abs() < 1e-7, "{floor}");
}

/// The doorway's lamp measures 1.2 × 1.2 m at 2000 nit; the hall is lit as a hall of 288 m² should be, by 200 lx.
#[test]
fn lamps_of_the_rooms_are_as_bright_as_said() {
    let doorway = emitted_power(&scene("doorway")).luminance();
    assert!((doorway / (PI * 1.44 * 2000.0) - 1.0).abs() < 1e-6, "{doorway} lm");
    let hall = emitted_power(&scene("hall")).luminance();
    assert!((40e3..60e3).contains(&hall), "{hall} lm");
}

/// The checks above leave `hall-diffuse` out, because it differs in its floor's material only.
#[test]
fn both_halls_have_the_same_shape() {
    let (glossy, matte) = (scene("hall"), scene("hall-diffuse"));
    assert_eq!(triangles(&glossy), triangles(&matte));
    assert!(matte.materials.iter().all(|material| matches!(material.surface, Surface::Lambertian { .. })));
    assert!(glossy.materials.iter().any(|material| matches!(material.surface, Surface::MetallicRoughness { .. })));
}

/// Plausible architecture: no reflectance above 0.85, so that light dies out.
#[test]
fn nothing_is_too_white() {
    for (name, _) in NAMES {
        for material in scene(name).materials {
            let (Surface::Lambertian { reflectance: colour }
            | Surface::MetallicRoughness { base_color: colour, .. }
            | Surface::Phong { diffuse: colour, .. }) = material.surface;
            assert!(colour.factor.max_channel() <= 0.85, "{name}: {}", material.name);
        }
    }
}

#[test]
fn plates_emit_one_watt() {
    for distance in [0.5, 1.0, 2.0] {
        assert!((emitted_power(&plates(distance)).g - 1.0).abs() < 1e-12);
    }
}

#[test]
fn furnace_emits_one_watt_per_area() {
    let area = 2.0 * (3.0 * 2.4 + 2.4 * 2.0 + 2.0 * 3.0) + 2.0 * 1.2 * (0.8 + 0.6);
    assert!((emitted_power(&scene("furnace")).g / area - 1.0).abs() < 1e-6);
}
