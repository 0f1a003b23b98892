//! Campaigns.

use sesame_plan::Times;

use super::exploration::exploring;
use super::words::list;
use super::{Kind, Resolver, lengths};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{
    self, Activation, ActivationMode, Averaging, CampaignId, Copies, Id as _, MetricId, OperationId, OwnSetting, Range,
    Search, Setting, Strategy, StrategyKind, StrategyProperties, TestId, TestTemplate,
};
use crate::span::Span;
use crate::syntax::ast::{self, Count, EndOfTest};
use crate::units::Unit;

/// The seed of a campaign that gives none.
const DEFAULT_SEED: u64 = 1;

impl<'a> Resolver<'a> {
    pub(super) fn campaigns(&mut self) -> Vec<Option<model::Campaign>> {
        let file = self.file;
        file.campaigns.iter().map(|campaign| self.campaign(campaign)).collect()
    }

    fn campaign(&mut self, campaign: &'a ast::Campaign) -> Option<model::Campaign> {
        let from = match &campaign.from {
            Some(from) => self.find(from, Kind::Campaign).map(|index| Some(CampaignId::from_index(index))),
            None => Some(None),
        };
        let end_after = self.end(campaign);
        let end_when = match campaign.ends.first().and_then(|(_, end)| end.when.as_ref()) {
            Some(condition) => self.switch(condition).map(Some),
            None => Some(None),
        };
        let objectives = self.objectives(campaign);
        let observed = match self.single(&campaign.observes, "observes") {
            Some(names) => self.find_all(names, Kind::Metric),
            None => Some(vec![]),
        };
        let searches: Vec<Span> = campaign.searches.iter().map(|search| search.span).collect();
        self.at_most_one(&searches, "search");
        let repeats: Vec<Span> = campaign.repeats.iter().map(|repeat| repeat.span).collect();
        self.at_most_one(&repeats, "repeat");
        let passives: Vec<Span> = campaign.passives.iter().map(|passive| passive.span).collect();
        self.at_most_one(&passives, "passive");
        let activation = match self.single(&campaign.activates, "activate") {
            Some(ast::ActivationMode::Condition(by)) => self.condition_space(by).map(ActivationMode::Condition),
            Some(ast::ActivationMode::Time) | None => Some(ActivationMode::Time),
        };
        let record = self.single(&campaign.records, "record").map(|record| match record {
            ast::Record::Failing => model::Recorded::Failing,
            ast::Record::All => model::Recorded::All,
        });
        let template = self.template(campaign, end_after, activation);
        let coverage = self.coverage(campaign);
        let exploration = self.exploration(campaign);
        let confirm = self.confirm(campaign);
        let neighbours = match campaign.searches.first() {
            Some(search) => self.neighbours(search),
            None => Some(None),
        };
        let stop = self.stop(campaign);
        let found = (campaign.searches.first(), campaign.repeats.first(), campaign.passives.first());
        let (search, seed) = match found {
            (_, repeat, Some(passive)) => {
                self.only_observes(campaign, passive, repeat.map(|repeat| repeat.span));
                let times = self.count(passive.times, 1, "the number of runs");
                (times.map(|times| Search::Passive { times }), self.seed(&passive.seed))
            }
            (_, Some(repeat), None) => {
                self.only_repeats(
                    campaign,
                    repeat.span,
                    "a campaign that repeats a test",
                    "this campaign repeats a test",
                );
                let search = self.repeat(repeat, end_after);
                (search, self.seed(&repeat.seed))
            }
            (Some(search), None, None) => {
                let explorable = self.explorable(campaign);
                let resolved = self.search(campaign, search, template, end_after).filter(|_| explorable);
                (resolved, self.seed(&search.seed))
            }
            (None, None, None) => {
                if !campaign.has_errors {
                    let title = format!("campaign `{}` needs `search`, `repeat` or `passive`", campaign.head.name.text);
                    let diagnostic = Diagnostic::new(Code::SEARCH_OR_REPEAT, campaign.head.name.span, title)
                        .label("add one of them")
                        .note("for example `search nsga2 { population 10  evaluations 200  seed 42 }`");
                    self.report(diagnostic);
                }
                return None;
            }
        };
        let metric_ids = |found: Vec<usize>| found.into_iter().map(MetricId::from_index).collect();
        Some(model::Campaign {
            declaration: self.declaration(&campaign.head),
            from: from?,
            objectives: metric_ids(objectives?),
            observed: metric_ids(observed?),
            search: search?,
            coverage: coverage?,
            exploration: exploration?,
            confirm: confirm?,
            neighbours: neighbours?,
            stop: stop?,
            seed: seed?,
            end_after: end_after?,
            end_when: end_when?,
            record,
        })
    }

