//! Animations, as far as they move cameras: tracks of the nodes that a camera hangs on (glTF §3.11).
//!
//! All else stays where the file puts it, and a warning says so: light is computed for one moment. A fault in an animation
//! costs that animation, never the scene: light does not need it. Called once all nodes have been placed.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use twinray_scene::{CameraAnimation, Interpolation, Joint, MovingJoint, Track};

use super::accessor::{Accessor, Component, Expected};
use super::container::Buffers;
use super::json::Element;
use super::node::Placed;
use crate::context::Context;
use crate::error::FormatError;
use crate::warning::name_list;

/// Cameras times animations that are looked at: a file of one megabyte could ask for 10⁸ of them.
const MOST_PAIRS: usize = 10_000;

/// The tracks of one node in one animation.
#[derive(Clone, Default)]
struct Tracks {
    translation: Option<Arc<Track<3>>>,
    rotation: Option<Arc<Track<4>>>,
}

/// Reads what moves cameras; `cameras` says of each camera of the scene which of the placed nodes it is.
pub(super) fn read(
    context: &mut Context<'_>,
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    placed: &[Placed<'_>],
    cameras: &[usize],
) -> Result<Vec<CameraAnimation>, FormatError> {
    let count = root.count("animations");
    if count == 0 {
        return Ok(Vec::new());
    }
    let at: HashMap<usize, usize> = placed.iter().enumerate().map(|(i, place)| (place.index, i)).collect();
    // Every node is marked once: who meets a marked one knows that its parents are.
    let mut carries = vec![false; placed.len()];
    for &camera in cameras {
        let mut next = Some(camera);
        while let Some(i) = next.filter(|&i| !carries[i]) {
            carries[i] = true;
            next = placed[i].parent.and_then(|parent| at.get(&parent).copied());
        }
    }
    let mut found = Vec::new();
    let (mut others, mut pairs) = (Vec::new(), 0);
    for index in 0..count {
        let Some(animation) = root.item("animations", index) else { continue };
        let name = animation.name_or(|| format!("animation {index}"));
        let read = tracks(context, root, buffers, &animation, &at, &carries);
        let (tracks, moves_others) = match read {
            Ok(read) => read,
            // A file that claims too much is refused whatever it claims it for.
            Err(error @ FormatError::OverLimit { .. }) => return Err(error),
            Err(error) => {
                let message = format!("the animation is ignored: {}", error.without_place());
                context.warn(&animation.path, message);
                continue;
            }
        };
        if (moves_others || tracks.is_empty()) && others.len() < 20 {
            others.push(name.clone());
        }
        if tracks.is_empty() {
            continue;
        }
        for (camera, &place) in cameras.iter().enumerate() {
            pairs += 1;
            if pairs > MOST_PAIRS {
                context.sum_up("animations", format!("only {MOST_PAIRS} pairs of a camera and an animation are read"));
                return Ok(found);
            }
            let joints = joints(placed, &at, &tracks, place);
            if joints.iter().any(|joint| matches!(joint, Joint::Moving(_))) {
                context
                    .charge(256 + name.len() as u64 + (joints.len() * size_of::<Joint>()) as u64, &animation.path)?;
                found.push(CameraAnimation { name: name.clone(), camera, joints });
            }
        }
    }
    if !others.is_empty() {
        let message = format!("only cameras move, other nodes stay where the file puts them: {}", name_list(&others));
        context.sum_up("animations", message);
    }
    Ok(found)
}

/// The tracks of nodes that carry cameras, by placed node, and whether the animation has others.
fn tracks(
    context: &mut Context<'_>,
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    animation: &Element<'_>,
    at: &HashMap<usize, usize>,
    carries: &[bool],
) -> Result<(HashMap<usize, Tracks>, bool), FormatError> {
    let mut tracks: HashMap<usize, Tracks> = HashMap::new();
    let mut moves_others = false;
    for channel in animation.items("channels")? {
        let target = channel.require("target", "an object")?;
        // Without a node an extension says what moves.
        let Some((node, _)) = target.follow("node", root, "nodes")? else {
            moves_others = true;
            continue;
        };
        let Some(&place) = at.get(&node).filter(|&&place| carries[place]) else {
            moves_others = true;
            continue;
        };
        let path = target.require("path", "\"translation\", \"rotation\" or \"scale\"")?;
        let (_, sampler) = channel
            .follow("sampler", animation, "samplers")?
            .ok_or_else(|| channel.fault("no sampler", "the index of a sampler"))?;
        let node = tracks.entry(place).or_default();
        match target.text("path")? {
            Some("translation") => node.translation = Some(track(context, root, buffers, &sampler)?),
            Some("rotation") => node.rotation = Some(track(context, root, buffers, &sampler)?),
            Some("scale") => context.warn(&path.path, "ignored: a camera that moves keeps the scale that its node has"),
            Some("weights") => moves_others = true,
            _ => return Err(path.invalid("\"translation\", \"rotation\", \"scale\" or \"weights\"")),
        }
    }
    tracks.retain(|_, t| t.translation.is_some() || t.rotation.is_some());
    Ok((tracks, moves_others))
}

fn track<const N: usize>(
    context: &mut Context<'_>,
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    sampler: &Element<'_>,
) -> Result<Arc<Track<N>>, FormatError> {
    use Component::{F32, I8, I16, U8, U16};
    let interpolation = match sampler.text("interpolation")? {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::Cubic,
        Some(_) => {
            let member = sampler.require("interpolation", "a string")?;
            return Err(member.invalid("\"LINEAR\", \"STEP\" or \"CUBICSPLINE\""));
        }
    };
    let accessor = |key: &str, expected: &Expected<'_>| {
        let member = sampler.require(key, "the index of an accessor")?;
        let (_, accessor) = member.as_link(root, "accessors")?;
        Accessor::load(root, buffers, &accessor, expected)
    };
    let input = accessor("input", &Expected { kind: "SCALAR", components: &[F32] })?;
    let output = match N {
        4 => accessor("output", &Expected { kind: "VEC4", components: &[F32, I8, U8, I16, U16] })?,
        _ => accessor("output", &Expected { kind: "VEC3", components: &[F32] })?,
    };
    let values_per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
    if input.count.checked_mul(values_per_key) != Some(output.count) {
        let found = format!("{} values for {} keys", output.count, input.count);
        return Err(sampler.fault(found, format!("{values_per_key} values for each key")));
    }
    // Accessors without data may claim any count.
    context.charge((input.count * 4) as u64 + (output.count * N * 4) as u64, &sampler.path)?;
    let times: Vec<f32> = (0..input.count).map(|i| input.floats::<1>(i)[0]).collect();
    let values: Vec<[f32; N]> = (0..output.count).map(|i| output.floats(i)).collect();
    let is_increasing = times.iter().all(|t| t.is_finite()) && times.is_sorted_by(|a, b| a < b);
    if !is_increasing {
        return Err(sampler.fault("times that do not increase", "keys in the order of their times"));
    }
    let limit = context.limits.max_coordinate as f32;
    if let Some(key) = values.iter().position(|v| !v.iter().all(|c| c.is_finite() && c.abs() <= limit)) {
        let found = format!("value {key} with a number that is none, or beyond {limit:e}");
        return Err(sampler.fault(found, "finite numbers"));
    }
    Ok(Arc::new(Track { times, values, interpolation }))
}

