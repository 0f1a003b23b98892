//! Words of other tools and fields for what the language says in its own: those of ROS, Optuna, pymoo, S-TaLiRo,
//! proptest and textbooks, and American spelling.

/// What a foreign word means here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Synonym {
    /// The foreign word or phrase, in lower case, with `_` between its words.
    foreign: &'static str,
    /// The words of the language for it.
    pub(crate) meant: &'static str,
    /// Whether it can mean nothing else: another spelling, or another name of the same thing.
    pub(crate) same: bool,
}

/// Another spelling or name of the same thing.
const fn same(foreign: &'static str, meant: &'static str) -> Synonym {
    Synonym { foreign, meant, same: true }
}

/// A word that probably means this, or one of several things that it has a row for each of.
const fn like(foreign: &'static str, meant: &'static str) -> Synonym {
    Synonym { foreign, meant, same: false }
}

/// The words, by where the language expects theirs. A row counts only where the first of its words is expected, so
/// the same foreign word can mean one thing for an operation and another in a campaign.
const SYNONYMS: &[Synonym] = &[
    // Operations on values.
    same("gaussian_noise", "noise"),
    same("white_noise", "noise"),
    same("normal_noise", "noise"),
    like("gaussian", "noise"),
    like("gauss", "noise"),
    like("jitter", "noise"),
    like("sigma", "noise"),
    like("uniform_noise", "random offset"),
    like("uniform", "random offset"),
    same("random_offset", "random offset"),
    same("random_absolute", "random absolute"),
    like("offset", "bias"),
    like("offset", "random offset"),
    like("shift", "bias"),
    like("displace", "bias"),
    like("absolute", "random absolute"),
    like("one_of", "random one of"),
    like("gain", "scale"),
    like("factor", "scale"),
    like("multiply", "scale"),
    same("scale_factor", "scale"),
    like("ramp", "drift"),
    same("brownian", "random walk"),
    same("brownian_motion", "random walk"),
    like("wander", "random walk"),
    same("random_walk", "random walk"),
    same("randomwalk", "random walk"),
    same("stuck_at", "stuck at"),
    like("constant", "stuck at"),
    like("fixed", "stuck at"),
    like("override", "stuck at"),
    like("hold", "freeze"),
    same("frozen", "freeze"),
    like("stuck", "freeze"),
    like("replay", "stale"),
    like("age", "stale"),
    like("skew", "clock skew"),
    same("clock_skew", "clock skew"),
    like("clock_offset", "clock skew"),
    like("clock_drift", "clock skew"),
    same("inf", "infinity"),
    same("infinite", "infinity"),
    // Functions of successive messages: those of Lustre, Modelica, NumPy, pandas and Simulink.
    like("derivative", "rate"),
    like("deriv", "rate"),
    like("ddt", "rate"),
    like("der", "rate"),
    like("diff", "rate"),
    like("gradient", "rate"),
    same("prev", "previous"),
    like("pre", "previous"),
    like("lag", "previous"),
    like("shift", "previous"),
    like("unit_delay", "previous"),
    same("integrate", "integral"),
    like("cumsum", "integral"),
    same("unwrap", "unwrapped"),
    same("wrap", "wrapped"),
    like("wraptopi", "wrapped"),
    like("normalize_angle", "wrapped"),
    like("shortest_angular_distance", "angle_between"),
    like("angdiff", "angle_between"),
    like("angle_diff", "angle_between"),
    like("angular_distance", "angle_between"),
    like("cumtrapz", "integral"),
    like("trapz", "integral"),
    // Operations on nodes and parameters.
    like("suspend", "pause"),
    like("halt", "pause"),
    like("hang", "pause"),
    like("stall", "pause"),
    like("crash", "kill"),
    like("restart", "kill"),
    like("shutdown", "kill"),
    like("throttle", "slow"),
    like("starve", "slow"),
    like("assign", "set"),
    like("param", "parameter"),
    // Operations on messages.
    like("delay", "latency"),
    like("lag", "latency"),
    like("jitter", "latency"),
    like("loss", "packet loss"),
    like("drop", "packet loss"),
    like("drop", "blackhole"),
    like("dropout", "packet loss"),
    like("omission", "packet loss"),
    same("packet_loss", "packet loss"),
    same("packetloss", "packet loss"),
    same("packet_drop", "packet loss"),
    same("message_loss", "packet loss"),
    same("burst_loss", "burst loss"),
    same("gilbert_elliott", "burst loss"),
    same("gilbert", "burst loss"),
    same("rate_limit", "rate limit"),
    like("throttle", "rate limit"),
    like("downsample", "rate limit"),
    like("blackout", "blackhole"),
    like("outage", "blackhole"),
    like("disconnect", "blackhole"),
    like("drop_all", "blackhole"),
    like("shuffle", "reorder"),
    same("out_of_order", "reorder"),
    same("reordering", "reorder"),
    like("repeat", "duplicate"),
    same("duplication", "duplicate"),
    like("gaussian", "normal"),
    like("constant", "fixed"),
    like("discard", "drop"),
    // Clauses of operations and of regression tests.
    like("during", "within"),
    like("active", "within"),
    like("between", "within"),
    like("window", "within"),
    like("probability", "inclusion"),
    same("prio", "priority"),
    like("duration", "for"),
    like("lasting", "for"),
    like("length", "for"),
    like("if", "when"),
    like("assert", "expect"),
    // Metrics and requirements.
    same("minimize", "minimise"),
    same("maximize", "maximise"),
    like("min", "minimise"),
    like("max", "maximise"),
    like("lower", "minimise"),
    like("greater", "maximise"),
    same("minimum", "min"),
    same("maximum", "max"),
    same("average", "mean"),
    same("avg", "mean"),
    like("final", "last"),
    like("latest", "last"),
    same("dist", "distance"),
    same("fabs", "abs"),
    same("absolute", "abs"),
    like("occurrences", "count"),
    like("stl", "robustness"),
    like("increasing", "rising"),
    like("nondecreasing", "rising"),
    like("decreasing", "falling"),
    like("nonincreasing", "falling"),
    like("init", "initial"),
    // Temporal operators.
    same("globally", "always"),
    like("g", "always"),
    same("finally", "eventually"),
    like("future", "eventually"),
    like("f", "eventually"),
    like("u", "until"),
    same("weak_until", "weak until"),
    like("unless", "weak until"),
    like("w", "weak until"),
    // Types of messages.
    same("float", "real"),
    same("float32", "real"),
    same("float64", "real"),
    same("f32", "real"),
    same("f64", "real"),
    same("double", "real"),
    same("number", "real"),
    same("integer", "int"),
    same("int8", "int"),
    same("int16", "int"),
    same("int32", "int"),
    same("int64", "int"),
    same("uint8", "int"),
    same("uint16", "int"),
    same("uint32", "int"),
    same("uint64", "int"),
    same("i32", "int"),
    same("i64", "int"),
    same("u8", "int"),
    same("u32", "int"),
    same("long", "int"),
    same("string", "text"),
    same("str", "text"),
    like("char", "text"),
    same("boolean", "bool"),
    same("vector3", "point"),
    same("vec3", "point"),
    same("point32", "point"),
    like("position", "point"),
    // Declarations.
    like("fault", "operation"),
    like("attack", "operation"),
    like("disturbance", "operation"),
    like("perturbation", "operation"),
    like("property", "requirement"),
    like("constraint", "requirement"),
    like("specification", "requirement"),
    like("invariant", "requirement"),
    like("measure", "metric"),
    like("experiment", "campaign"),
    like("study", "campaign"),
    like("scenario", "test"),
    like("case", "test"),
    like("include", "import"),
    like("use", "import"),
    like("project", "space"),
    like("package", "space"),
    like("module", "space"),
    like("robot", "system"),
    like("sut", "system"),
    like("monitor", "eddi"),
    like("certificate", "eddi"),
    like("consert", "eddi"),
    like("claim", "guarantee"),
    like("fallback", "otherwise"),
    like("lab", "physical"),
    like("channel", "topic"),
    like("struct", "message"),
    same("msg", "message"),
    same("sim", "simulator"),
    same("publish", "publishes"),
    like("publisher", "publishes"),
    same("subscribe", "subscribes"),
    like("subscriber", "subscribes"),
    same("serve", "serves"),
    like("server", "serves"),
    like("offers", "serves"),
    same("call", "calls"),
    like("client", "calls"),
    // Clauses of campaigns.
    like("objective", "objectives"),
    like("goals", "objectives"),
    like("targets", "objectives"),
    like("faults", "operations"),
    like("metrics", "observes"),
    like("measure", "observes"),
    same("observe", "observes"),
    like("algorithm", "search"),
    like("strategy", "search"),
    like("sampler", "search"),
    same("optimizer", "search"),
    same("optimiser", "search"),
    like("duration", "end after"),
    like("length", "end after"),
    like("timeout", "end after"),
    like("until", "end after"),
    like("trigger", "activate"),
    same("activation", "activate"),
    like("termination", "stop"),
    like("stopping", "stop"),
    like("repetitions", "repeat"),
    like("trace", "record"),
    like("rosbag", "record"),
    like("log", "record"),
    like("rosbag", "mcap"),
    like("bag", "mcap"),
    like("failures", "failing"),
    like("failed", "failing"),
    like("everything", "all"),
    // Strategies: the settings that follow may be those of another one.
    like("nsga", "nsga2"),
    like("nsgaii", "nsga2"),
    like("nsga_ii", "nsga2"),
    like("nsga_2", "nsga2"),
    like("nsgaiii", "nsga3"),
    like("nsga_iii", "nsga3"),
    like("nsga_3", "nsga3"),
    like("genetic", "nsga2"),
    like("ga", "nsga2"),
    like("evolutionary", "nsga2"),
    like("random_search", "random"),
    like("monte_carlo", "random"),
    like("montecarlo", "random"),
    like("uniform", "random"),
    like("lhs", "latin_hypercube"),
    like("lhc", "latin_hypercube"),
    like("latin", "latin_hypercube"),
    like("latinhypercube", "latin_hypercube"),
    like("qmc", "sobol"),
    like("halton", "sobol"),
    like("grid_search", "grid"),
    like("full_factorial", "grid"),
    like("mapelites", "map_elites"),
    like("qd", "map_elites"),
    like("quality_diversity", "map_elites"),
    like("pairwise", "interleaved"),
    like("combinatorial", "interleaved"),
    like("covering_array", "interleaved"),
    like("bayesian", "falsification"),
    like("bo", "falsification"),
    like("tpe", "falsification"),
    like("falsify", "falsification"),
    like("staliro", "falsification"),
    // Settings: the one that is written here may be another one that is missing.
    like("pop_size", "population"),
    like("popsize", "population"),
    like("population_size", "population"),
    like("pop", "population"),
    like("n_evals", "evaluations"),
    like("n_eval", "evaluations"),
    like("max_evals", "evaluations"),
    like("max_evaluations", "evaluations"),
    like("evals", "evaluations"),
    like("n_trials", "evaluations"),
    like("trials", "evaluations"),
    like("cases", "evaluations"),
    like("tests", "evaluations"),
    like("runs", "evaluations"),
    like("budget", "evaluations"),
    like("iterations", "evaluations"),
    like("samples", "evaluations"),
    like("random_seed", "seed"),
    like("random_state", "seed"),
    like("rng", "seed"),
    same("neighbors", "neighbours"),
    like("steps", "levels"),
    same("dt", "step"),
    same("time_step", "step"),
    same("timestep", "step"),
    same("step_size", "step"),
    like("period", "step"),
    same("max_depth", "depth"),
];

