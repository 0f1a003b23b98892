//! Step sequences: how a PLC moves an axis group from station to station and keeps it in step with the others.

use sesame_runtime::time::SimTime;

/// One step of a sequence for a group of `N` axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step<const N: usize> {
    /// Moves the set points to a station in this time, all axes together, starting and ending smoothly.
    Move {
        /// The set points to end at.
        to: [f64; N],
        /// How long it takes.
        seconds: f64,
    },
    /// Waits until every measured axis is within the tolerance of its set point; at most [`IN_POSITION_MONITORING`].
    Arrive,
    /// Waits without limit until every measured axis is within the tolerance: the end switch that must be made before
    /// other sequences may continue.
    AwaitSwitch,
    /// Waits for this time.
    Hold {
        /// How long.
        seconds: f64,
    },
    /// Tells the other sequences that something is done.
    Raise(Signal),
    /// Waits until another sequence has raised the signal.
    Await(Signal),
}

/// The signals that sequences exchange. Each is raised at most once in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// The infeed holds an assembled gearbox at the pick station.
    GearboxAtPick,
    /// The R3200 has lifted the gearbox clear of the infeed.
    GearboxLifted,
    /// The infeed's empty carrier is back between the assembly arms.
    CarrierAtAssembly,
    /// The R270073 has put a housing down and is clear of it.
    HousingPlaced,
    /// The R3200 has put the gearbox down at the workers' station and is clear of it.
    GearboxPlaced,
}

/// The signals raised so far in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Signals(u8);

impl Signals {
    /// Raises a signal.
    pub fn raise(&mut self, signal: Signal) {
        self.0 |= 1 << signal as u8;
    }

    /// Whether a signal has been raised.
    pub fn is_raised(self, signal: Signal) -> bool {
        self.0 & (1 << signal as u8) != 0
    }
}

/// How far a measured axis may be from its set point and still count as arrived: rad for joints, m for conveyors.
pub const IN_POSITION_TOLERANCE: f64 = 0.03;

/// How long a PLC waits for an arm to arrive. Then the PLC continues, because the fixtures of the cell centre parts
/// that arrive slightly off: an arm that is off costs the cycle this time at each station but does not stop the line.
pub const IN_POSITION_MONITORING: SimTime = SimTime::from_nanos(1_500_000_000);

/// A sequence in progress.
#[derive(Debug, Clone)]
pub struct Sequence<const N: usize> {
    steps: Vec<Step<N>>,
    current: usize,
    begun: SimTime,
    from: [f64; N],
    set_points: [f64; N],
}

impl<const N: usize> Sequence<N> {
    /// A sequence that has not begun; its axes stand at the station where it also ends.
    pub fn new(steps: Vec<Step<N>>, home: [f64; N]) -> Self {
        Sequence { steps, current: 0, begun: SimTime::ZERO, from: home, set_points: home }
    }

    /// Begins again from the first step.
    pub fn restart(&mut self, now: SimTime) {
        self.current = 0;
        self.begun = now;
        self.from = self.set_points;
    }

    /// Lets this much time not count: the set points stay as they are.
    pub fn pause(&mut self, time: SimTime) {
        self.begun = self.begun + time;
    }

    /// Whether all steps are done.
    pub fn is_done(&self) -> bool {
        self.current == self.steps.len()
    }

    /// The present set points.
    pub fn set_points(&self) -> &[f64; N] {
        &self.set_points
    }

