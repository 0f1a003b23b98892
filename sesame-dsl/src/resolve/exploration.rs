//! How a campaign's search explores (`boost`, `construct`, `predict`, `novelty`), and whether the campaign has what its
//! strategies need: cells, time windows, conditions or requirements.

use super::Resolver;
use super::quantity::percent;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{BoostedChildren, Dimension, Exploration, StrategyProperties};
use crate::span::Span;
use crate::syntax::ast::{self, ActivationMode, ExplorationKind};

/// Default settings of a boost: those of the original platform.
const EVERY: u32 = 2;
const TRIES: u32 = 10;
const DROP: u32 = 1;
/// Default number of candidates that a prediction compares.
const CANDIDATES: u32 = 20;
/// Default share of a generation that is constructed.
const SHARE: f64 = 0.5;
/// Default number of nearest tests that novelty is measured by.
const NEIGHBOURS: u32 = 10;

impl<'a> Resolver<'a> {
    /// The campaign's exploration. The outer `None` means that it has mistakes.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is the model's")]
    pub(super) fn exploration(&mut self, campaign: &'a ast::Campaign) -> Option<Option<Exploration>> {
        if let Some(again) = campaign.explorations.get(1) {
            let diagnostic = Diagnostic::new(
                Code::CLAUSE_TWICE,
                again.span,
                "a search can have only one of `boost`, `construct`, `predict` and `novelty`",
            )
            .label("remove one of the two")
            .secondary(campaign.explorations[0].span, "first given here");
            self.report(diagnostic);
        }
        let Some(written) = campaign.explorations.first() else { return Some(None) };
        let of = match written.kind {
            ExplorationKind::BoostFixed | ExplorationKind::BoostLinear => self.boost(written),
            ExplorationKind::Construct => self.construct(written),
            ExplorationKind::Novelty => self.novelty(written),
            ExplorationKind::Predict => match self.single(&written.candidates, "candidates") {
                Some(&count) => self.count(count, 1, "the number of candidates"),
                None => Some(CANDIDATES),
            }
            .map(|candidates| Exploration::Predict { candidates }),
        };
        Some(Some(of?))
    }

    fn boost(&mut self, written: &'a ast::Exploration) -> Option<Exploration> {
        let every_generations = match self.single(&written.generations, "every … generations") {
            Some(&count) => self.count(count, 1, "the number of generations from one boost to the next"),
            None => Some(EVERY),
        };
        let tries = match self.single(&written.tries, "tries") {
            Some(&count) => self.count(count, 1, "the number of tries"),
            None => Some(TRIES),
        };
        let children = if written.kind == ExplorationKind::BoostFixed {
            self.of_the_other(written, &written.children, "from … to");
            self.of_the_other(written, &written.drops, "drop");
            match self.single(&written.iterations, "every … iterations") {
                Some(&count) => self.count(count, 1, "the number of children from one boosted child to the next"),
                None => Some(EVERY),
            }
            .map(|iterations| BoostedChildren::Every { iterations })
        } else {
            self.of_the_other(written, &written.iterations, "every … iterations");
            self.falling(written)
        };
        Some(Exploration::Boost { every_generations: every_generations?, children: children?, tries: tries? })
    }

    fn falling(&mut self, written: &'a ast::Exploration) -> Option<BoostedChildren> {
        let drop = match self.single(&written.drops, "drop") {
            Some(&count) => self.count(count, 0, "the decrease per boost"),
            None => Some(DROP),
        };
        let Some(&[from, to]) = self.single(&written.children, "from … to") else {
            if !written.has_errors {
                let diagnostic = Diagnostic::new(
                    Code::CLAUSE_MISSING,
                    written.span,
                    "a linear boost needs the numbers of boosted children",
                )
                .label("add the first and the last number")
                .note("for example `from 10 to 1`");
                self.report(diagnostic);
            }
            return None;
        };
        let [first, last] = [from, to].map(|count| self.count(count, 0, "the number of boosted children"));
        let (first, last, drop) = (first?, last?, drop?);
        if first < last {
            let diagnostic =
                Diagnostic::new(Code::BAD_COUNT, from.span.to(to.span), "the number of boosted children must decrease")
                    .label("expected the larger number first");
            self.report(diagnostic.suggest(
                "swap the two numbers",
                from.span.to(to.span),
                format!("{last} to {first}"),
            ));
            return None;
        }
        Some(BoostedChildren::Falling { first, last, drop })
    }

