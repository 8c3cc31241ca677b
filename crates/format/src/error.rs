//! Why a file could not be read, split by who must act.
//!
//! Every message has four parts: the file, the element in it, what was found against what was expected, and
//! what to do. Not here: what was readable but changed or ignored (`warning`). Called by every reader.

/// A file that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The bytes are not of the format they claim to be, or are cut off: get the file again.
    #[error("{file}: {detail}; expected {expected}. Check that the file is complete, or export it again")]
    Unreadable {
        /// Name of the file as given to the reader.
        file: String,
        /// What the bytes should have been.
        expected: String,
        /// What is wrong with them.
        detail: String,
    },
    /// The file may be fine, but this version cannot use it: convert it, or export it differently.
    #[error("{file}: {element}: {what} is not supported. {hint}")]
    Unsupported {
        /// Name of the file as given to the reader.
        file: String,
        /// Path of the element inside the file.
        element: String,
        /// The feature.
        what: String,
        /// What to do instead.
        hint: String,
    },
    /// The scene needs another file, which could not be had: put it in place.
    #[error("{file}: {element}: refers to \"{reference}\", which {reason}. {hint}")]
    Reference {
        /// Name of the file that refers.
        file: String,
        /// Path of the element that refers.
        element: String,
        /// The reference as written.
        reference: String,
        /// Why it could not be had.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// One element breaks the rules of the format: the author, or the exporter, must correct it.
    #[error("{file}: {element}: found {found}, expected {expected}. Correct the file, or export it again")]
    Invalid {
        /// Name of the file as given to the reader.
        file: String,
        /// Path of the element inside the file, or its line.
        element: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// The file asks for more than the caller allows: raise the limit if the file is trusted.
    #[error("{file}: {element}: needs {needed}, allowed are {allowed}. If you trust the file, raise Limits::{limit}")]
    OverLimit {
        /// Name of the file as given to the reader.
        file: String,
        /// Path of the element inside the file.
        element: String,
        /// The field of [`Limits`](crate::Limits).
        limit: &'static str,
        /// What the element needs, with its unit.
        needed: String,
        /// What the limit is.
        allowed: u64,
    },
}

impl FormatError {
    pub(crate) fn unreadable(file: &str, expected: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::Unreadable { file: file.to_owned(), expected: expected.into(), detail: detail.into() }
    }

    pub(crate) fn unsupported(file: &str, element: &str, what: impl Into<String>, hint: impl Into<String>) -> Self {
        let (file, element) = (file.to_owned(), element.to_owned());
        Self::Unsupported { file, element, what: what.into(), hint: hint.into() }
    }

    pub(crate) fn invalid(file: &str, element: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        let (file, element) = (file.to_owned(), element.to_owned());
        Self::Invalid { file, element, found: found.into(), expected: expected.into() }
    }

    /// What the message says after the file's name and the element; for turning an error into a warning.
    pub(crate) fn without_place(&self) -> String {
        match self {
            Self::Unreadable { expected, detail, .. } => format!("{detail}; expected {expected}"),
            Self::Unsupported { what, hint, .. } => format!("{what} is not supported. {hint}"),
            Self::Reference { reference, reason, .. } => format!("refers to \"{reference}\", which {reason}"),
            Self::Invalid { found, expected, .. } => format!("found {found}, expected {expected}"),
            Self::OverLimit { needed, allowed, limit, .. } => {
                format!("needs {needed}, allowed are {allowed} (Limits::{limit})")
            }
        }
    }
}
