use sesame_plan::{CoverageGoal, GridAxis};
use sesame_present::table::TextOptions;
use sesame_record::{Recorder, ResultSet, Status, sample};

use super::*;

fn repository() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::covering(folder.path());
    (folder, repository)
}

fn all() -> Selection {
    Selection::default()
}

fn names(dataset: &Table) -> Vec<String> {
    let first = dataset.rows().into_iter().map(|row| match &row[0] {
        Datum::Test(test) => test.to_string(),
        other => panic!("{other:?}"),
    });
    first.collect()
}

#[test]
fn tests_are_listed_with_the_values_that_were_recorded() {
    let (_folder, repository) = repository();
    let dataset = tests(&repository, &all()).unwrap();
    let rows = repository.tests().unwrap();
    let searched: Vec<_> = rows.iter().filter(|row| row.origin != Origin::Reference).collect();
    assert_eq!(dataset.rows().len(), searched.len());
    for (row, found) in dataset.rows().iter().zip(searched) {
        assert_eq!(row[0], Datum::test(found.number));
        assert_eq!(row[3], Datum::Text(found.outcome.word().to_owned()));
        for (at, datum) in row[6..].iter().enumerate() {
            let id = MetricId(u32::try_from(at).unwrap());
            assert_eq!(*datum, Datum::real(found.value(id).value));
        }
    }
    insta::assert_snapshot!("tests", dataset.text(TextOptions { width: None, colour: false }));
}

#[test]
fn the_front_of_all_tests_is_that_of_the_campaign_and_equal_tests_say_so() {
    let (_folder, repository) = repository();
    let dataset = front(&repository, &all()).unwrap();
    let mut standing = dataset.rows();
    standing.retain(|row| row.last() == Some(&Datum::Missing));
    let recorded = repository.latest_result_set().unwrap().unwrap().members;
    let recorded: Vec<Datum> = recorded.into_iter().map(Datum::test).collect();
    assert!(recorded.len() > 2);
    assert_eq!(standing.iter().map(|row| row[0].clone()).collect::<Vec<_>>(), recorded);
    // Values are those of the tests, whichever way they are optimised.
    let listed = tests(&repository, &all()).unwrap().rows();
    for row in dataset.rows() {
        let test = listed.iter().find(|test| test[0] == row[0]).unwrap();
        assert_eq!(row[1..3], [test[7].clone(), test[6].clone()], "fuzzing time and collisions");
    }
    let members = Selection::of(&repository, Some("front")).unwrap();
    assert_eq!(front(&repository, &members).unwrap().rows().len(), standing.len());
}

#[test]
fn a_set_that_is_not_there_is_refused_with_those_that_are() {
    let (_folder, repository) = repository();
    let error = Selection::of(&repository, Some("frond")).unwrap_err().to_string();
    assert!(error.starts_with("no set of results `frond`; there are `generation-0` and `front`"), "{error}");
}

#[test]
fn points_are_those_of_the_observed_intervals_in_the_convention_asked_for() {
    let (_folder, repository) = repository();
    let dataset = sspr(&repository, &all(), &Dimension::ALL, Convention::Original).unwrap();
    assert_eq!(dataset.columns().len(), 10);
    let mut compared = 0;
    for row in dataset.rows() {
        let Datum::Test(test) = &row[0] else { panic!("{row:?}") };
        let record = repository.test(repository.find(&test.to_string()).unwrap()).unwrap();
        let disturbances = sesame_search::sspr::observed(repository.plan(), &record.test, &record.observation);
        let point = sesame_search::sspr::Point::from_disturbances(&disturbances, Convention::Original).unwrap();
        for (datum, dimension) in row[1..].iter().zip(Dimension::ALL) {
            assert_eq!(*datum, Datum::real(point.get(dimension)), "{test} {dimension:?}");
        }
        compared += 1;
    }
    assert!(compared > 50);
    let few = sspr(&repository, &all(), &[Dimension::P2, Dimension::T1], Convention::Ours).unwrap();
    assert_eq!(few.columns(), ["test", "P2", "T1"]);
    assert_eq!(names(&few), names(&dataset));
}

