//! Whether an interlock stands for the violation that it prevents.
//!
//! In the lab an interlock stops the test before the robot is where it must not be, so metrics that count violations
//! cannot be compared with simulation, only whether there is one. That comparison is sound if the interlock trips in
//! exactly the tests in which the forbidden zone would have been entered, and early enough [SESAME 2023, Section 4.3].
//! It is checked on motions that were recorded without the interlock, in simulation, where nothing is damaged.

use crate::body::Body;
use crate::contact::{ContactError, contacts};

/// What happened in one motion, in seconds; `None` for what did not happen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// When the interlock trips first.
    pub trip: Option<f64>,
    /// When the forbidden zone is entered first.
    pub entry: Option<f64>,
}

/// How a trip and an entry are to each other. A lead is the time from the trip to the entry, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Judgement {
    /// Neither happened.
    Nothing,
    /// The interlock trips early enough.
    Prevented {
        /// At least the lead that is required.
        lead: f64,
    },
    /// It trips, but too late: less than the required lead before the entry, or after it.
    Late {
        /// Negative after the entry.
        lead: f64,
    },
    /// The interlock trips, and the zone is not entered: in the lab this looks like a violation.
    FalseAlarm,
    /// The zone is entered, and the interlock does not trip: nothing would have stopped the robot.
    Missed,
}

impl Judgement {
    /// Whether both happened or neither.
    pub fn same_presence(self) -> bool {
        !matches!(self, Judgement::FalseAlarm | Judgement::Missed)
    }

    /// Whether the interlock prevented all that had to be prevented.
    pub fn safe(self) -> bool {
        !matches!(self, Judgement::Late { .. } | Judgement::Missed)
    }
}

/// Judges one motion. An interlock with a threshold on a signal instead of a zone has its trip where the signal crosses
/// the threshold. With a required lead of 0 s it may trip exactly when the zone is entered; a lead of NaN is never
/// enough.
pub fn judge(response: Response, required_lead: f64) -> Judgement {
    match (response.trip, response.entry) {
        (None, None) => Judgement::Nothing,
        (Some(_), None) => Judgement::FalseAlarm,
        (None, Some(_)) => Judgement::Missed,
        (Some(trip), Some(entry)) => {
            let lead = entry - trip;
            if lead >= required_lead { Judgement::Prevented { lead } } else { Judgement::Late { lead } }
        }
    }
}

/// When a moving body enters the zone of an interlock and a forbidden zone; see [`contacts`] for the tolerance. Zones
/// may move too.
pub fn response(body: &Body, interlock: &Body, forbidden: &Body, tolerance: f64) -> Result<Response, ContactError> {
    Ok(Response {
        trip: contacts(body, interlock, tolerance)?.first(),
        entry: contacts(body, forbidden, tolerance)?.first(),
    })
}

/// The interlock in many motions, each with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Equivalence {
    /// All motions, in the order given.
    pub motions: Vec<Motion>,
    /// What was required, in seconds.
    pub required_lead: f64,
}

/// One of the motions.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Its name, for example that of its test.
    pub name: String,
    /// What happened.
    pub response: Response,
    /// What that means.
    pub judgement: Judgement,
}

impl Equivalence {
    /// Judges all motions.
    pub fn of(responses: impl IntoIterator<Item = (String, Response)>, required_lead: f64) -> Equivalence {
        let motion = |(name, response)| Motion { name, response, judgement: judge(response, required_lead) };
        Equivalence { motions: responses.into_iter().map(motion).collect(), required_lead }
    }

    /// Whether in all motions the interlock trips if and only if the zone is entered. Without any motion this says
    /// nothing, so it is false.
    pub fn equivalent(&self) -> bool {
        !self.motions.is_empty() && self.differing().next().is_none()
    }

    /// Whether the interlock trips early enough in all motions in which the zone is entered. Without any motion this
    /// says nothing, so it is false.
    pub fn safe(&self) -> bool {
        !self.motions.is_empty() && self.motions.iter().all(|motion| motion.judgement.safe())
    }

    /// The motions in which only one of both happened.
    pub fn differing(&self) -> impl Iterator<Item = &Motion> {
        self.motions.iter().filter(|motion| !motion.judgement.same_presence())
    }

    /// The motions in which the zone is entered before the interlock could stop the robot.
    pub fn unsafe_motions(&self) -> impl Iterator<Item = &Motion> {
        self.motions.iter().filter(|motion| !motion.judgement.safe())
    }

