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

/// The most bytes that a message may have.
pub(crate) const LARGEST: usize = 1 << 28;

/// A message that cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    /// It ends too early.
    #[error("{}it ends after {length} bytes, where {needed} more are needed", inside(path))]
    Short {
        /// Where in the message.
        path: String,
        /// How long the message is.
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
    /// An array has more elements than can be.
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
    pub(super) fn inside(mut self, field: &str) -> Self {
        if let CodecError::Short { path, .. } | CodecError::TooLarge { path, .. } | CodecError::Unbounded { path, .. } =
            &mut self
        {
            let dot = if path.is_empty() || path.starts_with('[') { "" } else { "." };
            *path = format!("{field}{dot}{path}");
        }
        self
    }

    /// The same error inside an element of an array.
    pub(super) fn element(self, at: usize) -> Self {
        self.inside(&format!("[{at}]"))
    }
}

fn inside(path: &str) -> String {
    if path.is_empty() { String::new() } else { format!("field `{path}`: ") }
}
