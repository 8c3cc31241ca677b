//! A point where a path meets a surface, and the ways on from it.
//!
//! What a camera sees, be it in mirrors and through glass, has the author's display normals; everywhere else normals are
//! geometric, as in the solver's transport. Knows no solution: the path tracer uses it too.

use glam::DVec3;
use twinray_scene::brdf::{Detail, Event, Scatter, mirrored};
use twinray_scene::{PatchId, PatchScene, Rgb, Side, SurfaceHit};

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub patch: PatchId,
    pub point: DVec3,
    /// Of the triangle, on the side that was met.
    pub geometric: DVec3,
    /// What reflections follow.
    pub normal: DVec3,
    pub scatter: Scatter,
    /// Whether the back was met: of glass, from within.
    pub inside: bool,
    /// Whether it is clear glass for shadow rays.
    pub is_clear: bool,
}

/// How normals and lobes are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    /// As a camera sees them.
    Display,
    /// Geometric normals, colours and lobes at full resolution.
    Plain,
    /// As the solver has them: colours are means of patches.
    Patch,
}

/// A way on that was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    pub direction: DVec3,
    /// Whether it goes on beyond the surface.
    pub beyond: bool,
    /// What the path is multiplied by.
    pub factor: Rgb,
    /// What attenuates it, 1/m.
    pub medium: Option<Rgb>,
    /// True if it passes clear glass, as shadow rays do where they come out in the direction in which they went in.
    pub clear: bool,
}

/// What happens to a path at a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// It is scattered by the BRDF; the factor is 1 over the probability of that.
    Scatter(f64),
    /// It goes on sharply.
    On(Way),
    /// It ends in the dark.
    End,
}

impl Vertex {
    /// Where a ray from direction `wo` (towards its origin) met `patch`.
    pub fn new(scene: &PatchScene, hit: &SurfaceHit, patch: PatchId, wo: DVec3, look: Look) -> Self {
        let geometric = scene.normal(patch);
        let (scatter, normal) = match look {
            Look::Display => {
                let bent = scene.normal_at(hit, 0.0);
                (scene.scatter_at(hit, Detail::Picture), if bent.dot(wo) > 0.0 { bent } else { geometric })
            }
            Look::Plain => (scene.scatter_at(hit, Detail::Picture), geometric),
            Look::Patch => (scene.scatter(patch), geometric),
        };
        let point = scene.point_of(hit.triangle, hit.u, hit.v);
        // Glass that is only nearly clear is clear to the solver, but not to shadow rays.
        let is_clear = scatter.specular.is_some_and(|s| s.is_clear())
            && (look != Look::Patch || scene.scatter_at(hit, Detail::Picture).specular.is_some_and(|s| s.is_clear()));
        Self { patch, point, geometric, normal, scatter, inside: hit.side == Side::Back, is_clear }
    }

    /// The first surface on the way in `direction`, on this side or `beyond`.
    pub fn next(&self, scene: &PatchScene, beyond: bool, direction: DVec3) -> Option<SurfaceHit> {
        let triangle = scene.triangle_of(self.patch);
        match beyond {
            true => scene.beyond(triangle, self.geometric, self.point, direction),
            false => scene.leave(triangle, self.geometric, self.point, direction),
        }
    }

    /// Chooses what happens to a path that came from `wo`; `event` is uniform, and so is `blur`, which is used where
    /// transmission is rough.
    pub fn step(&self, wo: DVec3, event: f64, blur: impl FnOnce() -> [f64; 2]) -> Step {
        let Some(specular) = &self.scatter.specular else { return Step::Scatter(1.0) };
        let cosine = self.normal.dot(wo);
        if cosine <= 0.0 {
            return Step::End;
        }
        let rest = self.scatter.brdf.albedo(cosine).max_channel();
        let choices = specular.choices(cosine, self.inside, rest, false);
        let (event, factor) = choices.choose(event);
        match event {
            Event::Stop if rest == 0.0 => Step::End,
            Event::Stop => Step::Scatter(factor.r),
            Event::Reflect => {
                let smooth = mirrored(self.normal, wo);
                let direction = if smooth.dot(self.geometric) > 0.0 { smooth } else { mirrored(self.geometric, wo) };
                let medium = specular.attenuation().filter(|_| self.inside);
                Step::On(Way { direction, beyond: false, factor, medium, clear: false })
            }
            Event::Transmit => {
                let Some((direction, weight)) = specular.refract_rough(self.normal, wo, self.inside, blur()) else {
                    return Step::End;
                };
                if direction.dot(self.geometric) >= 0.0 {
                    return Step::End;
                }
                let medium = specular.attenuation().filter(|_| !self.inside);
                Step::On(Way {
                    direction,
                    beyond: true,
                    factor: factor * (weight * specular.radiance_ratio(self.inside)),
                    medium,
                    clear: self.is_clear,
                })
            }
        }
    }
}
