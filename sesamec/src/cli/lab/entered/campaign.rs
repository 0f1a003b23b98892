//! The campaign whose tests are run in a lab: what forms are printed from and checked against.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{anyhow, bail};

use sesame_dsl::similar::most_similar;
use sesame_plan::{CampaignPlan, Test};
use sesame_record::{Origin, Repository};

use super::sheet::quoted;

/// A test of the campaign.
struct Known {
    test: Test,
    /// The number of the test whose runs are its runs too, because it disturbs the same; its own, if there is none.
    first: u32,
}

/// The results of a campaign that has ended.
pub(super) struct Campaign {
    repository: Repository,
    tests_digest: String,
    tests: BTreeMap<u32, Known>,
    /// Names of tests beside `T1`, `T2`, …: those of regression tests, and those before an import.
    names: BTreeMap<String, u32>,
}

impl Campaign {
    /// Reads results of a campaign. They must be finished, because a form is about tests that do not change.
    pub(super) fn open(path: &Path) -> anyhow::Result<Campaign> {
        let repository = Repository::open(path)?;
        let at = repository.path().display();
        if repository.task().of_lab().is_some() {
            bail!("{at} has results of a lab; give the results of the campaign whose tests were run there");
        }
        if repository.campaign().stop.is_none() {
            bail!("{at} is unfinished, and a form is about tests that do not change; `resume` continues the run");
        }
        let (mut tests, mut names, mut firsts) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for row in repository.tests()? {
            if let Origin::Known(id) = row.origin {
                names.entry(repository.plan().test(id).name.clone()).or_insert(row.number);
            }
            if row.origin == Origin::Reference {
                names.entry("reference".to_owned()).or_insert(row.number);
            }
            let words = serde_json::to_string(&row.test).expect("a test is plain data with text keys");
            let first = *firsts.entry(words).or_insert(row.duplicate_of.unwrap_or(row.number));
            tests.insert(row.number, Known { test: row.test, first });
        }
        for (number, name) in repository.original_names()? {
            names.entry(name).or_insert(number);
        }
        let tests_digest = repository.tests_digest()?;
        Ok(Campaign { repository, tests_digest, tests, names })
    }

    pub(super) fn plan(&self) -> &CampaignPlan {
        self.repository.plan()
    }

    pub(super) fn repository(&self) -> &Repository {
        &self.repository
    }

    /// What a form says to be of these tests.
    pub(super) fn tests_digest(&self) -> &str {
        &self.tests_digest
    }

    pub(super) fn folder(&self) -> &Path {
        self.repository.folder()
    }

    /// A test by its number, which must be one of the campaign.
    pub(super) fn test(&self, number: u32) -> &Test {
        &self.tests[&number].test
    }

    /// The number of a test that can be run in a lab, from `T158`, `158` or another name of it; or what is wrong with
    /// the name. Of equal tests, this is the named one.
    pub(super) fn named(&self, name: &str) -> Result<u32, String> {
        let number = match (name.strip_prefix(['T', 't']).unwrap_or(name).parse::<u32>(), self.names.get(name)) {
            (_, Some(number)) => *number,
            (Ok(number), None) if self.tests.contains_key(&number) => number,
            (Ok(_), None) => return Err(format!("the campaign has no test {}; {}", quoted(name), self.range())),
            (Err(_), None) => {
                return Err(match most_similar(name, self.names.keys().map(String::as_str)) {
                    Some(meant) => format!("the campaign has no test {}; did you mean `{meant}`?", quoted(name)),
                    None => format!("{} is not a test such as `T1`; {}", quoted(name), self.range()),
                });
            }
        };
        if self.tests[&number].test.operations.is_empty() {
            return Err(format!("T{number} disturbs nothing; choose tests with operations"));
        }
        Ok(number)
    }

    /// The number of the test whose runs are those of this one too, because it disturbs the same; often its own.
    pub(super) fn first(&self, number: u32) -> u32 {
        self.tests[&number].first
    }

    fn range(&self) -> String {
        match (self.tests.keys().next(), self.tests.keys().next_back()) {
            (Some(first), Some(last)) => format!("its tests are T{first} to T{last}"),
            _ => "it has none".to_owned(),
        }
    }

    /// The numbers of these tests, each once and in this order; without names those of the front. Of equal tests it is
    /// the first one, whose runs are those of the others too.
    pub(super) fn to_run(&self, names: &[String]) -> anyhow::Result<Vec<u32>> {
        let mut numbers = Vec::new();
        if names.is_empty() {
            let front = self.repository.latest_result_set()?.map(|set| set.members).unwrap_or_default();
            numbers.extend(front.into_iter().filter(|number| self.tests.contains_key(number)));
            if numbers.is_empty() {
                bail!("campaign `{}` has no front; name the tests, for example `T1 T2`", self.plan().campaign.name);
            }
        }
        for name in names {
            numbers.push(self.named(name).map_err(|wrong| anyhow!(wrong))?);
        }
        let mut chosen = Vec::new();
        for number in numbers {
            let first = self.first(number);
            if !chosen.contains(&first) {
                chosen.push(first);
            }
        }
        Ok(chosen)
    }
}
