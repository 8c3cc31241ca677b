//! The sun: where it stands, how large it is, and what the air leaves of it.
//!
//! Azimuths are clockwise from north as a compass has them; north is −Z, east +X, up +Y.

use std::f64::consts::PI;

use glam::DVec3;

use crate::rgb::Rgb;

/// Cosine of half the sun's angle of 0.533°, its mean over the year.
pub(crate) const DISC_COSINE: f64 = 0.999_989_182_712_231_1;
/// Solid angle of the disc, 2π(1 − cos), sr.
pub(crate) const DISC_SOLID_ANGLE: f64 = 2.0 * PI * (1.0 - DISC_COSINE);

/// Illuminance beyond the air across the sun's rays, lx (IES RP-21-1984).
const SOLAR_ILLUMINANCE: f64 = 127_500.0;
/// Colour of a black body of 5778 K (x = 0.3263, y = 0.3354) at luminance 1.
const SOLAR_COLOUR: Rgb = Rgb::new(1.1126, 0.9751, 0.9163);

/// Unit vector towards a sun at these angles, degrees.
pub fn towards(elevation: f64, azimuth: f64) -> DVec3 {
    let (up, level) = libm::sincos(elevation.to_radians());
    let (east, north) = libm::sincos(azimuth.to_radians());
    DVec3::new(level * east, up, -level * north)
}

/// A moment of the Gregorian calendar, in universal time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Year.
    pub year: i32,
    /// Month, from 1.
    pub month: u32,
    /// Day of the month, from 1.
    pub day: u32,
    /// Hours of universal time since midnight; may be negative or beyond 24.
    pub hours: f64,
}

impl Moment {
    /// Days since noon of 1 January 2000.
    fn days(&self) -> f64 {
        // Days of the civil calendar with the year beginning in March, so that the odd day comes last.
        let (year, month) = if self.month > 2 { (self.year, self.month - 3) } else { (self.year - 1, self.month + 9) };
        let leap = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
        let days = 365 * i64::from(year) + i64::from(leap) + i64::from((153 * month + 2) / 5 + self.day);
        // The first of January 2000 is number 730 426 of this count.
        (days - 730_426) as f64 - 0.5 + self.hours / 24.0
    }
}

/// Elevation and azimuth of the sun's centre, degrees, without refraction, at a latitude and an eastern longitude, degrees.
///
/// The Astronomical Almanac's approximation, good to 0.01° from 1950 to 2050: J. J. Michalsky, "The Astronomical Almanac's
/// algorithm for approximate solar position (1950–2050)", Solar Energy 40(3), 1988.
pub fn position(moment: Moment, latitude: f64, longitude: f64) -> [f64; 2] {
    let n = moment.days();
    let mean_longitude = 280.460 + 0.985_647_4 * n;
    let anomaly = (357.528 + 0.985_600_3 * n).to_radians();
    let ecliptic = (mean_longitude + 1.915 * libm::sin(anomaly) + 0.020 * libm::sin(2.0 * anomaly)).to_radians();
    let obliquity = (23.439 - 4e-7 * n).to_radians();
    let (sin_ecliptic, cos_ecliptic) = libm::sincos(ecliptic);
    let ascension = libm::atan2(libm::cos(obliquity) * sin_ecliptic, cos_ecliptic);
    let sin_declination = libm::sin(obliquity) * sin_ecliptic;
    let cos_declination = (1.0 - sin_declination * sin_declination).max(0.0).sqrt();
    let universal = (n + 0.5).rem_euclid(1.0) * 24.0;
    // Sidereal time of the day's beginning, and of the hours since.
    let sidereal = 6.697_375 + 0.065_709_824_2 * n + universal;
    let hour_angle = (15.0 * sidereal + longitude).rem_euclid(360.0).to_radians() - ascension;
    let (sin_latitude, cos_latitude) = libm::sincos(latitude.to_radians());
    let (sin_hour, cos_hour) = libm::sincos(hour_angle);
    let up = sin_declination * sin_latitude + cos_declination * cos_latitude * cos_hour;
    let east = -cos_declination * sin_hour;
    let north = sin_declination * cos_latitude - cos_declination * sin_latitude * cos_hour;
    let azimuth = libm::atan2(east, north).to_degrees().rem_euclid(360.0);
    [libm::asin(up.clamp(-1.0, 1.0)).to_degrees(), azimuth]
}

/// Illuminance of what faces the sun through clear air, lx: 127 500 · exp(−0.21/sin h), IES RP-21-1984, in the colour of
/// [`through_haze`] at turbidity 2.5.
pub fn through_clear_air(elevation: f64) -> Rgb {
    let sine = libm::sin(elevation.to_radians());
    if sine <= 0.0 {
        return Rgb::BLACK;
    }
    let colour = through_haze(elevation, 2.5);
    colour * (SOLAR_ILLUMINANCE * libm::exp(-0.21 / sine) / colour.luminance().max(f64::MIN_POSITIVE))
}

