//! The container of `.twin` files: named arrays with checksums, in order, without a gap that could hide a change.
//!
//! Little-endian. Eight bytes of magic, u32 version, u32 number of sections; per section 40 bytes: name (12 bytes
//! ASCII, filled with zeros), u32 CRC-32, u64 offset, u64 length, kind (4 bytes ASCII, as NumPy writes it, filled with zeros), u32
//! columns; u32 CRC-32 of everything so far, u32 zero. Then the sections, each at the next multiple of 8 bytes, the gaps
//! filled with zeros. Every bit of a file is thus checked, sections when they are asked for; one that this version
//! does not know is ignored, once it was found whole.

use std::borrow::Cow;
use std::io::{self, Write};

use bytemuck::Pod;

use crate::error::FormatError;
use crate::limits::Limits;

/// The first byte is no text, and the last ones are changed by programs that take the file for text (as in PNG).
const MAGIC: [u8; 8] = *b"\x89TWIN\r\n\x1a";
/// Raised when old readers would misread new files; sections may be added without.
const VERSION: u32 = 3;
/// Bytes before the table.
const START: usize = 16;
/// Bytes of the table for one section.
const ENTRY: usize = 40;
const NAME: usize = 12;
/// More sections than anybody needs: every name is compared with every other one.
const MOST_SECTIONS: u32 = 256;

/// What the numbers of a section are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// UTF-8, or bytes with a layout of their own.
    Bytes,
    /// u32.
    U32,
    /// u64.
    U64,
    /// f32.
    F32,
    /// f64.
    F64,
}

impl Kind {
    /// As NumPy writes it.
    fn text(self) -> &'static [u8; 4] {
        match self {
            Kind::Bytes => b"|u1\0",
            Kind::U32 => b"<u4\0",
            Kind::U64 => b"<u8\0",
            Kind::F32 => b"<f4\0",
            Kind::F64 => b"<f8\0",
        }
    }

    fn bytes(self) -> usize {
        match self {
            Kind::Bytes => 1,
            Kind::U32 | Kind::F32 => 4,
            Kind::U64 | Kind::F64 => 8,
        }
    }
}

/// One array, to be written: `[rows, columns]`.
pub(super) struct Section<'a> {
    name: &'static str,
    kind: Kind,
    columns: usize,
    bytes: Cow<'a, [u8]>,
}

impl<'a> Section<'a> {
    /// Bytes with a layout of their own, so many a row.
    pub fn raw(name: &'static str, columns: usize, bytes: Cow<'a, [u8]>) -> Self {
        assert!((1..=NAME).contains(&name.len()), "section name {name}");
        Self { name, kind: Kind::Bytes, columns, bytes }
    }

    /// Rows of numbers of this kind.
    pub fn rows<T: Pod>(name: &'static str, kind: Kind, rows: &'a [T]) -> Self {
        let columns = size_of::<T>() / kind.bytes();
        Self { kind, ..Self::raw(name, columns, Cow::Borrowed(bytemuck::must_cast_slice(rows))) }
    }

    /// Rows of numbers of this kind that nobody else keeps.
    pub fn owned<T: Pod>(name: &'static str, kind: Kind, rows: Vec<T>) -> Self {
        let columns = size_of::<T>() / kind.bytes();
        Self { kind, ..Self::raw(name, columns, Cow::Owned(bytemuck::must_cast_slice(&rows).to_vec())) }
    }
}

/// Writes a file with these sections, in this order.
pub(super) fn write(sections: &[Section], out: &mut dyn Write) -> io::Result<()> {
    let mut table = MAGIC.to_vec();
    table.extend(VERSION.to_le_bytes());
    table.extend((sections.len() as u32).to_le_bytes());
    let mut offset = data_start(sections.len());
    for section in sections {
        let mut padded = [0; NAME];
        padded[..section.name.len()].copy_from_slice(section.name.as_bytes());
        table.extend(padded);
        table.extend(crc32fast::hash(&section.bytes).to_le_bytes());
        table.extend((offset as u64).to_le_bytes());
        table.extend((section.bytes.len() as u64).to_le_bytes());
        table.extend(section.kind.text());
        table.extend((section.columns as u32).to_le_bytes());
        offset = (offset + section.bytes.len()).next_multiple_of(8);
    }
    out.write_all(&table)?;
    out.write_all(&u64::from(crc32fast::hash(&table)).to_le_bytes())?;
    for section in sections {
        out.write_all(&section.bytes)?;
        let gap = section.bytes.len().next_multiple_of(8) - section.bytes.len();
        out.write_all(&[0; 8][..gap])?;
    }
    Ok(())
}

