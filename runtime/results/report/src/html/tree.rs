//! Certificates as trees: guarantees, the gates and the evidence that each needs, and demands to other monitors.

use sesame_notation as notation;
use sesame_plan::{CampaignPlan, Gate, Monitor, MonitorId};
use sesame_present::markup::{Markup, coordinate};

/// Sizes in pixels: a line of text, the space around it in a box, between boxes, and between columns.
const LINE: f64 = 15.0;
const INSET: f64 = 7.0;
const GAP: f64 = 8.0;
const BETWEEN: f64 = 34.0;

/// About the width of a letter, in pixels.
const LETTER: f64 = 6.8;

/// Letters of a name or a condition at most; its tooltip has all of it.
const LETTERS: usize = 54;

/// Parts that are drawn of a certificate at most.
const MOST: usize = 400;

/// The section with a tree for each monitor.
pub(super) fn certificates(body: &mut Markup, plan: &CampaignPlan) {
    if plan.monitors.is_empty() {
        return;
    }
    body.open("section", &[("id", "certificates")]);
    body.heading("Certificates");
    let said = "What each guarantee needs, the strongest first; a monitor is in its safe state (dashed) if none holds. A \
                demand leads to the certificate of another monitor.";
    body.element("p", &[("class", "quiet")], said);
    for (id, monitor) in (0..).map(MonitorId).zip(&plan.monitors) {
        body.element("h3", &[("id", &anchor(id))], &monitor.name);
        if !monitor.doc.is_empty() {
            body.element("p", &[("class", "quiet")], &monitor.doc);
        }
        let tree = CertificatePart::of(plan, monitor);
        if tree.size() > MOST {
            let words = format!("The certificate has {} parts. ", tree.size());
            body.open("p", &[]);
            body.prose(&format!("{words}`sesamec explain {} {}` prints them.", monitor.name, plan.source));
            body.close();
            continue;
        }
        body.open("div", &[("class", "scroll")]);
        draw(body, &tree, &monitor.name);
        body.close();
    }
    body.close();
}

fn anchor(monitor: MonitorId) -> String {
    format!("certificate-{}", monitor.0)
}

/// A part of a certificate as a box.
#[derive(Debug)]
struct CertificatePart {
    class: &'static str,
    /// Its lines; the second one is in a fainter colour.
    lines: Vec<String>,
    /// What it says in full, if that is more than the lines.
    title: Option<String>,
    /// The certificate to which it leads.
    leads_to: Option<MonitorId>,
    parts: Vec<CertificatePart>,
}

impl CertificatePart {
    fn new(class: &'static str, lines: &[&str], parts: Vec<CertificatePart>) -> CertificatePart {
        let is_long = |line: &&str| line.chars().count() > LETTERS;
        let title = lines.iter().any(is_long).then(|| lines.join(": "));
        let short = |line: &&str| {
            if is_long(line) { line.chars().take(LETTERS - 1).chain(['…']).collect() } else { (*line).to_owned() }
        };
        CertificatePart { class, lines: lines.iter().map(short).collect(), title, leads_to: None, parts }
    }

    fn of(plan: &CampaignPlan, monitor: &Monitor) -> CertificatePart {
        let mut parts: Vec<CertificatePart> = Vec::new();
        for guarantee in &monitor.guarantees {
            let integrity = format!("integrity {}", guarantee.integrity);
            parts.push(CertificatePart::new(
                "guarantee",
                &[&guarantee.name, &integrity],
                vec![gate(plan, monitor, &guarantee.gate)],
            ));
        }
        let sent = monitor.otherwise.mitigation.as_ref().map(|mitigation| notation::mitigation(plan, mitigation));
        let sent = sent.map_or("otherwise".to_owned(), |sent| format!("otherwise, with {sent}"));
        parts.push(CertificatePart::new("otherwise", &[&monitor.otherwise.name, &sent], Vec::new()));
        let external = if monitor.publishes.is_none() { "external monitor" } else { "monitor" };
        CertificatePart::new("monitor", &[&monitor.name, external], parts)
    }

    fn size(&self) -> usize {
        1 + self.parts.iter().map(CertificatePart::size).sum::<usize>()
    }

    fn width(&self) -> f64 {
        let letters = self.lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
        letters as f64 * LETTER + 2.0 * INSET
    }

    fn height(&self) -> f64 {
        self.lines.len() as f64 * LINE + INSET
    }

    /// The greatest width of the boxes in each column from this one on.
    fn widths(&self, column: usize, widths: &mut Vec<f64>) {
        if widths.len() == column {
            widths.push(0.0);
        }
        widths[column] = widths[column].max(self.width());
        self.parts.iter().for_each(|part| part.widths(column + 1, widths));
    }
}

