//! Which requirement the next test targets: a bandit over requirements.
//!
//! The reward of a test is the share of its target's lowest margin that it removed, in any unit:
//! 0.75 for lowering it from 20 to 5, 1 for the first violation, 0 for no progress. The bandit chooses by the mean
//! reward of the latest tests of each requirement, with a bonus for those that were seldom chosen: UCB1 [Auer et al.
//! 2002] over a sliding window.

use super::Margin;

/// How many of the latest rewards of a requirement count.
const WINDOW: usize = 6;
/// Weight of the bonus for requirements that were seldom chosen.
const EXPLORATION: f64 = 0.25;

/// The rewards of each requirement so far.
#[derive(Debug, Clone)]
pub(super) struct Bandit {
    arms: Vec<Arm>,
}

#[derive(Debug, Clone, Default)]
struct Arm {
    /// The lowest margin seen.
    lowest: Option<f64>,
    violated: bool,
    /// Tests that targeted it.
    pulls: u32,
    /// The rewards of the latest of them.
    rewards: Vec<f64>,
}

impl Bandit {
    /// A bandit over this many requirements, at least one.
    pub(super) fn new(requirements: usize) -> Self {
        Bandit { arms: vec![Arm::default(); requirements] }
    }

    /// The requirement that the next test targets: one that is not violated yet, as long as there is one; of equally
    /// good ones, the first. `pending` has the number of tests per requirement that are asked for and not told yet.
    pub(super) fn choose(&self, pending: &[u32]) -> usize {
        let open = self.arms.iter().any(|arm| !arm.violated);
        let pulls = |at: usize| self.arms[at].pulls + pending[at];
        let total: u32 = (0..self.arms.len()).map(pulls).sum();
        let mut best: Option<(usize, f64)> = None;
        for (at, arm) in self.arms.iter().enumerate() {
            if arm.violated && open {
                continue;
            }
            let reward =
                if arm.rewards.is_empty() { 1.0 } else { arm.rewards.iter().sum::<f64>() / arm.rewards.len() as f64 };
            let pulls = f64::from(pulls(at)) + 1.0;
            let index = reward + EXPLORATION * libm::sqrt(libm::log(f64::from(total) + 1.0) / pulls);
            if best.is_none_or(|(_, most)| index > most) {
                best = Some((at, index));
            }
        }
        best.expect("there is a requirement").0
    }

    /// Takes the margins of a test, and the requirement that it targeted, if any.
    pub(super) fn update(&mut self, margins: &[Margin], target: Option<usize>) {
        for (at, (arm, &margin)) in self.arms.iter_mut().zip(margins).enumerate() {
            let reward = arm.reward(margin);
            if target == Some(at) {
                arm.pulls += 1;
                arm.rewards.push(reward);
                if arm.rewards.len() > WINDOW {
                    arm.rewards.remove(0);
                }
            }
        }
    }

    /// How many tests targeted a requirement.
    pub(super) fn pulls(&self, requirement: usize) -> u32 {
        self.arms[requirement].pulls
    }
}

impl Arm {
    /// Takes a margin; its reward.
    fn reward(&mut self, margin: Margin) -> f64 {
        let Some(value) = margin.value else { return 0.0 };
        let first = margin.violated && !self.violated;
        self.violated |= margin.violated;
        let before = self.lowest;
        if before.is_none_or(|lowest| value < lowest) {
            self.lowest = Some(value);
        }
        match before {
            _ if first => 1.0,
            Some(lowest) if value < lowest && lowest > 0.0 => ((lowest - value) / lowest).min(1.0),
            // A violated requirement has no margin left to remove, so any progress has the same reward.
            Some(lowest) if value < lowest => 0.5,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn margins(values: [f64; 3]) -> Vec<Margin> {
        values.map(|value| Margin { value: Some(value), violated: value <= 0.0 }).to_vec()
    }

    /// How often each requirement is chosen if these are their margins after so many tests that targeted them.
    fn pulls(margin: impl Fn(usize, u32) -> f64, tests: u32) -> [u32; 3] {
        let mut bandit = Bandit::new(3);
        let mut pulls = [0; 3];
        bandit.update(&margins([0, 1, 2].map(|at| margin(at, 0))), None);
        for _ in 0..tests {
            let choice = bandit.choose(&[0; 3]);
            pulls[choice] += 1;
            bandit.update(&margins([0, 1, 2].map(|at| margin(at, pulls[at]))), Some(choice));
        }
        assert_eq!(pulls, [0, 1, 2].map(|at| bandit.pulls(at)));
        pulls
    }

    #[test]
    fn most_tests_target_the_requirement_whose_margin_shrinks_and_some_the_others() {
        let [stuck, nearer, far] = pulls(
            |at, tests| match at {
                0 => 5.0,
                1 => 1e6 * libm::pow(0.8, f64::from(tests)),
                _ => 1e9,
            },
            40,
        );
        assert!(nearer > 20 && stuck >= 2 && far >= 2, "{stuck}, {nearer} and {far}");
    }

    #[test]
    fn a_violated_requirement_is_not_targeted_until_all_are_violated() {
        let [first, second, third] =
            pulls(|at, tests| if tests >= [2, 4, 6][at] { -1.0 } else { 10.0 - f64::from(tests) }, 12);
        assert_eq!([first, second, third], [2, 4, 6]);
        let [first, second, third] = pulls(|at, tests| if tests >= [2, 4, 6][at] { -1.0 } else { 10.0 }, 40);
        assert!(first > 2 && second > 4 && third > 6, "then all are targeted again");
    }

    #[test]
    fn an_inconclusive_run_has_no_reward() {
        let mut bandit = Bandit::new(1);
        bandit.update(&[Margin { value: None, violated: false }], Some(0));
        bandit.update(&[Margin { value: Some(4.0), violated: false }], Some(0));
        bandit.update(&[Margin { value: Some(1.0), violated: false }], Some(0));
        bandit.update(&[Margin { value: Some(3.0), violated: false }], Some(0));
        assert_eq!(bandit.arms[0].rewards, [0.0, 0.0, 0.75, 0.0]);
        assert_eq!(bandit.arms[0].lowest, Some(1.0));
    }
}
