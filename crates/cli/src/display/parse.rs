//! Values of the options for film, lens and screen, from their text.

use twinray::render::{Crop, Exposure, PhysicalCamera, WhiteBalance};

use super::{Aperture, Dof};

/// A number above 0.
fn positive(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite())
}

/// An f-number, such as f/2.8.
fn f_number(text: &str) -> Option<f64> {
    positive(text.trim().strip_prefix("f/").or_else(|| text.trim().strip_prefix("F/"))?)
}

pub(super) fn crop(text: &str) -> Result<Crop, String> {
    let expected = "expected X,Y,WIDTHxHEIGHT in pixels, such as 100,50,320x240";
    let parse = || {
        let mut parts = text.splitn(3, ',');
        let (x, y) = (parts.next()?.trim().parse().ok()?, parts.next()?.trim().parse().ok()?);
        let (width, height) = parts.next()?.split_once(['x', 'X', '×'])?;
        let (width, height) = (width.trim().parse().ok()?, height.trim().parse().ok()?);
        Some(Crop { x, y, width, height }).filter(|c| c.width > 0 && c.height > 0)
    };
    parse().ok_or_else(|| expected.into())
}

pub(super) fn fisheye(text: &str) -> Result<f64, String> {
    let degrees = positive(text).filter(|d| *d <= 360.0);
    degrees.ok_or_else(|| "expected more than 0 and at most 360 degrees, such as 180".into())
}

pub(super) fn dof(text: &str) -> Result<Dof, String> {
    let (aperture, distance) = text.split_once(',').map_or((text, None), |(a, d)| (a, Some(d)));
    let fits = distance.is_none_or(|d| positive(d).is_some());
    let aperture = f_number(aperture).map(Aperture::FNumber).or_else(|| positive(aperture).map(Aperture::Radius));
    let dof = aperture.filter(|_| fits).map(|aperture| Dof { aperture, distance: distance.and_then(positive) });
    dof.ok_or_else(|| "expected an f-number or a radius, and a distance, such as f/2.8,3.5 or 0.01,3.5 or f/2.8".into())
}

pub(super) fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    if let Some(settings) = text.strip_prefix("camera:") {
        let expected = "expected ISO, seconds and f-number of a camera, such as camera:100,1/60,f/4";
        return physical_camera(settings).map(Exposure::Camera).ok_or_else(|| expected.into());
    }
    let expected = "expected auto, a number of stops such as -2.5, or a camera such as camera:100,1/60,f/4";
    let stops: f64 = text.parse().map_err(|_| expected)?;
    // Beyond a thousand stops 2^EV is no number.
    if stops.abs() <= 1000.0 { Ok(Exposure::Stops(stops)) } else { Err("expected -1000 to 1000 stops".into()) }
}

fn physical_camera(text: &str) -> Option<PhysicalCamera> {
    let [iso, shutter, aperture] = text.split(',').collect::<Vec<_>>().try_into().ok()?;
    let shutter = match shutter.split_once('/') {
        Some((numerator, denominator)) => positive(numerator)? / positive(denominator)?,
        None => positive(shutter)?,
    };
    let camera = PhysicalCamera {
        iso: positive(iso.trim().trim_start_matches("ISO"))?,
        shutter,
        f_number: f_number(aperture).or_else(|| positive(aperture))?,
    };
    let luminance = camera.saturating_luminance();
    (luminance.is_normal() && (1.0 / luminance).is_normal()).then_some(camera)
}

pub(super) fn white_balance(text: &str) -> Result<WhiteBalance, String> {
    match text {
        "none" => Ok(WhiteBalance::None),
        "auto" => Ok(WhiteBalance::Auto),
        _ => {
            let kelvin = positive(text.trim_end_matches(['K', 'k'])).filter(|t| WhiteBalance::KELVIN.contains(t));
            let expected = "expected none, auto or a colour temperature of 1667 to 25000 kelvin, such as 3000";
            kelvin.map(WhiteBalance::Kelvin).ok_or_else(|| expected.into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_and_lenses() {
        assert_eq!(crop("10,20,30x40"), Ok(Crop { x: 10, y: 20, width: 30, height: 40 }));
        assert!(["10,20", "10,20,30", "-1,0,3x4", "1,2,0x4", "a,b,cxd", "1,2,3x4,5"].iter().all(|t| crop(t).is_err()));
        assert_eq!(fisheye("180"), Ok(180.0));
        assert!(["0", "361", "-90", "wide", "nan"].iter().all(|t| fisheye(t).is_err()));
        assert_eq!(dof("f/2.8,3.5"), Ok(Dof { aperture: Aperture::FNumber(2.8), distance: Some(3.5) }));
        assert_eq!(dof("f/4"), Ok(Dof { aperture: Aperture::FNumber(4.0), distance: None }));
        assert_eq!(dof("0.01, 2"), Ok(Dof { aperture: Aperture::Radius(0.01), distance: Some(2.0) }));
        assert!(["", "f/0", "f/2.8,", "f/2.8,-1", "f/x", "0,1", "1,2,3", "inf"].iter().all(|t| dof(t).is_err()));
    }

    #[test]
    fn exposures_and_whites() {
        let camera = |iso, shutter, f_number| Ok(Exposure::Camera(PhysicalCamera { iso, shutter, f_number }));
        assert_eq!(exposure("-2.5"), Ok(Exposure::Stops(-2.5)));
        assert_eq!(exposure("camera:100,1/50,f/4"), camera(100.0, 0.02, 4.0));
        assert_eq!(exposure("camera:ISO400,2,5.6"), camera(400.0, 2.0, 5.6));
        let bad =
            ["", "nan", "inf", "1e4", "camera:", "camera:100,1/60", "camera:0,1,1", "camera:1,1/0,1", "camera:1,1,1,1"];
        assert!(bad.iter().all(|t| exposure(t).is_err()));
        assert_eq!(white_balance("2700K"), Ok(WhiteBalance::Kelvin(2700.0)));
        assert_eq!(white_balance("auto"), Ok(WhiteBalance::Auto));
        assert!(["1000", "30000", "-3000", "warm", ""].iter().all(|t| white_balance(t).is_err()));
    }
}
