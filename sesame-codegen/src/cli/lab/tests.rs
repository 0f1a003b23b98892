//! Forms are printed, filled in, and taken or refused.
