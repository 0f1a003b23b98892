//! Truth with three values: Kleene's strong logic [Kleene 1952]. Unknown means that it is true or false, but nobody
//! knows which.

use std::fmt;

/// A truth value. The order is false, unknown, true, so that `and` is the least and `or` the greatest of its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Truth {
    /// It does not hold.
    False,
    /// Nobody knows.
    #[default]
    Unknown,
    /// It holds.
    True,
}

impl Truth {
    /// Whether it is known to hold.
    pub fn holds(self) -> bool {
        self == Truth::True
    }
}

impl From<bool> for Truth {
    fn from(holds: bool) -> Self {
        if holds { Truth::True } else { Truth::False }
    }
}

impl fmt::Display for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Truth::False => "false",
            Truth::Unknown => "unknown",
            Truth::True => "true",
        })
    }
}

/// Whether at least `count` of the parts hold: true if that many are true, false if fewer are not false, otherwise
/// unknown. All of n parts is at least n of them, any of them is at least 1.
pub fn at_least(count: usize, parts: impl IntoIterator<Item = Truth>) -> Truth {
    let (mut certain, mut possible) = (0, 0);
    for part in parts {
        certain += usize::from(part == Truth::True);
        possible += usize::from(part != Truth::False);
    }
    at_least_of(count, certain, possible)
}

/// [`at_least`], of so many parts that are true and so many that are not false.
pub(crate) fn at_least_of(count: usize, certain: usize, possible: usize) -> Truth {
    if certain >= count {
        Truth::True
    } else if possible < count {
        Truth::False
    } else {
        Truth::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::Truth::{False, True, Unknown};
    use super::*;

    const ALL: [Truth; 3] = [False, Unknown, True];

    #[test]
    fn and_is_the_least_and_or_the_greatest() {
        for a in ALL {
            for b in ALL {
                assert_eq!(at_least(2, [a, b]), a.min(b));
                assert_eq!(at_least(1, [a, b]), a.max(b));
            }
        }
    }

    #[test]
    fn k_of_n_is_what_all_ways_to_know_more_agree_on() {
        for a in ALL {
            for b in ALL {
                for c in ALL {
                    for count in 1..=3 {
                        let may = |truth: Truth| match truth {
                            False => vec![0],
                            Unknown => vec![0, 1],
                            True => vec![1],
                        };
                        let mut outcomes = Vec::new();
                        for x in may(a) {
                            for y in may(b) {
                                outcomes.extend(may(c).into_iter().map(|z| x + y + z >= count));
                            }
                        }
                        let expected = match (outcomes.contains(&false), outcomes.contains(&true)) {
                            (true, true) => Unknown,
                            (_, holds) => Truth::from(holds),
                        };
                        assert_eq!(at_least(count, [a, b, c]), expected, "{count} of {a}, {b}, {c}");
                    }
                }
            }
        }
    }
}