/// The way from the world to a camera; what does not move is one step.
fn joints(
    placed: &[Placed<'_>],
    at: &HashMap<usize, usize>,
    tracks: &HashMap<usize, Tracks>,
    camera: usize,
) -> Vec<Joint> {
    let mut joints: Vec<Joint> = Vec::new();
    let mut next = Some(camera);
    while let Some(i) = next {
        let place = &placed[i];
        match (tracks.get(&i), joints.last_mut()) {
            (Some(tracks), _) => joints.push(Joint::Moving(moving(place, tracks))),
            (None, Some(Joint::Fixed(below))) => *below = place.to_parent * *below,
            (None, _) => joints.push(Joint::Fixed(place.to_parent)),
        }
        next = place.parent.and_then(|parent| at.get(&parent).copied());
    }
    joints.reverse();
    joints
}

fn moving(place: &Placed<'_>, tracks: &Tracks) -> MovingJoint {
    let rest = place.to_parent;
    // A matrix should not stand where something moves (§3.5.3); its columns tell a scale all the same.
    let of_matrix = || {
        let m = rest.matrix3;
        DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
    };
    let has_matrix = place.node.get("matrix").is_some();
    let scale = place.node.numbers("scale").ok().flatten().map(DVec3::from_array);
    let scale = if has_matrix { of_matrix() } else { scale.unwrap_or(DVec3::ONE) };
    MovingJoint { rest, scale, translation: tracks.translation.clone(), rotation: tracks.rotation.clone() }
}
