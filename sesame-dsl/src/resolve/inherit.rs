//! `campaign x from y`: the clauses that a campaign does not write itself, before anything is resolved.

use std::collections::BTreeMap;

use super::words::list;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{ActivationMode, Campaign, Exploration, ExplorationKind, File};

/// Copies inherited clauses. A clause that a campaign writes replaces the inherited one as a whole; `search`, `repeat`
/// and `passive` count as one clause here, and clauses of a search are not copied to a campaign without one.
///
/// A base that does not exist is left for resolution to report.
pub(super) fn inherit(file: &mut File, diagnostics: &mut Vec<Diagnostic>) {
    let mut positions: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, campaign) in file.campaigns.iter().enumerate() {
        positions.entry(&campaign.head.name.text).or_insert(index);
    }
    let bases = file.campaigns.iter().map(|campaign| positions.get(campaign.from.as_ref()?.text.as_str()).copied());
    let mut bases: Vec<Option<usize>> = bases.collect();
    let mut done = vec![false; bases.len()];
    for start in 0..bases.len() {
        let mut chain = Vec::new();
        let mut next = Some(start);
        while let Some(index) = next.filter(|&index| !done[index]) {
            if let Some(at) = chain.iter().position(|&before| before == index) {
                let cycle = chain[at..].to_vec();
                diagnostics.push(cycle_of(file, &cycle));
                for &member in &cycle {
                    bases[member] = None;
                }
                break;
            }
            chain.push(index);
            next = bases[index];
        }
        for &index in chain.iter().rev() {
            match bases[index] {
                Some(base) => {
                    let [child, base] =
                        file.campaigns.get_disjoint_mut([index, base]).expect("no campaign is its base");
                    hand_down(base, child);
                }
                // What is inherited is unknown, so nothing is reported as missing.
                None if file.campaigns[index].from.is_some() => {
                    file.campaigns[index].has_errors = true;
                    file.campaigns[index].inherited_errors = true;
                }
                None => {}
            }
            done[index] = true;
        }
    }
}

fn cycle_of(file: &File, cycle: &[usize]) -> Diagnostic {
    let name = |index: usize| &file.campaigns[index].head.name;
    let first = name(cycle[0]);
    let title = if cycle.len() == 1 {
        format!("campaign `{}` inherits from itself", first.text)
    } else {
        let through: Vec<&str> = cycle[1..].iter().map(|&index| name(index).text.as_str()).collect();
        format!("campaign `{}` inherits from itself through {}", first.text, list(&through))
    };
    let last = cycle[cycle.len() - 1];
    let closes = file.campaigns[last].from.as_ref().map_or(first.span, |from| from.span);
    let diagnostic = Diagnostic::new(Code::CIRCLE, closes, title).label("this closes the cycle");
    if cycle.len() == 1 { diagnostic } else { diagnostic.secondary(first.span, "declared here") }
}

/// Whether a campaign itself says where its tests come from.
fn finds(campaign: &Campaign) -> bool {
    !(campaign.searches.is_empty() && campaign.repeats.is_empty() && campaign.passives.is_empty())
}

fn hand_down(base: &Campaign, child: &mut Campaign) {
    let own = finds(child);
    if !own {
        child.searches.clone_from(&base.searches);
        child.repeats.clone_from(&base.repeats);
        child.passives.clone_from(&base.passives);
    }
    // One that also repeats or observes is wrong as it is; what it would inherit for a search is not its mistake.
    let searches = !child.searches.is_empty() && child.repeats.is_empty() && child.passives.is_empty();
    // What is missing in the base was reported there.
    child.has_errors |= base.has_errors || !own || searches != base.searches.is_empty();
    child.inherited_errors |= base.inherited_errors;
    if child.observes.is_empty() {
        child.observes.clone_from(&base.observes);
    }
    if child.records.is_empty() {
        child.records.clone_from(&base.records);
    }
    if child.ends.is_empty() {
        child.ends.clone_from(&base.ends);
        child.inherited.end = true;
    }
    if searches || !own {
        if child.objectives.is_empty() {
            child.objectives.clone_from(&base.objectives);
        }
        if child.operations.is_empty() {
            child.operations.clone_from(&base.operations);
            child.inherited.operations = true;
        }
        if child.activates.is_empty() {
            child.activates.clone_from(&base.activates);
            child.inherited.activate = true;
        }
        if child.coverages.is_empty() {
            child.coverages.clone_from(&base.coverages);
        }
        if child.explorations.is_empty() {
            child.explorations =
                base.explorations.iter().filter(|exploration| suits(exploration, child)).cloned().collect();
        }
        if child.confirms.is_empty() {
            child.confirms.clone_from(&base.confirms);
        }
        if child.stops.is_empty() {
            child.stops.clone_from(&base.stops);
        }
    }
}

/// Whether a campaign can explore like its base. Explorations change an evolution, and except for novelty each works
/// either on time windows or on conditions. If the base itself does not fit, that is reported there.
fn suits(exploration: &Exploration, child: &Campaign) -> bool {
    let evolves =
        child.searches.iter().all(|search| search.strategy.is_none_or(|strategy| strategy.properties().explores));
    let by_condition = child.activates.iter().any(|(_, mode)| matches!(mode, ActivationMode::Condition(_)));
    let novel = exploration.kind == ExplorationKind::Novelty;
    evolves && (novel || by_condition == (exploration.kind == ExplorationKind::Predict))
}