fn gate(plan: &CampaignPlan, monitor: &Monitor, formula: &Gate) -> CertificatePart {
    match formula {
        Gate::Evidence(at) => {
            let evidence = &monitor.evidence[*at as usize];
            CertificatePart::new("evidence", &[&evidence.name, &notation::evidence(plan, evidence)], Vec::new())
        }
        Gate::Demand(at) => {
            let demand = &monitor.demands[*at as usize];
            let from = format!("demanded from {}", plan.monitor(demand.monitor).name);
            CertificatePart {
                leads_to: Some(demand.monitor),
                ..CertificatePart::new("demand", &[&demand.name, &from], Vec::new())
            }
        }
        Gate::All(_) | Gate::Any(_) | Gate::AtLeast { .. } => {
            let (needed, of) = (formula.needed().unwrap_or_default(), formula.parts().len());
            let name = match formula {
                Gate::All(_) => "and".to_owned(),
                Gate::Any(_) => "or".to_owned(),
                _ => format!("{needed} of {of}"),
            };
            CertificatePart::new(
                "gate",
                &[&name],
                formula.parts().iter().map(|part| gate(plan, monitor, part)).collect(),
            )
        }
    }
}

fn draw(body: &mut Markup, tree: &CertificatePart, name: &str) {
    let mut widths = Vec::new();
    tree.widths(0, &mut widths);
    let mut drawn = Drawing { boxes: Markup::default(), edges: Markup::default(), columns: Vec::new(), bottom: 1.0 };
    let mut x = 1.0;
    for width in widths {
        drawn.columns.push(x);
        x += width + BETWEEN;
    }
    drawn.part(tree, 0);
    let (width, height) = (coordinate(x - BETWEEN + 1.0), coordinate(drawn.bottom - GAP + 1.0));
    let frame = format!("0 0 {width} {height}");
    let label = format!("The certificate of {name}");
    let size = [("viewBox", frame.as_str()), ("width", &width), ("height", &height)];
    body.open("svg", &[&[("class", "tree"), ("role", "img"), ("aria-label", label.as_str())][..], &size].concat());
    body.append(drawn.edges);
    body.append(drawn.boxes);
    body.close();
}

struct Drawing {
    boxes: Markup,
    edges: Markup,
    /// Where each column begins.
    columns: Vec<f64>,
    /// Below all boxes so far.
    bottom: f64,
}

impl Drawing {
    /// Draws a box with all its parts to the right of it; gives the height of its middle.
    fn part(&mut self, part: &CertificatePart, column: usize) -> f64 {
        let top = self.bottom;
        let middles: Vec<f64> = part.parts.iter().map(|part| self.part(part, column + 1)).collect();
        let (left, width, height) = (self.columns[column], part.width(), part.height());
        let middle = match (middles.first(), middles.last()) {
            (Some(first), Some(last)) => f64::midpoint(*first, *last).max(top + height / 2.0),
            _ => top + height / 2.0,
        };
        self.bottom = self.bottom.max(middle + height / 2.0 + GAP);
        for end in middles {
            let (from, bend, to) = (left + width, self.columns[column + 1] - BETWEEN / 2.0, self.columns[column + 1]);
            let [from, bend, to, start, end] = [from, bend, to, middle, end].map(coordinate);
            self.edges.leaf("path", &[("class", "edge"), ("d", &format!("M{from} {start}H{bend}V{end}H{to}"))]);
        }
        let corner = [left, middle - height / 2.0];
        let address = part.leads_to.map(|monitor| format!("#{}", anchor(monitor)));
        if let Some(address) = &address {
            self.boxes.open("a", &[("href", address)]);
        }
        self.in_box(part, corner);
        if address.is_some() {
            self.boxes.close();
        }
        middle
    }

    fn in_box(&mut self, part: &CertificatePart, [left, top]: [f64; 2]) {
        let [x, y, width, height] = [left, top, part.width(), part.height()].map(coordinate);
        let round = if part.class == "gate" { "11" } else { "4" };
        let class = format!("box {}", part.class);
        let place = [("x", x.as_str()), ("y", &y), ("width", &width), ("height", &height), ("rx", round)];
        self.boxes.open("rect", &[&[("class", class.as_str())][..], &place].concat());
        if let Some(title) = &part.title {
            self.boxes.element("title", &[], title);
        }
        self.boxes.close();
        for (at, line) in part.lines.iter().enumerate() {
            let class = if at == 0 { "part" } else { "part says" };
            let (x, y) = (coordinate(left + INSET), coordinate(top + LINE * (at as f64 + 1.0)));
            self.boxes.element("text", &[("class", class), ("x", &x), ("y", &y)], line);
        }
    }
}
