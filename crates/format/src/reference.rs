//! References from one file to another: percent-decoding, `data:` URIs, and what may be asked of the disk.
//!
//! The rule: a scene refers to files in its own folder or below. Absolute paths, drive letters, other URI
//! schemes and ways out through `..` are refused here, before any caller could open them. `Limits::allow_outside`
//! permits paths of all kinds, but no scheme. Links on the disk are the caller's matter, who alone can see them.

use base64::Engine as _;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

/// `reference` as a path with `/` between its parts and without needless `.` and `..`, or why not. The path is
/// relative and stays below the scene's folder, unless `outside` allows others.
pub(crate) fn safe_path(reference: &str, outside: bool) -> Result<String, &'static str> {
    if reference.trim().is_empty() {
        return Err("is empty");
    }
    if reference.contains('\0') {
        return Err("contains a NUL character");
    }
    let is_absolute = reference.starts_with(['/', '\\']);
    if is_absolute && !outside {
        return Err("is an absolute path, outside the scene's folder (--allow-outside reads it)");
    }
    // A colon in the first part is a URI scheme or a drive letter; file names with colons do not travel anyway.
    let first = reference.split(['/', '\\']).next().unwrap_or_default();
    let is_drive = first.len() == 2 && first.starts_with(|c: char| c.is_ascii_alphabetic());
    if first.contains(':') && !(outside && is_drive) {
        return Err("is an absolute URI or path");
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in reference.split(['/', '\\']) {
        match part {
            "" | "." => {}
            // Above the root there is nothing; above a relative path's start there is, if that is allowed.
            ".." if parts.last().is_some_and(|&p| p != "..") => drop(parts.pop()),
            ".." if is_absolute => {}
            ".." if outside => parts.push(".."),
            ".." => return Err("leaves the scene's folder through \"..\" (--allow-outside reads it)"),
            _ => parts.push(part),
        }
    }
    if parts.is_empty() {
        return Err("names no file");
    }
    // Two slashes at the front name a host where Windows reads them.
    let root = match reference.as_bytes() {
        [b'/' | b'\\', b'/' | b'\\', ..] => "//",
        [b'/' | b'\\', ..] => "/",
        _ => "",
    };
    Ok(format!("{root}{}", parts.join("/")))
}

/// `text` with `%20` and the like replaced; left as it is if the result is not UTF-8.
pub(crate) fn percent_decode(text: &str) -> String {
    String::from_utf8(percent_bytes(text)).unwrap_or_else(|_| text.to_owned())
}

/// The bytes that `text` stands for; sequences that are not two hex digits stand for themselves.
fn percent_bytes(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = |at: usize| bytes.get(at).and_then(|b| char::from(*b).to_digit(16));
        if let (b'%', Some(high), Some(low)) = (bytes[i], hex(i + 1), hex(i + 2)) {
            out.push((high * 16 + low) as u8);
            i += 3;
        } else {
            out.push(bytes[i]);
            i += 1;
        }
    }
    out
}

/// The payload of a `data:` URI; `None` if `uri` is not one, an error if it cannot be decoded.
pub(crate) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let scheme = uri.get(..5)?;
    if !scheme.eq_ignore_ascii_case("data:") {
        return None;
    }
    let Some((head, payload)) = uri[5..].split_once(',') else {
        return Some(Err("a data: URI without a comma".to_owned()));
    };
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Some(Ok(percent_bytes(payload)));
    }
    // Exporters disagree on padding; the data are the same with and without.
    let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
    Some(engine.decode(payload.trim()).map_err(|error| format!("a data: URI that is not base64 ({error})")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_scenes_own_folder_is_reachable() {
        let good = [("a.bin", "a.bin"), ("./t/../a b.png", "a b.png"), ("t\\wood.png", "t/wood.png"), ("a..b", "a..b")];
        for (reference, path) in good {
            assert_eq!(safe_path(reference, false).as_deref(), Ok(path), "{reference}");
        }
        let bad = [
            "",
            " ",
            ".",
            "..",
            "/etc/passwd",
            "\\\\host\\share",
            "../a",
            "a/../../b",
            "..\\a",
            "C:\\a",
            "c:a",
            "file:///a",
            "http://host/a",
            "a\0b",
        ];
        for reference in bad {
            assert!(safe_path(reference, false).is_err(), "{reference}");
        }
    }

    #[test]
    fn outside_is_reachable_where_that_is_allowed() {
        let good = [
            ("a/../../b.png", "../b.png"),
            ("../../b.png", "../../b.png"),
            ("/etc/../a.png", "/a.png"),
            ("/../a.png", "/a.png"),
            ("C:\\t\\a.png", "C:/t/a.png"),
            ("\\\\host\\share\\a.png", "//host/share/a.png"),
            ("t/../a.png", "a.png"),
        ];
        for (reference, path) in good {
            assert_eq!(safe_path(reference, true).as_deref(), Ok(path), "{reference}");
        }
        for reference in ["", "/", "..\0", "http://host/a", "file:///a", "ab:c"] {
            assert!(safe_path(reference, true).is_err(), "{reference}");
        }
        for reference in ["/etc/passwd", "../a"] {
            let refusal = safe_path(reference, false).unwrap_err();
            assert!(refusal.contains("--allow-outside"), "{refusal}");
        }
    }

    #[test]
    fn percent_decoding_leaves_what_it_cannot_read() {
        for (text, decoded) in [("a%20b", "a b"), ("%C3%A4", "ä"), ("100%", "100%"), ("%zz", "%zz"), ("%ff", "%ff")] {
            assert_eq!(percent_decode(text), decoded);
        }
    }

    #[test]
    fn data_uris_are_decoded_with_and_without_padding() {
        assert!(data_uri("a.bin").is_none());
        assert!(data_uri("dä").is_none());
        for uri in ["data:application/octet-stream;base64,YWI=", "DATA:;base64,YWI", "data:,a%62"] {
            assert_eq!(data_uri(uri).unwrap().unwrap(), b"ab", "{uri}");
        }
        assert!(data_uri("data:;base64,!!").unwrap().is_err());
        assert!(data_uri("data:;base64").unwrap().is_err());
    }
}
