//! What a line of progress says, by how much room there is.

use std::time::Duration;

use sesame_base::visible::visible_lines;

/// Columns of the bar where there is little room, and where there is enough.
const BAR: [usize; 2] = [10, 20];

/// Between two parts of a line.
const GAP: &str = "  ";

/// After how long without a terminal it is first said that the reference run is awaited; then once a minute.
const FIRST_AWAITED: Duration = Duration::from_secs(10);
const AWAITED_EVERY: u64 = 60;

/// How far a campaign is, in the parts of a line.
#[derive(Debug, Clone, Default)]
pub(super) struct Line {
    pub(super) name: String,
    pub(super) seed: u64,
    pub(super) done: u32,
    pub(super) total: u32,
    /// How long it will still take, if that is known.
    pub(super) left: Option<Duration>,
    /// The rest, what is of most interest first.
    pub(super) details: Vec<String>,
}

impl Line {
    /// The line of so many columns at most. What counts most is kept where there is little room: first how many tests
    /// are done, then how long it will still take, a bar, the name, and details from the first on.
    pub(super) fn fit(&self, columns: usize) -> String {
        let counts = format!("{}/{}", self.done, self.total);
        let left = self.left.map(|left| format!("{} left", wait(left.as_secs_f64())));
        let seed = format!("seed {}", self.seed);
        let mut room = columns.saturating_sub(console::measure_text_width(&counts) + 1);
        let mut fits = |columns: usize| {
            let fits = columns + GAP.len() <= room;
            room -= if fits { columns + GAP.len() } else { 0 };
            fits
        };
        let mut fitting = |text: &str| fits(console::measure_text_width(text));
        let left = left.filter(|left| fitting(left));
        let bar = fitting(&" ".repeat(BAR[0]));
        let name = fitting(&self.name);
        let details: Vec<&String> = self.details.iter().take_while(|detail| fitting(detail)).collect();
        let seed = (name && details.len() == self.details.len() && fitting(&seed)).then_some(seed);
        let wide = BAR[0] + if bar { room.min(BAR[1] - BAR[0]) } else { 0 };
        let bar = bar.then(|| self.bar(wide));
        let name = name.then(|| self.name.clone());
        let parts = [name, seed, bar, Some(counts), left].into_iter().flatten();
        format!(" {}", parts.chain(details.into_iter().cloned()).collect::<Vec<_>>().join(GAP))
    }

    /// All parts, for a log.
    pub(super) fn whole(&self) -> String {
        let left = self.left.map(|left| format!("{} left", wait(left.as_secs_f64())));
        let start = format!("{} {}/{}", self.name, self.done, self.total);
        [start].into_iter().chain(left).chain(self.details.iter().cloned()).collect::<Vec<_>>().join(GAP)
    }

    fn bar(&self, columns: usize) -> String {
        let (done, total) = (u64::from(self.done.min(self.total)), u64::from(self.total.max(1)));
        let full = usize::try_from(done * columns as u64 / total).unwrap_or(columns);
        format!("{}{}", "█".repeat(full), "░".repeat(columns - full))
    }
}

/// What a terminal of so many columns shows while the first reference run is awaited.
pub(super) fn countdown(name: &str, waited: Duration, limit: Duration, columns: usize) -> String {
    let left = limit.saturating_sub(waited).as_secs();
    let short = format!(" T0 runs; stopped in {left} s");
    let long = format!(" {name}{GAP}waiting for T0, the run without disturbance; it is stopped in {left} s");
    if console::measure_text_width(&long) <= columns { long } else { short }
}

/// What a log gets while the first reference run is awaited: after ten seconds, then once a minute. `due` is when it
/// gets the next line.
pub(super) fn awaited(name: &str, waited: Duration, limit: Duration, due: &mut Duration) -> Option<String> {
    if waited < (*due).max(FIRST_AWAITED) {
        return None;
    }
    *due = Duration::from_secs((waited.as_secs() / AWAITED_EVERY + 1) * AWAITED_EVERY);
    Some(format!(
        "{name}: waiting for T0, the run without disturbance, for {} s; it is stopped after {} s (`--reference-timeout`)",
        waited.as_secs(),
        limit.as_secs_f64()
    ))
}

