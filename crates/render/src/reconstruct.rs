//! Smooth light from patch means: what stands between cells and the eye.
//!
//! At a point x, irradiance is a weighted mean over nearby elements of the same surface: a compact kernel of the
//! distance, times area and visible share, faded out where normals turn or a step leads off the tangent plane. Only
//! elements that the point's own can see take part, so that nothing passes a wall; an element that passes under a wall divides
//! its light as its whole neighbours on either side have it. The weights vary continuously with x: no facets. Elements are
//! looked at when a pixel first needs them.

use std::sync::OnceLock;

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use crate::element::{Element, Elements};
use crate::grid::Grid;
use crate::vantage::Vantage;

/// Radius of the kernel over the side of an element: about ten elements share a point.
const RADIUS: f64 = 1.9;
/// The most neighbours of an element: those within the kernel of any of its points, nearest first.
const MOST_NEIGHBOURS: usize = 72;
/// Cosine between normals below which surfaces are not the same.
const SAME_NORMAL: f64 = 0.8;
/// Rise over run off the tangent plane beyond which surfaces are not the same.
const SAME_PLANE: f64 = 0.35;
/// Points are lifted by this share of a typical cell's side before it is asked whether they see each other.
const LIFT: f64 = 0.03;
/// A surface closer than this share of a typical cell's side covers a point.
const TOUCHING: f64 = 0.05;
/// Corners of a cell are tested so far towards its middle.
const INWARDS: f64 = 0.05;
/// Points at which a suspicious cell is tested for what covers it.
const COVER_TESTS: u32 = 24;
/// Cells of which less than this share is free say too little of their light.
const LEAST_SHARE: f64 = 0.2;
/// A cell with no more neighbours than this, itself included, has too little to average.
const ALONE: usize = 2;
/// Neighbours of a point that its own cell does not know.
const NEIGHBOURS_OF_SLIVER: usize = 8;

/// A part of an element whose points see each other. A cell that passes under a wall has one on either side, and
/// light must not pass from the one to the other. All is one part unless something stands on the cell; none is left
/// if all of it is covered.
#[derive(Clone, Copy, Debug)]
struct Part {
    origin: Vantage,
    /// Its share of the cell. What is covered gets no light, and would show as a dark rim: a cell's light is that of all its parts.
    share: f64,
}

/// A part of an element.
type Neighbour = (u32, u8);

/// A point of a surface, with its display normal and that of its triangle.
#[derive(Clone, Copy)]
struct Place {
    x: DVec3,
    n: DVec3,
    facet: DVec3,
}

impl Place {
    /// How far a neighbour at `offset` with display normal `there` is off the surface: 0 in the plane of the facet,
    /// and 0 on an arc, whose chord is perpendicular to the mean of its ends' normals.
    fn rise(&self, offset: DVec3, there: DVec3) -> f64 {
        let mean = (self.n + there).normalize_or(self.facet);
        offset.dot(self.facet).abs().min(offset.dot(mean).abs())
    }
}

/// Reconstructed light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Smooth {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Radiance of the lobe towards the observer: of direct light, and of all other light.
    pub lobe: [Rgb; 2],
}

/// How far an element's light reaches.
#[derive(Clone, Copy)]
enum Kernel {
    /// Each element's own radius.
    Elements,
    /// A common radius.
    Wide(f64),
}

/// Reconstruction over all elements of a scene.
#[derive(Debug)]
pub struct Reconstruction<'a> {
    scene: &'a PatchScene,
    solution: &'a Solution,
    surfaces: Surfaces,
    /// Per element.
    splits: Vec<OnceLock<Split>>,
}

/// How the light of an element is divided among its parts.
#[derive(Debug)]
struct Split {
    /// Light of each part over that of the whole element. Times the parts' shares, they add up to 1.
    factors: Box<[f64]>,
    /// Whether neighbours told.
    is_known: bool,
}

/// What is known of a scene's surfaces whatever their light: it outlives solutions.
#[derive(Debug)]
pub struct Surfaces {
    elements: Elements,
    grid: Grid,
    parts: Vec<OnceLock<Box<[Part]>>>,
    /// Per element and part.
    neighbours: Vec<OnceLock<Vec<Box<[Neighbour]>>>>,
}