fn data_start(sections: usize) -> usize {
    START + ENTRY * sections + 8
}

/// The sections of a file whose table is whole, by name.
#[derive(Clone, Debug)]
pub(super) struct Sections<'a> {
    file: &'a str,
    sections: Vec<Entry<'a>>,
}

#[derive(Clone, Debug)]
struct Entry<'a> {
    name: &'a str,
    checksum: u32,
    kind: &'a [u8],
    columns: u32,
    content: &'a [u8],
}

impl<'a> Sections<'a> {
    /// Checks every byte of the container but those of the sections, which are checked when they are asked for.
    ///
    /// # Errors
    /// `OverLimit` if the file is too large, `Unsupported` for another version, `Unreadable` if it is no such file,
    /// is cut off, or has a changed bit.
    pub fn open(file: &'a str, bytes: &'a [u8], limits: &Limits) -> Result<Self, FormatError> {
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
        let mut sections: Vec<Entry> = Vec::new();
        let mut end = table_end + 4;
        for entry in bytes[START..table_end].chunks_exact(ENTRY) {
            let (entry, after) = section(file, bytes, entry, end)?;
            if sections.iter().any(|other| other.name == entry.name) {
                return Err(unreadable(format!("has two sections \"{}\"", entry.name), "one of each name"));
            }
            sections.push(entry);
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

    /// Checks every byte of the sections.
    ///
    /// # Errors
    /// Names the first that was changed.
    pub fn verify(&self) -> Result<(), FormatError> {
        self.sections.iter().try_for_each(|entry| self.whole(entry).map(|_| ()))
    }

    /// True if there is a section of that name.
    pub fn has(&self, name: &str) -> bool {
        self.sections.iter().any(|entry| entry.name == name)
    }

    /// The bytes of a section, once they were found whole.
    ///
    /// # Errors
    /// If there is none of that name, or it was changed.
    pub fn bytes(&self, name: &str) -> Result<&'a [u8], FormatError> {
        self.whole(self.entry(name)?)
    }

    /// `rows` rows of numbers of a kind, in place where they lie as memory wants them.
    ///
    /// # Errors
    /// If there is no section of that name, it was changed, or it is of another shape.
    pub fn rows<T: Pod>(&self, name: &str, kind: Kind, rows: usize) -> Result<Cow<'a, [T]>, FormatError> {
        let entry = self.entry(name)?;
        let columns = size_of::<T>() / kind.bytes();
        if entry.kind != kind.text() || entry.columns as usize != columns {
            let shown = |kind: &[u8]| String::from_utf8_lossy(kind).trim_end_matches('\0').to_owned();
            return Err(FormatError::unreadable(
                self.file,
                format!("{columns} columns of {}", shown(kind.text())),
                format!("section \"{name}\" has {} of {}", entry.columns, shown(entry.kind)),
            ));
        }
        if rows.checked_mul(size_of::<T>()) != Some(entry.content.len()) {
            return Err(FormatError::unreadable(
                self.file,
                format!("{rows} rows of {} bytes", size_of::<T>()),
                format!("section \"{name}\" has {} bytes", entry.content.len()),
            ));
        }
        let bytes = self.whole(entry)?;
        Ok(match bytemuck::try_cast_slice(bytes) {
            Ok(rows) => Cow::Borrowed(rows),
            // Bytes that were not mapped may begin anywhere.
            Err(_) => Cow::Owned(bytemuck::pod_collect_to_vec(bytes)),
        })
    }

