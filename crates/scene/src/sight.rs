//! What a straight line of sight lets through: nothing beyond surfaces, a part beyond clear panes; and which points no light
//! reaches at all.
//!
//! Panes do not bend light, so that shadow rays may follow it through them. Bodies of glass with parallel faces, as windows
//! are often drawn, let it out in the direction in which it came, a little aside, which is neglected. Not here: other
//! bodies of glass, behind which only paths that are bent find light.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::brdf::{Detail, Specular, attenuated};
use crate::bvh::SurfaceHit;
use crate::patch::{PatchId, PatchScene, Side};
use crate::rgb::Rgb;

/// Cosine between the normals of parallel faces.
const PARALLEL: f64 = 1.0 - 1e-9;
/// Panes behind each other that are looked through.
const MOST_PANES: u32 = 16;
/// The share of the way to the middle of its cell by which a point is moved before it is asked whether something covers it.
const INWARDS: f64 = 0.01;
/// Share of the scene's radius within which two surfaces are in the same place.
const SAME_PLACE: f64 = 1e-5;
/// Directions, all 60° from the normal, in which a point within a body has to meet the body's inside.
const OBLIQUE: u32 = 6;

impl PatchScene {
    /// The share of light that passes the open segment between two points above surfaces: 0 or 1 but for panes. The
    /// points are lifted along the given unit normals as in [`PatchScene::visible`].
    pub fn transmittance(&self, a: DVec3, normal_a: DVec3, b: DVec3, normal_b: DVec3) -> Rgb {
        if !self.has_clear_glass() {
            return if self.visible(a, normal_a, b, normal_b) { Rgb::WHITE } else { Rgb::BLACK };
        }
        let [from, to] = [self.lifted(a, normal_a), self.lifted(b, normal_b)];
        let direction = to - from;
        self.through_panes(from, direction, self.trace(from, direction), 1.0)
    }

    /// The share of light that reaches `point` on `patch` from infinitely far away in direction `towards`.
    pub fn transmittance_from_sky(&self, patch: PatchId, point: DVec3, towards: DVec3) -> Rgb {
        let hit = self.trace_from(patch, point, towards);
        if !self.has_clear_glass() {
            return if hit.is_none() { Rgb::WHITE } else { Rgb::BLACK };
        }
        self.through_panes(point, towards, hit, f64::INFINITY)
    }

    /// The same for a free point, above no surface.
    pub fn transmittance_from_sky_to(&self, point: DVec3, towards: DVec3) -> Rgb {
        let hit = self.trace(point, towards);
        if !self.has_clear_glass() {
            return if hit.is_none() { Rgb::WHITE } else { Rgb::BLACK };
        }
        self.through_panes(point, towards, hit, f64::INFINITY)
    }

    /// True if nothing can light a point of `patch`: along the normal it meets something within `touching` metres, or it lies
    /// within a body, whose absorbing inside it meets in all directions that are tried. An absorbing back above it alone, as that of a
    /// leaf, leaves light a way from the side.
    pub fn is_covered(&self, patch: PatchId, point: DVec3, touching: f64) -> bool {
        let normal = self.normal(patch);
        // On an edge, a ray would pass between the faces of a body that meet there.
        let point = point.lerp(self.cell_centre(patch), INWARDS);
        let (a, b) = normal.any_orthonormal_pair();
        let oblique = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(OBLIQUE)).sin_cos();
            0.5 * normal + 0.75_f64.sqrt() * (cos * a + sin * b)
        };
        match self.trace_from(patch, point, normal) {
            None => false,
            Some(above) if above.t < touching => true,
            Some(above) => {
                self.is_inside(patch, point, normal, &above)
                    && (0..OBLIQUE).map(oblique).all(|towards| {
                        let met = self.trace_from(patch, point, towards);
                        met.is_some_and(|met| met.t < touching || self.is_inside(patch, point, towards, &met))
                    })
            }
        }
    }

    /// True if what a ray met is the absorbing inside of a body. A body may end in the plane of another's front, as a wall does
    /// at a ceiling, and a ray from within meet either first.
    fn is_inside(&self, patch: PatchId, point: DVec3, towards: DVec3, met: &SurfaceHit) -> bool {
        let absorbs = |hit: &SurfaceHit| hit.side == Side::Back && self.patch_of(hit).is_none();
        absorbs(met)
            || self
                .closest(self.lifted(point, self.normal(patch)), towards, met.triangle)
                .is_some_and(|other| absorbs(&other) && (other.t - met.t).abs() < SAME_PLACE * self.radius())
    }

    /// What panes let through up to parameter `end` of a ray whose first hit is known.
    fn through_panes(&self, origin: DVec3, direction: DVec3, first: Option<SurfaceHit>, end: f64) -> Rgb {
        let length = direction.length();
        let (mut share, mut hit, mut gone) = (Rgb::WHITE, first, 0.0);
        // The face by which the ray entered a body of glass.
        let mut entered: Option<SurfaceHit> = None;
        for _ in 0..MOST_PANES {
            let Some(met) = hit.filter(|h| gone + h.t < end) else {
                return if entered.is_none() { share } else { Rgb::BLACK };
            };
            let Some(specular) = self.clear_glass(&met) else { return Rgb::BLACK };
            let cosine = self.triangles[met.triangle as usize].normal.dot(direction / length).abs();
            if specular.is_pane() {
                share = share * specular.throughput(cosine, met.side == Side::Back)[1];
            } else {
                // Both faces see the angle that there is outside.
                share = share * specular.throughput(cosine, false)[1];
                match (entered, met.side) {
                    (None, Side::Front) => entered = Some(met),
                    (Some(face), Side::Back) if self.are_parallel(&face, &met) => {
                        let way = met.t * length * specular.stretch(cosine);
                        share = share * specular.attenuation().map_or(Rgb::WHITE, |a| attenuated(a, way));
                        entered = None;
                    }
                    _ => return Rgb::BLACK,
                }
            }
            if share.is_black() {
                return Rgb::BLACK;
            }
            gone += met.t;
            let front = self.triangles[met.triangle as usize].normal;
            let before = if front.dot(direction) > 0.0 { -front } else { front };
            hit = self.beyond(met.triangle, before, origin + direction * gone, direction);
        }
        Rgb::BLACK
    }

    /// What a surface lets through clearly; `None` if it does not.
    fn clear_glass(&self, hit: &SurfaceHit) -> Option<Specular> {
        self.material_at(hit.triangle).transmission.as_ref()?;
        self.scatter_at(hit, Detail::Picture).specular.filter(|s| s.is_clear())
    }

    /// True if what enters by one face leaves by the other as it came.
    fn are_parallel(&self, entered: &SurfaceHit, left: &SurfaceHit) -> bool {
        let normal = |hit: &SurfaceHit| self.triangles[hit.triangle as usize].normal;
        normal(entered).dot(normal(left)) < -PARALLEL
    }
}
