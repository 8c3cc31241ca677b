//! The ZIP archive around the arrays of an NPZ: entries stored as they are, one after the other.
//!
//! Written by hand, to any `Write`. The `zip` crate wants to seek back for each checksum (or leaves it out of the head
//! of the entry, where some readers of NPZ look for it), writes to standard error when a disk is full, and brings seven
//! crates along; it reads the archives back in the tests. Here an entry is computed twice, first for its checksum. No
//! dates, no attributes. Source: PKWARE's APPNOTE.TXT 6.3.10, sections 4.3 and 4.5.3.

use std::io::{self, Write};

/// Numbers from here on do not fit into the fields of the first ZIP and go into the long ones of ZIP64.
const LONG: u64 = u32::MAX as u64;

/// An archive under construction.
pub struct Archive<W> {
    out: W,
    entries: Vec<Entry>,
    /// Bytes written so far.
    at: u64,
    /// [`LONG`], or less to try the long fields on short files.
    long: u64,
}

struct Entry {
    name: String,
    crc: u32,
    size: u64,
    offset: u64,
}

impl<W: Write> Archive<W> {
    /// An archive that is written to `out`.
    pub fn new(out: W) -> Self {
        Self { out, entries: Vec::new(), at: 0, long: LONG }
    }

    /// Adds a file. `content` writes the same bytes each of the two times that it is called.
    pub fn add(&mut self, name: &str, content: impl Fn(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let mut measure = Measure::default();
        content(&mut measure)?;
        let (crc, size) = (measure.hasher.finalize(), measure.bytes);
        let entry = Entry { name: name.to_owned(), crc, size, offset: self.at };
        let extra = long_fields(&[size, size], size >= self.long);
        let mut head = b"PK\x03\x04".to_vec();
        entry.describe(&mut head, &extra, self.long);
        head.extend(name.bytes());
        head.extend(extra);
        self.out.write_all(&head)?;
        content(&mut self.out)?;
        self.at += head.len() as u64 + size;
        self.entries.push(entry);
        Ok(())
    }

    /// Writes the directory, without which there is no archive.
    pub fn finish(mut self) -> io::Result<()> {
        let mut directory = Vec::new();
        for entry in &self.entries {
            let is_long = |n: &u64| *n >= self.long;
            let fields: Vec<u64> = [entry.size, entry.size, entry.offset].into_iter().filter(is_long).collect();
            let extra = long_fields(&fields, !fields.is_empty());
            directory.extend(b"PK\x01\x02");
            // Made by version 4.5 on a system of files without attributes.
            directory.extend([45, 0]);
            entry.describe(&mut directory, &extra, self.long);
            // No comment, first disk, binary, no attributes.
            directory.extend([0; 10]);
            directory.extend(short(entry.offset, self.long));
            directory.extend(entry.name.bytes());
            directory.extend(extra);
        }
        let (count, size) = (self.entries.len(), directory.len() as u64);
        let mut end = Vec::new();
        if self.at >= self.long {
            end.extend(b"PK\x06\x06");
            end.extend(44u64.to_le_bytes());
            end.extend([45, 0, 45, 0]);
            end.extend([0; 8]);
            end.extend([count as u64, count as u64, size, self.at].iter().flat_map(|n| n.to_le_bytes()));
            end.extend(b"PK\x06\x07\0\0\0\0");
            end.extend((self.at + size).to_le_bytes());
            end.extend(1u32.to_le_bytes());
        }
        end.extend(b"PK\x05\x06\0\0\0\0");
        end.extend([count as u16, count as u16].iter().flat_map(|n| n.to_le_bytes()));
        end.extend((size as u32).to_le_bytes());
        end.extend(short(self.at, self.long));
        end.extend([0, 0]);
        self.out.write_all(&directory)?;
        self.out.write_all(&end)?;
        self.out.flush()
    }
}

impl Entry {
    /// What the head of an entry and the directory have in common.
    fn describe(&self, out: &mut Vec<u8>, extra: &[u8], long: u64) {
        // Midnight of the first of January 1980, where the dates of ZIP begin.
        const NO_DATE: [u8; 4] = [0, 0, 0x21, 0];
        // Needs version 2.0, or 4.5 with long fields; no flags; stored.
        out.extend([if extra.is_empty() { 20 } else { 45 }, 0, 0, 0, 0, 0]);
        out.extend(NO_DATE);
        out.extend(self.crc.to_le_bytes());
        out.extend(short(self.size, long));
        out.extend(short(self.size, long));
        out.extend((self.name.len() as u16).to_le_bytes());
        out.extend((extra.len() as u16).to_le_bytes());
    }
}

/// A number in four bytes: all ones if it is among the long fields.
fn short(n: u64, long: u64) -> [u8; 4] {
    if n >= long { [0xff; 4] } else { (n as u32).to_le_bytes() }
}

/// The extra field of ZIP64 with `fields`, or nothing.
fn long_fields(fields: &[u64], are_needed: bool) -> Vec<u8> {
    if !are_needed {
        return Vec::new();
    }
    let numbers = fields.iter().flat_map(|n| n.to_le_bytes());
    [1, 0].into_iter().chain((8 * fields.len() as u16).to_le_bytes()).chain(numbers).collect()
}

/// Checksum and length of what is written to it.
#[derive(Default)]
struct Measure {
    hasher: crc32fast::Hasher,
    bytes: u64,
}

impl Write for Measure {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use super::*;

    /// Read back by the `zip` crate, which compares the checksums; with short fields, with all of them long, and with
    /// offsets alone long.
    #[test]
    fn entries_come_back() {
        let contents: [(&str, &[u8]); 3] = [("a", b""), ("b.npy", &[7; 300]), ("c", b"xyz")];
        for long in [LONG, 0, 320] {
            let mut file = Vec::new();
            let mut archive = Archive { long, ..Archive::new(&mut file) };
            for (name, content) in contents {
                archive.add(name, |out| out.write_all(content)).unwrap();
            }
            archive.finish().unwrap();
            let mut archive = zip::ZipArchive::new(Cursor::new(&file)).unwrap();
            assert_eq!(archive.len(), contents.len());
            for (k, (name, content)) in contents.iter().enumerate() {
                let mut entry = archive.by_index(k).unwrap();
                assert_eq!(entry.name().unwrap(), *name);
                assert_eq!(entry.last_modified(), Some(zip::DateTime::default()));
                let mut found = Vec::new();
                entry.read_to_end(&mut found).unwrap();
                assert_eq!(found, *content, "long from {long}");
            }
            assert_eq!(file.windows(4).any(|w| w == b"PK\x06\x06"), long != LONG, "long from {long}");
        }
    }
}
