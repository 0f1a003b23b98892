//! A requirement that is violated only in a hundredth of its domain, and after how many evaluations that is found.

use sesame_optimise::falsify::{Falsifier, Margin, Settings, UnitBox};

/// By how much the requirement is kept.
fn margin(point: &[f64]) -> f64 {
    let distance: f64 = point.iter().map(|x| (x - 0.8) * (x - 0.8)).sum();
    distance - 0.003
}

fn main() {
    let settings = Settings { requirements: 1, evaluations: 100, batch: 1, seed: 1 };
    let mut search = Falsifier::new(UnitBox::new(2, 1), settings);
    let mut evaluations = 0;
    loop {
        let asked = search.ask();
        if asked.is_empty() {
            println!("no violation in {evaluations} evaluations");
            return;
        }
        let mut told = Vec::new();
        for point in asked {
            evaluations += 1;
            let value = margin(&point);
            if value < 0.0 {
                println!("violated after {evaluations} evaluations, at {point:.3?}");
                return;
            }
            told.push((point, vec![Margin { value: Some(value), violated: false }]));
        }
        search.tell(told);
    }
}
