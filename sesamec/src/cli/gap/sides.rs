//! The two sides that are compared: results of a campaign, and of a lab in which its tests were run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::bail;

use sesame_analysis::gap::{Gap, LabRun, compensated_runs, dimensions, gap, gap_after, lab_runs};
use sesame_analysis::traces::{Signals, TraceGap, TracedTest, compare};
use sesame_plan::Lab;
use sesame_record::{RecordError, Repository};

use super::traces::{self, Runs};

/// Results of a campaign, of a lab, and perhaps of the simulation that was compensated for it.
pub(in crate::cli) struct Sides {
    /// The campaign.
    pub(in crate::cli) campaign: Repository,
    /// The files of the lab.
    pub(in crate::cli) labs: Vec<Repository>,
    /// The lab as it was declared on the day on which it ran; `None` without files of a lab.
    pub(in crate::cli) lab: Option<Lab>,
    /// The runs in the lab, by file.
    in_lab: Vec<Runs>,
    /// The compensated simulation, with its runs.
    pub(in crate::cli) again: Option<Repository>,
    simulated: Option<Runs>,
}

impl Sides {
    /// Reads results; all files of the lab must be of one lab.
    pub(in crate::cli) fn read(campaign: &Path, labs: &[PathBuf], simulation: Option<&Path>) -> anyhow::Result<Sides> {
        let campaign = Repository::open(campaign)?;
        let mut lab: Option<Lab> = None;
        let mut in_lab = Vec::new();
        let labs = labs.iter().map(|file| Repository::open(file)).collect::<Result<Vec<_>, _>>()?;
        for repository in &labs {
            in_lab.push((repository.folder().to_owned(), lab_runs(&campaign, repository)?));
            let Some(task) = repository.task().in_lab() else { continue };
            match &lab {
                Some(lab) if lab.name != task.lab => {
                    bail!(
                        "{} is of lab `{}`, and others are of lab `{}`; compare them separately",
                        repository.path().display(),
                        task.lab,
                        lab.name
                    )
                }
                // Tolerances and interlocks are those of the day on which the lab ran.
                _ => lab = repository.plan().labs.iter().find(|lab| lab.name == task.lab).cloned(),
            }
        }
        let again = simulation.map(Repository::open).transpose()?;
        let simulated = match &again {
            Some(again) => Some((again.folder().to_owned(), compensated_runs(&campaign, again)?)),
            None => None,
        };
        Ok(Sides { campaign, labs, lab, in_lab, again, simulated })
    }

    /// All runs in the lab.
    pub(in crate::cli) fn runs(&self) -> Vec<LabRun> {
        self.in_lab.iter().flat_map(|(_, runs)| runs.iter().cloned()).collect()
    }

    /// How simulation and lab differ.
    pub(in crate::cli) fn gap(&self) -> Result<Gap, RecordError> {
        gap(&self.campaign, &self.runs(), self.lab.as_ref())
    }

    /// How the compensated simulation and the lab differ; `None` without one.
    pub(in crate::cli) fn gap_after(&self) -> Result<Option<Gap>, RecordError> {
        let after = |(_, again): &Runs| gap_after(&self.campaign, again, &self.runs(), self.lab.as_ref());
        self.simulated.as_ref().map(after).transpose()
    }

    /// The traces of simulation and lab.
    pub(in crate::cli) fn traces(&self) -> anyhow::Result<Vec<TracedTest>> {
        traces::read(&self.campaign, None, &self.in_lab, self.lab.as_ref())
    }

    /// The traces of the compensated simulation and of the lab; none without one.
    pub(in crate::cli) fn traces_after(&self) -> anyhow::Result<Vec<TracedTest>> {
        match &self.simulated {
            Some(again) => traces::read(&self.campaign, Some(again), &self.in_lab, self.lab.as_ref()),
            None => Ok(Vec::new()),
        }
    }

    /// What the compensated simulation of each test published; nothing without one.
    pub(in crate::cli) fn simulated_after(&self) -> anyhow::Result<BTreeMap<u32, Signals>> {
        let again = self.simulated.as_ref();
        again.map_or_else(|| Ok(BTreeMap::new()), |again| traces::read_again(self.campaign.plan(), again))
    }

    /// How traces differ; `None` if there are none.
    pub(in crate::cli) fn compared(&self, tests: &[TracedTest]) -> Option<TraceGap> {
        (!tests.is_empty()).then(|| compare(tests, &dimensions(self.lab.as_ref())))
    }
}
