//! Licences of packages, as `cargo metadata` prints them.

use std::collections::BTreeMap;

use semver::Version;
use serde::Deserialize;
use spdx::{Expression, Licensee, ParseMode};

use crate::error::AuditError;
use crate::locked::Package;
use crate::problem::Problem;

/// What each package, by name and version, offers; `None` if its manifest names no licence.
pub type Licences = BTreeMap<(String, Version), Option<String>>;

/// The licences in what `cargo metadata --format-version 1` prints.
///
/// # Errors
///
/// When the text is something else.
pub fn of_metadata(metadata: &str) -> Result<Licences, AuditError> {
    #[derive(Deserialize)]
    struct Metadata {
        packages: Vec<Manifest>,
    }
    #[derive(Deserialize)]
    struct Manifest {
        name: String,
        version: Version,
        license: Option<String>,
    }
    let metadata: Metadata =
        serde_json::from_str(metadata).map_err(|error| AuditError::malformed("cargo metadata", error))?;
    Ok(metadata.packages.into_iter().map(|package| ((package.name, package.version), package.license)).collect())
}

/// The packages that offer none of the licences `agreed`, then those of `agreed` that no package needs.
///
/// A package that `licences` does not know offers nothing.
///
/// # Errors
///
/// When a licence is not an expression of names in the SPDX list.
pub fn problems(packages: &[Package], licences: &Licences, agreed: &[String]) -> Result<Vec<Problem>, AuditError> {
    let agreed: Vec<(&String, Licensee)> = agreed
        .iter()
        .map(|name| match Licensee::parse(name) {
            Ok(licensee) => Ok((name, licensee)),
            Err(error) => Err(AuditError::malformed("agreed.toml", error)),
        })
        .collect::<Result<_, _>>()?;
    let mut problems = Vec::new();
    let mut needed = vec![false; agreed.len()];
    for package in packages {
        let offered = licences.get(&(package.name.clone(), package.version.clone())).cloned().flatten();
        let Some(offered) = offered else {
            problems.push(Problem::Licence { package: package.clone(), offered });
            continue;
        };
        // Older manifests write `MIT/Apache-2.0`.
        let expression = Expression::parse_mode(&offered, ParseMode::LAX)
            .map_err(|error| AuditError::malformed(format!("{} {}", package.name, package.version), error))?;
        let passes_without = |left_out: Option<usize>| {
            expression.evaluate(|requirement| {
                let others = agreed.iter().enumerate().filter(|(index, _)| Some(*index) != left_out);
                others.into_iter().any(|(_, (_, licensee))| licensee.satisfies(requirement))
            })
        };
        if passes_without(None) {
            for (index, needed) in needed.iter_mut().enumerate() {
                *needed |= !passes_without(Some(index));
            }
        } else {
            problems.push(Problem::Licence { package: package.clone(), offered: Some(offered) });
        }
    }
    let needless = agreed.iter().zip(needed).filter(|(_, needed)| !needed);
    problems.extend(needless.map(|((licence, _), _)| Problem::NeedlessLicence { licence: (*licence).clone() }));
    Ok(problems)
}
