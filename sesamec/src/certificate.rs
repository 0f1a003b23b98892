//! The certificate of a runtime monitor as a tree: its guarantees, the gates and the evidence that each needs, and
//! through demands those of other monitors.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde::Serialize;
use sesame_dsl::index::{Definition, Index, Kind};
use sesame_dsl::model::eddi::{Evidence, Gate};
use sesame_dsl::model::{EddiId, Space};
use sesame_dsl::source::SourceMap;
use sesame_dsl::span::Span;
use sesame_notation::quoted;
use sesame_plan::TextTest;

/// A part of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct CertificatePart {
    /// What it is.
    pub kind: PartKind,
    /// Its name; `None` for `and`, `or` and `at_least`.
    pub name: Option<String>,
    /// For a demand: the monitor whose guarantee it is.
    pub from: Option<String>,
    /// For a guarantee: its integrity.
    pub integrity: Option<u32>,
    /// For `and`, `or` and `at_least`: how many parts must hold.
    pub needs: Option<usize>,
    /// For evidence: its condition, with how long it must hold and when it is stale. For the safe state: its
    /// mitigation.
    pub says: Option<String>,
    /// For a demand: whether its parts are those of an earlier demand of the same guarantee, and not listed again.
    pub repeated: bool,
    /// What it depends on, in the order of the declaration. For a monitor: its guarantees, the strongest first, and its
    /// safe state. For a demand: the guarantees of the other monitor that fulfil it.
    pub parts: Vec<CertificatePart>,
}

/// What a part of a certificate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PartKind {
    /// A monitor.
    Monitor,
    /// A monitor that the system itself decides.
    ExternalMonitor,
    /// A guarantee.
    Guarantee,
    /// All of its parts.
    And,
    /// At least one of its parts.
    Or,
    /// At least so many of its parts.
    AtLeast,
    /// Evidence.
    Evidence,
    /// A guarantee of another monitor.
    Demand,
    /// The state when no guarantee holds.
    SafeState,
}

impl CertificatePart {
    fn new(kind: PartKind, name: Option<&str>, parts: Vec<CertificatePart>) -> Self {
        let name = name.map(str::to_owned);
        CertificatePart { kind, name, from: None, integrity: None, needs: None, says: None, repeated: false, parts }
    }
}

/// The certificate of the monitor whose name is declared here, if there is one.
pub(crate) fn certificate(
    space: &Space,
    sources: &SourceMap,
    index: &Index,
    declared: Span,
) -> Option<CertificatePart> {
    let (id, monitor) = space.eddis.iter().find(|(_, eddi)| eddi.declaration.span == declared)?;
    let kind = if monitor.publishes.is_some() { PartKind::Monitor } else { PartKind::ExternalMonitor };
    let mut tree = Tree { space, sources, index, seen: BTreeSet::new() };
    let mut parts: Vec<_> = (0..monitor.guarantees.len()).map(|at| tree.guarantee(id, at)).collect();
    let otherwise = &monitor.otherwise.declaration;
    let mut safe = CertificatePart::new(PartKind::SafeState, Some(&otherwise.name), Vec::new());
    safe.says = tree.written(otherwise.span).and_then(|(definition, text)| {
        let (_, sent) = text.split_once(definition.name.as_str())?;
        Some(one_line(sent)).filter(|sent| !sent.is_empty())
    });
    parts.push(safe);
    Some(CertificatePart::new(kind, Some(&monitor.declaration.name), parts))
}

struct Tree<'a> {
    space: &'a Space,
    sources: &'a SourceMap,
    index: &'a Index,
    /// Demanded guarantees whose parts were listed.
    seen: BTreeSet<(EddiId, usize)>,
}

impl<'a> Tree<'a> {
    fn guarantee(&mut self, monitor: EddiId, at: usize) -> CertificatePart {
        let guarantee = &self.space.eddis[monitor].guarantees[at];
        let parts = vec![self.gate(monitor, &guarantee.gate)];
        let part = CertificatePart::new(PartKind::Guarantee, Some(&guarantee.declaration.name), parts);
        CertificatePart { integrity: Some(guarantee.integrity), ..part }
    }