/// Illuminance of what faces the sun through air of a turbidity, lx: extinction by molecules, aerosols and ozone at the
/// wavelengths for which the channels stand. Formulas of A. J. Preetham, P. Shirley, B. Smits, "A practical analytic model for
/// daylight", SIGGRAPH 1999, appendix A.1, after M. Iqbal, "An introduction to solar radiation", 1983.
pub fn through_haze(elevation: f64, turbidity: f64) -> Rgb {
    if elevation <= 0.0 {
        return Rgb::BLACK;
    }
    let zenith = 90.0 - elevation;
    let mass = 1.0 / (libm::cos(zenith.to_radians()) + 0.15 * libm::pow(93.885 - zenith, -1.253));
    let aerosols = 0.046_083_65 * turbidity - 0.045_860_26;
    // µm, and the attenuation by ozone per cm, of which there are 0.35.
    let [red, green, blue] = [(0.610, 0.12), (0.550, 0.085), (0.465, 0.008)].map(|(wavelength, ozone)| {
        let molecules = 0.008_735 * libm::pow(wavelength, -4.08);
        let haze = aerosols * libm::pow(wavelength, -1.3);
        libm::exp(-mass * (molecules + haze + 0.35 * ozone))
    });
    Rgb::new(red, green, blue) * SOLAR_COLOUR * SOLAR_ILLUMINANCE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_has_the_suns_size() {
        assert!((libm::acos(DISC_COSINE).to_degrees() - 0.2665).abs() < 1e-9);
        assert!((DISC_SOLID_ANGLE / 6.796e-5 - 1.0).abs() < 1e-3);
        assert!((SOLAR_COLOUR.luminance() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn angles_are_those_of_a_compass() {
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        near(towards(0.0, 0.0), DVec3::NEG_Z);
        near(towards(0.0, 90.0), DVec3::X);
        near(towards(0.0, 180.0), DVec3::Z);
        near(towards(90.0, 123.0), DVec3::Y);
    }

    #[test]
    fn days_are_counted_from_noon_of_2000() {
        let at = |year, month, day, hours| Moment { year, month, day, hours }.days();
        assert_eq!(at(2000, 1, 1, 12.0), 0.0);
        assert_eq!(at(2000, 3, 1, 12.0), 60.0);
        assert_eq!(at(1999, 12, 31, 36.0), 0.0);
        // Julian dates 2 452 930.312847 and 2 415 020.5.
        assert!((at(2003, 10, 17, 19.0 + 30.5 / 60.0) - 1_385.312_847).abs() < 1e-6);
        assert_eq!(at(1900, 1, 1, 0.0), -36_524.5);
    }

    /// The example of I. Reda and A. Andreas, "Solar position algorithm for solar radiation applications" (NREL/TP-560-34302):
    /// Golden, Colorado, 17 October 2003, 12:30:30 local time (UT − 7 h): elevation without refraction 39.872046°, azimuth 194.340241°.
    /// And declinations of the solstices at noon.
    #[test]
    fn the_sun_stands_where_it_should() {
        let moment = Moment { year: 2003, month: 10, day: 17, hours: 19.0 + 30.5 / 60.0 };
        let [elevation, azimuth] = position(moment, 39.742_476, -105.178_6);
        assert!(
            (elevation - 39.872_046).abs() < 0.01 && (azimuth - 194.340_241).abs() < 0.015,
            "{elevation} {azimuth}"
        );
        let highest = |month, day| {
            let at = |minute: u32| Moment { year: 2026, month, day, hours: f64::from(minute) / 60.0 };
            (600..840).map(|minute| position(at(minute), 50.0, 0.0)[0]).fold(f64::MIN, f64::max)
        };
        assert!((highest(6, 21) - 63.436).abs() < 0.02, "{}", highest(6, 21));
        assert!((highest(12, 21) - 16.563).abs() < 0.02, "{}", highest(12, 21));
    }

    #[test]
    fn the_air_takes_more_of_a_low_sun_and_most_of_its_blue() {
        let high = through_haze(60.0, 2.5);
        let low = through_haze(5.0, 2.5);
        // Some 100 klx on a clear day.
        assert!((85_000.0..115_000.0).contains(&high.luminance()), "{high:?}");
        assert!(low.luminance() < 0.5 * high.luminance() && low.b / low.r < 0.5 * high.b / high.r);
        assert!(through_haze(60.0, 6.0).luminance() < high.luminance());
        assert_eq!(through_haze(-1.0, 2.5), Rgb::BLACK);
        assert!((through_clear_air(90.0).luminance() / (127_500.0 * (-0.21f64).exp()) - 1.0).abs() < 1e-12);
    }
}
