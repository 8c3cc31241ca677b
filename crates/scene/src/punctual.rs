//! Lights without area in a scene: where they are, what they send where, and rays that leave them.
//!
//! What a ray carries is intensity over the density of its direction, in W (lm): its mean over rays is the light's power.
//! No ray can meet such a light, so there is nothing to weigh against. Directional lights send parallel rays through the
//! disc that `environment` has for skies. Not here: which light is chosen (solve, render), files (format).

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use crate::authored::{LightKind, LightProfile, PunctualLight};
use crate::environment::far_disc;
use crate::rgb::Rgb;
use crate::sample::table::SphereTable;
use crate::sample::warp;

/// A light without area, in the coordinates of its patch scene.
#[derive(Clone, Debug)]
pub struct PointLight {
    name: String,
    place: DVec3,
    /// Columns are the light's own axes in the world.
    axes: DMat3,
    intensity: Rgb,
    beam: Beam,
}

/// What intensity does with the direction.
#[derive(Clone, Debug)]
enum Beam {
    Even,
    Cone(Cone),
    Measured(Box<Measured>),
    /// Parallel rays through a disc of this radius, m.
    Parallel {
        radius: f64,
    },
}

/// Cosines of the two cones of a spot.
#[derive(Clone, Copy, Debug)]
struct Cone {
    inner: f64,
    outer: f64,
}

/// A profile with its sampler.
#[derive(Clone, Debug)]
struct Measured {
    profile: std::sync::Arc<LightProfile>,
    /// Rows from the nadir. `None` if there is no light.
    table: Option<SphereTable>,
    /// lm, for intensities of 1.
    flux: f64,
}

/// What a light gives to a point, if nothing is in between.
#[derive(Clone, Copy, Debug)]
pub struct Illumination {
    /// Unit, from the point to the light.
    pub towards: DVec3,
    /// Distance to the light, m; infinite for directional ones.
    pub distance: f64,
    /// Illuminance of what faces the light, lx (W·m⁻²).
    pub irradiance: Rgb,
}

/// Rows of a profile's table: half a degree.
const ROWS: usize = 360;
/// Its columns, unless there is symmetry around the axis.
const COLUMNS: usize = 180;
/// Points of a cell along a side whose brightest decides its density.
const POINTS: usize = 5;
/// Least density of a cell over the mean one: peaks between the points must not be missed.
const LEAST: f64 = 1e-3;
/// What peaks between the points may have over the brightest of them.
const OVER_BRIGHTEST: f64 = 2.0;

