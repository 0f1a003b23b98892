//! Placeholders in the arguments of launched programs.

use super::Resolver;
use super::words::list;
use crate::diagnostic::{Code, Diagnostic};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::Text;

/// What a worker has of its own.
const KNOWN: [&str; 6] = ["worker", "domain", "port", "folder", "seed", "ros-args"];

/// These, and what a member of a group of nodes has of its own.
const OF_MEMBERS: [&str; 7] = ["member", "worker", "domain", "port", "folder", "seed", "ros-args"];

/// What a text is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// An argument of a program.
    Argument,
    /// An argument of a program that is started for each member of a group of nodes.
    ArgumentOfMember,
    /// The number of a port.
    Port,
}

impl Resolver<'_> {
    /// Reports placeholders that are not replaced; returns whether there is none of them.
    pub(super) fn placeholders(&mut self, text: &Text, purpose: Purpose) -> bool {
        let permitted = match purpose {
            Purpose::Argument => &KNOWN[..],
            Purpose::ArgumentOfMember => &OF_MEMBERS[..],
            Purpose::Port => &["worker", "port"],
        };
        let mut sound = true;
        for word in words(&text.text) {
            let span = self.inside_of(text, word);
            if !permitted.contains(&word) {
                let title = format!("there is no placeholder `{{{word}}}`");
                let mut diagnostic = Diagnostic::new(Code::PLACEHOLDER, span, title).label("unknown placeholder");
                diagnostic = if word == "member" {
                    diagnostic.note("only a node that is a group, such as `\"/{r1,r2}/vehicle\"`, has members")
                } else if let Some(similar) = most_similar(word, permitted.iter().copied()) {
                    diagnostic.did_you_mean(span, format!("{{{similar}}}"))
                } else {
                    let braced: Vec<String> = permitted.iter().map(|word| format!("{{{word}}}")).collect();
                    let braced: Vec<&str> = braced.iter().map(String::as_str).collect();
                    diagnostic.note(format!("the placeholders are {}", list(&braced)))
                };
                self.report(diagnostic);
                sound = false;
            } else if word == "ros-args" && text.text != "{ros-args}" {
                let diagnostic = Diagnostic::new(Code::PLACEHOLDER, span, "`{ros-args}` is not an argument of its own")
                    .label("it stands for several arguments")
                    .note("write it as a text of its own: `\"{ros-args}\"`");
                self.report(diagnostic);
                sound = false;
            } else if let Some((what, whose, (kind, simulator))) = self.lacking(word) {
                let title = format!("simulator kind `{kind}` has no {what}");
                let diagnostic = Diagnostic::new(Code::PLACEHOLDER, span, title)
                    .label(format!("only a simulator of {whose} has this placeholder"))
                    .secondary(simulator, "the simulator is declared here");
                self.report(diagnostic);
                sound = false;
            }
        }
        sound
    }

    /// What a placeholder stands for, of which systems, and the simulator that has none of it.
    fn lacking(&self, word: &str) -> Option<(&'static str, &'static str, (&'static str, Span))> {
        match word {
            "ros-args" => Some(("remappings", "ROS", self.other_than_ros()?)),
            "domain" => Some(("domains", "ROS 2", self.other_than_ros_2()?)),
            _ => None,
        }
    }

    /// Where a part of a text stands, with its braces; the whole text if escapes move it.
    fn inside_of(&self, text: &Text, word: &str) -> Span {
        let braced = format!("{{{word}}}");
        let found = self.text(text.span).find(&braced).and_then(|at| u32::try_from(at).ok());
        match (found, u32::try_from(braced.len())) {
            (Some(at), Ok(length)) => Span { lo: text.span.lo + at, hi: text.span.lo + at + length, ..text.span },
            _ => text.span,
        }
    }
}

/// The words in braces that are made of letters and hyphens: other braces are the program's own.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let parts = text.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(word, _)| word);
    parts.filter(|word| {
        word.starts_with(|first: char| first.is_ascii_alphabetic())
            && word.bytes().all(|byte| byte.is_ascii_alphabetic() || byte == b'-')
    })
}

#[cfg(test)]
mod tests {
    use super::words;

    #[test]
    fn braces_of_the_program_s_own_are_no_placeholders() {
        let text = r#"{"a": 1} {worker} ${HOME}x{ros-args}{} {2} {a b} {{seed}} {open"#;
        assert_eq!(words(text).collect::<Vec<_>>(), ["worker", "HOME", "ros-args", "seed"]);
    }
}
