//! The normal that pictures show: interpolated between vertices, bent by normal maps.
//!
//! Tangents are the file's, or else those of the texture coordinates on each triangle, made square to the interpolated
//! normal. MikkTSpace would average the latter over vertices as well; what remains is a step at edges between triangles
//! whose coordinates are sheared against each other. Light in the solver knows geometric normals alone.

use glam::DVec3;

use crate::authored::NormalMap;
use crate::bvh::SurfaceHit;
use crate::patch::{PatchScene, Side, vec};
use crate::texture::Encoding;

/// Least cosine between a bent normal and the geometric one: what bends further would show the surface from behind.
const LEAST: f64 = 0.05;

impl PatchScene {
    /// Normal for display at a point of a triangle's side: interpolated vertex normals where there are any.
    pub fn shading_normal(&self, triangle: u32, side: Side, u: f64, v: f64) -> DVec3 {
        let flat = self.triangles[triangle as usize].normal;
        let smooth = self.authored_normal(triangle, u, v).unwrap_or(flat);
        // Authors' normals may point either way on two-sided surfaces; the side decides.
        let front = if smooth.dot(flat) < 0.0 { -smooth } else { smooth };
        if side == Side::Front { front } else { -front }
    }

    /// The same with the material's normal map, averaged over `footprint` metres ([`PatchScene::surface_at`]).
    pub fn normal_at(&self, hit: &SurfaceHit, footprint: f64) -> DVec3 {
        let front = self.shading_normal(hit.triangle, Side::Front, hit.u, hit.v);
        let bent = match &self.material_at(hit.triangle).normal_map {
            Some(map) => self.bent(hit, map, front, footprint).unwrap_or(front),
            None => front,
        };
        // The back of a surface is the front's mirror image (glTF 2.0, 3.9.5: its normals are reversed).
        if hit.side == Side::Front { bent } else { -bent }
    }

    /// Unit normal between the vertices as the author has it.
    fn authored_normal(&self, triangle: u32, u: f64, v: f64) -> Option<DVec3> {
        let n = self.attributes[triangle as usize].normals?;
        (vec(n[0]) * (1.0 - u - v) + vec(n[1]) * u + vec(n[2]) * v).try_normalize()
    }

    fn bent(&self, hit: &SurfaceHit, map: &NormalMap, front: DVec3, footprint: f64) -> Option<DVec3> {
        let [right, up] = self.tangents_at(hit, map, front)?;
        let place = [hit.u, hit.v];
        let texel = self.texture_at(Some(&map.texture), hit.triangle, Encoding::Linear, place, footprint).0;
        let [x, y, z] = texel.map(|c| 2.0 * c - 1.0).to_array();
        let bent = (right * (x * map.scale) + up * (y * map.scale) + front * z).try_normalize()?;
        let flat = self.triangles[hit.triangle as usize].normal;
        let above = bent.dot(flat);
        if above >= LEAST {
            return Some(bent);
        }
        // Turned back within its plane with the geometric normal.
        let along = (bent - flat * above).try_normalize()?;
        Some(flat * LEAST + along * (1.0 - LEAST * LEAST).sqrt())
    }

    /// Directions of the map's x (right) and y (up) at a point, square to `front` and to each other.
    fn tangents_at(&self, hit: &SurfaceHit, map: &NormalMap, front: DVec3) -> Option<[DVec3; 2]> {
        let (triangle, u, v) = (hit.triangle, hit.u, hit.v);
        // glTF: tangents mean nothing without normals.
        let given = self.tangents.get(triangle as usize).copied().flatten();
        if let (Some(t), Some(normal)) = (given, self.authored_normal(triangle, u, v)) {
            let xyz = |k: usize| vec([t[k][0], t[k][1], t[k][2]]);
            let between = xyz(0) * (1.0 - u - v) + xyz(1) * u + xyz(2) * v;
            if let Some(right) = (between - normal * between.dot(normal)).try_normalize() {
                return Some([right, normal.cross(right) * f64::from(t[0][3].signum())]);
            }
        }
        // Where the picture's u and v grow; its up is against v.
        let t = self.texcoords(triangle, &map.texture)?;
        let step = |i: usize| map.texture.transform.apply_to_step([0, 1].map(|k| f64::from(t[i][k] - t[0][k])));
        let ([du1, dv1], [du2, dv2]) = (step(1), step(2));
        let area = du1 * dv2 - du2 * dv1;
        let [a, b, c] = self.corners(triangle);
        let (e1, e2) = (b - a, c - a);
        let along_u = (e1 * dv2 - e2 * dv1) * area.signum();
        let along_v = (e2 * du1 - e1 * du2) * area.signum();
        let right = (along_u - front * along_u.dot(front)).try_normalize().filter(|_| area != 0.0)?;
        let up = front.cross(right);
        Some([right, if up.dot(along_v) > 0.0 { -up } else { up }])
    }
}

#[cfg(test)]
mod tests;
