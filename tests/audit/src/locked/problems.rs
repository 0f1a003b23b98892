//! Locked packages, held against the registries that were agreed to.

use super::Package;
use crate::problem::Problem;

/// The packages that come from elsewhere than `sources`.
pub fn problems(packages: &[Package], sources: &[String]) -> Vec<Problem> {
    packages
        .iter()
        .filter(|package| package.source.as_ref().is_some_and(|source| !sources.contains(source)))
        .map(|package| Problem::Source { package: package.clone() })
        .collect()
}
