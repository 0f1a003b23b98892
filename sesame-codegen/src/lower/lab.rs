//! Labs.

use sesame_dsl::model::physical::{Fit, Form, LabSetting, LabSimulator, Physical, Place, Shape};
use sesame_dsl::model::{self, Space};
use sesame_plan as plan;

use super::id::topic_id;
use super::ros2::ros2;
use super::selection::Selection;

/// How a lab is reached; `None` if it has no simulator, or one of a kind that runners cannot reach.
pub(crate) fn lab_simulator(space: &Space, lab: &Physical) -> Option<plan::Simulator> {
    let LabSimulator { declaration, transport, arguments, settings } = lab.simulator.as_ref()?;
    let setting = |wanted: &str| settings.iter().find(|(name, _)| name == wanted).map(|(_, value)| value);
    let transport = match (transport.as_str(), &arguments[..]) {
        ("process", [program, arguments @ ..]) => {
            let step_ns = match setting("step") {
                Some(LabSetting::Seconds(seconds)) => Some(nanoseconds(*seconds)),
                _ => None,
            };
            plan::Transport::Process { program: program.clone(), arguments: arguments.to_vec(), step_ns }
        }
        // The nodes of the lab are those of the system, in a domain of their own.
        ("ros2", _) if matches!(space.simulator.transport, model::Transport::Ros2 { .. }) => {
            let system = ros2(space);
            let domain = match setting("domain") {
                Some(LabSetting::Count(domain)) => u16::try_from(*domain).ok()?,
                _ => system.domain,
            };
            plan::Transport::Ros2(plan::Ros2 { domain, step: None, reset: None, ..system })
        }
        _ => return None,
    };
    let (name, lifecycle) = (declaration.name.clone(), plan::Lifecycle::default());
    Some(plan::Simulator { name, transport, lifecycle })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a step is positive, and no step lasts years"
)]
fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round().max(1.0) as u64
}

impl Selection {
    pub(super) fn lab(&self, space: &Space, lab: &Physical) -> plan::Lab {
        plan::Lab {
            name: lab.declaration.name.clone(),
            doc: lab.declaration.doc.clone(),
            simulator: lab_simulator(space, lab),
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
            Place::Pose(pose) => plan::ShapePlace::Pose { pose: pose.clone() },
            Place::Point(centre) => plan::ShapePlace::Fixed { centre: *centre },
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
