use proptest::prelude::*;
use serde_json::{Map, Value as Json, json};

use super::*;

fn samples<'a>(payloads: impl IntoIterator<Item = &'a Json>) -> Samples {
    let mut samples = Samples::default();
    for payload in payloads {
        samples.add(payload);
    }
    samples
}

fn guess(payloads: &[Json], conventions: Conventions) -> Result<Guess, String> {
    samples(payloads).guess(conventions)
}

/// A guess in the words of the language, with what is left out.
fn in_words(guess: &Guess) -> String {
    match guess {
        Guess::Bool => "bool".to_owned(),
        Guess::Int => "int".to_owned(),
        Guess::Real => "real".to_owned(),
        Guess::Text => "text".to_owned(),
        Guess::Point => "point".to_owned(),
        Guess::Time => "time".to_owned(),
        Guess::List(of) => format!("list of {}", in_words(of)),
        Guess::Message { fields, left_out } => {
            let fields = fields.iter().map(|GuessedField { name, guess, optional }| {
                format!("{}{name}: {}", if *optional { "optional " } else { "" }, in_words(guess))
            });
            let left_out = left_out.iter().map(|omitted| format!("not {}: {}", omitted.name, omitted.why));
            format!("{{ {} }}", fields.chain(left_out).collect::<Vec<_>>().join("  "))
        }
    }
}

fn said(payloads: &[Json], conventions: Conventions) -> String {
    guess(payloads, conventions).map_or_else(|why| format!("none: {why}"), |guess| in_words(&guess))
}

#[test]
fn a_state_has_the_fields_of_all_messages_and_those_of_some_are_optional() {
    let states = [
        json!({ "driving": false, "x": 1, "y": 2.5, "loads": [], "errors": [{ "id": "E1", "level": 3 }], "zone": null }),
        json!({ "driving": true, "x": 7, "y": 2, "loads": [], "errors": [{ "id": "E2" }], "zone": "A", "a b": 1, "_": 1 }),
    ];
    assert_eq!(
        said(&states, Conventions::Json),
        "{ driving: bool  errors: list of { id: text  optional level: int }  x: int  y: real  optional zone: text  \
         not _: its name cannot be that of a field in a space  not a b: its name cannot be that of a field in a space  not loads: its lists were empty }"
    );
}

#[test]
fn points_times_and_numbers_that_json_does_not_have_are_as_the_middleware_writes_them() {
    let at = [json!({ "x": 1.5, "y": 0, "z": "NaN" })];
    assert_eq!(said(&at, Conventions::Simlog3), "point");
    assert_eq!(said(&at, Conventions::Json), "{ x: real  y: int  z: text }");
    let stamped = [
        json!({ "stamp": { "sec": 1, "nanosec": 5 }, "level": null }),
        json!({ "stamp": { "sec": 2, "nanosec": 0 }, "level": 1 }),
    ];
    assert_eq!(said(&stamped, Conventions::Rosbridge), "{ level: real  stamp: time }");
    assert_eq!(said(&stamped, Conventions::Json), "{ optional level: int  stamp: { nanosec: int  sec: int } }");
    let texts = [json!("none"), json!(0.5)];
    assert_eq!(said(&texts, Conventions::Simlog2), "text");
    assert_eq!(said(&texts, Conventions::Simlog3), "none: it came as a number and a text");
    assert_eq!(said(&[json!(u64::MAX), json!(1)], Conventions::Json), "real");
    assert_eq!(said(&[], Conventions::Simlog2), "none: nothing came");
    assert_eq!(said(&[json!({}), json!({ "a": 1 })], Conventions::Json), "{ optional a: int }");
    assert_eq!(
        said(&[json!({}), json!({ "a": 1 })], Conventions::Rosbridge),
        "none: its objects have no field that a space can declare, for example not `a`: only 1 of 2 objects have it"
    );
}

#[test]
fn whatever_comes_is_bounded() {
    let mut deep = json!(1);
    for _ in 0..100 {
        deep = json!([deep]);
    }
    assert!(said(&[deep], Conventions::Json).contains("nested too deeply"));
    let mut all = Samples::default();
    for number in 0..100_000 {
        all.add(&json!({ format!("field_{number}"): { "at": 1 }, "n".repeat(10_000): 1 }));
    }
    assert!(format!("{all:?}").len() < 1_000_000);
}

