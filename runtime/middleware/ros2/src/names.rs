//! Names of ROS 2 as they are in DDS, on which the middlewares of ROS agree.

/// The name of a topic in DDS.
pub(crate) fn topic(path: &str) -> String {
    format!("rt{path}")
}

/// The name of the topic of a service's requests in DDS.
pub(crate) fn request(service: &str) -> String {
    format!("rq{service}Request")
}

/// The name of the topic of a service's replies in DDS.
pub(crate) fn reply(service: &str) -> String {
    format!("rr{service}Reply")
}

/// The name of an interface's type in DDS: `sensor_msgs/msg/Image` is `sensor_msgs::msg::dds_::Image_`.
pub(crate) fn type_name(interface: &str) -> String {
    let (package, name) = interface.rsplit_once('/').unwrap_or(("", interface));
    format!("{}::dds_::{name}_", package.replace('/', "::"))
}

/// The name of the interface with this type in DDS; `None` for types that are none of ROS's.
pub(crate) fn interface(type_name: &str) -> Option<String> {
    let (package, name) = type_name.split_once("::dds_::")?;
    Some(format!("{}/{}", package.replace("::", "/"), name.strip_suffix('_')?))
}

/// What a topic of DDS is in ROS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Topic,
    Request,
    Reply,
}

/// What a topic of DDS is in ROS, with its name there; `None` for one that is none of ROS's.
pub(crate) fn in_ros(topic: &str) -> Option<(Kind, &str)> {
    if let Some(path) = topic.strip_prefix("rt/") {
        return Some((Kind::Topic, &topic[topic.len() - path.len() - 1..]));
    }
    if let Some(path) = topic.strip_prefix("rq").and_then(|path| path.strip_suffix("Request")) {
        return path.starts_with('/').then_some((Kind::Request, path));
    }
    let path = topic.strip_prefix("rr").and_then(|path| path.strip_suffix("Reply"))?;
    path.starts_with('/').then_some((Kind::Reply, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_dds_are_those_of_the_middlewares_and_read_back() {
        assert_eq!(topic("/arm/state"), "rt/arm/state");
        assert_eq!(request("/arm/grip"), "rq/arm/gripRequest");
        assert_eq!(type_name("sensor_msgs/msg/JointState"), "sensor_msgs::msg::dds_::JointState_");
        assert_eq!(type_name("std_srvs/srv/SetBool_Request"), "std_srvs::srv::dds_::SetBool_Request_");
        assert_eq!(interface("std_srvs::srv::dds_::SetBool_Request_").as_deref(), Some("std_srvs/srv/SetBool_Request"));
        assert_eq!(interface("SetBool"), None);
        assert_eq!(in_ros("rt/arm/state"), Some((Kind::Topic, "/arm/state")));
        assert_eq!(in_ros("rq/arm/gripRequest"), Some((Kind::Request, "/arm/grip")));
        assert_eq!(in_ros(&reply("/arm/grip")), Some((Kind::Reply, "/arm/grip")));
        assert_eq!(in_ros("ros_discovery_info"), None);
    }
}
