"""Drives a ROS 2 example in lock-step without Sesame, as a reference for what a runner should see.

Starts the nodes of the example, resets the simulator, steps it, and waits after each step until every controller has
answered. Prints one line of JSON per run: a digest of all states, answers and measurements, what the metrics of the
example say, and how fast it went.

    venv/bin/python drive.py iiwa_cell --runs 2 --seconds 10
    venv/bin/python drive.py iiwa_cell --relay --bias /right/joint_states 0 -0.3 --from 2 --until 5

With `--relay` the topics that controllers answer and their answers pass through this program, as those that a test
disturbs pass through a runner, and nodes are asked whether they have what passes this program by. Then runs must print
the same digest. Without it they need not: an answer reaches this program and the simulator at different moments, so a
step may begin before the simulator has it.
"""

import argparse
import hashlib
import json
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from geometry_msgs.msg import PoseStamped, Twist
from rcl_interfaces.srv import GetParameters
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header
from std_srvs.srv import Trigger

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
ROBOTS = range(1, 7)


class Example:
    """What has to be known about an example: its nodes, its topics, and which topic answers which."""

    def __init__(self, name: str) -> None:
        self.folder = EXAMPLES / name
        if name == "iiwa_cell":
            self.simulator = ["cell.py", "--lock-step"]
            self.controllers = [["controller.py", "--arm", arm] for arm in ("left", "right")]
            self.services = "/cell"
            self.asked = ["/left_controller", "/right_controller"]
            self.period = 0.02
            self.states = {f"/{arm}/joint_states": JointState for arm in ("left", "right")}
            self.answers = {f"/{arm}/joint_commands": JointState for arm in ("left", "right")}
            self.measures = ["/cell/distance", *(f"/workers/{w}/distance" for w in "ab"), "/left/part", "/right/part"]
        else:
            self.simulator = ["fleet.py", "--lock-step"]
            self.controllers = [["planner.py"]]
            self.services = "/fleet"
            self.asked = []
            self.period = 0.1
            self.states = {f"/robot_{i}/pose": PoseStamped for i in ROBOTS} | {"/fleet/tick": Header}
            self.answers = {f"/robot_{i}/cmd_vel": Twist for i in ROBOTS}
            self.measures = ["/fleet/distance", "/fleet/collisions", "/fleet/arrived"]