/// What a campaign will cost, once its reference run has ended; `None` for one of less than a minute.
pub(super) fn cost(reference: Duration, timeout: Duration, tests: u32, workers: u32) -> Option<String> {
    let workers = workers.min(tests).max(1);
    let all = reference.as_secs_f64() * f64::from(tests) / f64::from(workers);
    (all >= 60.0).then(|| {
        format!(
            "the reference run took {}: {tests} tests take about {} with {workers} {}; a test is stopped after {}",
            wait(reference.as_secs_f64()),
            wait(all),
            if workers == 1 { "worker" } else { "workers" },
            wait(timeout.as_secs_f64())
        )
    })
}

/// A warning as a line, without what would do more to a terminal than be read.
pub(super) fn warning(text: &str) -> String {
    format!("warning: {}", visible_lines(text))
}

/// A length of wall time in words.
pub(super) fn wait(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if seconds < 5400.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Line {
        Line {
            name: "by_time".to_owned(),
            seed: 7,
            done: 50,
            total: 200,
            left: Some(Duration::from_secs(150)),
            details: ["front of 12", "coverage 34 %", "least closest 5.2328", "most breaches 17"]
                .map(str::to_owned)
                .to_vec(),
        }
    }

    #[test]
    fn the_estimate_is_kept_at_every_width_and_the_rest_as_it_fits() {
        let shown = [20, 40, 60, 80, 100, 140].map(|columns| {
            let shown = line().fit(columns);
            assert!(console::measure_text_width(&shown) <= columns, "{columns}: {shown}");
            assert!(shown.contains("50/200  2 min left"), "{columns}: {shown}");
            shown
        });
        assert_eq!(
            shown,
            [
                " 50/200  2 min left",
                " by_time  ██░░░░░░░░  50/200  2 min left",
                " by_time  ████░░░░░░░░░░░░░  50/200  2 min left  front of 12",
                " by_time  █████░░░░░░░░░░░░░░░  50/200  2 min left  front of 12  coverage 34 %",
                " by_time  █████░░░░░░░░░░░░░░░  50/200  2 min left  front of 12  coverage 34 %  least closest 5.2328",
                " by_time  seed 7  █████░░░░░░░░░░░░░░░  50/200  2 min left  front of 12  coverage 34 %  least closest 5.2328  \
                 most breaches 17",
            ]
        );
    }

    #[test]
    fn lines_of_any_width_fit_and_keep_how_many_tests_are_done() {
        for columns in 0..200 {
            for total in [0, 1, 200, 4_000_000_000] {
                let shown = Line { total, ..line() }.fit(columns);
                assert!(shown.contains(&format!("50/{total}")), "{columns}: {shown}");
                let least = format!(" 50/{total}").len();
                assert!(console::measure_text_width(&shown) <= columns.max(least), "{columns}: {shown}");
            }
        }
    }

    #[test]
    fn waiting_for_the_reference_run_is_said_after_ten_seconds_and_then_each_minute() {
        let limit = Duration::from_secs(600);
        let mut due = Duration::ZERO;
        let said: Vec<u64> = (0..250)
            .filter(|&second| awaited("find", Duration::from_secs(second), limit, &mut due).is_some())
            .collect();
        assert_eq!(said, [10, 60, 120, 180, 240]);
        let line = awaited("find", Duration::from_secs(301), limit, &mut due).unwrap();
        assert_eq!(
            line,
            "find: waiting for T0, the run without disturbance, for 301 s; it is stopped after 600 s (`--reference-timeout`)"
        );
        for columns in [40, 60, 80, 100] {
            let shown = countdown("find", Duration::from_secs(12), limit, columns);
            assert!(shown.ends_with("stopped in 588 s") && shown.len() <= columns, "{shown}");
        }
        assert!(countdown("find", Duration::from_secs(700), limit, 80).ends_with("stopped in 0 s"));
    }

    #[test]
    fn what_a_campaign_costs_is_said_if_it_is_more_than_a_minute() {
        let [fast, slow, timeout] = [0.2, 43.0, 860.0].map(Duration::from_secs_f64);
        assert_eq!(cost(fast, timeout, 200, 4), None);
        let words =
            "the reference run took 43 s: 200 tests take about 36 min with 4 workers; a test is stopped after 14 min";
        assert_eq!(cost(slow, timeout, 200, 4).unwrap(), words);
        assert!(cost(slow, timeout, 2, 4).is_none_or(|words| words.contains("with 2 workers")));
    }
}
