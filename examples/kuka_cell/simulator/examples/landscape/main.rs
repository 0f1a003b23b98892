//! Prints the behaviour of the cell without disturbance and under jitter, as the tables of the crate's README.
//!
//! `cargo run --release -p kuka_cell_sim --example landscape`

mod disturbed;

use disturbed::{Jitter, Outcome, level, outcome, real, run};
use kuka_cell_sim::arm::target_topic;
use kuka_cell_sim::zones::{ZONES, zone_topic};
use kuka_cell_sim::{Cell, NoisyCell};

const UP: (f64, f64) = (0.27, 0.29);
const DOWN: (f64, f64) = (-0.29, -0.27);

fn main() {
    without_disturbance();
    println!("\n## Long jitter\n");
    println!("| joint | offset, rad | window, s | collisions | top speed, m/s | approach, mm | cycle, s |");
    println!("|---|---|---|---|---|---|---|");
    let known = [(1, UP, (8.0, 57.0)), (0, UP, (8.0, 57.0)), (0, DOWN, (8.0, 57.0))];
    let whole = [UP, DOWN, (-0.3, 0.3), (0.0, 0.3), (0.1, 0.17), (-0.17, -0.1)];
    let whole = whole.into_iter().flat_map(|offset| [0, 1].map(|link| (link, offset, (0.0, 65.0))));
    for (link, offset, window) in known.into_iter().chain(whole) {
        let Outcome { collisions, top_speed, approach, cycle_time } =
            outcome(&run::<Cell>(0, &[Jitter { link, offset, window }]));
        let cycle = cycle_time.map_or("not by 70 s".to_owned(), |seconds| format!("{seconds:.2}"));
        println!(
            "| Link{link} | {} to {} | {} to {} | {collisions} | {top_speed:.2} | {approach:.0} | {cycle} |",
            offset.0, offset.1, window.0, window.1
        );
    }
    println!("\n## Known test (the first row) with torque noise, seeds 1 to 10: collisions and top speed in m/s\n");
    for seed in 1..=10 {
        let Outcome { collisions, top_speed, .. } =
            outcome(&run::<NoisyCell>(seed, &[Jitter { link: 1, offset: UP, window: (8.0, 57.0) }]));
        print!("{collisions} ({top_speed:.3})  ");
    }
    println!("\n\n## Collisions, top speed in m/s and approach in mm by the 5 s in which a joint is off by 0.28 rad\n");
    println!("| from, s | Link0 + | Link0 − | Link1 + | Link1 − |\n|---|---|---|---|---|");
    for from in (0..13).map(|i| f64::from(i) * 5.0) {
        print!("| {from} |");
        for (link, offset) in [(0, UP), (0, DOWN), (1, UP), (1, DOWN)] {
            let Outcome { collisions, top_speed, approach, .. } =
                outcome(&run::<Cell>(0, &[Jitter { link, offset, window: (from, from + 5.0) }]));
            print!(" {collisions}, {top_speed:.2}, {approach:.0} |");
        }
        println!();
    }
}

fn without_disturbance() {
    let bench = run::<Cell>(0, &[]);
    println!("## Without disturbance\n\n{:?}\n", outcome(&bench));
    println!("| zone | smallest level, mm | at, s | below 300 mm during, s |\n|---|---|---|---|");
    let pairs = ["ZR270073", "ZR270072", "ZR270073R270072"];
    for name in ZONES.iter().map(|zone| zone.name).chain(pairs) {
        let messages = bench.published(&zone_topic(name));
        let nearest = messages.iter().min_by(|a, b| level(a).total_cmp(&level(b))).expect("there are messages");
        let near = spans(messages.iter().map(|message| (message.time.seconds(), level(message) < 300.0)));
        println!("| {name} | {:.0} | {:.2} | {near} |", level(nearest), nearest.time.seconds());
    }
    println!("\n| joint extreme of R3200 | during, s |\n|---|---|");
    for (link, name, beyond) in [
        (0, "Link0 above 2.5", (|q| q > 2.5) as fn(f64) -> bool),
        (0, "Link0 below -2.5", |q| q < -2.5),
        (1, "Link1 above 0.8", |q| q > 0.8),
        (1, "Link1 below -0.4", |q| q < -0.4),
    ] {
        let targets = bench.published(&target_topic("R3200ProductMove", link));
        println!(
            "| {name} | {} |",
            spans(targets.iter().map(|message| (message.time.seconds(), beyond(real(message)))))
        );
    }
    let begun = std::time::Instant::now();
    let n_runs = 20;
    for _ in 0..n_runs {
        std::hint::black_box(run::<Cell>(0, &[]));
    }
    println!("\none run of 70 s: {:.1} ms", begun.elapsed().as_secs_f64() * 1000.0 / f64::from(n_runs));
}

/// The times at which a condition holds, as a list of spans.
fn spans(course: impl Iterator<Item = (f64, bool)>) -> String {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    let mut held = false;
    for (time, holds) in course {
        match spans.last_mut() {
            Some(last) if held && holds => last.1 = time,
            _ if holds => spans.push((time, time)),
            _ => {}
        }
        held = holds;
    }
    spans.iter().map(|(from, until)| format!("{from:.1} to {until:.1}")).collect::<Vec<_>>().join(", ")
}
