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
        assert_eq!(serde_json::to_string(&[TestNumber(0), TestNumber(5)]).unwrap(), r#"["T0","T5"]"#);
    }
}
