//! `sesamec results`: analyses of results files.

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand, ValueEnum};
use sesame_plan::Dimension;
use sesame_runtime::analysis::{self, Dataset, Selection, regions};
use sesame_runtime::coverage::Grid;
use sesame_runtime::record::{DATABASE, Repository};
use sesame_runtime::report::TextOptions;
use sesame_runtime::sspr::Convention;

use super::shell::Shell;

/// What is asked of results files.
#[derive(Debug, Subcommand)]
pub(super) enum Results {
    /// What is in these files: campaigns, how many tests, and the names of result sets.
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
    /// The tests that no other dominates, by their recorded values.
    Front {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        output: Output,
    },
    /// The point of each test in the reduced parameter space.
    Sspr {
        #[command(flatten)]
        input: Input,
        /// The dimensions, for example `T1,T2,P1`; all if not said.
        #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = dimension)]
        dims: Vec<Dimension>,
        /// Whose formulas: `original` for the original platform's numbers, `paper` for those of the paper's text.
        #[arg(long, value_enum, default_value_t)]
        compat: Compat,
        #[command(flatten)]
        output: Output,
    },
    /// Where tests fail: rules over the reduced space and the operations, found by a small decision tree.
    Regions {
        #[command(flatten)]
        input: Input,
        /// Only this requirement, or `crash` or `timeout`; all in which tests fail if not said.
        #[arg(long, value_name = "NAME")]
        requirement: Option<String>,
        /// How many questions a rule has at most.
        #[arg(long, value_name = "N", default_value_t = regions::DEPTH, value_parser = clap::value_parser!(u32).range(1..=8))]
        depth: u32,
        /// Draw the tree of each into this folder, as `regions-NAME.svg`.
        #[arg(long, value_name = "DIR")]
        svg: Option<PathBuf>,
        #[command(flatten)]
        output: Output,
    },
    /// How many cells the tests cover: over evaluations, or each cell with its hits.
    Coverage {
        #[command(flatten)]
        input: Input,
        /// The cells, for example `T1:0:1:6,T2:0:0.5:6,P1:0:1:3`; those of the campaign if not said.
        #[arg(long, value_name = "GRID", value_parser = Grid::parse)]
        grid: Option<Grid>,
        /// Dimensions of the campaign's grid to keep, for example `T1,T2`; all if not said.
        #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = dimension, conflicts_with = "grid")]
        dims: Vec<Dimension>,
        /// Tests that a cell must have seen to be covered; as the campaign has it, else 1, if not said.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
        hits: Option<u32>,
        /// Show each cell instead of the coverage over evaluations.
        #[arg(long)]
        cells: bool,
        /// Whose formulas: `original` for the original platform's numbers, `paper` for those of the paper's text.
        #[arg(long, value_enum, default_value_t)]
        compat: Compat,
        #[command(flatten)]
        output: Output,
    },
}

/// Which tests.
#[derive(Debug, Args)]
pub(super) struct Input {
    /// A results file, or the folder of a run.
    file: PathBuf,
    /// Only the tests of this result set; `campaigns` names them.
    #[arg(long, value_name = "NAME")]
    set: Option<String>,
}

/// How the answer is printed.
#[derive(Debug, Args)]
pub(super) struct Output {
    /// As a table for people, or as CSV or JSON with all digits.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Format {
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
    fn convention(self) -> Convention {
        match self {
            Compat::Ours => Convention::Ours,
            Compat::Original => Convention::Original,
            Compat::Paper => Convention::Paper,
        }
    }
}

fn dimension(name: &str) -> Result<Dimension, String> {
    Dimension::named(name).ok_or_else(|| "there are T1, T2, T3, P1, P2, O0, O1, O2 and O3".to_owned())
}

/// Answers on standard output.
pub(super) fn results(shell: Shell, asked: Results) -> anyhow::Result<ExitCode> {
    match asked {
        Results::Campaigns { files, output } => {
            let mut found = Vec::new();
            for file in &files {
                let before = found.len();
                gather(file, &mut found)?;
                if found.len() == before {
                    bail!("no results in {}: name a results file, or a folder with such files below", file.display());
                }
            }
            let repositories = found.iter().map(|file| Repository::open(file)).collect::<Result<Vec<_>, _>>()?;
            print(&analysis::campaigns(&repositories)?, &output)
        }
        Results::Tests { input, output } => {
            let (repository, selection) = open(&input)?;
            print(&analysis::tests(&repository, &selection)?, &output)
        }
        Results::Front { input, output } => {
            let (repository, selection) = open(&input)?;
            if repository.plan().campaign.objectives.is_empty() {
                bail!("campaign `{}` has no objectives, so there is no front", repository.plan().campaign.name);
            }
            print(&analysis::front(&repository, &selection)?, &output)
        }
        Results::Sspr { input, dims, compat, output } => {
            let (repository, selection) = open(&input)?;
            let dimensions = if dims.is_empty() { Dimension::ALL.to_vec() } else { dims };
            print(&analysis::sspr(&repository, &selection, &dimensions, compat.convention())?, &output)
        }
        Results::Regions { input, requirement, depth, svg, output } => {
            let (repository, selection) = open(&input)?;
            let found = regions::regions(&repository, &selection, requirement.as_deref(), depth)?;
            if found.is_empty() {
                shell.warning("no test of these fails: it violates no requirement, crashes or times out");
            }
            if let Some(folder) = svg {
                std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
                for of in &found {
                    let file = folder.join(format!("regions-{}.svg", of.target));
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
                    if let Some(missing) = dims.iter().find(|&&it| goal.axes.iter().all(|axis| axis.dimension != it)) {
                        bail!("the campaign's cells have no dimension {}; give all with `--grid`", missing.name());
                    }
                    Grid::new(goal.axes).context("the campaign's cells")?
                }
                (None, None) => bail!(
                    "campaign `{}` does not count its coverage; say which cells, for example `--grid \
                     T1:0:1:6,T2:0:0.5:6,P1:0:1:3`",
                    repository.plan().campaign.name
                ),
            };
            let analysis = analysis::coverage(&repository, &selection, grid, hits, compat.convention())?;
            if !analysis.feasible_is_exact() {
                shell.warning("which cells are feasible is known in part: some of them perhaps cannot be reached");
            }
            print(&if cells { analysis.cells() } else { analysis.curve() }, &output)
        }
    }
}

fn open(input: &Input) -> anyhow::Result<(Repository, Selection)> {
    let repository = Repository::open(&input.file)?;
    let selection = Selection::of(&repository, input.set.as_deref())?;
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

/// Prints for people or programs. A reader that has gone away, as `| head` does, is no failure.
fn print(dataset: &Dataset, output: &Output) -> anyhow::Result<ExitCode> {
    let terminal = std::io::stdout().is_terminal();
    let colour = terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let text = match output.format {
        Format::Table => dataset.text(TextOptions { width: None, colour }),
        Format::Csv => dataset.csv(),
        Format::Json => dataset.json(),
    };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}
