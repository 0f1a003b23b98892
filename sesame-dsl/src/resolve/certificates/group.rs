//! Monitors that rely on each other, as data that can be checked.

use std::collections::BTreeSet;

use sesame_monitor::check::Values;
use sesame_monitor::gate::{self, Leaf};
use sesame_monitor::truth::Truth;
use sesame_plan as plan;
use sesame_plan::{Gate, MonitorId};

use crate::model::eddi::{Eddi, Evidence};
use crate::model::{Id as _, Topic, Type};
use crate::resolve::SystemPart;
use crate::units::{Unit, product};

/// Monitors without mistakes, in groups that rely on each other: positions, in the order of declarations.
pub(super) fn groups(eddis: &[Option<Eddi>]) -> Vec<Vec<usize>> {
    let demanded = |at: usize| eddis[at].iter().flat_map(|eddi| &eddi.demands).map(|demand| demand.eddi.index());
    let mut sound = vec![false; eddis.len()];
    let mut before = usize::MAX;
    let mut open = eddis.len();
    while open < before {
        before = open;
        for at in 0..eddis.len() {
            if !sound[at] && eddis[at].is_some() && demanded(at).all(|other| sound[other]) {
                sound[at] = true;
                open -= 1;
            }
        }
    }
    let mut group_of: Vec<usize> = (0..eddis.len()).collect();
    let first = |group_of: &[usize], mut at: usize| {
        while group_of[at] != at {
            at = group_of[at];
        }
        at
    };
    for at in (0..eddis.len()).filter(|&at| sound[at]) {
        for other in demanded(at) {
            let (one, other) = (first(&group_of, at), first(&group_of, other));
            group_of[one.max(other)] = one.min(other);
        }
    }
    let mut groups = vec![Vec::new(); eddis.len()];
    for at in (0..eddis.len()).filter(|&at| sound[at]) {
        groups[first(&group_of, at)].push(at);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// A group of monitors.
pub(super) struct Group<'a> {
    /// The positions of its monitors among all.
    pub(super) members: Vec<usize>,
    pub(super) eddis: Vec<&'a Eddi>,
    /// The same as a plan has them, without what a check does not need.
    pub(super) monitors: Vec<plan::Monitor>,
    system: &'a SystemPart,
}

impl<'a> Group<'a> {
    /// A group; `None` if something that it reads has a mistake.
    pub(super) fn of(eddis: &'a [Option<Eddi>], members: Vec<usize>, system: &'a SystemPart) -> Option<Self> {
        let own: Vec<&Eddi> = members.iter().map(|&at| eddis[at].as_ref()).collect::<Option<_>>()?;
        let monitors = own.iter().map(|eddi| planned(eddi, &own, &members)).collect::<Option<_>>()?;
        let group = Group { members, eddis: own, monitors, system };
        let mut inputs =
            group.monitors.iter().flat_map(|monitor| &monitor.evidence).flat_map(|evidence| &evidence.inputs);
        inputs.all(|input| group.value(&input.field).is_some()).then_some(group)
    }

    /// How much work a check may be: pieces of evidence times gates.
    pub(super) fn size(&self) -> usize {
        let gates = self
            .monitors
            .iter()
            .flat_map(|monitor| &monitor.guarantees)
            .map(|guarantee| guarantee.gate.size())
            .sum::<usize>();
        self.monitors.iter().map(|monitor| monitor.evidence.len()).sum::<usize>().saturating_mul(gates)
    }

    fn topic(&self, field: &plan::FieldRef) -> Option<&'a Topic> {
        self.system.topics.get(field.topic.index())?.as_ref()
    }

    /// The type of a field, down to the coordinates of points.
    pub(super) fn value(&self, field: &plan::FieldRef) -> Option<Type> {
        let mut ty = self.topic(field)?.ty.clone();
        for name in &field.path {
            ty = match ty {
                Type::Message(id) => {
                    let message = self.system.messages.get(id.index())?.as_ref()?;
                    message.fields.iter().find(|field| field.declaration.name == *name)?.ty.clone()
                }
                Type::Point(unit) => Type::Real(unit),
                _ => return None,
            };
        }
        Some(ty)
    }

    /// What is known of the values of an input.
    pub(super) fn values(&self, input: &plan::Input) -> Values {
        // What holds of several elements of a list is like what holds of the members of a group.
        let elements = input.list.as_ref().is_some_and(|list| list.reduction != plan::Reduction::First);
        let members = self.topic(&input.field).is_some_and(|topic| topic.paths.len() > 1);
        let group = elements || members && input.only().is_none();
        let range = match self.value(&input.field) {
            Some(Type::Bool) => Values { least: 0.0, greatest: 1.0, whole: true, ..Values::ANY },
            // A sum of whole numbers may be beyond those that a message can carry.
            Some(Type::Int(_)) if input.members == plan::Members::Sum => Values { whole: true, ..Values::ANY },
            Some(Type::Int(_)) => {
                Values { least: i64::MIN as f64, greatest: i64::MAX as f64, whole: true, ..Values::ANY }
            }
            _ => Values::ANY,
        };
        // Rates of whole numbers are not whole, and beyond those that a message can carry.
        let range = if input.memory.iter().all(|of| *of == plan::Memory::Previous) { range } else { Values::ANY };
        Values { group, ..range }
    }

    /// An input as text, and the unit of its numbers.
    pub(super) fn input_text(&self, input: &plan::Input) -> (String, Option<Unit>) {
        let name = self.topic(&input.field).map_or("", |topic| topic.declaration.name.as_str());
        let only = input.only().and_then(|only| self.topic(&input.field)?.members.get(only as usize));
        let name = only.map_or_else(|| name.to_owned(), |member| plan::with_member(name, member));
        let fields = input.field.path.iter().map(String::as_str);
        let path: Vec<&str> = std::iter::once(name.as_str()).chain(fields).collect();
        let steps = input.list.as_ref().map_or(&[][..], |list| &list.steps);
        let path = format!("`{}{}`", path.join("."), plan::value_path_in_words(steps));
        let reduction = input.list.as_ref().map(|list| list.reduction);
        let least = matches!(reduction, None | Some(plan::Reduction::First | plan::Reduction::Min));
        let text = match input.members {
            plan::Members::Min if least && self.values(input).group => format!("the least {path}"),
            plan::Members::Max => format!("the greatest {path}"),
            plan::Members::Sum => format!("the sum of {path}"),
            _ => path,
        };
        let mut text = text;
        let mut unit = match self.value(&input.field) {
            Some(Type::Int(unit) | Type::Real(unit)) => unit,
            _ => None,
        };
        for memory in &input.memory {
            let what = match memory {
                plan::Memory::Previous => "previous value",
                plan::Memory::Unwrapped { .. } => "unwrapped angle",
                plan::Memory::Rate | plan::Memory::Integral => memory.name(),
            };
            text = format!("the {what} of {text}");
            if *memory == plan::Memory::Rate {
                unit = product(unit.as_ref(), Some(&Unit::seconds()), true).and_then(|(unit, _)| unit);
            }
        }
        (text, unit)
    }

    /// The evidence on which a guarantee depends, through demands, in order: monitor and position.
    pub(super) fn evidence_of(&self, monitor: MonitorId, guarantee: u32) -> BTreeSet<(MonitorId, u32)> {
        let mut found = BTreeSet::new();
        let mut seen = BTreeSet::new();
        let mut waiting = vec![(monitor, guarantee)];
        while let Some((monitor, guarantee)) = waiting.pop() {
            if !seen.insert((monitor, guarantee)) {
                continue;
            }
            let declared = &self.monitors[monitor.index()];
            for leaf in leaves(&declared.guarantees[guarantee as usize].gate) {
                match leaf {
                    Leaf::Evidence(at) => _ = found.insert((monitor, at)),
                    Leaf::Demand(at) => {
                        let demand = &declared.demands[at as usize];
                        // A stronger state is as good.
                        waiting.extend((0..=demand.guarantee).map(|strong| (demand.monitor, strong)));
                    }
                }
            }
        }
        found
    }

    /// Whether a guarantee has this value whatever its evidence is, only because all guarantees in `known` have it. A
    /// demand is true if one of the guarantees with which it is content is, and false if all of them are.
    pub(super) fn follows(
        &self,
        (monitor, guarantee): (MonitorId, u32),
        known: &BTreeSet<(MonitorId, u32)>,
        value: Truth,
    ) -> bool {
        let declared = &self.monitors[monitor.index()];
        let free = if value == Truth::True { Truth::False } else { Truth::True };
        let computed = gate::value(&declared.guarantees[guarantee as usize].gate, &|leaf| {
            let Leaf::Demand(at) = leaf else { return free };
            let demand = &declared.demands[at as usize];
            let mut content = (0..=demand.guarantee).map(|strong| known.contains(&(demand.monitor, strong)));
            let has = if value == Truth::True { content.any(|holds| holds) } else { content.all(|holds| holds) };
            if has { value } else { free }
        });
        computed == value
    }
}

