//! Text from diagnostics.
