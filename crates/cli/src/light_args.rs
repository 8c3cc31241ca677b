//! What can be said of light on the command line.

use clap::ValueEnum;
use twinray::scene::environment::solar::Moment;

/// Light that a scene gets beside its own.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Light")]
pub struct LightArgs {
    /// Environment map: .hdr or .exr, equirectangular; its middle is seen in +X, what is right of it towards +Z
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sky", "sun", "when"])]
    pub env: Option<String>,
    /// Turn of the map about the vertical, degrees, counter-clockwise as seen from above
    #[arg(long, value_name = "DEGREES", requires = "env", value_parser = number, allow_hyphen_values = true)]
    pub env_rotation: Option<f64>,
    /// Factor to the map's radiance [default: 1]
    #[arg(long, value_name = "X", requires = "env", value_parser = positive, allow_hyphen_values = true)]
    pub env_strength: Option<f64>,
    /// Sky, in nit [default with --sun or --when: preetham]
    #[arg(long, value_enum)]
    pub sky: Option<SkyArg>,
    /// Place of the sun, degrees: above the horizon, and clockwise from north, which is -Z (east is +X)
    #[arg(long, value_name = "ELEVATION,AZIMUTH", value_parser = sun, allow_hyphen_values = true, conflicts_with = "when")]
    pub sun: Option<[f64; 2]>,
    /// Time for the sun's place, with its offset from universal time, such as 2026-06-21T12:00+02:00
    #[arg(long, value_name = "TIME", value_parser = when, requires = "place")]
    pub when: Option<When>,
    /// Place on earth for the sun's place, degrees: latitude (north is positive) and longitude (east is)
    #[arg(long = "where", value_name = "LAT,LON", value_parser = place, requires = "when", allow_hyphen_values = true)]
    pub place: Option<[f64; 2]>,
    /// Haze of the Preetham sky, 1.7 to 10 [default: 2.5]
    #[arg(long, value_name = "T", value_parser = turbidity)]
    pub turbidity: Option<f64>,
    /// Illuminance of open level ground by the sky without the sun [default: as it is outdoors]
    #[arg(long, value_name = "LUX", value_parser = positive, allow_hyphen_values = true)]
    pub sky_lux: Option<f64>,
    /// Leave the sun's disc out of a clear or Preetham sky
    #[arg(long)]
    pub no_sun: bool,
    /// Photometric file (IES LM-63) for the point or spot lights of that name; may be repeated
    #[arg(long, value_name = "LIGHT=FILE", value_parser = profile)]
    pub ies: Vec<Profile>,
    /// Unit of the file's point, spot and directional lights [default: auto]
    #[arg(long, value_enum)]
    pub units: Option<UnitsArg>,
}

/// Skies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SkyArg {
    /// The same from everywhere.
    Uniform,
    /// CIE standard overcast sky.
    Overcast,
    /// CIE standard clear sky.
    Clear,
    /// Preetham, Shirley and Smits 1999, in colour.
    Preetham,
}

/// What a file's lights are measured in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum UnitsArg {
    /// As glTF says (cd, lx, nit), with a warning where numbers look wrong.
    #[default]
    Auto,
    /// As glTF says.
    Si,
    /// Blender's watts × 683 lm/W: divided by 683, so that lights are in watts as its surfaces are.
    #[value(name = "blender-683")]
    Blender683,
    /// The same with 177.83 lm/W.
    #[value(name = "blender-177")]
    Blender177,
    /// Blender's watts as they are: divided by 4π, but for directional lights.
    Unitless,
}

/// A time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct When(pub Moment);

/// A light's name and its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Profile(pub String, pub String);

fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a number".into())
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite()).ok_or_else(|| "expected a positive number".into())
}

fn turbidity(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x| (1.7..=10.0).contains(x)).ok_or_else(|| "expected 1.7 to 10".into())
}

fn pair(text: &str, limits: [f64; 2], expected: &str) -> Result<[f64; 2], String> {
    let pair = text.split_once(',').and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    let good = pair.filter(|p: &[f64; 2]| p.iter().zip(limits).all(|(x, limit)| x.abs() <= limit));
    good.ok_or_else(|| expected.into())
}

fn sun(text: &str) -> Result<[f64; 2], String> {
    pair(text, [90.0, 360.0], "expected elevation and azimuth in degrees, such as 35,180 for a sun in the south")
}

