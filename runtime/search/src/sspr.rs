//! The SESAME standard parameter reduction (SSPR): from a test to one point with up to nine coordinates.
//!
//! A test is a list of operations with windows and parameters; no two tests have the same shape. The reduction (section
//! 4.2.1 of the methodology's paper) makes them comparable: when the disturbances were active (T1 to T3), how strong
//! they were (P1, P2), and how many there were of which class (O0 to O3). Cells of a grid over these dimensions are
//! what coverage counts, and distances between points are what diversity means.
//!
//! The reduction is pure: [`Disturbance`]s in, a [`Point`] out. [`planned`] and [`observed`] make disturbances from a
//! plan and its tests.

mod adapt;
mod extent;
#[cfg(test)]
mod legacy;
#[cfg(test)]
mod tests;
mod window;

use sesame_plan::{ChoiceKind, Dimension, Span};

pub use adapt::{disturbance, observed, observed_point, planned};
pub use extent::extent;
pub use sesame_plan::Class;
pub(crate) use window::Window;

/// One operation of a test, as far as the reduction sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// What it does.
    pub class: Class,
    /// Where it may be active at all: what its intervals are shares of, in seconds.
    pub window: Span,
    /// When it was active, or is to be, in seconds. An operation without an interval does not contribute to the point.
    pub intervals: Vec<Span>,
    /// Its numeric parameters. Choices among texts are none.
    pub parameters: Vec<Intensity>,
}

/// A numeric parameter: what was chosen, and of what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intensity {
    /// What the space permits, lower end first.
    pub permitted: (f64, f64),
    /// What the test chose, lower end first; both ends are equal for a single value.
    pub chosen: (f64, f64),
    /// Whether the test chooses a value or a sub-range.
    pub shape: ChoiceKind,
}

/// Whose formulas are used. New campaigns always use [`Convention::Ours`]; the others reproduce old numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Convention {
    /// P2 is a standard deviation, O2 counts losses and O3 delays, a value is normalised from the lower end of its
    /// range.
    #[default]
    Ours,
    /// The original platform's code: P2 is a variance, O2 counts delays and O3 losses, packet loss is taken as the
    /// probability to keep a message, of a range of delays the lower end counts, and parameters of custom operations
    /// do not count.
    Original,
    /// The paper's text: as ours, but a value is divided by the width of its range without subtracting the lower end.
    Paper,
}

/// A test in the reduced parameter space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// T1, T2 and T3.
    timing: [f64; 3],
    /// P1 and P2; `None` for a test whose operations have no parameters.
    intensity: Option<[f64; 2]>,
    /// O0 to O3.
    counts: [u32; 4],
}

impl Point {
    /// The point of these disturbances; `None` if none of them has an interval.
    ///
    /// With the start `s` and end `e` of each interval as shares of its operation's window: T1 is the mean of
    /// `(s + e) / 2`, T2 the mean of `e - s`, T3 the population standard deviation of `(s + e) / 2`. With the
    /// normalised parameters of all operations that were active: P1 is their mean, P2 their population standard
    /// deviation.
    pub fn from_disturbances(disturbances: &[Disturbance], convention: Convention) -> Option<Point> {
        let active: Vec<&Disturbance> = disturbances
            .iter()
            .filter(|disturbance| !disturbance.intervals.is_empty() && disturbance.window.length() > 0.0)
            .collect();
        let share = |of: &Disturbance, time: f64| (time - of.window.start) / of.window.length();
        let shares: Vec<(f64, f64)> = active
            .iter()
            .flat_map(|&of| {
                of.intervals.iter().map(move |interval| (share(of, interval.start), share(of, interval.end)))
            })
            .collect();
        if shares.is_empty() {
            return None;
        }
        let midpoints: Vec<f64> = shares.iter().map(|(start, end)| f64::midpoint(*start, *end)).collect();
        let lengths: Vec<f64> = shares.iter().map(|(start, end)| end - start).collect();
        let parameters: Vec<f64> = active
            .iter()
            .filter(|of| convention != Convention::Original || of.class != Class::Other)
            .flat_map(|of| of.parameters.iter().filter_map(|parameter| parameter.normalised(of.class, convention)))
            .collect();
        let intensity = (!parameters.is_empty()).then(|| {
            let variance = variance(&parameters);
            let spread = if convention == Convention::Original { variance } else { libm::sqrt(variance) };
            [mean(&parameters), spread]
        });
        let count = |class: Option<Class>| {
            let counted = active.iter().filter(|of| class.is_none_or(|class| of.class == class)).count();
            u32::try_from(counted).unwrap_or(u32::MAX)
        };
        let [second, third] = match convention {
            Convention::Original => [Class::Delay, Class::Loss],
            Convention::Ours | Convention::Paper => [Class::Loss, Class::Delay],
        };
        Some(Point {
            timing: [mean(&midpoints), mean(&lengths), libm::sqrt(variance(&midpoints))],
            intensity,
            counts: [count(None), count(Some(Class::Value)), count(Some(second)), count(Some(third))],
        })
    }

