//! IES files: symmetries and factors, faults with their lines, real files, and no panic whatever the bytes.

use proptest::prelude::*;
use twinray_format::{FormatError, Limits, read_ies};
use twinray_scene::LightProfile;

use crate::real::shared_scenes;

fn read(text: &str) -> Result<LightProfile, FormatError> {
    read_ies("a.ies", text.as_bytes(), &Limits::default())
}

/// A file with these lines of numbers after `TILT=NONE`.
fn file(numbers: &str) -> String {
    format!("IESNA:LM-63-1995\n[TEST] one\nTILT=NONE\n{numbers}")
}

/// Three vertical angles and the given horizontal ones, with 100·plane + angle as candela.
fn planes(horizontal: &[f32]) -> String {
    let words = horizontal.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    let candela: Vec<String> =
        (1..=horizontal.len()).map(|k| format!("{} {} {}", 100 * k, 100 * k + 45, 100 * k + 90)).collect();
    file(&format!("1 1000 2 3 {} 1 2 0 0 0\n0.5 1 10\n0 45 90\n{words}\n{}\n", horizontal.len(), candela.join("\n")))
}

#[test]
fn symmetries_are_unfolded() {
    // Planes of the file, in order of the angles of the whole circle.
    let cases: [(&[f32], &[f32], &[usize]); 6] = [
        (&[0.0], &[0.0], &[1]),
        (
            &[0.0, 45.0, 90.0],
            &[0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0, 360.0],
            &[1, 2, 3, 2, 1, 2, 3, 2, 1],
        ),
        (&[0.0, 60.0, 180.0], &[0.0, 60.0, 180.0, 300.0, 360.0], &[1, 2, 3, 2, 1]),
        (&[0.0, 120.0, 240.0, 360.0], &[0.0, 120.0, 240.0, 360.0], &[1, 2, 3, 4]),
        (&[0.0, 120.0, 240.0], &[0.0, 120.0, 240.0, 360.0], &[1, 2, 3, 1]),
        (&[90.0, 180.0, 270.0], &[0.0, 90.0, 180.0, 270.0, 360.0], &[2, 1, 2, 3, 2]),
    ];
    for (horizontal, whole, order) in cases {
        let profile = read(&planes(horizontal)).unwrap();
        assert_eq!((&profile.vertical[..], &profile.horizontal[..]), (&[0.0, 45.0, 90.0][..], whole));
        // Multiplier 2 and ballast factor 0.5 leave the values as they are.
        let first: Vec<f32> = profile.candela.chunks(3).map(|plane| plane[0]).collect();
        assert_eq!(first, order.iter().map(|&k| 100.0 * k as f32).collect::<Vec<_>>(), "{horizontal:?}");
    }
}

#[test]
fn factors_and_forms_of_all_versions() {
    let numbers = "1, 1000, 3, 2, 1, 1, 2, 0 0 0\r\n0.5 0.8 10\r\n0 90\r\n0\r\n10 20\r\n";
    let candela = |text: &str| read(text).unwrap().candela;
    let near = |found: Vec<f32>, factor: f32| {
        let expected = [10.0 * factor, 20.0 * factor];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {expected:?}");
    };
    near(candela(&file(numbers)), 1.2);
    // From 2002 on, what was the ballast-lamp factor is reserved.
    near(candela(&format!("IESNA:LM-63-2002\nTILT=NONE\n{numbers}")), 1.5);
    near(candela(&format!("IES:LM-63-2019\r\nTILT=NONE\r\n{numbers}")), 1.5);
    // 1986: no first line at all, and a table of tilt.
    near(candela(&format!("some luminaire\nTILT=INCLUDE\n1\n3\n0 30 60\n1 .9 .8\n{numbers}")), 1.2);
}

