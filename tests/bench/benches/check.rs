//! What checking a space costs by its number of lines, from its text to its plans.

use std::fmt::Write as _;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sesamec::frontend::{Look, SESAME};

/// A space with this many lines, all of which say something: topics, metrics, requirements, operations, known tests.
fn space(lines: usize) -> String {
    let mut text = String::from(
        "space large\nsystem {\n  simulator sim = in_process \"sim::Sim\" { crate \"simulator\"  step 1ms }\n  \
         message Zone { zone: text  level: real[mm]  object1: text  object2: text }\n",
    );
    let groups = (lines - 11) / 10;
    for n in 0..groups {
        writeln!(text, "  topic link{n} = \"joints/robot{n}/position\" : real[rad]").expect("text grows");
        writeln!(text, "  topic zone{n} = \"safetyzones/{n}/{{Z1,Z2,Z3}}\" : Zone").expect("text grows");
    }
    text.push_str("}\nmetric fuzzing_time minimise = fuzzing_time()\n");
    for n in 0..groups {
        write!(
            text,
            "/// How near the gripper of robot {n} comes.\n\
             metric near{n} = when zone{n}.level < 300mm then zone{n}.level / 300mm * 10\n\
             requirement R{n} \"Gripper {n} stays out of its safety zones\" = near{n} >= 0.5\n\
             operation jitter{n} on link{n} = random offset [-0.3rad, 0.3rad]   within [0s, 65s]\n\
             operation lose{n}   on link{n} = packet loss [0%, 100%]            within [0s, 65s]\n\
             test known{n} {{\n  jitter{n} offset [0.27rad, 0.29rad] from 8s to 57s   lose{n} loss 40% from 1s to 20s\n}}\n"
        )
        .expect("text grows");
    }
    text.push_str(
        "campaign c {\n  objectives fuzzing_time\n  operations jitter0, lose0 1..5 per test\n  \
         search nsga2 { population 10  evaluations 210 }  end after 70s\n}\n",
    );
    text
}

fn check(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("check");
    group.sample_size(10);
    for lines in [1_000, 10_000, 100_000] {
        let text = space(lines);
        let found = text.lines().count();
        assert!(found.abs_diff(lines) <= 10, "{found} lines");
        let checked = (SESAME.check)("large.sesame", &text, Look::Short);
        assert_eq!(checked.errors, 0, "{}", checked.diagnostics.lines().next().unwrap_or_default());
        group.throughput(Throughput::Elements(lines as u64));
        group.bench_function(BenchmarkId::new("lines", lines), |bencher| {
            bencher.iter(|| black_box((SESAME.check)("large.sesame", black_box(&text), Look::Short)));
        });
    }
    group.finish();
}

criterion_group!(benches, check);
criterion_main!(benches);
