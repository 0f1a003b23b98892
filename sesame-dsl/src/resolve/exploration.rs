//! What a campaign's search does to cover more cells, and what the strategies need that go by cells or windows.

use super::Resolver;
use super::quantity::percent;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{ActivationMode, BoostedChildren, Dimension, Exploration, Search};
use crate::span::Span;
use crate::syntax::ast::{self, ExplorationKind, Strategy};

/// Numbers that a boost has unless it says otherwise: those of the original platform.
const EVERY: u32 = 2;
const TRIES: u32 = 10;
const DROP: u32 = 1;
/// Candidates that a prediction compares unless it is said.
const CANDIDATES: u32 = 20;
/// The share of a generation that is constructed unless it is said.
const SHARE: f64 = 0.5;
/// Nearest tests that make up novelty unless it is said.
const NEIGHBOURS: u32 = 10;

impl<'a> Resolver<'a> {
    /// The campaign's exploration. The outer `None` says that it is not in order.
    #[expect(clippy::option_option, reason = "the outer says whether it was in order, the inner is the model's")]
    pub(super) fn exploration(&mut self, campaign: &'a ast::Campaign) -> Option<Option<Exploration>> {
        if let Some(again) = campaign.explorations.get(1) {
            let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, again.span, "a search explores in one way")
                .label("remove this one or the other")
                .also(campaign.explorations[0].span, "first here");
            self.report(diagnostic);
        }
        let Some(written) = campaign.explorations.first() else { return Some(None) };
        let of = match written.kind {
            ExplorationKind::BoostFixed | ExplorationKind::BoostLinear => self.boost(written),
            ExplorationKind::Construct => self.construct(written),
            ExplorationKind::Novelty => self.novelty(written),
            ExplorationKind::Predict => match self.single(&written.candidates, "candidates") {
                Some(&count) => self.count(count, 1, "a prediction compares"),
                None => Some(CANDIDATES),
            }
            .map(|candidates| Exploration::Predict { candidates }),
        };
        Some(Some(of?))
    }

    fn boost(&mut self, written: &'a ast::Exploration) -> Option<Exploration> {
        let every_generations = match self.single(&written.generations, "every … generations") {
            Some(&count) => self.count(count, 1, "the generations from one boost to the next are"),
            None => Some(EVERY),
        };
        let tries = match self.single(&written.tries, "tries") {
            Some(&count) => self.count(count, 1, "a boost tries"),
            None => Some(TRIES),
        };
        let children = if written.kind == ExplorationKind::BoostFixed {
            self.of_the_other(written, &written.children, "from … to");
            self.of_the_other(written, &written.drops, "drop");
            match self.single(&written.iterations, "every … iterations") {
                Some(&count) => self.count(count, 1, "the children from one boost to the next are"),
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
            Some(&count) => self.count(count, 0, "a boost drops"),
            None => Some(DROP),
        };
        let Some(&[from, to]) = self.single(&written.children, "from … to") else {
            if !written.has_errors {
                let diagnostic =
                    Diagnostic::new(Code::CLAUSE_MISSING, written.span, "this boost does not say how many")
                        .label("add how many children are boosted at first and at last")
                        .note("for example `from 10 to 1`");
                self.report(diagnostic);
            }
            return None;
        };
        let [first, last] = [from, to].map(|count| self.count(count, 0, "a boost takes"));
        let (first, last, drop) = (first?, last?, drop?);
        if first < last {
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, from.span.to(to.span), "a linear boost becomes less")
                .label("expected the larger number first");
            self.report(diagnostic.suggest("swap them", from.span.to(to.span), format!("{last} to {first}")));
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
            .label("leave it out")
            .note(format!("`boost {other}` has it"));
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
            Some(&count) => self.count(count, 1, "novelty looks at"),
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

    /// Whether a campaign has what its strategies work on.
    pub(super) fn explorable(&mut self, campaign: &'a ast::Campaign, search: &Search) -> bool {
        // A campaign that searches nothing was told so.
        let Some(template) = search.template() else { return true };
        let mut complete = true;
        let by_condition = matches!(template.activation, ActivationMode::Condition(_));
        let mut refuse = |resolver: &mut Self, span: Span, what: &str, lacks: &str, label: &str| {
            let title = format!("{what} {lacks}");
            resolver.report(Diagnostic::new(Code::NOTHING_TO_EXPLORE, span, title).label(label));
            complete = false;
        };
        let written = campaign.searches.first();
        let strategy = written.and_then(|search| Some((search.span, search.strategy?)));
        let without_requirements = self.file.requirements.is_empty() && !campaign.inherited_errors;
        let without_cells = campaign.coverages.is_empty() && !campaign.inherited_errors;
        match strategy {
            Some((span, Strategy::MapElites)) if without_cells => {
                refuse(self, span, "MAP-Elites", "has no cells to keep tests in", "add a `coverage`");
            }
            Some((span, by_windows @ (Strategy::LatinHypercube | Strategy::Sobol | Strategy::Falsification)))
                if by_condition =>
            {
                let what = match by_windows {
                    Strategy::Sobol => "a Sobol search",
                    Strategy::Falsification => "a falsification",
                    _ => "a Latin hypercube",
                };
                let lacks = "has no windows of time to choose";
                refuse(self, span, what, lacks, "leave `activate by condition` out, or search otherwise");
            }
            Some((span, Strategy::Falsification)) if without_requirements => {
                refuse(self, span, "a falsification", "has no requirement to violate", "add a `requirement`");
            }
            _ => {}
        }
        if let Some(exploration) = campaign.explorations.first() {
            let what = match exploration.kind {
                ExplorationKind::BoostFixed | ExplorationKind::BoostLinear => "a boost",
                ExplorationKind::Construct => "construction",
                ExplorationKind::Predict => "a prediction",
                ExplorationKind::Novelty => "novelty",
            };
            let novel = exploration.kind == ExplorationKind::Novelty;
            let predicts = exploration.kind == ExplorationKind::Predict;
            if strategy.is_some_and(|(_, strategy)| strategy != Strategy::Nsga2) {
                refuse(self, exploration.span, what, "changes an evolution", "search by `nsga2` to have one");
            } else if novel {
                // Distances are between points: neither cells nor windows are needed.
            } else if without_cells {
                refuse(self, exploration.span, what, "has no cells to go for", "add a `coverage`");
            } else if predicts && !by_condition {
                let label = "say `activate by condition`, or take `construct` instead";
                refuse(self, exploration.span, what, "has no conditions to weigh", label);
            } else if by_condition && !predicts {
                let lacks = "has no windows of time to choose";
                refuse(
                    self,
                    exploration.span,
                    what,
                    lacks,
                    "leave `activate by condition` out, or take `predict` instead",
                );
            }
        }
        complete
    }
}
