//! The blocks of the grammar and their members, as one table.
//!
//! The parser reads a block by its row. A message about a syntax error takes from it what can stand at a place and
//! which word was probably meant. A new block is its rules in the grammar and a row here.

use sesame_grammar::Rule;
use sesame_plan::Setting;

/// A construct with members, most of them in braces.
#[derive(Debug)]
pub(super) struct Block {
    /// The rule of the pair whose children are the members.
    pub(super) rule: Rule,
    /// What a message calls the construct that the block belongs to.
    pub(super) name: &'static str,
    /// Swallows what is not a member.
    pub(super) error: Rule,
    /// Accepts one member of this block, and nothing after it.
    pub(super) one: Rule,
    /// In the order in which a message lists them; one that is written in several ways has a row for each.
    pub(super) members: &'static [Member],
}

/// What can stand in a block.
#[derive(Debug)]
pub(super) struct Member {
    /// Its rule.
    pub(super) rule: Rule,
    /// The word that begins it; `None` for a member that begins with a name.
    pub(super) word: Option<&'static str>,
    /// How a message calls it: its first words, or for a member that begins with a name a phrase with an example.
    example: &'static str,
    /// Whether the name after its word is one that the rest of the space can mention.
    pub(super) declares: bool,
}

impl Member {
    const fn new(rule: Rule, word: &'static str) -> Member {
        Member { rule, word: Some(word), example: word, declares: false }
    }

    const fn like(rule: Rule, word: &'static str, example: &'static str) -> Member {
        Member { rule, word: Some(word), example, declares: false }
    }

    const fn declaration(rule: Rule, word: &'static str) -> Member {
        Member { rule, word: Some(word), example: word, declares: true }
    }

    const fn named(rule: Rule, example: &'static str) -> Member {
        Member { rule, word: None, example, declares: false }
    }

    /// The member in a message.
    pub(super) fn phrase(&self) -> String {
        if self.word.is_some() { format!("`{}`", self.example) } else { self.example.to_owned() }
    }
}

impl Block {
    /// A block whose members all begin with a word. The grammar swallows what is not a member word by word.
    const fn settings(rule: Rule, name: &'static str, members: &'static [Member]) -> Block {
        Block { rule, name, error: Rule::error_setting, one: Rule::one_setting, members }
    }

    /// The words that begin its members.
    pub(super) fn words(&self) -> impl Iterator<Item = &'static str> {
        self.members.iter().filter_map(|member| member.word)
    }

    /// Whether a member can begin with this word.
    pub(super) fn begins_with(&self, word: &str) -> bool {
        self.words().any(|known| known == word)
    }

    /// Whether a member can begin with a name.
    pub(super) fn begins_with_a_name(&self) -> bool {
        self.members.iter().any(|member| member.word.is_none())
    }
}

/// The block of a rule of [`BLOCKS`].
pub(super) fn block(rule: Rule) -> &'static Block {
    find(rule).unwrap_or_else(|| panic!("{rule:?} has no row in the table of blocks"))
}

/// The block of a rule, if it has one.
pub(super) fn find(rule: Rule) -> Option<&'static Block> {
    BLOCKS.iter().find(|block| block.rule == rule)
}

/// The members of a rule, in the first block that has any.
pub(super) fn members(rule: Rule) -> impl Iterator<Item = &'static Member> {
    let of = move |block: &&'static Block| block.members.iter().any(|member| member.rule == rule);
    BLOCKS.iter().find(of).into_iter().flat_map(|block| block.members).filter(move |member| member.rule == rule)
}

/// Whether a word declares something that the rest of the space can mention by the name after it.
pub(super) fn declares(word: &str) -> bool {
    BLOCKS.iter().flat_map(|block| block.members).any(|member| member.declares && member.word == Some(word))
}

/// The settings of a search: those of single strategies, then those of all.
const SEARCH_SETTINGS: [Member; Setting::ALL.len() + 4] = {
    let mut members = [const { Member::new(Rule::setting_neighbours, "neighbours") }; Setting::ALL.len() + 4];
    let mut at = 0;
    while at < Setting::ALL.len() {
        members[at] = Member::new(Rule::strategy_setting, Setting::ALL[at].keyword());
        at += 1;
    }
    members[at] = Member::new(Rule::setting_evaluations, "evaluations");
    members[at + 1] = Member::new(Rule::setting_seed, "seed");
    members[at + 2] = Member::new(Rule::setting_causes, "keep");
    members
};