#[test]
fn topics_resemble_each_other_if_most_fields_have_equal_names() {
    let of = |payload: Json| samples([&payload]);
    let state = of(json!({ "id": "a", "x": 1, "y": 2, "loads": [] }));
    assert!(state.resemble(&of(json!({ "id": "b", "x": 1.5, "y": 2 }))));
    assert!(!state.resemble(&of(json!({ "id": "b", "order": 1, "nodes": [] }))));
    assert!(!state.resemble(&of(json!("a"))));
    assert!(of(json!(1)).resemble(&of(json!(2.5))));
}

/// Whether the relay reads this as of this type: the rules of its codecs, without their code.
fn fits(value: &Json, guess: &Guess, conventions: Conventions) -> bool {
    let is_word = |value: &Json| matches!(value.as_str(), Some("NaN" | "Infinity" | "-Infinity"));
    let is_number =
        |value: &Json| value.is_number() || is_word(value) || (conventions.null_is_nan() && value.is_null());
    match guess {
        Guess::Bool => value.is_boolean(),
        Guess::Int => value.is_i64(),
        Guess::Real => is_number(value),
        Guess::Text => value.is_string() || (conventions.any_text() && (value.is_number() || value.is_boolean())),
        Guess::Point => ["x", "y", "z"].iter().all(|axis| value.get(axis).is_some_and(is_number)),
        Guess::Time => [["sec", "nanosec"], ["secs", "nsecs"]]
            .iter()
            .any(|names| names.iter().all(|name| value.get(name).is_some_and(Json::is_i64))),
        Guess::List(of) => value.as_array().is_some_and(|items| items.iter().all(|item| fits(item, of, conventions))),
        Guess::Message { fields, .. } => {
            fields.iter().all(|GuessedField { name, guess, optional }| match value.get(name) {
                None | Some(Json::Null) if *optional => true,
                field => field.is_some_and(|field| fits(field, guess, conventions)),
            })
        }
    }
}

/// Payloads of few names and kinds, so that many have something in common.
fn payload() -> impl Strategy<Value = Json> {
    let leaf = prop_oneof![
        Just(Json::Null),
        any::<bool>().prop_map(Json::from),
        (-3i64..3).prop_map(Json::from),
        (-3i8..3).prop_map(|n| Json::from(f64::from(n) / 2.0)),
        prop_oneof![Just("a"), Just("NaN"), Just("1")].prop_map(Json::from),
    ];
    leaf.prop_recursive(4, 24, 4, |inner| {
        let name = prop_oneof![Just("x"), Just("y"), Just("z"), Just("sec"), Just("nanosec"), Just("a b")];
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..4).prop_map(Json::from),
            prop::collection::vec((name, inner), 0..4).prop_map(|fields| Json::Object(
                fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect::<Map<_, _>>()
            )),
        ]
    })
}

/// The same payload again, with other values in the places of some.
fn payloads() -> impl Strategy<Value = Vec<Json>> {
    prop_oneof![
        prop::collection::vec(payload(), 1..6),
        (payload(), 1usize..4).prop_map(|(payload, times)| vec![payload; times]),
    ]
}

proptest! {
    #[test]
    fn each_payload_is_of_the_type_that_all_have(payloads in payloads()) {
        let all = [Conventions::Json, Conventions::Rosbridge, Conventions::Simlog2, Conventions::Simlog3];
        for conventions in all {
            if let Ok(guess) = guess(&payloads, conventions) {
                for payload in &payloads {
                    prop_assert!(fits(payload, &guess, conventions), "{payload} is not a {}", in_words(&guess));
                }
            }
        }
    }

    #[test]
    fn payloads_of_one_shape_have_a_type(n in 1usize..5, x in any::<f32>(), text in "[a-z]*", truth in any::<bool>()) {
        let payload = json!({ "x": f64::from(x), "all": vec![json!({ "t": text, "b": truth }); n], "n": n });
        let said = said(&vec![payload; n], Conventions::Json);
        let number = if x.is_finite() { "x: real" } else { "not x: it came as null" };
        let all = "{ all: list of { b: bool  t: text }  n: int  ";
        prop_assert_eq!(said, format!("{all}{number} }}"));
    }

    #[test]
    fn it_does_not_matter_in_which_order_or_in_how_many_parts_payloads_come(
        (payloads, at) in payloads().prop_flat_map(|all| { let most = all.len(); (Just(all), 0..=most) })
    ) {
        let whole = samples(&payloads);
        prop_assert_eq!(&samples(payloads.iter().rev()), &whole);
        let (first, second) = payloads.split_at(at);
        let mut merged = samples(second);
        merged.merge(&samples(first));
        prop_assert_eq!(&merged, &whole);
        prop_assert_eq!(whole.count(), payloads.len() as u64);
    }
}
