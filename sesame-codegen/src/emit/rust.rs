//! Formatting of generated Rust: doc comments, headers and notes at the end of a line.

use proc_macro2::TokenStream;
use quote::quote;

/// Doc comments of an item, one attribute for each line. Control characters would end the comment and become blanks.
pub(super) fn docs(lines: impl IntoIterator<Item = impl AsRef<str>>) -> TokenStream {
    doc_lines(lines).map(|line| quote! { #[doc = #line] }).collect()
}

/// Doc comments at the beginning of a module.
pub(super) fn module_docs(lines: impl IntoIterator<Item = impl AsRef<str>>) -> TokenStream {
    doc_lines(lines).map(|line| quote! { #![doc = #line] }).collect()
}

fn doc_lines(lines: impl IntoIterator<Item = impl AsRef<str>>) -> impl Iterator<Item = String> {
    lines.into_iter().map(|line| {
        let line = one_line(line.as_ref());
        if line.is_empty() { line } else { format!(" {line}") }
    })
}

/// Text that stays on its line in any kind of file, and reads there as it is.
pub(super) fn one_line(text: &str) -> String {
    let plain = |c: char| if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') { ' ' } else { c };
    turning_escaped(&text.chars().map(plain).collect::<String>()).trim_end().to_owned()
}

/// With the signs that change the direction of what follows written as `\u{202e}`: rustc refuses them even in comments.
fn turning_escaped(text: &str) -> String {
    let turning = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if !text.contains(turning) {
        return text.to_owned();
    }
    let escaped = |c: char| if turning(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect()
}

/// Text that is said as it is where rustc takes a format, as in `#[diagnostic::on_unimplemented]`.
pub(super) fn as_format(text: &str) -> String {
    text.replace('{', "{{").replace('}', "}}")
}

/// A generated file: its header, then its items as prettyplease sets them. That it parses is an invariant of this
/// crate, for any names in the space.
pub(super) fn file(header: &str, items: TokenStream) -> String {
    let file = syn::parse2(items).expect("generated Rust parses, since every name and text goes through quote");
    // In comments they are escaped already, and in a literal the escape means the same sign.
    turning_escaped(&format!("{header}\n{}", prettyplease::unparse(&file)))
}

/// Adds a comment at the end of each line that starts with one of these beginnings. rustc shows the whole line when
/// something is wrong there, so the comment names the place in the `.sesame` file.
pub(super) fn note_lines(source: &str, notes: &[(String, String)]) -> String {
    let mut noted = String::with_capacity(source.len());
    for line in source.lines() {
        noted.push_str(line);
        if let Some((_, note)) = notes.iter().find(|(start, _)| line.starts_with(start.as_str())) {
            noted.push_str(" // ");
            noted.push_str(&one_line(note));
        }
        noted.push('\n');
    }
    noted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_doc_comment_ends_early() {
        let docs = docs(["a */ b", "c \r\n fn evil() {}", "d \u{2028} e", "f \u{202e}g", ""]);
        let text = file("// header", quote! { #docs pub struct A; const B: &str = "b\u{2066}"; });
        insta::assert_snapshot!(text, @r#"
        // header
        /// a */ b
        /// c    fn evil() {}
        /// d   e
        /// f \u{202e}g
        ///
        pub struct A;
        const B: &str = "b\u{2066}";
        "#);
    }
}
