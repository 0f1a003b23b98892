//! Placeholders in the arguments of launched programs: what a worker has of its own, and scenes, which tests choose.

use super::words::list;
use super::{Kind, Resolver};
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

impl<'a> Resolver<'a> {
    /// Reports placeholders that nothing replaces, and returns whether there are none. Notes the scenes in the text.
    pub(super) fn placeholders(&mut self, text: &Text, purpose: Purpose) -> bool {
        let permitted = match purpose {
            Purpose::Argument => &KNOWN[..],
            Purpose::ArgumentOfMember => &OF_MEMBERS[..],
            Purpose::Port => &["worker", "port"],
        };
        let mut sound = true;
        for (word, place) in text.placeholders() {
            // With its braces.
            let span = place.map_or(text.span, |Span { file, lo, hi }| Span { file, lo: lo - 1, hi: hi + 1 });
            let scene = self.scene_named(word).filter(|_| purpose != Purpose::Port);
            if let (Some((declared, _)), true) = (scene, permitted.contains(&word)) {
                let title = format!("`{{{word}}}` could be the parameter `{word}` or what the worker has of its own");
                let diagnostic = Diagnostic::new(Code::PLACEHOLDER, span, title)
                    .label("two values have this name")
                    .secondary(declared, "the parameter is declared here")
                    .note(format!("rename the parameter, for example `start_{word}`"));
                self.report(diagnostic);
                sound = false;
            } else if scene.is_some() {
                self.in_arguments.entry(word.to_owned()).or_insert(span);
            } else if !permitted.contains(&word) {
                // An import that failed may have declared it.
                if !self.file.incomplete && !self.silent.contains(word) {
                    let diagnostic = self.no_placeholder(word, span, permitted, purpose);
                    self.report(diagnostic);
                }
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

    /// What to say of a word in braces that nothing replaces.
    fn no_placeholder(&self, word: &str, span: Span, permitted: &[&'a str], purpose: Purpose) -> Diagnostic {
        let title = format!("there is no placeholder `{{{word}}}`");
        let diagnostic = Diagnostic::new(Code::PLACEHOLDER, span, title).label("unknown placeholder");
        if word == "member" {
            return diagnostic.note("only a node that is a group, such as `\"/{r1,r2}/vehicle\"`, has members");
        }
        let operation = self.names.get(word).filter(|definition| definition.kind == Kind::Operation);
        if let (Some(operation), true) = (operation, purpose != Purpose::Port) {
            return diagnostic
                .secondary(operation.span, "this operation has no value before the start of a run")
                .note("of what tests choose, only a `parameter` of the space is given to launched programs");
        }
        let mut known = permitted.to_vec();
        if purpose != Purpose::Port {
            let operations = self.names_of(Kind::Operation).into_iter();
            known.extend(operations.filter(|name| self.scene_named(name).is_some() && !permitted.contains(name)));
        }
        if let Some(similar) = most_similar(word, known.iter().copied()) {
            return diagnostic.did_you_mean(span, format!("{{{similar}}}"));
        }
        let braced: Vec<String> = known.iter().map(|word| format!("{{{word}}}")).collect();
        let braced: Vec<&str> = braced.iter().map(String::as_str).collect();
        diagnostic.note(format!("the placeholders are {}", list(&braced)))
    }

    /// What a placeholder stands for, of which systems, and the simulator that has none of it.
    fn lacking(&self, word: &str) -> Option<(&'static str, &'static str, (&'static str, Span))> {
        match word {
            "ros-args" => Some(("remappings", "ROS", self.other_than_ros()?)),
            "domain" => Some(("domains", "ROS 2", self.other_than_ros_2()?)),
            _ => None,
        }
    }
}
