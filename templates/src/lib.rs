//! Texts that SESAME writes for people, as templates.

pub mod report;
