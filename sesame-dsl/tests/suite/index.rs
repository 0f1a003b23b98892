//! The index of definitions and references, above all of files with errors.

use sesame_dsl::index::{DefinitionId, Index, Kind};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{analyse, load_imports};

fn index(text: &str) -> (SourceMap, Index, bool) {
    let mut sources = SourceMap::new();
    let root = sources.add("a.sesame", text);
    let analysis = analyse(&sources, root);
    let has_errors = analysis.has_errors();
    (sources, analysis.index, has_errors)
}

fn only(index: &Index, name: &str) -> DefinitionId {
    let found = index.find(name);
    assert_eq!(found.len(), 1, "{name}: {found:?}");
    found[0]
}

/// Who mentions a name, and in which line.
fn uses(sources: &SourceMap, index: &Index, name: &str) -> Vec<(String, u32)> {
    let uses = index.uses(only(index, name));
    uses.map(|used| (index.full_name(used.within), sources.position(used.span).line)).collect()
}

/// Who mentions a name, in the order of the text.
fn who(sources: &SourceMap, index: &Index, name: &str) -> Vec<String> {
    uses(sources, index, name).into_iter().map(|(who, _)| who).collect()
}

const BROKEN: &str = "space broken
system {
  message Zone { /// How deep.
                 level: real[mm]  name: text }
  topic zones = \"z/{a,b}\" : Zone
  topic gone
  node plc { publishes zones }
}
metric depth minimise = max(zones.level)
metric never minimise = last(nowhere.level
requirement R1 \"safe\" = deth <= 3mm
operation cut on zones.level = blackhole
operation other on zones.level, missing = bias [1mm, 2mm]
campaign c { objectives depth  oops  operations cut 1 per test  end after 3s }
campaign d from c { end after 4s }
";

#[test]
fn a_file_with_errors_has_its_definitions_and_their_uses() {
    let (sources, index, has_errors) = index(BROKEN);
    assert!(has_errors);
    let at = |name: &str, line: u32| (name.to_owned(), line);
    let of_zones = [at("plc", 7), at("depth", 9), at("cut", 12), at("other", 13)];
    assert_eq!(uses(&sources, &index, "zones"), of_zones);
    assert_eq!(uses(&sources, &index, "Zone"), [at("zones", 5)]);
    assert_eq!(uses(&sources, &index, "Zone.level"), [at("depth", 9), at("cut", 12), at("other", 13)]);
    assert_eq!(uses(&sources, &index, "depth"), [at("c", 14)]);
    assert_eq!(uses(&sources, &index, "c"), [at("d", 15)]);
    assert_eq!(uses(&sources, &index, "d"), []);
}

#[test]
fn the_key_of_a_filter_is_a_field_of_the_elements_or_a_list_beside_theirs() {
    let (sources, index, has_errors) = index(include_str!("../good/lists.sesame"));
    assert!(!has_errors);
    let of = |name: &str| who(&sources, &index, name);
    assert_eq!(of("Joints.name"), ["elbow", "turning", "bent", "names", "names", "names", "names"]);
    assert_eq!(of("Joints.position"), ["elbow", "turning", "widest", "bent"]);
    assert_eq!(of("Transform.child"), ["apart", "apart", "moved"]);
    assert_eq!(of("Transform.at"), ["apart", "apart", "home", "height", "height", "moved"]);
    assert_eq!(of("Part.level"), ["worst", "failing"]);
}

#[test]
fn a_scene_in_the_arguments_of_what_is_launched_is_mentioned_there() {
    let (sources, index, has_errors) = index(
        "space cell
        system {
          simulator sim = mqtt \"mqtt://127.0.0.1:1883\"
          topic place = \"place\" : real[m]
          launch \"./world\" \"{\\\"boxes\\\": {boxes}}\"
          terminate \"./end\" \"{boxes}\"
          node robot { publishes place  launch \"./robot\" \"{worker}\" \"{start_x}:{start_x}\" }
        }
        metric far maximise default 0m = max(place)
        parameter start_x: real[m] in [-2m, 2m] default 0m
        parameter boxes: int in [0, 6] default 0
        campaign c { objectives far  operations start_x 1 per test  search random { evaluations 2 }  end after 5s }",
    );
    assert!(!has_errors);
    let at = |name: &str, line: u32| (name.to_owned(), line);
    assert_eq!(uses(&sources, &index, "boxes"), [at("sim", 5), at("sim", 6)]);
    assert_eq!(uses(&sources, &index, "start_x"), [at("robot", 7), at("robot", 7), at("c", 12)]);
    for name in ["boxes", "start_x"] {
        assert!(index.uses(only(&index, name)).all(|used| sources.snippet(used.span) == name), "{name}");
    }
}

#[test]
fn an_operation_on_a_node_or_its_parameter_mentions_the_node() {
    let text = "space cell
        system { simulator sim = ros2  node arm { launch \"./arm\" }  node plan { } }
        operation halt on node arm = pause
        operation weak on parameter \"payload\" of plan = set [0, 3]
        operation wrong on node plan = blackhole";
    let (sources, index, _) = index(text);
    assert_eq!(uses(&sources, &index, "arm"), [("halt".to_owned(), 3)]);
    assert_eq!(uses(&sources, &index, "plan"), [("weak".to_owned(), 4), ("wrong".to_owned(), 5)]);
}

#[test]
fn names_that_do_not_resolve_are_references_too() {
    let (sources, index, _) = index(BROKEN);
    let unresolved = index.references.iter().filter(|reference| reference.target.is_none());
    let unresolved: Vec<&str> = unresolved.map(|reference| sources.snippet(reference.span)).collect();
    assert_eq!(unresolved, ["deth", "missing"]);
    let unread: Vec<&str> = index.unread.iter().map(|(name, _)| name.as_str()).collect();
    assert!(unread.contains(&"gone") && unread.contains(&"never"), "{unread:?}");
    assert_eq!(index.find("never"), []);
    assert_eq!(index.most_similar("deth").as_deref(), Some("depth"));
    assert_eq!(index.most_similar("Zone.levl").as_deref(), Some("Zone.level"));
}

#[test]
fn a_definition_has_all_of_its_declaration_and_what_it_belongs_to() {
    let (sources, index, _) = index(BROKEN);
    let level = index.definition(only(&index, "zones.level"));
    assert_eq!((level.kind, level.doc.as_str()), (Kind::Field, "How deep."));
    assert_eq!(sources.snippet(level.full_span), "level: real[mm]");
    assert_eq!(level.owner, Some(only(&index, "Zone")));
    let campaign = index.definition(only(&index, "d"));
    assert_eq!(sources.snippet(campaign.full_span), "campaign d from c { end after 4s }");
}

#[test]
fn a_name_alone_is_a_declaration_before_it_is_a_member_of_one() {
    let text =
        "space s system { message A { level: real } message B { level: real  zones: A } topic zones = \"z\" : B }";
    let (_, index, _) = index(text);
    let level: Vec<String> = index.find("level").into_iter().map(|id| index.full_name(id)).collect();
    assert_eq!(level, ["A.level", "B.level"]);
    assert_eq!(index.definition(only(&index, "zones")).kind, Kind::Topic);
    assert_eq!(index.full_name(only(&index, "zones.zones")), "B.zones");
    assert_eq!(index.full_name(only(&index, "zones.zones.level")), "A.level");
    assert_eq!(index.find("zones.nothing"), []);
}

#[test]
fn the_first_of_several_definitions_is_meant_and_imported_ones_are_first() {
    let mut sources = SourceMap::new();
    let root = sources.add(
        "a.sesame",
        "space a import \"b.sesame\" metric speed minimise { hook on x } requirement R \"r\" = speed <= 1",
    );
    load_imports(&mut sources, root, |_| Ok("metric speed minimise { hook on y }".to_owned()));
    let index = analyse(&sources, root).index;
    let found = index.find("speed");
    assert_eq!(found.len(), 2);
    assert_eq!(sources.file(index.definition(found[0]).span.file).name(), "b.sesame");
    assert_eq!([index.uses(found[0]).count(), index.uses(found[1]).count()], [1, 0]);
}

#[test]
fn what_is_known_inside_of_a_monitor_is_meant_there() {
    let text = include_str!("../good/blocks.sesame");
    let (sources, index, _) = index(text);
    let at = |name: &str, line: u32| (name.to_owned(), line);
    assert_eq!(uses(&sources, &index, "transport.conveyor_stops"), [at("transport", 37), at("transport", 38)]);
    assert_eq!(uses(&sources, &index, "conveyor.conveyor_stops"), [at("transport", 34)], "the demand");
    assert_eq!(uses(&sources, &index, "conveyor"), [at("transport", 34)]);
    assert_eq!(uses(&sources, &index, "known"), [at("again", 73)]);
}

#[test]
fn what_is_said_of_a_monitor_elsewhere_mentions_it_and_its_parts() {
    let text = include_str!("../good/monitors.sesame");
    let (sources, index, has_errors) = index(text);
    assert!(!has_errors);
    let who = |name: &str| who(&sources, &index, name);
    let campaign = "missed_hazards_of_the_certificate";
    assert_eq!(
        who("transport.brakes_ok"),
        [&["transport"; 3][..], &["lie"], &["worst_moment"; 2], &[campaign]].concat()
    );
    assert_eq!(who("transport.fast"), ["quick", "worst_moment", campaign]);
    assert_eq!(who("transport.halted"), ["still", "worst_moment", campaign]);
    assert_eq!(who("conveyor.rolls"), ["worst_moment"]);
    assert_eq!(who("plc"), ["cell", "controller"], "the topic that says a state");
    assert_eq!(who("controller"), ["plc_safe"]);
    assert!(who("R1").contains(&"missed".to_owned()));
    assert!(index.references.iter().all(|reference| reference.target.is_some()));
}

#[test]
fn a_formula_mentions_the_parameter_of_the_space_that_it_reads() {
    let (sources, index, has_errors) = index(include_str!("../good/scenes.sesame"));
    assert!(!has_errors);
    let of = |name: &str| who(&sources, &index, name);
    assert_eq!(of("start_y"), ["moved", "stays", "scenes"]);
    assert_eq!(of("load"), ["burdened", "heavy", "scenes"]);
}

#[test]
fn operations_and_bounds_mention_the_messages_of_their_constants() {
    let (sources, index, has_errors) = index(
        "space cart
        system {
          simulator sim = mqtt \"mqtt://127.0.0.1:1883\"
          message Battery { constant EMPTY = 0  constant FULL = 9  state: int }
          topic battery = \"battery\" : Battery
        }
        metric state minimise default 9 = last(battery.state)
        requirement R1 \"charged\" = state >= Battery.FULL
        operation held on battery.state = stuck at one of Battery.EMPTY, FULL
        operation drawn on battery.state = random one of EMPTY, Battery.FULL
        test known { drawn from 1s to 2s  expect state == Battery.EMPTY }
        campaign c { objectives state  operations held, drawn 1 per test
                     search random { evaluations 2 }  end after 5s }",
    );
    assert!(!has_errors);
    let at = |name: &str, line: u32| (name.to_owned(), line);
    let of_battery = [at("battery", 5), at("R1", 8), at("held", 9), at("drawn", 10), at("known", 11)];
    assert_eq!(uses(&sources, &index, "Battery"), of_battery);
    assert!(index.references.iter().all(|reference| reference.target.is_some()));
}
