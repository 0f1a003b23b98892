//! Reports as HTML: the page, and its parts.

mod all_tests;
mod before_after;
mod cells;
pub(super) mod certificate;
mod command;
mod figures;
mod front;
mod generations;
mod header;
mod legend;
mod monitors;
mod page;
mod pairs;
mod policy;
mod published;
mod regions;
mod scatter;
mod shrinking;
mod test;
mod timeline;
mod tree;

pub use figures::figures;
pub use page::{page, write_page, write_page_against, write_page_with};
pub(crate) use policy::policy;
