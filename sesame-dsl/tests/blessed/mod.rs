//! Models as their snapshots show them: in few lines, with names where the model has positions, and without what the
//! plainest model has as well.
//!
//! That one is the model of `good/base.sesame`, which has each kind of declaration in its plainest form, most of them
//! twice; its own snapshot lists what is ordinary. So a new field of the model changes that snapshot, and those of
//! files that say more about the field. What only systems of ROS have is in `good/base_of_ros.sesame`.
//! `sesame_plan::testing::compact` has the rules.

use std::collections::BTreeMap;

use sesame_dsl::model::Space;
use sesame_plan::testing::compact::Tree;

/// A model's debug text as a tree.
pub(crate) fn tree(model: &Space) -> Tree {
    Tree::read(&format!("{model:?}"))
}

/// A model without spans and scales, whose numbers nobody can check by eye, and without the types of ids.
pub(crate) fn without_places(model: Tree) -> Tree {
    model.map(&|part| match part {
        Tree::Struct { kind, head, mut fields } => {
            fields.retain(|(name, value)| !is_place(name, value));
            Tree::Struct { kind, head, fields }
        }
        other => other,
    })
}

fn is_place(name: &str, value: &Tree) -> bool {
    match value {
        Tree::Struct { kind, .. } => {
            [("span", "Span"), ("dimension", "Dimension"), ("scale", "Scale")].contains(&(name, kind))
        }
        Tree::Scalar(text) => text.starts_with("PhantomData"),
        _ => false,
    }
}

/// A model as a snapshot shows it: without [places](without_places); with its declarations as `Topic link@3`, which is
/// in line 3; with ids as names, arenas as lists, and units as they are written.
pub(crate) fn readable(model: Tree) -> Tree {
    let names = names(&model);
    without_places(model).map(&|part| match part {
        Tree::Struct { kind, fields, .. } => with_words(kind, fields),
        Tree::Tuple(id, of) => match (names.get(&id), of.as_slice()) {
            (Some(names), [position]) => match name_at(names, position) {
                Some(name) => Tree::Scalar(name),
                None => Tree::Tuple(id, of),
            },
            _ => Tree::Tuple(id, of),
        },
        other => other,
    })
}

/// The names of what is declared, by the type of its ids and in the order of these.
fn names(model: &Tree) -> BTreeMap<String, Vec<String>> {
    let mut found = BTreeMap::new();
    model.each_struct(&mut |_, part| {
        let (Tree::Struct { kind, .. }, Some(Tree::List(items))) = (part, part.field("items")) else { return };
        let name = |item: &Tree| item.field("declaration")?.field("name")?.scalar().and_then(unquoted);
        if let (true, Some(Tree::Struct { kind, .. })) = (kind == "Arena", items.first()) {
            found.insert(format!("{kind}Id"), items.iter().map(|item| name(item).unwrap_or_default()).collect());
        }
    });
    found
}

/// The name at a position, if no other has it.
fn name_at(names: &[String], position: &Tree) -> Option<String> {
    let name = names.get(position.scalar()?.parse::<usize>().ok()?)?;
    let alone = names.iter().filter(|other| *other == name).count() == 1;
    (alone && !name.is_empty()).then(|| name.clone())
}

/// A struct in better words than those of its debug text, where there are some.
fn with_words(kind: String, mut fields: Vec<(String, Tree)>) -> Tree {
    match (kind.as_str(), fields.as_slice()) {
        ("Arena", [(name, items)]) if name == "items" => return items.clone(),
        ("Unit", [(name, text)]) if name == "text" => {
            if let Some(unit) = text.scalar().and_then(unquoted) {
                return Tree::Scalar(unit);
            }
        }
        _ => {}
    }
    let mut head = kind.clone();
    let declaration = fields.iter().position(|(name, _)| name == "declaration").unwrap_or(fields.len());
    if let Some((_, Tree::Struct { kind: of, fields: declared, .. })) = fields.get(declaration)
        && let ("Declaration", [(_, name), (_, line), others @ ..]) = (of.as_str(), declared.as_slice())
        && let (Some(name), Some(line)) = (name.scalar().and_then(unquoted), line.scalar())
    {
        head = format!("{kind} {name}@{line}");
        let others = others.to_vec();
        fields.splice(declaration..=declaration, others);
    }
    Tree::Struct { kind, head, fields }
}

/// A text without its quotes, if that can be read as easily.
fn unquoted(text: &str) -> Option<String> {
    let text = text.strip_prefix('"')?.strip_suffix('"')?;
    let plain = |character: char| !character.is_whitespace() && !"(){}[],:@\"\\".contains(character);
    (!text.is_empty() && text.chars().all(plain)).then(|| text.to_owned())
}
