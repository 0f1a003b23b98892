//! A simulator of everything that a space declares, for the tests across crates: publishes a plain value on every path,
//! and hears what it published.
//!
//! The plan of its campaign is the file that the environment variable `PLAN` names.

use sesame_runtime::message::record;
use sesame_runtime::plan::{CampaignPlan, Type};
use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_runtime::value::Value;

pub struct Anything(Vec<(Port, Value)>);

fn plain(plan: &CampaignPlan, ty: &Type) -> Value {
    match ty {
        Type::Bool => Value::Bool(true),
        Type::Int { .. } => Value::Int(1),
        Type::Real { .. } => Value::Real(1.0),
        Type::Text => Value::Text("text".into()),
        Type::Point { .. } => Value::Point([1.0, 2.0, 3.0]),
        Type::List { of } => Value::List([plain(plan, of)].into_iter().collect()),
        Type::Message { id } => {
            let fields = &plan.message(*id).fields;
            let fields: Vec<(&str, Value)> =
                fields.iter().map(|field| (field.name.as_str(), plain(plan, &field.ty))).collect();
            record(&fields)
        }
    }
}

impl Simulator for Anything {
    fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let file = std::env::var("PLAN").expect("the test names the plan");
        let plan = std::fs::read_to_string(file).map_err(|error| SimulatorError(error.to_string()))?;
        let plan: CampaignPlan = serde_json::from_str(&plan).map_err(|error| SimulatorError(error.to_string()))?;
        let paths = plan.topics.iter().flat_map(|topic| topic.paths.iter().map(|path| (path, &topic.ty)));
        let ports = paths.map(|(path, ty)| (bus.open(path), plain(&plan, ty))).collect::<Vec<_>>();
        ports.iter().for_each(|(port, _)| bus.subscribe(*port));
        Ok(Anything(ports))
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        for (port, value) in &self.0 {
            bus.publish(*port, value.clone());
            while bus.receive(*port).is_some() {}
        }
        Ok(Progress::Running)
    }
}
