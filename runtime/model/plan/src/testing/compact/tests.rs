use std::collections::{BTreeMap, BTreeSet};

use super::*;

#[expect(dead_code, reason = "only their debug text is read")]
#[derive(Debug, Clone)]
struct Plant {
    name: &'static str,
    parts: Vec<Part>,
    limits: Limits,
    spare: Option<Part>,
    places: BTreeMap<Id, &'static str>,
}

#[expect(dead_code, reason = "only their debug text is read")]
#[derive(Debug, Clone)]
struct Part {
    name: &'static str,
    weight: f64,
    timed: bool,
    state: State,
    note: Option<&'static str>,
    limits: Limits,
    #[expect(clippy::option_option, reason = "it is to be printed so that all cases differ")]
    twice: Option<Option<u8>>,
}

#[expect(dead_code, reason = "only their debug text is read")]
#[derive(Debug, Clone)]
struct Limits {
    low: f64,
    seed: u64,
}

#[expect(dead_code, reason = "only their debug text is read")]
#[derive(Debug, Clone)]
enum State {
    Idle,
    Moving { speed: f64, limits: Limits },
    Held(Held, (u8, u8)),
    Limits(Limits),
}

#[expect(dead_code, reason = "only their debug text is read")]
#[derive(Debug, Clone)]
struct Held {
    by: Vec<Id>,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Id(u8);

fn limits(low: f64) -> Limits {
    Limits { low, seed: 1 }
}

fn part(name: &'static str, weight: f64) -> Part {
    Part { name, weight, timed: true, state: State::Idle, note: None, limits: limits(weight), twice: None }
}

fn plant(parts: Vec<Part>) -> Plant {
    Plant { name: "plant", parts, limits: limits(0.0), spare: None, places: BTreeMap::from([(Id(0), "here")]) }
}

fn tree(plant: &Plant) -> Tree {
    Tree::read(&format!("{plant:?}"))
}

fn base() -> Base {
    Base::of(&[tree(&plant(vec![part("a", 1.0), part("b", 2.0)]))])
}

/// Parts with values of all kinds that are not ordinary.
fn unusual() -> Plant {
    let moving = State::Moving { speed: -0.5, limits: limits(0.0) };
    let held = State::Held(Held { by: vec![Id(3), Id(4)] }, (1, 2));
    let parts = vec![
        part("c", 1.0),
        Part { timed: false, state: moving, note: Some("None"), twice: Some(None), ..part("d", f64::INFINITY) },
        Part { state: held, note: Some("a \"b\", {c}\\"), twice: Some(Some(3)), ..part("e", f64::NAN) },
        Part { state: State::Limits(Limits { low: 3.0, seed: 9 }), ..part("f", 1e-9) },
    ];
    Plant { spare: Some(part("g", 1.0)), ..plant(parts) }
}

#[test]
fn what_all_parts_of_the_base_have_is_left_out() {
    assert_eq!(
        base().compact(&tree(&unusual())),
        r#"Plant {
  name: "plant"
  parts: [
    Part { name: "c", weight: 1.0, limits: Limits { low: 1.0 } }
    Part {
      name: "d"
      weight: inf
      timed: false
      state: Moving { speed: -0.5, limits: Limits { low: 0.0 } }
      note: "None"
      limits: Limits { low: inf }
      twice: Some(None)
    }
    Part {
      name: "e"
      weight: NaN
      state: Held(Held { by: [Id(3), Id(4)] }, (1, 2))
      note: "a \"b\", {c}\\"
      limits: Limits { low: NaN }
      twice: Some(3)
    }
    Part { name: "f", weight: 1e-9, state: Limits { low: 3.0, seed: 9 }, limits: Limits { low: 1e-9 } }
  ]
  limits: Limits { low: 0.0 }
  spare: Part { name: "g", weight: 1.0, limits: Limits { low: 1.0 } }
  places: { Id(0): "here" }
}
"#
    );
}

#[test]
fn what_is_ordinary_is_in_the_snapshot_of_the_base() {
    let more = Base::of(&[tree(&plant(vec![part("a", 1.0), part("b", 2.0)])), tree(&unusual())]);
    assert_eq!(more.ordinary(&base()), "Held { by: [] }\nMoving { limits: Limits }\n");
    assert_eq!(
        base().ordinary(&Base::default()),
        "Limits { seed: 1 }
Part { limits: Limits, note: None, state: Idle, timed: true, twice: None }
Plant { limits: Limits, parts: [], spare: None }
"
    );
}