    fn gate(&mut self, monitor: EddiId, gate: &Gate) -> CertificatePart {
        let kind = match gate {
            Gate::Evidence(at) => return self.evidence(&self.space.eddis[monitor].evidence[*at as usize]),
            Gate::Demand(at) => return self.demand(monitor, *at as usize),
            Gate::All(_) => PartKind::And,
            Gate::Any(_) => PartKind::Or,
            Gate::AtLeast { .. } => PartKind::AtLeast,
        };
        let parts = gate.parts().iter().map(|part| self.gate(monitor, part)).collect();
        CertificatePart { needs: gate.needed(), ..CertificatePart::new(kind, None, parts) }
    }

    fn evidence(&self, evidence: &Evidence) -> CertificatePart {
        let part = CertificatePart::new(PartKind::Evidence, Some(&evidence.declaration.name), Vec::new());
        let written =
            self.written(evidence.declaration.span).filter(|(definition, _)| definition.kind == Kind::Evidence);
        let written = written.and_then(|(_, text)| Some(one_line(text.split_once('=')?.1)));
        CertificatePart { says: written.or_else(|| self.said(evidence)), ..part }
    }

    /// The evidence of an external monitor whose state a topic says.
    fn said(&self, evidence: &Evidence) -> Option<String> {
        let input = evidence.inputs.first()?;
        let topic = self.space.topics[input.field.topic].declaration.name.as_str();
        let path: Vec<&str> = std::iter::once(topic).chain(input.field.fields.iter().map(String::as_str)).collect();
        let path = path.join(".");
        Some(match (&input.text, &evidence.condition) {
            (Some(TextTest::Is(text)), _) => format!("{path} == {}", quoted(text)),
            (_, sesame_plan::Condition::Compare { right: sesame_plan::Expression::Constant(integrity), .. }) => {
                format!("{path} == {integrity}")
            }
            _ => path,
        })
    }

    fn demand(&mut self, monitor: EddiId, at: usize) -> CertificatePart {
        let demand = &self.space.eddis[monitor].demands[at];
        let name = &demand.declaration.name;
        let other = &self.space.eddis[demand.eddi];
        let demanded = other.guarantees.iter().position(|guarantee| guarantee.declaration.name == *name);
        let demanded = demanded.expect("a demand names a guarantee of the other monitor");
        let repeated = !self.seen.insert((demand.eddi, demanded));
        let strong = if repeated { 0 } else { demanded + 1 };
        let parts = (0..strong).map(|at| self.guarantee(demand.eddi, at)).collect();
        let part = CertificatePart::new(PartKind::Demand, Some(name), parts);
        CertificatePart { from: Some(other.declaration.name.clone()), repeated, ..part }
    }

    /// The definition with its name at this place, and how it is written.
    fn written(&self, name: Span) -> Option<(&'a Definition, &'a str)> {
        let definition = self.index.definitions.iter().find(|definition| definition.span == name)?;
        Some((definition, self.sources.snippet(definition.full_span)))
    }
}

/// A text of the language on one line, without comments.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(|line| match line.split_once("//") {
        Some((code, _)) if !code.contains('"') => code,
        _ => line,
    });
    let lines = lines.map(|line| {
        if line.contains('"') { line.trim().to_owned() } else { line.split_whitespace().collect::<Vec<_>>().join(" ") }
    });
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// A certificate as text, one line for each part.
pub(crate) fn text(certificate: &CertificatePart) -> String {
    let by = if certificate.kind == PartKind::ExternalMonitor { ", decided by the system" } else { "" };
    let mut text = format!("certificate{by}\n");
    for part in &certificate.parts {
        write_part(&mut text, 1, part);
    }
    text
}

fn write_part(text: &mut String, depth: usize, part: &CertificatePart) {
    let name = part.name.as_deref().unwrap_or_default();
    let says = |before: &str| part.says.as_ref().map(|says| format!("{before}{says}")).unwrap_or_default();
    let line = match part.kind {
        PartKind::Monitor | PartKind::ExternalMonitor => name.to_owned(),
        PartKind::Guarantee => format!("{name} (integrity {})", part.integrity.unwrap_or_default()),
        PartKind::And => "and".to_owned(),
        PartKind::Or => "or".to_owned(),
        PartKind::AtLeast => format!("{} of {}", part.needs.unwrap_or_default(), part.parts.len()),
        PartKind::Evidence => format!("{name}{}", says(": ")),
        PartKind::Demand => {
            let more = match (part.repeated, part.parts.len()) {
                (true, _) => ", as above",
                (false, 0 | 1) => "",
                (false, _) => ", or a stronger guarantee",
            };
            format!("{name} from {}{more}", part.from.as_deref().unwrap_or_default())
        }
        PartKind::SafeState => format!("{name} otherwise{}", says(": ")),
    };
    writeln!(text, "{:width$}{line}", "", width = 2 * depth).expect("a string takes all text");
    for inner in &part.parts {
        write_part(text, depth + 1, inner);
    }
}

