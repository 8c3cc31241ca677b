//! Skies of formulas: the CIE's and Preetham's, in nit.
//!
//! Radiance is the formula itself; directions come from a table of it. The sun is not in it (`super::Sun`), but for the
//! ground that both illuminate.

use std::f64::consts::PI;

use glam::DVec3;

use super::{direction_of, place_of, solar};
use crate::authored::{Sky, SkyLevel, SkyModel};
use crate::rgb::Rgb;
use crate::sample::table::{SphereTable, cell_solid_angle};

/// Rows and columns of the table: cells of 1.4°. Half of the rows are above the horizon.
const ROWS: usize = 128;
const COLUMNS: usize = 256;
/// A cell's density follows the brightest of nine of its points; what lies between them is hardly brighter.
const OVER_BRIGHTEST: f64 = 1.5;

impl Sky {
    /// A sky as it usually is with the sun at these angles (degrees, azimuth clockwise from north); `None` of the sun's place for
    /// a uniform or an overcast sky of 10 000 lx. Ground of albedo 0.2.
    ///
    /// Illuminances are those of IES RP-21-1984: cloudy 300 + 21 000 sin h, clear 800 + 15 500 √sin h. Preetham's model has
    /// a scale of its own.
    pub fn natural(model: SkyModel, sun: Option<[f64; 2]>) -> Self {
        let [elevation, azimuth] = sun.unwrap_or([90.0, 180.0]);
        let sine = libm::sin(elevation.to_radians()).max(0.0);
        let cloudy = if sun.is_some() { 300.0 + 21_000.0 * sine } else { 10_000.0 };
        let (level, sun) = match model {
            SkyModel::Uniform | SkyModel::Overcast => (SkyLevel::Horizontal(cloudy), None),
            SkyModel::Clear => {
                let level = SkyLevel::Horizontal(800.0 + 15_500.0 * sine.sqrt());
                (level, Some(solar::through_clear_air(elevation)))
            }
            SkyModel::Preetham { turbidity } => {
                let level = SkyLevel::Zenith(preetham_zenith(turbidity, (90.0 - elevation).to_radians())[0]);
                (level, Some(solar::through_haze(elevation, turbidity)))
            }
        };
        Self { model, towards_sun: solar::towards(elevation, azimuth), level, sun, ground: Rgb::grey(0.2) }
    }
}

#[derive(Clone, Debug)]
pub(super) struct SkyLight {
    formula: Formula,
    towards_sun: DVec3,
    /// Factor to the formula.
    scale: f64,
    /// Radiance of the ground.
    ground: Rgb,
    /// `None` if all of it is black.
    table: Option<SphereTable>,
    integral: Rgb,
}

/// A distribution, with what is computed once.
#[derive(Clone, Debug)]
enum Formula {
    Uniform,
    Overcast,
    Clear,
    Preetham(Box<Preetham>),
}

impl SkyLight {
    pub(super) fn new(sky: &Sky) -> Self {
        let formula = match sky.model {
            SkyModel::Uniform => Formula::Uniform,
            SkyModel::Overcast => Formula::Overcast,
            SkyModel::Clear => Formula::Clear,
            SkyModel::Preetham { turbidity } => Formula::Preetham(Box::new(Preetham::new(turbidity, sky.towards_sun))),
        };
        let mut this = Self {
            formula,
            towards_sun: sky.towards_sun,
            scale: 1.0,
            ground: Rgb::BLACK,
            table: None,
            integral: Rgb::BLACK,
        };
        let [zenith, horizontal] = [this.radiance(DVec3::Y).luminance(), this.horizontal().luminance()];
        this.scale = match sky.level {
            SkyLevel::Zenith(luminance) => luminance / zenith,
            SkyLevel::Horizontal(illuminance) => illuminance / horizontal,
        };
        let sunlight = sky.sun.unwrap_or(Rgb::BLACK) * sky.towards_sun.y.max(0.0);
        this.ground = sky.ground * (this.horizontal() + sunlight) / PI;
        this.table = SphereTable::new(ROWS, COLUMNS, |row, column| this.brightest(row, column));
        this.integral = this.sum(|_| 1.0) + this.ground * (2.0 * PI);
        this
    }

    #[inline]
    pub(super) fn radiance(&self, towards: DVec3) -> Rgb {
        if towards.y <= 0.0 {
            return self.ground;
        }
        let cosine = towards.y.min(1.0);
        let value = match &self.formula {
            Formula::Uniform => Rgb::WHITE,
            Formula::Overcast => Rgb::grey((1.0 + 2.0 * cosine) / 3.0),
            Formula::Clear => Rgb::grey(clear(cosine, towards.dot(self.towards_sun))),
            Formula::Preetham(preetham) => preetham.radiance(cosine, towards.dot(self.towards_sun)),
        };
        value * self.scale
    }

    /// ∫ L dω.
    pub(super) fn integral(&self) -> Rgb {
        self.integral
    }

