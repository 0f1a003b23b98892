"""What the peers that use rclpy share: their options, qualities of service, and how they wait for each other.

Peers say what has happened as lines of JSON, which a test waits for: `up` when their publishers and subscribers are
there, `matched` when somebody is at the other end. Somebody who is matched on one side may need a while to be matched
on the other, so a publisher that is told `probe` sends a message that belongs to nothing, and a subscriber says `heard`
with its number. When all have heard the latest one, nothing that is sent from then on is lost.

A peer says its result together with its exit `code` before it leaves. A middleware may hang while it takes a node down,
and a test of what was exchanged does not depend on that.
"""

import argparse
import importlib
import json
import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def spin(node: Node) -> None:
    """Runs until it is ended."""
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


def add_topic(parser: argparse.ArgumentParser) -> None:
    """Options of a topic."""
    parser.add_argument("--topic", default="/peer", help="the topic (default: /peer)")
    parser.add_argument("--type", default="sensor_msgs/msg/JointState", help="its type, as in PACKAGE/msg/NAME")
    parser.add_argument("--best-effort", action="store_true", help="best effort instead of reliable")
    parser.add_argument("--transient-local", action="store_true", help="transient local instead of volatile")
    parser.add_argument("--depth", type=int, default=1000, help="how many samples are kept (default: 1000)")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds of silence at most (default: 120)")


def quality(options: argparse.Namespace) -> QoSProfile:
    """The quality of service that the options ask for."""
    return QoSProfile(
        depth=options.depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if options.best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if options.transient_local else DurabilityPolicy.VOLATILE,
    )


def message_type(name: str) -> type:
    """The class of a type."""
    package, _, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


def fill(message, values: dict):
    """Sets the fields of a message from nested values and returns it."""
    for name, value in values.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message


def say(**said) -> None:
    """Says something, in a line."""
    print(json.dumps(said), flush=True)


def wait_until(what: str, seconds: float, holds) -> None:
    """Waits for a condition; exits with code 2 if it does not come to hold."""
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            say(error=f"timeout: {what}")
            sys.exit(2)
        time.sleep(0.005)
