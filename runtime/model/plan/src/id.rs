//! Ids: positions in the lists of a plan.

use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The position in the plan's list of these.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// A message type: position in [`crate::CampaignPlan::messages`].
    MessageId
);
id!(
    /// A topic, or a group of topics: position in [`crate::CampaignPlan::topics`].
    TopicId
);
id!(
    /// A node: position in [`crate::CampaignPlan::nodes`].
    NodeId
);
id!(
    /// A runtime monitor: position in [`crate::CampaignPlan::monitors`].
    MonitorId
);
id!(
    /// A metric: position in [`crate::CampaignPlan::metrics`].
    MetricId
);
id!(
    /// A fuzzing operation: position in [`crate::CampaignPlan::operations`].
    OperationId
);
id!(
    /// A known test: position in [`crate::CampaignPlan::tests`].
    KnownTestId
);
id!(
    /// A requirement: position in [`crate::CampaignPlan::requirements`].
    RequirementId
);
