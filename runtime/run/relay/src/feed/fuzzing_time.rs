//! The fuzzing time at each moment of a recorded run, from what its operations did.

use sesame_base::time::SimTime;
use sesame_base::verdict::ends;
use sesame_plan::{Bound, CampaignPlan, MetricSource, Span};

use crate::relay::{beyond, reaching};

/// The bounds of all requirements on the fuzzing time whose hazards are scored.
pub(super) fn scored_bounds(plan: &CampaignPlan) -> Vec<Bound> {
    let of_metric = |metric: &MetricSource| match metric {
        MetricSource::Monitor { score, .. } => score.requirement().map(|id| plan.requirement(id)),
        _ => None,
    };
    let scored = plan.metrics.iter().filter_map(|metric| of_metric(&metric.source));
    let on_it = scored.filter(|objective| matches!(plan.metric(objective.metric).source, MetricSource::FuzzingTime));
    on_it.map(|requirement| requirement.bound).collect()
}

/// How the fuzzing time grew in a run.
pub(super) struct FuzzingTime {
    /// From each of these moments on, in nanoseconds: the fuzzing time at it, and how much it grows per nanosecond.
    pieces: Vec<(i64, i64, i64)>,
    /// When it comes to the end of a bound, or goes beyond it; in order.
    marks: Vec<SimTime>,
}

impl FuzzingTime {
    /// From the times at which each operation was active or held messages back.
    pub(super) fn new(busy: &[Span], bounds: &[Bound]) -> Self {
        let nanos = |seconds| SimTime::from_seconds(seconds).nanos();
        let mut steps: Vec<(i64, i64)> =
            busy.iter().flat_map(|span| [(nanos(span.start), 1), (nanos(span.end), -1)]).collect();
        steps.sort_unstable();
        let mut pieces = vec![(0, 0, 0)];
        for (at, by) in steps {
            let &(from, total, pace) = pieces.last().expect("the first one is that of the start");
            if from == at {
                pieces.pop();
            }
            pieces.push((at, total + pace * (at - from), pace + by));
        }
        let mut found = FuzzingTime { pieces, marks: Vec::new() };
        for &bound in bounds {
            let (low, _, high, _) = ends(bound);
            let totals = [low, high].into_iter().flatten().flat_map(|end| [reaching(end), beyond(end)]);
            let marks: Vec<SimTime> = totals.filter_map(|total| found.when(total)).collect();
            found.marks.extend(marks);
        }
        found.marks.sort_unstable();
        found
    }

    /// How much of it has passed at this moment.
    pub(super) fn at(&self, now: SimTime) -> SimTime {
        let later = self.pieces.partition_point(|&(from, ..)| from <= now.nanos());
        let piece = self.pieces[..later].last();
        SimTime::from_nanos(piece.map_or(0, |&(from, total, pace)| total + pace * (now.nanos() - from)))
    }

    /// When it next comes to the end of a bound, or goes beyond it.
    pub(super) fn next(&self, after: SimTime) -> Option<SimTime> {
        self.marks.get(self.marks.partition_point(|&mark| mark <= after)).copied()
    }

    /// The first nanosecond at which it is at least this.
    fn when(&self, wanted: i64) -> Option<SimTime> {
        if wanted <= 0 {
            return Some(SimTime::ZERO);
        }
        let ends = self.pieces.iter().skip(1).map(|&(_, total, _)| total);
        let mut pieces = self.pieces.iter().zip(ends);
        let (&(from, total, pace), _) = pieces.find(|(_, end)| wanted <= *end)?;
        let missing = (wanted - total).max(0);
        // The least number of nanoseconds after which this many operations have added up enough.
        Some(SimTime::from_nanos(if missing == 0 { from } else { from + (missing - 1) / pace + 1 }))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_what_all_spans_add_up_to_and_marks_are_the_first_times(
            spans in prop::collection::vec((0..50_i64, 0..20_i64), 0..6),
            bound in 0..60_i64,
        ) {
            let seconds = |nanos: i64| SimTime::from_nanos(nanos).seconds();
            let span = |&(from, length): &(i64, i64)| Span { start: seconds(from), end: seconds(from + length) };
            let busy: Vec<Span> = spans.iter().map(span).collect();
            let found = FuzzingTime::new(&busy, &[Bound::AtMost { value: seconds(bound) }]);
            let total = |now: i64| spans.iter().map(|&(from, length)| (now - from).clamp(0, length)).sum::<i64>();
            for now in 0..80 {
                prop_assert_eq!(found.at(SimTime::from_nanos(now)).nanos(), total(now));
            }
            let marks: Vec<i64> = [bound, bound + 1].into_iter()
                .filter_map(|wanted| (0..80).find(|&now| total(now) >= wanted))
                .collect();
            prop_assert_eq!(found.marks.iter().map(|mark| mark.nanos()).collect::<Vec<_>>(), marks.clone());
            prop_assert_eq!(found.next(SimTime::ZERO).map(SimTime::nanos), marks.into_iter().find(|&mark| mark > 0));
        }
    }
}