/// All blocks of the language.
pub(super) const BLOCKS: &[Block] = &[
    Block {
        rule: Rule::file,
        name: "file",
        error: Rule::error_item,
        one: Rule::one_item,
        members: &[
            Member::new(Rule::space, "space"),
            Member::new(Rule::import, "import"),
            Member::new(Rule::system, "system"),
            Member::declaration(Rule::metric, "metric"),
            Member::declaration(Rule::requirement, "requirement"),
            Member::declaration(Rule::scene_parameter, "parameter"),
            Member::declaration(Rule::operation, "operation"),
            Member::declaration(Rule::test, "test"),
            Member::declaration(Rule::campaign, "campaign"),
            Member::declaration(Rule::eddi, "eddi"),
            Member::declaration(Rule::physical, "physical"),
        ],
    },
    Block {
        rule: Rule::system,
        name: "system",
        error: Rule::error_system_member,
        one: Rule::one_system_member,
        members: &[
            Member::declaration(Rule::simulator, "simulator"),
            Member::declaration(Rule::message, "message"),
            Member::declaration(Rule::topic, "topic"),
            Member::declaration(Rule::service, "service"),
            Member::declaration(Rule::action, "action"),
            Member::declaration(Rule::node, "node"),
            Member::new(Rule::launch, "launch"),
            Member::new(Rule::terminate, "terminate"),
            Member::like(Rule::relay_budget, "relay", "relay budget"),
        ],
    },
    Block::settings(
        Rule::simulator_settings,
        "simulator",
        &[Member::new(Rule::setting_crate, "crate"), Member::new(Rule::setting_step, "step")],
    ),
    Block::settings(
        Rule::process_settings,
        "process",
        &[Member::new(Rule::setting_step, "step"), Member::like(Rule::free_running, "free", "free running")],
    ),
    Block::settings(
        Rule::ros2_settings,
        "ros2",
        &[
            Member::new(Rule::setting_domain, "domain"),
            Member::new(Rule::setting_types, "types"),
            Member::new(Rule::setting_clock, "clock"),
            Member::new(Rule::step_by, "step"),
            Member::like(Rule::setting_reset, "reset", "reset by service"),
        ],
    ),
    Block::settings(
        Rule::rosbridge_settings,
        "rosbridge",
        &[
            Member::new(Rule::setting_domain, "domain"),
            Member::new(Rule::setting_types, "types"),
            Member::new(Rule::setting_clock, "clock"),
            Member::like(Rule::setting_reset, "reset", "reset by service"),
            Member::new(Rule::setting_dialect, "dialect"),
            Member::new(Rule::setting_compression, "compression"),
            Member::like(Rule::setting_token, "token", "token from"),
            Member::new(Rule::setting_trust, "trust"),
            Member::new(Rule::proxy, "proxy"),
        ],
    ),
    Block::settings(
        Rule::proxy_settings,
        "proxy",
        &[
            Member::like(Rule::setting_token, "token", "token from"),
            Member::new(Rule::setting_certificate, "certificate"),
            Member::new(Rule::setting_key, "key"),
            Member::new(Rule::setting_public, "public"),
        ],
    ),
    Block::settings(
        Rule::ros1_settings,
        "ros1",
        &[
            Member::new(Rule::setting_types, "types"),
            Member::new(Rule::setting_clock, "clock"),
            Member::like(Rule::setting_reset, "reset", "reset by service"),
        ],
    ),
    Block::settings(
        Rule::mqtt_settings,
        "mqtt",
        &[
            Member::new(Rule::setting_quality, "quality"),
            Member::new(Rule::setting_user, "user"),
            Member::like(Rule::setting_password, "password", "password from"),
            Member::new(Rule::setting_trust, "trust"),
        ],
    ),
    Block::settings(
        Rule::simlog_settings,
        "simlog",
        &[
            Member::new(Rule::setting_step, "step"),
            Member::new(Rule::setting_protocol, "protocol"),
            Member::like(Rule::setting_topics, "topics", "topics at"),
            Member::new(Rule::setting_marker, "marker"),
            Member::new(Rule::setting_settle, "settle"),
            Member::new(Rule::setting_trust, "trust"),
            Member::new(Rule::setting_prefix, "prefix"),
            Member::new(Rule::setting_cut, "cut"),
            Member::new(Rule::setting_heard, "heard"),
            Member::new(Rule::setting_injected, "injected"),
            Member::new(Rule::setting_bare, "bare"),
        ],
    ),
    Block::settings(
        Rule::mavlink_settings,
        "mavlink",
        &[Member::new(Rule::setting_types, "types"), Member::new(Rule::proxy, "proxy")],
    ),
    Block::settings(Rule::launch_settings, "launch", &[Member::like(Rule::ready, "ready", "ready when")]),
    Block::settings(
        Rule::budget_settings,
        "relay budget",
        &[Member::new(Rule::setting_latency, "latency"), Member::new(Rule::setting_jitter, "jitter")],
    ),
    Block {
        rule: Rule::message,
        name: "message",
        error: Rule::error_field,
        one: Rule::one_field,
        members: &[
            Member::named(Rule::field, "a field such as `level: real[mm]`"),
            Member::new(Rule::constant, "constant"),
        ],
    },
    Block {
        rule: Rule::node,
        name: "node",
        error: Rule::error_node_member,
        one: Rule::one_node_member,
        members: &[
            Member::new(Rule::publishes, "publishes"),
            Member::new(Rule::subscribes, "subscribes"),
            Member::new(Rule::serves, "serves"),
            Member::new(Rule::calls, "calls"),
            Member::new(Rule::launch, "launch"),
            Member::new(Rule::answers, "answers"),
            Member::like(Rule::every_step, "every", "every step"),
            Member::new(Rule::broker, "broker"),
        ],
    },
    Block {
        rule: Rule::hook_block,
        name: "metric",
        error: Rule::error_hook_member,
        one: Rule::one_hook_member,
        members: &[Member::like(Rule::hook_on, "hook", "hook on")],
    },
    Block {
        rule: Rule::custom_parameters,
        name: "operation",
        error: Rule::error_custom_parameter,
        one: Rule::one_custom_parameter,
        members: &[Member::named(Rule::custom_parameter, "a parameter such as `points: int [3, 20]`")],
    },
    Block {
        rule: Rule::test,
        name: "test",
        error: Rule::error_test_member,
        one: Rule::one_test_member,
        members: &[
            Member::named(Rule::test_operation, "an operation such as `jitter offset [0.1rad, 0.2rad] from 8s to 57s`"),
            Member::new(Rule::expectation, "expect"),
            Member::like(Rule::simulator_seed, "simulator", "simulator seed"),
        ],
    },
    Block {
        rule: Rule::campaign,
        name: "campaign",
        error: Rule::error_campaign_member,
        one: Rule::one_campaign_member,
        members: &[
            Member::new(Rule::objectives, "objectives"),
            Member::new(Rule::operations, "operations"),
            Member::new(Rule::observes, "observes"),
            Member::new(Rule::activate, "activate"),
            Member::new(Rule::search, "search"),
            Member::new(Rule::coverage, "coverage"),
            Member::new(Rule::boost, "boost"),
            Member::new(Rule::construct, "construct"),
            Member::new(Rule::predict, "predict"),
            Member::new(Rule::novelty, "novelty"),
            Member::new(Rule::confirm, "confirm"),
            Member::new(Rule::stop, "stop"),
            Member::new(Rule::repeat, "repeat"),
            Member::new(Rule::passive, "passive"),
            Member::new(Rule::record, "record"),
            Member::like(Rule::end, "end", "end after"),
        ],
    },
    Block::settings(
        Rule::condition_settings,
        "condition",
        &[Member::new(Rule::setting_depth, "depth"), Member::new(Rule::setting_integers, "integers")],
    ),
    Block::settings(Rule::search_settings, "search", &SEARCH_SETTINGS),
    Block {
        rule: Rule::coverage,
        name: "coverage",
        error: Rule::error_coverage_member,
        one: Rule::one_coverage_member,
        members: &[
            Member::named(Rule::coverage_axis, "a dimension such as `T1 [0, 1] cells 6`"),
            Member::new(Rule::coverage_hits, "hits"),
            Member::like(Rule::coverage_stop, "stop", "stop at"),
            Member::new(Rule::coverage_failsafe, "failsafe"),
        ],
    },
    Block::settings(
        Rule::boost_settings,
        "boost",
        &[
            Member::like(Rule::boost_generations, "every", "every N generations"),
            Member::like(Rule::boost_iterations, "every", "every N iterations"),
            Member::like(Rule::boost_children, "from", "from N to N"),
            Member::like(Rule::boost_drop, "drop", "drop N"),
            Member::like(Rule::boost_tries, "tries", "tries N"),
        ],
    ),
    Block::settings(
        Rule::construct_settings,
        "construct",
        &[Member::new(Rule::construct_share, "share"), Member::new(Rule::construct_until, "until")],
    ),
    Block::settings(Rule::predict_settings, "predict", &[Member::new(Rule::predict_candidates, "candidates")]),
    Block::settings(
        Rule::novelty_settings,
        "novelty",
        &[Member::new(Rule::novelty_neighbours, "neighbours"), Member::new(Rule::novelty_over, "over")],
    ),
    Block::settings(
        Rule::confirm_settings,
        "confirm",
        &[
            Member::like(Rule::confirm_by, "by", "by mean"),
            Member::like(Rule::confirm_by, "by", "by median"),
            Member::like(Rule::confirm_by, "by", "by quantile 90%"),
            Member::new(Rule::confirm_violations, "violations"),
        ],
    ),
    Block::settings(
        Rule::stop_settings,
        "stop",
        &[
            Member::new(Rule::stop_time, "time"),
            Member::new(Rule::stop_stagnation, "stagnation"),
            Member::new(Rule::stop_discovery, "discovery"),
            Member::new(Rule::stop_completeness, "completeness"),
            Member::like(Rule::stop_causes, "no", "no new cause in 40 tests"),
            Member::like(Rule::stop_pairs, "every", "every pair"),
        ],
    ),
    Block::settings(Rule::repeat_settings, "repeat", &[Member::new(Rule::setting_seed, "seed")]),
    Block {
        rule: Rule::eddi,
        name: "eddi",
        error: Rule::error_eddi_member,
        one: Rule::one_eddi_member,
        members: &[
            Member::new(Rule::demand, "demand"),
            Member::new(Rule::evidence, "evidence"),
            Member::new(Rule::guarantee, "guarantee"),
            Member::new(Rule::otherwise, "otherwise"),
        ],
    },
    Block {
        rule: Rule::physical,
        name: "physical",
        error: Rule::error_physical_member,
        one: Rule::one_physical_member,
        members: &[
            Member::new(Rule::simulator, "simulator"),
            Member::new(Rule::repeats, "repeats"),
            Member::new(Rule::cost, "cost"),
            Member::new(Rule::exclude, "exclude"),
            Member::new(Rule::rank, "rank"),
            Member::new(Rule::budget, "budget"),
            Member::new(Rule::tolerance, "tolerance"),
            Member::new(Rule::interlock, "interlock"),
            Member::new(Rule::shape, "shape"),
            Member::new(Rule::fit, "fit"),
        ],
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The text between the braces of a rule of the grammar.
    fn body(rule: &str) -> &'static str {
        let grammar = sesame_grammar::GRAMMAR;
        let at = grammar
            .match_indices(rule)
            .map(|(at, _)| at)
            .find(|&at| {
                let before = grammar[..at].ends_with('\n');
                let after = grammar[at + rule.len()..].trim_start();
                before && after.starts_with('=')
            })
            .unwrap_or_else(|| panic!("the grammar has a rule {rule}"));
        let end = grammar[at..].find("\n}").into_iter().chain(grammar[at..].find("}\n")).min().expect("a rule ends");
        &grammar[at..=at + end]
    }

    #[test]
    fn each_member_begins_with_its_word_in_the_grammar_too() {
        for member in BLOCKS.iter().flat_map(|block| block.members) {
            let rule = format!("{:?}", member.rule);
            let text = body(&rule);
            let (_, text) = text.split_once('{').expect("a rule has a body");
            let first = text.trim_start().strip_prefix("docs ~").unwrap_or(text).trim_start();
            match member.word {
                Some(word) => {
                    // One word, or several in parentheses of which it is one.
                    let group = first.strip_prefix('(').and_then(|rest| rest.split_once(')'));
                    let words = group.map_or(first.split(['~', '}']).next().unwrap(), |(words, _)| words);
                    let listed = words.split('|').any(|listed| listed.trim() == format!("k_{word}"));
                    assert!(listed, "{rule} begins with `{word}` in the table, and with {first} in the grammar");
                }
                None => assert!(!first.starts_with("k_"), "{rule} begins with a word in the grammar: {first}"),
            }
        }
    }

    #[test]
    fn a_setting_that_the_table_has_is_one_that_the_grammar_explains() {
        let one = body("one_setting").to_owned() + body("setting");
        for block in BLOCKS.iter().filter(|block| block.one == Rule::one_setting) {
            for member in block.members {
                let rule = format!("{:?}", member.rule);
                let listed = one.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == rule);
                assert!(listed, "`setting` of the grammar lacks {rule}");
            }
        }
    }
}
