//! Files of the original platform made up at random, of every dialect and with everything odd that real ones hold: each
//! is imported, and of what it holds nothing is lost without a word.
//!
//! What goes in is counted in the XML, by a reading that shares nothing with the importer.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::Path;

use roxmltree::{Document, Node};

use sesame_legacy::{Counted, Imported};
use sesame_record::Repository;
use sesamec::frontend::{Look, SESAME};

use crate::mutated_imports::Draws;

/// Types of messages with how they are parsed, and a path to a number in each; many lead into lists.
const TYPES: &[(&str, &str, &str)] = &[
    ("doubleEncodedAsString", " parsingMethod=\"STRING\"", ""),
    ("geometry_msgs/Twist", "", "geometry_msgs/Twist.linear.X"),
    ("perception_msgs/DetectedObjectList", "", "DetectedObjectList.objects[0].object.sector.center_angle"),
    ("sensor_msgs/LaserScan", "", "sensor_msgs/LaserScan.ranges[3]"),
    ("SafetyZone", "", "SafetyZone.level"),
    ("std_msgs/Bool", "", "std_msgs/Bool.stamp.seconds"),
];

/// Paths that lead nowhere in most messages.
const PATHS: &[&str] = &[
    "",
    "..",
    "a.b.c",
    "a.b[0][1]",
    "a.ranges",
    "a.ranges[-1]",
    "a.objects[1].object.Distance",
    "a.linear.y",
    "level",
];

const OPERATIONS: &[&str] = &[
    "RandomValueFromSetOperation",
    "RandomValueFromSetOperation",
    "RandomValueFromSetOperation",
    "RandomValueFromSetOperation",
    "PacketLossNetworkOperation",
    "PacketLossNetworkOperation",
    "LatencyNetworkOperation",
    "LatencyNetworkOperation",
    "BlackholeNetworkOperation",
    "CustomFuzzingOperation",
    "CustomFuzzingOperation",
    "OfflineFuzzingOperation",
];

const VALUES: &[&str] = &["0.0", "1.5", "-3", "4.25", "100000.0", "1e-9", "17"];

const NOT_FINITE: &[&str] = &["NaN", "Infinity", "-Infinity"];

/// An operation of the space: its kind, its variable, and the kinds and paths of its value sets.
struct Template {
    kind: &'static str,
    name: String,
    variable: Option<usize>,
    relative: bool,
    sets: Vec<(&'static str, &'static str)>,
}

/// What a file is made of.
struct Maker {
    draws: Draws,
    text: String,
    metrics: usize,
    /// The type of each variable.
    variables: Vec<usize>,
    /// Whether references are paths, and not ids.
    paths: bool,
}

impl Maker {
    fn chance(&mut self, one_in: usize) -> bool {
        self.draws.below(one_in) == 0
    }

