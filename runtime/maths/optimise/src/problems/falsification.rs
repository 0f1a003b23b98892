//! Published falsification problems over the unit box, for comparisons with published figures.

use crate::problems::transmission::{self, Transmission};

/// A problem: margins of a vector of numbers in `0..=1`, one per requirement. A vector falsifies it when a margin is 0
/// or less.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FalsificationProblem {
    /// Three requirements over three variables, of which one alone can be violated, by 0.07 % of the box. Figures:
    /// Peltomäki and Porres 2022, "Falsification of Multiple Requirements for Cyber-Physical Systems Using Online
    /// Generative Adversarial Networks and Multi-Armed Bandits".
    Mo3d,
    /// Requirements `AT6a`, `AT6b` and `AT6c` of the automatic transmission of ARCH-COMP (Hoxha, Abbas and Fainekos
    /// 2014; Ernst et al. 2021), each of which may be violated: throttle and brake are constant for 5 s each, twelve
    /// numbers for 30 s. The published Simulink model is written anew as differential equations; see
    /// [`FalsificationProblem::margins`].
    Transmission,
}

impl FalsificationProblem {
    /// All of them.
    pub const ALL: [FalsificationProblem; 2] = [FalsificationProblem::Mo3d, FalsificationProblem::Transmission];

    /// Its name in small letters.
    pub fn name(self) -> &'static str {
        match self {
            FalsificationProblem::Mo3d => "mo3d",
            FalsificationProblem::Transmission => "at6abc",
        }
    }

    /// How many variables it has.
    pub fn variables(self) -> usize {
        match self {
            FalsificationProblem::Mo3d => 3,
            FalsificationProblem::Transmission => 2 * transmission::SEGMENTS,
        }
    }

    /// How many requirements it has.
    pub fn requirements(self) -> usize {
        3
    }

    /// The margins of its requirements.
    ///
    /// mo3d, with each x in `-15..=15`: `305 - 100 Σ sin(x/3)`, `230 - 75 Σ cos(x/2.5 + 15)` and
    /// `Σ ((x - 7)² - cos((x - 7)/2.75))`.
    ///
    /// at6abc: with `ω` the greatest engine speed within 30 s in rpm and `v(t)` the greatest vehicle speed up to `t`
    /// seconds in miles per hour, the greater of `(ω - 3000)/4800` and `(limit - v(t))/125`, for a limit of 35 at 4 s,
    /// of 50 at 8 s, and of 65 at 20 s. That is the robustness of "if the engine stays below 3000 rpm, the vehicle
    /// stays below the limit until then", with both signals divided by the ends of their usual ranges.
    pub fn margins(self, x: &[f64]) -> Vec<f64> {
        assert!(x.len() == self.variables(), "a vector has as many numbers as its problem");
        match self {
            FalsificationProblem::Mo3d => {
                let sum = |term: fn(f64) -> f64| x.iter().map(|x| term(30.0 * x - 15.0)).sum::<f64>();
                vec![
                    305.0 - 100.0 * sum(|x| libm::sin(x / 3.0)),
                    230.0 - 75.0 * sum(|x| libm::cos(x / 2.5 + 15.0)),
                    sum(|x| (x - 7.0) * (x - 7.0) - libm::cos((x - 7.0) / 2.75)),
                ]
            }
            FalsificationProblem::Transmission => {
                let (throttle, brake) = x.split_at(transmission::SEGMENTS);
                let run = Transmission::run(throttle, brake);
                let engine = (run.engine_speed - 3000.0) / 4800.0;
                [(4.0, 35.0), (8.0, 50.0), (20.0, 65.0)]
                    .map(|(until, limit)| engine.max((limit - run.vehicle_speed(until)) / 125.0))
                    .to_vec()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mo3d_is_violated_around_one_point_in_one_requirement_alone() {
        let at = |x: f64| FalsificationProblem::Mo3d.margins(&[(x + 15.0) / 30.0; 3]);
        assert!((at(7.0)[2] + 3.0).abs() < 1e-12, "the least of the third");
        assert!(at(8.0)[2] > 0.0);
        let steps = |least: usize, of: usize| {
            (0..=3000).map(|k| at(-15.0 + f64::from(k) / 100.0)[of]).fold(f64::INFINITY, f64::min) - least as f64
        };
        assert!(steps(5, 0).abs() < 0.01 && steps(5, 1).abs() < 0.01, "the others stay above 5");
    }
}