    /// A coordinate. P1 and P2 are `None` for a test whose operations have no parameters.
    pub fn get(&self, dimension: Dimension) -> Option<f64> {
        let [t1, t2, t3] = self.timing;
        let count = |at: usize| Some(f64::from(self.counts[at]));
        match dimension {
            Dimension::T1 => Some(t1),
            Dimension::T2 => Some(t2),
            Dimension::T3 => Some(t3),
            Dimension::P1 => self.intensity.map(|[mean, _]| mean),
            Dimension::P2 => self.intensity.map(|[_, spread]| spread),
            Dimension::O0 => count(0),
            Dimension::O1 => count(1),
            Dimension::O2 => count(2),
            Dimension::O3 => count(3),
        }
    }
}

impl Intensity {
    /// The parameter as a share of what is permitted; `None` where nothing else is permitted.
    pub fn normalised(&self, class: Class, convention: Convention) -> Option<f64> {
        let ((low, high), (from, to)) = (self.permitted, self.chosen);
        let width = high - low;
        if width.is_nan() || width <= 0.0 {
            return None;
        }
        Some(match (convention, class) {
            (Convention::Original, Class::Loss) => (high - to) / width,
            (Convention::Original, Class::Delay) => (from - low) / width,
            _ if self.shape == ChoiceKind::Range => (to - from) / width,
            (Convention::Paper, _) => from / width,
            _ => (from - low) / width,
        })
    }
}

/// The distance of two points over some dimensions [SESAME 2023, equation 1]: Euclidean, with counts divided by
/// `largest_count`. Give the most operations a test of the campaign may hold, or 1 for counts as they are (as the
/// original platform and [SESAME 2023] do). `None` if one of the points lacks one of the dimensions.
pub fn distance(a: &Point, b: &Point, over: &[Dimension], largest_count: f64) -> Option<f64> {
    let whole = over.iter().all(|&dimension| a.get(dimension).is_some() && b.get(dimension).is_some());
    whole.then(|| distance_of_any(a, b, over, largest_count))
}

/// The same for points that may lack a dimension: where one of two does they are as far apart in it as can be, where
/// both do not at all. Operations without parameters are unlike any parameter.
pub fn distance_of_any(a: &Point, b: &Point, over: &[Dimension], largest_count: f64) -> f64 {
    let mut sum = 0.0;
    for &dimension in over {
        let difference = match (a.get(dimension), b.get(dimension)) {
            (Some(a), Some(b)) => a - b,
            (None, None) => 0.0,
            _ => 1.0,
        };
        let scale = match dimension {
            Dimension::O0 | Dimension::O1 | Dimension::O2 | Dimension::O3 => largest_count,
            Dimension::T1 | Dimension::T2 | Dimension::T3 | Dimension::P1 | Dimension::P2 => 1.0,
        };
        sum += (difference / scale) * (difference / scale);
    }
    libm::sqrt(sum)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The population variance.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64
}