#[test]
fn faults_name_their_line() {
    let good = planes(&[0.0]);
    let cases = [
        ("no TILT here\n".to_owned(), "TILT=", ""),
        ("IESNA91\nTILT=a.tlt\n1".to_owned(), "TILT=INCLUDE", "a.tlt"),
        (good.replacen("1 1000 2 3", "1 1000 x 3", 1), "line 4", "\"x\""),
        (good.replacen("1 1000 2 3", "1 1000 -2 3", 1), "line 4", "more than 0"),
        (good.replacen("2 3 1 1", "2 3.5 1 1", 1), "line 4", "vertical angles"),
        (good.replacen("2 3 1 1", "2 3000000000 1 1", 1), "line 4", "whole number"),
        (good.replacen("3 1 1 2", "3 1 2 2", 1), "type B", "type C"),
        (good.replacen("3 1 1 2", "3 1 3 2", 1), "type A", "type C"),
        (good.replacen("3 1 1 2", "3 1 7 2", 1), "line 4", "7"),
        (good.replacen("0 45 90\n", "0 90 45\n", 1), "line 6", "90 followed by 45"),
        (good.replacen("0 45 90\n", "0 45 190\n", 1), "line 6", "angle 3 = 190"),
        (planes(&[0.0, 45.0]), "line 7", "0 to 45"),
        (planes(&[30.0, 120.0]), "30 to 120", "0, 90, 180 or 360"),
        (good.replacen("145", "-145", 1), "line 8", "-145"),
        (good.replacen("145", "nan", 1), "line 8", "nan"),
        (good.replacen("145 190\n", "145\n", 1), "plane 1 of 1", "number 3 of 3"),
        (good.replacen("145", "1e30", 1), "max_radiance", "1e12"),
    ];
    for (text, place, words) in cases {
        let message = read(&text).expect_err(&text).to_string();
        assert!(message.starts_with("a.ies: ") && message.contains(place) && message.contains(words), "{message}");
    }
    let small = Limits { max_file_bytes: 10, ..Limits::default() };
    assert!(matches!(read_ies("a.ies", good.as_bytes(), &small), Err(FormatError::OverLimit { .. })));
}

/// Values measured on the files by other means.
#[test]
fn real_luminaires() {
    let Some(root) = shared_scenes() else { return };
    let real =
        |name: &str| read_ies(name, &std::fs::read(root.join("ies").join(name)).unwrap(), &Limits::default()).unwrap();
    let pendant = real("examp1.ies");
    assert_eq!((pendant.vertical.len(), pendant.horizontal.len()), (73, 17));
    assert!((pendant.flux() - 5296.7).abs() < 0.05, "{}", pendant.flux());
    assert!((pendant.at(0.0, 33.0) - 778.4).abs() < 1e-4 && (pendant.at(180.0, 0.0) - 801.4).abs() < 1e-4);
    let most = pendant.candela.iter().copied().fold(0.0, f32::max);
    assert!((most - 1065.2).abs() < 1e-3 && pendant.candela[4 * 73..5 * 73].contains(&most), "{most}");
    // A street lamp, full cutoff: nothing above the horizon, symmetric about its arm.
    let street = real("ASA_15M_R2.ies");
    assert!(street.at(95.0, 0.0) == 0.0 && street.at(60.0, 80.0) > 0.0);
    assert!((street.at(60.0, 80.0) - street.at(60.0, 280.0)).abs() < 1e-6 * street.at(60.0, 80.0));
    assert!((1000.0..20_000.0).contains(&street.flux()), "{}", street.flux());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// Any bytes, and good files with any piece put anywhere.
    #[test]
    fn no_bytes_panic(junk in proptest::collection::vec(any::<u8>(), 0..60), at in 0usize..200, piece in "[0-9 .\\-eE,\n]{0,12}") {
        let _ = read_ies("a.ies", &junk, &Limits::default());
        let head = [b"TILT=NONE\n", &junk[..]].concat();
        let _ = read_ies("a.ies", &head, &Limits::default());
        let mut text = planes(&[0.0, 45.0, 90.0]);
        text.insert_str(at.min(text.len()), &piece);
        if let Ok(profile) = read(&text) {
            prop_assert!(profile.flux() >= 0.0 && profile.flux().is_finite());
        }
    }
}
