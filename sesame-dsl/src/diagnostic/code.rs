//! The kinds of diagnostics, each with a page that `sesamec explain` prints.

/// Whether a diagnostic stops the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// No model comes out.
    Error,
    /// The model comes out, and probably does not do what was meant.
    Warning,
}

/// A kind of diagnostic, for example `E0203`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Code(&'static str);

impl Code {
    /// The code as text.
    pub fn text(self) -> &'static str {
        self.0
    }

    /// `E…` is an error, `W…` a warning.
    pub fn severity(self) -> Severity {
        if self.0.starts_with('W') { Severity::Warning } else { Severity::Error }
    }
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

macro_rules! codes {
    ($($name:ident = $text:literal : $what:literal,)*) => {
        impl Code {
            $(
                #[doc = $what]
                pub const $name: Code = Code($text);
            )*
        }

        /// Every code with its page in Markdown, sorted by code.
        pub const CODES: &[(Code, &str)] = &[
            $((Code::$name, include_str!(concat!("codes/", $text, ".md"))),)*
        ];
    };
}

codes! {
    SYNTAX = "E0101": "Something else stands where the grammar expects a word or sign.",
    KEYWORD_AS_NAME = "E0102": "A keyword of the language is used as a name.",
    NOT_CLOSED = "E0103": "A block is not closed, or a brace closes nothing.",
    NOT_SUPPORTED = "E0104": "The language has it, this version of the compiler does not.",
    TOO_LARGE = "E0105": "The file is too large or too deeply nested to be read.",
    NOT_A_NAME = "E0106": "A name holds characters that names do not have.",
    BAD_TEXT = "E0107": "A quoted text does not end, is empty, or holds an unknown escape.",
    BAD_NUMBER = "E0108": "A number is out of range or not whole where it must be.",
    DEFINED_TWICE = "E0201": "One name is defined twice.",
    MISSING_DECLARATION = "E0202": "A space lacks a declaration it cannot do without, or has it twice.",
    UNKNOWN_NAME = "E0203": "No such topic, metric, operation, test, message, field or setting.",
    OTHER_KIND = "E0204": "The name is that of something else.",
    RECURSIVE_MESSAGE = "E0205": "A message type contains itself.",
    SAME_PATH = "E0206": "Two topics have the same path.",
    BAD_PATH = "E0207": "A topic's path or a simulator's path is malformed.",
    GENERATED_COLLISION = "E0208": "Two names of one kind meet in the generated code.",
    LISTED_TWICE = "E0209": "A name stands twice in one list.",
    CLAUSE_TWICE = "E0210": "A clause stands twice.",
    CLAUSE_MISSING = "E0211": "A clause is missing.",
    NOT_IMPORTED = "E0212": "An imported file cannot be read.",
    CIRCLE = "E0213": "Files, campaigns or monitors go back to themselves.",
    WHICH_NODES = "E0214": "An operation cannot be limited to these nodes.",
    LARGE_MESSAGE = "E0215": "A message holds more values than a runner can.",
    UNKNOWN_UNIT = "E0301": "No such unit.",
    WRONG_UNIT = "E0302": "A quantity measures something else, or lacks its unit.",
    WRONG_TYPE = "E0303": "A value of this type cannot be used here.",
    NOT_A_FORMULA = "E0304": "A formula is not one number over the time of a test.",
    IDLE_CLAUSE = "E0305": "A clause of a metric changes nothing.",
    NOT_A_CONDITION = "E0306": "A condition holds something else than comparisons of metrics.",
    CONSTANT_COMPARISON = "E0307": "A comparison always goes the same way.",
    TEMPORAL_REACH = "E0308": "How far a temporal operator reaches is not said.",
    REVERSED_RANGE = "E0401": "A range begins above its end.",
    OUT_OF_RANGE = "E0402": "A value lies outside of what is permitted.",
    WRONG_CHOICE = "E0403": "A test's choice does not fit the operation's parameter.",
    BAD_WINDOW = "E0404": "A window of time is empty or leaves its operation's `within`.",
    AFTER_THE_END = "E0405": "A window begins when the campaign is already over.",
    NO_DIRECTION = "E0501": "An objective has no direction.",
    BAD_COUNT = "E0502": "A count of operations, tests or repetitions makes no sense.",
    SEARCH_OR_REPEAT = "E0503": "A campaign does two of search, repeat and observe, or none.",
    NOTHING_TO_GROW = "E0504": "No condition that may hold and may not can be made of what a campaign offers.",
    CANNOT_CONTAIN = "E0505": "An operation asks for something that the campaign's conditions cannot contain.",
    NOTHING_TO_EXPLORE = "E0506": "A strategy lacks what it works on: cells, windows of time, or an evolution.",
    BAD_MONITOR = "E0601": "A monitor's guarantees are not in order.",
    BAD_LAB = "E0602": "A setting does not fit the lab's transport.",
    OUTLASTS_THE_END = "W0001": "A window goes on after the campaign's end.",
    UNUSED_OPERATION = "W0002": "No campaign and no test uses the operation.",
    OBJECTIVE_WITHOUT_DEFAULT = "W0003": "An objective may stay without a value.",
    NO_CAMPAIGN = "W0004": "The space has no campaign.",
    EQUALITY_WITHOUT_ROOM = "W0005": "An equality in a robustness is never kept by any amount.",
    ONE_VALUE = "W0010": "An operation permits one value only.",
    UNUSED_METRIC = "W0011": "No campaign measures the metric.",
    MISNAMED_OPERATION = "W0012": "An operation is named for one topic and disturbs another.",
    TWO_PUBLISHERS = "W0013": "Two nodes publish one topic.",
    UNUSED_TOPIC = "W0014": "A topic has no node and no use.",
    UNUSED_EVIDENCE = "W0015": "No guarantee of a monitor needs the evidence or demand.",
    ONE_OUTCOME = "W0016": "A comparison in a formula goes one way whatever is heard.",
    COPIES_OVERLAP = "W0020": "Copies of one operation act at the same time in a known test.",
    EQUAL_SEEDS = "W0021": "Copies of one operation in a known test have equal seeds.",
    NOBODY_HEARS = "W0022": "Nobody hears what an operation disturbs.",
}

/// The page of a code, found by its text in any case, for example `e0203`.
pub fn page(code: &str) -> Option<&'static str> {
    CODES.iter().find(|(known, _)| known.text().eq_ignore_ascii_case(code)).map(|(_, page)| *page)
}