fn place(text: &str) -> Result<[f64; 2], String> {
    pair(text, [90.0, 180.0], "expected latitude and longitude in degrees, such as 52.5,13.4")
}

fn profile(text: &str) -> Result<Profile, String> {
    let parts = text.split_once('=').filter(|(light, file)| !light.is_empty() && !file.is_empty());
    let (light, file) = parts.ok_or("expected the name of a light and a file, such as pendant=lamp.ies")?;
    Ok(Profile(light.to_owned(), file.to_owned()))
}

/// A time of the form YYYY-MM-DDTHH:MM[:SS] with Z or an offset.
fn when(text: &str) -> Result<When, String> {
    let expected =
        "expected a time with its offset from universal time, such as 2026-06-21T12:00+02:00 or 2026-06-21T10:00Z";
    parse_time(text).map(When).ok_or_else(|| expected.into())
}

fn parse_time(text: &str) -> Option<Moment> {
    let (date, rest) = text.split_once(['T', ' '])?;
    let number = |text: &str, digits: usize| {
        let good = text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
        if good { text.parse::<u32>().ok() } else { None }
    };
    let mut parts = date.split('-');
    let (year, month, day) = (number(parts.next()?, 4)?, number(parts.next()?, 2)?, number(parts.next()?, 2)?);
    let days = match month {
        4 | 6 | 9 | 11 => 30,
        2 if year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400)) => 29,
        2 => 28,
        _ => 31,
    };
    let good = parts.next().is_none() && (1..=12).contains(&month) && (1..=days).contains(&day);
    let (clock, offset) = match rest.strip_suffix(['Z', 'z']) {
        Some(clock) => (clock, 0.0),
        None => {
            let at = rest.rfind(['+', '-'])?;
            let (hours, minutes) = rest[at + 1..].split_once(':')?;
            let (hours, minutes) = (number(hours, 2).filter(|h| *h <= 14)?, number(minutes, 2).filter(|m| *m < 60)?);
            let sign = if rest.as_bytes()[at] == b'-' { -1.0 } else { 1.0 };
            (&rest[..at], sign * (f64::from(hours) + f64::from(minutes) / 60.0))
        }
    };
    let mut parts = clock.split(':');
    let (hour, minute) = (number(parts.next()?, 2)?, number(parts.next()?, 2)?);
    let second = parts.next().map_or(Some(0), |text| number(text, 2))?;
    let good = good && parts.next().is_none() && hour < 24 && minute < 60 && second < 60;
    let hours = f64::from(hour) + f64::from(minute) / 60.0 + f64::from(second) / 3600.0 - offset;
    good.then_some(Moment { year: year as i32, month, day, hours })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_places() {
        let moment = |hours| Ok(When(Moment { year: 2026, month: 6, day: 21, hours }));
        assert_eq!(when("2026-06-21T12:00+02:00"), moment(10.0));
        assert_eq!(when("2026-06-21T12:00:36Z"), moment(12.01));
        assert_eq!(when("2026-06-21 00:30+05:30"), moment(-5.0));
        assert_eq!(when("2026-06-21T20:00-07:00"), moment(27.0));
        for wrong in [
            "",
            "2026-06-21",
            "2026-06-21T12:00",
            "2026-02-29T12:00Z",
            "2026-13-01T12:00Z",
            "2026-6-21T12:00Z",
            "2026-06-21T24:00Z",
            "2026-06-21T12:00+2:00",
            "2026-06-21T12:00:00.5Z",
            "2026-06-21T12:00ä02:00",
            "+-:T+:",
        ] {
            assert!(when(wrong).is_err(), "{wrong}");
        }
        assert!(when("2024-02-29T12:00Z").is_ok());
        assert_eq!(sun("35, -20"), Ok([35.0, -20.0]));
        assert!(["91,0", "1", "a,b", "nan,1", "1,2,3"].iter().all(|text| sun(text).is_err()));
        assert_eq!(place("-33.9,151.2"), Ok([-33.9, 151.2]));
        assert_eq!(profile("a=b=c"), Ok(Profile("a".into(), "b=c".into())));
        assert!(profile("a").is_err() && profile("=b").is_err() && profile("a=").is_err());
        assert!(turbidity("1").is_err() && positive("0").is_err() && number("inf").is_err());
    }
}