    /// Bound of 𝓛(radiance)/pdf.
    pub(super) fn largest_estimate(&self) -> f64 {
        self.table.as_ref().map_or(0.0, |table| OVER_BRIGHTEST * table.integral())
    }

    #[inline]
    pub(super) fn pdf(&self, towards: DVec3) -> f64 {
        match &self.table {
            Some(table) => table.pdf(place_of(towards)),
            None => 1.0 / (4.0 * PI),
        }
    }

    #[inline]
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        match &self.table {
            Some(table) => direction_of(table.sample(u)),
            None => crate::sample::warp::uniform_sphere(u),
        }
    }

    /// Largest luminance of nine points of a cell.
    fn brightest(&self, row: usize, column: usize) -> f64 {
        let at = |i: usize, j: usize| {
            // A hair within, so that the horizon belongs to the sky above and to the ground below.
            let [down, across] = [i, j].map(|k| [0.001, 0.5, 0.999][k]);
            let angle = (row as f64 + down) * PI / ROWS as f64;
            self.radiance(direction_of([libm::cos(angle), (column as f64 + across) / COLUMNS as f64])).luminance()
        };
        (0..9).map(|k| at(k / 3, k % 3)).fold(0.0, f64::max)
    }

    /// Illuminance of level ground.
    fn horizontal(&self) -> Rgb {
        self.sum(|cosine| cosine)
    }

    /// ∫ L · weight(cosθ) dω above the horizon, by cells of half the table's size: good to 1e-4 of smooth skies.
    fn sum(&self, weight: impl Fn(f64) -> f64) -> Rgb {
        let (rows, columns) = (2 * ROWS, 2 * COLUMNS);
        let row = |row: usize| {
            // The mean cosine of a row is the middle of its edges.
            let [from, to] = [row, row + 1].map(|r| libm::cos(PI * r as f64 / rows as f64));
            let cosine = 0.5 * (from + to);
            let ring = |column: usize| self.radiance(direction_of([cosine, (column as f64 + 0.5) / columns as f64]));
            (0..columns).map(ring).sum::<Rgb>() * (weight(cosine) * cell_solid_angle(row, rows, columns))
        };
        (0..ROWS).map(row).sum()
    }
}

/// CIE standard clear sky, luminance over that of the zenith: CIE S 003/E-1996 (ISO 15469), after R. Kittler 1967. `cosine` is that
/// of the angle from the zenith, `to_sun` that of the angle from the sun; the factor that only depends on the sun is left out.
#[inline]
fn clear(cosine: f64, to_sun: f64) -> f64 {
    let to_sun = to_sun.clamp(-1.0, 1.0);
    let scattered = 0.91 + 10.0 * libm::exp(-3.0 * libm::acos(to_sun)) + 0.45 * to_sun * to_sun;
    scattered * -libm::expm1(-0.32 / cosine)
}

/// A. J. Preetham, P. Shirley, B. Smits, "A practical analytic model for daylight", SIGGRAPH 1999, appendix A.2: R. Perez'
/// five-parameter distribution for luminance (cd/m²) and for the chromaticities x and y.
#[derive(Clone, Debug)]
struct Preetham {
    /// Coefficients A to E of Y, x, y.
    perez: [[f64; 5]; 3],
    /// Value at the zenith over that of the distribution there.
    scale: [f64; 3],
}

impl Preetham {
    fn new(turbidity: f64, towards_sun: DVec3) -> Self {
        let t = turbidity;
        let perez = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let cosine = towards_sun.y.clamp(0.0, 1.0);
        let zenith = preetham_zenith(turbidity, libm::acos(cosine));
        let scale = std::array::from_fn(|k| zenith[k] / distribution(&perez[k], 1.0, cosine));
        Self { perez, scale }
    }

    #[inline]
    fn radiance(&self, cosine: f64, to_sun: f64) -> Rgb {
        let [luminance, x, y] =
            std::array::from_fn(|k| self.scale[k] * distribution(&self.perez[k], cosine, to_sun.clamp(-1.0, 1.0)));
        // CIE xyY to linear Rec. 709 (IEC 61966-2-1); blues beyond its gamut are cut off, and luminance is kept.
        let (x, z) = (x / y, (1.0 - x - y) / y);
        let rgb = Rgb::new(
            3.240_6 * x - 1.537_2 - 0.498_6 * z,
            -0.968_9 * x + 1.875_8 + 0.041_5 * z,
            0.055_7 * x - 0.204 + 1.057 * z,
        )
        .map(|c| c.max(0.0));
        rgb * (luminance.max(0.0) / rgb.luminance().max(f64::MIN_POSITIVE))
    }
}

/// F(θ, γ) from the cosines of the angles from the zenith and from the sun.
#[inline]
fn distribution(&[a, b, c, d, e]: &[f64; 5], cosine: f64, to_sun: f64) -> f64 {
    (1.0 + a * libm::exp(b / cosine)) * (1.0 + c * libm::exp(d * libm::acos(to_sun)) + e * to_sun * to_sun)
}