    fn end(&mut self, campaign: &'a ast::Campaign) -> Option<f64> {
        let Some(EndOfTest { after: end, .. }) = self.single(&campaign.ends, "end after") else {
            if !campaign.has_errors {
                let name = &campaign.head.name;
                self.missing(name.span, &name.text, "the time at which its tests end", "end after 70s");
            }
            return None;
        };
        self.above_zero(end, &Unit::seconds(), "the end of a test", "`end after` must be greater than 0s")
    }

    fn objectives(&mut self, campaign: &'a ast::Campaign) -> Option<Vec<usize>> {
        let Some(names) = self.single(&campaign.objectives, "objectives") else {
            if campaign.repeats.is_empty()
                && campaign.passives.is_empty()
                && !campaign.searches.is_empty()
                && !campaign.has_errors
            {
                let (name, example) = (&campaign.head.name, self.example_of_objectives());
                self.missing(name.span, &name.text, "its objectives", &example);
            }
            return Some(vec![]);
        };
        let found = self.find_all(names, Kind::Metric);
        let mut complete = true;
        // A campaign without a search cannot have objectives, which is reported as such.
        for name in names.iter().filter(|_| campaign.repeats.is_empty() && campaign.passives.is_empty()) {
            let Some(definition) = self.names.get(name.text.as_str()).copied() else { continue };
            if definition.kind != Kind::Metric {
                continue;
            }
            let Some(metric) = &self.metrics[definition.index] else { continue };
            if metric.direction.is_some() {
                continue;
            }
            complete = false;
            let declared = &self.file.metrics[definition.index];
            let at = declared.ty.as_ref().map_or(declared.head.name.span, |ty| ty.span).end();
            let diagnostic =
                Diagnostic::new(Code::NO_DIRECTION, name.span, format!("objective `{}` has no direction", name.text))
                    .label("should it be maximised or minimised?")
                    .secondary(declared.head.name.span, "the metric is declared here")
                    .suggest("add `maximise` to search for large values", at, " maximise")
                    .suggest("add `minimise` to search for small values", at, " minimise");
            self.report(diagnostic);
        }
        found.filter(|_| complete)
    }

    /// What the tests of a search contain.
    fn template(
        &mut self,
        campaign: &'a ast::Campaign,
        end_after: Option<f64>,
        activation: Option<ActivationMode>,
    ) -> Option<TestTemplate> {
        let spans: Vec<Span> = campaign.operations.iter().map(|operation| operation.span).collect();
        self.at_most_one(&spans, "operations");
        let Some(operations) = campaign.operations.first() else {
            if campaign.repeats.is_empty()
                && campaign.passives.is_empty()
                && !campaign.searches.is_empty()
                && !campaign.has_errors
            {
                let name = &campaign.head.name;
                let example = format!("operations {} 1..5 per test", self.declared_or(Kind::Operation, "jitter"));
                self.missing(name.span, &name.text, "the operations of its tests", &example);
            }
            return None;
        };
        let found = self.find_all(&operations.names, Kind::Operation);
        for name in &operations.names {
            let Some(definition) = self.names.get(name.text.as_str()).copied() else { continue };
            if definition.kind != Kind::Operation {
                continue;
            }
            if let Some(end) = end_after {
                self.window_and_end(name, definition.index, end, campaign);
                self.lengths_and_end(name, definition.index, end, campaign);
            }
            // It was reported for the campaign that writes both.
            let told = campaign.inherited.operations && campaign.inherited.activate;
            if let (Some(ActivationMode::Condition(space)), false) = (&activation, told) {
                self.constraints_and_space(name, definition.index, space, campaign);
                self.lengths_and_space(name, definition.index, space, campaign);
            }
        }
        let min = self.count(operations.min, 1, "the number of operations per test");
        let max = self.count(operations.max, 1, "the number of operations per test");
        let [min, max] = [min?, max?];
        if min > max {
            let span = operations.min.span.to(operations.max.span);
            let mut diagnostic = Diagnostic::new(Code::BAD_COUNT, span, format!("`{min}..{max}` is reversed"))
                .label("the smaller number must come first");
            diagnostic = diagnostic.suggest("swap the two numbers", span, format!("{max}..{min}"));
            self.report(diagnostic);
            return None;
        }
        let found: Vec<OperationId> = found?.into_iter().map(OperationId::from_index).collect();
        let copies = operations.copies.map_or_else(Copies::default, |(_, copies)| copies);
        self.enough_operations(campaign, operations, &found, min)?;
        Some(TestTemplate { operations: found, min, max, copies, activation: activation? })
    }

