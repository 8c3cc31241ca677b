//! Bodies that are closed but for small holes.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::boxes::{BoxTree, around};
use super::finding::{Finding, Kind, Severity, Worst};
use super::subject::Subject;

/// Part of a body's edges that may be open for it to be nearly closed.
const EDGES: f64 = 0.1;
/// Length of its holes' rims, in parts of its diagonal: rims of cups and lampshades are longer, and meant.
const RIM: f64 = 0.5;
/// What a room encloses, in parts of the scene's diagonal.
const ROOM: f64 = 0.5;
/// Edges that end on another surface leave no hole: distance in parts of the scene's diagonal.
const TOUCHING: f64 = 1e-5;
/// Fewer triangles make no body with a hole.
const LEAST: usize = 8;

pub fn find(subject: &Subject) -> Vec<Finding> {
    let corners: Vec<[DVec3; 3]> = subject.triangles().map(|t| subject.corners(t)).collect();
    let key = |p: DVec3| p.as_vec3().to_array().map(|x| (x + 0.0).to_bits());
    let mut edges: HashMap<_, (usize, u32, u8)> = HashMap::new();
    let mut bodies = Bodies::new(corners.len());
    for (t, c) in (0u32..).zip(&corners) {
        for k in 0..3u8 {
            let (a, b) = (key(c[usize::from(k)]), key(c[usize::from(k + 1) % 3]));
            let edge = edges.entry((a.min(b), a.max(b))).or_insert((0, t, k));
            edge.0 += 1;
            bodies.join(edge.1, t);
        }
    }
    let mut open: Vec<(u32, u8)> = edges.values().filter(|e| e.0 == 1).map(|e| (e.1, e.2)).collect();
    open.sort_unstable();
    let mut of_body: HashMap<u32, Body> = HashMap::new();
    for (t, c) in (0u32..).zip(&corners) {
        let body = of_body.entry(bodies.of(t)).or_default();
        body.triangles.push(t);
        for p in c {
            (body.low, body.high) = (body.low.min(*p), body.high.max(*p));
        }
    }
    open.iter().for_each(|&(t, k)| of_body.entry(bodies.of(t)).or_default().open.push((t, k)));
    let mut bodies: Vec<Body> = of_body.into_values().collect();
    bodies.sort_by_key(|b| b.triangles.first().copied());

    let margin = TOUCHING * subject.diagonal();
    let tree = BoxTree::new(corners.iter().map(|c| around(&c.map(|p| p.to_array()), margin)).collect());
    let is_hole = |&(t, k): &(u32, u8)| {
        let c = corners[t as usize];
        let (a, b) = (c[usize::from(k)], c[usize::from(k + 1) % 3]);
        // An edge between vertices of finer neighbours touches them all along.
        [0.1, 0.5, 0.9].into_iter().any(|s| {
            let p = a.lerp(b, s);
            let mut touches = false;
            tree.meeting(&around(&[p.to_array()], 0.0), |other| {
                touches |= other != t && distance(p, corners[other as usize]) < margin;
                !touches
            });
            !touches
        })
    };
    let of_one = |body: Body| {
        let many = body.open.len() as f64 > EDGES * 1.5 * body.triangles.len() as f64;
        if body.open.is_empty() || many || body.triangles.len() < LEAST {
            return None;
        }
        let holes: Vec<(u32, u8)> = body.open.iter().copied().filter(is_hole).collect();
        let length = |&(t, k): &(u32, u8)| {
            let c = corners[t as usize];
            c[usize::from(k)].distance(c[usize::from(k + 1) % 3])
        };
        let rim: f64 = holes.iter().map(length).sum();
        let diagonal = (body.high - body.low).length();
        if holes.is_empty() || rim > RIM * diagonal {
            return None;
        }
        let is_room = diagonal > ROOM * subject.diagonal();
        Some((subject.instance_of(holes[0].0), Holes { edges: holes, rim, bodies: 1, is_room }))
    };
    let mut of_instance: BTreeMap<usize, Holes> = BTreeMap::new();
    for (instance, holes) in bodies.into_iter().filter_map(of_one) {
        let all = of_instance.entry(instance).or_default();
        all.edges.extend(holes.edges);
        (all.rim, all.bodies, all.is_room) = (all.rim + holes.rim, all.bodies + 1, all.is_room | holes.is_room);
    }
    of_instance.into_iter().map(|(instance, holes)| finding(subject, instance, &holes)).collect()
}

/// Open edges of the bodies of one instance.
#[derive(Default)]
struct Holes {
    edges: Vec<(u32, u8)>,
    /// Length of all of them, metres.
    rim: f64,
    bodies: usize,
    /// Whether one of the bodies encloses much of the scene.
    is_room: bool,
}

fn finding(subject: &Subject, instance: usize, holes: &Holes) -> Finding {
    let mut triangles: Vec<u32> = holes.edges.iter().map(|h| h.0).collect();
    triangles.sort_unstable();
    triangles.dedup();
    Finding {
        kind: Kind::OpenShell,
        severity: if holes.is_room { Severity::Warning } else { Severity::Note },
        element: subject.instance_element(instance),
        count: holes.edges.len(),
        area: subject.area(&triangles),
        worst: Worst { value: holes.rim, unit: "m" },
        message: format!(
            "{} open edges, {:.4} m in all, in bodies that are closed otherwise ({} of them)",
            holes.edges.len(),
            holes.rim,
            holes.bodies
        ),
        triangles,
    }
}

/// Triangles that hang together by their edges.
struct Body {
    triangles: Vec<u32>,
    low: DVec3,
    high: DVec3,
    open: Vec<(u32, u8)>,
}

impl Default for Body {
    fn default() -> Self {
        Self { triangles: Vec::new(), low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, open: Vec::new() }
    }
}

/// Sets that are joined.
struct Bodies(Vec<u32>);

impl Bodies {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn of(&mut self, mut t: u32) -> u32 {
        while self.0[t as usize] != t {
            self.0[t as usize] = self.0[self.0[t as usize] as usize];
            t = self.0[t as usize];
        }
        t
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
fn distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(ac);
    let inside = |u: DVec3, v: DVec3| (v - u).cross(p - u).dot(normal) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return ap.dot(normal.normalize_or_zero()).abs();
    }
    let to = |u: DVec3, v: DVec3| {
        let t = ((p - u).dot(v - u) / (v - u).length_squared()).clamp(0.0, 1.0);
        p.distance(u.lerp(v, if t.is_nan() { 0.0 } else { t }))
    };
    to(a, b).min(to(b, c)).min(to(c, a))
}
