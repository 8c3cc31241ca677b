//! The node tree: where things stand in the world.
//!
//! Lives here: the walk, transforms composed in f64, cameras. Not here: what stands there (`primitive`,
//! `material`). The walk keeps its own stack and visits every node once, so that neither a cycle nor a node with
//! two parents can make it long.

use glam::{DAffine3, DMat4, DQuat, DVec3};
use twinray_scene::{Camera, Projection};

use super::json::Element;
use crate::context::Context;
use crate::error::FormatError;

/// A node with its place in the world.
pub(super) struct Placed<'a> {
    pub(super) node: Element<'a>,
    pub(super) index: usize,
    /// Index of its parent's node, if it has one.
    pub(super) parent: Option<usize>,
    pub(super) to_parent: DAffine3,
    pub(super) to_world: DAffine3,
}

/// Nodes of the scene to show, parents before children, in the order of the file.
pub(super) fn walk<'a>(context: &mut Context<'_>, root: &Element<'a>) -> Result<Vec<Placed<'a>>, FormatError> {
    let mut seen = vec![Seen::No; root.count("nodes")];
    let mut found = Vec::new();
    // A node is claimed before it is pushed, so that the stack never holds more than the file's nodes.
    let claim = |seen: &mut Vec<Seen>, index: usize, node: &Element<'_>| match seen[index] {
        Seen::No => {
            seen[index] = Seen::Claimed;
            Ok(())
        }
        Seen::Open => Err(node.fault("a node that is its own descendant", "a tree without cycles")),
        Seen::Claimed | Seen::Done => Err(node.fault("a node listed twice", "at most one parent for each node")),
    };
    // Children are pushed in reverse, so that the first is visited first; `Leave` closes a node.
    enum Step<'a> {
        Enter(usize, Element<'a>, Option<(usize, DAffine3)>, u64),
        Leave(usize),
    }
    let mut stack: Vec<Step<'a>> = Vec::new();
    for (index, node) in starts(context, root)?.into_iter().rev() {
        claim(&mut seen, index, &node)?;
        stack.push(Step::Enter(index, node, None, 1));
    }
    while let Some(step) = stack.pop() {
        let (index, node, parent, depth) = match step {
            Step::Enter(index, node, parent, depth) => (index, node, parent, depth),
            Step::Leave(index) => {
                seen[index] = Seen::Done;
                continue;
            }
        };
        seen[index] = Seen::Open;
        if depth > context.limits.max_depth {
            return Err(FormatError::OverLimit {
                file: context.file.to_owned(),
                element: node.path.clone(),
                limit: "max_depth",
                needed: format!("{depth} levels of nodes"),
                allowed: context.limits.max_depth,
            });
        }
        let to_parent = local_transform(context, &node)?;
        let to_world = parent.map_or(to_parent, |(_, parent)| parent * to_parent);
        stack.push(Step::Leave(index));
        for (child_index, child) in links(root, &node, "children")?.into_iter().rev() {
            claim(&mut seen, child_index, &child)?;
            stack.push(Step::Enter(child_index, child, Some((index, to_world)), depth + 1));
        }
        found.push(Placed { node, index, parent: parent.map(|(parent, _)| parent), to_parent, to_world });
    }
    Ok(found)
}

#[derive(Clone, Copy)]
enum Seen {
    No,
    Claimed,
    Open,
    Done,
}

/// The root nodes: of the default scene, else of the first, else all nodes without a parent.
fn starts<'a>(context: &mut Context<'_>, root: &Element<'a>) -> Result<Vec<(usize, Element<'a>)>, FormatError> {
    let scenes = root.count("scenes");
    let shown = match root.follow("scene", root, "scenes")? {
        Some((index, scene)) => Some((index, scene)),
        None => root.item("scenes", 0).map(|scene| (0, scene)),
    };
    if let Some((shown, scene)) = shown {
        if scenes > 1 {
            let others = (0..scenes).filter(|&i| i != shown).take(20).filter_map(|i| root.item("scenes", i));
            let others: Vec<String> = others.map(|s| s.path).collect();
            let message = format!("only {} is read; ignored: {}", scene.path, others.join(", "));
            context.warn("scenes", message);
        }
        return links(root, &scene, "nodes");
    }
    let mut has_parent = vec![false; root.count("nodes")];
    for node in root.items("nodes")? {
        for (child, _) in links(root, &node, "children")? {
            has_parent[child] = true;
        }
    }
    if !has_parent.is_empty() {
        context.warn("scenes", "the file has no scene: all nodes are taken");
    }
    Ok((0..has_parent.len()).filter(|&i| !has_parent[i]).filter_map(|i| Some((i, root.item("nodes", i)?))).collect())
}