#[test]
fn coverage_afterwards_is_counted_on_the_grid_asked_for() {
    let (_folder, repository) = repository();
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6").unwrap();
    let analysis = coverage(&repository, &all(), grid.clone(), 1, Convention::Ours).unwrap();
    let curve = analysis.curve();
    let rows = curve.rows();
    let last = rows.last().unwrap();
    assert_eq!(last[2], Datum::Whole(36));
    let cells = analysis.cells();
    let covered = cells.rows().iter().filter(|row| row[5] == Datum::Truth(true)).count();
    assert_eq!((cells.rows().len(), Datum::count(covered)), (36, last[1].clone()));
    let feasible = cells.rows().iter().filter(|row| row[6] == Datum::Truth(true)).count();
    assert_eq!(Datum::count(feasible), last[4]);
    assert_eq!(cells.columns(), ["T1_low", "T1_high", "T2_low", "T2_high", "hits", "covered", "feasible"]);
    let twice = coverage(&repository, &all(), grid, 2, Convention::Ours).unwrap();
    assert!(twice.curve().rows().len() < curve.rows().len());
}

#[test]
fn campaigns_tell_what_a_file_holds() {
    let (_folder, repository) = repository();
    let dataset = campaigns(&[repository], Readers::Programs).unwrap();
    let row = &dataset.rows()[0];
    assert_eq!(row[2], Datum::Text("coverage_experiment".to_owned()));
    assert_eq!(row[5], Datum::Whole(61));
    assert_eq!(row[8], Datum::Text("generation-0 front".to_owned()));
}

#[test]
fn people_are_shown_the_first_and_the_last_of_many_result_sets_and_programs_all() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), &sample::plan(), 1, 1).unwrap();
    let sets = |recorder: &Recorder, readers| {
        let repository = Repository::open(recorder.repository().path()).unwrap();
        match &campaigns(&[repository], readers).unwrap().rows()[0][8] {
            Datum::Text(names) => names.clone(),
            other => panic!("{other:?}"),
        }
    };
    for generation in 0..40 {
        let name = format!("generation-{generation}");
        let status = Status::Intermediate;
        recorder
            .put_result_set(&ResultSet { name, generation: Some(generation), status, members: Vec::new() })
            .unwrap();
        let people = sets(&recorder, Readers::People);
        assert!(people.len() < 50, "{people}");
        if generation < 3 {
            assert_eq!(people, sets(&recorder, Readers::Programs));
        }
    }
    assert_eq!(sets(&recorder, Readers::People), "generation-0 … generation-39 (40)");
    assert_eq!(sets(&recorder, Readers::Programs).split(' ').count(), 40);
}

#[test]
fn what_is_printed_for_programs_reads_back() {
    let mut dataset = Table::new(["a".to_owned(), "b, \"c\"".to_owned(), "d".to_owned(), "e".to_owned()]);
    let third = 0.1 + 0.2;
    dataset.row([Datum::Text("x\ny".to_owned()), Datum::Real(third), Datum::Missing, Datum::Truth(true)]);
    dataset.row([Datum::Whole(-3), Datum::Real(1e300), Datum::Text(String::new()), Datum::Whole(7)]);
    let csv = dataset.csv();
    assert!(csv.starts_with("a,\"b, \"\"c\"\"\",d,e\n\"x\ny\",0.30000000000000004,,true\n-3,1000000"), "{csv}");
    let json: serde_json::Value = serde_json::from_str(&dataset.json()).unwrap();
    assert_eq!(json[0]["b, \"c\""].as_f64(), Some(third));
    assert_eq!(json[1]["b, \"c\""].as_f64(), Some(1e300));
    assert!(json[0]["d"].is_null());
    assert_eq!(Table::new(["a".to_owned()]).json(), "[]\n");
    assert_eq!(Datum::real(Some(f64::NAN)), Datum::Missing);
}

