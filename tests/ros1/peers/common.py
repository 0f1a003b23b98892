"""What the peers share: how they begin, and how they say what they saw."""

import importlib
import json
import sys
import time


def start(name):
    """Joins the graph, under a name that ends when asked from outside only; what is left of the arguments."""
    import rospy

    arguments = rospy.myargv(sys.argv)[1:]
    rospy.init_node(name, disable_signals=True)
    return arguments


def cls(name, kind="msg"):
    """The class of a type, `sensor_msgs/JointState`."""
    package, last = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), last)


def await_(what, holds, within=120.0):
    """Waits until something holds."""
    until = time.monotonic() + within
    while not holds():
        if time.monotonic() > until:
            say({"timeout": what})
            sys.exit(1)
        time.sleep(0.01)


def say(said):
    """Prints a line with JSON."""
    print(json.dumps(said), flush=True)


def go():
    """Waits for a line of the standard input."""
    sys.stdin.readline()