    fn entry(&self, name: &str) -> Result<&Entry<'a>, FormatError> {
        let found = self.sections.iter().find(|entry| entry.name == name);
        found.ok_or_else(|| {
            FormatError::unreadable(self.file, format!("a section \"{name}\""), "has no such section".to_owned())
        })
    }

    fn whole(&self, entry: &Entry<'a>) -> Result<&'a [u8], FormatError> {
        let found = crc32fast::hash(entry.content);
        if found == entry.checksum {
            return Ok(entry.content);
        }
        Err(FormatError::unreadable(
            self.file,
            format!("{:08x}", entry.checksum),
            format!("section \"{}\" has been changed, its checksum is {found:08x}", entry.name),
        ))
    }
}

/// One entry of the table, and where its section ends; the one before ended at `last_end`.
fn section<'a>(
    file: &str,
    bytes: &'a [u8],
    entry: &'a [u8],
    last_end: usize,
) -> Result<(Entry<'a>, usize), FormatError> {
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
    let (Some(checksum), Some(offset), Some(length), Some(columns)) = (checksum, offset, length, u32_at(entry, 36))
    else {
        unreachable!("an entry has 40 bytes");
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
    Ok((Entry { name, checksum, kind: &entry[32..36], columns, content: &bytes[start..end] }, end))
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

    fn pack(sections: &[Section]) -> Vec<u8> {
        let mut out = Vec::new();
        write(sections, &mut out).unwrap();
        out
    }

    fn opened<'a>(bytes: &'a [u8]) -> Result<Sections<'a>, FormatError> {
        let sections = Sections::open("x.twin", bytes, &Limits::default())?;
        sections.verify().map(|()| sections)
    }

    #[test]
    fn sections_come_back_and_are_aligned() {
        let numbers = [[1.5f32, 2.0], [3.0, -4.0]];
        let bytes = pack(&[
            Section::raw("a", 1, vec![1, 2, 3].into()),
            Section::raw("a-longer-one", 1, vec![].into()),
            Section::rows("c", Kind::F32, &numbers),
        ]);
        let sections = opened(&bytes).unwrap();
        assert_eq!(sections.bytes("a").unwrap(), [1, 2, 3]);
        assert!(sections.bytes("a-longer-one").unwrap().is_empty());
        assert_eq!(sections.rows::<[f32; 2]>("c", Kind::F32, 2).unwrap()[..], numbers);
        assert!(sections.bytes("d").unwrap_err().to_string().contains("a section \"d\""));
        assert!(sections.rows::<[f32; 2]>("c", Kind::F32, 3).unwrap_err().to_string().contains("3 rows of 8 bytes"));
        assert!(sections.rows::<[u32; 2]>("c", Kind::U32, 2).unwrap_err().to_string().contains("2 columns of <u4"));
        assert!(sections.rows::<f32>("c", Kind::F32, 4).unwrap_err().to_string().contains("1 columns of <f4"));
        assert_eq!(bytes.len() % 8, 0);
        assert_eq!(bytes.windows(4).position(|w| w == 1.5f32.to_le_bytes()).unwrap() % 8, 0);
    }

    /// What lies as memory wants it is not copied, as in a mapped file; what does not comes out the same.
    #[test]
    fn aligned_rows_are_borrowed() {
        let file = pack(&[Section::owned("c", Kind::F64, vec![1.0, 2.0])]);
        let mut aligned = vec![0u64; file.len() / 8 + 1];
        for shift in 0..8 {
            let bytes = &mut bytemuck::cast_slice_mut(&mut aligned)[shift..shift + file.len()];
            bytes.copy_from_slice(&file);
            let rows = opened(bytes).unwrap().rows::<f64>("c", Kind::F64, 2).unwrap();
            assert_eq!(rows[..], [1.0, 2.0]);
            assert_eq!(matches!(rows, Cow::Borrowed(_)), shift == 0);
        }
    }

    /// CRC-32 finds every change of one bit; what is not under a checksum is compared.
    #[test]
    fn every_flipped_bit_and_every_cut_is_seen() {
        let bytes = pack(&[Section::raw("a", 1, vec![1, 2, 3].into()), Section::raw("b", 8, vec![7; 8].into())]);
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(opened(&flipped).is_err(), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(opened(&bytes[..length]).is_err(), "{length} bytes");
        }
        let longer = [&bytes[..], &[0; 8]].concat();
        assert!(opened(&longer).is_err());
    }
}
