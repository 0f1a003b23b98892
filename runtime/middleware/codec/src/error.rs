//! What is wrong with layouts and messages, in words for the user.

/// A layout that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// An interface is not there, or comes only after the one that contains it.
    #[error("there is no interface `{name}`")]
    Missing {
        /// Its name.
        name: String,
    },
    /// Its arrays alone are larger than any message can be.
    #[error("interface `{name}` is larger than {LARGEST} bytes")]
    TooLarge {
        /// Its name.
        name: String,
    },
    /// ROS 1 has no such type.
    #[error("field `{field}` of interface `{name}` is a `wstring`, which ROS 1 does not have")]
    Wide {
        /// The name of the interface.
        name: String,
        /// The field.
        field: String,
    },
}

/// The most bytes that a message without elements in its sequences may have.
pub const LARGEST: usize = 1 << 28;

/// A message that cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    /// Its encoding is none that CDR has here.
    #[error("it is encoded as {0:02x} {1:02x}, not as plain CDR (00 00 or 00 01)")]
    Encoding(u8, u8),
    /// It ends too early.
    #[error("{}it ends after {length} bytes, where {needed} more are needed", inside(path))]
    Short {
        /// Where in the message.
        path: String,
        /// How long the message is, without its header.
        length: usize,
        /// How many bytes are missing.
        needed: usize,
    },
    /// It does not end where its last field does.
    #[error("{surplus} bytes follow its last field")]
    Long {
        /// How many.
        surplus: usize,
    },
    /// A number does not fit.
    #[error("{}{number} is too large for a whole number of 64 bits with a sign", inside(path))]
    TooLarge {
        /// Where in the message.
        path: String,
        /// The number.
        number: u64,
    },
    /// A sequence has more elements than it may.
    #[error("{}{length} elements are more than the {bound} that it may have", inside(path))]
    Unbounded {
        /// Where in the message.
        path: String,
        /// How many it has.
        length: usize,
        /// How many it may have.
        bound: usize,
    },
    /// What is to be written is not a message.
    #[error("it is not a message but {0}")]
    NoMessage(&'static str),
}

impl CodecError {
    /// The same error inside a field.
    pub(crate) fn inside(mut self, field: &str) -> Self {
        if let CodecError::Short { path, .. } | CodecError::TooLarge { path, .. } | CodecError::Unbounded { path, .. } =
            &mut self
        {
            let dot = if path.is_empty() || path.starts_with('[') { "" } else { "." };
            *path = format!("{field}{dot}{path}");
        }
        self
    }

    /// The same error inside an element of an array.
    pub(crate) fn element(self, at: usize) -> Self {
        self.inside(&format!("[{at}]"))
    }
}

fn inside(path: &str) -> String {
    if path.is_empty() { String::new() } else { format!("field `{path}`: ") }
}