class Disturbance:
    """What the relay does to one topic in a window of time."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.begin, self.end = options.begin, options.until
        self.bias = (options.bias[0], int(options.bias[1]), float(options.bias[2])) if options.bias else None
        self.delay = (options.delay[0], float(options.delay[1])) if options.delay else None
        self.loss = (options.loss[0], float(options.loss[1])) if options.loss else None
        self.luck = random.Random(1)

    def apply(self, topic: str, kind: type, raw: bytes, now: float) -> tuple[bytes | None, float]:
        """Returns what is left of a message, and when it is released."""
        if not self.begin <= now < self.end:
            return raw, now
        if self.loss and re.fullmatch(self.loss[0], topic) and self.luck.random() < self.loss[1]:
            return None, now
        if self.bias and re.fullmatch(self.bias[0], topic):
            message = deserialize_message(raw, kind)
            if kind is PoseStamped:
                axis = "xyz"[self.bias[1]]
                setattr(message.pose.position, axis, getattr(message.pose.position, axis) + self.bias[2])
            else:
                message.position[self.bias[1]] += self.bias[2]
            raw = serialize_message(message)
        late = self.delay[1] if self.delay and re.fullmatch(self.delay[0], topic) else 0.0
        return raw, now + late


class Driver:
    """A node that steps an example."""

    def __init__(self, example: Example, relay: bool, disturbance: Disturbance) -> None:
        self.example, self.relay, self.disturbance = example, relay, disturbance
        self.node = rclpy.create_node("driver", enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        deep = QoSProfile(depth=1000)
        self.now = 0.0
        self.received: dict[str, list[bytes]] = {}
        self.publishers, self.subscriptions = {}, []
        cut = example.states | example.answers
        for topic, kind in {**cut, **dict.fromkeys(example.measures, Float64)}.items():
            is_cut = relay and topic in cut
            self.received[topic] = []
            self.subscriptions.append(
                self.node.create_subscription(
                    kind, topic + "/undisturbed" * is_cut, self.received[topic].append, deep, raw=True
                )
            )
            if is_cut:
                self.publishers[topic] = self.node.create_publisher(kind, topic, deep)
        self.step_service = self.node.create_client(Trigger, f"{example.services}/step")
        self.reset_service = self.node.create_client(Trigger, f"{example.services}/reset")
        # What passes this program by is there when a node has answered a question that was asked after it was sent.
        self.questions = [
            self.node.create_client(GetParameters, f"{name}/get_parameters")
            for name in (example.services, *example.asked)
        ]

    def spin_until(self, done, seconds: float = 120.0) -> None:
        """Handles messages until a condition holds."""
        if not self.spin(done, seconds):
            counts = {topic: len(messages) for topic, messages in self.received.items()}
            sys.exit(f"drive.py: nothing more came at {self.now:.2f} s; received {counts}")

    def spin(self, done, seconds: float) -> bool:
        """Handles messages until a condition holds, which this returns, or for so long."""
        until = time.monotonic() + seconds
        while not done():
            if time.monotonic() > until:
                return False
            self.executor.spin_once(0.1)
        return True

    def call(self, client) -> None:
        """Calls a service and waits for its answer."""
        future = client.call_async(client.srv_type.Request())
        self.spin_until(future.done)

    def ask(self, clients: list) -> None:
        """Waits until nodes have handled what was sent to them before."""
        for client in clients:
            self.call(client)

    def match(self) -> None:
        """Waits until all nodes have found each other."""
        for client in (self.step_service, self.reset_service, *self.questions):
            if not client.wait_for_service(timeout_sec=120.0):
                sys.exit("drive.py: the simulator offers no service")
        node = self.node
        ends = "/undisturbed" if self.relay else ""

        def complete() -> bool:
            """Everything has its publisher and all its subscribers."""
            for topic in (*self.example.states, *self.example.answers):
                if node.count_publishers(topic + ends) < 1 or node.count_subscribers(topic) < (1 if self.relay else 2):
                    return False
            return all(publisher.get_subscription_count() >= 1 for publisher in self.publishers.values())

        self.spin_until(complete)
        # The nodes may take a moment longer to find each other than we to find them. Whoever has not found all others
        # answers no step, so steps are taken until everybody answers one; the first run begins with a reset.
        for _ in range(12):
            self.call(self.reset_service)
            self.clear()
            self.call(self.step_service)
            if self.spin(self.is_answered, 10.0):
                return
        sys.exit("drive.py: not all nodes answer a step")

    def clear(self) -> None:
        """Forgets what has come."""
        for messages in self.received.values():
            messages.clear()

    def is_answered(self) -> bool:
        """Whether each controller has answered the first step, whose states are passed on to them as they come."""
        received = self.received
        if self.relay:
            for topic in self.example.states:
                while received[topic]:
                    self.publishers[topic].publish(received[topic].pop(0))
        return all(received[topic] for topic in self.example.answers)

    def run(self, seconds: float, list_topic: str | None = None) -> dict:
        """Runs one test from time zero."""
        self.call(self.reset_service)
        self.disturbance.luck.seed(1)
        held: list[tuple[float, str, bytes]] = []
        digest = hashlib.sha256()
        measured: dict[str, list[float]] = {topic: [] for topic in self.example.measures}
        self.clear()
        steps = round(seconds / self.example.period)
        begin = time.monotonic()
        for number in range(1, steps + 1):
            self.now = number * self.example.period
            self.call(self.step_service)
            self.spin_until(lambda: all(self.received[topic] for topic in self.example.states))
            if self.relay:
                self.ask(self.questions[1:])  # of the distance between the arms
            delivered = 0
            for topic in self.example.states:
                raw = self.received[topic].pop(0)
                digest.update(raw)
                delivered += self.pass_on(topic, raw, held)
            by_tick = "/fleet/tick" in self.example.states
            expected = delivered if self.relay and not by_tick else len(self.example.answers)
            self.spin_until(lambda: sum(len(self.received[of]) for of in self.example.answers) >= expected)
            for topic in self.example.answers:
                for raw in self.received[topic]:
                    digest.update(raw)
                    if self.relay:
                        self.publishers[topic].publish(raw)
                self.received[topic].clear()
            if self.relay and self.example.asked:
                # Of the zone: those who ask for it, who grants it, and those who are answered.
                self.ask([*self.questions[1:], self.questions[0], *self.questions[1:]])
            for topic in self.example.measures:
                for raw in self.received[topic]:
                    digest.update(raw)
                    measured[topic].append(struct.unpack_from("<d", raw, 4)[0])
                self.received[topic].clear()
        wall = time.monotonic() - begin
        listed = {}
        if list_topic:
            listed = {"values": [struct.pack(">d", value).hex() for value in measured[list_topic]]}
        summary = {
            topic: values and {"count": len(values), "min": round(min(values), 4), "last": round(values[-1], 4)}
            for topic, values in measured.items()
        }
        measures = {"steps_per_second": round(steps / wall), "wall": round(wall, 2)}
        return {"digest": digest.hexdigest(), **measures, **summary, **listed}

    def pass_on(self, topic: str, raw: bytes, held: list) -> int:
        """Relays a message and what is due of those held back; returns how many were released."""
        if not self.relay:
            return 0
        left, due = self.disturbance.apply(topic, self.example.states[topic], raw, self.now)
        if left is not None:
            last = max((time_of for time_of, of, _ in held if of == topic), default=due)
            held.append((max(due, last), topic, left))
        ready = [item for item in held if item[1] == topic and item[0] <= self.now + 1e-9]
        for item in ready:
            held.remove(item)
            self.publishers[topic].publish(item[2])
        return len(ready)


def main() -> None:
    """Starts the nodes, runs, and ends them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("example", choices=["iiwa_cell", "fleet"])
    parser.add_argument("--python", help="the Python with which the nodes run; this one by default")
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated seconds of each run")
    parser.add_argument("--relay", action="store_true", help="cut the topics of controllers and pass on their messages")
    parser.add_argument("--bias", nargs=3, metavar=("TOPIC", "INDEX", "VALUE"), help="TOPIC is a regular expression")
    parser.add_argument("--delay", nargs=2, metavar=("TOPIC", "SECONDS"))
    parser.add_argument("--loss", nargs=2, metavar=("TOPIC", "SHARE"))
    parser.add_argument("--list", metavar="TOPIC", help="also print all measurements on this topic, bit for bit")
    parser.add_argument("--from", dest="begin", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--until", type=float, default=1e9, metavar="SECONDS")
    options = parser.parse_args()
    if (options.bias or options.delay or options.loss) and not options.relay:
        parser.error("only --relay can disturb messages")

    example = Example(options.example)
    python = options.python or sys.executable
    cut = []
    if options.relay:
        for topic in (*example.states, *example.answers):
            cut.append((topic, f"{topic}:={topic}/undisturbed"))
    with tempfile.TemporaryDirectory() as logs:
        os.environ.setdefault("ROS_LOG_DIR", logs)
        nodes = []
        try:
            for command in [example.simulator, *example.controllers]:
                own = example.states if command is example.simulator else example.answers
                remap = [part for topic, rule in cut if topic in own for part in ("-r", rule)]
                arguments = ["--ros-args", *remap] if remap else []
                nodes.append(subprocess.Popen([python, *command, *arguments], cwd=example.folder))
            rclpy.init()
            driver = Driver(example, options.relay, Disturbance(options))
            driver.match()
            for _ in range(options.runs):
                print(json.dumps(driver.run(options.seconds, options.list)), flush=True)
        finally:
            for node in nodes:
                node.terminate()
            for node in nodes:
                try:
                    node.wait(5)
                except subprocess.TimeoutExpired:
                    node.kill()
                    print(f"drive.py: {node.args[1]} did not end by itself", file=sys.stderr)


if __name__ == "__main__":
    main()
