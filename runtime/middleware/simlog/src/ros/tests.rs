use proptest::collection::vec;
use proptest::prelude::*;
use sesame_relay::value::{Fields, Record};

use super::*;

const REAL: ExpectedType = ExpectedType::Real;

fn record(fields: &[(&str, Value)]) -> Value {
    let names = Fields::new(fields.iter().map(|(name, _)| *name));
    Record::new(&names, fields.iter().map(|(_, value)| value.clone()).collect()).into()
}

fn holding(content: Content) -> RosMessage {
    RosMessage { r#type: "kind".to_owned(), value: String::new(), content: Some(content) }
}

fn saying(text: &str) -> RosMessage {
    RosMessage { value: text.to_owned(), ..RosMessage::default() }
}

fn stamped(sec: u64, nsec: u64) -> Header {
    Header { seq: 7, stamp: Some(Time { sec, nsec }), frame_id: "world".to_owned() }
}

/// A single number, as the wire has it.
fn single() -> impl Strategy<Value = f32> {
    any::<f32>().prop_filter("NaN is not equal to itself", |x| !x.is_nan())
}

fn header() -> impl Strategy<Value = Header> {
    // Values hold whole numbers of 63 bits.
    let stamp = (0..=i64::MAX as u64, 0..=i64::MAX as u64).prop_map(|(sec, nsec)| Time { sec, nsec });
    (any::<u32>(), stamp, "\\PC{0,5}").prop_map(|(seq, stamp, frame_id)| Header { seq, stamp: Some(stamp), frame_id })
}

fn point() -> impl Strategy<Value = Point> {
    [single(), single(), single()].prop_map(|[x, y, z]| Point { x, y, z })
}

fn joint_point() -> impl Strategy<Value = JointTrajectoryPoint> {
    let reals = || vec(single(), 1..3);
    ([reals(), reals(), reals(), reals()], 0..=i64::MAX as u64).prop_map(|([a, b, c, d], msec)| JointTrajectoryPoint {
        positions: a,
        velocities: b,
        accelerations: c,
        effort: d,
        time_from_start: Some(Duration { msec }),
    })
}

/// Any content whose parts are all there.
fn contents() -> impl Strategy<Value = Content> {
    let text = || "\\PC{0,5}";
    prop_oneof![
        point().prop_map(Content::Point),
        header().prop_map(Content::TimeStamp),
        (header(), point())
            .prop_map(|(header, at)| Content::PointStamped(PointStamped { header: Some(header), point: Some(at) })),
        [single(), single(), single(), single()].prop_map(|[x, y, z, w]| Content::Quaternion(Quaternion {
            x,
            y,
            z,
            w
        })),
        joint_point().prop_map(Content::JointTrajectoryPoint),
        (header(), vec(text(), 1..3), vec(joint_point(), 1..3)).prop_map(|(header, joint_names, points)| {
            Content::JointTrajectory(JointTrajectory { header: Some(header), joint_names, points })
        }),
        (header(), text(), single(), text(), text()).prop_map(|(header, zone, level, object1, object2)| {
            Content::SafetyZone(SafetyZone { header: Some(header), zone, level, object1, object2 })
        }),
        (text(), text()).prop_map(|(zone, cmd)| Content::SafetyZoneCmd(SafetyZoneCmd { zone, cmd })),
    ]
}

/// As a space would declare all of a content.
fn all_of(tree: &Tree) -> ExpectedType {
    fn value(tree: &Tree) -> Value {
        match tree {
            Tree::Int(_) => Value::Int(0),
            Tree::Real(_) => Value::Real(0.0),
            Tree::Text(_) => Value::from(""),
            Tree::List(items) => Value::List(items.iter().take(1).map(value).collect()),
            Tree::Fields(fields) => {
                let fields: Vec<(&str, Value)> =
                    fields.iter().map(|(name, tree)| (name.as_ref(), value(tree))).collect();
                record(&fields)
            }
            Tree::Nothing | Tree::Bool(_) => unreachable!("all parts are there, and none is a truth value"),
        }
    }
    ExpectedType::of_value(&value(tree))
}

proptest! {
    /// Whatever content there is, what is read of it and written into another one of its kind is the same content.
    #[test]
    fn what_is_read_is_written_back(content in contents(), other in contents()) {
        let expected = all_of(&tree(&content));
        let message = holding(content);
        let value = read(&expected, &message).unwrap();
        prop_assert_eq!(&write(&value, &message).unwrap(), &message);
        let other = holding(other);
        let kinds = [&message, &other].map(|message| message.content.as_ref().map(std::mem::discriminant));
        if kinds[0] == kinds[1] {
            prop_assert_eq!(write(&value, &other).unwrap().content, message.content);
        }
    }

    /// Numbers are rounded once: what is written is the nearest number of 32 bits.
    #[test]
    fn numbers_are_rounded_once(x in -1e30..1e30f64) {
        let like = holding(Content::Point(Point::default()));
        let written = write(&Value::Point([x, 0.0, 0.0]), &like).unwrap();
        let Some(Content::Point(point)) = written.content else { panic!("it stays a point") };
        let near = [f32::from_bits(point.x.to_bits() - 1), f32::from_bits(point.x.to_bits() + 1)];
        for other in near.into_iter().filter(|_| point.x != 0.0) {
            prop_assert!((f64::from(point.x) - x).abs() <= (f64::from(other) - x).abs());
        }
    }

    /// Texts hold any value without loss, as what it was.
    #[test]
    fn texts_hold_any_value(x in any::<f64>().prop_filter("NaN", |x| !x.is_nan()), n in any::<i64>(), text in "\\PC{0,9}") {
        let nested = record(&[("list", Value::List(vec![Value::Real(x)])), ("text", Value::from(text.as_str()))]);
        for value in [Value::Real(x), Value::Int(n), Value::Bool(n > 0), Value::from(text.as_str()), nested] {
            let written = write(&value, &saying("")).unwrap();
            prop_assert_eq!(read(&ExpectedType::of_value(&value), &written).unwrap(), value);
        }
    }

    /// No text is a reason to panic, whatever is expected.
    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,20}|[\\[\\]{}\":,0-9eEn.-]{0,20}") {
        let zone = record(&[("zone", Value::from("")), ("level", Value::Real(0.0))]);
        for like in [Value::Real(0.0), Value::Int(0), Value::Bool(true), Value::Point([0.0; 3]), zone] {
            let expected = ExpectedType::of_value(&like);
            if let Ok(value) = read(&expected, &saying(&text)) {
                prop_assert!(write(&value, &saying(&text)).is_ok());
            }
        }
    }
}

