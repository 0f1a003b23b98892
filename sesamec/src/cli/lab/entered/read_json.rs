//! A filled-in form as JSON, as programs write it.
//!
//! Each value is kept as the text that it is in the file, so that a mistake in it has a place.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use sesame_dsl::similar::most_similar;
use sesame_plan::CampaignPlan;

use super::mistakes::Mistakes;
use super::sheet::{At, Given, HEAD, Row, Sheet, UNMEASURED, conversion, given, metric, quoted};

/// The members of an object, in the order of the file.
struct Members<'t>(Vec<(String, &'t RawValue)>);

impl<'t> Deserialize<'t> for Members<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        struct Each;
        impl<'t> Visitor<'t> for Each {
            type Value = Members<'t>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("an object")
            }

            fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<Members<'t>, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Each)
    }
}

/// A file while it is read.
struct Reader<'r, 't, 'f> {
    text: &'t str,
    plan: &'r CampaignPlan,
    mistakes: &'r mut Mistakes<'f>,
}

/// Reads the text of a file, and tells all that is wrong with it as a form; `None` if it is none at all.
pub(super) fn read(text: &str, plan: &CampaignPlan, mistakes: &mut Mistakes<'_>) -> Option<Sheet> {
    let whole: &RawValue = match serde_json::from_str(text) {
        Ok(whole) => whole,
        Err(error) => {
            let at = mistakes.offset(error.line(), error.column());
            mistakes.say(at, || format!("this is not JSON ({error}); write an object with `tests` and `runs`"));
            return None;
        }
    };
    let mut reader = Reader { text, plan, mistakes };
    if !whole.get().starts_with('{') {
        reader.say(whole, || format!("the file is {}; write an object with `tests` and `runs`", kind(whole)));
        return None;
    }
    let mut sheet = Sheet::default();
    let [tests, campaign, lab, operator, hardware, software, date] = HEAD;
    let names = [tests, campaign, lab, operator, hardware, software, date, "runs"];
    let [head @ .., runs] = reader.members(whole, "the form", names, &["runs"]);
    for (name, text) in HEAD.into_iter().zip(head) {
        let text = text.and_then(|text| reader.text(text, name));
        sheet.head.extend(text.filter(|text| !text.value.is_empty()).map(|text| (name, text)));
    }
    let Some(runs) = runs else { return Some(sheet) };
    match serde_json::from_str::<Vec<&RawValue>>(runs.get()) {
        Ok(runs) => sheet.rows.extend(runs.into_iter().filter_map(|run| reader.run(run))),
        Err(_) => reader.say(runs, || format!("`runs` is {}; write an array of runs", kind(runs))),
    }
    Some(sheet)
}

impl<'t> Reader<'_, 't, '_> {
    /// Where a value begins in the file.
    fn at(&self, value: &RawValue) -> usize {
        value.get().as_ptr().addr() - self.text.as_ptr().addr()
    }

    fn say(&mut self, value: &RawValue, what: impl FnOnce() -> String) {
        let at = self.at(value);
        self.mistakes.say(at, what);
    }

    /// The members of an object by these names; each may be there once, some must, and others must not.
    fn members<const N: usize>(
        &mut self,
        value: &'t RawValue,
        what: &str,
        names: [&str; N],
        needed: &[&str],
    ) -> [Option<&'t RawValue>; N] {
        let mut found = [None; N];
        let Ok(Members(members)) = serde_json::from_str(value.get()) else {
            let listed = names.map(|name| format!("`{name}`")).join(", ");
            self.say(value, || format!("{what} is {}; write an object with {listed}", kind(value)));
            return found;
        };
        for (name, member) in members {
            match names.iter().position(|known| *known == name) {
                Some(at) if found[at].is_none() => found[at] = Some(member),
                Some(_) => self.say(member, || format!("`{name}` is there twice; remove one")),
                None => self.say(member, || match most_similar(&name, names) {
                    Some(meant) => format!("{} is unknown; did you mean `{meant}`?", quoted(&name)),
                    None => format!("{} is unknown; remove it", quoted(&name)),
                }),
            }
        }
        for name in needed {
            if names.iter().zip(&found).any(|(known, member)| known == name && member.is_none()) {
                self.say(value, || format!("{what} has no `{name}`; add it"));
            }
        }
        found
    }

