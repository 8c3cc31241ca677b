//! The container of `.twin` files: named sections with checksums, in order, without a gap that could hide a change.
//!
//! Little-endian. Eight bytes of magic, u32 version, u32 number of sections; per section 32 bytes: name (12 bytes
//! ASCII, filled with zeros), u32 CRC-32, u64 offset, u64 length; u32 CRC-32 of everything so far, u32 zero. Then the
//! sections, each at the next multiple of 8 bytes, the gaps filled with zeros. Every bit of a file is thus checked:
//! a section that this version does not know must be whole as well, and is then ignored.

use crate::error::FormatError;
use crate::limits::Limits;

/// The first byte is no text, and the last ones are changed by programs that take the file for text (as in PNG).
const MAGIC: [u8; 8] = *b"\x89TWIN\r\n\x1a";
/// Raised when old readers would misread new files; sections may be added without.
const VERSION: u32 = 1;
/// Bytes before the table.
const START: usize = 16;
/// Bytes of the table for one section.
const ENTRY: usize = 32;
const NAME: usize = 12;
/// More sections than anybody needs: every name is compared with every other one.
const MOST_SECTIONS: u32 = 256;

/// The bytes of a file with these sections, in this order.
///
/// # Panics
/// If a name is empty or longer than 12 bytes.
pub(super) fn pack(sections: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut table = MAGIC.to_vec();
    table.extend(VERSION.to_le_bytes());
    table.extend((sections.len() as u32).to_le_bytes());
    let mut offset = data_start(sections.len());
    for (name, bytes) in sections {
        assert!((1..=NAME).contains(&name.len()), "section name {name}");
        let mut padded = [0; NAME];
        padded[..name.len()].copy_from_slice(name.as_bytes());
        table.extend(padded);
        table.extend(crc32fast::hash(bytes).to_le_bytes());
        table.extend((offset as u64).to_le_bytes());
        table.extend((bytes.len() as u64).to_le_bytes());
        offset = (offset + bytes.len()).next_multiple_of(8);
    }
    let mut out = Vec::with_capacity(offset);
    out.extend(&table);
    out.extend(crc32fast::hash(&table).to_le_bytes());
    out.extend([0; 4]);
    for (_, bytes) in sections {
        out.extend(bytes);
        out.resize(out.len().next_multiple_of(8), 0);
    }
    out
}

fn data_start(sections: usize) -> usize {
    START + ENTRY * sections + 8
}

/// The sections of a file that is whole, by name.
#[derive(Debug)]
pub(super) struct Sections<'a> {
    file: &'a str,
    sections: Vec<(&'a str, &'a [u8])>,
}

impl<'a> Sections<'a> {
    /// Checks every byte of the container.
    ///
    /// # Errors
    /// `OverLimit` if the file is too large, `Unsupported` for another version, `Unreadable` if it is no such file,
    /// is cut off, or has a changed bit.
    pub fn unpack(file: &'a str, bytes: &'a [u8], limits: &Limits) -> Result<Self, FormatError> {
        if bytes.len() as u64 > limits.max_file_bytes {
            return Err(FormatError::OverLimit {
                file: file.to_owned(),
                element: "the file".to_owned(),
                limit: "max_file_bytes",
                needed: format!("{} bytes", bytes.len()),
                allowed: limits.max_file_bytes,
            });
        }
        let unreadable = |detail: String, expected: &str| FormatError::unreadable(file, expected, detail);
        if !bytes.starts_with(&MAGIC) {
            return Err(unreadable("is no solution file".into(), "a .twin file, as `twinray solve` writes it"));
        }
        let cut_off = |needed: u64| {
            unreadable(format!("is cut off after {} bytes", bytes.len()), &format!("{needed} bytes or more"))
        };
        let (Some(version), Some(count)) = (u32_at(bytes, 8), u32_at(bytes, 12)) else {
            return Err(cut_off(START as u64));
        };
        if version != VERSION {
            return Err(FormatError::unsupported(
                file,
                "header",
                format!("version {version} of solution files"),
                format!("This twinray reads version {VERSION}: use the twinray that wrote the file, or solve again"),
            ));
        }
        if count > MOST_SECTIONS {
            return Err(unreadable(format!("has {count} sections"), &format!("at most {MOST_SECTIONS}")));
        }
        let table_end = START + ENTRY * count as usize;
        let Some(checksum) = u32_at(bytes, table_end) else {
            return Err(cut_off(data_start(count as usize) as u64));
        };
        if crc32fast::hash(&bytes[..table_end]) != checksum {
            return Err(unreadable(
                "the table of sections has been changed".into(),
                &format!("the checksum {checksum:08x}"),
            ));
        }
        let mut sections: Vec<(&str, &[u8])> = Vec::new();
        let mut end = table_end + 4;
        for entry in bytes[START..table_end].chunks_exact(ENTRY) {
            let (name, content, after) = section(file, bytes, entry, end)?;
            if sections.iter().any(|(other, _)| *other == name) {
                return Err(unreadable(format!("has two sections \"{name}\""), "one of each name"));
            }
            sections.push((name, content));
            end = after;
        }
        expect_zeros(file, bytes, end, end.next_multiple_of(8))?;
        let end = end.next_multiple_of(8);
        if bytes.len() > end {
            return Err(unreadable(
                format!("has {} bytes after its last section", bytes.len() - end),
                &format!("{end} bytes in all"),
            ));
        }
        Ok(Self { file, sections })
    }

