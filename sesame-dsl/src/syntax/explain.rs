//! What is wrong where the grammar gave up, in words.
//!
//! pest reports only the first failure of a parse and speaks in rule names. So each swallowed stretch is read once more,
//! by the rule its first word asks for, or as the continuation of the construct before it; the furthest failure of that
//! reading is the mistake, and the rules it names are what would fit.

use std::collections::BTreeSet;

use pest::error::{ErrorVariant, InputLocation};
use sesame_grammar::Rule;

use super::limits::parse_bounded;
use super::token::{Token, TokenKind, is_keyword, token_at};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::{FileId, Span};
use crate::units::Unit;

/// A place in the grammar where recovery happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    File,
    System,
    Simulator,
    Process,
    Message,
    Node,
    Hook,
    Custom,
    Test,
    Campaign,
    Condition,
    Search,
    Coverage,
    Boost,
    Construct,
    Predict,
    Novelty,
    Confirm,
    Stop,
    Repeat,
    Launch,
    Budget,
    Eddi,
    Physical,
    Lab,
}

impl Place {
    pub(super) fn error_rule(self) -> Rule {
        match self {
            Place::File => Rule::error_item,
            Place::System => Rule::error_system_member,
            Place::Simulator => Rule::error_simulator_setting,
            Place::Process => Rule::error_process_setting,
            Place::Message => Rule::error_field,
            Place::Node => Rule::error_node_member,
            Place::Hook => Rule::error_hook_member,
            Place::Custom => Rule::error_custom_parameter,
            Place::Test => Rule::error_test_member,
            Place::Campaign => Rule::error_campaign_member,
            Place::Condition => Rule::error_condition_setting,
            Place::Search => Rule::error_search_setting,
            Place::Coverage => Rule::error_coverage_member,
            Place::Boost => Rule::error_boost_setting,
            Place::Construct => Rule::error_construct_setting,
            Place::Predict => Rule::error_predict_setting,
            Place::Novelty => Rule::error_novelty_setting,
            Place::Confirm => Rule::error_confirm_setting,
            Place::Stop => Rule::error_stop_rule,
            Place::Repeat => Rule::error_repeat_setting,
            Place::Launch => Rule::error_launch_setting,
            Place::Budget => Rule::error_budget_setting,
            Place::Eddi => Rule::error_eddi_member,
            Place::Physical => Rule::error_physical_member,
            Place::Lab => Rule::error_lab_setting,
        }
    }