    /// Refuses a setting that belongs to the other kind of boost.
    fn of_the_other<T>(&mut self, written: &ast::Exploration, settings: &[(Span, T)], setting: &str) {
        let Some((span, _)) = settings.first() else { return };
        let (this, other) = match written.kind {
            ExplorationKind::BoostFixed => ("fixed", "linear"),
            _ => ("linear", "fixed"),
        };
        let title = format!("a {this} boost has no setting `{setting}`");
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, *span, title)
            .label("remove this")
            .note(format!("only `boost {other}` has this setting"));
        self.report(diagnostic);
    }

    fn construct(&mut self, written: &'a ast::Exploration) -> Option<Exploration> {
        let share = match self.single(&written.shares, "share") {
            Some(quantity) => self.share(quantity, "the share of constructed tests"),
            None => Some(SHARE),
        };
        let until = match self.single(&written.untils, "until") {
            Some(quantity) => self.share(quantity, "the share of covered cells").map(Some),
            None => Some(None),
        };
        Some(Exploration::Construct { share: share?, until: until? })
    }

    fn novelty(&mut self, written: &'a ast::Exploration) -> Option<Exploration> {
        let neighbours = match self.single(&written.neighbours, "neighbours") {
            Some(&count) => self.count(count, 1, "the number of neighbours"),
            None => Some(NEIGHBOURS),
        };
        let over = match self.single(&written.overs, "over") {
            Some(names) => {
                self.once(names.iter());
                let over: Vec<_> = names.iter().map(|name| self.dimension(name)).collect();
                over.into_iter().collect::<Option<Vec<_>>>()
            }
            None => Some(Dimension::ALL.to_vec()),
        };
        Some(Exploration::Novelty { neighbours: neighbours?, over: over? })
    }

    /// A share above 0 and at most 1.
    pub(super) fn share(&mut self, quantity: &ast::Quantity, what: &str) -> Option<f64> {
        let value = self.value(quantity, Some(&percent()), what)?;
        if 0.0 < value && value <= 100.0 {
            return Some(self.probability(quantity, value));
        }
        let title = format!("{what} cannot be `{}`", self.text(quantity.span));
        let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, quantity.span, title);
        self.report(diagnostic.label("expected more than 0% and at most 100%"));
        None
    }

    /// Whether a campaign that searches has what its strategies need. Reports also if the search itself has mistakes.
    pub(super) fn explorable(&mut self, campaign: &'a ast::Campaign) -> bool {
        let before = self.diagnostics.len();
        let without_requirements = self.without_requirements(campaign);
        let mut refuse = |span: Span, title: String, label: &str| {
            self.diagnostics.push(Diagnostic::new(Code::NOTHING_TO_EXPLORE, span, title).label(label));
        };
        let by_condition =
            campaign.activates.first().is_some_and(|(_, mode)| matches!(mode, ActivationMode::Condition(_)));
        // Clauses that could not be read may be the missing ones.
        let without_conditions = !by_condition && !campaign.inherited_errors;
        let without_cells = campaign.coverages.is_empty() && !campaign.inherited_errors;
        let strategy = campaign.searches.first().and_then(|search| Some((search.span, search.strategy?)));
        if let Some((span, strategy)) = strategy {
            let StrategyProperties { keyword, needs_coverage, by_time_only, needs_requirements, .. } =
                strategy.properties();
            if needs_coverage && without_cells {
                let title = format!("`search {keyword}` needs a `coverage`");
                refuse(span, title, "add a `coverage`; the search keeps the best tests of each cell");
            }
            if by_time_only && by_condition {
                let title = format!("`search {keyword}` cannot be combined with `activate by condition`");
                refuse(span, title, "this search chooses time windows: use `activate by time`, or another search");
            }
            if needs_requirements && without_requirements {
                let title = format!("`search {keyword}` needs a `requirement`");
                refuse(span, title, "add a `requirement` that the search can try to violate");
            }
        }
        if let Some(exploration) = campaign.explorations.first() {
            let span = exploration.span;
            let (word, kind) = (exploring(exploration), exploration.kind);
            if strategy.is_some_and(|(_, strategy)| !strategy.properties().explores) {
                let title = format!("`{word}` only works with `search nsga2`");
                refuse(span, title, "use `search nsga2`, or remove this");
            } else if kind != ExplorationKind::Novelty {
                if without_cells {
                    refuse(span, format!("`{word}` needs a `coverage`"), "add a `coverage`, whose cells it aims at");
                }
                if kind == ExplorationKind::Predict && without_conditions {
                    let title = format!("`{word}` needs `activate by condition`");
                    refuse(span, title, "add `activate by condition`, or use `construct` instead");
                } else if kind != ExplorationKind::Predict && by_condition {
                    let title = format!("`{word}` cannot be combined with `activate by condition`");
                    refuse(span, title, "remove `activate by condition`, or use `predict` instead");
                }
            }
        }
        self.diagnostics.len() == before
    }

    /// Whether the space has no requirement, as far as its files and this campaign could be read.
    pub(super) fn without_requirements(&self, campaign: &ast::Campaign) -> bool {
        self.file.requirements.is_empty() && !self.file.incomplete && !campaign.inherited_errors
    }
}

/// The keyword of an exploration.
pub(super) fn exploring(exploration: &ast::Exploration) -> &'static str {
    match exploration.kind {
        ExplorationKind::BoostFixed | ExplorationKind::BoostLinear => "boost",
        ExplorationKind::Construct => "construct",
        ExplorationKind::Predict => "predict",
        ExplorationKind::Novelty => "novelty",
    }
}
