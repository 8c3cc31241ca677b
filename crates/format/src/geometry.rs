//! Triangles made fit for light: damaged, empty and doubled ones are taken out, and unused vertices with them.
//!
//! Lives here: what both scene readers do to a mesh once its arrays are filled, and the account of placed
//! triangles. Not here: where the arrays come from. Called by: `gltf` and `obj`.

use std::hash::{DefaultHasher, Hash, Hasher};

use glam::DVec3;
use twinray_scene::Mesh;

use crate::context::Context;
use crate::error::FormatError;

/// A triangle whose double area is below this part of its longest edge squared has no usable normal: the sine
/// of its angle is then below what the rounding of f32 coordinates leaves in it.
const ZERO_AREA: f64 = 1e-10;

/// Takes out of `mesh` what light cannot use, each kind with one warning:
/// triangles with damaged vertices, without area, and exact copies (same corners in the same order of rotation)
/// of an earlier one, which would shadow each other. Answers which of the vertices are left, if not all are.
pub(crate) fn clean(context: &mut Context<'_>, mesh: &mut Mesh) -> Option<Vec<bool>> {
    let limit = context.limits.max_coordinate;
    let good: Vec<bool> = mesh.positions.iter().map(|p| p.iter().all(|c| f64::from(c.abs()) <= limit)).collect();
    let before = mesh.triangles.len();
    mesh.triangles.retain(|t| t.iter().all(|&i| good[i as usize]));
    let damaged = before - mesh.triangles.len();
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|i| DVec3::from(mesh.positions[i as usize].map(f64::from)));
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (b - a).cross(c - a).length() > ZERO_AREA * longest
    });
    let empty = before - damaged - mesh.triangles.len();
    let doubled = remove_copies(mesh);

    let element = format!("mesh \"{}\"", mesh.name);
    let mut report = |count: usize, what: &str| {
        if count > 0 {
            context.warn(&element, format!("{count} of {before} triangles dropped: {what}"));
        }
    };
    report(damaged, &format!("a corner is not a number or beyond {limit:e}"));
    report(empty, "no area");
    report(doubled, "exact copies of others");
    let left = (mesh.triangles.len() < before).then(|| drop_unused_vertices(mesh));
    mend_attributes(context, mesh, &element);
    left
}

/// Removes all but the first of triangles with equal corners and orientation; answers how many.
fn remove_copies(mesh: &mut Mesh) -> usize {
    // Corners as bit patterns (−0 counts as 0), rotated so that the smallest comes first: copies become equal
    // and mirror images do not. Sorting by hash keeps this at 12 bytes a triangle.
    let corner = |i: u32| mesh.positions[i as usize].map(|c| (c + 0.0).to_bits());
    let key = |t: [u32; 3]| {
        let k = t.map(corner);
        let first = (0..3).min_by_key(|&i| k[i]).unwrap_or(0);
        [k[first], k[(first + 1) % 3], k[(first + 2) % 3]]
    };
    let hash = |t: [u32; 3]| {
        let mut hasher = DefaultHasher::new();
        key(t).hash(&mut hasher);
        hasher.finish()
    };
    let mut order: Vec<(u64, u32)> = (0u32..).zip(&mesh.triangles).map(|(i, &t)| (hash(t), i)).collect();
    let triangles = &mesh.triangles;
    order.sort_unstable_by(|a, b| {
        a.0.cmp(&b.0).then_with(|| key(triangles[a.1 as usize]).cmp(&key(triangles[b.1 as usize]))).then(a.1.cmp(&b.1))
    });
    let mut copy = vec![false; triangles.len()];
    for pair in order.windows(2) {
        let same = pair[0].0 == pair[1].0 && key(triangles[pair[0].1 as usize]) == key(triangles[pair[1].1 as usize]);
        copy[pair[1].1 as usize] = same;
    }
    let before = triangles.len();
    let mut is_copy = copy.iter();
    mesh.triangles.retain(|_| !is_copy.next().copied().unwrap_or(false));
    before - mesh.triangles.len()
}

/// Renumbers the vertices so that every one belongs to a triangle; answers which do.
fn drop_unused_vertices(mesh: &mut Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
    let before = |count: &mut u32, &used: &bool| {
        let index = *count;
        *count += u32::from(used);
        Some(index)
    };
    let renumbered: Vec<u32> = used.iter().scan(0, before).collect();
    mesh.triangles.iter_mut().flatten().for_each(|i| *i = renumbered[*i as usize]);
    fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
        let mut flags = used.iter();
        values.retain(|_| flags.next().copied().unwrap_or(false));
    }
    keep(&mut mesh.positions, &used);
    mesh.normals.iter_mut().for_each(|n| keep(n, &used));
    mesh.tangents.iter_mut().for_each(|t| keep(t, &used));
    mesh.texcoords.iter_mut().chain(&mut mesh.second_texcoords).for_each(|t| keep(t, &used));
    used
}