#[test]
fn numbers_of_unlike_things_in_one_column_have_digits_of_their_own() {
    let mut dataset = Table::new(["measure".to_owned(), "median".to_owned()]);
    for (name, value) in [("hypervolume", 19_852.6), ("igd_plus", 0.1346), ("p", 1.75e-4), ("tests", 210.0)] {
        dataset.row([Datum::Text(name.to_owned()), Datum::lone(Some(value))]);
    }
    let text = dataset.text(sesame_present::table::TextOptions { width: None, colour: false });
    let shown: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split_whitespace().last()).collect();
    assert_eq!(shown, ["19853", "0.135", "1.75e-4", "210"], "{text}");
    assert_eq!(Datum::lone(Some(f64::INFINITY)), Datum::Missing);
}

/// Numbers of a column, by its name.
fn numbers(dataset: &Table, column: &str) -> Vec<Option<f64>> {
    let at = dataset.columns().iter().position(|&name| name == column).unwrap();
    let number = |row: &Vec<Datum>| match row[at] {
        Datum::Missing => None,
        Datum::Real(number) | Datum::Lone(number) => Some(number),
        Datum::Whole(number) => Some(number as f64),
        ref other => panic!("{other:?} is not a number"),
    };
    dataset.rows().iter().map(number).collect()
}

#[test]
fn indicators_are_those_recorded_and_end_on_the_front() {
    let (_folder, repository) = repository();
    let analysis = indicators(&repository, None).unwrap();
    let dataset = analysis.dataset();
    let recorded = repository.indicators().unwrap();
    assert_eq!(recorded.len(), 7);
    let volumes: Vec<Option<f64>> = recorded.iter().map(|generation| generation.hypervolume).collect();
    assert_eq!(numbers(&dataset, "hypervolume"), volumes);
    assert!(volumes.is_sorted() && volumes[0] < volumes[6], "{volumes:?}");
    let distances = numbers(&dataset, "igd_plus");
    assert!(distances.iter().rev().is_sorted() && distances[0] > Some(0.0), "{distances:?}");
    assert_eq!(distances[6], Some(0.0), "the last front is the front");
    let last = &analysis.generations[6];
    assert_eq!((last.evaluations, last.unique), (Some(61), Some(60)));
    assert_eq!((last.crashes, last.timeouts), (Some(2), Some(1)));
    insta::assert_snapshot!("indicators", dataset.text(TextOptions { width: None, colour: false }));
}

#[test]
fn hypervolumes_are_measured_anew_from_the_point_given() {
    let (_folder, repository) = repository();
    let own = indicators(&repository, None).unwrap();
    let point: Vec<f64> = own.reference.iter().map(|(_, value)| *value).collect();
    let same = indicators(&repository, Some(&point)).unwrap();
    assert_eq!((&same.generations, &same.reference), (&own.generations, &own.reference));
    let farther = indicators(&repository, Some(&[point[0] + 10.0, point[1] - 1.0])).unwrap();
    assert!(farther.generations[6].hypervolume > own.generations[6].hypervolume);
}