    fn one<'t, T: ?Sized>(&mut self, of: &[&'t T]) -> &'t T {
        of[self.draws.below(of.len())]
    }

    /// A number with one digit after its point.
    fn number(&mut self, low: i32, high: i32) -> f64 {
        let width = usize::try_from(10 * (high - low) + 1).unwrap();
        f64::from(low) + self.draws.below(width) as f64 / 10.0
    }

    fn say(&mut self, words: &str) {
        self.text.push_str(words);
    }

    fn reference(&self, id: &str, path: &str, at: usize) -> String {
        if self.paths { format!("//@{path}.{at}") } else { format!("_{id}{at}") }
    }

    fn metric(&mut self) -> String {
        // Sometimes one more than there are: a reference that leads nowhere.
        let at = if self.chance(12) { self.metrics } else { self.draws.below(self.metrics) };
        self.reference("m", "metrics", at)
    }

    fn metrics(&mut self) {
        for at in 0..self.metrics {
            let kind = self.one(&[
                "StreamMetric",
                "StreamMetric",
                "StreamMetric",
                "FuzzingOperationTimesMetric",
                "StartEndTimingMetric",
            ]);
            let name = if self.chance(8) { "same".to_owned() } else { format!("metric-{at}") };
            let optimised = if self.chance(2) { " useInOptimisation=\"true\"" } else { "" };
            let direction = if self.chance(2) { " dir=\"LOWEST\"" } else { "" };
            let default = if self.chance(3) { "" } else { "<valueIfNotReceived defaultVal=\"1.5\"/>" };
            let _ = writeln!(
                self.text,
                "  <metrics xsi:type=\"Metrics:{kind}\" xmi:id=\"_m{at}\" name=\"{name}\"{direction}{optimised}>{default}</metrics>"
            );
        }
    }

    /// A window that is as it should be, reversed, empty, negative, or after the end of tests.
    fn window(&mut self) -> (f64, f64) {
        let (start, length) = (self.number(0, 60), self.number(0, 60));
        match self.draws.below(10) {
            0 => (start + length, start),
            1 => (start, start),
            2 => (start - 30.0, start + length),
            3 => (start + 8000.0, start + length + 8000.0),
            4 => (start, start + length + 8000.0),
            5 => (-10.0, -5.0),
            _ => (start, start + length),
        }
    }

    /// A condition under this tag, of so many levels at most.
    fn condition(&mut self, tag: &str, levels: u32) -> String {
        if levels > 0 && self.chance(3) {
            let operator = if self.chance(2) { " binop=\"OR\"" } else { "" };
            let (left, right) = (self.condition("left", levels - 1), self.condition("right", levels - 1));
            return format!("<{tag} xsi:type=\"G:CompositeCondition\"{operator}>{left}{right}</{tag}>");
        }
        let by = self.one(&["", " bincomp=\"GREATER_THAN\"", " bincomp=\"EQUALS\""]);
        let left = self.metric();
        let right = if self.chance(2) {
            format!("<right xsi:type=\"G:ConditionInteger\" value=\"{}\"/>", self.draws.below(30))
        } else {
            format!("<right xsi:type=\"G:ConditionVariable\" metric=\"{}\"/>", self.metric())
        };
        format!("<{tag} xsi:type=\"G:BasicCondition\"{by}><left metric=\"{left}\"/>{right}</{tag}>")
    }

    fn activation(&mut self, conditional: bool) {
        if self.chance(15) {
            return;
        }
        if !conditional {
            let (start, end) = self.window();
            let _ = writeln!(
                self.text,
                "        <activation xsi:type=\"F:FixedTimeActivation\" startTime=\"{start}\" endTime=\"{end}\"/>"
            );
            return;
        }
        let starting =
            if self.chance(10) { String::new() } else { format!("<starting>{}</starting>", self.condition("c", 2)) };
        let activation = if self.chance(2) {
            let ending =
                if self.chance(4) { String::new() } else { format!("<ending>{}</ending>", self.condition("c", 2)) };
            format!("<activation xsi:type=\"F:ConditionBasedActivation\">{starting}{ending}</activation>")
        } else {
            let length = self.number(0, 20);
            format!("<activation xsi:type=\"F:ConditionBasedTimeLimited\" length=\"{length}\">{starting}</activation>")
        };
        let _ = writeln!(self.text, "        {activation}");
        if self.chance(2) {
            let start = self.number(0, 60);
            let length = if self.chance(2) { 0.0 } else { self.number(0, 40) };
            let end = start + length;
            let _ = writeln!(self.text, "        <recordedTimings startTime=\"{start}\" endTime=\"{end}\"/>");
        }
    }

    /// What an operation draws from.
    fn choices(&mut self, template: &Template) {
        let feature = if template.kind == "CustomFuzzingOperation" { "params" } else { "valueSet" };
        for (domain, path) in &template.sets {
            let (low, high) = (self.number(-2, 2), self.number(-2, 2));
            let (whole_low, whole_high) = (self.draws.below(20), self.draws.below(20));
            let held = match *domain {
                "DoubleRange" => format!(" lowerBound=\"{low}\" upperBound=\"{high}\"/>"),
                "IntRange" => format!(" lowerBound=\"{whole_low}\" upperBound=\"{whole_high}\"/>"),
                "PointRange" => format!("><minPoint x=\"{low}\"/><maxPoint y=\"{high}\"/></{feature}>"),
                "StringSet" => format!("><choices>map</choices><choices>odom</choices></{feature}>"),
                _ => "/>".to_owned(),
            };
            let _ = writeln!(self.text, "        <{feature} xsi:type=\"F:{domain}\" propertyName=\"{path}\"{held}");
        }
        let (low, high) = (self.number(0, 1), self.number(0, 2));
        let range = match template.kind {
            "PacketLossNetworkOperation" => "frequency",
            "LatencyNetworkOperation" => "latency",
            _ => return,
        };
        if !self.chance(5) {
            let _ = writeln!(self.text, "        <{range} lowerBound=\"{low}\" upperBound=\"{high}\"/>");
        }
    }

    /// An operation under this tag: of the space, or of a test and then one of this template.
    fn operation(&mut self, tag: &str, template: &Template, of: Option<usize>, id: &str, conditional: bool) {
        let mut attributes = String::new();
        if let Some(variable) = template.variable {
            let _ = write!(attributes, " variableToAffect=\"{}\"", self.reference("v", "mrs/@variables", variable));
        }
        // Some tests hold an operation that names none of the space.
        if let Some(of) = of.filter(|_| !self.chance(10)) {
            let _ = write!(attributes, " fromTemplate=\"{}\"", self.reference("o", "possibleFuzzingOperations", of));
        }
        if template.relative {
            attributes.push_str(" isRelative=\"true\"");
        }
        let (kind, name) = (template.kind, &template.name);
        let _ = writeln!(self.text, "      <{tag} xsi:type=\"F:{kind}\"{id} name=\"{name}\"{attributes}>");
        self.activation(conditional);
        self.choices(template);
        let _ = writeln!(self.text, "      </{tag}>");
    }

    fn template(&mut self, at: usize) -> Template {
        let kind = self.one(OPERATIONS);
        let variable = if self.chance(12) { None } else { Some(self.draws.below(self.variables.len())) };
        let count = match kind {
            "RandomValueFromSetOperation" if !self.chance(10) => 1 + self.draws.below(3),
            "CustomFuzzingOperation" => self.draws.below(4),
            _ => 0,
        };
        let sets = (0..count)
            .map(|_| {
                let odd = self.one(&["IntRange", "PointRange", "StringSet", "Odd"]);
                let domain = if self.chance(4) { odd } else { "DoubleRange" };
                let good = variable.map_or("", |variable| TYPES[self.variables[variable]].2);
                (domain, if self.chance(4) { self.one(PATHS) } else { good })
            })
            .collect();
        let name = if self.chance(12) { String::new() } else { format!("operation {}", at / 2) };
        Template { kind, name, variable, relative: self.chance(2), sets }
    }

    fn performed_test(&mut self, campaign: usize, at: usize, templates: &[Template], conditional: bool) {
        let mut parents = String::new();
        if at > 0 && self.chance(2) {
            let parent = self.draws.below(at);
            let parent = if self.paths {
                format!("//@campaigns.{campaign}/@performedTests.{parent}")
            } else {
                format!("_p{campaign}_{parent}")
            };
            parents = format!(" developedFrom=\"{parent}\"");
        }
        let _ = writeln!(self.text, "    <performedTests xmi:id=\"_p{campaign}_{at}\" name=\"Test_{at}\"{parents}>");
        for _ in 0..self.draws.below(4) {
            let of = self.draws.below(templates.len());
            self.operation("operations", &templates[of], Some(of), "", conditional);
        }
        let odd = usize::from(self.chance(6));
        for measured in 0..self.metrics + odd {
            let reference = match self.draws.below(8) {
                0 => self.metric(),
                _ => self.reference("m", "metrics", measured),
            };
            let metric = if self.chance(4) { String::new() } else { format!(" metric=\"{reference}\"") };
            let name = if self.chance(8) { String::new() } else { format!(" name=\"metric-{measured}\"") };
            let values = if self.chance(12) { NOT_FINITE } else { VALUES };
            let value = if self.chance(6) { String::new() } else { format!(" value=\"{}\"", self.one(values)) };
            let result = if self.chance(15) { String::new() } else { format!("<result{name}{value}/>") };
            let _ = writeln!(self.text, "      <metrics{metric}>{result}</metrics>");
        }
        self.say("    </performedTests>\n");
    }

    /// How a search boosts coverage: an attribute of older files, or an element.
    fn boosting(&mut self) -> (&'static str, String) {
        let number = |maker: &mut Maker, name: &str| match maker.draws.below(3) {
            0 => String::new(),
            _ => format!(" {name}=\"{}\"", maker.draws.below(12)),
        };
        let kind = match self.draws.below(5) {
            0 => return ("", String::new()),
            1 => return (" useMutationEnhancingCoverage=\"true\"", String::new()),
            2 => "Fixed",
            3 => "Linear",
            _ => "Odd",
        };
        let numbers: Vec<String> = [
            "useBoostingOnceEveryGenerations",
            "useBoostingOnceEveryIterations",
            "startingBoostingCount",
            "endingBoostingCount",
            "countDropEveryGeneration",
        ]
        .iter()
        .map(|name| number(self, name))
        .collect();
        let numbers = numbers.concat();
        ("", format!("<coverageBoostingStrategy xsi:type=\"T:{kind}NSGACoverageBoostingStrategy\"{numbers}/>"))
    }

    fn campaign(&mut self, at: usize, templates: &[Template]) {
        let list = |maker: &mut Maker, id: &str, path: &str, count: usize| -> String {
            let chosen: Vec<usize> = (0..count).filter(|_| !maker.chance(3)).collect();
            chosen.into_iter().map(|at| maker.reference(id, path, at)).collect::<Vec<_>>().join(" ")
        };
        let measured = list(self, "m", "metrics", self.metrics);
        let compared = list(self, "m", "metrics", self.metrics);
        let included = list(self, "o", "possibleFuzzingOperations", templates.len());
        let conditional = self.chance(3);
        let _ = writeln!(
            self.text,
            "  <campaigns name=\"campaign-{at}\" metrics=\"{measured}\" conditionMetrics=\"{compared}\" includedOperations=\"{included}\">"
        );
        if conditional && !self.chance(3) {
            self.say("    <activationGeneration xsi:type=\"T:ConditionBasedActivationGenerationMethod\" conditionDepth=\"3\"/>\n");
        }
        let tests = self.draws.below(6);
        match self.draws.below(5) {
            0 => self.say("    <approach xsi:type=\"T:RandomTestGeneration\"/>\n"),
            1 => self.say(
                "    <approach xsi:type=\"T:NSGAEvolutionaryAlgorithm\" populationSize=\"7\" iterations=\"20\"/>\n",
            ),
            2 => {
                let cells = self.one(&[
                    "<dimensionRecords maxValue=\"1.0\" count=\"4\"/><dimensionRecords dimID=\"O2_DELAY_COUNT\" maxValue=\"3.0\" count=\"3\"/>",
                    "<dimensionRecords maxValue=\"1.0\" count=\"4\"/>",
                    "",
                ]);
                let (older, boosting) = self.boosting();
                let _ = writeln!(
                    self.text,
                    "    <approach xsi:type=\"T:NSGAWithCoverageCells\" populationSize=\"4\" iterations=\"20\"{older}>{cells}{boosting}</approach>"
                );
            }
            3 => {
                let repeated = if self.chance(4) {
                    String::new()
                } else {
                    let of = self.draws.below(at + 1);
                    let which = self.draws.below(4);
                    let path = format!("//@campaigns.{of}/@performedTests.{which}");
                    format!(" testToRepeat=\"{}\"", if self.paths { path } else { format!("_p{of}_{which}") })
                };
                let _ =
                    writeln!(self.text, "    <approach xsi:type=\"T:RepeatedExecution\"{repeated} repeatCount=\"3\"/>");
            }
            _ => {}
        }
        for test in 0..tests {
            self.performed_test(at, test, templates, conditional);
        }
        if tests > 0 {
            let member = if self.paths { format!("//@campaigns.{at}/@performedTests.0") } else { format!("_p{at}_0") };
            let _ =
                writeln!(self.text, "    <resultSets name=\"FULL-1\" status=\"INTERMEDIATE\" results=\"{member}\"/>");
        }
        if !self.chance(4) {
            let limit = self.one(&["70", "12", "300"]);
            let _ = writeln!(self.text, "    <endTrigger xsi:type=\"T:TimeBasedEnd\" timeLimitSeconds=\"{limit}\"/>");
        }
        self.say("  </campaigns>\n");
    }

    fn system(&mut self) {
        self.say("  <mrs launchDelaySeconds=\"10\">\n");
        for at in 0..self.variables.len() {
            let ty = self.reference("t", "mrs/@propertyType", self.variables[at]);
            let _ = writeln!(self.text, "    <variables xmi:id=\"_v{at}\" name=\"robot/topic{at}\" type=\"{ty}\"/>");
        }
        let published: Vec<usize> = (0..self.variables.len()).filter(|_| !self.chance(4)).collect();
        let published: Vec<String> =
            published.into_iter().map(|at| self.reference("v", "mrs/@variables", at)).collect();
        let _ = writeln!(self.text, "    <nodes name=\"arm\" publisher=\"{}\"/>", published.join(" "));
        if !self.chance(4) {
            self.say("    <simulator xsi:type=\"M:TTSSimulator\" hostname=\"localhost\" port=\"8089\"/>\n");
        }
        for (at, (name, parsing, _)) in TYPES.iter().enumerate() {
            let _ = writeln!(self.text, "    <propertyType xmi:id=\"_t{at}\" name=\"{name}\"{parsing}/>");
        }
        self.say("  </mrs>\n");
    }
}

