//! The page, and all its figures as files.

use std::collections::BTreeMap;

use sesame_analysis::compensation;
use sesame_analysis::gap::Gap;
use sesame_analysis::traces::{Signals, TraceGap, TracedTest};
use sesame_plan::Lab;
use sesame_present::markup::{Markup, fill};
use sesame_present::number::plural;
use sesame_present::table::Table;
use sesame_record::{RecordError, Repository};

use crate::html::policy;
use crate::study::figure::Figure;
use crate::study::space::Space;
use crate::study::{before_after, differences, figure, provenance, signals};

/// Traces of the tests on both sides.
#[derive(Debug)]
pub struct Traces {
    /// What was recorded.
    pub tests: Vec<TracedTest>,
    /// How the two sides differ.
    pub gap: TraceGap,
}

/// What is known of a study.
#[derive(Debug)]
pub struct Study<'a> {
    /// The results of the campaign.
    pub campaign: &'a Repository,
    /// The lab.
    pub lab: &'a Lab,
    /// The results of the lab; none before its first run.
    pub labs: &'a [Repository],
    /// The results of the compensated simulation, if there are any.
    pub again: Option<&'a Repository>,
    /// The tests in the reduced space, and what is chosen at each weight.
    pub space: &'a Space,
    /// How the tests were chosen, and all other choices.
    pub choices: &'a Table,
    /// The chosen tests.
    pub chosen: &'a Table,
    /// How simulation and lab differ; `None` before the lab's first run.
    pub gap: Option<&'a Gap>,
    /// How the compensated simulation and the lab differ.
    pub after: Option<&'a Gap>,
    /// Traces of simulation and lab.
    pub traces: Option<&'a Traces>,
    /// What the compensated simulation of each test published, by number.
    pub simulated_after: &'a BTreeMap<u32, Signals>,
    /// Finished markup of a briefing sheet for each chosen test: a `section` of the class `briefing`.
    pub sheets: &'a [String],
}

/// The figures of a study, by the section in which they are.
struct Figures {
    space: Figure,
    differences: Vec<Figure>,
    compensation: Vec<Figure>,
    traces: Vec<(u32, Vec<Figure>)>,
}

impl Figures {
    fn all(self) -> Vec<Figure> {
        let Figures { space, differences, compensation, traces } = self;
        let traces = traces.into_iter().flat_map(|(_, figures)| figures);
        std::iter::once(space).chain(differences).chain(compensation).chain(traces).collect()
    }
}

