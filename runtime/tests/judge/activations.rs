//! When operations are active, by the words of the documentation.