    pub(super) fn member_rules(self) -> &'static [Rule] {
        match self {
            Place::File => &[
                Rule::space,
                Rule::import,
                Rule::system,
                Rule::metric,
                Rule::requirement,
                Rule::operation,
                Rule::test,
                Rule::campaign,
                Rule::eddi,
                Rule::physical,
            ],
            Place::System => &[
                Rule::simulator,
                Rule::message,
                Rule::topic,
                Rule::node,
                Rule::launch,
                Rule::terminate,
                Rule::relay_budget,
            ],
            Place::Simulator => &[Rule::setting_crate, Rule::setting_step],
            Place::Process => &[Rule::setting_step, Rule::free_running],
            Place::Message => &[Rule::field],
            Place::Node => &[Rule::publishes, Rule::subscribes],
            Place::Hook => &[Rule::hook_on],
            Place::Custom => &[Rule::custom_parameter],
            Place::Test => &[Rule::expectation, Rule::test_operation],
            Place::Campaign => &[
                Rule::objectives,
                Rule::operations,
                Rule::observes,
                Rule::activate,
                Rule::search,
                Rule::coverage,
                Rule::boost,
                Rule::construct,
                Rule::predict,
                Rule::novelty,
                Rule::confirm,
                Rule::stop,
                Rule::end,
                Rule::repeat,
                Rule::passive,
                Rule::record,
            ],
            Place::Condition => &[Rule::setting_depth, Rule::setting_integers],
            Place::Search => {
                &[Rule::setting_population, Rule::setting_evaluations, Rule::setting_seed, Rule::setting_neighbours]
            }
            Place::Coverage => {
                &[Rule::coverage_axis, Rule::coverage_hits, Rule::coverage_stop, Rule::coverage_failsafe]
            }
            Place::Boost => &[
                Rule::boost_generations,
                Rule::boost_iterations,
                Rule::boost_tries,
                Rule::boost_children,
                Rule::boost_drop,
            ],
            Place::Construct => &[Rule::construct_share, Rule::construct_until],
            Place::Predict => &[Rule::predict_candidates],
            Place::Novelty => &[Rule::novelty_neighbours, Rule::novelty_over],
            Place::Confirm => &[Rule::confirm_by, Rule::confirm_violations],
            Place::Stop => &[Rule::stop_time, Rule::stop_stagnation, Rule::stop_discovery, Rule::stop_completeness],
            Place::Repeat => &[Rule::setting_seed],
            Place::Launch => &[Rule::ready],
            Place::Budget => &[Rule::setting_latency, Rule::setting_jitter],
            Place::Eddi => &[Rule::demand, Rule::evidence, Rule::guarantee, Rule::otherwise],
            Place::Physical => &[
                Rule::lab_simulator,
                Rule::repeats,
                Rule::cost,
                Rule::exclude,
                Rule::rank,
                Rule::budget,
                Rule::tolerance,
                Rule::interlock,
                Rule::shape,
                Rule::fit,
            ],
            Place::Lab => &[Rule::lab_setting],
        }
    }

    fn one_rule(self) -> Rule {
        match self {
            Place::File => Rule::one_item,
            Place::System => Rule::one_system_member,
            Place::Simulator => Rule::one_simulator_setting,
            Place::Process => Rule::one_process_setting,
            Place::Message => Rule::one_field,
            Place::Node => Rule::one_node_member,
            Place::Hook => Rule::one_hook_member,
            Place::Custom => Rule::one_custom_parameter,
            Place::Test => Rule::one_test_member,
            Place::Campaign => Rule::one_campaign_member,
            Place::Condition => Rule::one_condition_setting,
            Place::Search => Rule::one_search_setting,
            Place::Coverage => Rule::one_coverage_member,
            Place::Boost => Rule::one_boost_setting,
            Place::Construct => Rule::one_construct_setting,
            Place::Predict => Rule::one_predict_setting,
            Place::Novelty => Rule::one_novelty_setting,
            Place::Confirm => Rule::one_confirm_setting,
            Place::Stop => Rule::one_stop_rule,
            Place::Repeat => Rule::one_repeat_setting,
            Place::Launch => Rule::one_launch_setting,
            Place::Budget => Rule::one_budget_setting,
            Place::Eddi => Rule::one_eddi_member,
            Place::Physical => Rule::one_physical_member,
            Place::Lab => Rule::one_lab_setting,
        }
    }

    /// What can stand here, for a message.
    fn members(self) -> &'static str {
        match self {
            Place::File => {
                "a declaration: `space`, `import`, `system`, `metric`, `requirement`, `operation`, `test`, `campaign`, \
                 `eddi` or `physical`"
            }
            Place::System => "`simulator`, `message`, `topic`, `node`, `launch`, `terminate` or `relay budget`",
            Place::Simulator => "`crate` or `step`",
            Place::Process => "`step` or `free running`",
            Place::Message => "a field such as `level: real[mm]`",
            Place::Node => "`publishes` or `subscribes`",
            Place::Hook => "`hook on` and topics",
            Place::Custom => "a parameter such as `points: int [3, 20]`",
            Place::Test => "an operation such as `jitter offset [0.1rad, 0.2rad] from 8s to 57s`, or `expect`",
            Place::Campaign => {
                "`objectives`, `operations`, `observes`, `activate`, `search`, `coverage`, `boost`, `construct`, `predict`, \
                 `novelty`, `confirm`, `stop`, `repeat`, `passive`, `record` or `end after`"
            }
            Place::Condition => "`depth` or `integers`",
            Place::Search => "`population`, `evaluations`, `seed` or `neighbours`",
            Place::Coverage => "a dimension such as `T1 [0, 1] cells 6`, `hits`, `stop at` or `failsafe`",
            Place::Boost => "`every N generations`, `every N iterations`, `from N to N`, `drop N` or `tries N`",
            Place::Construct => "`share` or `until`",
            Place::Predict => "`candidates`",
            Place::Novelty => "`neighbours` or `over`",
            Place::Confirm => "`by mean`, `by median`, `by quantile` and a share, or `violations`",
            Place::Stop => "`time`, `stagnation`, `discovery` or `completeness`",
            Place::Repeat => "`seed`",
            Place::Launch => "`ready when topic`",
            Place::Budget => "`latency` or `jitter`",
            Place::Eddi => "`demand`, `evidence`, `guarantee` or `otherwise`",
            Place::Physical => {
                "`simulator`, `repeats`, `cost`, `exclude`, `rank`, `budget`, `tolerance`, `interlock`, `shape` or `fit`"
            }
            Place::Lab => "a setting such as `step 20ms`",
        }
    }

    /// The words that begin something here.
    fn starters(self) -> &'static [&'static str] {
        match self {
            Place::File => &[
                "space",
                "import",
                "system",
                "metric",
                "requirement",
                "operation",
                "test",
                "campaign",
                "eddi",
                "physical",
            ],
            Place::System => &["simulator", "message", "topic", "node", "launch", "terminate", "relay"],
            Place::Simulator => &["crate", "step"],
            Place::Process => &["step", "free"],
            Place::Message | Place::Custom | Place::Lab => &[],
            Place::Node => &["publishes", "subscribes"],
            Place::Hook => &["hook"],
            Place::Test => &["expect"],
            Place::Campaign => &[
                "objectives",
                "operations",
                "observes",
                "activate",
                "search",
                "coverage",
                "boost",
                "construct",
                "predict",
                "novelty",
                "confirm",
                "stop",
                "repeat",
                "passive",
                "record",
                "end",
            ],
            Place::Condition => &["depth", "integers"],
            Place::Search => &["population", "evaluations", "seed", "neighbours"],
            Place::Coverage => &["hits", "stop", "failsafe"],
            Place::Boost => &["every", "from", "drop", "tries"],
            Place::Construct => &["share", "until"],
            Place::Predict => &["candidates"],
            Place::Novelty => &["neighbours", "over"],
            Place::Confirm => &["by", "violations"],
            Place::Stop => &["time", "stagnation", "discovery", "completeness"],
            Place::Repeat => &["seed"],
            Place::Launch => &["ready"],
            Place::Budget => &["latency", "jitter"],
            Place::Eddi => &["demand", "evidence", "guarantee", "otherwise"],
            Place::Physical => {
                &["simulator", "repeats", "cost", "exclude", "rank", "budget", "tolerance", "interlock", "shape", "fit"]
            }
        }
    }
}