/// The names that elements and attributes had in early files.
const OLD: [(&str, &str); 10] = [
    ("possibleFuzzingOperations", "possibleAttacks"),
    ("<operations", "<attacks"),
    ("</operations", "</attacks"),
    ("includedOperations", "includedAttacks"),
    ("variableToAffect", "topicToAttack"),
    ("variables", "topics"),
    ("valueIfNotReceived", "default"),
    ("activation ", "attackActivation "),
    ("</activation", "</attackActivation"),
    ("FixedTimeActivation", "AttackFixedTime"),
];

/// A file.
fn made(seed: u64) -> String {
    let mut draws = Draws(seed);
    let metrics = 1 + draws.below(4);
    let variables = (0..=draws.below(4)).map(|_| draws.below(TYPES.len())).collect();
    let paths = draws.below(3) == 0;
    let mut maker = Maker { draws, text: String::new(), metrics, variables, paths };
    maker.say("<?xml version=\"1.0\" encoding=\"ASCII\"?>\n");
    maker.say(
        "<T:TestingSpace xmi:version=\"2.0\" xmlns:xmi=\"http://www.omg.org/XMI\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xmlns:T=\"TestingMM\" name=\"made-up\">\n",
    );
    maker.metrics();
    let count = 1 + maker.draws.below(5);
    let templates: Vec<Template> = (0..count).map(|at| maker.template(at)).collect();
    for (at, template) in templates.iter().enumerate() {
        let conditional = maker.chance(6);
        maker.operation("possibleFuzzingOperations", template, None, &format!(" xmi:id=\"_o{at}\""), conditional);
    }
    for at in 0..=maker.draws.below(3) {
        maker.campaign(at, &templates);
    }
    maker.system();
    maker.say("</T:TestingSpace>\n");
    let (dialect, text) = (maker.draws.below(4), maker.text);
    match dialect {
        0 => OLD.iter().fold(text, |text, (now, before)| text.replace(now, before)),
        1 => text.replace("\"F:", "\"TestingMM.FuzzingOperations:").replace("\"G:", "\"TestingMM.StandardGrammar:"),
        2 => text.replace("\"Metrics:", "\"").replace("\"F:", "\"_1:").replace("\"G:", "\"_3:"),
        _ => text,
    }
}

