//! Locked packages, held against advisories and exceptions.

use super::{Advisory, Database};
use crate::agreed::Exception;
use crate::locked::Package;
use crate::problem::Problem;

/// The packages that an advisory affects and no exception names, then the exceptions that name nothing of the kind,
/// then the packages from elsewhere that the database does not cover.
///
/// Every kind counts: vulnerable, unsound, unmaintained, or a mere notice.
pub fn problems(packages: &[Package], database: &Database, exceptions: &[Exception]) -> Vec<Problem> {
    let names = |exception: &Exception, advisory: &Advisory| {
        exception.id == advisory.id && exception.package == advisory.package
    };
    let affected: Vec<(&Package, &Advisory)> = packages
        .iter()
        .flat_map(|package| database.advisories.iter().map(move |advisory| (package, advisory)))
        .filter(|(package, advisory)| advisory.package == package.name && advisory.affects(&package.version))
        .collect();
    let unnamed = affected
        .iter()
        .filter(|(_, advisory)| !exceptions.iter().any(|exception| names(exception, advisory)))
        .map(|&(package, advisory)| Problem::Affected { package: package.clone(), advisory: advisory.clone() });
    let needless = exceptions
        .iter()
        .filter(|exception| !affected.iter().any(|(_, advisory)| names(exception, advisory)))
        .map(|Exception { id, package, .. }| Problem::NeedlessException { id: id.clone(), package: package.clone() });
    let uncovered = packages
        .iter()
        .filter(|package| package.source.is_some())
        .filter(|package| database.covers.as_ref().is_some_and(|covers| !covers.contains(&package.name)))
        .map(|package| Problem::NotCovered { package: package.clone() });
    unnamed.chain(needless).chain(uncovered).collect()
}
