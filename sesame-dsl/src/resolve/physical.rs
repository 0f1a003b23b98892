//! Physical labs.

use std::collections::BTreeMap;

use super::ros2::is_of_ros;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::physical::{Fit, Form, LabBudget, LabCost, Physical, RankOrder, Shape, ShapePlace};
use crate::model::{Dimension, Domain, Id as _, MetricId, Parameter, Simulator, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::physical as written;
use crate::syntax::ast::{self, Name, Quantity};
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn physicals(&mut self) -> Vec<Option<Physical>> {
        let file = self.file;
        file.physicals.iter().map(|lab| self.physical(lab)).collect()
    }

    fn physical(&mut self, lab: &'a written::Physical) -> Option<Physical> {
        self.own_names(lab);
        let simulator = match self.single(&lab.simulators, "simulator") {
            Some(simulator) => self.lab_simulator(simulator).map(Some),
            None => Some(None),
        };
        let repeats = match self.single(&lab.repeats, "repeats") {
            Some(repeats) => self.count(*repeats, 1, "the number of repetitions"),
            None => Some(1),
        };
        let cost = match self.single(&lab.costs, "cost") {
            Some((base, each)) => self.cost(base, each.as_ref()),
            None => Some(LabCost { base: 1.0, per_operation: 0.0 }),
        };
        let exclude: Vec<_> = lab.excludes.iter().map(|(name, bound)| self.bound(name, bound)).collect();
        let rank = match self.single(&lab.ranks, "rank by") {
            Some(keys) => self.rank(keys),
            None => Some(vec![]),
        };
        let budget = match self.single(&lab.budgets, "budget") {
            Some(budget) => self.budget(budget).map(Some),
            None => Some(None),
        };
        let tolerance = match self.single(&lab.tolerances, "tolerance") {
            Some(tolerances) => self.tolerance(tolerances),
            None => Some(vec![]),
        };
        let interlock = match self.single(&lab.interlocks, "interlock") {
            Some(names) => self.find_all(names, Kind::Metric),
            None => Some(vec![]),
        };
        let shapes: Vec<_> = lab.shapes.iter().map(|shape| self.shape(shape)).collect();
        let fits = match self.single(&lab.fits, "fit") {
            Some(fits) => fits.iter().map(|fit| self.fit(fit)).collect::<Vec<_>>().into_iter().collect(),
            None => Some(vec![]),
        };
        Some(Physical {
            declaration: self.declaration(&lab.head),
            simulator: simulator?,
            repeats: repeats?,
            cost: cost?,
            exclude: exclude.into_iter().collect::<Option<_>>()?,
            rank: rank?,
            budget: budget?,
            tolerance: tolerance?,
            interlock: interlock?.into_iter().map(MetricId::from_index).collect(),
            shapes: shapes.into_iter().collect::<Option<_>>()?,
            fits: fits?,
        })
    }

    /// The names inside a lab are local to it, and each is defined once.
    fn own_names(&mut self, lab: &'a written::Physical) {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let simulators = lab.simulators.iter().map(|(_, simulator)| &simulator.head.name);
        for name in simulators.chain(lab.shapes.iter().map(|shape| &shape.head.name)) {
            if let Some(&before) = first.get(name.text.as_str()) {
                let title = format!("`{}` is defined twice in lab `{}`", name.text, lab.head.name.text);
                self.defined_twice(title, name.span, before);
            }
            first.entry(&name.text).or_insert(name.span);
        }
    }

    /// The simulator in a lab's place: as that of a system, but no part of the runner.
    fn lab_simulator(&mut self, simulator: &'a ast::Simulator) -> Option<Simulator> {
        let resolved = self.simulator(simulator);
        let transport = simulator.transport.as_ref()?;
        let (title, label) = if transport.kind.properties().in_runner {
            let label = "a Rust type is part of the runner; write a program around it, and reach that with `process`";
            ("a lab is reached from outside", label)
        } else if is_of_ros(transport) && !self.has_ros_types() {
            let label =
                "name the ROS type of each topic's message, for example `message Twist = \"geometry_msgs/msg/Twist\"`";
            ("a lab of ROS needs topics of ROS", label)
        } else {
            return resolved;
        };
        self.report(Diagnostic::new(Code::BAD_LAB, simulator.head.name.span, title).label(label));
        None
    }

    /// Whether each topic carries a message with a ROS type, as far as that is known.
    fn has_ros_types(&self) -> bool {
        self.system.topics.iter().flatten().all(|topic| match topic.ty {
            Type::Message(id) => {
                self.system.messages[id.index()].as_ref().is_none_or(|message| message.interface.is_some())
            }
            _ => false,
        })
    }

    /// A plain number, 0 or more.
    fn not_negative(&mut self, quantity: &Quantity, unit: Option<&Unit>, what: &str) -> Option<f64> {
        let value = self.value(quantity, unit, what)?;
        if value >= 0.0 {
            return Some(value);
        }
        let title = format!("`{}` is out of range for {what}", self.text(quantity.span));
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, quantity.span, title).label("expected 0 or more"));
        None
    }

    fn cost(&mut self, base: &Quantity, each: Option<&Quantity>) -> Option<LabCost> {
        let per_operation = match each {
            Some(each) => self.not_negative(each, None, "the cost of an operation"),
            None => Some(0.0),
        };
        let cost =
            LabCost { base: self.not_negative(base, None, "the cost of a test")?, per_operation: per_operation? };
        if cost.base + cost.per_operation > 0.0 {
            return Some(cost);
        }
        let title = "the cost of a test must be greater than 0";
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, base.span, title).label("expected more than 0"));
        None
    }

    fn rank(&mut self, keys: &'a [(Name, written::RankOrder)]) -> Option<Vec<(MetricId, RankOrder)>> {
        self.once(keys.iter().map(|(name, _)| name));
        let found = keys.iter().map(|(name, order)| {
            let index = self.find(name, Kind::Metric)?;
            let order = match order {
                written::RankOrder::Ascending => RankOrder::Ascending,
                written::RankOrder::Descending => RankOrder::Descending,
                written::RankOrder::ClosestTo(value) => {
                    let unit = self.metrics[index].as_ref()?.unit.clone();
                    let what = format!("a value of `{}`", name.text);
                    RankOrder::ClosestTo { value: self.value(value, unit.as_ref(), &what)? }
                }
            };
            Some((MetricId::from_index(index), order))
        });
        found.collect::<Vec<_>>().into_iter().collect()
    }

    /// Reports names that are listed twice.
    pub(super) fn once(&mut self, names: impl Iterator<Item = &'a Name>) {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        for name in names {
            if let Some(&before) = first.get(name.text.as_str()) {
                self.listed_twice(name.span, before);
            }
            first.entry(&name.text).or_insert(name.span);
        }
    }

    fn budget(&mut self, budget: &'a written::Budget) -> Option<LabBudget> {
        let mut complete = true;
        let limit = self.value(&budget.limit, None, "the budget");
        if limit.is_some_and(|limit| limit <= 0.0) {
            let title = "the budget must be greater than 0";
            self.report(Diagnostic::new(Code::OUT_OF_RANGE, budget.limit.span, title).label("expected more than 0"));
            complete = false;
        }
        let lambda = self.value(&budget.lambda, None, "`lambda`");
        if lambda.is_some_and(|lambda| !(0.0..=1.0).contains(&lambda)) {
            let title = format!("`{}` is out of range for `lambda`", self.text(budget.lambda.span));
            self.report(Diagnostic::new(Code::OUT_OF_RANGE, budget.lambda.span, title).label("expected 0 to 1"));
            complete = false;
        }
        self.once(budget.over.iter());
        let over: Vec<_> = budget.over.iter().map(|name| self.dimension(name)).collect();
        complete.then_some(())?;
        Some(LabBudget { limit: limit?, lambda: lambda?, over: over.into_iter().collect::<Option<_>>()? })
    }

    /// A dimension of the reduced test space.
    pub(super) fn dimension(&mut self, name: &Name) -> Option<Dimension> {
        let found = Dimension::named(&name.text);
        if found.is_none() {
            let title = format!("no dimension named `{}`", name.text);
            let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("unknown dimension").note(
                "the dimensions are `T1`, `T2`, `T3` (timing), `P1`, `P2` (parameters), `O0`, `O1`, `O2` and `O3` \
                 (operations)",
            );
            self.report(match most_similar(&name.text, Dimension::ALL.map(Dimension::name)) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None => diagnostic,
            });
        }
        found
    }

    fn tolerance(&mut self, tolerances: &'a [(Name, Quantity)]) -> Option<Vec<(MetricId, f64)>> {
        self.once(tolerances.iter().map(|(name, _)| name));
        let found = tolerances.iter().map(|(name, quantity)| {
            let index = self.find(name, Kind::Metric)?;
            let unit = self.metrics[index].as_ref()?.unit.clone();
            let what = format!("the tolerance of `{}`", name.text);
            Some((MetricId::from_index(index), self.not_negative(quantity, unit.as_ref(), &what)?))
        });
        found.collect::<Vec<_>>().into_iter().collect()
    }

    fn shape(&mut self, shape: &'a written::Shape) -> Option<Shape> {
        let metre = metre();
        let form = match &shape.form {
            written::Form::Sphere(radius) => self.positive(radius, &metre, "the radius of a sphere").map(Form::Sphere),
            written::Form::Box(edges) => self.vector(edges, true).map(Form::Box),
        };
        let place = match &shape.place {
            written::ShapePlace::Carried(pose) => self.plain_text(pose).map(ShapePlace::Pose),
            written::ShapePlace::Fixed(point) => self.vector(point, false).map(ShapePlace::Point),
        };
        let expand = match &shape.expand {
            Some(expand) => self.not_negative(expand, Some(&metre), "the margin of a shape"),
            None => Some(0.0),
        };
        Some(Shape { declaration: self.declaration(&shape.head), form: form?, place: place?, expand: expand? })
    }

    /// A text that is shown on terminals and compared with names in recordings: no control characters.
    fn plain_text(&mut self, text: &'a ast::Text) -> Option<String> {
        // An empty text was reported where it was read.
        let Some(c) = text.text.chars().find(|c| c.is_control()) else { return Some(text.text.clone()) };
        let diagnostic =
            Diagnostic::new(Code::BAD_TEXT, text.span, format!("this text contains the control character {c:?}"))
                .label("expected visible characters and spaces");
        self.report(diagnostic);
        None
    }

    /// Three lengths, in metres.
    fn vector(&mut self, point: &'a ast::Point, positive: bool) -> Option<[f64; 3]> {
        let metre = metre();
        let what = if positive { "an edge of a box" } else { "a coordinate" };
        let lengths = self.coordinates(point, Some(&metre), what)?;
        let mut complete = true;
        if positive {
            for edge in &point.coordinates {
                complete &= self.positive(edge, &metre, what).is_some();
            }
        }
        complete.then_some(lengths)
    }

    fn fit(&mut self, fit: &'a written::Fit) -> Option<Fit> {
        match fit {
            written::Fit::Delay(targets, range) => {
                let topic = match self.at_most_one_topic(targets) {
                    Some(Some(target)) => self.whole_messages(target, "a relay delays").and_then(|found| {
                        self.of_all_members(&found, target.span)?;
                        Some(Some(found.topic))
                    }),
                    Some(None) => Some(None),
                    None => None,
                };
                let delay = self.times(range, "the delay of a relay");
                Some(Fit::RelayDelay(topic?, delay?))
            }
            written::Fit::Relay { rule, targets, amounts } => {
                let target = self.at_most_one_topic(targets)??;
                let span = target.span;
                let (target, kind, parameters) = self.plain(target, *rule, Some(amounts))?;
                self.of_all_members(&target, span)?;
                match parameters.as_slice() {
                    [Parameter { domain: Domain::Number { range, .. }, .. }] => {
                        Some(Fit::Relay { kind, target, range: *range })
                    }
                    _ => unreachable!("a scale, a bias and a noise of numbers have one parameter"),
                }
            }
            written::Fit::Parameter(name, range) => {
                let plain = self.plain_text(name);
                let permitted = self.range(range, None, &format!("parameter \"{}\"", name.text))?;
                Some(Fit::Parameter(plain?, permitted))
            }
        }
    }
}

impl<'a> Resolver<'a> {
    /// What is written of the one topic that is meant, if one is written. `None` was reported.
    #[expect(clippy::option_option, reason = "the outer one is for what was reported")]
    pub(super) fn at_most_one_topic(&mut self, targets: &'a [ast::Target]) -> Option<Option<&'a ast::Target>> {
        let [first, second, ..] = targets else { return Some(targets.first()) };
        let title = format!("`{}` and `{}` are on different topics", self.text(second.span), self.text(first.span));
        self.report(Diagnostic::new(Code::WRONG_TYPE, second.span, title).label("expected one topic"));
        None
    }
}

fn metre() -> Unit {
    Unit::parse("m").expect("`m` is in the table")
}