/// How many there are of what an import counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Counts {
    tests: usize,
    operations: usize,
    values: usize,
}

/// What is in a file, in the words of any dialect.
fn in_file(text: &str) -> Counts {
    let document = Document::parse(text).unwrap();
    let children = |of: Node<'_, '_>, tags: &[&str]| -> Vec<_> {
        of.children().filter(|child| tags.contains(&child.tag_name().name())).map(|child| child.id()).collect()
    };
    let mut counts = Counts::default();
    for campaign in children(document.root_element(), &["campaigns"]) {
        for test in children(document.get_node(campaign).unwrap(), &["performedTests"]) {
            let test = document.get_node(test).unwrap();
            counts.tests += 1;
            counts.operations += children(test, &["operations", "attacks"]).len();
            counts.values += children(test, &["metrics"]).len();
        }
    }
    counts
}

/// What is in the results that were imported.
fn in_results(repository: &Repository) -> Counts {
    let mut counts = Counts::default();
    let seen = &mut |test: sesame_record::ScannedTest| {
        counts.tests += 1;
        counts.operations += test.operations.iter().filter(|operation| operation.part_of.is_none()).count();
        counts.values += test.values.iter().filter(|value| value.value.is_some()).count();
    };
    repository.scan(seen).unwrap();
    counts
}