/// What a foreign word or phrase means, the likeliest first, of the meanings whose first word `expected` accepts.
/// Case does not matter, and neither does whether words are joined by `_`, `-` or a blank.
pub(crate) fn meanings(foreign: &str, expected: impl Fn(&str) -> bool) -> Vec<Synonym> {
    let normal = foreign.to_lowercase().replace(['-', ' '], "_");
    let first = |words: &'static str| words.split(' ').next().unwrap_or(words);
    SYNONYMS.iter().filter(|row| row.foreign == normal && expected(first(row.meant))).copied().collect()
}

/// What to write for a region that other tools have.
pub(crate) fn region_otherwise(name: &str) -> Option<&'static str> {
    match name {
        "circle" | "disc" | "disk" | "cylinder" => Some(
            "the signed distance from a circle, at any height, is a formula such as \
             `hypot(position.x - 20m, position.y - 20m) - 3m`",
        ),
        "sphere" | "ball" => {
            Some("the signed distance from a sphere is a formula such as `distance(position, (20, 20, 0)m) - 3m`")
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_means_what_is_expected_at_its_place() {
        let meant = |word: &str, expected: &[&str]| {
            meanings(word, |first| expected.contains(&first)).into_iter().map(|row| row.meant).collect::<Vec<_>>()
        };
        assert_eq!(meant("jitter", &["noise", "latency"]), ["noise", "latency"]);
        assert_eq!(meant("Gaussian", &["normal", "uniform"]), ["normal"]);
        assert_eq!(meant("duration", &["end", "search"]), ["end after"]);
        assert_eq!(meant("NSGA-II", &["nsga2", "nsga3"]), ["nsga2"]);
        assert!(meant("delay", &["noise"]).is_empty());
    }

    #[test]
    fn what_is_the_same_has_one_meaning_at_a_place() {
        let grammar_places = |row: &Synonym| meanings(row.foreign, |_| true).iter().filter(|other| other.same).count();
        for row in SYNONYMS.iter().filter(|row| row.same) {
            assert_eq!(
                grammar_places(row),
                1,
                "`{}` has several meanings and one of them is the only one",
                row.foreign
            );
            assert_eq!(row.foreign, row.foreign.to_lowercase());
        }
    }
}