/// Luminance of the zenith, cd/m², and its chromaticity, for a turbidity and the sun's angle from the zenith.
fn preetham_zenith(turbidity: f64, sun: f64) -> [f64; 3] {
    let (t, s) = (turbidity, sun);
    let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * s);
    let luminance = (4.0453 * t - 4.9710) * libm::tan(chi) - 0.2155 * t + 2.4192;
    let cubic = |[c3, c2, c1, c0]: [f64; 4]| ((c3 * s + c2) * s + c1) * s + c0;
    let quadratic = |rows: [[f64; 4]; 3]| (cubic(rows[0]) * t + cubic(rows[1])) * t + cubic(rows[2]);
    let x = quadratic([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = quadratic([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    [1000.0 * luminance.max(0.0), x, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(model: SkyModel, level: SkyLevel, ground: f64) -> SkyLight {
        let towards_sun = solar::towards(40.0, 130.0);
        SkyLight::new(&Sky { model, towards_sun, level, sun: None, ground: Rgb::grey(ground) })
    }

    /// Horizontal illuminance: π Lz under a uniform sky, (7/9)π Lz under an overcast one; the quadrature is good to 1e-4.
    #[test]
    fn illuminances_are_those_of_closed_forms() {
        for (model, expected) in [(SkyModel::Uniform, PI), (SkyModel::Overcast, 7.0 / 9.0 * PI)] {
            let sky = light(model, SkyLevel::Zenith(1000.0), 0.0);
            let found = sky.horizontal().luminance() / 1000.0;
            assert!((found / expected - 1.0).abs() < 1e-4, "{model:?}: {found}");
            let sky = light(model, SkyLevel::Horizontal(5000.0), 0.2);
            assert!((sky.radiance(DVec3::Y).luminance() * expected / 5000.0 - 1.0).abs() < 1e-4);
            // The ground sends 0.2 of it back.
            assert!((sky.radiance(DVec3::NEG_Y).luminance() * PI / 1000.0 - 1.0).abs() < 1e-12);
        }
        let clear = light(SkyModel::Clear, SkyLevel::Horizontal(12_000.0), 0.0);
        assert!((clear.horizontal().luminance() / 12_000.0 - 1.0).abs() < 1e-9);
    }

    /// The clear sky's formula at the zenith and at 45°, the sun 50° from the zenith and opposite to the latter.
    #[test]
    fn the_clear_sky_is_the_standards() {
        let (sun, sky) = (solar::towards(40.0, 0.0), Sky::natural(SkyModel::Clear, Some([40.0, 0.0])));
        let light = SkyLight::new(&Sky { level: SkyLevel::Zenith(1.0), ..sky });
        let f = |angle: f64| 0.91 + 10.0 * (-3.0 * angle).exp() + 0.45 * angle.cos().powi(2);
        let expected = f(95f64.to_radians()) * (1.0 - (-0.32 / 45f64.to_radians().cos()).exp())
            / (f(50f64.to_radians()) * (1.0 - (-0.32f64).exp()));
        let found = light.radiance(solar::towards(45.0, 180.0)).luminance();
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        assert!(light.radiance(sun).luminance() > 3.0);
    }

    /// Preetham's sky: a zenith of some thousand nit, bluer than white; brighter near the sun than opposite to it, and whiter
    /// near the horizon; hazier skies are whiter.
    #[test]
    fn preethams_sky_looks_like_one() {
        let sky = |turbidity| SkyLight::new(&Sky::natural(SkyModel::Preetham { turbidity }, Some([45.0, 90.0])));
        let (clear, hazy) = (sky(2.5), sky(8.0));
        let zenith = clear.radiance(DVec3::Y);
        assert!((1000.0..10_000.0).contains(&zenith.luminance()) && zenith.b > 1.5 * zenith.r, "{zenith:?}");
        let [near, opposite] = [90.0, 270.0].map(|azimuth| clear.radiance(solar::towards(30.0, azimuth)).luminance());
        assert!(near > 2.0 * opposite);
        let blueness = |c: Rgb| c.b / c.r;
        assert!(blueness(clear.radiance(solar::towards(3.0, 0.0))) < blueness(zenith));
        assert!(blueness(hazy.radiance(DVec3::Y)) < blueness(zenith));
        // Yz of the paper's formula, in kcd/m²: χ = (4/9 − 2.5/120)(π − π/2).
        let chi = (4.0 / 9.0 - 2.5 / 120.0) * 0.5 * PI;
        let expected = (4.0453 * 2.5 - 4.9710) * chi.tan() - 0.2155 * 2.5 + 2.4192;
        assert!((zenith.luminance() / (1000.0 * expected) - 1.0).abs() < 1e-9);
    }
}
