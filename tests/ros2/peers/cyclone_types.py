"""The types of the peers for Cyclone DDS, named as ROS 2 names them on the wire."""

from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """A point in time."""

    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """The time and the frame of a message."""

    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    """A point in space."""

    x: float64
    y: float64
    z: float64


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    """A text."""

    data: str


@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    """A number."""

    data: float64


@dataclass
class PointStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PointStamped_"):
    """A point at a time."""

    header: Header
    point: Point


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    """The joints of a robot."""

    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


TYPES = {
    "std_msgs/msg/String": String,
    "std_msgs/msg/Float64": Float64,
    "geometry_msgs/msg/PointStamped": PointStamped,
    "sensor_msgs/msg/JointState": JointState,
}


def build(kind: str, values: dict):
    """A message from nested values."""
    if "header" not in values:
        return TYPES[kind](**values)
    header = Header(Time(**values["header"]["stamp"]), values["header"]["frame_id"])
    rest = {name: Point(**value) if name == "point" else value for name, value in values.items() if name != "header"}
    return TYPES[kind](header, **rest)


def quality(best_effort: bool, transient_local: bool, depth: int) -> Qos:
    """The quality of service that the options ask for."""
    return Qos(
        Policy.Reliability.BestEffort if best_effort else Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.TransientLocal if transient_local else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),  # ROS 2 speaks version 1 of CDR only
    )
