//! Labs.

use sesame_dsl::model::physical::{Fit, Form, Physical, Shape, ShapePlace};
use sesame_dsl::model::{self, Space};
use sesame_plan as plan;

use super::id::topic_id;
use super::selection::Selection;
use super::simulator::simulator;

impl Selection {
    pub(super) fn lab(&self, space: &Space, lab: &Physical) -> plan::Lab {
        plan::Lab {
            name: lab.declaration.name.clone(),
            doc: lab.declaration.doc.clone(),
            simulator: lab.simulator.as_ref().map(|of_lab| simulator(space, of_lab)),
            repeats: lab.repeats,
            cost: lab.cost,
            exclude: lab
                .exclude
                .iter()
                .map(|&(metric, bound)| plan::LabExclusion { metric: self.metric(metric), bound })
                .collect(),
            rank: lab
                .rank
                .iter()
                .map(|&(metric, order)| plan::RankKey { metric: self.metric(metric), order })
                .collect(),
            budget: lab.budget.clone(),
            tolerances: lab
                .tolerance
                .iter()
                .map(|&(metric, value)| plan::LabTolerance { metric: self.metric(metric), value })
                .collect(),
            interlock: lab.interlock.iter().map(|&metric| self.metric(metric)).collect(),
            shapes: lab.shapes.iter().map(shape).collect(),
            fits: lab.fits.iter().map(fit).collect(),
        }
    }
}

fn shape(shape: &Shape) -> plan::LabShape {
    plan::LabShape {
        name: shape.declaration.name.clone(),
        doc: shape.declaration.doc.clone(),
        form: match shape.form {
            Form::Sphere(radius) => plan::ShapeForm::Sphere { radius },
            Form::Box(edges) => plan::ShapeForm::Box { edges },
        },
        place: match &shape.place {
            ShapePlace::Pose(pose) => plan::ShapePlace::Pose { pose: pose.clone() },
            ShapePlace::Point(centre) => plan::ShapePlace::Fixed { centre: *centre },
        },
        expand: shape.expand,
    }
}

fn fit(fit: &Fit) -> plan::Fit {
    let (what, range) = match fit {
        Fit::RelayDelay(topic, range) => (plan::Fitted::Delay { topic: topic.map(topic_id) }, range),
        Fit::Relay { kind, target, range } => {
            let values = plan::Values { topic: topic_id(target.topic), places: target.places.clone() };
            let what = match kind {
                model::OperationKind::Scale => plan::Fitted::Scale(values),
                model::OperationKind::Bias => plan::Fitted::Bias(values),
                model::OperationKind::Noise => plan::Fitted::Noise(values),
                _ => unreachable!("a relay is fitted by a scale, a bias or noise"),
            };
            (what, range)
        }
        Fit::Parameter(name, range) => (plan::Fitted::Parameter { name: name.clone() }, range),
    };
    plan::Fit { what, low: range.low, high: range.high }
}
