//! Which requirement the next tests go for: a bandit over requirements.
//!
//! A test that goes for a requirement earns the share of what was left to its violation that it took away: from a least margin
//! of 20 down to 5 earns 0.75, a violation earns 1, and no progress nothing, whatever the requirement's unit. Requirements
//! are chosen by what their latest tests earned, with a bonus for those seldom gone for (UCB1 of Auer, Cesa-Bianchi and
//! Fischer 2002, over a window).

use super::Margin;

/// Earnings that count: older ones say little of what is near.
const WINDOW: usize = 6;
/// Weight of the bonus.
const CURIOSITY: f64 = 0.25;

/// What is known of each requirement.
#[derive(Debug, Clone)]
pub(super) struct Bandit {
    arms: Vec<Arm>,
}

#[derive(Debug, Clone, Default)]
struct Arm {
    /// The least margin seen.
    least: Option<f64>,
    violated: bool,
    /// Tests that went for it.
    pulls: u32,
    /// What the latest of them earned.
    earned: Vec<f64>,
}

impl Bandit {
    /// Over so many requirements, at least one.
    pub(super) fn new(requirements: usize) -> Self {
        Bandit { arms: vec![Arm::default(); requirements] }
    }

    /// The requirement to go for: of those not violated yet, as long as there are any. `coming` says per requirement how many
    /// tests are on the way already. Of equals, the first.
    pub(super) fn choice(&self, coming: &[u32]) -> usize {
        let open = self.arms.iter().any(|arm| !arm.violated);
        let pulls = |at: usize| self.arms[at].pulls + coming[at];
        let total: u32 = (0..self.arms.len()).map(pulls).sum();
        let mut best: Option<(usize, f64)> = None;
        for (at, arm) in self.arms.iter().enumerate() {
            if arm.violated && open {
                continue;
            }
            let earned =
                if arm.earned.is_empty() { 1.0 } else { arm.earned.iter().sum::<f64>() / arm.earned.len() as f64 };
            let often = f64::from(pulls(at)) + 1.0;
            let promise = earned + CURIOSITY * libm::sqrt(libm::log(f64::from(total) + 1.0) / often);
            if best.is_none_or(|(_, most)| promise > most) {
                best = Some((at, promise));
            }
        }
        best.expect("there is a requirement").0
    }

    /// Takes the margins of a test, and which requirement it went for, if any.
    pub(super) fn learn(&mut self, margins: &[Margin], went_for: Option<usize>) {
        for (at, (arm, &margin)) in self.arms.iter_mut().zip(margins).enumerate() {
            let earned = arm.take(margin);
            if went_for == Some(at) {
                arm.pulls += 1;
                arm.earned.push(earned);
                if arm.earned.len() > WINDOW {
                    arm.earned.remove(0);
                }
            }
        }
    }

    /// How many tests went for a requirement.
    pub(super) fn pulls(&self, requirement: usize) -> u32 {
        self.arms[requirement].pulls
    }
}

impl Arm {
    /// What a margin earns.
    fn take(&mut self, margin: Margin) -> f64 {
        let Some(value) = margin.value else { return 0.0 };
        let first = margin.violated && !self.violated;
        self.violated |= margin.violated;
        let before = self.least;
        if before.is_none_or(|least| value < least) {
            self.least = Some(value);
        }
        match before {
            _ if first => 1.0,
            Some(least) if value < least && least > 0.0 => ((least - value) / least).min(1.0),
            // Beyond the violation there is no end to go by: progress is that there is some.
            Some(least) if value < least => 0.5,
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

    /// How often each requirement is gone for when these are their margins after so many tests that went for them.
    fn pulls(margin: impl Fn(usize, u32) -> f64, tests: u32) -> [u32; 3] {
        let mut bandit = Bandit::new(3);
        let mut pulls = [0; 3];
        bandit.learn(&margins([0, 1, 2].map(|at| margin(at, 0))), None);
        for _ in 0..tests {
            let choice = bandit.choice(&[0; 3]);
            pulls[choice] += 1;
            bandit.learn(&margins([0, 1, 2].map(|at| margin(at, pulls[at]))), Some(choice));
        }
        assert_eq!(pulls, [0, 1, 2].map(|at| bandit.pulls(at)));
        pulls
    }

    #[test]
    fn most_tests_go_for_the_requirement_that_comes_nearer_and_some_for_the_others() {
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
    fn what_is_violated_is_left_alone_until_all_are() {
        let [first, second, third] =
            pulls(|at, tests| if tests >= [2, 4, 6][at] { -1.0 } else { 10.0 - f64::from(tests) }, 12);
        assert_eq!([first, second, third], [2, 4, 6]);
        let [first, second, third] = pulls(|at, tests| if tests >= [2, 4, 6][at] { -1.0 } else { 10.0 }, 40);
        assert!(first > 2 && second > 4 && third > 6, "then all are gone for again");
    }

    #[test]
    fn a_run_that_says_nothing_earns_nothing() {
        let mut bandit = Bandit::new(1);
        bandit.learn(&[Margin { value: None, violated: false }], Some(0));
        bandit.learn(&[Margin { value: Some(4.0), violated: false }], Some(0));
        bandit.learn(&[Margin { value: Some(1.0), violated: false }], Some(0));
        bandit.learn(&[Margin { value: Some(3.0), violated: false }], Some(0));
        assert_eq!(bandit.arms[0].earned, [0.0, 0.0, 0.75, 0.0]);
        assert_eq!(bandit.arms[0].least, Some(1.0));
    }
}
