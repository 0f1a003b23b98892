//! What formulas say of points, texts, time and groups: from the text of a space to the values of a run.

use sesame_base::time::SimTime;
use sesame_relay::metric::MetricTable;
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::WireTable;

const SPACE: &str = r#"
space field
system {
  simulator field = process "python3" "field.py" { step 100ms }
  message Pose { position: point[m]  heading: real[deg]  mode: text }
  topic poses = "drones/{a,b,c}/pose" : Pose
  topic goals = "drones/{a,b,c}/goal" : point[m]
  topic tower = "tower" : text
}
requirement R1 "the fence is kept" = beyond_fence <= 0m
operation gps on poses.position = bias [(-5, -5, 0)m, (5, 5, 0)m]
"#;

/// Seconds, path, x and y; a drone is `fast` in the right half of the field, and the tower holds from 2 s on.
const SENT: &[(f64, &str, f64, f64)] = &[
    (0.0, "drones/a/goal", 0.0, 40.0),
    (0.0, "drones/b/goal", 40.0, 40.0),
    (0.0, "tower", 0.0, 0.0),
    (1.0, "drones/a/pose", 10.0, 40.0),
    (1.0, "drones/b/pose", 40.0, 10.0),
    (1.0, "drones/c/pose", 40.0, 13.0),
    (2.0, "tower", 1.0, 0.0),
    (3.0, "drones/a/pose", 53.0, 54.0),
    (3.0, "drones/b/pose", 40.0, 41.0),
    (3.0, "drones/c/pose", 43.0, 45.0),
    (4.0, "tower", 0.0, 0.0),
];

fn payload(path: &str, x: f64, y: f64) -> Value {
    let position = Value::Point([x, y, 2.5]);
    match path {
        "tower" => Value::from(if x > 0.0 { "hold" } else { "free" }),
        _ if path.ends_with("goal") => position,
        _ => {
            let mode = Value::from(if x > 25.0 { "fast" } else { "slow" });
            Record::new(&Fields::new(["position", "heading", "mode"]), vec![position, Value::Real(60.0), mode]).into()
        }
    }
}

/// The values of metrics, each with its formula, after ten seconds.
fn values(formulas: &[(&str, &str)]) -> Vec<Option<f64>> {
    let metrics: Vec<String> = formulas.iter().map(|(name, formula)| format!("metric {name} = {formula}\n")).collect();
    let metrics = metrics.concat();
    let names: Vec<&str> = formulas.iter().map(|(name, _)| *name).collect();
    let campaign = format!("campaign look {{ passive 1 times  observes {}  end after 10s }}", names.join(", "));
    let mut sources = sesame_dsl::source::SourceMap::new();
    let file = sources.add("field.sesame", format!("{SPACE}{metrics}{campaign}"));
    let analysis = sesame_dsl::analyse(&sources, file);
    let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
    let (campaign, _) = space.campaigns.iter().next().expect("there is a campaign");
    let plan = sesame_codegen::lower::lower(&space, campaign, "field.sesame", "sesamec").plan;
    plan.validate().expect("the plan is sound");
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).expect("no metric has a hook");
    let mut run = table.start();
    run.begin();
    for &(time, path, x, y) in SENT {
        let wire = wires.find(path).expect("the space declares all paths");
        run.message(SimTime::from_seconds(time), wire, &payload(path, x, y));
    }
    run.end(SimTime::from_seconds(10.0));
    let (observed, warnings) = run.finish(&[]);
    assert_eq!(warnings, Vec::<String>::new());
    let of = |name: &str| plan.metrics.iter().position(|metric| metric.name == name).expect("it is observed");
    names.into_iter().map(|name| observed[of(name)].value).collect()
}

#[test]
fn formulas_of_points_texts_time_and_groups_give_the_values_that_one_computes_by_hand() {
    const FENCE: &str = "polygon((0, 0), (5000, 0), (5000, 5000), (0, 5000))cm";
    let fence = |of: &str| format!("{of}(signed_distance(each of poses.position, {FENCE}))");
    let (beyond, nearest) = (fence("max"), fence("min"));
    let expected: &[(&str, &str, f64)] = &[
        ("beyond_fence", &beyond, 5.0),
        ("deepest", &nearest, -10.0),
        ("fenced", "robustness(always signed_distance(each of poses.position, box((0, 0), (50, 50))m) < 0m)", -5.0),
        ("below_roof", "max(signed_distance(each of poses.position, box((0, 0, 0), (60, 60, 4))m))", -1.5),
        ("closest", "min(distance(each pair of poses.position))", 3.0),
        ("widest", "max(distance(each pair of poses.position))", f64::hypot(30.0, 30.0)),
        ("near", "duration(distance(each pair of poses.position) < 6m)", 9.0),
        ("apart", "robustness(always distance(each pair of poses.position) > 2m)", 1.0),
        ("missed", "max(distance(each of poses.position, each of goals)) when time < 2s", 30.0),
        ("arrived", "min(distance(each of poses.position, each of goals))", 1.0),
        ("rightmost", "max(max of poses.position.x)", 53.0),
        ("from_gate", "min(distance(each of poses.position, (4000, 0, 250)cm))", 10.0),
        ("held", "duration(tower == \"hold\")", 2.0),
        ("all_fast", "count(poses.mode == \"fast\" and tower != \"free\")", 1.0),
        ("any_slow", "count(max of poses.mode != \"fast\")", 1.0),
        ("last_slow", "when each of poses.mode == \"slow\" then time", 1.0),
        ("obeyed", "robustness(always (tower == \"hold\" implies poses.position.z < 2m))", -0.5),
        ("heading", "last(cos(each of poses.heading) * 2)", 1.0),
        ("radius", "max(hypot(each of poses.position.x, each of poses.position.y))", f64::hypot(53.0, 54.0)),
        ("root", "last(sqrt(poses.position.z * 10m))", 5.0),
        ("turn", "last(atan2(poses.position.z, poses.position.z) - 45deg)", 0.0),
    ];
    let formulas: Vec<(&str, &str)> = expected.iter().map(|(name, formula, _)| (*name, *formula)).collect();
    for ((name, formula, value), found) in expected.iter().zip(values(&formulas)) {
        let found = found.unwrap_or_else(|| panic!("{name} = {formula} has no value"));
        assert!((found - value).abs() < 1e-9, "{name} = {formula} is {found}, not {value}");
    }
}
