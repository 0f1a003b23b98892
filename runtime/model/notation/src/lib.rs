//! A plan as text of the SESAME language.
//!
//! What is written here, the front end of the language reads back as the same plan: the same names, and every number
//! bit for bit, in the unit that the plan has it in. Commands that show or export parts of a plan, and those that
//! translate other files into the language, decide what to write; how it is written is decided here.
//!
//! Conditions are read here too, since results keep them as text.

mod campaign;
pub mod condition;
mod monitor;
mod number;
mod operation;
mod test;
mod text;
mod unit;

pub use campaign::{
    Clause, campaign, campaign_block, coverage_clause, end_clause, exploration_clause, operations_clause,
    repeat_clause, search_clause,
};
pub use monitor::{evidence, mitigation};
pub use operation::{Clauses, constraint, custom_domain, integer_constraint, operation, resource};
pub use test::{
    activation, activation_named, expectation, expected_requirement, messages, simulator_seed, test_block, test_member,
    test_operation,
};
pub use text::{doc_comment, is_name, quoted};
pub use unit::Unit;
