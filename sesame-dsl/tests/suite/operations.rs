//! Every kind of operation on every type: what it is for is accepted, and all else refused with one diagnostic.

use sesame_dsl::analyse;
use sesame_dsl::diagnostic::Code;
use sesame_dsl::source::SourceMap;

/// Targets, with the unit of the numbers in them.
const TARGETS: [(&str, &str); 12] = [
    ("m.real", "m"),
    ("m.whole", ""),
    ("m.stamp", "ns"),
    ("m.truth", ""),
    ("m.word", ""),
    ("m.point", "m"),
    ("m.list", "m"),
    ("m.list[*]", "m"),
    ("m.list[3]", "m"),
    ("m.points[*]", "m"),
    ("m.inner", ""),
    ("m", ""),
];

const NUMBERS: [&str; 5] = ["m.real", "m.whole", "m.stamp", "m.list[*]", "m.list[3]"];
const POINTS: [&str; 2] = ["m.point", "m.points[*]"];

/// What a kind is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum For {
    Amounts,
    Reals,
    Texts,
    Truths,
    Stamps,
    Anything,
    WholeMessages,
}

impl For {
    fn accepts(self, target: &str) -> bool {
        match self {
            For::Amounts => NUMBERS.contains(&target) || POINTS.contains(&target),
            For::Reals => For::Amounts.accepts(target) && target != "m.whole" && target != "m.stamp",
            For::Texts => target == "m.word",
            For::Truths => target == "m.truth",
            For::Stamps => target == "m.stamp",
            For::Anything => true,
            For::WholeMessages => target == "m",
        }
    }
}

/// A kind in the words of the language. `AMOUNTS` stands for what is permitted of a number or a point, `RANGE` for a
/// range in the unit of the target, and `RATE` for amounts per second.
const KINDS: [(&str, For); 25] = [
    ("random offset AMOUNTS", For::Amounts),
    ("random absolute AMOUNTS", For::Amounts),
    ("random one of \"a\", \"b\"", For::Texts),
    ("stuck at AMOUNTS", For::Amounts),
    ("stuck at one of \"a\"", For::Texts),
    ("stuck at true", For::Truths),
    ("stuck at false", For::Truths),
    ("bias AMOUNTS", For::Amounts),
    ("drift RATE", For::Amounts),
    ("noise RANGE", For::Amounts),
    ("random walk RANGE", For::Amounts),
    ("scale [0.5, 2]", For::Amounts),
    ("nan", For::Reals),
    ("infinity", For::Reals),
    ("-infinity", For::Reals),
    ("freeze", For::Anything),
    ("stale [0s, 1s]", For::Anything),
    ("clock skew [-1ms, 1ms]", For::Stamps),
    ("packet loss [0%, 50%]", For::WholeMessages),
    ("burst loss { enter [0%, 50%]  leave [10%, 50%]  loss [0%, 90%] }", For::WholeMessages),
    ("rate limit [1Hz, 5Hz]", For::WholeMessages),
    ("latency [0s, 1s] normal drain drop", For::WholeMessages),
    ("reorder [0s, 1s] drain flush", For::WholeMessages),
    ("duplicate [1, 3]", For::WholeMessages),
    ("blackhole", For::WholeMessages),
];

/// A space with this operation.
fn space(target: &str, kind: &str, unit: &str) -> String {
    let per_second = if unit.is_empty() { "Hz".to_owned() } else { format!("{unit}/s") };
    let amounts = |unit: &str| {
        if POINTS.contains(&target) {
            format!("[(0, -1, 0){unit}, (1, 1, 0){unit}]")
        } else {
            format!("[0{unit}, 1{unit}]")
        }
    };
    let kind = kind
        .replace("AMOUNTS", &amounts(unit))
        .replace("RATE", &amounts(&per_second))
        .replace("RANGE", &format!("[0{unit}, 1{unit}]"));
    format!(
        "space cell
         system {{
           simulator sim = in_process \"cell::Cell\" {{ crate \"simulator\"  step 20ms }}
           message Inner {{ deep: real[m] }}
           message M {{
             real: real[m]  whole: int  stamp: int[ns]  truth: bool  word: text  point: point[m]
             list: list of real[m]  points: list of point[m]  inner: Inner
           }}
           topic m = \"m\" : M
         }}
         metric time minimise = fuzzing_time()
         operation it on {target} = {kind} within [0s, 5s] priority 1
         campaign c {{ objectives time  operations it 1 per test  search random {{ evaluations 2 }}  end after 9s }}"
    )
}

#[test]
fn a_kind_is_accepted_on_what_it_is_for_and_refused_on_all_else() {
    let (mut accepted, mut refused) = (0, 0);
    for (kind, is_for) in KINDS {
        for (target, unit) in TARGETS {
            let text = space(target, kind, unit);
            let mut sources = SourceMap::new();
            let file = sources.add("cell.sesame", text.as_str());
            let analysis = analyse(&sources, file);
            let codes: Vec<Code> = analysis.diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
            if is_for.accepts(target) {
                assert!(analysis.model.is_some() && codes.is_empty(), "{kind} on {target}: {codes:?}");
                accepted += 1;
            } else {
                assert!(analysis.model.is_none() && codes == [Code::WRONG_TYPE], "{kind} on {target}: {codes:?}");
                refused += 1;
            }
        }
    }
    assert_eq!((accepted, refused), (107, 193));
}
