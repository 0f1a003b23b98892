//! What happens in a run without operations: when messages come on each wire, and what their fields do. Searches place
//! windows of operations by it, so it is recorded in reference runs only.
//!
//! Its size is bounded, however long the run is and however large the messages are: of a field with a great many values
//! an even selection is kept, and of all fields the first ones.

mod happenings;
mod stretches;

use sesame_base::observation::{Course, Heard, Signal, States};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, CourseRead, Test};

use crate::relay::course::happenings::Field;
use crate::relay::course::stretches::Stretches;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// How many fields are followed, over all wires.
const FIELDS: usize = 400;
/// Lists of at most so many numbers are followed number by number; of longer ones, the length is.
const NUMBERS: usize = 8;

/// What is recorded of the course of a run: something of one without operations, for a search that places windows by
/// it, or a description of when operations have to act.
pub(super) fn read(plan: &CampaignPlan, test: &Test) -> CourseRead {
    match plan.campaign.search.strategy() {
        _ if !test.operations.is_empty() => CourseRead::Nothing,
        _ if plan.campaign.describes_when => CourseRead::Happenings,
        Some(strategy) => strategy.kind().properties().course,
        None => CourseRead::Nothing,
    }
}

/// The course of one run.
pub(super) struct Recorder {
    wires: Vec<Option<OfWire>>,
    read: CourseRead,
    /// How many more fields can be followed.
    left: usize,
}

/// What is known of a wire that spoke.
struct OfWire {
    stretches: Stretches,
    layout: Layout,
    fields: Vec<Field>,
}

/// Where in a message the fields are that are followed, as its first message has them.
enum Layout {
    /// A value, and the position of its field.
    Value(usize),
    /// A point, and the position of its first coordinate.
    Point(usize),
    /// A list of so many numbers, and the position of the first one.
    Numbers { first: usize, count: usize },
    /// The length of a list.
    Length(usize),
    /// The values of a record.
    Record(Vec<Layout>),
    /// Nothing that is followed.
    Nothing,
}

impl Recorder {
    /// A recorder of what is read of a course; `None` if that is nothing.
    pub(super) fn new(wires: &WireTable, read: CourseRead) -> Option<Self> {
        let left = match read {
            CourseRead::Nothing => return None,
            CourseRead::Messages => 0,
            CourseRead::Happenings => FIELDS,
        };
        Some(Recorder { wires: wires.iter().map(|_| None).collect(), read, left })
    }

    /// A message was published on a wire.
    pub(super) fn published(&mut self, now: SimTime, wire: Wire, value: &Value) {
        let left = &mut self.left;
        let of = self.wires[wire.index()].get_or_insert_with(|| {
            let mut fields = Vec::new();
            let layout = Layout::of(value, "", &mut fields, left);
            OfWire { stretches: Stretches::new(), layout, fields }
        });
        of.stretches.heard(now);
        of.layout.read(value, now, &mut of.fields);
    }

    /// The course of a run that ended at a time.
    pub(super) fn course(&self, end: SimTime) -> Course {
        let mut course = Course::default();
        for (wire, of) in (0..).zip(&self.wires) {
            let Some(of) = of else { continue };
            course.heard.push(Heard { wire, stretches: of.stretches.spans() });
            if self.read == CourseRead::Messages {
                continue;
            }
            let messages = ("", of.stretches.events(end));
            let fields = of.fields.iter().map(|field| (field.name.as_str(), field.events()));
            let happened = std::iter::once(messages).chain(fields).filter(|(_, events)| !events.is_empty());
            let signals = happened.map(|(field, events)| Signal { wire, field: field.to_owned(), events });
            course.signals.extend(signals);
            let states = of
                .fields
                .iter()
                .filter_map(|field| Some(States { wire, field: field.name.clone(), entered: field.states()? }));
            course.states.extend(states);
        }
        course
    }
}