/// The furthest failure of a reading: where, and which rules would have fitted.
struct Failure {
    at: usize,
    expected: Vec<Rule>,
}

fn read(text: &str, lo: usize, hi: usize, rule: Rule) -> Option<Failure> {
    let error = parse_bounded(rule, &text[lo..hi]).err()?;
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => lo + at,
    };
    match error.variant {
        ErrorVariant::ParsingError { positives, .. } => Some(Failure { at, expected: positives }),
        ErrorVariant::CustomError { .. } => None,
    }
}

/// Explains a swallowed stretch, given the good construct before it.
pub(super) fn explain(file: FileId, text: &str, region: Span, place: Place, previous: Option<Span>) -> Diagnostic {
    let span_of = |token: Token<'_>| Span {
        file,
        lo: u32::try_from(token.lo).expect("files are small"),
        hi: u32::try_from(token.hi()).expect("files are small"),
    };
    let [lo, hi] = [region.lo as usize, region.hi as usize];
    let mut first = token_at(text, lo);
    while first.kind == TokenKind::Doc && first.hi() < hi {
        first = token_at(text, first.hi());
    }
    if first.kind == TokenKind::Doc || first.lo >= hi {
        let doc = token_at(text, lo);
        return Diagnostic::new(Code::SYNTAX, span_of(doc), "this doc comment belongs to nothing")
            .label("no declaration follows it")
            .suggest("make it a plain comment", Span { hi: region.lo + 3, ..region }, "//");
    }
    if first.text == "}" {
        let title = "this `}` closes nothing";
        return Diagnostic::new(Code::NOT_CLOSED, span_of(first), title).label("no block is open here");
    }

    let begins = place.starters().contains(&first.text)
        || matches!(place, Place::Message | Place::Custom | Place::Test | Place::Coverage | Place::Lab);
    let continued = previous
        .and_then(|previous| read(text, previous.lo as usize, hi, place.one_rule()))
        .filter(|failure| token_at(text, failure.at).lo >= first.lo);
    let alone = read(text, lo, hi, place.one_rule()).filter(|failure| failure.at >= lo);
    let failure = if begins { alone.or(continued) } else { continued.or(alone) };
    let failure = failure.unwrap_or(Failure { at: first.lo, expected: vec![] });

    let found = token_at(text, failure.at);
    let span = span_of(found);
    let words: BTreeSet<&'static str> = failure.expected.iter().filter_map(|&rule| keyword_of(rule)).collect();
    let wants_name = failure.expected.iter().any(|&rule| {
        matches!(rule, Rule::name | Rule::names | Rule::path | Rule::target | Rule::targets | Rule::condition_variable)
    });
    let expected = describe(&failure, place, found.lo == first.lo);

    let before = text[..found.lo].chars().next_back();
    let after = text[found.hi()..].chars().next();
    let joins = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    if found.text == "-" && joins(before) && joins(after) {
        return Diagnostic::new(Code::NOT_A_NAME, span, "a name cannot hold `-`")
            .label("names are letters, digits and `_`")
            .suggest("use `_`", span, "_");
    }
    if found.kind == TokenKind::OpenText {
        let title = "this text does not end on its line";
        return Diagnostic::new(Code::BAD_TEXT, span, title).label("no closing `\"`");
    }
    if found.kind == TokenKind::Doc {
        return Diagnostic::new(Code::SYNTAX, span, "a doc comment cannot stand here")
            .label(format!("expected {expected}"))
            .note("`///` belongs above a declaration; `//` may stand anywhere");
    }
    let next = token_at(text, found.hi());
    // A keyword that begins the next declaration is in its place: what lacks is the name before it.
    let declares = Place::File.starters().contains(&found.text) || Place::System.starters().contains(&found.text);
    let declares = declares && (next.kind == TokenKind::Word || next.text == "{");
    if wants_name && found.kind == TokenKind::Word && is_keyword(found.text) && !declares {
        return Diagnostic::new(
            Code::KEYWORD_AS_NAME,
            span,
            format!("`{}` is a keyword and cannot be a name", found.text),
        )
        .label("choose another name")
        .suggest("add to it", span, format!("{}_1", found.text));
    }

    let title = match found.kind {
        TokenKind::End => "the file ends in the middle of a declaration".to_owned(),
        TokenKind::Text => format!("unexpected text {}", found.text),
        TokenKind::Number => format!("unexpected number `{}`", found.text),
        _ => format!("unexpected `{}`", found.text),
    };
    let mut diagnostic = Diagnostic::new(Code::SYNTAX, span, title).label(format!("expected {expected}"));
    if found.kind == TokenKind::Word {
        let candidates = words.into_iter().chain(place.starters().iter().copied().filter(|_| found.lo == first.lo));
        // A word of the language is no misspelling of another.
        let known = Rule::all_rules().iter().any(|&rule| keyword_of(rule) == Some(found.text));
        if let Some(similar) = crate::similar::most_similar(found.text, candidates).filter(|_| !known) {
            diagnostic = diagnostic.suggest(format!("`{similar}` is a word that fits here"), span, similar);
        }
        let number_before = before.is_some_and(char::is_whitespace)
            && text[..found.lo].trim_end().ends_with(|c: char| c.is_ascii_digit());
        if number_before && Unit::parse(found.text).is_ok() {
            let gap = text[..found.lo].trim_end().len();
            let gap = Span { lo: u32::try_from(gap).expect("files are small"), hi: span.lo, ..span };
            diagnostic = diagnostic.suggest("glue the unit to its number", gap, "");
        }
        if place == Place::File && Place::System.starters().contains(&found.text) {
            diagnostic = diagnostic.note(format!("`{}` is declared inside of `system {{ … }}`", found.text));
        }
    }
    if found.kind == TokenKind::Sign && found.text == "=" && failure.expected.contains(&Rule::equal_to) {
        diagnostic = diagnostic.suggest("compare with `==`", span, "==");
    }
    diagnostic
}

