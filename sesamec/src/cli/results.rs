//! `sesamec results`: analyses of results files.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand, ValueEnum};

use sesame_analysis as analysis;
use sesame_analysis::{GivenFront, Run, Scaling, Selection, Table, causes, pairs, regions};
use sesame_codegen::input;
use sesame_plan::{CampaignPlan, Dimension};
use sesame_record::{DATABASE, Repository};
use sesame_report::{TextOptions, figures};
use sesame_search::coverage::Grid;
use sesame_search::sspr::Convention;

use super::shell::{self, Shell};

/// Tests may violate a requirement all the same: what the reference run violates has no cause.
const NO_CAUSE: &str = "these tests show no cause of a violation";

/// What is asked of results files.
#[derive(Debug, Subcommand)]
pub(super) enum Results {
    /// Content of results files: campaigns, numbers of tests, and names of result sets.
    Campaigns {
        /// Results files, folders of runs, or folders with such folders below.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
        #[command(flatten)]
        output: Output,
    },
    /// All tests with their operations and the values of their metrics.
    Tests {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// The values of each metric over all tests: how many, mean, standard deviation and range. For repeated tests.
    Statistics {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// The front: the tests that no other test dominates, by their recorded values.
    Front {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// The causes of violations: for each requirement the smallest sets of operations with which tests violate it.
    Causes {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// In how many tests, and in which quarters of the run, each operation and each two of them acted together.
    Pairs {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// The point of each test in the reduced parameter space.
    Sspr {
        #[command(flatten)]
        input: Input,
        /// The dimensions, for example `T1,T2,P1`; all if omitted.
        #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = dimension)]
        dims: Vec<Dimension>,
        /// The formulas to use: `original` for those of the original platform, `paper` for those of the paper.
        #[arg(long, value_enum, default_value_t)]
        compat: Compat,
        #[command(flatten)]
        output: Output,
    },
    /// Where tests fail: rules over the reduced space and the operations, found by a small decision tree.
    Regions {
        #[command(flatten)]
        input: Input,
        /// Only this requirement, or `crash` or `timeout`; if omitted, everything by which tests fail.
        #[arg(long, value_name = "NAME")]
        requirement: Option<String>,
        /// A tree for each cause, of the tests that hold its operations and no other cause of the requirement, in the
        /// units of what these operations do.
        #[arg(long)]
        by_cause: bool,
        /// The maximum number of conditions in a rule.
        #[arg(long, value_name = "N", default_value_t = regions::DEPTH, value_parser = clap::value_parser!(u32).range(1..=8))]
        depth: u32,
        /// Draw each tree into this folder, as `regions-NAME.svg`.
        #[arg(long, value_name = "DIR")]
        svg: Option<PathBuf>,
        #[command(flatten)]
        output: Output,
    },
    /// How many cells the tests cover: over evaluations, or each cell with its hits.
    Coverage {
        #[command(flatten)]
        input: Input,
        /// The cells, for example `T1:0:1:6,T2:0:0.5:6,P1:0:1:3`; those of the campaign if omitted.
        #[arg(long, value_name = "GRID", value_parser = Grid::parse)]
        grid: Option<Grid>,
        /// Dimensions of the campaign's grid to keep, for example `T1,T2`; all if omitted.
        #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = dimension, conflicts_with = "grid")]
        dims: Vec<Dimension>,
        /// Tests that a cell needs to be covered; if omitted, the number given in the campaign, or else 1.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
        hits: Option<u32>,
        /// Show each cell instead of the coverage over evaluations.
        #[arg(long)]
        cells: bool,
        /// The formulas to use: `original` for those of the original platform, `paper` for those of the paper.
        #[arg(long, value_enum, default_value_t)]
        compat: Compat,
        #[command(flatten)]
        output: Output,
    },
    /// Hypervolume, distance to the final front, coverage and counts of tests after each generation.
    Indicators {
        /// A results file, or the folder of a run.
        file: PathBuf,
        /// The reference point of hypervolumes, a value per objective in its unit, for example `325,0`; if omitted, the
        /// one that was fixed while the campaign ran.
        #[arg(long, value_delimiter = ',', allow_negative_numbers = true, value_name = "VALUES")]
        reference: Vec<f64>,
        /// Show the distances IGD and IGD+ to this front instead: CSV or JSON with a column per objective, rows of
        /// numbers in the order of the objectives, or other results.
        #[arg(long, value_name = "FILE", conflicts_with = "reference")]
        against: Option<PathBuf>,
        /// Measure the distances in the units of the objectives instead of in ranges of the given front.
        #[arg(long, requires = "against")]
        unscaled: bool,
        #[command(flatten)]
        output: Output,
    },
    /// The page's figures of a run or a test, as a piece of HTML for a page of your own, such as a notebook.
    ///
    /// A run has its findings, causes, requirements and front; a test has its timeline and tables of everything on it.
    /// The piece brings its style, and needs no script.
    Figures {
        /// A results file, or the folder of a run.
        file: PathBuf,
        /// The test, for example `T158`; if omitted, the run.
        test: Option<String>,
    },
    /// Compare runs, or groups of runs that differ in their seeds.
    ///
    /// Each FILE is a group: a results file, the folder of a run, or a folder with several runs below. For groups
    /// of several runs, medians, quartiles and a comparison with the first group are shown, otherwise the runs.
    Compare {
        /// Results files, folders of runs, or folders with such folders below.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
        /// Group all runs by the names of their campaigns instead.
        #[arg(long)]
        by_campaign: bool,
        /// The reference point of hypervolumes, a value per objective in its unit, for example `325,0`; if omitted, the
        /// worst values in any test of any run.
        #[arg(long, value_delimiter = ',', allow_negative_numbers = true, value_name = "VALUES")]
        reference: Vec<f64>,
        /// The cells in which coverage is counted, for example `T1:0:1:6,T2:0:0.5:6,P1:0:1:3`; if omitted, those of the
        /// campaigns, provided that all have the same.
        #[arg(long, value_name = "GRID", value_parser = Grid::parse)]
        grid: Option<Grid>,
        /// Show each run, even if there are groups.
        #[arg(long, conflicts_with = "pairs")]
        runs: bool,
        /// For each pair of runs, show the share of the second front that the first one covers (the C-metric).
        #[arg(long)]
        pairs: bool,
        #[command(flatten)]
        output: Output,
    },
}

/// Which tests.
#[derive(Debug, Args)]
pub(super) struct Input {
    /// A results file, or the folder of a run.
    file: PathBuf,
    /// Only the tests of this result set; `campaigns` lists them.
    #[arg(long, value_name = "NAME")]
    set: Option<String>,
    /// Only the tests up to this number: what was known once so many had run.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    until: Option<u32>,
}

/// How the answer is printed.
#[derive(Debug, Args)]
pub(super) struct Output {
    /// As a table for people, or as CSV or JSON with all digits.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

impl Output {
    /// For whom.
    pub(super) fn format(&self) -> Format {
        self.format
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Format {
    #[default]
    Table,
    Csv,
    Json,
}

/// Whose formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Compat {
    /// Those of new campaigns.
    #[default]
    Ours,
    /// Those of the original platform's code.
    Original,
    /// Those of the paper's text.
    Paper,
}

impl Compat {
    pub(super) fn convention(self) -> Convention {
        match self {
            Compat::Ours => Convention::Ours,
            Compat::Original => Convention::Original,
            Compat::Paper => Convention::Paper,
        }
    }
}

pub(super) fn dimension(name: &str) -> Result<Dimension, String> {
    Dimension::named(name).ok_or_else(|| "expected one of T1, T2, T3, P1, P2, O0, O1, O2 and O3".to_owned())
}

/// Answers on standard output.
pub(super) fn results(shell: Shell, asked: Results) -> anyhow::Result<ExitCode> {
    match asked {
        Results::Campaigns { files, output } => {
            let mut found = Vec::new();
            for file in &files {
                found.extend(gathered(file)?);
            }
            let repositories = found.iter().map(|file| Repository::open(file)).collect::<Result<Vec<_>, _>>()?;
            let people = matches!(output.format, Format::Table);
            let readers = if people { analysis::Readers::People } else { analysis::Readers::Programs };
            print(&analysis::campaigns(&repositories, readers)?, &output)
        }
        Results::Tests { input, output } => {
            let (repository, selection) = open(&input)?;
            print(&analysis::tests(&repository, &selection)?, &output)
        }
        Results::Statistics { input, output } => {
            let (repository, selection) = open(&input)?;
            print(&analysis::statistics(&repository, &selection)?, &output)
        }
        Results::Front { input, output } => {
            let (repository, selection) = open(&input)?;
            if repository.plan().campaign.objectives.is_empty() {
                bail!("campaign `{}` has no objectives, so there is no front", repository.plan().campaign.name);
            }
            print(&analysis::front(&repository, &selection)?, &output)
        }
        Results::Causes { input, output } => {
            let (repository, selection) = open(&input)?;
            let found = causes::causes(&repository, &selection)?;
            if found.is_empty() {
                shell.warning(NO_CAUSE);
            }
            print(&causes::table(repository.plan(), &found), &output)
        }
        Results::Pairs { input, output } => {
            let (repository, selection) = open(&input)?;
            let found = pairs::pairs(&repository, &selection)?;
            match found.sentence() {
                Some(sentence) => shell.note(sentence),
                None => shell.note("there are no pairs: tests of this campaign hold at most one operation"),
            }
            print(&found.table(repository.plan()), &output)
        }
        Results::Sspr { input, dims, compat, output } => {
            let (repository, selection) = open(&input)?;
            let dimensions = if dims.is_empty() { Dimension::ALL.to_vec() } else { dims };
            say_without_point(shell, &repository, &selection, compat.convention())?;
            print(&analysis::sspr(&repository, &selection, &dimensions, compat.convention())?, &output)
        }
        Results::Regions { input, requirement, by_cause, depth, svg, output } => {
            let (repository, selection) = open(&input)?;
            let look = if by_cause { regions::regions_by_cause } else { regions::regions };
            let found = look(&repository, &selection, requirement.as_deref(), depth)?;
            if found.is_empty() {
                shell.warning(if by_cause {
                    NO_CAUSE
                } else {
                    "none of these tests violates a requirement, crashes or times out"
                });
            }
            if let Some(folder) = svg {
                std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
                for of in &found {
                    let file = folder.join(format!("regions-{}.svg", of.file_stem()));
                    std::fs::write(&file, of.svg(repository.plan()))
                        .with_context(|| format!("cannot write {}", file.display()))?;
                }
            }
            print(&regions::table(&found), &output)
        }
        Results::Coverage { input, grid, dims, hits, cells, compat, output } => {
            let (repository, selection) = open(&input)?;
            let goal = repository.plan().campaign.coverage.clone();
            let hits = hits.or(goal.as_ref().map(|goal| goal.hits)).unwrap_or(1);
            let grid = match (grid, goal) {
                (Some(grid), _) => grid,
                (None, Some(mut goal)) => {
                    goal.axes.retain(|axis| dims.is_empty() || dims.contains(&axis.dimension));
                    if let Some(missing) =
                        dims.iter().find(|&&dimension| goal.axes.iter().all(|axis| axis.dimension != dimension))
                    {
                        bail!(
                            "the campaign's cells have no dimension {}; give all cells with `--grid`",
                            missing.name()
                        );
                    }
                    Grid::new(goal.axes).context("the campaign's cells")?
                }
                (None, None) => bail!(
                    "campaign `{}` has no coverage; give the cells, for example `--grid \
                     T1:0:1:6,T2:0:0.5:6,P1:0:1:3`",
                    repository.plan().campaign.name
                ),
            };
            let analysis = analysis::coverage(&repository, &selection, grid, hits, compat.convention())?;
            if !analysis.feasible_is_exact() {
                shell.warning("not all feasible cells are known: some of these cells may be unreachable");
            }
            say_without_point(shell, &repository, &selection, compat.convention())?;
            print(&if cells { analysis.cells() } else { analysis.curve() }, &output)
        }
        Results::Indicators { file, reference, against, unscaled, output } => {
            let repository = Repository::open(&file)?;
            let needed = repository.plan().campaign.objectives.len();
            if let Some(against) = against {
                if needed == 0 {
                    bail!("campaign `{}` has no objectives, so there is no front", repository.plan().campaign.name);
                }
                let given = given_front(&against, repository.plan())
                    .with_context(|| format!("cannot take a front from {}", against.display()))?;
                let scaling = if unscaled { Scaling::Unscaled } else { Scaling::ByRange };
                let distances = analysis::distances(&repository, &given, scaling)?;
                return print(&analysis::distance_table(&distances), &output);
            }
            if !reference.is_empty() && reference.len() != needed {
                let given = reference.len();
                bail!(
                    "the reference point has {given} values for {needed} objectives; give one per objective, in its unit"
                );
            }
            let given = Some(reference.as_slice()).filter(|point| !point.is_empty());
            let analysis = analysis::indicators(&repository, given)?;
            measured_from(shell, &analysis.reference);
            print(&analysis.dataset(), &output)
        }
        Results::Figures { file, test } => {
            let repository = Repository::open(&file)?;
            let number = test.map(|name| repository.find(&name)).transpose()?;
            shell::asked_for(&figures(&repository, number)?)?;
            Ok(ExitCode::SUCCESS)
        }
        Results::Compare { files, by_campaign, reference, grid, runs, pairs, output } => {
            let compared = to_compare(&files, by_campaign)?;
            let given = Some(reference.as_slice()).filter(|point| !point.is_empty());
            let comparison = analysis::compare(&compared, given, grid)?;
            measured_from(shell, &comparison.reference);
            if !comparison.covers && !pairs {
                shell.note("the campaigns do not have the same cells; give cells for the comparison with `--grid`");
            }
            let shown = if pairs {
                comparison.pairs()
            } else if runs || !comparison.has_groups() {
                comparison.runs()
            } else {
                comparison.groups()
            };
            print(&shown, &output)
        }
    }
}

/// Says which imported tests have no point and why, aside, so that tables stay tables.
fn say_without_point(
    shell: Shell,
    repository: &Repository,
    selection: &Selection,
    convention: Convention,
) -> anyhow::Result<()> {
    for sentence in analysis::without_point(repository, selection, convention)? {
        shell.note(sentence);
    }
    Ok(())
}

/// Says where hypervolumes begin, aside, so that tables stay tables.
fn measured_from(shell: Shell, reference: &[(String, f64)]) {
    if !reference.is_empty() {
        let point: Vec<String> = reference.iter().map(|(metric, value)| format!("{metric} {value}")).collect();
        shell.note(format!("hypervolumes are measured from {}", point.join(", ")));
    }
}

/// The front in a file of points, or of results.
fn given_front(path: &Path, plan: &CampaignPlan) -> anyhow::Result<GivenFront> {
    let is_results = path.is_dir() || path.file_name().is_some_and(|name| name == DATABASE);
    if is_results {
        return Ok(GivenFront::of_results(&Repository::open(path)?, plan)?);
    }
    let text = input::text(path)?;
    GivenFront::read(&text, plan).map_err(anyhow::Error::msg)
}

/// The runs at and below paths, each in the group of its path or of its campaign.
fn to_compare(files: &[PathBuf], by_campaign: bool) -> anyhow::Result<Vec<Run>> {
    let mut runs: Vec<Run> = Vec::new();
    for file in files {
        for found in gathered(file)? {
            let repository = Repository::open(&found)?;
            let group = if by_campaign { repository.plan().campaign.name.clone() } else { file.display().to_string() };
            runs.push(Run { group, repository });
        }
    }
    if runs.len() < 2 {
        bail!("there is only one run; give two or more to compare");
    }
    Ok(runs)
}

/// The results files at and below a path; at least one.
fn gathered(path: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    gather(path, &mut found)?;
    if found.is_empty() {
        bail!("no results in {}; give a results file, or a folder that contains results", path.display());
    }
    Ok(found)
}

fn open(input: &Input) -> anyhow::Result<(Repository, Selection)> {
    let repository = Repository::open(&input.file)?;
    let selection = Selection::of(&repository, input.set.as_deref())?.until(input.until);
    Ok((repository, selection))
}

/// Folders that are looked into below one that is named.
const DEPTH: u32 = 4;

/// Finds results files at and below a path, in the order of their names.
fn gather(path: &Path, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    fn below(path: &Path, depth: u32, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
        let mut entries = std::fs::read_dir(path)?.collect::<Result<Vec<_>, _>>()?;
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let at = entry.path();
            if at.file_name().is_some_and(|name| name == DATABASE) {
                found.push(at);
            } else if depth > 0 && entry.file_type()?.is_dir() {
                below(&at, depth - 1, found)?;
            }
        }
        Ok(())
    }
    if path.is_dir() {
        below(path, DEPTH, found).with_context(|| format!("cannot look for results in {}", path.display()))
    } else {
        found.push(path.to_owned());
        Ok(())
    }
}

/// Prints for people or programs.
pub(super) fn print(table: &Table, output: &Output) -> anyhow::Result<ExitCode> {
    let terminal = std::io::stdout().is_terminal();
    let colour = terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let text = match output.format {
        Format::Table => table.text(TextOptions { width: None, colour }),
        Format::Csv => table.csv(),
        Format::Json => table.json(),
    };
    shell::asked_for(&text)?;
    Ok(ExitCode::SUCCESS)
}
