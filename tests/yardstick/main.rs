//! A fixed amount of work, so that what the suite takes can be compared between machines.
//!
//! It does what tests do most, unoptimised as they are: it makes texts and reads them, keeps them in maps, and computes
//! with real numbers. `./test --long` says how many times as long as this the suite takes, and compares that with the
//! figure in `tests/processor_time`. It never changes: with other work that figure would mean nothing.

use std::collections::BTreeMap;

/// How often the work is done.
const TIMES: u32 = 200;

fn main() {
    let mut sum = 0.0;
    for time in 0..TIMES {
        let mut words: BTreeMap<String, f64> = BTreeMap::new();
        let mut state = u64::from(time) + 1;
        for number in 0..8_000_u32 {
            // Marsaglia's xorshift: any sequence would do, but it has to be the same everywhere.
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let word = format!("{:x}/{}", state % 4_096, number % 7);
            let value = f64::from(number).sqrt() * 0.5 + words.get(&word).copied().unwrap_or(1.0);
            words.insert(word, value);
        }
        let lines: Vec<String> = words.iter().map(|(word, value)| format!("{word} {value:.3}")).collect();
        for line in lines.join("\n").lines() {
            let value: f64 = line.split_once(' ').and_then(|(_, value)| value.parse().ok()).expect("it was written so");
            sum += value;
        }
    }
    std::hint::black_box(sum);
}