    /// Advances to `now`: completes the steps that are due, and updates the set points of the current one.
    pub fn advance(&mut self, now: SimTime, measured: &[f64; N], signals: &mut Signals) {
        while let Some(&step) = self.steps.get(self.current) {
            let elapsed = now - self.begun;
            let done = match step {
                Step::Move { to, seconds } => {
                    let share = smooth(elapsed.seconds() / seconds);
                    self.set_points = std::array::from_fn(|i| self.from[i] + (to[i] - self.from[i]) * share);
                    elapsed.seconds() >= seconds
                }
                Step::Arrive => self.has_arrived(measured) || elapsed >= IN_POSITION_MONITORING,
                Step::AwaitSwitch => self.has_arrived(measured),
                Step::Hold { seconds } => elapsed.seconds() >= seconds,
                Step::Raise(signal) => {
                    signals.raise(signal);
                    true
                }
                Step::Await(signal) => signals.is_raised(signal),
            };
            if !done {
                return;
            }
            self.current += 1;
            self.begun = now;
            self.from = self.set_points;
        }
    }

    fn has_arrived(&self, measured: &[f64; N]) -> bool {
        // A measured value of NaN is never within the tolerance.
        self.set_points.iter().zip(measured).all(|(wanted, is)| (wanted - is).abs() <= IN_POSITION_TOLERANCE)
    }
}

/// The minimum-jerk course from 0 to 1 over the unit interval: speed and acceleration are zero at both ends. Its
/// highest speed is 1.875 and its highest acceleration 5.77.
fn smooth(share: f64) -> f64 {
    let u = share.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> SimTime {
        SimTime::from_seconds(seconds)
    }

    fn sequence(steps: Vec<Step<1>>) -> (Sequence<1>, Signals) {
        (Sequence::new(steps, [0.0]), Signals::default())
    }

    #[test]
    fn a_move_starts_and_ends_smoothly_and_passes_its_middle_at_half_time() {
        let (mut sequence, mut signals) = sequence(vec![Step::Move { to: [2.0], seconds: 4.0 }]);
        let mut set_point = |seconds| {
            sequence.advance(at(seconds), &[0.0], &mut signals);
            sequence.set_points()[0]
        };
        assert!(set_point(0.04) < 1e-4);
        assert_eq!(set_point(2.0), 1.0);
        assert!(set_point(3.96) > 2.0 - 1e-4);
        assert_eq!(set_point(4.0), 2.0);
        assert!(sequence.is_done());
    }

    #[test]
    fn arriving_waits_for_the_measured_axis() {
        let (mut sequence, mut signals) = sequence(vec![Step::Arrive]);
        sequence.advance(at(0.5), &[0.28], &mut signals);
        assert!(!sequence.is_done());
        sequence.advance(at(0.6), &[0.02], &mut signals);
        assert!(sequence.is_done());
    }

    #[test]
    fn an_axis_that_never_arrives_costs_the_monitoring_time() {
        for off in [0.28, f64::NAN] {
            let (mut sequence, mut signals) = sequence(vec![Step::Arrive]);
            sequence.advance(at(1.48), &[off], &mut signals);
            assert!(!sequence.is_done());
            sequence.advance(at(1.50), &[off], &mut signals);
            assert!(sequence.is_done());
        }
    }

    #[test]
    fn an_end_switch_is_waited_for_without_limit() {
        let (mut sequence, mut signals) = sequence(vec![Step::AwaitSwitch]);
        sequence.advance(at(1000.0), &[0.28], &mut signals);
        assert!(!sequence.is_done());
        sequence.advance(at(1000.02), &[0.02], &mut signals);
        assert!(sequence.is_done());
    }

    #[test]
    fn signals_hold_one_sequence_until_another_is_ready() {
        let (mut waiting, mut signals) =
            sequence(vec![Step::Await(Signal::GearboxAtPick), Step::Hold { seconds: 1.0 }]);
        let (mut telling, _) = sequence(vec![Step::Hold { seconds: 2.0 }, Step::Raise(Signal::GearboxAtPick)]);
        for step in 1..=150 {
            let now = at(f64::from(step) * 0.02);
            waiting.advance(now, &[0.0], &mut signals);
            telling.advance(now, &[0.0], &mut signals);
        }
        assert!(telling.is_done() && !waiting.is_done(), "2 s, one PLC cycle to notice, and 1 s more");
        waiting.advance(at(3.02), &[0.0], &mut signals);
        assert!(waiting.is_done());
    }
}