impl PointLight {
    /// The light, moved by −`centre`, in a scene of `radius` about it.
    pub(crate) fn new(light: &PunctualLight, centre: DVec3, radius: f64) -> Self {
        let beam = match (&light.profile, light.kind) {
            (Some(profile), _) => Beam::Measured(Box::new(Measured::new(profile.clone()))),
            (None, LightKind::Point) => Beam::Even,
            (None, LightKind::Spot { inner, outer }) => {
                Beam::Cone(Cone { inner: libm::cos(inner), outer: libm::cos(outer) })
            }
            (None, LightKind::Directional) => Beam::Parallel { radius },
        };
        Self {
            name: light.name.clone(),
            place: light.transform.translation - centre,
            axes: orthonormal(light.transform.matrix3),
            intensity: light.intensity,
            beam,
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// True of directional lights: rays come from far away, as from a sky, and most may miss the scene.
    pub fn is_distant(&self) -> bool {
        matches!(self.beam, Beam::Parallel { .. })
    }

    /// Where it is, in the coordinates of the scene; of directional lights without meaning.
    pub fn place(&self) -> DVec3 {
        self.place
    }

    /// Luminous intensity in a direction away from it (unit), cd (W·sr⁻¹); nothing of directional ones.
    pub fn intensity(&self, direction: DVec3) -> Rgb {
        let local = || self.axes.transpose() * direction;
        match &self.beam {
            Beam::Even => self.intensity,
            Beam::Cone(cone) => self.intensity * cone.falloff(-local().z),
            Beam::Measured(measured) => self.intensity * measured.profile.candela(local()),
            Beam::Parallel { .. } => Rgb::BLACK,
        }
    }

    /// Power, lm (W); of directional lights what comes through the disc around the scene.
    pub fn power(&self) -> Rgb {
        let factor = match &self.beam {
            Beam::Even => 4.0 * PI,
            Beam::Cone(cone) => cone.solid_angle(),
            Beam::Measured(measured) => measured.flux,
            Beam::Parallel { radius } => PI * radius * radius,
        };
        self.intensity * factor
    }

    /// Bound of the luminance that [`PointLight::carried`] gives.
    pub fn largest_carried(&self) -> f64 {
        match &self.beam {
            Beam::Measured(measured) => {
                let table = measured.table.as_ref().map_or(0.0, SphereTable::integral);
                OVER_BRIGHTEST * table * self.intensity.luminance()
            }
            _ => self.power().luminance(),
        }
    }

    /// Origin and direction of a ray that leaves the light, with density about proportional to its intensity.
    pub fn sample_ray(&self, u: [f64; 2], disc: [f64; 2]) -> (DVec3, DVec3) {
        let local = match &self.beam {
            Beam::Even => return (self.place, warp::uniform_sphere(u)),
            Beam::Cone(cone) => cone.sample(u),
            Beam::Measured(measured) => measured.sample(u),
            Beam::Parallel { radius } => {
                let towards = self.axes.z_axis;
                return (far_disc(towards, *radius, disc), -towards);
            }
        };
        (self.place, self.axes * local)
    }

    /// What a ray of [`PointLight::sample_ray`] in this direction carries, lm (W).
    pub fn carried(&self, direction: DVec3) -> Rgb {
        match &self.beam {
            Beam::Measured(measured) => {
                let local = self.axes.transpose() * direction;
                let pdf = measured.table.as_ref().map_or(0.0, |table| table.pdf(place_of(local)));
                if pdf > 0.0 { self.intensity * (measured.profile.candela(local) / pdf) } else { Rgb::BLACK }
            }
            // Directions are exactly proportional to intensity.
            _ => self.power(),
        }
    }

    /// Everything that decides its light, for fingerprints.
    pub(crate) fn words(&self) -> impl Iterator<Item = u64> {
        let (kind, details) = match &self.beam {
            Beam::Even => (1, Vec::new()),
            Beam::Cone(cone) => (2, vec![cone.inner, cone.outer]),
            Beam::Parallel { .. } => (3, Vec::new()),
            Beam::Measured(measured) => {
                let LightProfile { vertical, horizontal, candela, .. } = &*measured.profile;
                let all = vertical.iter().chain(horizontal).chain(candela).map(|&x| f64::from(x));
                (4, [vertical.len() as f64, horizontal.len() as f64].into_iter().chain(all).collect())
            }
        };
        let numbers =
            self.place.to_array().into_iter().chain(self.axes.to_cols_array()).chain(self.intensity.to_array());
        [0x11_6874, kind].into_iter().chain(numbers.chain(details).map(f64::to_bits))
    }

    /// What it gives to a point, if nothing is in between; `None` at the light itself.
    pub fn illuminate(&self, point: DVec3) -> Option<Illumination> {
        if self.is_distant() {
            let irradiance = self.intensity;
            return Some(Illumination { towards: self.axes.z_axis, distance: f64::INFINITY, irradiance });
        }
        let between = self.place - point;
        let square = between.length_squared();
        let towards = between.try_normalize()?;
        let irradiance = self.intensity(-towards) / square;
        irradiance.is_finite().then_some(Illumination { towards, distance: square.sqrt(), irradiance })
    }
}

/// The rotation of a node's matrix, without scale; mirrored axes stay mirrored. What is flat gets any axes.
fn orthonormal(m: DMat3) -> DMat3 {
    let Some(z) = m.z_axis.try_normalize() else { return DMat3::IDENTITY };
    let Some(x) = (m.x_axis - z * z.dot(m.x_axis)).try_normalize() else {
        let frame = crate::geom::Frame::from_normal(z);
        return DMat3::from_cols(frame.x, frame.y, z);
    };
    let y = z.cross(x);
    DMat3::from_cols(x, if y.dot(m.y_axis) < 0.0 { -y } else { y }, z)
}

impl Cone {
    /// Share of the intensity at a cosine from the axis: the square of a ramp between the cones, as `KHR_lights_punctual`
    /// recommends.
    #[inline]
    fn falloff(self, cosine: f64) -> f64 {
        let ramp = ((cosine - self.outer) / (self.inner - self.outer)).clamp(0.0, 1.0);
        if cosine >= self.inner { 1.0 } else { ramp * ramp }
    }

    /// ∫ falloff dω = 2π [(1 − cᵢ) + (cᵢ − cₒ)/3].
    fn solid_angle(self) -> f64 {
        TAU * ((1.0 - self.inner) + (self.inner - self.outer) / 3.0)
    }

    /// A direction about −Z, with density ∝ falloff.
    fn sample(self, u: [f64; 2]) -> DVec3 {
        let full = TAU * (1.0 - self.inner) / self.solid_angle();
        let cosine = if u[0] < full {
            1.0 - u[0] / full * (1.0 - self.inner)
        } else {
            // The integral of the ramp's square is its cube; 1 − u keeps 0 out of it.
            let rest = ((1.0 - u[0]) / (1.0 - full)).clamp(0.0, 1.0);
            self.outer + libm::cbrt(rest) * (self.inner - self.outer)
        };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = libm::sincos(TAU * u[1]);
        DVec3::new(sine * cos, sine * sin, -cosine)
    }
}

impl Measured {
    fn new(profile: std::sync::Arc<LightProfile>) -> Self {
        let columns = if profile.horizontal.len() == 1 { 1 } else { COLUMNS };
        let flux = profile.flux();
        let [first, last] =
            [profile.vertical.first(), profile.vertical.last()].map(|v| v.map_or(0.0, |&v| f64::from(v)));
        let step = 180.0 / ROWS as f64;
        let weight = |row: usize, column: usize| {
            let at = |k: usize, n: usize, size: f64| (n as f64 + k as f64 / (POINTS - 1) as f64) * size;
            let value =
                |k: usize| profile.at(at(k / POINTS, row, step), at(k % POINTS, column, 360.0 / columns as f64));
            let brightest = (0..POINTS * POINTS).map(value).fold(0.0, f64::max);
            let lit = at(POINTS - 1, row, step) >= first && at(0, row, step) <= last;
            if lit { brightest.max(LEAST * flux / (4.0 * PI)) } else { 0.0 }
        };
        let table = if flux > 0.0 { SphereTable::new(ROWS, columns, weight) } else { None };
        Self { profile, table, flux }
    }

    fn sample(&self, u: [f64; 2]) -> DVec3 {
        let Some(table) = &self.table else { return warp::uniform_sphere(u) };
        let [cosine, turn] = table.sample(u);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = libm::sincos(TAU * turn);
        DVec3::new(sine * cos, sine * sin, -cosine)
    }
}

/// A local direction's place in a profile's table: cosine from the nadir, turns from +X towards +Y.
fn place_of(local: DVec3) -> [f64; 2] {
    let turn = libm::atan2(local.y, local.x) / TAU;
    let turn = if turn < 0.0 { turn + 1.0 } else { turn };
    [(-local.z).clamp(-1.0, 1.0), if turn < 1.0 { turn } else { 0.0 }]
}

impl LightProfile {
    /// Intensity in a direction of the light's own axes (unit), cd.
    pub fn candela(&self, local: DVec3) -> f64 {
        let [cosine, turn] = place_of(local);
        self.at(libm::acos(cosine).to_degrees(), 360.0 * turn)
    }

    /// Intensity at γ and C, degrees: linear in both between the measured ones; none beyond the first and the last γ.
    pub fn at(&self, gamma: f64, c: f64) -> f64 {
        let vertical = &self.vertical;
        let [Some(&first), Some(&last)] = [vertical.first(), vertical.last()] else { return 0.0 };
        // Rounding of an angle computed from a direction must not lose the edge of a file that ends at 90°.
        let slack = 1e-6;
        if gamma < f64::from(first) - slack || gamma > f64::from(last) + slack {
            return 0.0;
        }
        let (row, down) = between(vertical, gamma);
        let (column, across) = between(&self.horizontal, c);
        let value = |j: usize, i: usize| {
            let [j, i] = [j.min(self.horizontal.len() - 1), i.min(vertical.len() - 1)];
            f64::from(self.candela[j * vertical.len() + i])
        };
        let plane = |j| value(j, row) * (1.0 - down) + value(j, row + 1) * down;
        plane(column) * (1.0 - across) + plane(column + 1) * across
    }

    /// Flux, lm: ∫ I dω, exact for intensity that is linear in γ and in C between the measured ones.
    pub fn flux(&self) -> f64 {
        let count = self.vertical.len();
        let plane = |j: usize| {
            let candela = &self.candela[j * count..][..count];
            let segment = |i: usize| {
                let [from, to] = [i, i + 1].map(|k| f64::from(self.vertical[k]).to_radians());
                let [a, b] = [i, i + 1].map(|k| f64::from(candela[k]));
                if to <= from {
                    return 0.0;
                }
                // ∫ (a + s(γ − from)) sin γ dγ = [−I cos γ] + s [sin γ].
                let slope = (b - a) / (to - from);
                a * libm::cos(from) - b * libm::cos(to) + slope * (libm::sin(to) - libm::sin(from))
            };
            (0..count.saturating_sub(1)).map(segment).sum::<f64>()
        };
        match self.horizontal.len() {
            0 => 0.0,
            1 => TAU * plane(0),
            n => {
                let width = |j: usize| f64::from(self.horizontal[j + 1] - self.horizontal[j]).to_radians();
                (0..n - 1).map(|j| 0.5 * (plane(j) + plane(j + 1)) * width(j)).sum()
            }
        }
    }
}

/// The last of ascending numbers that is not above `x`, and how far `x` is on the way to the next one.
fn between(numbers: &[f32], x: f64) -> (usize, f64) {
    let index = numbers.partition_point(|&n| f64::from(n) <= x).max(1) - 1;
    match numbers.get(index + 1) {
        Some(&next) => {
            let from = f64::from(numbers[index]);
            (index, ((x - from) / (f64::from(next) - from)).clamp(0.0, 1.0))
        }
        None => (index, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DQuat};
    use twinray_testkit::chi2;

    use super::*;
    use crate::sample::Stream;

    /// Brighter downwards, with a dark quarter, and nothing above 120°.
    fn profile() -> LightProfile {
        let vertical = vec![0.0, 30.0, 60.0, 90.0, 120.0];
        let horizontal = vec![0.0, 90.0, 180.0, 270.0, 360.0];
        let plane = |k: usize| [100.0, 90.0, [60.0, 10.0, 40.0, 0.0, 60.0][k], [30.0, 0.0, 5.0, 0.0, 30.0][k], 5.0];
        LightProfile { name: "test".into(), vertical, horizontal, candela: (0..5).flat_map(plane).collect() }
    }

    fn light(kind: LightKind, profile: Option<LightProfile>) -> PointLight {
        let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        // Scale must mean nothing.
        let transform =
            DAffine3::from_scale_rotation_translation(DVec3::new(3.0, 0.5, 2.0), rotation, DVec3::new(1.0, 2.0, 3.0));
        let intensity = Rgb::new(1.0, 2.0, 3.0);
        let authored = PunctualLight { name: "l".into(), kind, intensity, transform, profile: profile.map(Arc::new) };
        PointLight::new(&authored, DVec3::new(1.0, 0.0, 0.0), 4.0)
    }

    /// Directions against intensity/carried, which is their density; 3 tests, each with a false-alarm rate of 1 %. And the mean of
    /// what rays carry against the power: five standard errors.
    #[test]
    fn rays_follow_their_density_and_carry_the_power() {
        let spot = LightKind::Spot { inner: 0.5, outer: 1.1 };
        for (name, light) in [
            ("point", light(LightKind::Point, None)),
            ("spot", light(spot, None)),
            ("profile", light(LightKind::Point, Some(profile()))),
        ] {
            let mut stream = Stream::new(41, 0, 0);
            let (mut sum, mut squares, mut most) = (0.0, 0.0, 0.0f64);
            const N: u32 = 400_000;
            let samples = (0..N).map(|_| {
                let mut pair = || [stream.uniform(), stream.uniform()];
                let (origin, direction) = light.sample_ray(pair(), pair());
                assert_eq!(origin, DVec3::new(0.0, 2.0, 3.0));
                assert!((direction.length() - 1.0).abs() < 1e-12);
                let carried = light.carried(direction).luminance();
                (sum, squares, most) = (sum + carried, squares + carried * carried, most.max(carried));
                Some(direction.to_array())
            });
            let density = |d: [f64; 3]| {
                let d = DVec3::from_array(d);
                let intensity = light.intensity(d).luminance();
                match &light.beam {
                    Beam::Measured(measured) => {
                        measured.table.as_ref().unwrap().pdf(place_of(light.axes.transpose() * d))
                    }
                    _ => intensity / light.power().luminance(),
                }
            };
            let outcome = chi2::sphere(samples, density, 20, 40);
            println!("{name}: {outcome:?}");
            assert!(outcome.p_value > 0.01, "{name}: {outcome:?}");
            let (n, power) = (f64::from(N), light.power().luminance());
            let error = ((squares / n - (sum / n).powi(2)).max(0.0) / n).sqrt();
            assert!((sum / n - power).abs() < 5.0 * error + 1e-9 * power, "{name}: {} ± {error}, not {power}", sum / n);
            assert!(most <= light.largest_carried() * (1.0 + 1e-12), "{name}: {most}");
            // Well sampled: the variance is far below that of even directions.
            assert!(error * n.sqrt() < 0.6 * power, "{name}: {error}");
        }
    }

    /// 2π I [(1 − cos i) + (cos i − cos o)/3] against a quadrature of the falloff.
    #[test]
    fn the_flux_of_a_spot_is_its_integral() {
        let spot = light(LightKind::Spot { inner: 0.3, outer: 0.9 }, None);
        let axis = spot.axes.z_axis * -1.0;
        let side = spot.axes.x_axis;
        let steps = 100_000;
        let ring = |k: u32| {
            let angle = (f64::from(k) + 0.5) / f64::from(steps) * PI;
            spot.intensity(axis * angle.cos() + side * angle.sin()).g * angle.sin() * TAU
        };
        let sum = (0..steps).map(ring).sum::<f64>() * PI / f64::from(steps);
        assert!((sum / spot.power().g - 1.0).abs() < 1e-6, "{sum} {:?}", spot.power());
        assert_eq!(spot.intensity(axis), Rgb::new(1.0, 2.0, 3.0));
        assert_eq!(spot.intensity(side), Rgb::BLACK);
    }

    /// 1000 cd at a height of 3 m, 2 m aside (reference: 64.0039 lx), and a lamp of 800 lm: 63.662 cd.
    #[test]
    fn illuminance_falls_with_the_square_of_the_distance() {
        let authored = PunctualLight {
            name: String::new(),
            kind: LightKind::Point,
            intensity: Rgb::grey(1000.0),
            transform: DAffine3::from_translation(DVec3::new(0.0, 3.0, 0.0)),
            profile: None,
        };
        let light = PointLight::new(&authored, DVec3::ZERO, 1.0);
        let given = light.illuminate(DVec3::new(2.0, 0.0, 0.0)).unwrap();
        assert!((given.irradiance.g * given.towards.y - 64.0039).abs() < 1e-4);
        assert!((given.distance - 13f64.sqrt()).abs() < 1e-12);
        assert!((light.power().g / 800.0 * 63.6620 / 1000.0 - 1.0).abs() < 1e-6);
        assert!(light.illuminate(DVec3::new(0.0, 3.0, 0.0)).is_none());
    }

    #[test]
    fn parallel_rays_come_through_the_disc() {
        let sun = light(LightKind::Directional, None);
        let given = sun.illuminate(DVec3::ZERO).unwrap();
        let (origin, direction) = sun.sample_ray([0.1, 0.2], [0.3, 0.4]);
        assert!((direction + given.towards).length() < 1e-12 && origin.dot(given.towards) > 4.0);
        assert_eq!((given.irradiance, given.distance), (Rgb::new(1.0, 2.0, 3.0), f64::INFINITY));
        assert_eq!(sun.carried(direction), Rgb::new(1.0, 2.0, 3.0) * (16.0 * PI));
    }

    #[test]
    fn profiles_are_linear_between_angles() {
        let p = profile();
        assert_eq!(p.at(0.0, 77.0), 100.0);
        assert_eq!(p.at(60.0, 90.0), 10.0);
        assert_eq!(p.at(60.0, 45.0), 35.0);
        assert_eq!(p.at(75.0, 45.0), 25.0);
        assert_eq!(p.at(60.0, 315.0), 30.0);
        assert_eq!((p.at(121.0, 0.0), p.at(120.0, 0.0)), (0.0, 5.0));
        // Down is −Z, C turns from +X to +Y.
        assert!((p.candela(DVec3::NEG_Z) - 100.0).abs() < 1e-9);
        assert!((p.candela(DVec3::X) - 30.0).abs() < 1e-6);
        assert!((p.candela(DVec3::Y) - 0.0).abs() < 1e-6);
        // An even profile gives 4π.
        let even = LightProfile {
            name: String::new(),
            vertical: vec![0.0, 60.0, 180.0],
            horizontal: vec![0.0],
            candela: vec![1.0; 3],
        };
        assert!((even.flux() - 4.0 * PI).abs() < 1e-9);
    }
}
