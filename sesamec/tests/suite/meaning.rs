//! What a file says to people only does not change what its campaigns mean.

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use serde_json::Value;

use sesame_dsl::source::SourceMap;
use sesame_plan::CampaignPlan;

use crate::notation::{Shown, everything, plans};

/// The plans of all campaigns of a file; none of a file that imports others.
fn plans_of(name: &str, text: &str) -> Vec<CampaignPlan> {
    let mut sources = SourceMap::new();
    let file = sources.add(name, text);
    let Some(space) = sesame_dsl::analyse(&sources, file).model else { return Vec::new() };
    let campaigns = space.campaigns.iter();
    campaigns.map(|(campaign, _)| sesame_codegen::lower::lower(&space, campaign, name, "sesamec 0.0.0").plan).collect()
}

/// Spaces of the tests of the language, and those of the examples.
fn spaces() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let within = |folder: PathBuf| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect::<Vec<_>>();
    let examples = within(root.join("examples")).into_iter().filter(|path| path.is_dir()).flat_map(within);
    let mut found: Vec<PathBuf> = examples.chain(within(root.join("sesame-dsl/tests/good"))).collect();
    found.retain(|path| path.extension().is_some_and(|ending| ending == "sesame"));
    found.sort();
    found
}

/// The text with a comment at its top, and with other words in doc comments and in the sentences of requirements.
fn described_anew(text: &str) -> String {
    let mut again = "// A remark at the top,\n// of two lines.\n".to_owned();
    for line in text.lines() {
        let begins = line.trim_start();
        let mut line = line.to_owned();
        if begins.starts_with("///") {
            line.push_str(" Corrected.");
        } else if begins.starts_with("requirement ")
            && let Some((name, sentence)) = line.split_once('"')
        {
            line = format!("{name}\"Corrected: {sentence}");
        }
        again.push_str(&line);
        again.push('\n');
    }
    again
}

#[test]
fn comments_and_sentences_and_the_name_of_the_file_do_not_change_a_meaning() {
    let (mut campaigns, mut described) = (0, 0);
    for path in spaces() {
        let text = fs::read_to_string(&path).unwrap();
        let [before, after] = [plans_of("a.sesame", &text), plans_of("b.sesame", &described_anew(&text))];
        assert_eq!(before.len(), after.len(), "{}", path.display());
        for (before, after) in before.iter().zip(&after) {
            assert_eq!(before.meaning(), after.meaning(), "{}", path.display());
            assert!(before.same_model(after), "{}", path.display());
            campaigns += 1;
            let texts = |plan: &CampaignPlan| {
                plan.requirements.iter().map(|requirement| requirement.text.clone()).collect::<Vec<_>>()
            };
            described += usize::from(texts(before) != texts(after) && before.doc != after.doc);
        }
    }
    assert!(campaigns > 20 && described > 5, "{campaigns} campaigns, {described} of them described anew");
}

/// Where each number, text and truth value of this value is.
fn leaves(at: &str, value: &Value) -> Vec<String> {
    let below: Vec<(String, &Value)> = match value {
        Value::Object(of) => of.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(of) => of.iter().enumerate().map(|(key, value)| (key.to_string(), value)).collect(),
        _ => return vec![at.to_owned()],
    };
    below.into_iter().flat_map(|(key, value)| leaves(&format!("{at}/{key}"), value)).collect()
}

/// Whether what is there in a plan is only for people.
fn is_for_people(pointer: &str) -> bool {
    let of_requirement = pointer.starts_with("/requirements/") && pointer.ends_with("/text");
    let names = pointer.starts_with("/topics/") && pointer.contains("/members/");
    let places = pointer.ends_with("/doc") || pointer.ends_with("/line");
    of_requirement || names || places || ["/generator", "/source"].contains(&pointer)
}

#[test]
fn any_other_change_of_a_plan_changes_its_meaning() {
    let (_, like) = everything();
    let cases = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) };
    let changes = prop::collection::vec(any::<prop::sample::Index>(), 40);
    let outcome = TestRunner::new(cases).run(&(plans(&like), changes), |(Shown(plan), changes)| {
        let json = serde_json::to_value(&plan).unwrap();
        let leaves = leaves("", &json);
        for at in changes {
            let pointer = at.get(&leaves);
            let mut changed = json.clone();
            let leaf = changed.pointer_mut(pointer).expect("it is there");
            *leaf = match &*leaf {
                Value::String(text) => Value::from(format!("{text} once more")),
                Value::Bool(truth) => Value::from(!truth),
                Value::Number(number) => match number.as_i64() {
                    Some(whole) => Value::from(whole.wrapping_add(1)),
                    None => Value::from(number.as_f64().unwrap_or_default().next_up()),
                },
                _ => Value::from(1),
            };
            // Words of which there are only a few, and numbers of things that are not there.
            let Ok(changed) = serde_json::from_value::<CampaignPlan>(changed) else { continue };
            let same = changed.meaning() == plan.meaning();
            if same != is_for_people(pointer) {
                return Err(TestCaseError::fail(format!("{pointer}: same meaning: {same}")));
            }
            prop_assert!(!same || changed.same_model(&plan));
        }
        Ok(())
    });
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
}
