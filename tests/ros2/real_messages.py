"""Messages of ROS with random content, serialised by rclpy, and what rclpy reads of samples.

    venv/bin/python real_messages.py write --seed 1     one line of JSON per sample: `type`, `cdr`, `fields`
    venv/bin/python real_messages.py read               the same, of lines with `type` and `cdr` on standard input

`cdr` is in hexadecimal digits. A real is `{"real": …}` with the digits of its bits as float64.
"""

import argparse
import array
import importlib
import importlib.util
import json
import random
import re
import struct
import sys

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

TYPES = """
    geometry_msgs/msg/PointStamped geometry_msgs/msg/PoseArray geometry_msgs/msg/PoseWithCovarianceStamped
    geometry_msgs/msg/PolygonStamped geometry_msgs/msg/TransformStamped geometry_msgs/msg/TwistStamped
    geometry_msgs/msg/WrenchStamped sensor_msgs/msg/JoyFeedbackArray sensor_msgs/msg/MagneticField
    sensor_msgs/msg/MultiEchoLaserScan sensor_msgs/msg/Range sensor_msgs/msg/TimeReference
    nav_msgs/msg/MapMetaData nav_msgs/msg/OccupancyGrid nav_msgs/msg/Odometry
    nav_msgs/msg/Path sensor_msgs/msg/BatteryState sensor_msgs/msg/CameraInfo sensor_msgs/msg/Image
    sensor_msgs/msg/Imu sensor_msgs/msg/JointState sensor_msgs/msg/Joy sensor_msgs/msg/LaserScan
    sensor_msgs/msg/NavSatFix sensor_msgs/msg/PointCloud2 trajectory_msgs/msg/JointTrajectory
    trajectory_msgs/msg/MultiDOFJointTrajectory
""".split()
INTEGERS = {f"{sign}int{bits}": (bits, sign == "") for bits in (8, 16, 32, 64) for sign in ("", "u")}
LETTERS = "abcxyz_/0129 äß€𝄞"


def message_type(name: str) -> type:
    """The class of a type."""
    package, *_, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


def is_there(name: str) -> bool:
    """Whether the environment has the package of a type."""
    return importlib.util.find_spec(name.split("/")[0]) is not None


def item(kind: str, luck: random.Random):
    """A random value of a type."""
    if "/" in kind:
        return fill(message_type(kind), luck)
    if kind == "boolean":
        return luck.random() < 0.5
    if kind.startswith("string"):
        return "".join(luck.choice(LETTERS) for _ in range(luck.randrange(9)))
    if kind in ("double", "float"):
        real = luck.choice([luck.uniform(-1e3, 1e3), 0.0, -0.0, float("inf"), 1e30])
        return real if kind == "double" else float(np.float32(real))
    if kind == "octet":
        return bytes([luck.randrange(256)])
    bits, signed = INTEGERS[kind]
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    return luck.choice([low, luck.randint(low, min(high, 2**63 - 1))])


def fill(kind: type, luck: random.Random):
    """A random message of a class."""
    message = kind()
    for name, of in kind.get_fields_and_field_types().items():
        if sequence := re.fullmatch(r"sequence<([^,]*)(?:, (\d+))?>", of):
            count = luck.randrange(min(int(sequence[2] or 4), 4) + 1)
            setattr(message, name, [item(sequence[1], luck) for _ in range(count)])
        elif fixed := re.fullmatch(r"(.*)\[(\d+)\]", of):
            setattr(message, name, [item(fixed[1], luck) for _ in range(int(fixed[2]))])
        elif of == "builtin_interfaces/Time" or of == "builtin_interfaces/Duration":
            stamp = message_type(of)(sec=luck.randint(-(2**31), 2**31 - 1), nanosec=luck.randrange(10**9))
            setattr(message, name, stamp)
        else:
            setattr(message, name, item(of, luck))
    return message


def shown(value):
    """A value as JSON."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: shown(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        return [shown(one) for one in value]
    if isinstance(value, (float, np.floating)):
        return {"real": struct.pack(">d", value).hex()}
    if isinstance(value, np.integer):
        return int(value)
    return value[0] if isinstance(value, bytes) else value


def main() -> None:
    """Reads or writes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["write", "read"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=3, help="how many samples of each type (default: 3)")
    options = parser.parse_args()
    if options.part == "write":
        for name in filter(is_there, TYPES):
            for number in range(options.each):
                message = fill(message_type(name), random.Random(f"{name} {options.seed} {number}"))
                line = {"type": name, "cdr": bytes(serialize_message(message)).hex(), "fields": shown(message)}
                print(json.dumps(line))
    else:
        for line in map(json.loads, sys.stdin):
            message = deserialize_message(bytes.fromhex(line["cdr"]), message_type(line["type"]))
            print(json.dumps({**line, "fields": shown(message)}))


if __name__ == "__main__":
    main()
