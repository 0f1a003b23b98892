//! From syntax to the index: first all definitions, then what mentions them.
//!
//! Files are taken apart field by field where they hold names, so that a new one cannot be forgotten.

mod declaration;

use std::collections::{BTreeMap, BTreeSet};

use super::{Definition, DefinitionId, Index, Kind, Reference};
use crate::clocks::clock_of;
use crate::import::Merged;
use crate::span::{FileId, Span};
use crate::syntax::ast::eddi::Eddi;
use crate::syntax::ast::physical::Physical;
use crate::syntax::ast::{
    self, Bound, ComparedWith, Expression, ExpressionKind, Head, Name, Operation, OperationKind, Path, Step, System,
    Type, TypeKind,
};

/// Makes the index of what was read.
pub(crate) fn index(merged: &Merged) -> Index {
    let ast::File {
        spaces,
        imports: _,
        systems,
        metrics,
        requirements,
        operations,
        tests,
        campaigns,
        eddis,
        physicals,
        undeclared,
        has_errors: _,
        incomplete: _,
    } = &merged.file;
    let mut indexer = Indexer::default();
    // Definitions come first: what is mentioned may be declared later.
    for head in spaces {
        indexer.declare(Kind::Space, head);
    }
    let systems: Vec<_> = systems.iter().map(|system| (system, indexer.declare_system(system))).collect();
    let metrics: Vec<_> = metrics.iter().map(|metric| (metric, indexer.declare(Kind::Metric, &metric.head))).collect();
    let requirements: Vec<_> = requirements
        .iter()
        .map(|requirement| (requirement, indexer.declare(Kind::Requirement, &requirement.head)))
        .collect();
    let operations: Vec<_> =
        operations.iter().map(|operation| (operation, indexer.declare_operation(operation))).collect();
    let tests: Vec<_> = tests.iter().map(|test| (test, indexer.declare(Kind::Test, &test.head))).collect();
    let campaigns: Vec<_> =
        campaigns.iter().map(|campaign| (campaign, indexer.declare(Kind::Campaign, &campaign.head))).collect();
    let eddis: Vec<_> = eddis.iter().map(|eddi| (eddi, indexer.declare_eddi(eddi))).collect();
    let physicals: Vec<_> = physicals.iter().map(|physical| (physical, indexer.declare_physical(physical))).collect();
    indexer.settle(&merged.ranks);

    for (system, ids) in &systems {
        indexer.system(system, ids);
    }
    for (metric, id) in metrics {
        indexer.metric(metric, id);
    }
    for (requirement, id) in requirements {
        indexer.mention_bounded(&requirement.metric, &requirement.bound, id);
    }
    for (operation, id) in operations {
        indexer.operation(operation, id);
    }
    for (test, id) in tests {
        indexer.test(test, id);
    }
    for (campaign, id) in campaigns {
        indexer.campaign(campaign, id);
    }
    for (eddi, id) in eddis {
        indexer.eddi(eddi, id);
    }
    for (physical, id) in physicals {
        indexer.physical(physical, id);
    }
    let mut index = indexer.sorted(&merged.ranks);
    index.unread = undeclared.iter().map(|name| (name.text.clone(), name.span)).collect();
    index
}

/// The ids of what a system declares, in the order of its lists.
struct SystemIds {
    simulators: Vec<DefinitionId>,
    messages: Vec<DefinitionId>,
    topics: Vec<DefinitionId>,
    nodes: Vec<DefinitionId>,
}

