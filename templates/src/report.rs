//! The shell of a campaign's results page.

/// The page as plain text with placeholders `{{policy}}`, `{{title}}` and `{{body}}`, each filled in with
/// finished markup. Style and script are inside, so the page needs nothing but itself.
pub const PAGE: &str = include_str!("../report/page.html");
