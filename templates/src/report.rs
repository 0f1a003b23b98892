//! The shell of a campaign's results page.

/// The page as plain text with placeholders `{{policy}}`, `{{title}}` and `{{body}}`, each filled in with
/// finished markup. Style and script are included, so the page needs no other file.
pub const PAGE: &str = include_str!("../report/page.html");
