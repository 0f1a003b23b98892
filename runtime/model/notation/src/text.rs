//! Texts in quotes, documentation comments, and names.

/// A text in quotes. It reads back as it was if it is on one line and has a character that is not white space.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Texts to choose from: `one of "a", "b"`.
pub(crate) fn one_of(texts: &[String]) -> String {
    format!("one of {}", list(texts))
}

/// Texts in quotes, with commas between them.
pub(crate) fn list(texts: &[String]) -> String {
    texts.iter().map(|text| quoted(text)).collect::<Vec<_>>().join(", ")
}

/// A documentation comment: a line for each line of the text, and none for an empty text.
pub fn doc_comment(text: &str) -> String {
    let lines = text.lines().map(|line| format!("{}\n", format!("/// {line}").trim_end()));
    lines.collect()
}

/// A declaration with a block: its documentation, its first line, and a line for each member.
pub(crate) fn block(doc: &str, head: &str, members: impl IntoIterator<Item = String>) -> String {
    let members = members.into_iter().map(|member| format!("  {member}\n"));
    format!("{}{head} {{\n{}}}\n", doc_comment(doc), members.collect::<String>())
}

/// Whether something has the form of a name. That it is not a word of the language is for the language to say.
pub fn is_name(text: &str) -> bool {
    let mut characters = text.chars();
    characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_and_backslashes_are_escaped() {
        assert_eq!(quoted(r#"a "b" \ c"#), r#""a \"b\" \\ c""#);
    }

    #[test]
    fn an_empty_line_of_documentation_has_no_space_at_its_end() {
        assert_eq!(doc_comment("Of two\n\nparagraphs."), "/// Of two\n///\n/// paragraphs.\n");
        assert_eq!(block("", "test t", ["a".to_owned()]), "test t {\n  a\n}\n");
    }
}