    /// Reports a test that needs more operations than there are, if it may contain each only once.
    fn enough_operations(
        &mut self,
        campaign: &'a ast::Campaign,
        written: &'a ast::Operations,
        operations: &[OperationId],
        min: u32,
    ) -> Option<()> {
        let offline = |id: &OperationId| {
            self.operations[id.index()].as_ref().is_some_and(|operation| operation.kind.is_offline())
        };
        let (once, why) = match written.copies {
            Some((span, Copies::Once)) => (true, Some(span)),
            Some((_, Copies::MayOverlap)) => return Some(()),
            // Operations before the start and after the end have no time windows that could lie apart.
            Some((_, Copies::Apart)) | None => (operations.iter().all(offline), None),
        };
        let most = operations.len();
        if !once || min as usize <= most {
            return Some(());
        }
        let title = format!("a test of campaign `{}` cannot contain {min} operations", campaign.head.name.text);
        let label = if most == 1 { "there is only 1".to_owned() } else { format!("there are only {most}") };
        let diagnostic = Diagnostic::new(Code::BAD_COUNT, written.min.span, title).label(label);
        self.report(match why {
            Some(span) => diagnostic.secondary(span, "each may occur at most once"),
            None => diagnostic.note(
                "operations before the start and after the end of a run have no time window, so a test contains each at \
                 most once; add `may overlap` to permit copies",
            ),
        });
        None
    }

    /// Compares the permitted window of an operation with the end of a campaign that uses it.
    fn window_and_end(&mut self, name: &ast::Name, index: usize, end: f64, campaign: &'a ast::Campaign) {
        // It was reported for the campaign that writes both.
        if campaign.inherited.operations && campaign.inherited.end {
            return;
        }
        let Some(within) = self.operations[index].as_ref().and_then(|operation| operation.within) else { return };
        let body = &self.file.operations[index].body;
        let Some((_, written)) = body.within.first() else { return };
        let Some((_, end_written)) = campaign.ends.first() else { return };
        let end_written = &end_written.after;
        let end_text = self.text(end_written.span);
        let diagnostic = if within.low >= end {
            let title = format!("`{}` can never be active in campaign `{}`", name.text, campaign.head.name.text);
            Diagnostic::new(Code::AFTER_THE_END, name.span, title)
                .label(format!("its permitted window begins after the tests end at {end_text}"))
        } else if within.high > end {
            let title =
                format!("`{}` may be active beyond the end of campaign `{}`", name.text, campaign.head.name.text);
            Diagnostic::new(Code::OUTLASTS_THE_END, name.span, title)
                .label(format!("tests end at {end_text}, so anything later never happens"))
        } else {
            return;
        };
        self.report(
            diagnostic.secondary(written.span, "its permitted window").secondary(end_written.span, "tests end here"),
        );
    }

    fn search(
        &mut self,
        campaign: &'a ast::Campaign,
        search: &'a ast::Search,
        template: Option<TestTemplate>,
        end_after: Option<f64>,
    ) -> Option<Search> {
        let kind = search.strategy?;
        let evaluations = self.single(&search.evaluations, "evaluations").copied();
        if evaluations.is_none() && !search.has_errors {
            self.missing(search.span, &campaign.head.name.text, "its number of evaluations", "evaluations 200");
        }
        let found = evaluations.and_then(|count| self.count(count, 1, "the number of evaluations"));
        if self.foreign_setting(search, kind) {
            return None;
        }
        let value = match kind.properties().own {
            None => 0,
            Some(own) => self.own_setting(campaign, search, own, evaluations.zip(found))?,
        };
        let keeps = self.single(&search.keep_causes, "keep causes").is_some();
        let strategy = match kind.with_own(value) {
            Strategy::Interleaved { .. } => Strategy::Interleaved { keep_causes: keeps },
            other => other,
        };
        let template = template?;
        self.room_for_operations(campaign, search, &template, strategy, end_after.unwrap_or(f64::INFINITY))?;
        Some(Search::Strategy { template, strategy, evaluations: found? })
    }