/// What would fit, in words.
fn describe(failure: &Failure, place: Place, at_start: bool) -> String {
    let mut words = BTreeSet::new();
    let mut members = false;
    for &rule in &failure.expected {
        match rule {
            Rule::EOI => members = true,
            _ if rule == place.one_rule() => members = true,
            _ => {
                if let Some(word) = in_words(rule) {
                    // The words that begin a member are said once, as a group.
                    if keyword_of(rule).is_some_and(|word| place.starters().contains(&word)) && at_start {
                        members = true;
                    } else {
                        words.insert(word);
                    }
                }
            }
        }
    }
    let mut words: Vec<String> = words.into_iter().collect();
    if words.is_empty() {
        return place.members().to_owned();
    }
    if members && at_start {
        words.push(if place == Place::File { "a declaration".to_owned() } else { place.members().to_owned() });
    }
    let last = words.pop().expect("it is not empty");
    if words.is_empty() { last } else { format!("{} or {last}", words.join(", ")) }
}

/// The word a keyword rule stands for.
fn keyword_of(rule: Rule) -> Option<&'static str> {
    // Rule names are the words with a prefix.
    rule_name(rule).strip_prefix("k_")
}

fn rule_name(rule: Rule) -> &'static str {
    static NAMES: std::sync::LazyLock<Vec<(Rule, String)>> =
        std::sync::LazyLock::new(|| Rule::all_rules().iter().map(|&rule| (rule, format!("{rule:?}"))).collect());
    NAMES.iter().find(|(known, _)| *known == rule).map_or("", |(_, name)| name)
}