impl Surfaces {
    /// Prepares the search for neighbours. O(K log K).
    pub fn new(scene: &PatchScene) -> Self {
        let elements = Elements::new(scene);
        let centres: Vec<DVec3> = elements.list.iter().map(|e| e.centre).collect();
        let count = centres.len();
        Self {
            grid: Grid::new(RADIUS * elements.typical_size, &centres),
            elements,
            parts: (0..count).map(|_| OnceLock::new()).collect(),
            neighbours: (0..count).map(|_| OnceLock::new()).collect(),
        }
    }
}

impl<'a> Reconstruction<'a> {
    /// Prepares the search for neighbours. O(K log K).
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        Self::over(scene, solution, Surfaces::new(scene))
    }

    /// The same where the scene's surfaces are known already. O(K).
    pub fn over(scene: &'a PatchScene, solution: &'a Solution, mut surfaces: Surfaces) -> Self {
        surfaces.elements.light(scene, solution);
        let splits = surfaces.parts.iter().map(|_| OnceLock::new()).collect();
        Self { scene, solution, surfaces, splits }
    }

    /// What has been learnt of the scene's surfaces.
    pub fn into_surfaces(self) -> Surfaces {
        self.surfaces
    }

    /// Light at a hit on `patch`, smooth across cells.
    pub fn smooth(&self, patch: PatchId, hit: &SurfaceHit) -> Smooth {
        let x = self.scene.point_of(hit.triangle, hit.u, hit.v);
        let n = self.scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v);
        let own = self.surfaces.elements.of_patch[patch.index()];
        let parts = self.parts(own);
        let part = match parts.len() {
            0 => None,
            1 => Some(0),
            _ => {
                let here = Vantage::new(self.scene, patch, x, n);
                parts.iter().position(|p| self.sees(&here, &p.origin))
            }
        };
        let place = Place { x, n, facet: self.scene.normal(patch) };
        let list = part.map_or(&[][..], |part| &self.neighbours(own)[part]);
        let near = self.mean(own, &place, list, Kernel::Elements);
        // A sliver that its own cell does not know, or a cell alone: ask the nearest that the point itself can see.
        near.filter(|_| list.len() > ALONE)
            .or_else(|| {
                let reach = 3.0 * self.radius(self.element(own));
                let here = Vantage::new(self.scene, patch, x, n);
                let mut list = self.visible_from(&here, self.same_surface(&place, reach), None);
                list.truncate(NEIGHBOURS_OF_SLIVER);
                self.mean(own, &place, &list, Kernel::Wide(reach))
            })
            .or(near)
            .unwrap_or_else(|| self.flat(patch))
    }

    /// Light of the patch itself.
    pub fn flat(&self, patch: PatchId) -> Smooth {
        Smooth {
            irradiance: self.solution.irradiance(patch),
            lobe: self.solution.observed_lobe(patch).unwrap_or([Rgb::BLACK; 2]),
        }
    }

    /// Weighted mean over neighbours; `None` if none has a weight.
    fn mean(&self, own: u32, place: &Place, neighbours: &[Neighbour], kernel: Kernel) -> Option<Smooth> {
        let own = self.element(own);
        let material = self.scene.material(own.patch) as *const _;
        let mut sum = Smooth { irradiance: Rgb::BLACK, lobe: [Rgb::BLACK; 2] };
        let (mut total, mut lobe_total) = (0.0, 0.0);
        for &(other, part) in neighbours {
            let element = self.element(other);
            let Part { origin, share } = self.parts(other)[usize::from(part)];
            let split = self.split(other);
            let factor = split.factors[usize::from(part)];
            let radius = if let Kernel::Wide(reach) = kernel { reach } else { self.radius(element) };
            let offset = origin.point - place.x;
            let distance_squared = offset.length_squared();
            let closeness = 1.0 - distance_squared / (radius * radius);
            if closeness <= 0.0 {
                continue;
            }
            let rise = place.rise(offset, element.normal) / distance_squared.sqrt().max(1e-12);
            let plane = fade(SAME_PLANE - rise, 0.15);
            let turn = fade(place.n.dot(element.normal) - SAME_NORMAL, 0.5 * (1.0 - SAME_NORMAL));
            // A cell that is half covered says less, and says it with the error of its share; one in several parts may not say
            // which of them has its light.
            let doubt = if split.is_known { 1.0 } else { (share * factor).powi(2) };
            let trust = element.area * share * share * share * doubt;
            let weight = closeness * closeness * plane * turn * trust;
            sum.irradiance += element.irradiance * (weight * factor);
            total += weight;
            if own.lobe.is_some()
                && let Some(lobe) = element.lobe
                && std::ptr::eq(self.scene.material(element.patch), material)
            {
                sum.lobe[0] += lobe[0] * (weight * factor);
                sum.lobe[1] += lobe[1] * (weight * factor);
                lobe_total += weight;
            }
        }
        let lobe = if lobe_total > 0.0 { sum.lobe.map(|l| l / lobe_total) } else { own.lobe.unwrap_or_default() };
        (total > 0.0).then(|| Smooth { irradiance: sum.irradiance / total, lobe })
    }

    fn element(&self, element: u32) -> &Element {
        &self.surfaces.elements.list[element as usize]
    }

    /// Side of an element for the kernel: single huge triangles among small ones keep to themselves, or the search
    /// for their neighbours would cross the whole scene.
    fn size(&self, element: &Element) -> f64 {
        let typical = self.surfaces.elements.typical_size;
        element.area.sqrt().clamp(typical, 4.0 * typical)
    }

    /// Radius of an element's kernel.
    fn radius(&self, element: &Element) -> f64 {
        RADIUS * self.size(element)
    }

    /// Neighbours of each part of an element.
    fn neighbours(&self, own: u32) -> &[Box<[Neighbour]>] {
        self.surfaces.neighbours[own as usize].get_or_init(|| {
            let here = self.element(own);
            let reach = self.radius(here) + 1.2 * self.size(here);
            let mut near = self.same_surface(&self.place(here), reach);
            near.truncate(MOST_NEIGHBOURS);
            let of = |(k, part): (usize, &Part)| {
                self.visible_from(&part.origin, near.clone(), Some((own, k as u8))).into_boxed_slice()
            };
            self.parts(own).iter().enumerate().map(of).collect()
        })
    }

    /// The first part of each element that a point sees, those left out of which too little is free. `own` is the
    /// part that the point belongs to.
    fn visible_from(&self, from: &Vantage, elements: Vec<u32>, own: Option<Neighbour>) -> Vec<Neighbour> {
        let visible = |other: u32| {
            let parts = self.parts(other);
            let part = match own {
                Some((element, part)) if element == other => Some(usize::from(part)),
                _ => parts.iter().position(|p| p.share >= LEAST_SHARE && self.sees(from, &p.origin)),
            };
            part.filter(|&k| parts[k].share >= LEAST_SHARE).map(|k| (other, k as u8))
        };
        elements.into_iter().filter_map(visible).collect()
    }

    fn place(&self, element: &Element) -> Place {
        Place { x: element.centre, n: element.normal, facet: self.scene.normal(element.patch) }
    }

    /// Elements within `reach` of a point whose normals and places fit its surface, nearest first.
    fn same_surface(&self, place: &Place, reach: f64) -> Vec<u32> {
        let mut found: Vec<(f64, u32)> = self
            .surfaces
            .grid
            .near(place.x, reach)
            .filter_map(|k| {
                let other = self.element(k);
                let offset = other.centre - place.x;
                let distance = offset.length();
                let fits = distance <= reach
                    && place.n.dot(other.normal) > SAME_NORMAL - 0.1
                    && place.rise(offset, other.normal) <= 1.5 * SAME_PLANE * distance;
                fits.then_some((distance, k))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, k)| k).collect()
    }

    fn sees(&self, from: &Vantage, to: &Vantage) -> bool {
        from.sees(to, self.scene, LIFT * self.surfaces.elements.typical_size)
    }

    /// How the light of an element is divided: as that of whole neighbours which its parts see is, so that a cell that passes
    /// under a wall gives no light of the bright side to the dark one. The light of the element stays what it is.
    fn split(&self, element: u32) -> &Split {
        self.splits[element as usize].get_or_init(|| {
            let parts = self.parts(element);
            let reach = self.radius(self.element(element)) + 1.2 * self.size(self.element(element));
            let light = |(k, part): (usize, &Part)| -> Option<f64> {
                let (mut sum, mut total) = (0.0, 0.0);
                for &(other, _) in &self.neighbours(element)[k] {
                    let is_whole = matches!(self.parts(other), [Part { share: 1.0, .. }]);
                    if other == element || !is_whole {
                        continue;
                    }
                    let there = self.element(other);
                    let closeness = 1.0 - there.centre.distance_squared(part.origin.point) / (reach * reach);
                    let weight = there.area * closeness.max(0.0).powi(2);
                    sum += weight * there.irradiance.luminance().max(0.0);
                    total += weight;
                }
                (total > 0.0).then(|| sum / total)
            };
            let free: f64 = parts.iter().map(|p| p.share).sum();
            let found: Option<Vec<f64>> =
                if parts.len() > 1 { parts.iter().enumerate().map(light).collect() } else { None };
            let whole = |found: &[f64]| parts.iter().zip(found).map(|(p, l)| p.share * l).sum::<f64>();
            match found.map(|found| (whole(&found), found)) {
                Some((whole, found)) if whole > 0.0 => {
                    Split { factors: found.iter().map(|l| l / whole).collect(), is_known: true }
                }
                _ => Split { factors: parts.iter().map(|_| 1.0 / free).collect(), is_known: false },
            }
        })
    }

    /// The free parts of an element, judged by the patch that stands for it.
    fn parts(&self, element: u32) -> &[Part] {
        self.surfaces.parts[element as usize].get_or_init(|| {
            let here = self.element(element);
            let Element { patch, centre, normal, .. } = *here;
            let mut witnesses = self.same_surface(&self.place(here), RADIUS * self.surfaces.elements.typical_size);
            witnesses.retain(|&w| w != element);
            witnesses.truncate(8);
            let vantage = |p: DVec3| Vantage::new(self.scene, patch, p, normal);
            let middle = vantage(centre);
            let witness = |&&w: &&u32| {
                let there = self.element(w);
                self.sees(&middle, &Vantage::new(self.scene, there.patch, there.centre, there.normal))
            };
            let seen = witnesses.iter().filter(witness).count();
            // A corner may lie beyond a wall, and have much light while the rest has none.
            let corners = self.scene.cell_corners(patch).into_iter().map(|c| c.lerp(centre, INWARDS));
            let places: Vec<DVec3> = (0..COVER_TESTS).map(|k| self.spread_point(patch, k)).chain(corners).collect();
            let mut outer = places[1..=4].iter().chain(&places[COVER_TESTS as usize..]);
            let touching = TOUCHING * self.surfaces.elements.typical_size;
            let free = |p: DVec3| !self.scene.is_covered(patch, p, touching);
            if free(centre)
                && seen * 6 >= witnesses.len() * 5
                && outer.all(|&p| free(p) && self.sees(&middle, &vantage(p)))
            {
                return Box::new([Part { origin: middle, share: 1.0 }]);
            }
            // Something stands on the cell: gather its free points into parts that see each other.
            let mut points: Vec<Vantage> = places.iter().copied().filter(|&p| free(p)).map(vantage).collect();
            let mut parts = Vec::new();
            while let Some(&first) = points.first() {
                let (group, rest): (Vec<Vantage>, Vec<Vantage>) =
                    points.iter().partition(|p| p.point == first.point || self.sees(&first, p));
                let middle = group.iter().map(|p| p.point).sum::<DVec3>() / group.len() as f64;
                let from_middle = |p: &Vantage| p.point.distance_squared(middle);
                let origin = group.iter().copied().min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)));
                let share = group.len() as f64 / places.len() as f64;
                parts.push(Part { origin: origin.unwrap_or(first), share });
                points = rest;
            }
            parts.into_boxed_slice()
        })
    }

    fn spread_point(&self, patch: PatchId, k: u32) -> DVec3 {
        let place = |step: f64| (f64::from(k) * step + 0.5).fract();
        self.scene.cell_point(patch, place(0.754_877_666), place(0.569_840_29))
    }
}

/// 0 below zero, 1 above `width`, smooth between.
fn fade(x: f64, width: f64) -> f64 {
    let t = (x / width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
