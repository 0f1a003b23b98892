//! The kinds of diagnostics, each with a page that `sesamec explain` prints.

/// Whether a diagnostic stops the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// There is no model.
    Error,
    /// There is a model, but it probably does not do what was intended.
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

        /// What each code is about, in a sentence, sorted by code.
        pub const MEANINGS: &[(Code, &str)] = &[$((Code::$name, $what),)*];
    };
}

codes! {
    SYNTAX = "E0101": "The text does not follow the grammar.",
    KEYWORD_AS_NAME = "E0102": "A keyword is used as a name.",
    NOT_CLOSED = "E0103": "A block is not closed, or a closing brace matches no block.",
    NOT_SUPPORTED = "E0104": "The language has the construct, but this version of the compiler does not support it.",
    TOO_LARGE = "E0105": "The file is too large or too deeply nested.",
    NOT_A_NAME = "E0106": "A name contains characters that are not allowed.",
    BAD_TEXT = "E0107": "A quoted text does not end, is empty, or contains an unknown escape or a control character.",
    BAD_NUMBER = "E0108": "A number is out of range, or not whole where it must be.",
    DEFINED_TWICE = "E0201": "A name is defined twice.",
    MISSING_DECLARATION = "E0202": "A space lacks a required declaration, or has it twice.",
    UNKNOWN_NAME = "E0203": "There is no such topic, metric, operation, test, message, field or setting.",
    OTHER_KIND = "E0204": "A name stands for something that cannot be used here.",
    RECURSIVE_MESSAGE = "E0205": "A message contains itself.",
    SAME_PATH = "E0206": "Two topics have the same path.",
    BAD_PATH = "E0207": "The path of a topic, simulator, program or file is malformed.",
    GENERATED_COLLISION = "E0208": "Two names of one kind collide in the generated code.",
    LISTED_TWICE = "E0209": "A list contains a name twice.",
    CLAUSE_TWICE = "E0210": "A clause is given twice.",
    CLAUSE_MISSING = "E0211": "A clause is missing.",
    NOT_IMPORTED = "E0212": "An imported file cannot be read.",
    CIRCLE = "E0213": "Files, campaigns or monitors depend on themselves.",
    WHICH_NODES = "E0214": "An operation cannot be limited to these nodes.",
    LARGE_MESSAGE = "E0215": "A message has more values than a runner supports.",
    NO_LAYOUT = "E0216": "The definition of a message cannot be found or used, or is not what the space says.",
    NOT_ROS = "E0217": "Something of ROS is used with another simulator, or is missing with one of ROS 2.",
    PLACEHOLDER = "E0218": "An argument of a launched program has a placeholder that nothing replaces.",
    NOTHING_TO_LAUNCH = "E0219": "A command is launched for a simulator that is part of the runner.",
    NODE_OUT_OF_REACH = "E0220": "An operation acts on a node, or its parameter, that a runner does not reach.",
    BAD_ADDRESS = "E0221": "The address of a simulator or broker is malformed, or a secret would go there in plain text.",
    NOT_OPTIONAL = "E0222": "A field is optional where messages have all of their fields.",
    UNKNOWN_UNIT = "E0301": "There is no such unit.",
    WRONG_UNIT = "E0302": "A quantity has the wrong dimension or no unit.",
    WRONG_TYPE = "E0303": "A value of this type cannot be used here.",
    NOT_A_FORMULA = "E0304": "A formula does not reduce values over time to a single number.",
    IDLE_CLAUSE = "E0305": "A clause of a metric has no effect.",
    NOT_A_CONDITION = "E0306": "A condition contains something other than comparisons of metrics.",
    CONSTANT_COMPARISON = "E0307": "A comparison has the same outcome in every test.",
    TEMPORAL_REACH = "E0308": "The scope of a temporal operator is ambiguous.",
    BAD_REGION = "E0309": "The corners of a region do not enclose exactly one region.",
    UNPAIRED = "E0310": "Members of groups are read together that do not belong together.",
    REVERSED_RANGE = "E0401": "A range begins above its end.",
    OUT_OF_RANGE = "E0402": "A value is outside the permitted range.",
    WRONG_CHOICE = "E0403": "A test's choice does not fit the operation's parameter.",
    BAD_WINDOW = "E0404": "A window of time is empty, reversed, outside its operation's `within`, or not as long as permitted.",
    AFTER_THE_END = "E0405": "An operation has no window before the campaign's tests end.",
    NO_DIRECTION = "E0501": "An objective has no direction.",
    BAD_COUNT = "E0502": "A count of operations, tests or repetitions is invalid.",
    SEARCH_OR_REPEAT = "E0503": "A campaign does not do exactly one of search, repeat and observe.",
    NOTHING_TO_GROW = "E0504": "Every condition that a campaign could grow is constant.",
    CANNOT_CONTAIN = "E0505": "An operation requires something that the campaign's conditions cannot contain, or lengths that its activations do not have.",
    NOTHING_TO_EXPLORE = "E0506": "A strategy lacks what it needs: cells, time windows, conditions, requirements or NSGA-II.",
    BAD_MONITOR = "E0601": "Evidence, guarantees or mitigation of a monitor are not in order.",
    BAD_LAB = "E0602": "The simulator of a lab cannot stand in the place of the system's.",
    NEVER_HOLDS = "E0603": "A guarantee of a monitor can never hold.",
    OUTLASTS_THE_END = "W0001": "A window extends beyond the campaign's end.",
    UNUSED_OPERATION = "W0002": "No campaign and no test uses the operation.",
    OBJECTIVE_WITHOUT_DEFAULT = "W0003": "An objective has no default value.",
    NO_CAMPAIGN = "W0004": "The space has no campaign.",
    EQUALITY_WITHOUT_ROOM = "W0005": "An equality cannot have a positive robustness.",
    ONE_VALUE = "W0010": "An operation permits only one value.",
    UNUSED_METRIC = "W0011": "No campaign measures the metric.",
    MISNAMED_OPERATION = "W0012": "An operation is named after one topic and disturbs another.",
    TWO_PUBLISHERS = "W0013": "Two nodes publish the same topic.",
    UNUSED_TOPIC = "W0014": "A topic is never used.",
    UNUSED_EVIDENCE = "W0015": "No guarantee of a monitor uses the evidence or demand.",
    ONE_OUTCOME = "W0016": "A comparison in a formula is constant.",
    ALWAYS_HOLDS = "W0017": "A guarantee of a monitor always holds.",
    NEVER_THE_STATE = "W0018": "A guarantee is never the state of its monitor: a stronger one holds whenever it does.",
    IDLE_EVIDENCE = "W0019": "Evidence of a monitor decides nothing.",
    COPIES_OVERLAP = "W0020": "Copies of one operation are active at the same time in a test.",
    EQUAL_SEEDS = "W0021": "Copies of one operation in a test have equal seeds.",
    NOBODY_HEARS = "W0022": "No node subscribes to what an operation disturbs.",
    WEAKER_FAILS = "W0023": "A guarantee of a monitor may hold while a weaker one does not.",
}

/// The page of a code, found by its text in any case, for example `e0203`.
pub fn page(code: &str) -> Option<&'static str> {
    CODES.iter().find(|(known, _)| known.text().eq_ignore_ascii_case(code)).map(|(_, page)| *page)
}