#[test]
fn one_part_does_not_make_its_numbers_and_texts_ordinary() {
    let base = Base::of(&[tree(&plant(vec![part("a", 1.0)]))]);
    let text = base.compact(&tree(&plant(vec![part("a", 1.0)])));
    assert!(text.contains(r#"[Part { name: "a", weight: 1.0, timed: true, state: Idle, limits: "#), "{text}");
}

#[test]
fn a_struct_of_ordinary_fields_is_left_out_only_where_no_other_could_be() {
    #[expect(dead_code, reason = "only their debug text is read")]
    #[derive(Debug)]
    enum Either {
        Here { unit: Option<u8> },
        There { unit: Option<u8> },
        Nowhere,
    }
    let base = Base::of(&[Tree::read(&format!("{:?}", [Either::Here { unit: None }, Either::There { unit: None }]))]);
    let holder = |of: &str| Tree::read(&format!("Holder {{ of: {of} }}"));
    let shown = |models: &[&str], of: &str| {
        let models: Vec<Tree> = models.iter().map(|of| holder(of)).chain([holder("Here { unit: None }")]).collect();
        Base::of(&[Tree::List(models)]).compact(&holder(of))
    };
    assert_eq!(base.compact(&holder("Here { unit: None }")), "Holder { of: Here }\n");
    assert_eq!(shown(&["Here { unit: Some(1) }"], "Here { unit: Some(1) }"), "Holder { of: Here { unit: 1 } }\n");
    assert_eq!(shown(&["Here { unit: Some(1) }"], "Here { unit: None }"), "Holder\n");
    assert_eq!(shown(&["Here { unit: None }"], "Here { unit: None }"), "Holder\n");
    assert_eq!(shown(&["There { unit: None }"], "Here { unit: None }"), "Holder { of: Here }\n");
    assert_eq!(shown(&["There { unit: None }"], "Nowhere"), "Holder { of: Nowhere }\n");
}

#[test]
fn a_new_field_changes_only_the_base_and_what_says_something_about_it() {
    let with = |text: &str, probe: &str| Tree::read(&text.replace("note:", &format!("probe: {probe}, note:")));
    let [base_before, model_before] =
        [plant(vec![part("a", 1.0), part("b", 2.0)]), unusual()].map(|plan| format!("{plan:?}"));
    let before = base().compact(&Tree::read(&model_before));
    for probe in ["None", "7"] {
        let base = Base::of(&[with(&base_before, probe)]);
        assert_eq!(base.compact(&with(&model_before, probe)), before);
        let text = base.compact(&with(&model_before, "Some(8)"));
        assert_eq!(text.matches("probe: 8").count(), 5, "{text}");
    }
}

#[test]
fn nothing_is_hidden() {
    let model = tree(&unusual());
    let variants: Vec<Tree> = (0..variants(&model)).map(|number| variant(&model, number).unwrap()).collect();
    assert!(variants.len() > 100 && variant(&model, variants.len()).is_none(), "{}", variants.len());
    for base in [base(), Base::default(), Base::of(&[tree(&unusual())])] {
        let mut texts = BTreeSet::from([base.compact(&model)]);
        for (number, variant) in variants.iter().enumerate() {
            let text = base.compact(variant);
            assert!(texts.insert(text.clone()), "change {number} is hidden, or as another one:\n{text}");
        }
    }
}

#[test]
fn objects_in_json_are_known_by_their_place_and_kind() {
    let json = r#"{ "topics": [
        { "name": "a", "type": { "kind": "real", "unit": null }, "doc": "" },
        { "name": "b", "type": { "kind": "real", "unit": null }, "doc": "" },
        { "name": "c", "type": { "kind": "text" }, "doc": "", "of": { } } ] }"#;
    let base = Base::of(&[Tree::read(json)]);
    let text = base.compact(&Tree::read(json));
    assert_eq!(
        text,
        "{ topics: [{ name: \"a\", type: real }, { name: \"b\", type: real }, { name: \"c\", type: text, of: {} }] }\n"
    );
    let other =
        json.replace("\"real\", \"unit\": null", "\"real\", \"unit\": \"m\"").replacen(", \"doc\": \"\"", "", 1);
    let text = base.compact(&Tree::read(&other));
    assert!(
        text.starts_with("{\n  topics: [\n    { name: \"a\", type: real { unit: \"m\" }, doc: missing }\n"),
        "{text}"
    );
}

#[test]
fn words_fill_their_lines_and_a_single_value_stays_beside_its_name() {
    let numbers: Vec<u32> = (1000..1030).collect();
    let text = Base::default().compact(&Tree::read(&format!("Wrapped({numbers:#?})")));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 4, "{text}");
    assert!(lines[0] == "Wrapped([" && lines[3] == "])" && lines[1].starts_with("  1000, 1001, "), "{text}");
    assert!(lines.iter().all(|line| line.len() <= WIDTH), "{text}");
}

#[test]
fn nothing_is_hidden_in_json() {
    let json = r#"{ "topics": [
        { "name": "a", "type": { "kind": "real", "unit": null }, "doc": "", "line": 1 },
        { "name": "b", "type": { "kind": "int", "unit": "m" }, "timed": false, "line": 1 },
        { "name": "c", "type": { "kind": "real", "unit": "s" }, "timed": true, "line": 1 } ], "at": { "x": 1 } }"#;
    let model = Tree::read(json);
    let variants: Vec<Tree> = (0..variants(&model)).map(|number| variant(&model, number).unwrap()).collect();
    for base in [Base::of(std::slice::from_ref(&model)), Base::default()] {
        let mut texts = BTreeSet::from([base.compact(&model)]);
        for (number, variant) in variants.iter().enumerate() {
            let text = base.compact(variant);
            assert!(texts.insert(text.clone()), "change {number} is hidden, or as another one:\n{text}");
        }
    }
}