/// The nodes that the array `key` of `owner` lists.
fn links<'a>(root: &Element<'a>, owner: &Element<'a>, key: &str) -> Result<Vec<(usize, Element<'a>)>, FormatError> {
    let (listed, nodes) = (owner.count(key), root.count("nodes"));
    if listed > nodes {
        let expected = format!("each of the {nodes} nodes once at most");
        return Err(owner.fault(format!("{listed} entries in {key}"), expected));
    }
    owner.items(key)?.map(|link| link.as_link(root, "nodes")).collect()
}

/// Node to parent, from its matrix or from translation, rotation and scale (glTF §3.5.3).
fn local_transform(context: &mut Context<'_>, node: &Element<'_>) -> Result<DAffine3, FormatError> {
    if let Some(columns) = node.numbers::<16>("matrix")? {
        let matrix = DMat4::from_cols_array(&columns);
        let bottom = [columns[3], columns[7], columns[11], columns[15]];
        if bottom != [0.0, 0.0, 0.0, 1.0] {
            context.warn(format!("{}.matrix", node.path), format!("the last row {bottom:?} is read as [0, 0, 0, 1]"));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let translation = node.numbers("translation")?.map_or(DVec3::ZERO, DVec3::from_array);
    let scale = node.numbers("scale")?.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = match node.numbers("rotation")? {
        None => DQuat::IDENTITY,
        Some(q) => {
            let q = DQuat::from_array(q);
            let length = q.length();
            // Exporters round quaternions to f32 or to a few digits; only clearly wrong ones are worth a word.
            if !(length.is_finite() && length > 1e-6) {
                context.warn(format!("{}.rotation", node.path), "a quaternion of length 0; no rotation is used");
                DQuat::IDENTITY
            } else {
                if (length - 1.0).abs() > 1e-2 {
                    let message = format!("a quaternion of length {length}; scaled to 1");
                    context.warn(format!("{}.rotation", node.path), message);
                }
                q / length
            }
        }
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// The camera of a node, if it has one that can be used. glTF cameras look along −Z with +Y up (§3.10).
pub(super) fn camera(context: &mut Context<'_>, root: &Element<'_>, placed: &Placed<'_>) -> Option<Camera> {
    placed.node.get("camera")?;
    match try_camera(root, placed) {
        Ok(camera) => camera,
        Err(error) => {
            let message = format!("the camera is ignored: {}", error.without_place());
            context.warn(&placed.node.path, message);
            None
        }
    }
}

fn try_camera(root: &Element<'_>, placed: &Placed<'_>) -> Result<Option<Camera>, FormatError> {
    let Some((index, camera)) = placed.node.follow("camera", root, "cameras")? else { return Ok(None) };
    let positive = |e: &Element<'_>, key: &str| -> Result<f64, FormatError> {
        let member = e.require(key, "a positive number")?;
        e.number(key)?.filter(|v| *v > 0.0).ok_or_else(|| member.invalid("a positive number"))
    };
    let (projection, aspect) = match camera.text("type")? {
        Some("perspective") => {
            let p = camera.require("perspective", "an object")?;
            let vertical_fov = positive(&p, "yfov")?;
            if vertical_fov >= std::f64::consts::PI {
                return Err(p.fault(format!("a yfov of {vertical_fov}"), "an angle below π"));
            }
            (Projection::Perspective { vertical_fov }, p.number("aspectRatio")?.filter(|a| *a > 0.0))
        }
        Some("orthographic") => {
            let o = camera.require("orthographic", "an object")?;
            // Negative magnifications mirror the picture; that is rarely meant.
            let (x, y) = (o.number("xmag")?.unwrap_or(0.0).abs(), o.number("ymag")?.unwrap_or(0.0).abs());
            if y == 0.0 {
                return Err(o.fault("no ymag, or 0", "half of the height of the picture"));
            }
            (Projection::Orthographic { half_height: y }, Some(x / y).filter(|a| *a > 0.0))
        }
        _ => return Err(camera.fault("another type", "\"perspective\" or \"orthographic\"")),
    };
    let matrix = placed.to_world.matrix3;
    let axis = |v: DVec3| (matrix * v).try_normalize();
    let (Some(forward), Some(up)) = (axis(-DVec3::Z), axis(DVec3::Y)) else {
        return Err(placed.node.fault("a scale of 0", "a transform that keeps directions"));
    };
    let name = placed.node.name_or(|| camera.name_or(|| format!("camera {index}")));
    Ok(Some(Camera { name, eye: placed.to_world.translation, forward, up, projection, lens: None, aspect }))
}