    /// The bytes of a section.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn get(&self, name: &str) -> Result<&'a [u8], FormatError> {
        let found = self.sections.iter().find(|(n, _)| *n == name);
        found.map(|(_, bytes)| *bytes).ok_or_else(|| {
            FormatError::unreadable(self.file, format!("a section \"{name}\""), "has no such section".to_owned())
        })
    }
}

/// Name and bytes of one section, and where it ends; the one before ended at `last_end`.
fn section<'a>(
    file: &str,
    bytes: &'a [u8],
    entry: &'a [u8],
    last_end: usize,
) -> Result<(&'a str, &'a [u8], usize), FormatError> {
    let unreadable = |detail: String, expected: String| FormatError::unreadable(file, expected, detail);
    let padded = &entry[..NAME];
    let length = padded.iter().position(|&b| b == 0).unwrap_or(NAME);
    let name = std::str::from_utf8(&padded[..length]).ok().filter(|n| {
        n.bytes().all(|b| b.is_ascii_graphic()) && !n.is_empty() && padded[length..].iter().all(|&b| b == 0)
    });
    let Some(name) = name else {
        return Err(unreadable(format!("has a section named {padded:?}"), "a short name in ASCII".into()));
    };
    let (checksum, offset, length) = (u32_at(entry, 12), u64_at(entry, 16), u64_at(entry, 24));
    let (Some(checksum), Some(offset), Some(length)) = (checksum, offset, length) else {
        unreachable!("an entry has 32 bytes");
    };
    let start = last_end.next_multiple_of(8);
    if offset != start as u64 {
        return Err(unreadable(format!("section \"{name}\" begins at byte {offset}"), format!("byte {start}")));
    }
    let end = offset.checked_add(length);
    let Some(end) = end.and_then(|end| usize::try_from(end).ok()).filter(|&end| end <= bytes.len()) else {
        let needed = end.map_or_else(|| "more than there can be".to_owned(), |end| format!("{end} bytes or more"));
        return Err(unreadable(format!("is cut off in section \"{name}\", after {} bytes", bytes.len()), needed));
    };
    expect_zeros(file, bytes, last_end, start)?;
    let found = crc32fast::hash(&bytes[start..end]);
    if found != checksum {
        return Err(unreadable(
            format!("section \"{name}\" has been changed, its checksum is {found:08x}"),
            format!("{checksum:08x}"),
        ));
    }
    Ok((name, &bytes[start..end], end))
}

/// Between sections there is nothing, so that no change goes unseen.
fn expect_zeros(file: &str, bytes: &[u8], from: usize, to: usize) -> Result<(), FormatError> {
    match bytes.get(from..to) {
        Some(gap) if gap.iter().all(|&b| b == 0) => Ok(()),
        Some(_) => Err(FormatError::unreadable(file, "zeros", format!("bytes {from} to {to} have been changed"))),
        None => {
            let detail = format!("is cut off after {} bytes", bytes.len());
            Err(FormatError::unreadable(file, format!("{to} bytes or more"), detail))
        }
    }
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?)?.try_into().ok().map(u32::from_le_bytes)
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..at.checked_add(8)?)?.try_into().ok().map(u64::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_come_back_and_are_aligned() {
        let bytes = pack(&[("a", vec![1, 2, 3]), ("a-longer-one", vec![]), ("c", vec![9; 16])]);
        let sections = Sections::unpack("x.twin", &bytes, &Limits::default()).unwrap();
        assert_eq!(sections.get("a").unwrap(), [1, 2, 3]);
        assert!(sections.get("a-longer-one").unwrap().is_empty());
        assert_eq!(sections.get("c").unwrap(), [9; 16]);
        assert!(sections.get("d").unwrap_err().to_string().contains("a section \"d\""));
        assert_eq!(bytes.len() % 8, 0);
        assert_eq!(bytes.windows(16).position(|w| w == [9; 16]).unwrap() % 8, 0);
    }

    /// CRC-32 finds every change of one bit; what is not under a checksum is compared.
    #[test]
    fn every_flipped_bit_and_every_cut_is_seen() {
        let bytes = pack(&[("a", vec![1, 2, 3]), ("b", vec![7; 8])]);
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(Sections::unpack("x.twin", &flipped, &Limits::default()).is_err(), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(Sections::unpack("x.twin", &bytes[..length], &Limits::default()).is_err(), "{length} bytes");
        }
        let longer = [&bytes[..], &[0; 8]].concat();
        assert!(Sections::unpack("x.twin", &longer, &Limits::default()).is_err());
    }
}