#[cfg(test)]
mod tests {
    use sesame_dsl::analyse;

    use super::*;

    fn explained(space: &str, name: &str) -> CertificatePart {
        let mut sources = SourceMap::new();
        let root = sources.add("a.sesame", space);
        let analysis = analyse(&sources, root);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let span = space.eddis.values().find(|eddi| eddi.declaration.name == name).unwrap().declaration.span;
        certificate(&space, &sources, &analysis.index, span).unwrap()
    }

    const MONITORS: &str = include_str!("../../sesame-dsl/tests/good/monitors.sesame");

    #[test]
    fn a_certificate_leads_from_guarantees_to_evidence_also_of_other_monitors() {
        insta::assert_snapshot!(text(&explained(MONITORS, "transport")));
    }

    #[test]
    fn an_external_monitor_shows_what_says_its_state() {
        let texts = ["conveyor", "controller", "reliability"].map(|name| text(&explained(MONITORS, name)));
        insta::assert_snapshot!(texts.join("\n"));
    }

    #[test]
    fn the_page_on_the_command_shows_a_certificate_as_it_is_printed() {
        let space =
            "space s system { simulator sim = in_process \"a::A\" { step 1s } topic pressure = \"p\" : real[bar]
            topic speed = \"v\" : real[m/s] topic stop = \"stop\" : bool topic a = \"a\" : int topic b = \"b\" : int }
            eddi transport publishes a {
              demand    stopped from eddi conveyor
              evidence  brakes_ok = pressure >= 4bar held 100ms  stale after 200ms is false
              guarantee fast  integrity 2 = brakes_ok and stopped
              guarantee slow  integrity 1 = brakes_ok
              otherwise halted  mitigate with stop = true
            }
            eddi conveyor publishes b {
              evidence  still = speed < 1cm/s
              guarantee stopped integrity 1 = still
              otherwise rolls
            }";
        let shown = text(&explained(space, "transport"));
        assert!(include_str!("../../docs/sesamec.md").contains(&shown), "{shown}");
    }

    #[test]
    fn a_certificate_is_also_data() {
        insta::assert_snapshot!(serde_json::to_string_pretty(&explained(MONITORS, "transport")).unwrap());
    }

    #[test]
    fn what_is_demanded_again_is_listed_once_and_conditions_of_several_lines_become_one() {
        let mut space = "space s system { simulator sim = in_process \"a::A\" { step 1s } topic a = \"a\" : real \
                         topic t = \"t\" : text topic s0 = \"s0\" : int\n"
            .to_owned();
        let mut monitors = "eddi m0 publishes s0 { evidence e = a > 1 // high\n  and t != \"a  //  b\" held 1s\n \
                            evidence f = a > 0 guarantee h0 integrity 2 = e guarantee g0 integrity 1 = e or f \
                            otherwise o }\n"
            .to_owned();
        for (before, at) in (0..20).zip(1..) {
            write!(space, " topic s{at} = \"s{at}\" : int").unwrap();
            let demands = format!("demand g{before} from eddi m{before} demand h{before} from eddi m{before}");
            let strong = format!("guarantee h{at} integrity 2 = h{before} and g{before}");
            let weak = format!("guarantee g{at} integrity 1 = g{before} or h{before}");
            writeln!(monitors, "eddi m{at} publishes s{at} {{ {demands} {strong} {weak} otherwise o }}").unwrap();
        }
        let space = format!("{space} }}\n{monitors}");
        let text = text(&explained(&space, "m20"));
        assert!(text.contains("e: a > 1 and t != \"a  //  b\" held 1s\n"), "{text}");
        assert!(text.lines().count() < 300, "{}", text.lines().count());
        assert!(
            text.contains("g19 from m19, or a stronger guarantee") && text.contains("h19 from m19, as above"),
            "{text}"
        );
    }
}