/// Imports a file and checks that everything is in the results or in a note; how much went in, and how much was noted.
fn accounted(text: &str, folder: &Path, shown: &dyn Fn() -> String) -> (Counts, Counts) {
    let file = folder.join("made.model");
    fs::write(&file, text).unwrap();
    let mut imported =
        Imported::read(&file, File::open(&file).unwrap()).unwrap_or_else(|broken| panic!("{broken}\n{}", shown()));
    let look = Look::Human { colour: false };
    let formatted = (SESAME.format)("made.sesame", imported.text(), look);
    let formatted = formatted.unwrap_or_else(|found| panic!("{}\n{}", found.diagnostics, shown()));
    let checked = (SESAME.check)("made.sesame", &formatted, look);
    assert_eq!(checked.errors, 0, "{}\n{formatted}\n{}", checked.diagnostics, shown());
    let mut out = Counts::default();
    let performed: Vec<(usize, String)> = imported.performed().map(|(at, name)| (at, name.to_owned())).collect();
    for (at, name) in performed {
        let plan = &checked.plans.iter().find(|runner| runner.plan.campaign.name == name).unwrap().plan;
        let results = folder.join(format!("results-{at}"));
        imported.record(at, plan, &results).unwrap_or_else(|error| panic!("{error}\n{formatted}\n{}", shown()));
        let found = in_results(&Repository::open(&results).unwrap());
        out.tests += found.tests;
        out.operations += found.operations;
        out.values += found.values;
        fs::remove_dir_all(&results).unwrap();
    }
    let lost = |what| imported.notes.lost(what);
    let lost =
        Counts { tests: lost(Counted::Test), operations: lost(Counted::Operation), values: lost(Counted::Value) };
    let found = in_file(text);
    let sum = Counts {
        tests: out.tests + lost.tests,
        operations: out.operations + lost.operations,
        values: out.values + lost.values,
    };
    let notes: Vec<String> = imported.notes.iter().map(|(kind, text)| format!("{} {text}", kind.word())).collect();
    assert_eq!(found, sum, "{out:?} and {lost:?}: {}\n{}", notes.join("\n"), shown());
    (found, lost)
}