#[test]
fn a_part_of_a_message_is_enough() {
    let zone = SafetyZone {
        header: Some(stamped(1, 5)),
        zone: "Z1".to_owned(),
        level: 250.5,
        object1: "gripper".to_owned(),
        object2: "worker".to_owned(),
    };
    let declared = record(&[("level", Value::Real(0.0)), ("zone", Value::from(""))]);
    let message = holding(Content::SafetyZone(zone.clone()));
    let value = read(&ExpectedType::of_value(&declared), &message).unwrap();
    assert_eq!(value, record(&[("level", Value::Real(250.5)), ("zone", Value::from("Z1"))]));
    let changed = record(&[("level", Value::Real(0.1)), ("zone", Value::from("Z1"))]);
    let expected = holding(Content::SafetyZone(SafetyZone { level: 0.1, ..zone }));
    assert_eq!(write(&changed, &message), Ok(expected), "all else stays");
}

#[test]
fn a_point_is_a_point_wherever_it_is() {
    let at = Point { x: 1.0, y: 2.0, z: 3.0 };
    let moved = Value::Point([4.0, 5.0, 6.0]);
    let there = Point { x: 4.0, y: 5.0, z: 6.0 };
    let plain = holding(Content::Point(at));
    assert_eq!(read(&ExpectedType::Point, &plain), Ok(Value::Point([1.0, 2.0, 3.0])));
    assert_eq!(write(&moved, &plain), Ok(holding(Content::Point(there))));
    let stamped = |point| holding(Content::PointStamped(PointStamped { header: Some(stamped(3, 4)), point }));
    assert_eq!(read(&ExpectedType::Point, &stamped(Some(at))), Ok(Value::Point([1.0, 2.0, 3.0])));
    assert_eq!(write(&moved, &stamped(Some(at))), Ok(stamped(Some(there))));
    assert_eq!(write(&moved, &stamped(None)), Ok(stamped(Some(there))));
    let declared = record(&[("header", record(&[("seq", Value::Int(0))])), ("point", Value::Point([0.0; 3]))]);
    let read_back = read(&ExpectedType::of_value(&declared), &stamped(Some(at))).unwrap();
    assert_eq!(read_back.number_at(&["point", "y"]), Some(2.0));
    assert_eq!(write(&read_back, &stamped(Some(at))), Ok(stamped(Some(at))));
}

