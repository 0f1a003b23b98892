//! How a runner reaches its simulator. Each middleware is a row of one table: its feature, its kind, and the function
//! of its crate that connects.

#[cfg(all(feature = "campaign", feature = "process"))]
use std::path::Path;

#[cfg(all(feature = "campaign", feature = "process"))]
use sesame_plan::SimulatorKind;

pub use sesame_relay::transport::*;

macro_rules! middleware {
    ($($feature:literal $kind:ident $library:ident::$connect:ident,)*) => {
        $(
            #[cfg(feature = $feature)]
            pub use $library::$connect;
        )*

        /// The way to a simulator of a kind, or of programs in this folder; `None` for a kind that this program was
        /// built without, and for one that is a part of the runner.
        #[cfg(all(feature = "campaign", feature = "process"))]
        pub(crate) fn of_kind(kind: SimulatorKind, folder: &Path) -> Option<Connect> {
            match kind {
                SimulatorKind::Process => Some(process(folder.to_owned())),
                $(
                    #[cfg(feature = $feature)]
                    SimulatorKind::$kind => Some($connect(folder.to_owned())),
                )*
                _ => None,
            }
        }

        /// Whether this program was built with a feature that [reaches a kind](sesame_plan::SimulatorProperties).
        pub fn is_built_in(feature: &str) -> bool {
            let built_in = [$(($feature, cfg!(feature = $feature)),)* ("simlog-tls", cfg!(feature = "simlog-tls"))];
            built_in.contains(&(feature, true))
        }
    };
}

middleware! {
    "mavlink" Mavlink sesame_mavlink::mavlink,
    "mqtt" Mqtt sesame_mqtt::mqtt,
    "ros1" Ros1 sesame_ros1::ros1,
    "ros2" Ros2 sesame_ros2::ros2,
    "rosbridge" Rosbridge sesame_rosbridge::rosbridge,
    "simlog" Simlog sesame_simlog::simlog,
}