/// Imports so many files made from a seed.
fn imports(seed: u64, count: u64) {
    let folder = tempfile::tempdir().unwrap();
    let (mut all, mut lost) = (Counts::default(), Counts::default());
    for number in 0..count {
        let text = made(seed.wrapping_mul(1_000_003).wrapping_add(number));
        let (found, noted) = accounted(&text, folder.path(), &|| format!("file {number} of seed {seed}:\n{text}"));
        all.tests += found.tests;
        all.operations += found.operations;
        all.values += found.values;
        lost.operations += noted.operations;
        lost.values += noted.values;
        assert_eq!(noted.tests, 0, "the results of every campaign are kept, file {number} of seed {seed}:\n{text}");
    }
    println!("{all:?}, of these only noted {lost:?}");
    // Otherwise there is little to learn from such files.
    let most = |lost: usize, of: usize| lost > 0 && 3 * lost < 2 * of;
    assert!(most(lost.operations, all.operations) && most(lost.values, all.values), "{lost:?} of {all:?}");
    assert!(all.tests as u64 > count, "{all:?}");
}

#[test]
fn what_a_random_file_holds_is_in_the_results_or_in_a_note() {
    imports(1, 200);
}

#[test]
#[ignore = "long: imports two thousand files"]
fn what_two_thousand_random_files_hold_is_in_the_results_or_in_a_note() {
    imports(2, 2000);
}

#[test]
fn what_the_platforms_own_files_hold_is_in_the_results_or_in_a_note() {
    let Some(files) = std::env::var_os("SESAME_LEGACY_DIR") else {
        eprintln!("skipped: SESAME_LEGACY_DIR names no folder of files of the original platform");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut found = 0;
    for entry in fs::read_dir(files).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        // One holds a merge conflict, and is not XML.
        if path.extension().is_none_or(|extension| extension != "model") || name == "merge-markers.model" {
            continue;
        }
        let (held, lost) = accounted(&fs::read_to_string(&path).unwrap(), folder.path(), &|| name.clone());
        println!("{name}: {held:?}, of these only noted {lost:?}");
        assert_eq!(lost.tests, 0, "{name}");
        found += held.tests;
    }
    assert!(found > 0);
}