    /// Reports tests by time that contain more copies than the strategy can place.
    fn room_for_operations(
        &mut self,
        campaign: &'a ast::Campaign,
        search: &'a ast::Search,
        template: &TestTemplate,
        strategy: Strategy,
        end_after: f64,
    ) -> Option<()> {
        let written = campaign.operations.first()?;
        let TestTemplate { operations, min, copies, activation, .. } = template;
        if *activation != ActivationMode::Time {
            return Some(());
        }
        let copies = |id: &OperationId| {
            let times = self.operations[id.index()].as_ref().map_or(Times::Offline, |operation| {
                let within = operation.within.unwrap_or(Range { low: 0.0, high: end_after });
                if operation.kind.is_offline() {
                    return Times::Offline;
                }
                Times::Windows {
                    room: (within.high.min(end_after) - within.low).max(0.0),
                    lengths: operation.lengths.map(lengths::permitted),
                }
            });
            strategy.most_copies(*copies, times)
        };
        let most = operations.iter().map(copies).fold(0, u32::saturating_add);
        if *min <= most {
            return Some(());
        }
        let keyword = strategy.kind().properties().keyword;
        let title = format!("a test of campaign `{}` cannot contain {min} operations", campaign.head.name.text);
        let diagnostic = Diagnostic::new(Code::BAD_COUNT, written.min.span, title)
            .label(format!("`search {keyword}` can place at most {most}"))
            .secondary(search.span, "this search");
        self.report(diagnostic);
        None
    }

