//! Reasons compared with all subsets of evidence.

use proptest::prelude::*;
use sesame_monitor::gate::Leaf;
use sesame_monitor::why::{Depth, Moment, Why, certificate, sentence, text, why, why_state};
use sesame_monitor::{EvidenceId, Network, Truth};
use sesame_plan::{Demand, Gate, Monitor, MonitorId};

use crate::random;

/// The value of a guarantee, from the values of all evidence, in the order of the network, and of the demands of one
/// monitor if they are given.
fn value(
    network: &Network,
    monitors: &[Monitor],
    id: MonitorId,
    guarantee: u32,
    evidence: &[Truth],
    given: Option<&[Truth]>,
) -> Truth {
    fn gate(of: &Gate, leaf: &dyn Fn(&Gate) -> Truth) -> Truth {
        let all = |of: &[Gate]| of.iter().map(|part| gate(part, leaf)).collect::<Vec<Truth>>();
        match of {
            Gate::Evidence(_) | Gate::Demand(_) => leaf(of),
            Gate::All(of) => all(of).into_iter().min().unwrap(),
            Gate::Any(of) => all(of).into_iter().max().unwrap(),
            Gate::AtLeast { count, of } => {
                let mut values = all(of);
                values.sort();
                values[values.len() - *count as usize]
            }
        }
    }
    let monitor = &monitors[id.index()];
    gate(&monitor.guarantees[guarantee as usize].gate, &|leaf| match leaf {
        Gate::Evidence(at) => evidence[network.evidence(id, *at).index()],
        Gate::Demand(at) => {
            let of_guarantee = || {
                let Demand { monitor, guarantee, .. } = monitor.demands[*at as usize];
                (0..=guarantee).map(|at| value(network, monitors, monitor, at, evidence, None)).max().unwrap()
            };
            given.map_or_else(of_guarantee, |given| given[*at as usize])
        }
        _ => unreachable!(),
    })
}

/// Whether these leaves of those of one guarantee force its value: evidence first, then demands if they count as
/// leaves.
struct Question<'a> {
    network: &'a Network,
    monitors: &'a [Monitor],
    monitor: MonitorId,
    guarantee: u32,
    leaves: Vec<Truth>,
    depth: Depth,
}

impl Question<'_> {
    fn value(&self, leaves: &[Truth]) -> Truth {
        let (evidence, demands) = leaves.split_at(self.network.evidence_count());
        let given = (self.depth == Depth::Own).then_some(demands);
        value(self.network, self.monitors, self.monitor, self.guarantee, evidence, given)
    }

    /// Whether the leaves in the set force the value, whatever the others are.
    fn forces(&self, set: u32, truth: Truth) -> bool {
        // Two demands of one guarantee are the same.
        let first = |at: usize| match at.checked_sub(self.network.evidence_count()) {
            None => at,
            Some(demand) => {
                let demands = &self.monitors[self.monitor.index()].demands;
                let same = |other: &Demand| {
                    (other.monitor, other.guarantee) == (demands[demand].monitor, demands[demand].guarantee)
                };
                self.network.evidence_count() + demands.iter().position(same).unwrap()
            }
        };
        let with = |other| {
            let leaf = |(at, &leaf): (usize, &Truth)| if set >> first(at) & 1 == 1 { leaf } else { other };
            self.value(&self.leaves.iter().enumerate().map(leaf).collect::<Vec<_>>())
        };
        match truth {
            Truth::True => with(Truth::False) == Truth::True,
            Truth::False => with(Truth::True) == Truth::False,
            Truth::Unknown => with(Truth::True) != Truth::True,
        }
    }

    fn check(&self, why: &Why, moment: &Moment<'_>) {
        assert_eq!(why.truth, self.value(&self.leaves));
        assert_eq!(why.truth, moment.guarantee(self.monitor, self.guarantee));
        assert!(why.smallest);
        let set = why.because.iter().map(|cause| {
            let at = match cause.leaf {
                Leaf::Evidence(at) => self.network.evidence(cause.monitor, at).index(),
                Leaf::Demand(at) => self.network.evidence_count() + at as usize,
            };
            assert_eq!(cause.truth, self.leaves[at]);
            self.check_way(&cause.through, cause.monitor);
            1 << at
        });
        let set: u32 = set.sum();
        assert!(self.forces(set, why.truth), "{why:?}");
        if why.truth == Truth::Unknown {
            assert!(why.because.iter().any(|cause| cause.truth == Truth::Unknown));
        }
        for smaller in (0..1_u32 << self.leaves.len()).filter(|other| other.count_ones() < set.count_ones()) {
            assert!(!self.forces(smaller, why.truth), "{why:?}, {smaller:b}");
        }
    }

    fn check_way(&self, through: &[(MonitorId, u32)], to: MonitorId) {
        let mut at = self.monitor;
        for &(monitor, demand) in through {
            assert_eq!(monitor, at);
            at = self.monitors[monitor.index()].demands[demand as usize].monitor;
        }
        assert_eq!(at, to);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn reasons_are_the_smallest_sets_that_force_a_value(
        monitors in random::any_monitors().prop_filter("few leaves", |monitors| {
            monitors.iter().map(|monitor| monitor.evidence.len()).sum::<usize>() <= 9
        }),
        truths in prop::collection::vec(random::any_truth(), 16),
    ) {
        let network = Network::new(&monitors).unwrap();
        let moment = Moment::new(&network, |evidence| truths[evidence.index()]);
        for (monitor, declared) in (0..).map(MonitorId).zip(&monitors) {
            for guarantee in 0..network.guarantees(monitor) {
                for depth in [Depth::Evidence, Depth::Own] {
                    let mut leaves = truths[..network.evidence_count()].to_vec();
                    if depth == Depth::Own {
                        leaves.extend((0..declared.demands.len() as u32).map(|at| moment.demand(monitor, at)));
                    }
                    let (network, monitors) = (&network, &monitors[..]);
                    let question = Question { network, monitors, monitor, guarantee, leaves, depth };
                    question.check(&why(&moment, monitor, guarantee, depth), &moment);
                }
            }
        }
    }

    #[test]
    fn gates_with_much_sharing_are_explained_exactly(
        raw_gates in prop::collection::vec(random::any_raw_gate(), 3..=5),
        truths in prop::collection::vec(random::any_truth(), 8),
    ) {
        let evidence = random::plain(8);
        let gates = raw_gates.iter().map(|raw| random::gate(raw, 8, 0)).collect();
        let monitors = [random::monitor(evidence, vec![Gate::AtLeast { count: 2, of: gates }])];
        let network = Network::new(&monitors).unwrap();
        let moment = Moment::new(&network, |evidence| truths[evidence.index()]);
        let reason = why(&moment, MonitorId(0), 0, Depth::Evidence);
        let (network, monitors, leaves) = (&network, &monitors[..], truths.clone());
        let question = Question { network, monitors, monitor: MonitorId(0), guarantee: 0, leaves, depth: Depth::Evidence };
        question.check(&reason, &moment);
    }
}