impl Layout {
    fn of(value: &Value, name: &str, fields: &mut Vec<Field>, left: &mut usize) -> Layout {
        let mut follow = |suffix: &str| {
            *left = left.checked_sub(1)?;
            fields.push(Field::new(format!("{name}{suffix}")));
            Some(fields.len() - 1)
        };
        match value {
            Value::Bool(_) | Value::Int(_) | Value::Real(_) | Value::Text(_) => {
                follow("").map_or(Layout::Nothing, Layout::Value)
            }
            Value::Point(_) => {
                let axes = if name.is_empty() { ["x", "y", "z"] } else { [".x", ".y", ".z"] };
                let followed = axes.map(follow);
                followed[2].and(followed[0]).map_or(Layout::Nothing, Layout::Point)
            }
            Value::List(list) => {
                let numbers = list.iter().all(|item| item.number().is_some());
                if !numbers || list.is_empty() || list.len() > NUMBERS {
                    return follow(".length").map_or(Layout::Nothing, Layout::Length);
                }
                let followed: Vec<usize> = (0..list.len()).map_while(|at| follow(&format!("[{at}]"))).collect();
                let count = followed.len();
                followed.first().map_or(Layout::Nothing, |&first| Layout::Numbers { first, count })
            }
            Value::Record(record) => {
                let of_field = |(field, value): (&crate::value::Text, &Value)| {
                    let name = if name.is_empty() { field.to_string() } else { format!("{name}.{field}") };
                    Layout::of(value, &name, fields, left)
                };
                Layout::Record(record.iter().map(of_field).collect())
            }
            Value::Undeclared(_) | Value::Opaque(_) => Layout::Nothing,
        }
    }