/// The names of the objectives, and the points of the front that `front` shows, in their units.
fn shown_front(repository: &Repository) -> (Vec<String>, Vec<Vec<f64>>) {
    let plan = repository.plan();
    let names: Vec<String> = plan.campaign.objectives.iter().map(|&metric| plan.metric(metric).name.clone()).collect();
    let table = front(repository, &all()).unwrap();
    let columns: Vec<Vec<f64>> =
        names.iter().map(|name| numbers(&table, name).into_iter().map(Option::unwrap).collect()).collect();
    let points = (0..columns[0].len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect();
    (names, points)
}

#[test]
fn a_front_is_at_no_distance_from_itself_however_it_is_given() {
    let (folder, repository) = repository();
    let plan = repository.plan();
    let (names, points) = shown_front(&repository);
    let rows = |between: &str| -> String {
        let row = |point: &Vec<f64>| point.iter().map(f64::to_string).collect::<Vec<_>>().join(between);
        points.iter().map(row).collect::<Vec<_>>().join("\n")
    };
    let table = front(&repository, &all()).unwrap();
    let reordered = format!("other,\"{}\",{}\n{}", names[1], names[0], {
        let row = |point: &Vec<f64>| format!("\"a, b\",{},{}", point[1], point[0]);
        points.iter().map(row).collect::<Vec<_>>().join("\n")
    });
    let texts = [
        table.csv(),
        table.json(),
        rows(","),
        format!("# of pymoo\n{}\n", rows(" ")),
        serde_json::to_string(&points).unwrap(),
        reordered,
    ];
    let mut given: Vec<GivenFront> =
        texts.iter().map(|text| GivenFront::read(text, plan).unwrap_or_else(|why| panic!("{why}: {text}"))).collect();
    given.push(GivenFront::of_results(&Repository::open(folder.path()).unwrap(), plan).unwrap());
    for given in given {
        for scaling in [Scaling::ByRange, Scaling::Unscaled] {
            let found = distances(&repository, &given, scaling).unwrap();
            let own: Vec<Option<u32>> =
                repository.indicators().unwrap().iter().map(|indicator| Some(indicator.generation)).collect();
            assert_eq!(found.iter().map(|distance| distance.generation).collect::<Vec<_>>(), own);
            let last = found.last().unwrap();
            assert_eq!((last.igd, last.igd_plus), (Some(0.0), Some(0.0)), "{given:?}");
            assert_eq!(last.front, points.len());
            assert!(found[0].igd >= found[0].igd_plus && found[0].igd > Some(0.0));
        }
    }
}

#[test]
fn distances_to_a_given_front_are_those_of_the_definition() {
    let (_folder, repository) = repository();
    let plan = repository.plan();
    let (_, points) = shown_front(&repository);
    let given = vec![vec![0.0, 0.0], vec![1000.0, 10.0]];
    let read = GivenFront::read(&serde_json::to_string(&given).unwrap(), plan).unwrap();
    // Smaller is better.
    let oriented = |of: &[Vec<f64>], by: [f64; 2]| -> Vec<[f64; 2]> {
        let one = |point: &Vec<f64>| {
            let objectives: Vec<_> = plan.objectives().collect();
            [0, 1].map(|at| objectives[at].oriented(point[at]) / by[at])
        };
        of.iter().map(one).collect()
    };
    for (scaling, by) in [(Scaling::Unscaled, [1.0, 1.0]), (Scaling::ByRange, [1000.0, 10.0])] {
        let (front, given) = (oriented(&points, by), oriented(&given, by));
        let mean = |distance: &dyn Fn(&[f64; 2], &[f64; 2]) -> f64| {
            let nearest = |z: &[f64; 2]| front.iter().map(|a| distance(a, z)).fold(f64::INFINITY, f64::min);
            given.iter().map(nearest).sum::<f64>() / given.len() as f64
        };
        let igd = mean(&|a, z| libm::hypot(a[0] - z[0], a[1] - z[1]));
        let plus = mean(&|a, z| libm::hypot((a[0] - z[0]).max(0.0), (a[1] - z[1]).max(0.0)));
        let found = distances(&repository, &read, scaling).unwrap();
        let last = found.last().unwrap();
        assert!((last.igd.unwrap() - igd).abs() < 1e-9 && (last.igd_plus.unwrap() - plus).abs() < 1e-9, "{last:?}");
    }
    insta::assert_snapshot!(
        "distances",
        distance_table(&distances(&repository, &read, Scaling::ByRange).unwrap())
            .text(TextOptions { width: None, colour: false })
    );
}

#[test]
fn what_is_no_front_of_the_campaign_is_refused() {
    let (_folder, repository) = repository();
    let plan = repository.plan();
    let name = |at: usize| plan.metric(plan.campaign.objectives[at]).name.clone();
    let said: Vec<String> = [
        String::new(),
        "[]".to_owned(),
        "1,2,3".to_owned(),
        "1 2\n3".to_owned(),
        "1,2\n3,x".to_owned(),
        "1,2\n3,inf".to_owned(),
        format!("{},speed\n1,2", name(0)),
        "[[1, 2], [3]]".to_owned(),
        "[[1, \"x\"]]".to_owned(),
        format!("[{{\"{}\": 1}}]", name(0)),
        "[1, 2]".to_owned(),
        "[[1, 2]".to_owned(),
    ]
    .iter()
    .map(|text| GivenFront::read(text, plan).map(|_| ()).unwrap_err())
    .collect();
    insta::assert_snapshot!(said.join("\n"), @r#"
    it has no points
    it has no points
    it has 3 columns for 2 objectives (fuzzing_time, collision_occurrence)
    row 2 ends before column 2
    row 2 holds `x`, which is not a number
    row 2 holds inf, which is not a finite number
    it has no column `collision_occurrence`; its columns are fuzzing_time, speed
    row 2 does not hold 2 numbers, one for each objective (fuzzing_time, collision_occurrence)
    row 1 holds "x", which is not a number
    row 1 has no `collision_occurrence`
    row 1 is neither a list nor an object
    it is not a list in JSON: EOF while parsing a list at line 1 column 7
    "#);
}

#[test]
fn statistics_are_those_of_the_values_recorded() {
    let (_folder, repository) = repository();
    let table = statistics(&repository, &all()).unwrap();
    let (tests, means) = (numbers(&table, "tests"), numbers(&table, "mean"));
    let deviations = numbers(&table, "deviation");
    let rows = repository.tests().unwrap();
    for (id, _) in (0u32..).zip(&repository.plan().metrics) {
        let searched = rows.iter().filter(|row| row.origin != Origin::Reference && row.duplicate_of.is_none());
        let values: Vec<f64> = searched.filter_map(|row| row.value(MetricId(id)).value).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
        let at = id as usize;
        assert_eq!(tests[at], Some(n));
        assert!((means[at].unwrap() - mean).abs() < 1e-9, "{means:?}");
        assert!((deviations[at].unwrap() - libm::sqrt(variance)).abs() < 1e-9, "{deviations:?}");
    }
}

/// Runs of one campaign, so many tests long.
fn runs(folder: &std::path::Path, groups: &[(&str, &[u32])]) -> Vec<Run> {
    let mut plan = sample::plan();
    let axis = GridAxis { dimension: Dimension::T1, low: 0.0, high: 1.0, cells: 6 };
    plan.campaign.coverage = Some(CoverageGoal { axes: vec![axis], hits: 1, stop_at: None });
    let mut runs = Vec::new();
    for (group, lengths) in groups {
        for &length in *lengths {
            let folder = folder.join(format!("{group}-{length}"));
            let repository = sample::campaign(&folder, &plan, length);
            runs.push(Run { group: (*group).to_owned(), repository });
        }
    }
    runs
}

#[test]
fn runs_are_measured_from_one_point_to_one_front() {
    let folder = tempfile::tempdir().unwrap();
    let runs = runs(folder.path(), &[("short", &[30]), ("long", &[90])]);
    let comparison = compare(&runs, None, None).unwrap();
    assert!(!comparison.has_groups() && comparison.covers);
    let table = comparison.runs();
    let column = |name: &str| numbers(&table, name);
    assert_eq!(column("tests"), [Some(31.0), Some(91.0)]);
    // The longer run holds all tests of the shorter one, so its front is the joint one.
    assert_eq!((column("igd_plus")[1], column("joint_share")[1]), (Some(0.0), Some(1.0)));
    assert!(column("igd_plus")[0] > Some(0.0) && column("joint_share")[0] < Some(1.0));
    assert!(column("hypervolume")[0] < column("hypervolume")[1]);
    assert!(column("coverage")[0] <= column("coverage")[1]);
    assert_eq!(numbers(&comparison.pairs(), "c")[1], Some(1.0), "the longer run's front covers the shorter one's");
    // Brute force: the area below a staircase, by counting squares.
    let point: Vec<f64> = comparison.reference.iter().map(|(_, value)| *value).collect();
    let listed = front(&runs[0].repository, &all()).unwrap();
    let members: Vec<(f64, f64)> = numbers(&listed, "fuzzing_time")
        .into_iter()
        .zip(numbers(&listed, "collision_occurrence"))
        .map(|(x, y)| (x.unwrap(), y.unwrap()))
        .collect();
    let (mut area, steps) = (0.0, 20_000u32);
    for step in 0..steps {
        let x = point[0] * (f64::from(step) + 0.5) / f64::from(steps);
        let best = members.iter().filter(|member| member.0 <= x).map(|member| member.1).fold(point[1], f64::max);
        area += (best - point[1]) * point[0] / f64::from(steps);
    }
    let volume = column("hypervolume")[0].unwrap();
    assert!((volume - area).abs() < 1e-3 * area, "{volume} {area}");
}

#[test]
fn groups_are_compared_by_medians_and_ranks() {
    let folder = tempfile::tempdir().unwrap();
    let groups: [(&str, &[u32]); 2] = [("short", &[20, 24, 28, 32, 36]), ("long", &[120, 130, 140, 150, 160])];
    let comparison =
        compare(&runs(folder.path(), &groups), Some(&[200.0, 0.0]), Grid::parse("T2:0:0.5:4").ok()).unwrap();
    assert!(comparison.has_groups());
    assert_eq!(comparison.reference, [("fuzzing_time".to_owned(), 200.0), ("collision_occurrence".to_owned(), 0.0)]);
    let table = comparison.groups();
    insta::assert_snapshot!("compared_groups", table.text(TextOptions { width: None, colour: false }));
    assert_eq!(numbers(&table, "median")[8..10], [Some(29.0), Some(141.0)], "tests, the known one included");
    let p = numbers(&table, "p");
    assert!((p[9].unwrap() - 2.0 / 252.0).abs() < 1e-12);
    assert_eq!(comparison.runs().rows().len(), 10);
}

#[test]
fn what_has_no_common_measure_is_refused_or_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut both = runs(folder.path(), &[("a", &[20])]);
    let mut plan = sample::plan();
    plan.campaign.objectives.reverse();
    let repository = sample::campaign(&folder.path().join("other"), &plan, 20);
    both.push(Run { group: "b".to_owned(), repository });
    let error = compare(&both, None, None).unwrap_err().to_string();
    let theirs = "has fuzzing_time [s] minimised, collision_occurrence maximised, ";
    assert!(
        error.starts_with("runs with different objectives cannot be compared: ") && error.contains(theirs),
        "{error}"
    );
    let error = compare(&both[..1], Some(&[1.0]), None).unwrap_err().to_string();
    assert!(error.starts_with("the reference point has 1 values for 2 objectives"), "{error}");

    plan.campaign.objectives.clear();
    let without = |name: &str| {
        let repository = sample::campaign(&folder.path().join(name), &plan, 20);
        Run { group: name.to_owned(), repository }
    };
    let table = compare(&[without("c"), without("d")], None, None).unwrap();
    assert!(!table.covers && table.reference.is_empty());
    for measure in ["hypervolume", "igd_plus", "joint_share", "coverage"] {
        assert_eq!(numbers(&table.runs(), measure), [None, None], "{measure}");
    }
}