/// The evidence and demands of a gate, each once.
pub(super) fn leaves(gate: &Gate) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    let mut waiting = vec![gate];
    while let Some(gate) = waiting.pop() {
        let leaf = match gate {
            Gate::Evidence(at) => Leaf::Evidence(*at),
            Gate::Demand(at) => Leaf::Demand(*at),
            _ => {
                waiting.extend(gate.parts().iter().rev());
                continue;
            }
        };
        if !leaves.contains(&leaf) {
            leaves.push(leaf);
        }
    }
    leaves
}

fn planned(eddi: &Eddi, all: &[&Eddi], members: &[usize]) -> Option<plan::Monitor> {
    let demands = eddi.demands.iter().map(|demand| {
        let name = &demand.declaration.name;
        let at = members.iter().position(|&member| member == demand.eddi.index())?;
        let guarantee = all[at].guarantees.iter().position(|guarantee| guarantee.declaration.name == *name)?;
        let monitor = MonitorId(u32::try_from(at).ok()?);
        Some(plan::Demand { name: name.clone(), monitor, guarantee: u32::try_from(guarantee).ok()? })
    });
    let guarantees = eddi.guarantees.iter().map(|guarantee| plan::Guarantee {
        name: guarantee.declaration.name.clone(),
        doc: String::new(),
        integrity: guarantee.integrity,
        gate: guarantee.gate.clone(),
    });
    Some(plan::Monitor {
        name: eddi.declaration.name.clone(),
        doc: String::new(),
        publishes: None,
        demands: demands.collect::<Option<_>>()?,
        evidence: eddi.evidence.iter().map(evidence).collect(),
        guarantees: guarantees.collect(),
        otherwise: plan::SafeState {
            name: eddi.otherwise.declaration.name.clone(),
            doc: String::new(),
            mitigation: None,
        },
        line: eddi.declaration.line,
    })
}

fn evidence(evidence: &Evidence) -> plan::Evidence {
    let inputs = evidence.inputs.iter().map(|input| plan::Input {
        field: plan::FieldRef {
            topic: plan::TopicId(u32::try_from(input.field.topic.index()).expect("a file has fewer topics than 2^32")),
            path: input.field.fields.clone(),
        },
        members: input.members,
        list: input.list.clone(),
        text: input.text.clone(),
        memory: input.memory.clone(),
    });
    plan::Evidence {
        name: evidence.declaration.name.clone(),
        doc: String::new(),
        inputs: inputs.collect(),
        condition: evidence.condition.clone(),
        held: evidence.held,
        stale: evidence.stale,
        side: if evidence.inbound { plan::Side::Inbound } else { plan::Side::Outbound },
    }
}