impl Study<'_> {
    /// What every page of a study holds and no other file: a page may be replaced.
    pub const MARK: &'static str = "id=\"space-data\"";

    fn drawn(&self) -> Figures {
        let plan = self.campaign.plan();
        Figures {
            space: self.space.figure(),
            differences: self.gap.map_or_else(Vec::new, |gap| differences::figures(plan, gap)),
            compensation: self
                .gap
                .zip(self.after)
                .map_or_else(Vec::new, |(before, after)| before_after::figures(plan, before, after)),
            traces: self
                .traces
                .map_or_else(Vec::new, |traces| signals::figures(&traces.tests, self.simulated_after, &traces.gap)),
        }
    }

    /// The page, one file that needs nothing but itself; and its figures, which can be files of their own.
    pub fn page(&self) -> Result<(String, Vec<Figure>), RecordError> {
        let plan = self.campaign.plan();
        let figures = self.drawn();
        let mut body = Markup::default();
        self.header(&mut body);
        body.open("main", &[]);
        self.choice(&mut body, &figures.space);
        self.gap(&mut body, &figures.differences);
        self.traces(&mut body, &figures.traces);
        self.compensation(&mut body, &figures.compensation);
        body.open("section", &[("id", "provenance")]);
        body.element("h2", &[], "Where this comes from");
        let mut files = vec![("Campaign", self.campaign)];
        files.extend(self.labs.iter().map(|lab| ("Lab", lab)));
        files.extend(self.again.map(|again| ("Compensated simulation", again)));
        provenance::provenance(&mut body, &files)?;
        body.close();
        body.close();
        let mut sheets = Markup::default();
        if !self.sheets.is_empty() {
            sheets.element("h2", &[("id", "sheets")], "Briefing sheets");
            let said = "One for each chosen test. Printing this page puts each on a sheet of its own.";
            sheets.element("p", &[("class", "quiet")], said);
        }
        let mut title = Markup::default();
        title.text(&format!("{} in lab {}", plan.campaign.name, self.lab.name));
        // Sheets are finished markup of another writer.
        let body = format!("{}{}{}", body.finish(), sheets.finish(), self.sheets.concat());
        let shell = sesame_templates::report::study(figure::style());
        let policy = policy(&shell);
        let page = fill(&shell, &[("policy", &policy), ("title", &title.finish()), ("body", &body)]);
        Ok((page, figures.all()))
    }

    fn header(&self, body: &mut Markup) {
        let plan = self.campaign.plan();
        body.open("header", &[]);
        body.element("p", &[("class", "kicker")], &format!("{} · campaign {}", plan.space, plan.campaign.name));
        body.element("h1", &[], &format!("Lab {}", self.lab.name));
        if !self.lab.doc.is_empty() {
            body.element("p", &[("class", "doc")], &self.lab.doc);
        }
        let headline = match self.gap {
            None => "The lab has not run any test yet.".to_owned(),
            Some(gap) => format!("{} in the lab and in simulation.", plural(gap.tests.len(), "test", "tests")),
        };
        body.element("p", &[("class", "headline")], &headline);
        body.close();
    }

    fn choice(&self, body: &mut Markup, space: &Figure) {
        body.open("section", &[("id", "choice")]);
        body.element("h2", &[], "The chosen tests");
        let said = "Each dot is a candidate, larger if it is more interesting. Chosen tests are coloured, named and \
                    joined by lines: the longer these are, the more the tests differ. A ring marks a test that the lab \
                    has run.";
        body.element("p", &[("class", "quiet")], said);
        body.open("div", &[("class", "space"), ("id", "space")]);
        space.picture(body, &[]);
        body.close();
        body.json("space-data", &self.space.data());
        self.chosen.html(body, &[]);
        body.open("details", &[]);
        body.element("summary", &[], "All weights at which the choice changes");
        self.choices.html(body, &[]);
        body.close();
        body.close();
    }

    fn gap(&self, body: &mut Markup, drawn: &[Figure]) {
        let Some(gap) = self.gap else { return };
        let plan = self.campaign.plan();
        body.open("section", &[("id", "gap")]);
        body.element("h2", &[], "The gap between simulation and lab");
        sentences(body, gap.sentences(plan));
        differences::map(body, plan, gap);
        let said = "Differences are the lab's mean minus the simulation's: = within the tolerance, ≠ different, ? not \
                    decided. Below, bars are intervals of 90 %, and the tolerance is shaded; a square is different, a \
                    dot is within the tolerance, a ring is not decided. A tinted range is where the gap is.";
        body.element("p", &[("class", "quiet")], said);
        grid(body, drawn);
        let events = gap.events();
        if !events.is_empty() {
            body.element("h3", &[], "Requirements and interlocks");
            events.html(body, &[]);
        }
        body.open("details", &[]);
        body.element("summary", &[], "All values");
        gap.overview(plan).html(body, &[]);
        body.close();
        body.close();
    }

    fn traces(&self, body: &mut Markup, drawn: &[(u32, Vec<Figure>)]) {
        let Some(traces) = self.traces else { return };
        body.open("section", &[("id", "traces")]);
        body.element("h2", &[], "Traces");
        sentences(body, traces.gap.sentences());
        let mut said =
            "Of each test, the signals that are furthest apart, and below them their difference. Black: simulation; \
             orange: runs of the lab"
                .to_owned();
        said.push_str(if self.simulated_after.is_empty() { "." } else { "; blue, dashed: compensated simulation." });
        body.element("p", &[("class", "quiet")], &said);
        for (test, figures) in drawn {
            body.element("h3", &[], &format!("T{test}"));
            grid(body, figures);
        }
        body.open("details", &[]);
        body.element("summary", &[], "All signals");
        traces.gap.table().html(body, &[]);
        body.close();
        body.close();
    }

    fn compensation(&self, body: &mut Markup, drawn: &[Figure]) {
        let (Some(again), Some(before), Some(after)) = (self.again, self.gap, self.after) else { return };
        let plan = self.campaign.plan();
        body.open("section", &[("id", "compensation")]);
        body.element("h2", &[], "Before and after the compensation");
        if let Some(compensation) = &again.plan().compensation {
            body.element("p", &[], &format!("Compensated {}.", compensation::in_words(again.plan(), compensation)));
        }
        grid(body, drawn);
        compensation::before_and_after(plan, before, after).html(body, &[]);
        body.close();
    }
}

fn sentences(body: &mut Markup, sentences: Vec<String>) {
    for sentence in sentences {
        body.open("p", &[]);
        body.prose(&sentence);
        body.close();
    }
}

fn grid(body: &mut Markup, figures: &[Figure]) {
    if figures.is_empty() {
        return;
    }
    body.open("div", &[("class", "drawings")]);
    for figure in figures {
        figure.show(body);
    }
    body.close();
}
