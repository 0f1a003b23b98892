//! Prints what the undisturbed cell does and what jitter does to it, as the tables of the crate's README.
//!
//! `cargo run --release -p kuka_cell_sim --example landscape`

mod disturbed;

use disturbed::{Jitter, Outcome, level, outcome, real, run};
use kuka_cell_sim::arm::target_topic;
use kuka_cell_sim::zones::{ZONES, zone_topic};
use kuka_cell_sim::{Cell, GRIPPER_SPEED_TOPIC};

fn main() {
    undisturbed();
    println!("\n## Jitter\n");
    println!("| joint | offset, rad | window, s | collisions | top speed, m/s | approach, mm | cycle, s |");
    println!("|---|---|---|---|---|---|---|");
    let known = [(1, (0.27, 0.29), (8.0, 57.0)), (0, (0.27, 0.29), (8.0, 57.0)), (0, (-0.29, -0.27), (8.0, 57.0))];
    let whole = [(0.27, 0.29), (-0.29, -0.27), (-0.3, 0.3), (0.0, 0.3), (0.1, 0.17), (-0.17, -0.1)];
    let whole = whole.into_iter().flat_map(|offset| [0, 1].map(|link| (link, offset, (0.0, 65.0))));
    let short = (0..13).flat_map(|i| {
        let window = (f64::from(i) * 5.0, f64::from(i) * 5.0 + 5.0);
        [(0, (0.27, 0.29), window), (0, (-0.29, -0.27), window), (1, (0.27, 0.29), window), (1, (-0.29, -0.27), window)]
    });
    for (link, offset, window) in known.into_iter().chain(whole).chain(short) {
        let Outcome { collisions, top_speed, approach, cycle_time } =
            outcome(&run::<Cell>(0, &[Jitter { link, offset, window }]));
        let cycle = cycle_time.map_or("not completed".to_owned(), |seconds| format!("{seconds:.2}"));
        println!(
            "| Link{link} | {} to {} | {} to {} | {collisions} | {top_speed:.2} | {approach:.0} | {cycle} |",
            offset.0, offset.1, window.0, window.1
        );
    }
}

fn undisturbed() {
    let bench = run::<Cell>(0, &[]);
    println!("## Undisturbed\n\n{:?}\n", outcome(&bench));
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
    if std::env::args().any(|argument| argument == "--trace") {
        println!("\n| s | Link0 | Link1 | gripper speed, m/s | Z1 | Z2 | Z3 | ZTRIG1 | ZR270073 | ZR270072 |\n|---|");
        for i in (49..bench.published(GRIPPER_SPEED_TOPIC).len()).step_by(50) {
            print!("{:5.1}", bench.published(GRIPPER_SPEED_TOPIC)[i].time.seconds());
            for link in [0, 1] {
                print!(" {:6.2}", real(&bench.published(&target_topic("R3200ProductMove", link))[i]));
            }
            print!(" {:5.2}", real(&bench.published(GRIPPER_SPEED_TOPIC)[i]));
            for zone in ["Z1", "Z2", "Z3", "ZTRIG1", "ZR270073", "ZR270072"] {
                print!(" {:6.0}", level(&bench.published(&zone_topic(zone))[i]));
            }
            println!();
        }
    }
    let begun = std::time::Instant::now();
    let n_runs = 20;
    for _ in 0..n_runs {
        std::hint::black_box(run::<Cell>(0, &[]));
    }
    println!("\none run of 70 s: {:.1} ms", begun.elapsed().as_secs_f64() * 1000.0 / f64::from(n_runs));
}

/// When something holds, as a list of spans of time.
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
