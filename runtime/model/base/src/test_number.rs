//! The number of a test in its results.

use std::fmt;

use serde::{Serialize, Serializer};

/// The number of a test in its results. It is shown, and serialised, as the test's name: `T` and the number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TestNumber(pub u32);

impl fmt::Display for TestNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "T{}", self.0)
    }
}

/// How many tests are named where many have something in common.
const NAMED: usize = 3;

/// The first of these tests by name, and how many more there are: `T3, T7, T9 and 18 more`.
pub fn first_of(tests: &[TestNumber]) -> String {
    let names: Vec<String> = tests.iter().take(NAMED).map(TestNumber::to_string).collect();
    let more = tests.len().saturating_sub(NAMED);
    if more == 0 { names.join(", ") } else { format!("{} and {more} more", names.join(", ")) }
}

impl Serialize for TestNumber {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_is_called_by_its_number_also_in_json() {
        assert_eq!(TestNumber(17).to_string(), "T17");
        let many: Vec<TestNumber> = (1..6).map(TestNumber).collect();
        assert_eq!([first_of(&many[..3]), first_of(&many)], ["T1, T2, T3", "T1, T2, T3 and 2 more"]);
        assert_eq!(serde_json::to_string(&[TestNumber(0), TestNumber(5)]).unwrap(), r#"["T0","T5"]"#);
    }
}