/// The example of the language's documentation.
fn transport() -> Vec<Monitor> {
    let mut transport = random::monitor(
        random::plain(2),
        vec![
            Gate::All(vec![Gate::Evidence(0), Gate::Evidence(1), Gate::Demand(0)]),
            Gate::All(vec![Gate::Evidence(0), Gate::Any(vec![Gate::Evidence(1), Gate::Demand(0)])]),
        ],
    );
    transport.name = "transport".into();
    transport.otherwise.name = "cannot_transport".into();
    for (evidence, name) in transport.evidence.iter_mut().zip(["brakes_ok", "perception_ok"]) {
        evidence.name = name.into();
    }
    for (guarantee, name) in transport.guarantees.iter_mut().zip(["fast", "slowly"]) {
        guarantee.name = name.into();
    }
    transport.demands = vec![Demand { name: "stops".into(), monitor: MonitorId(1), guarantee: 0 }];
    let mut conveyor = random::monitor(random::plain(1), vec![Gate::Evidence(0)]);
    conveyor.name = "conveyor".into();
    conveyor.evidence[0].name = "still".into();
    conveyor.guarantees[0].name = "stops".into();
    vec![transport, conveyor]
}

#[test]
fn a_state_is_explained_by_what_holds_and_what_does_not() {
    let monitors = transport();
    let network = Network::new(&monitors).unwrap();
    let truths = [Truth::True, Truth::True, Truth::Unknown];
    let moment = Moment::new(&network, |EvidenceId(at)| truths[at as usize]);
    let sentences = |depth| {
        let reasons = why_state(&moment, MonitorId(0), depth);
        reasons.iter().map(|reason| sentence(reason, &monitors)).collect::<Vec<_>>()
    };
    assert_eq!(
        sentences(Depth::Evidence),
        [
            "`fast` is not known to hold because `still` of `conveyor` is unknown",
            "`slowly` holds because `brakes_ok` is true and `perception_ok` is true",
        ]
    );
    assert_eq!(sentences(Depth::Own)[0], "`fast` is not known to hold because `stops` is unknown");
    assert_eq!(why(&moment, MonitorId(0), 0, Depth::Evidence).because[0].through, [(MonitorId(0), 0)]);
}

#[test]
fn a_certificate_is_shown_as_a_tree() {
    let monitors = transport();
    let network = Network::new(&monitors).unwrap();
    let truths = [Truth::True, Truth::False, Truth::Unknown];
    let moment = Moment::new(&network, |EvidenceId(at)| truths[at as usize]);
    let tree = certificate(&moment, &monitors, MonitorId(0));
    assert_eq!(
        text(&tree, &monitors),
        "\
transport: cannot_transport
  fast (integrity 4): false
    and: false
      brakes_ok: true
      perception_ok: false
      stops from conveyor: unknown
  slowly (integrity 2): unknown
    and: unknown
      brakes_ok: true
      or: unknown
        perception_ok: false
        stops from conveyor: unknown
"
    );
}
