//! A case with monitors of its topics.

use sesame_plan::testing;
use sesame_plan::{RequirementId, Side, TopicId};
use sesame_rng::Stream;

use super::Case;
use super::maker::{Maker, Watching};
use crate::robot::Carries;

impl Case {
    /// The same case with monitors, all evidence of which hears one side, in half of the cases one wire each; and with
    /// their scores, for one requirement if there is any.
    pub(crate) fn with_monitors(&self) -> Case {
        let stream = Stream::derive(self.number, "monitors", &[]);
        let mut maker = Maker { stream, carries: self.carries.clone(), topics: self.plan.topics.clone() };
        let side = if maker.chance(0.7) { Side::Outbound } else { Side::Inbound };
        let first = self.plan.topics.len();
        let states: Vec<TopicId> = (first..first + 2).map(|at| TopicId(u32::try_from(at).unwrap())).collect();
        let one_wire = maker.chance(0.5);
        let monitors = maker.monitors(&states, Watching { side: Some(side), one_wire, mitigated: None });
        let mut case = self.clone();
        for at in 0..monitors.len() {
            let path = format!("state/{at}");
            case.plan.topics.push(testing::topic(&format!("state{at}"), &[&path], Maker::state_type(at)));
            case.carries.push(if at.is_multiple_of(2) { Carries::Bool } else { Carries::Int });
        }
        let requirements = self.plan.requirements.len();
        for at in 0..u32::try_from(monitors.len()).unwrap() {
            let requirement =
                (requirements > 0).then(|| RequirementId(u32::try_from(maker.stream.below(requirements)).unwrap()));
            case.plan.metrics.extend(maker.scores(at, requirement));
        }
        case.plan.monitors = monitors;
        case
    }
}