    /// Takes the values of a message; what is not as the first message had it is left out.
    fn read(&self, value: &Value, now: SimTime, fields: &mut [Field]) {
        match (self, value) {
            (&Layout::Value(at), value) => fields[at].take(now, value),
            (&Layout::Point(first), Value::Point(point)) => {
                for (field, number) in fields[first..].iter_mut().zip(point) {
                    field.take_number(now, *number);
                }
            }
            (&Layout::Numbers { first, count }, Value::List(list)) => {
                for (field, item) in fields[first..first + count].iter_mut().zip(list) {
                    field.take(now, item);
                }
            }
            (&Layout::Length(at), Value::List(list)) => fields[at].take_number(now, list.len() as f64),
            (Layout::Record(layouts), Value::Record(record)) => {
                for (layout, value) in layouts.iter().zip(record.values()) {
                    layout.read(value, now, fields);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::{Entered, Happening, SignalEvent};
    use sesame_plan::testing::{field, message, minimal, topic};
    use sesame_plan::testing::{test_of, use_of};
    use sesame_plan::{MessageId, Search, Strategy, Type};

    use super::*;
    use crate::value::{Fields, Record};

    fn at(tenths: u32) -> SimTime {
        SimTime::from_seconds(f64::from(tenths) / 10.0)
    }

    /// `order`, a text of which there are few, and `state`: a pose, a mode and the ranges of a sensor.
    fn plan() -> CampaignPlan {
        let real = || Type::Real { unit: None };
        CampaignPlan {
            messages: vec![message(
                "State",
                vec![field("pose", Type::Point { unit: None }), field("mode", Type::Text)],
            )],
            topics: vec![
                topic("order", &["order"], Type::Text),
                topic("state", &["state"], Type::Message { id: MessageId(0) }),
                topic("silent", &["silent"], real()),
            ],
            ..minimal()
        }
    }

    fn state(x: f64, mode: &str) -> Value {
        let fields = Fields::new(["pose", "mode"]);
        Record::new(&fields, vec![Value::Point([x, 0.0, 0.0]), Value::Text(mode.into())]).into()
    }

    #[test]
    fn the_course_tells_when_messages_came_and_what_their_fields_did() {
        let plan = plan();
        let wires = WireTable::new(&plan);
        let wire = |path: &str| wires.find(path).unwrap();
        let mut recorder = Recorder::new(&wires, CourseRead::Happenings).unwrap();
        for step in 1..=100 {
            if step == 20 || step == 70 {
                recorder.published(at(step), wire("order"), &Value::Text("go".into()));
            }
            // The robot sets out at 3 s, stops at 6 s, and nobody hears of it after 8 s.
            let x = f64::from(step.clamp(30, 60)) / 10.0 - 3.0;
            if step <= 80 {
                recorder.published(at(step), wire("state"), &state(x, if step < 30 { "rest" } else { "drive" }));
            }
        }
        let course = recorder.course(at(100));
        assert_eq!(course.heard.iter().map(|heard| heard.stretches.len()).collect::<Vec<_>>(), [2, 80]);
        let of = |field: &str, wire: u32| -> Vec<(f64, Happening)> {
            let signals = course.signals.iter().filter(|signal| signal.field == field && signal.wire == wire);
            signals.flat_map(|signal| signal.events.iter().map(|&SignalEvent { at, what }| (at, what))).collect()
        };
        assert_eq!(of("", 0)[..2], [(2.0, Happening::Message), (7.0, Happening::Message)]);
        assert_eq!(of("", 1), [(8.0, Happening::Ends)]);
        assert_eq!(of("mode", 1), [(3.0, Happening::Changes)]);
        let entered = [(0.1, "rest"), (3.0, "drive")].map(|(at, value)| Entered { at, value: value.to_owned() });
        assert_eq!(course.states, [States { wire: 1, field: "mode".to_owned(), entered: entered.to_vec() }]);
        assert_eq!(of("pose.x", 1), [(3.1, Happening::SetsOut), (6.0, Happening::Rests)]);
        assert_eq!(of("pose.y", 1), []);
    }

    #[test]
    fn undisturbed_runs_record_what_their_search_reads() {
        let with = |search| {
            let mut plan = plan();
            plan.campaign.search = search;
            plan
        };
        let (undisturbed, disturbed) = (Test::default(), test_of(vec![use_of(0, 0.0, 1.0, vec![], 1)]));
        let interleaved = with(Search::new(Strategy::Interleaved { keep_causes: false }, 8));
        assert_eq!(read(&interleaved, &undisturbed), CourseRead::Happenings);
        assert_eq!(read(&interleaved, &disturbed), CourseRead::Nothing);
        assert_eq!(read(&with(Search::new(Strategy::Random, 8)), &undisturbed), CourseRead::Messages);
        assert_eq!(read(&with(Search::new(Strategy::Grid { levels: 3 }, 8)), &undisturbed), CourseRead::Nothing);
        let wires = WireTable::new(&plan());
        let mut recorder = Recorder::new(&wires, CourseRead::Messages).unwrap();
        recorder.published(at(1), wires.find("state").unwrap(), &state(1.0, "rest"));
        let course = recorder.course(at(2));
        assert_eq!((course.heard.len(), course.signals.len()), (1, 0));
    }

    #[test]
    fn its_size_is_bounded() {
        let plan = plan();
        let wires = WireTable::new(&plan);
        let mut recorder = Recorder::new(&wires, CourseRead::Happenings).unwrap();
        let wire = wires.find("silent").unwrap();
        for step in 0..200_000u32 {
            // A zigzag with a jump, a turn and a change of its sign over and over.
            let x = f64::from(step % 40) - 20.0;
            recorder.published(SimTime::from_nanos(i64::from(step) * 1_000_000), wire, &Value::Real(x));
        }
        let course = recorder.course(SimTime::from_seconds(200.0));
        assert_eq!(course.heard[0].stretches.len(), 1, "messages came regularly: {:?}", course.heard[0].stretches[0]);
        assert!(course.signals.iter().all(|signal| signal.events.len() <= 400));
    }
}
