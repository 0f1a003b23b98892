use proptest::collection::vec;
use proptest::prelude::*;
use sesame_relay::value::{Fields, Record};

use super::*;
use crate::proto::v3::SimlogHeader;

/// Values that numbers of the wire hold.
fn values() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        any::<bool>().prop_map(Value::Bool),
        (-(1i64 << 53)..=1 << 53).prop_map(Value::Int),
        any::<f64>().prop_filter("NaN is not equal to itself", |x| !x.is_nan()).prop_map(Value::Real),
        "\\PC{0,6}".prop_map(|text| Value::from(text.as_str())),
        any::<[f64; 3]>().prop_filter("as above", |point| point.iter().all(|x| !x.is_nan())).prop_map(Value::Point),
    ];
    leaf.prop_recursive(2, 8, 3, |inner| {
        vec(inner, 1..4).prop_map(|values| {
            let names: Vec<String> = (0..values.len()).map(|at| format!("f{at}")).collect();
            Value::Record(Record::new(&Fields::new(names.iter().map(String::as_str)), values))
        })
    })
}

fn message(value: Option<Kind>) -> SimlogMessage {
    let timestamp = Some(Timestamp { seconds: 2, nanos: 5 });
    let header = Some(SimlogHeader { timestamp, path: "SIM://joint/out".to_owned() });
    SimlogMessage { header, r#type: 2, value: value.map(|kind| Dynamic { kind: Some(kind) }) }
}

proptest! {
    /// Whatever a value holds, what is written is read back the same, into any message.
    #[test]
    fn what_is_written_is_read_back(value in values(), other in values()) {
        let written = write(&value, &message(None)).unwrap();
        prop_assert_eq!(read(&ExpectedType::of_value(&value), &written), Ok(value.clone()));
        let over_other = write(&value, &write(&other, &message(None)).unwrap()).unwrap();
        prop_assert_eq!(read(&ExpectedType::of_value(&value), &over_other), Ok(value));
    }
}

#[test]
fn the_rest_of_a_message_stays() {
    let number = message(Some(Kind::NumberValue(1.5)));
    assert_eq!(read(&ExpectedType::Real, &number), Ok(Value::Real(1.5)));
    let written = write(&Value::Real(f64::NAN), &number).unwrap();
    assert_eq!((&written.header, written.r#type), (&number.header, 2));
    assert!(matches!(read(&ExpectedType::Real, &written), Ok(Value::Real(x)) if x.is_nan()));
    assert_eq!(stamp(&number), Some(2_000_000_005));
}

#[test]
fn what_does_not_fit_is_said() {
    let said = |result: Result<Value, Mismatch>| result.unwrap_err().to_string();
    assert_eq!(said(read(&ExpectedType::Real, &message(None))), "expected real, found nothing");
    let half = message(Some(Kind::NumberValue(0.5)));
    assert_eq!(said(read(&ExpectedType::Int, &half)), "expected int, found a number that is not whole");
    let large = write(&Value::List(vec![Value::Int(i64::MAX)]), &message(None)).unwrap_err();
    assert_eq!(large.to_string(), "field `[0]`: expected an int of 53 bits, found a number that is too large");
    let odd = SimlogHeader { timestamp: Some(Timestamp { seconds: -1, nanos: 0 }), path: String::new() };
    assert_eq!(stamp(&SimlogMessage { header: Some(odd), ..half }), None);
}
