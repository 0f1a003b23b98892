//! Nodes of the space.

use std::fmt::Write as _;

use sesame_notation::quoted;
use sesame_scan::System;

use super::grouped_nodes::{Node, WORDS};
use super::named::Named;

/// A block for each node, or group of them.
pub(super) fn nodes(system: &System, named: &Named<'_>) -> String {
    let mut text = String::new();
    for (name, line) in &named.nodes {
        let Some(Node { found, lists }) = line.of.first() else { continue };
        if found.count > 1 {
            _ = writeln!(text, "// decide: {} nodes have this name; give each its own", found.count);
        }
        if found.answers == Some(false) {
            text.push_str("// decide: it does not answer; it may have ended without a word\n");
        }
        // Only nodes of ROS have names of their own.
        let own = if system.is_ros() { format!("{} ", quoted(&line.path)) } else { String::new() };
        _ = writeln!(text, "node {name} {own}{{");
        for (word, listed) in WORDS.iter().zip(*lists) {
            if !listed.is_empty() {
                let listed: Vec<&str> = listed.iter().map(String::as_str).collect();
                _ = writeln!(text, "{word:<10} {}", wrapped(&listed));
            }
        }
        text.push_str("}\n");
    }
    text
}

/// Names with commas between them, on lines that are not too long.
fn wrapped(names: &[&str]) -> String {
    const LONGEST: usize = 90;
    let (mut text, mut line) = (String::new(), 0);
    for name in names {
        let between = match line {
            0 => "",
            _ if line + name.len() > LONGEST => {
                line = 0;
                ",\n"
            }
            _ => ", ",
        };
        _ = write!(text, "{between}{name}");
        line += name.len() + 2;
    }
    text
}
