//! Names of numbered files: `frames/%04d.png` for `frames/0000.png`, `frames/0001.png` and so on.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};

/// A file name with a place for a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbered {
    before: String,
    /// Digits at least, with leading zeros.
    digits: usize,
    after: String,
}

/// More digits than any number has would only make a long name.
const MOST_DIGITS: usize = 20;

impl Numbered {
    /// Reads a name with one `%d` or `%0Nd` in its last part; `%%` is a percent sign.
    pub fn parse(path: &Path) -> anyhow::Result<Self> {
        let expected = "expected the place of the frame's number in the file's name, such as frames/%04d.png";
        let fail = |what: &str| anyhow!("{}: {what}; {expected}", path.display());
        let text = path.to_str().ok_or_else(|| fail("is no text"))?;
        let (mut before, mut after, mut digits) = (String::new(), String::new(), None);
        let mut rest = text;
        while let Some((plain, tail)) = rest.split_once('%') {
            let side = if digits.is_none() { &mut before } else { &mut after };
            side.push_str(plain);
            if let Some(tail) = tail.strip_prefix('%') {
                side.push('%');
                rest = tail;
                continue;
            }
            let (width, tail) = tail.split_once('d').ok_or_else(|| fail("has a % that is neither %d nor %%"))?;
            let n = match width.strip_prefix('0') {
                None if width.is_empty() => 1,
                Some(width) => width.parse().ok().filter(|n| (1..=MOST_DIGITS).contains(n)).unwrap_or(0),
                None => 0,
            };
            if n == 0 {
                return Err(fail(&format!("has %{width}d")));
            }
            if digits.replace(n).is_some() {
                return Err(fail("has two places for a number"));
            }
            rest = tail;
        }
        let digits = digits.ok_or_else(|| fail("has no place for a number"))?;
        after.push_str(rest);
        let numbered = Self { before, digits, after };
        if numbered.path(0).parent() != numbered.path(1).parent() {
            bail!("{}: has the number in the name of a folder; {expected}", path.display());
        }
        Ok(numbered)
    }

    /// The name with this number.
    pub fn path(&self, number: usize) -> PathBuf {
        PathBuf::from(format!("{}{number:0digits$}{}", self.before, self.after, digits = self.digits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_place() {
        let name = |pattern: &str, n| Numbered::parse(Path::new(pattern)).map(|p| p.path(n).display().to_string());
        assert_eq!(name("frames/%04d.png", 7).unwrap(), "frames/0007.png");
        assert_eq!(name("frames/%04d.png", 12345).unwrap(), "frames/12345.png");
        assert_eq!(name("a%d.exr", 3).unwrap(), "a3.exr");
        assert_eq!(name("50%%-%02d%%.png", 3).unwrap(), "50%-03%.png");
        for (bad, says) in [
            ("a.png", "no place"),
            ("%d-%d.png", "two places"),
            ("%s.png", "neither"),
            ("%4d.png", "%4d"),
            ("%00d.png", "%00d"),
            ("%099d.png", "%099d"),
            ("%d/a.png", "folder"),
        ] {
            let message = name(bad, 0).unwrap_err().to_string();
            assert!(message.contains(says) && message.contains("frames/%04d.png"), "{bad}: {message}");
        }
    }
}
