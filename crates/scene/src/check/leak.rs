//! Light that escapes from a closed scene through narrow gaps.

use glam::DVec3;

use super::finding::{Element, Finding, Kind, Severity, Worst};
use super::subject::Subject;
use super::walks::{Step, Walks};
use crate::geom::Frame;

/// Of a scene that is meant to be closed no more rays escape.
const CLOSED: f64 = 0.01;
/// Rays beside an escaping one, radians: both meet something where the gap is narrower than twice this, times the distance.
const BESIDE: f64 = 0.01;
/// Share of the escaping rays that see both sides of a gap, where there is one. Those that start within or right before it do
/// not: 47 % do with a slit of a centimetre around a wall of a 2 m cube, 2 % with a window of a third of a metre.
const NARROW: f64 = 0.2;
/// Fewer are noise of the arithmetic.
const RAYS: usize = 20;

pub fn find(subject: &Subject, walks: &Walks) -> Vec<Finding> {
    let from_surfaces = || walks.0.iter().filter(|step| step.from.is_some());
    let rays = from_surfaces().count();
    let escapes: Vec<&Step> = from_surfaces().filter(|step| step.hit.is_none()).collect();
    let share = escapes.len() as f64 / rays.max(1) as f64;
    if escapes.len() < RAYS || share > CLOSED {
        return Vec::new();
    }
    let rims: Vec<Vec<(u32, DVec3)>> = escapes.iter().filter_map(|step| rim(subject, step)).collect();
    // Otherwise they go through windows, which are meant.
    if (rims.len() as f64) < NARROW * escapes.len() as f64 {
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
        severity: Severity::Error,
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

/// What lies on both sides of the gap through which a ray escapes, if it is narrow.
fn rim(subject: &Subject, step: &Step) -> Option<Vec<(u32, DVec3)>> {
    let (patch, point) = step.from?;
    let frame = Frame::from_normal(step.direction);
    let meets = |across: DVec3| {
        let direction = (step.direction + across * BESIDE).normalize();
        let hit = subject.patches.trace_from(patch, point, direction)?;
        Some((hit.triangle, subject.patches.point_of(hit.triangle, hit.u, hit.v)))
    };
    let ways = [frame.x, frame.y, (frame.x + frame.y).normalize(), (frame.x - frame.y).normalize()];
    ways.into_iter().find_map(|way| Some(vec![meets(way)?, meets(-way)?]))
}