/// Replaces normals without direction by the geometric ones around the vertex, and damaged texture coordinates
/// by the origin.
fn mend_attributes(context: &mut Context<'_>, mesh: &mut Mesh, element: &str) {
    if let Some(normals) = &mut mesh.normals {
        let usable = |n: &[f32; 3]| {
            let length = DVec3::from(n.map(f64::from)).length();
            length.is_finite() && length > 1e-6
        };
        let bad = normals.iter().filter(|n| !usable(n)).count();
        if bad > 0 {
            let mut sums = vec![DVec3::ZERO; normals.len()];
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| DVec3::from(mesh.positions[i as usize].map(f64::from)));
                t.iter().for_each(|&i| sums[i as usize] += (b - a).cross(c - a));
            }
            for (normal, sum) in normals.iter_mut().zip(sums).filter(|(n, _)| !usable(n)) {
                *normal = sum.normalize_or(DVec3::Y).as_vec3().to_array();
            }
            context.warn(element, format!("{bad} normals have no direction; the triangles around them give it"));
        }
    }
    let mut mend = |count: usize, what: &str| {
        if count > 0 {
            context.warn(element, format!("{count} {what} are not numbers; taken as 0"));
        }
    };
    let texcoords = mesh.texcoords.iter_mut().chain(&mut mesh.second_texcoords).flatten();
    mend(without_damage(texcoords), "texture coordinates");
    mend(without_damage(mesh.tangents.iter_mut().flatten()), "tangents");
}

/// Puts zeros where a number is none; answers how many elements were damaged.
fn without_damage<'a, const N: usize>(values: impl Iterator<Item = &'a mut [f32; N]>) -> usize {
    let damaged = values.filter(|v| v.iter().any(|c| !c.is_finite()));
    damaged.map(|v| *v = [0.0; N]).count()
}

/// Counts triangles as they are placed in the world.
#[derive(Default)]
pub(crate) struct Account {
    triangles: u64,
    instances: u64,
}

impl Account {
    /// Counts one more placed mesh.
    pub(crate) fn add(&mut self, context: &Context<'_>, element: &str, triangles: usize) -> Result<(), FormatError> {
        self.triangles = self.triangles.saturating_add(triangles as u64);
        self.instances += 1;
        check_triangles(context, element, self.triangles)?;
        if self.instances > context.limits.max_instances {
            return Err(FormatError::OverLimit {
                file: context.file.to_owned(),
                element: element.to_owned(),
                limit: "max_instances",
                needed: format!("more than {} placed meshes", context.limits.max_instances),
                allowed: context.limits.max_instances,
            });
        }
        Ok(())
    }
}

/// The error for a scene that has nothing to light, with the reasons the warnings give: nobody gets to see those.
pub(crate) fn no_triangles(context: &Context<'_>, element: &str) -> FormatError {
    const REASONS: usize = 4;
    let reasons: Vec<String> =
        context.warnings.iter().take(REASONS).map(|w| format!("{}: {}", w.element, w.message)).collect();
    let mut hint = "Light needs surfaces: export triangles".to_owned();
    if !reasons.is_empty() {
        hint += &format!(" (on the way: {})", reasons.join("; "));
    }
    FormatError::unsupported(context.file, element, "a scene without usable triangles", hint)
}

/// Refuses more triangles than the limits allow.
pub(crate) fn check_triangles(context: &Context<'_>, element: &str, triangles: u64) -> Result<(), FormatError> {
    if triangles <= context.limits.max_triangles {
        return Ok(());
    }
    Err(FormatError::OverLimit {
        file: context.file.to_owned(),
        element: element.to_owned(),
        limit: "max_triangles",
        needed: format!("{triangles} triangles"),
        allowed: context.limits.max_triangles,
    })
}

/// Memory of the arrays of a mesh whose vertices take `vertex` bytes each, for the budget.
pub(crate) fn mesh_bytes(vertices: usize, triangles: usize, vertex: u64) -> u64 {
    vertices as u64 * vertex + triangles as u64 * 12
}

/// Memory of a vertex: its position, and whichever it has of a normal, a tangent and texture coordinates.
pub(crate) fn vertex_bytes(normal: bool, tangent: bool, texcoords: usize) -> u64 {
    12 + 12 * u64::from(normal) + 16 * u64::from(tangent) + 8 * texcoords as u64
}

/// Memory of a vertex that has everything.
pub(crate) const RICHEST_VERTEX: u64 = 12 + 12 + 16 + 2 * 8;