/// A rule as people call it; `None` for what is not worth naming: recovery, comments, constructs of later versions.
fn in_words(rule: Rule) -> Option<String> {
    let words = match rule {
        Rule::equals => "`=`",
        Rule::colon | Rule::metric_type => "`:`",
        Rule::comma => "`,`",
        Rule::dots => "`..`",
        Rule::paren_open => "`(`",
        Rule::paren_close | Rule::point_end => "`)`",
        Rule::bracket_open => "`[`",
        Rule::bracket_close => "`]`",
        Rule::open
        | Rule::custom_parameters
        | Rule::hook_block
        | Rule::simulator_settings
        | Rule::process_settings
        | Rule::search_settings
        | Rule::boost_settings
        | Rule::construct_settings
        | Rule::predict_settings
        | Rule::confirm_settings
        | Rule::stop_settings
        | Rule::launch_settings
        | Rule::budget_settings
        | Rule::lab_settings
        | Rule::repeat_settings
        | Rule::condition_settings => "`{`",
        Rule::close => "`}`",
        Rule::name
        | Rule::names
        | Rule::path
        | Rule::target
        | Rule::targets
        | Rule::identifier
        | Rule::condition_variable => "a name",
        Rule::field_name | Rule::field => "a field such as `level: real[mm]`",
        Rule::text | Rule::texts => "a text in double quotes",
        Rule::number | Rule::count => "a number",
        Rule::signed | Rule::quantity => "a quantity such as `20ms`",
        Rule::range => "a range such as `[0s, 65s]`",
        Rule::unit | Rule::unit_symbol => "a unit",
        Rule::unit_in_brackets => "a unit in brackets",
        Rule::type_of | Rule::scalar_type | Rule::message_type => "a type such as `real[mm]`",
        Rule::bound => "a bound such as `<= 0` or `in [1, 40]`",
        Rule::at_most => "`<=`",
        Rule::at_least => "`>=`",
        Rule::equal_to => "`==`",
        Rule::not_equal => "`!=`",
        Rule::below => "`<`",
        Rule::above => "`>`",
        Rule::bound_within => "`in`",
        Rule::parameter_name | Rule::choice => "a parameter such as `offset`, `value`, `loss` or `delay`",
        Rule::window | Rule::from_nodes | Rule::campaign_from | Rule::boost_children => "`from`",
        Rule::moment => "`before start`",
        Rule::until_condition | Rule::construct_until => "`until`",
        Rule::for_length | Rule::for_lengths => "`for`",
        Rule::at_most_times => "`at most`",
        Rule::may_overlap => "`may overlap`",
        Rule::at_most_once => "`each at most once`",
        Rule::by_condition => "`condition`",
        Rule::start_contains => "`start contains`",
        Rule::contained_integer => "`integer`",
        Rule::initial_value => "`initial`",
        Rule::trend => "`rising` or `falling`",
        Rule::accepts => "`accepts non_finite`",
        Rule::custom => "`custom`",
        Rule::custom_parameter => "a parameter such as `points: int [3, 20]`",
        Rule::domain | Rule::number_domain | Rule::point_domain | Rule::text_domain | Rule::file_domain => {
            "what is permitted, such as `int [3, 20]`"
        }
        Rule::point => "a point such as `(1, 0, -0.5)m`",
        Rule::coordinate => "a number without unit",
        Rule::draw_seed | Rule::setting_seed => "`seed`",
        Rule::dimension | Rule::coverage_axis => "a dimension such as `T1 [0, 1] cells 6`",
        Rule::coverage_hits => "`hits`",
        Rule::coverage_stop => "`stop at`",
        Rule::coverage_failsafe => "`failsafe`",
        Rule::boost_generations => "`every 2 generations`",
        Rule::boost_iterations => "`every 2 iterations`",
        Rule::boost_tries => "`tries`",
        Rule::boost_drop => "`drop`",
        Rule::construct_share => "`share`",
        Rule::predict_candidates => "`candidates`",
        Rule::confirm_by => "`by`",
        Rule::confirm_violations => "`violations`",
        Rule::stop_time => "`time`",
        Rule::stop_stagnation => "`stagnation`",
        Rule::stop_discovery => "`discovery`",
        Rule::stop_completeness => "`completeness`",
        Rule::within => "`within`",
        Rule::priority => "`priority`",
        Rule::inclusion => "`inclusion`",
        Rule::untimed => "`untimed`",
        Rule::to_nodes => "`to`",
        Rule::held => "`held`",
        Rule::stale => "`stale after`",
        Rule::mitigation => "`mitigate with`",
        Rule::lab_transport => "a simulator kind such as `simlog`",
        Rule::lab_setting | Rule::lab_setting_name => "a setting such as `step 20ms`",
        Rule::rank_key | Rule::tolerated => "a metric",
        Rule::per_operation => "`, plus … per operation`",
        Rule::sphere => "`sphere`",
        Rule::cuboid => "`box`",
        Rule::carried => "`on pose`",
        Rule::fixed => "`at`",
        Rule::expand => "`expand`",
        Rule::fit_delay => "`relay delay`",
        Rule::fit_parameter => "`parameter`",
        Rule::drain => "`drain`",
        Rule::direction => "`maximise` or `minimise`",
        Rule::default_value => "`default`",
        Rule::value_mode => "`offset` or `absolute`",
        Rule::in_process => "`in_process`",
        Rule::process => "`process`",
        Rule::free_running | Rule::k_free => "`free running`",
        Rule::k_running => "`running`",
        Rule::random_value => "`random`",
        Rule::packet_loss | Rule::k_packet => "`packet loss`",
        Rule::stuck_at | Rule::k_stuck => "`stuck at`",
        Rule::bias => "`bias`",
        Rule::drift => "`drift`",
        Rule::noise => "`noise`",
        Rule::scale => "`scale`",
        Rule::not_finite => "`nan` or `infinity`",
        Rule::freeze => "`freeze`",
        Rule::stale_value => "`stale`",
        Rule::clock_skew | Rule::k_clock => "`clock skew`",
        Rule::burst_loss | Rule::k_burst => "`burst loss`",
        Rule::burst_enter => "`enter`",
        Rule::burst_leave => "`leave`",
        Rule::burst_drops => "`loss`",
        Rule::rate_limit | Rule::k_rate => "`rate limit`",
        Rule::reorder => "`reorder`",
        Rule::duplicate => "`duplicate`",
        Rule::distribution => "a distribution such as `uniform`",
        Rule::corners => "a box such as `[(0, 0, 0)m, (1, 1, 1)m]`",
        Rule::latency => "`latency`",
        Rule::blackhole => "`blackhole`",
        Rule::formula => "a formula such as `last(cycle)`",
        Rule::expression
        | Rule::switch
        | Rule::switch_conjunction
        | Rule::disjunction
        | Rule::conjunction
        | Rule::passage
        | Rule::relation
        | Rule::prefix
        | Rule::sum
        | Rule::product
        | Rule::factor
        | Rule::call
        | Rule::function
        | Rule::members
        | Rule::truth => "a value such as `link0 - 2.5rad`",
        Rule::plus => "`+`",
        Rule::times | Rule::each_element => "`*`",
        Rule::over => "`/`",
        Rule::trigger | Rule::when_then | Rule::formula_when => "`when`",
        Rule::formula_every => "`every`",
        Rule::formula_per => "`per`",
        Rule::formula_outbound => "`outbound`",
        Rule::formula_whole => "`whole windows`",
        Rule::fuzzing_time => "`fuzzing_time()`",
        Rule::minus
        | Rule::k_not
        | Rule::k_always
        | Rule::k_eventually
        | Rule::k_implies
        | Rule::k_node
        | Rule::k_parameter
        | Rule::element => return None,
        _ => return keyword_of(rule).map(|word| format!("`{word}`")),
    };
    Some(words.to_owned())
}
