//! Light that escapes from a closed scene, or from one with windows, through narrow gaps.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use super::finding::{Element, Finding, Kind, Severity, Worst};
use super::subject::Subject;
use super::walks::{Step, Walks};
use crate::geom::Frame;
use crate::patch::PatchId;

/// Of a scene that is meant to be closed no more rays escape.
const CLOSED: f64 = 0.01;
/// Of a room with windows no more rays escape.
const ROOM: f64 = 0.4;
/// Rays beside an escaping one, radians: both meet something where the gap is narrower than twice this, times the distance.
const BESIDE: f64 = 0.01;
/// Share of the escaping rays that see both sides of a gap, where there is one. Those that start within or right before it do
/// not: 47 % do with a slit of a centimetre around a wall of a 2 m cube, 2 % with a window of a third of a metre.
const NARROW: f64 = 0.2;
/// Fewer are noise of the arithmetic.
const RAYS: usize = 20;
/// Fewer through slits beside windows are chance: bars, leaves and the frames of windows have none or next to none.
const SLIT_RAYS: usize = 10;
/// From one side of a gap beside windows to the other, metres: more is a window seen at a low angle.
const WIDE: f64 = 0.1;
/// Of four ways across a ray so many meet both sides of a slit; in the corner of a window one does.
const ACROSS: usize = 2;
/// What of a gap is looked at to tell whether it is a slit, metres around one of its points.
const AROUND: f64 = 0.5;
/// Points of a gap are within so much of a line, metres (root of the mean square); those of blinds, bars and leaves are not.
const LINE: f64 = 0.08;
/// As many points around one make a line.
const POINTS: usize = 6;
/// Share of the narrow gaps that are slits: between bars and leaves some look like slits by chance.
const SLITS: f64 = 0.5;

pub fn find(subject: &Subject, walks: &Walks) -> Vec<Finding> {
    let from_surfaces = || walks.0.iter().filter(|step| step.from.is_some());
    let rays = from_surfaces().count();
    let escapes: Vec<&Step> = from_surfaces().filter(|step| step.hit.is_none()).collect();
    let share = escapes.len() as f64 / rays.max(1) as f64;
    if escapes.len() < RAYS || share > ROOM {
        return Vec::new();
    }
    let rims: Vec<Vec<Rim>> = escapes.iter().map(|step| rims(subject, step)).filter(|rims| !rims.is_empty()).collect();
    let is_closed = share <= CLOSED && rims.len() as f64 >= NARROW * escapes.len() as f64;
    // Otherwise most go through windows, which are meant: only slits count, which most ways lead across.
    let ways = if is_closed { 1 } else { ACROSS };
    let rims: Vec<Rim> = rims.into_iter().filter(|rims| rims.len() >= ways).map(|rims| rims[0]).collect();
    let rims = if is_closed { rims } else { slits(rims) };
    if !is_closed && rims.len() < SLIT_RAYS {
        return Vec::new();
    }
    let mut instances = vec![(0usize, DVec3::ZERO); subject.scene.instances.len()];
    let mut triangles = Vec::new();
    for &(triangle, point) in rims.iter().flatten() {
        let (count, sum) = &mut instances[subject.instance_of(triangle)];
        *count += 1;
        *sum += point;
        triangles.push(triangle);
    }
    triangles.sort_unstable();
    triangles.dedup();
    let most = (0..instances.len()).max_by_key(|&i| (instances[i].0, std::cmp::Reverse(i)));
    let element = most.map_or(Element::Scene, |i| subject.instance_element(i));
    let (count, sum) = most.map_or((1, DVec3::ZERO), |i| instances[i]);
    let [x, y, z] = (sum / count.max(1) as f64 + subject.patches.centre()).to_array();
    vec![Finding {
        kind: Kind::Leak,
        severity: if is_closed { Severity::Error } else { Severity::Warning },
        element,
        count: escapes.len(),
        area: subject.area(&triangles),
        worst: Worst { value: share, unit: "share" },
        message: format!(
            "{:.3} % of {rays} rays escape, {} of {} through narrow gaps, most around ({x:.3}, {y:.3}, {z:.3})",
            100.0 * share,
            rims.len(),
            escapes.len()
        ),
        triangles,
    }]
}

/// What lies on both sides of a gap: triangles and points of them.
type Rim = [(u32, DVec3); 2];

/// What lies on both sides of the gap through which a ray escapes, for each of four ways across it that meet both.
fn rims(subject: &Subject, step: &Step) -> Vec<Rim> {
    let Some((patch, point)) = step.from else { return Vec::new() };
    let frame = Frame::from_normal(step.direction);
    let meets = |across: DVec3| meets(subject, patch, point, step.direction + across * BESIDE);
    let ways = [frame.x, frame.y, (frame.x + frame.y).normalize(), (frame.x - frame.y).normalize()];
    ways.into_iter().filter_map(|way| Some([meets(way)?, meets(-way)?])).collect()
}

fn meets(subject: &Subject, patch: PatchId, point: DVec3, direction: DVec3) -> Option<(u32, DVec3)> {
    let hit = subject.patches.trace_from(patch, point, direction.normalize())?;
    Some((hit.triangle, subject.patches.point_of(hit.triangle, hit.u, hit.v)))
}

/// Those of gaps that are narrow wherever they are seen from, and lie along lines: none where others are more.
fn slits(rims: Vec<Rim>) -> Vec<Rim> {
    let rims: Vec<Rim> = rims.into_iter().filter(|[a, b]| a.1.distance(b.1) < WIDE).collect();
    let middles: Vec<DVec3> = rims.iter().map(|[a, b]| a.1.midpoint(b.1)).collect();
    let cell = |p: DVec3| (p / AROUND).floor().as_i64vec3().to_array();
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    middles.iter().enumerate().for_each(|(i, &p)| cells.entry(cell(p)).or_default().push(i));
    let is_slit = |&p: &DVec3| {
        let [x, y, z] = cell(p);
        let beside = (0..27).filter_map(|k| cells.get(&[x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])).flatten();
        let near: Vec<DVec3> = beside.map(|&i| middles[i] - p).filter(|d| d.length() < AROUND).collect();
        near.len() >= POINTS && thickness(&near) < LINE
    };
    let keep: Vec<bool> = middles.iter().map(is_slit).collect();
    let all = rims.len() as f64;
    let slits: Vec<Rim> = rims.into_iter().zip(keep).filter(|r| r.1).map(|r| r.0).collect();
    if slits.len() as f64 >= SLITS * all { slits } else { Vec::new() }
}

/// How far points are from the line along which they lie most: the root of the mean square.
fn thickness(points: &[DVec3]) -> f64 {
    let n = points.len() as f64;
    let mean = points.iter().sum::<DVec3>() / n;
    let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    let spread = points.iter().fold(DMat3::ZERO, |m, &p| m + outer(p - mean)) * (1.0 / n);
    let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
    // The greatest eigenvalue, by powers: squares of squares until the others are nothing.
    let mut power = spread * (1.0 / trace.max(f64::MIN_POSITIVE));
    for _ in 0..6 {
        power = power * power;
        power *= 1.0 / (power.x_axis.x + power.y_axis.y + power.z_axis.z).max(f64::MIN_POSITIVE);
    }
    let along = [power.x_axis, power.y_axis, power.z_axis]
        .into_iter()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(DVec3::X)
        .normalize_or_zero();
    (trace - along.dot(spread * along)).max(0.0).sqrt()
}