    /// Whether a search has a setting that its strategy does not have, which is reported.
    fn foreign_setting(&mut self, search: &'a ast::Search, kind: StrategyKind) -> bool {
        let StrategyProperties { own, averaging, noun, .. } = kind.properties();
        let foreign = |setting: &&(Span, (Setting, Count))| own.is_none_or(|own| own.setting != setting.1.0);
        let of_others = search.own.iter().filter(foreign).map(|(span, (setting, _))| (*span, setting.keyword()));
        let causes = search.keep_causes.iter().filter(|_| kind != StrategyKind::Interleaved);
        let Some((span, setting)) = of_others.chain(causes.map(|(span, ())| (*span, "keep causes"))).next() else {
            return false;
        };
        let neighbours = (averaging == Averaging::Possible).then_some("neighbours");
        let causes = (kind == StrategyKind::Interleaved).then_some("keep causes");
        let known: Vec<&str> = own
            .map(|own| own.setting.keyword())
            .into_iter()
            .chain(["evaluations", "seed"])
            .chain(neighbours)
            .chain(causes)
            .collect();
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, span, format!("{noun} has no setting `{setting}`"))
            .label("remove this")
            .note(format!("its settings are {}", list(&known)));
        self.report(diagnostic);
        true
    }

    /// The value of a strategy's own setting. `evaluations` is what is written of them, and their number.
    fn own_setting(
        &mut self,
        campaign: &'a ast::Campaign,
        search: &'a ast::Search,
        own: OwnSetting,
        evaluations: Option<(Count, u32)>,
    ) -> Option<u32> {
        let (keyword, noun) = (own.setting.keyword(), own.setting.noun());
        let Some(&(_, count)) = self.single(&search.own, keyword) else {
            if own.default.is_none() && !search.has_errors {
                let example = format!("{keyword} {}", own.example);
                self.missing(search.span, &campaign.head.name.text, &format!("its {noun}"), &example);
            }
            return own.default;
        };
        let (least, most) = own.setting.permitted().into_inner();
        let value = self.count(count, if own.bred { least.max(2) } else { least }, &format!("the {noun}"))?;
        if value > most {
            let title = format!("the {noun} must be at most {most}, not {value}");
            self.report(Diagnostic::new(Code::BAD_COUNT, count.span, title).label(format!("expected {most} or less")));
            return None;
        }
        if !own.bred {
            return Some(value);
        }
        let even = value % 2 == 0;
        if !even {
            let title = format!("the {noun} must be even, not {value}");
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, count.span, title)
                .label("expected an even number, because children are made in pairs");
            self.report(match value.checked_add(1) {
                Some(even) => diagnostic.suggest(format!("use {even}"), count.span, even.to_string()),
                None => diagnostic,
            });
        }
        let (evaluations, found) = evaluations?;
        if found < value {
            let title = format!("{found} evaluations are too few for a {noun} of {value}");
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, evaluations.span, title)
                .label(format!("expected at least {value}"))
                .secondary(count.span, format!("the {noun}"));
            self.report(diagnostic);
            return None;
        }
        even.then_some(value)
    }

    fn repeat(&mut self, repeat: &'a ast::Repeat, end_after: Option<f64>) -> Option<Search> {
        let times = self.count(repeat.times, 1, "the number of repetitions");
        let index = self.find(&repeat.test, Kind::Test)?;
        if let Some(end) = end_after {
            self.test_and_end(index, end, repeat);
        }
        Some(Search::Repeat { test: TestId::from_index(index), times: times? })
    }

    /// Compares the windows of a repeated test with the campaign's end.
    fn test_and_end(&mut self, index: usize, end: f64, repeat: &ast::Repeat) {
        let Some(test) = self.tests[index].clone() else { return };
        let written = &self.file.tests[index].operations;
        for (operation, written) in test.operations.iter().zip(written) {
            let name = &written.operation.text;
            // A condition may hold at any time: only the permitted window is known beforehand.
            let (span, window) = match (&operation.activation, &written.activation) {
                (Activation::Window(window), ast::Activation::Window(written)) => (written.span, *window),
                _ => match self.operations[operation.operation.index()].as_ref().and_then(|operation| operation.within)
                {
                    Some(within) if within.low >= end => (written.operation.span, within),
                    _ => continue,
                },
            };
            let diagnostic = if window.low >= end {
                let title = format!("`{name}` is never active, because the campaign's tests end earlier");
                Diagnostic::new(Code::AFTER_THE_END, span, title).label(format!("begins after the tests end at {end}s"))
            } else if window.high > end {
                let title = format!("`{name}` is active beyond the end of the campaign that repeats this test");
                Diagnostic::new(Code::OUTLASTS_THE_END, span, title)
                    .label(format!("tests end at {end}s, so anything later never happens"))
            } else {
                continue;
            };
            self.report(diagnostic.secondary(repeat.test.span, "repeated here"));
        }
    }

    /// Reports clauses that disturb in a campaign that only observes.
    fn only_observes(&mut self, campaign: &'a ast::Campaign, passive: &ast::Passive, repeats: Option<Span>) {
        self.only_repeats(campaign, passive.span, "a campaign that only observes", "this campaign only observes");
        if let Some(repeat) = repeats {
            let title = "a campaign that only observes cannot repeat a test";
            let diagnostic = Diagnostic::new(Code::SEARCH_OR_REPEAT, repeat, title)
                .label("a test applies operations")
                .secondary(passive.span, "this campaign only observes");
            self.report(diagnostic);
        }
    }

    fn only_repeats(&mut self, campaign: &'a ast::Campaign, place: Span, who: &str, here: &str) {
        let by_condition =
            campaign.activates.iter().find(|(_, mode)| matches!(mode, ast::ActivationMode::Condition(_)));
        let exploration = campaign.explorations.first();
        let clauses = [
            (by_condition.map(|(span, _)| *span), "activate by condition"),
            (campaign.searches.first().map(|search| search.span), "search"),
            (campaign.operations.first().map(|operations| operations.span), "operations"),
            (campaign.objectives.first().map(|(span, _)| *span), "objectives"),
            (campaign.coverages.first().map(|coverage| coverage.span), "coverage"),
            (exploration.map(|exploration| exploration.span), exploration.map_or("", exploring)),
            (campaign.confirms.first().map(|confirm| confirm.span), "confirm"),
            (campaign.stops.first().map(|stop| stop.span), "stop"),
        ];
        for (span, word) in clauses {
            let Some(span) = span else { continue };
            let title = format!("{who} cannot have `{word}`");
            let mut diagnostic = Diagnostic::new(Code::SEARCH_OR_REPEAT, span, title)
                .label("a campaign either searches, repeats a test or only observes")
                .secondary(place, here);
            if word == "objectives" {
                diagnostic = diagnostic.suggest("use `observes` to measure metrics", span, "observes");
            }
            self.report(diagnostic);
        }
    }

    fn seed(&mut self, clauses: &'a [(Span, Count)]) -> Option<u64> {
        match self.single(clauses, "seed") {
            Some(seed) => seed.value,
            None => Some(DEFAULT_SEED),
        }
    }

    /// A count of at least `min`. `what` is the subject of "… must be at least 1", for example "the number of runs".
    pub(super) fn count(&mut self, count: Count, min: u32, what: &str) -> Option<u32> {
        let value = count.value?;
        match u32::try_from(value) {
            Ok(found) if found >= min => Some(found),
            Ok(_) => {
                let title = format!("{what} must be at least {min}, not {value}");
                let diagnostic = Diagnostic::new(Code::BAD_COUNT, count.span, title);
                self.report(diagnostic.label(format!("expected {min} or more")));
                None
            }
            Err(_) => {
                let title = format!("{what} cannot be {value}");
                let diagnostic = Diagnostic::new(Code::BAD_NUMBER, count.span, title);
                self.report(diagnostic.label(format!("expected at most {}", u32::MAX)));
                None
            }
        }
    }
}