    /// A text; `null` is none.
    fn text(&mut self, value: &RawValue, what: &str) -> Option<At<String>> {
        let Ok(text) = serde_json::from_str::<Option<String>>(value.get()) else {
            self.say(value, || format!("`{what}` is {}; write a text", kind(value)));
            return None;
        };
        Some(At { at: self.at(value), value: text.unwrap_or_default().trim().to_owned() })
    }

    fn run(&mut self, value: &'t RawValue) -> Option<Row> {
        let names = ["test", "run", "outcome", "values"];
        let [test, run, outcome, values] = self.members(value, "this run", names, &names);
        let values = values.and_then(|values| self.values(values));
        let test = test.and_then(|test| self.text(test, "test"));
        let run = run.map(|run| At { at: self.at(run), value: run.get().to_owned() });
        let outcome = outcome.and_then(|outcome| self.text(outcome, "outcome"));
        Some(Row { test: test?, run: run?, outcome: outcome?, values })
    }

    /// What is given for each metric; `None` if these are not values at all.
    fn values(&mut self, value: &'t RawValue) -> Option<Vec<At<Given>>> {
        let Ok(Members(members)) = serde_json::from_str(value.get()) else {
            self.say(value, || format!("`values` is {}; write an object with a member for each metric", kind(value)));
            return None;
        };
        let mut values = vec![At { at: self.at(value), value: Given::Empty }; self.plan.metrics.len()];
        let mut there = vec![false; values.len()];
        for (name, member) in members {
            let at = match metric(self.plan, &name) {
                Ok(at) if !std::mem::replace(&mut there[at], true) => at,
                Ok(_) => {
                    self.say(member, || format!("`{name}` is there twice; remove one"));
                    continue;
                }
                Err(wrong) => {
                    self.say(member, || wrong);
                    continue;
                }
            };
            let value = self.value(at, member);
            values[at] = At { at: self.at(member), value };
        }
        Some(values)
    }

    fn value(&mut self, metric: usize, value: &'t RawValue) -> Given {
        let plan = self.plan;
        let metric = &plan.metrics[metric];
        let (number, unit) = if value.get().starts_with('{') {
            let [number, unit] = self.members(value, "this value", ["value", "unit"], &["value"]);
            let Some(number) = number else { return Given::Mistaken };
            let unit = match unit.map(|unit| self.text(unit, "unit")) {
                Some(None) => return Given::Mistaken,
                unit => unit.flatten().filter(|unit| !unit.value.is_empty()),
            };
            (number, unit)
        } else {
            (value, None)
        };
        let text = match number.get() {
            "null" => return Given::Empty,
            text if text.starts_with('"') => match serde_json::from_str::<String>(text) {
                Ok(word) if word == UNMEASURED => return Given::Unmeasured,
                Ok(word) if word.is_empty() => return Given::Empty,
                _ => {
                    self.say(number, || format!("this is a text; write a number, or \"{UNMEASURED}\""));
                    return Given::Mistaken;
                }
            },
            text if text.starts_with(|first: char| first == '-' || first.is_ascii_digit()) => text,
            _ => {
                self.say(number, || format!("this is {}; write a number, or \"{UNMEASURED}\"", kind(number)));
                return Given::Mistaken;
            }
        };
        let write = match &metric.unit {
            Some(own) => format!("{{ \"value\": {text}, \"unit\": \"{own}\" }}"),
            None => "a number alone".to_owned(),
        };
        let place = unit.as_ref().map_or_else(|| self.at(number), |unit| unit.at);
        let conversion = match conversion(metric, unit.as_ref().map(|unit| unit.value.as_str()), &write) {
            Ok(conversion) => conversion,
            Err(wrong) => {
                self.mistakes.say(place, || wrong);
                return Given::Mistaken;
            }
        };
        given(text, &conversion).unwrap_or_else(|wrong| {
            self.say(number, || wrong);
            Given::Mistaken
        })
    }
}

/// What a value is, with its article.
fn kind(value: &RawValue) -> &'static str {
    match value.get().as_bytes().first() {
        Some(b'{') => "an object",
        Some(b'[') => "an array",
        Some(b'"') => "a text",
        Some(b't' | b'f') => "a truth value",
        Some(b'n') => "null",
        _ => "a number",
    }
}
