//! What operations do, for the plan.

use sesame_dsl::model;
use sesame_plan as plan;

pub(super) fn kind(kind: &model::OperationKind) -> plan::OperationKind {
    match kind {
        model::OperationKind::RandomValue { mode, integer } => plan::OperationKind::RandomValue {
            mode: match mode {
                model::ValueMode::Absolute => plan::ValueMode::Absolute,
                model::ValueMode::Offset => plan::ValueMode::Offset,
            },
            integer: *integer,
        },
        model::OperationKind::RandomText { texts } => plan::OperationKind::RandomText { texts: texts.clone() },
        model::OperationKind::StuckAt { truth } => plan::OperationKind::StuckAt { truth: *truth },
        model::OperationKind::Bias => plan::OperationKind::Bias,
        model::OperationKind::Drift => plan::OperationKind::Drift,
        model::OperationKind::Noise => plan::OperationKind::Noise,
        model::OperationKind::Scale => plan::OperationKind::Scale,
        model::OperationKind::NotFinite { number } => plan::OperationKind::NotFinite {
            number: match number {
                model::NotFinite::Nan => plan::NotFinite::Nan,
                model::NotFinite::Infinity => plan::NotFinite::Infinity,
                model::NotFinite::MinusInfinity => plan::NotFinite::MinusInfinity,
            },
        },
        model::OperationKind::Freeze => plan::OperationKind::Freeze,
        model::OperationKind::Stale => plan::OperationKind::Stale,
        model::OperationKind::ClockSkew => plan::OperationKind::ClockSkew,
        model::OperationKind::PacketLoss => plan::OperationKind::PacketLoss,
        model::OperationKind::BurstLoss => plan::OperationKind::BurstLoss,
        model::OperationKind::RateLimit => plan::OperationKind::RateLimit,
        model::OperationKind::Latency { distribution, drain: mode } => plan::OperationKind::Latency {
            distribution: match distribution {
                model::Distribution::Fixed => plan::Distribution::Fixed,
                model::Distribution::Uniform => plan::Distribution::Uniform,
                model::Distribution::Normal => plan::Distribution::Normal,
            },
            drain: drain(*mode),
        },
        model::OperationKind::Reorder { drain: mode } => plan::OperationKind::Reorder { drain: drain(*mode) },
        model::OperationKind::Duplicate => plan::OperationKind::Duplicate,
        model::OperationKind::Blackhole => plan::OperationKind::Blackhole,
        model::OperationKind::Custom { moment: when } => plan::OperationKind::Custom { moment: moment(*when) },
    }
}

fn drain(drain: model::Drain) -> plan::Drain {
    match drain {
        model::Drain::Finish => plan::Drain::Finish,
        model::Drain::Flush => plan::Drain::Flush,
        model::Drain::Drop => plan::Drain::Drop,
    }
}

pub(super) fn moment(moment: model::Moment) -> plan::Moment {
    match moment {
        model::Moment::OnMessage => plan::Moment::OnMessage,
        model::Moment::BeforeStart => plan::Moment::BeforeStart,
        model::Moment::AfterEnd => plan::Moment::AfterEnd,
    }
}