    /// The shortest time between trip and entry, in seconds; `None` if they never both happened.
    pub fn shortest_lead(&self) -> Option<f64> {
        let leads = self.motions.iter().filter_map(|motion| match motion.judgement {
            Judgement::Prevented { lead } | Judgement::Late { lead } => Some(lead),
            Judgement::Nothing | Judgement::FalseAlarm | Judgement::Missed => None,
        });
        leads.min_by(f64::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use parry3d_f64::math::Vector;
    use proptest::prelude::*;

    use super::*;
    use crate::body::Shape;
    use crate::contact::TOLERANCE;
    use crate::trace::Trace;

    fn zone(expand: f64) -> Body {
        let cuboid = Shape::cuboid([2.0; 3]).unwrap();
        Body::fixed_at(cuboid, Vector::ZERO).unwrap().expanded(expand).unwrap()
    }

    fn flying(points: &[[f64; 3]]) -> Body {
        let times = (0..points.len()).map(|second| second as f64).collect();
        let positions = points.iter().map(|&point| Vector::from_array(point)).collect();
        Body::moving(Shape::sphere(0.5).unwrap(), Trace::new(times, positions, None).unwrap()).unwrap()
    }

    fn through() -> Body {
        flying(&[[-6.5, 0.0, 0.0], [-1.5, 0.0, 0.0], [3.5, 0.0, 0.0]])
    }

    fn responded(body: &Body, expand: f64) -> Response {
        response(body, &zone(expand), &zone(0.0), TOLERANCE).unwrap()
    }

    #[test]
    fn a_wider_zone_trips_before_the_forbidden_one_is_entered() {
        // At 5 m/s, a metre is 0.2 s.
        let found = responded(&through(), 1.0);
        let Judgement::Prevented { lead } = judge(found, 0.19) else { panic!("{found:?}") };
        assert!((lead - 0.2).abs() < 1e-5);
        let Judgement::Late { lead } = judge(found, 0.3) else { panic!("{found:?}") };
        assert!((lead - 0.2).abs() < 1e-5);
    }

    #[test]
    fn the_same_zone_trips_exactly_at_the_entry() {
        assert_eq!(judge(responded(&through(), 0.0), 0.0), Judgement::Prevented { lead: 0.0 });
    }

    #[test]
    fn motions_in_which_presence_differs_are_reported() {
        let beside = flying(&[[-5.0, 2.0, 0.0], [5.0, 2.0, 0.0]]);
        let far = flying(&[[-5.0, 9.0, 0.0], [5.0, 9.0, 0.0]]);
        let motions = [("T1", through()), ("T2", beside), ("T3", far)];
        let responses = motions.map(|(name, body)| (name.to_owned(), responded(&body, 1.0)));
        let found = Equivalence::of(responses, 0.1);
        assert!(!found.equivalent());
        assert!(found.safe());
        assert_eq!(found.differing().map(|motion| motion.name.as_str()).collect::<Vec<_>>(), ["T2"]);
        assert_eq!(found.motions[1].judgement, Judgement::FalseAlarm);
        assert_eq!(found.motions[2].judgement, Judgement::Nothing);
    }

    #[test]
    fn an_interlock_elsewhere_misses_the_entry() {
        let elsewhere = Body::fixed_at(Shape::sphere(1.0).unwrap(), Vector::new(0.0, 20.0, 0.0)).unwrap();
        let found = response(&through(), &elsewhere, &zone(0.0), TOLERANCE).unwrap();
        let found = Equivalence::of([("T1".to_owned(), found)], 0.0);
        assert_eq!(found.motions[0].judgement, Judgement::Missed);
        assert!(!found.equivalent() && !found.safe());
        assert_eq!(found.unsafe_motions().count(), 1);
        assert_eq!(found.shortest_lead(), None);
    }

    #[test]
    fn no_motion_proves_nothing() {
        let none = Equivalence::of([], 0.0);
        assert!(!none.equivalent() && !none.safe());
    }

    proptest! {
        #[test]
        fn a_wider_zone_never_misses_and_never_trips_later(
            points in prop::collection::vec([-4.0..4.0f64, -4.0..4.0f64, -4.0..4.0f64], 2..6),
            narrow in 1e-3..1.0f64, more in 1e-3..1.0f64,
        ) {
            let body = flying(&points);
            let judgement = judge(responded(&body, narrow), 0.0);
            prop_assert!(judgement.safe(), "{judgement:?}");
            let wider = responded(&body, narrow + more);
            if let Some(trip) = responded(&body, narrow).trip {
                prop_assert!(wider.trip.is_some_and(|wide| wide <= trip));
            }
        }
    }
}
