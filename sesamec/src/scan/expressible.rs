//! What a space can say of what was found; everything else becomes a comment.

use std::collections::BTreeSet;

use sesame_dsl::diagnostic::visible_lines;
use sesame_notation::quoted;
use sesame_scan::{CLOCK, Facts, FoundAction, FoundService, FoundTopic, System, TypeSource};

use super::comments::LeftOut;
use super::origin::Origin;
use super::types::Types;

/// Topics that the space can have.
pub(super) fn topics<'a>(
    facts: &'a Facts,
    types: &Types,
    origin: Origin<'_>,
    clock: Option<&str>,
    left_out: &mut LeftOut,
) -> Vec<&'a FoundTopic> {
    let (mut paths, mut expressible) = (BTreeSet::new(), Vec::new());
    for topic in &facts.topics {
        let path = quoted(&topic.path);
        let ty = topic.ty.as_deref();
        let what = ty.map_or_else(|| path.clone(), |ty| format!("{path} of type {}", quoted(ty)));
        if ty == Some(CLOCK) && clock == Some(topic.path.as_str()) {
            continue;
        }
        if !is_path(&facts.system, &topic.path) {
            left_out.decide(&if facts.system.is_ros() {
                format!("topic {what} has no name of ROS")
            } else {
                format!("topic {what} has a name that a space cannot say")
            });
        } else if let Some(problem) = topic.problem.as_deref().or(ty.and_then(|ty| types.problem(ty))) {
            left_out.decide(&format!("topic {what} cannot be used: {problem}"));
        } else if let Some(ty) = ty {
            if types.is_plain(ty) || types.source(ty) != TypeSource::Unknown {
                if paths.insert(topic.path.as_str()) {
                    expressible.push(topic);
                } else {
                    left_out.decide(&format!("topic {what} is used with another type as well"));
                }
            } else {
                let nobody = match facts.system {
                    System::Ros1 { .. } => "no publisher said what it is",
                    System::Rosbridge { .. } => "no message of it came",
                    _ => "no node described it",
                };
                let add =
                    if origin.folders.is_empty() { "name one with `types`" } else { "name another one with `types`" };
                left_out.decide(&format!("no folder has the type of topic {what}, and {nobody}; {add}"));
            }
        } else {
            left_out.decide(&format!("nobody said the type of topic {what}"));
        }
    }
    expressible
}

/// Services that the space can have.
pub(super) fn services<'a>(facts: &'a Facts, origin: Origin<'_>, left_out: &mut LeftOut) -> Vec<&'a FoundService> {
    let (mut paths, mut expressible) = (BTreeSet::new(), Vec::new());
    for service in &facts.services {
        let path = quoted(&service.path);
        let Some(ty) = &service.ty else {
            left_out.decide(&format!("nobody said the type of service {path}"));
            continue;
        };
        let what = format!("{path} of type {}", quoted(ty));
        if !is_ros_name(&service.path) {
            left_out.decide(&format!("service {what} has no name of ROS"));
        } else if !origin.services.contains(ty) {
            left_out.decide(&format!("no folder has the type of service {what}"));
        } else if !paths.insert(service.path.as_str()) {
            left_out.decide(&format!("service {what} is used with another type as well"));
        } else {
            expressible.push(service);
        }
    }
    expressible
}

/// Actions that the space can have.
pub(super) fn actions<'a>(facts: &'a Facts, origin: Origin<'_>, left_out: &mut LeftOut) -> Vec<&'a FoundAction> {
    let mut expressible = Vec::new();
    for action in &facts.actions {
        let path = quoted(&action.path);
        let what = format!("{path} of type {}", quoted(&action.ty));
        if action.ty.is_empty() {
            left_out.decide(&format!("nobody said the type of action {path}"));
        } else if !is_ros_name(&action.path) {
            left_out.decide(&format!("action {what} has no name of ROS"));
        } else if !origin.services.contains(&action.ty) {
            left_out.decide(&format!("no folder has the type of action {what}"));
        } else {
            expressible.push(action);
        }
    }
    expressible
}

/// Whether this can be the path of a topic.
fn is_path(system: &System, path: &str) -> bool {
    const LONGEST: usize = 500;
    if system.is_ros() {
        return is_ros_name(path);
    }
    // A brace begins a group, and what is not visible is not text of a space.
    let unsayable = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '{' | '}');
    !path.is_empty() && path.len() <= LONGEST && !path.contains(unsayable) && visible_lines(path) == path
}

/// Whether this can be the name of a topic, a service or a node of ROS, with its `/` at the beginning.
pub(super) fn is_ros_name(path: &str) -> bool {
    const LONGEST: usize = 247;
    let Some(relative) = path.strip_prefix('/') else { return false };
    let fits = |part: &str| {
        !part.is_empty()
            && !part.starts_with(|first: char| first.is_ascii_digit())
            && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
    };
    relative.len() <= LONGEST && relative.split('/').all(fits)
}