#[test]
fn a_time_stamp_belongs_to_the_text_beside_it() {
    let joint = RosMessage { value: "0.25".to_owned(), ..holding(Content::TimeStamp(stamped(0, 20_000_000))) };
    assert_eq!(read(&REAL, &joint), Ok(Value::Real(0.25)));
    assert_eq!(stamp(&joint), Some(20_000_000));
    assert_eq!(write(&Value::Real(0.5), &joint), Ok(RosMessage { value: "0.5".to_owned(), ..joint }));
    assert_eq!(stamp(&holding(Content::TimeStamp(stamped(2, 3)))), Some(2_000_000_003));
    assert_eq!(stamp(&holding(Content::TimeStamp(stamped(u64::MAX, 3)))), Some(u64::MAX));
    assert_eq!(stamp(&saying("1")), None);
}

#[test]
fn what_json_has_beyond_the_declaration_stays() {
    let zone = record(&[("level", Value::Real(0.0))]);
    let message = saying(r#"{"level": 3, "seq": 18446744073709551615, "tags": ["a", null]}"#);
    let mut value = read(&ExpectedType::of_value(&zone), &message).unwrap();
    assert_eq!(value, record(&[("level", Value::Real(3.0))]));
    *value.at_mut(&["level"]).unwrap() = Value::Real(f64::NAN);
    let written = write(&value, &message).unwrap();
    assert_eq!(written.value, r#"{"level":"NaN","seq":18446744073709551615,"tags":["a",null]}"#);
    assert!(read(&ExpectedType::of_value(&zone), &written).unwrap().number_at(&["level"]).unwrap().is_nan());
}

#[test]
fn misfits_say_where_and_what() {
    let trajectory = Content::JointTrajectory(JointTrajectory {
        header: None,
        joint_names: vec!["j1".to_owned()],
        points: vec![JointTrajectoryPoint { positions: vec![0.5], ..JointTrajectoryPoint::default() }],
    });
    let header = record(&[("header", record(&[("seq", Value::Int(0))]))]);
    let names = record(&[("joint_names", Value::List(vec![Value::Real(0.0)]))]);
    let lacking = record(&[("joint_name", Value::from(""))]);
    let points =
        |positions| record(&[("points", Value::List(vec![record(&[("positions", Value::List(vec![positions]))])]))]);
    let trajectory = holding(trajectory);
    let zone = holding(Content::SafetyZone(SafetyZone::default()));
    let seq = |seq| record(&[("header", record(&[("seq", seq)]))]);
    let said = [
        read(&ExpectedType::of_value(&header), &trajectory).map(drop),
        read(&ExpectedType::of_value(&names), &trajectory).map(drop),
        read(&ExpectedType::of_value(&lacking), &trajectory).map(drop),
        read(&REAL, &trajectory).map(drop),
        read(&REAL, &saying("fast")).map(drop),
        read(&ExpectedType::Int, &saying("2.5")).map(drop),
        read(&ExpectedType::Bool, &saying("1")).map(drop),
        read(&ExpectedType::Point, &saying("[1, 2]")).map(drop),
        read(&ExpectedType::of_value(&header), &saying("{")).map(drop),
        write(&points(Value::Real(1e300)), &trajectory).map(drop),
        write(&points(Value::from("far")), &trajectory).map(drop),
        write(&seq(Value::Int(-1)), &zone).map(drop),
        write(&seq(Value::Int(1 << 40)), &zone).map(drop),
        write(&lacking, &zone).map(drop),
        write(&Value::Real(1.0), &zone).map(drop),
    ]
    .map(|result| result.expect_err("it does not fit").to_string());
    insta::assert_snapshot!(said.join("\n"));
}
