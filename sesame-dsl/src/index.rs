//! What a space declares and where it is mentioned, by place: for showing a thing with all its uses, and for editors.
//!
//! The index is made from the syntax alone, before names mean anything. So it is there for a file with errors as well,
//! with all of it that could be read: names that resolve, and names that do not.

pub(crate) mod build;

use crate::similar::most_similar;
use crate::span::Span;

/// The definitions and references of a space.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Index {
    /// In the order of declarations: those of an imported file stand before those of the file that imports it.
    pub definitions: Vec<Definition>,
    /// Sorted by place. A name of the language itself, such as a dimension or a function, is not one.
    pub references: Vec<Reference>,
    /// Names that constructs with syntax errors, or of later versions, were about to declare, as far as can be told.
    pub unread: Vec<(String, Span)>,
}

/// The position of a [`Definition`] in its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DefinitionId(pub usize);

/// Something with a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Where the name stands.
    pub span: Span,
    /// The whole declaration, from its first word to its last, without its doc comment.
    pub full_span: Span,
    /// Its doc comment; empty when there is none.
    pub doc: String,
    /// What it belongs to, if its name is known inside of that only: the message of a field, for example.
    pub owner: Option<DefinitionId>,
}

/// A place where something is mentioned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Where the name stands.
    pub span: Span,
    /// What it stands for: the first definition of the name, of any kind. `None` if there is none.
    pub target: Option<DefinitionId>,
    /// The declaration that mentions it.
    pub within: DefinitionId,
}

/// What a name can stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The space itself.
    Space,
    /// A simulator, of the system or of a lab.
    Simulator,
    /// A message type.
    Message,
    /// A field of a message type.
    Field,
    /// A topic, or a group of topics.
    Topic,
    /// A service.
    Service,
    /// An action of ROS 2.
    Action,
    /// A node.
    Node,
    /// A metric.
    Metric,
    /// A requirement.
    Requirement,
    /// An operation.
    Operation,
    /// A parameter of a custom operation.
    Parameter,
    /// A test of the file.
    Test,
    /// A campaign.
    Campaign,
    /// A runtime monitor.
    Monitor,
    /// What a monitor demands of another.
    Demand,
    /// Evidence of a monitor.
    Evidence,
    /// A guarantee of a monitor, or what holds otherwise.
    Guarantee,
    /// A physical lab.
    Lab,
    /// A body in a lab.
    Shape,
}

impl Kind {
    /// The word for it in a sentence.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Space => "space",
            Kind::Simulator => "simulator",
            Kind::Message => "message",
            Kind::Field => "field",
            Kind::Topic => "topic",
            Kind::Service => "service",
            Kind::Action => "action",
            Kind::Node => "node",
            Kind::Metric => "metric",
            Kind::Requirement => "requirement",
            Kind::Operation => "operation",
            Kind::Parameter => "parameter",
            Kind::Test => "test",
            Kind::Campaign => "campaign",
            Kind::Monitor => "monitor",
            Kind::Demand => "demand",
            Kind::Evidence => "evidence",
            Kind::Guarantee => "guarantee",
            Kind::Lab => "lab",
            Kind::Shape => "shape",
        }
    }

    pub(crate) fn with_article(self) -> String {
        let article = if matches!(self, Kind::Action | Kind::Operation | Kind::Evidence) { "an" } else { "a" };
        format!("{article} {}", self.word())
    }
}

impl Index {
    /// The definition of an id of this index.
    pub fn definition(&self, id: DefinitionId) -> &Definition {
        &self.definitions[id.0]
    }

    /// The definitions that a name can stand for, in the order of declarations. `owner.name` is what belongs to an
    /// owner, or the field of what a topic carries; a name alone is that of a declaration of the space, if there is
    /// one, otherwise of anything that belongs to one.
    pub fn find(&self, name: &str) -> Vec<DefinitionId> {
        let ids = || (0..self.definitions.len()).map(DefinitionId);
        if let Some((owner, member)) = name.rsplit_once('.') {
            let owners: Vec<_> = self.find(owner).into_iter().flat_map(|owner| self.scopes(owner)).collect();
            return ids()
                .filter(|&id| {
                    let found = self.definition(id);
                    found.name == member && found.owner.is_some_and(|its| owners.contains(&its))
                })
                .collect();
        }
        let (declared, owned): (Vec<_>, Vec<_>) =
            ids().filter(|&id| self.definition(id).name == name).partition(|&id| self.definition(id).owner.is_none());
        if declared.is_empty() { owned } else { declared }
    }

    /// Where the members of a definition are declared: in itself, and in the message type of a topic or field.
    fn scopes(&self, of: DefinitionId) -> Vec<DefinitionId> {
        let Definition { kind, full_span: Span { file, lo, hi }, .. } = *self.definition(of);
        let mut scopes = vec![of];
        if matches!(kind, Kind::Topic | Kind::Field) {
            let inside = self
                .references
                .iter()
                .filter(|reference| reference.span.file == file && lo <= reference.span.lo && reference.span.hi <= hi);
            let messages = inside.filter_map(|reference| reference.target);
            scopes.extend(messages.filter(|&id| self.definition(id).kind == Kind::Message));
        }
        scopes
    }

    /// The name by which [`Index::find`] finds a definition: with its owner's if it has one.
    pub fn full_name(&self, id: DefinitionId) -> String {
        let Definition { name, owner, .. } = self.definition(id);
        owner.map_or_else(|| name.clone(), |owner| format!("{}.{name}", self.full_name(owner)))
    }

    /// The name that looks most like one that is not there: with its owner's if that one has a dot.
    pub fn most_similar(&self, name: &str) -> Option<String> {
        let ids = (0..self.definitions.len()).map(DefinitionId);
        let known: Vec<String> = if name.contains('.') {
            ids.map(|id| self.full_name(id)).collect()
        } else {
            ids.map(|id| self.definition(id).name.clone()).collect()
        };
        most_similar(name, known.iter().map(String::as_str)).map(str::to_owned)
    }

    /// Where a definition is mentioned, by place.
    pub fn uses(&self, id: DefinitionId) -> impl Iterator<Item = &Reference> {
        self.references.iter().filter(move |reference| reference.target == Some(id))
    }
}
