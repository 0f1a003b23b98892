//! What messages call the rules of the grammar.

use std::collections::HashMap;
use std::sync::LazyLock;

use sesame_grammar::Rule;
use sesame_plan::SimulatorKind;

use super::blocks;

/// The word a keyword rule stands for.
pub(super) fn keyword_of(rule: Rule) -> Option<&'static str> {
    // Rule names are the words with a prefix.
    rule_name(rule).strip_prefix("k_")
}

/// The name of a rule in the grammar; empty for the end of the text, which is not in it.
pub(super) fn rule_name(rule: Rule) -> &'static str {
    static NAMES: LazyLock<HashMap<Rule, String>> =
        LazyLock::new(|| Rule::all_rules().iter().map(|&rule| (rule, format!("{rule:?}"))).collect());
    NAMES.get(&rule).map_or("", String::as_str)
}

/// What a message calls a rule; nothing for what is not worth naming: recovery, comments, constructs of later versions.
pub(super) fn phrases_of(rule: Rule) -> Vec<String> {
    let phrases: &[&str] = match rule {
        Rule::equals => &["`=`"],
        Rule::colon | Rule::metric_type => &["`:`"],
        Rule::comma => &["`,`"],
        Rule::dots => &["`..`"],
        Rule::paren_open => &["`(`"],
        Rule::paren_close | Rule::point_end => &["`)`"],
        Rule::bracket_open => &["`[`"],
        Rule::bracket_close => &["`]`"],
        Rule::open => &["`{`"],
        Rule::close => &["`}`"],
        Rule::name
        | Rule::names
        | Rule::with_member
        | Rule::with_members
        | Rule::path
        | Rule::target
        | Rule::targets
        | Rule::identifier
        | Rule::metric_name
        | Rule::metric_names
        | Rule::condition_variable => &["a name"],
        Rule::field_name => &["a field such as `level: real[mm]`"],
        Rule::text | Rule::texts => &["a text in double quotes"],
        Rule::number | Rule::count => &["a number"],
        Rule::signed | Rule::quantity => &["a quantity such as `20ms`"],
        Rule::range => &["a range such as `[0s, 65s]`"],
        Rule::unit | Rule::unit_symbol => &["a unit"],
        Rule::unit_in_brackets => &["a unit in brackets"],
        Rule::type_of | Rule::scalar_type | Rule::message_type => &["a type such as `real[mm]`"],
        Rule::bound => &["a bound such as `<= 0` or `in [1, 40]`"],
        Rule::at_most => &["`<=`"],
        Rule::at_least => &["`>=`"],
        Rule::equal_to => &["`==`"],
        Rule::not_equal => &["`!=`"],
        Rule::below => &["`<`"],
        Rule::above => &["`>`"],
        Rule::bound_within | Rule::k_in => &["`in`"],
        Rule::scene_type => &["`real` or `int`"],
        Rule::parameter_name | Rule::choice => &["a parameter such as `offset`, `value`, `loss` or `delay`"],
        Rule::window | Rule::from_nodes | Rule::campaign_from => &["`from`"],
        Rule::moment => &["`before start`"],
        Rule::until_condition => &["`until`"],
        Rule::end_when => &["`or when`"],
        Rule::for_length | Rule::for_lengths => &["`for`"],
        Rule::at_most_times => &["`at most`"],
        Rule::may_overlap => &["`may overlap`"],
        Rule::at_most_once => &["`each at most once`"],
        Rule::by_condition => &["`condition`"],
        Rule::start_contains => &["`start contains`"],
        Rule::contained_integer => &["`integer`"],
        Rule::initial_value => &["`initial`"],
        Rule::trend => &["`rising`", "`falling`"],
        Rule::accepts => &["`accepts non_finite`"],
        Rule::custom => &["`custom`"],
        Rule::domain | Rule::number_domain | Rule::point_domain | Rule::text_domain | Rule::file_domain => {
            &["the permitted values, such as `int [3, 20]`"]
        }
        Rule::point => &["a point such as `(1, 0, -0.5)m`"],
        Rule::corner => &["a corner such as `(0, 50)`"],
        Rule::coordinate => &["a number without a unit"],
        Rule::draw_seed => &["`seed`"],
        Rule::listed_messages => &["`messages`"],
        Rule::listed_run => &["a message such as `248` or `248..250`"],
        Rule::on_wire => &["`on`"],
        Rule::dimension => &["a dimension such as `T1 [0, 1] cells 6`"],
        Rule::within => &["`within`"],
        Rule::priority => &["`priority`"],
        Rule::inclusion => &["`inclusion`"],
        Rule::untimed => &["`untimed`"],
        Rule::wrapped => &["`wrapped`"],
        Rule::next_messages => &["`next`"],
        Rule::to_nodes => &["`to`"],
        Rule::state_topic => &["`publishes`"],
        Rule::external => &["`external`"],
        Rule::inbound => &["`inbound`"],
        Rule::held => &["`held`"],
        Rule::stale => &["`stale after`"],
        Rule::mitigation => &["`mitigate with`"],
        Rule::rank_key | Rule::tolerated => &["a metric"],
        Rule::per_operation => &["`, plus … per operation`"],
        Rule::sphere => &["`sphere`"],
        Rule::cuboid => &["`box`"],
        Rule::carried => &["`on pose`"],
        Rule::fixed => &["`at`"],
        Rule::expand => &["`expand`"],
        Rule::fit_delay => &["`relay delay`"],
        Rule::fit_parameter | Rule::on_parameter => &["`parameter`"],
        Rule::drain => &["`drain`"],
        Rule::direction => &["`maximise`", "`minimise`"],
        Rule::default_value => &["`default`"],
        Rule::value_mode => &["`offset`", "`absolute`"],
        Rule::secret => &["`from env` or `from file`"],
        Rule::k_at_most_once => &["`at_most_once`"],
        Rule::k_at_least_once => &["`at_least_once`"],
        Rule::k_exactly_once => &["`exactly_once`"],
        Rule::ros_type => &["`=` and a ROS type"],
        Rule::wire_type => &["`as`"],
        Rule::answer => &["an answer such as `joints with commands`"],
        Rule::ready_topic => &["`topic`"],
        Rule::ready_port => &["`port`"],
        Rule::ready_line => &["`line`"],
        Rule::ready_clock => &["`clock`"],
        Rule::random_value => &["`random`"],
        Rule::packet_loss | Rule::k_packet => &["`packet loss`"],
        Rule::stuck_at | Rule::k_stuck => &["`stuck at`"],
        Rule::bias => &["`bias`"],
        Rule::drift => &["`drift`"],
        Rule::noise => &["`noise`"],
        Rule::scale => &["`scale`"],
        Rule::not_finite => &["`nan`", "`infinity`"],
        Rule::freeze => &["`freeze`"],
        Rule::stale_value => &["`stale`"],
        Rule::clock_skew | Rule::k_clock => &["`clock skew`"],
        Rule::burst_loss | Rule::k_burst => &["`burst loss`"],
        Rule::burst_enter => &["`enter`"],
        Rule::burst_leave => &["`leave`"],
        Rule::burst_drops => &["`loss`"],
        Rule::rate_limit | Rule::k_rate => &["`rate limit`"],
        Rule::reorder => &["`reorder`"],
        Rule::duplicate => &["`duplicate`"],
        Rule::distribution => &["`fixed`", "`uniform`", "`normal`"],
        Rule::k_one => &["`one of`"],
        Rule::corners => &["a box such as `[(0, 0, 0)m, (1, 1, 1)m]`"],
        Rule::latency => &["`latency`"],
        Rule::blackhole => &["`blackhole`"],
        Rule::on_node => &["`node`"],
        Rule::set_parameter => &["`set`"],
        Rule::transition => &["`transition`"],
        Rule::transition_name => &["`configure`", "`activate`", "`deactivate`", "`cleanup`"],
        Rule::new_value => &["`true`", "`false`", "a text in double quotes", "a list such as `list [1, 2]`"],
        Rule::pause => &["`pause`"],
        Rule::slow => &["`slow`"],
        Rule::kill => &["`kill`"],
        Rule::formula => &["a formula such as `last(cycle)`"],
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
        | Rule::region
        | Rule::function
        | Rule::members
        | Rule::some_of
        | Rule::truth => &["a value such as `link0 - 2.5rad`"],
        Rule::plus => &["`+`"],
        Rule::times | Rule::each_element => &["`*`"],
        Rule::over => &["`/`"],
        Rule::trigger | Rule::when_then | Rule::formula_when => &["`when`"],
        Rule::formula_every | Rule::every_messages => &["`every`"],
        Rule::formula_per => &["`per`"],
        Rule::formula_outbound => &["`outbound`"],
        Rule::formula_whole => &["`whole windows`"],
        Rule::fuzzing_time => &["`fuzzing_time()`"],
        Rule::minus => &["`-`"],
        // What is for few places would be in the way at all others.
        Rule::k_not
        | Rule::k_always
        | Rule::k_eventually
        | Rule::k_pair
        | Rule::k_weak
        | Rule::element
        | Rule::element_filter
        | Rule::element_key
        | Rule::element_range
        | Rule::one_member
        | Rule::member_name
        | Rule::chosen
        | Rule::of_these
        | Rule::reduction
        | Rule::formula_within => &[],
        _ => {
            let members: Vec<String> = blocks::members(rule).map(blocks::Member::phrase).collect();
            if !members.is_empty() {
                return members;
            }
            let block = blocks::find(rule).map(|_| "`{`".to_owned());
            // The rule of a kind of simulator is named like its word.
            let kind = || SimulatorKind::from_keyword(rule_name(rule)).map(|kind| kind.properties().keyword);
            let word = || keyword_of(rule).or_else(kind).map(|word| format!("`{word}`"));
            return block.or_else(word).into_iter().collect();
        }
    };
    phrases.iter().map(|&phrase| phrase.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rule_has_its_own_name() {
        for rule in Rule::all_rules() {
            assert_eq!(rule_name(*rule), format!("{rule:?}"));
        }
        assert_eq!(rule_name(Rule::EOI), "");
    }
}