#[derive(Default)]
struct Indexer<'a> {
    index: Index,
    /// The first definition of each name that the whole space knows.
    names: BTreeMap<&'a str, DefinitionId>,
    /// The names that are known inside of a definition only.
    members: BTreeMap<(DefinitionId, &'a str), DefinitionId>,
    /// The types of topics and fields.
    types: BTreeMap<DefinitionId, &'a Type>,
    /// Messages with a type of ROS.
    of_ros: BTreeSet<DefinitionId>,
    /// The operations that are parameters of the space.
    scenes: BTreeSet<DefinitionId>,
    /// The names of constants that messages declare.
    constants: BTreeSet<&'a str>,
    /// The names of the space, which are not settled before all are there.
    heads: Vec<(&'a Name, DefinitionId)>,
}

impl<'a> Indexer<'a> {
    fn add(
        &mut self,
        kind: Kind,
        name: &'a Name,
        full_span: Span,
        doc: &str,
        owner: Option<DefinitionId>,
    ) -> DefinitionId {
        let id = DefinitionId(self.index.definitions.len());
        self.index.definitions.push(Definition {
            name: name.text.clone(),
            kind,
            span: name.span,
            full_span,
            doc: doc.to_owned(),
            owner,
        });
        id
    }

    /// A name that the whole space knows.
    fn declare(&mut self, kind: Kind, head: &'a Head) -> DefinitionId {
        let id = self.add(kind, &head.name, head.full_span, &head.doc, None);
        if kind != Kind::Space {
            self.heads.push((&head.name, id));
        }
        id
    }

    /// A name that is known inside of its owner only.
    fn declare_member(&mut self, kind: Kind, head: &'a Head, owner: DefinitionId) -> DefinitionId {
        let id = self.add(kind, &head.name, head.full_span, &head.doc, Some(owner));
        self.members.entry((owner, &head.name.text)).or_insert(id);
        id
    }

    fn declare_system(&mut self, system: &'a System) -> SystemIds {
        let System { simulators, messages, topics, services, actions, nodes, .. } = system;
        let simulators = simulators.iter().map(|simulator| self.declare(Kind::Simulator, &simulator.head)).collect();
        let mut message_ids = Vec::new();
        for message in messages {
            let id = self.declare(Kind::Message, &message.head);
            message_ids.push(id);
            if message.ros_type.is_some() {
                self.of_ros.insert(id);
            }
            self.constants.extend(message.constants.iter().map(|constant| constant.name.text.as_str()));
            for field in &message.fields {
                let field_id = self.declare_member(Kind::Field, &field.head, id);
                self.types.insert(field_id, &field.ty);
            }
        }
        let mut topic_ids = Vec::new();
        for topic in topics {
            let id = self.declare(Kind::Topic, &topic.head);
            self.types.insert(id, &topic.ty);
            topic_ids.push(id);
        }
        for service in services {
            self.declare(Kind::Service, &service.head);
            self.declare(Kind::Topic, &service.request);
            self.declare(Kind::Topic, &service.reply);
        }
        for action in actions {
            self.declare(Kind::Action, &action.head);
            for part in &action.parts {
                self.declare(Kind::Topic, part);
            }
        }
        let nodes = nodes.iter().map(|node| self.declare(Kind::Node, &node.head)).collect();
        SystemIds { simulators, messages: message_ids, topics: topic_ids, nodes }
    }

    fn declare_operation(&mut self, operation: &'a Operation) -> DefinitionId {
        let id = self.declare(Kind::Operation, &operation.head);
        if let OperationKind::Scene(_) = &operation.body.kind {
            self.scenes.insert(id);
        }
        if let OperationKind::Custom(custom) = &operation.body.kind {
            for parameter in &custom.parameters {
                let full_span = parameter.name.span.to(parameter.span);
                let parameter_id = self.add(Kind::Parameter, &parameter.name, full_span, &parameter.doc, Some(id));
                self.members.entry((id, &parameter.name.text)).or_insert(parameter_id);
            }
        }
        id
    }

    fn declare_eddi(&mut self, eddi: &'a Eddi) -> DefinitionId {
        let Eddi { head, state: _, demands, evidence, guarantees, otherwise, has_errors: _ } = eddi;
        let id = self.declare(Kind::Monitor, head);
        let demands = demands.iter().map(|demand| (Kind::Demand, &demand.head));
        let evidence = evidence.iter().map(|item| (Kind::Evidence, &item.head));
        let guarantees = guarantees.iter().map(|guarantee| (Kind::Guarantee, &guarantee.head));
        let otherwise = otherwise.iter().map(|(_, otherwise)| (Kind::Guarantee, &otherwise.head));
        for (kind, head) in demands.chain(evidence).chain(guarantees).chain(otherwise) {
            self.declare_member(kind, head, id);
        }
        id
    }

    fn declare_physical(&mut self, lab: &'a Physical) -> DefinitionId {
        let id = self.declare(Kind::Lab, &lab.head);
        for (_, simulator) in &lab.simulators {
            self.declare_member(Kind::Simulator, &simulator.head, id);
        }
        for shape in &lab.shapes {
            self.declare_member(Kind::Shape, &shape.head, id);
        }
        id
    }

    /// The first of several definitions of one name counts, as in resolution.
    fn settle(&mut self, ranks: &BTreeMap<FileId, usize>) {
        let mut heads = std::mem::take(&mut self.heads);
        heads.sort_by_key(|(name, _)| (ranks.get(&name.span.file).copied(), name.span));
        for (name, id) in heads {
            self.names.entry(&name.text).or_insert(id);
        }
    }

    // ----- references

    fn refer(&mut self, span: Span, target: Option<DefinitionId>, within: DefinitionId) {
        self.index.references.push(Reference { span, target, within });
    }

    fn mention(&mut self, name: &'a Name, within: DefinitionId) -> Option<DefinitionId> {
        let target = self.names.get(name.text.as_str()).copied();
        self.refer(name.span, target, within);
        target
    }

    /// A metric, or a part of a monitor, with the monitor's name before a dot.
    fn mention_metric(&mut self, name: &'a Name, within: DefinitionId) {
        let Some((monitor, part)) = name.text.split_once('.') else {
            self.mention(name, within);
            return;
        };
        let dot = name.span.lo + u32::try_from(monitor.len()).expect("files are small");
        let target = self.names.get(monitor).copied();
        self.refer(Span { hi: dot, ..name.span }, target, within);
        let part = target.and_then(|monitor| self.members.get(&(monitor, part)).copied());
        self.refer(Span { lo: dot + 1, ..name.span }, part, within);
    }

    /// A metric, and the constant that bounds it.
    fn mention_bounded(&mut self, metric: &'a Name, bound: &'a Bound, within: DefinitionId) {
        self.mention_metric(metric, within);
        if let Bound::Constant(_, constant) = bound {
            self.path(constant, within);
        }
    }

    /// A part of a monitor, if a path is one: what is before its dot is a monitor.
    fn part(&mut self, path: &'a Path, within: DefinitionId) -> bool {
        let monitor = self.names.get(path.topic.text.as_str()).copied();
        let is_monitor = |id: &DefinitionId| self.index.definitions[id.0].kind == Kind::Monitor;
        let (Some(monitor), Some(part)) = (monitor.filter(is_monitor), path.part()) else { return false };
        self.mention(&path.topic, within);
        let part_id = self.members.get(&(monitor, part.text.as_str())).copied();
        self.refer(part.span, part_id, within);
        true
    }

    fn mention_all(&mut self, lists: &'a [(Span, Vec<Name>)], within: DefinitionId) {
        for name in lists.iter().flat_map(|(_, names)| names) {
            self.mention(name, within);
        }
    }

    /// A field of what a topic or field carries.
    fn field(&mut self, of: Option<DefinitionId>, name: &'a Name, within: DefinitionId) -> Option<DefinitionId> {
        let mut ty = self.types.get(&of?).copied();
        while let Some(TypeKind::List(inner)) = ty.map(|ty| &ty.kind) {
            ty = Some(inner);
        }
        let target = match &ty?.kind {
            TypeKind::Message(message) => {
                let message = self.names.get(message.text.as_str()).copied();
                let member = message.and_then(|message| self.members.get(&(message, name.text.as_str())).copied());
                // Only resolution knows what a type of ROS holds in addition to the fields of its block.
                if member.is_none() && message.is_some_and(|message| self.of_ros.contains(&message)) {
                    return None;
                }
                member
            }
            _ => None,
        };
        self.refer(name.span, target, within);
        target
    }

    /// Whether a path is the name of a constant: one that a message declares or, since definitions in files are not
    /// read here, a word in capital letters that names nothing else.
    fn is_constant(&self, path: &Path) -> bool {
        let name = path.topic.text.as_str();
        path.is_name() && !self.names.contains_key(name) && (self.constants.contains(name) || in_capitals(name))
    }

    fn path(&mut self, path: &'a Path, within: DefinitionId) {
        if self.part(path, within) || self.is_constant(path) {
            return;
        }
        let mut target = self.mention(&path.topic, within);
        let of_message = target.is_some_and(|target| self.index.definition(target).kind == Kind::Message);
        if of_message && path.fields.len() == 1 {
            // `Battery.LOW` is a constant.
            return;
        }
        for step in &path.elements {
            if let Step::Filter(filter) = step
                && let ComparedWith::Constant(constant) = &filter.with
            {
                self.path(constant, within);
            }
        }
        let mut outer = None;
        let fields = path.fields.iter().map(|name| Some((name, None)));
        let steps = path.elements.iter().map(|step| match step {
            Step::Field(name) => Some((name, None)),
            Step::Filter(filter) => filter.key.first().map(|name| (name, Some(&filter.key[1..]))),
            Step::Element(..) | Step::Elements(..) | Step::Each(_) => None,
        });
        for (name, key) in fields.chain(steps).flatten() {
            if self.is_point(target) {
                // Its coordinates are words of the language.
                return;
            }
            let Some(inner) = key else {
                outer = target;
                target = self.field(target, name, within);
                continue;
            };
            // The key of a filter is a field of the elements, or a list beside theirs.
            let of = if self.has_field(target, name) { target } else { outer };
            let mut of = self.field(of, name, within);
            for name in inner {
                if self.is_point(of) {
                    break;
                }
                of = self.field(of, name, within);
            }
        }
    }

    fn is_point(&self, of: Option<DefinitionId>) -> bool {
        let ty = of.and_then(|of| self.types.get(&of));
        ty.is_some_and(|ty| matches!(ty.kind, TypeKind::Point))
    }

    /// Whether what a topic or field carries has a field of this name.
    fn has_field(&self, of: Option<DefinitionId>, name: &Name) -> bool {
        let mut ty = of.and_then(|of| self.types.get(&of)).copied();
        while let Some(TypeKind::List(inner)) = ty.map(|ty| &ty.kind) {
            ty = Some(inner);
        }
        let Some(TypeKind::Message(message)) = ty.map(|ty| &ty.kind) else { return false };
        let message = self.names.get(message.text.as_str());
        message.is_some_and(|&message| self.members.contains_key(&(message, name.text.as_str())))
    }

    fn type_of(&mut self, ty: &'a Type, within: DefinitionId) {
        let mut ty = ty;
        while let TypeKind::List(inner) = &ty.kind {
            ty = inner;
        }
        if let TypeKind::Message(name) = &ty.kind {
            self.mention(name, within);
        }
    }

    fn expression(&mut self, expression: &'a Expression, within: DefinitionId) {
        match &expression.kind {
            ExpressionKind::Number(_)
            | ExpressionKind::Truth(_)
            | ExpressionKind::Text(_)
            | ExpressionKind::Point(_)
            | ExpressionKind::Region(_) => {}
            ExpressionKind::Field(path) if path.is_name() => {
                // Inside of a monitor its own names come first.
                let own = self.members.get(&(within, path.topic.text.as_str())).copied();
                // The time is a word of the language, unless something is named like it.
                let is_clock = clock_of(path).is_some_and(|clock| !self.names.contains_key(clock.word));
                match own {
                    Some(own) => self.refer(path.topic.span, Some(own), within),
                    None if is_clock => {}
                    None => self.path(path, within),
                }
            }
            ExpressionKind::Field(path) | ExpressionKind::Members(_, _, path) => self.path(path, within),
            ExpressionKind::Negate(of) | ExpressionKind::Prefixed(_, of) => self.expression(of, within),
            ExpressionKind::Sum(parts) | ExpressionKind::Product(parts) => {
                for (_, part) in parts {
                    self.expression(part, within);
                }
            }
            ExpressionKind::All(parts)
            | ExpressionKind::Any(parts)
            | ExpressionKind::AtLeast(_, parts)
            | ExpressionKind::Call(_, parts) => {
                for part in parts {
                    self.expression(part, within);
                }
            }
            ExpressionKind::Compare(left, _, right)
            | ExpressionKind::Until(left, _, right)
            | ExpressionKind::Implies(left, right) => {
                self.expression(left, within);
                self.expression(right, within);
            }
        }
    }

    // ----- order

    /// The index with its definitions in the order of declarations, and its references by place.
    fn sorted(self, ranks: &BTreeMap<FileId, usize>) -> Index {
        let Index { definitions, mut references, unread } = self.index;
        let place = |span: Span| (ranks.get(&span.file).copied(), span);
        let mut order: Vec<usize> = (0..definitions.len()).collect();
        order.sort_by_key(|&at| place(definitions[at].span));
        let mut now = vec![0; order.len()];
        for (at, &before) in order.iter().enumerate() {
            now[before] = at;
        }
        let moved = |id: DefinitionId| DefinitionId(now[id.0]);
        for reference in &mut references {
            reference.target = reference.target.map(moved);
            reference.within = moved(reference.within);
        }
        references.sort_by_key(|reference| place(reference.span));
        let mut sorted: Vec<(usize, Definition)> = now.iter().copied().zip(definitions).collect();
        sorted.sort_by_key(|(at, _)| *at);
        let definitions = sorted
            .into_iter()
            .map(|(_, definition)| Definition { owner: definition.owner.map(moved), ..definition })
            .collect();
        Index { definitions, references, unread }
    }
}

/// Whether a name is written like a constant: `STATUS_OK`.
fn in_capitals(name: &str) -> bool {
    name.bytes().any(|byte| byte.is_ascii_uppercase()) && !name.bytes().any(|byte| byte.is_ascii_lowercase())
}
