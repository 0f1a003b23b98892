"""A cell with two KUKA iiwa arms, simulated by MuJoCo or PyBullet, as a ROS 2 node.

The arms face each other over a table and fetch parts from the same feeder in its middle. Each takes torques and
reports its joints; the node also reports how close the arms are to each other, and the tools to the places of two
workers.

In lock-step (`--lock-step`) the service `/cell/step` advances the world by one control period, with the torques
received so far, and answers after all messages of that period are published; `/cell/reset` sets the world to time
zero. Without it, the world runs by the wall clock, `--speed` times as fast.

With `--hall DOMAIN` the node is also the stand-in for a lab: in this ROS domain the engine is PyBullet, and the world
runs by the wall clock, whatever the other options say. It begins only when both controllers have been there for a
moment: nobody resets a hall, so a test that began later would meet the arms somewhere on their way.
"""

import argparse
import os
import sys
import time

import numpy as np
import rclpy
from geometry_msgs.msg import PointStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from arms import ARMS, JOINTS, PERIOD, Physics

NAMES = [f"joint_{i + 1}" for i in range(JOINTS)]
FEEDER = np.array([0.0, 0.0, 0.22])  # where parts are fetched
BOX = {"left": np.array([-0.16, -0.3, 0.3]), "right": np.array([0.16, 0.3, 0.3])}  # where they are put down
AT = 0.06  # metres within which a tool has reached a place
SHARED = 0.28  # metres around the feeder, as seen from above, that only one arm may enter
GATHERING = 2.0  # seconds after which nobody else is expected in the hall; the runner waits for half a second
WORKERS = {  # the places of the workers: two opposite corners
    "a": (np.array([-1.0, -1.5, 0.0]), np.array([0.2, -0.5, 2.0])),
    "b": (np.array([-0.2, 0.5, 0.0]), np.array([1.0, 1.5, 2.0])),
}


class Cell:
    """The world: its physics, and what can be measured in it."""

    def __init__(self, physics: Physics) -> None:
        self.physics = physics
        self.start()

    def reset(self) -> None:
        """Sets the world to time zero: both arms rest above their boxes."""
        self.physics.reset()
        self.start()

    def start(self) -> None:
        """Nothing was fetched yet."""
        self.periods = 0
        self.fetched = {arm: False for arm in ARMS}
        self.last_part = {arm: 0 for arm in ARMS}

    @property
    def now(self) -> int:
        """The simulation time in nanoseconds."""
        return self.periods * PERIOD

    def advance(self, torques: dict[str, np.ndarray], enabled: bool = True) -> dict[str, float]:
        """Advances by a control period and returns the arms that put down a part, with the seconds it took them.

        An arm without new torques keeps its last ones. Without `enabled` no arm moves.
        """
        for arm, wanted in torques.items():
            self.physics.push(arm, wanted)
        if enabled:
            self.physics.step()
        else:
            self.physics.hold()
        self.periods += 1
        parts = {}
        for arm in ARMS:
            if np.linalg.norm(self.tool(arm) - FEEDER) < AT:
                self.fetched[arm] = True
            elif self.fetched[arm] and np.linalg.norm(self.tool(arm) - BOX[arm]) < AT:
                self.fetched[arm] = False
                parts[arm] = (self.now - self.last_part[arm]) * 1e-9
                self.last_part[arm] = self.now
        return parts

    def tool(self, arm: str) -> np.ndarray:
        """Where the tip of a tool is, from the middle of the table."""
        return self.physics.tool(arm)

    def distance_to_worker(self, worker: str) -> float:
        """The distance of the nearest tool from a worker's place; negative inside of it."""
        low, high = WORKERS[worker]
        distances = []
        for arm in ARMS:
            outside = np.maximum(low - self.tool(arm), self.tool(arm) - high)
            distances.append(np.linalg.norm(np.maximum(outside, 0.0)) + min(outside.max(), 0.0))
        return float(min(distances))

    def is_free(self, arm: str) -> bool:
        """Whether the other arm's tool is outside of the shared zone around the feeder."""
        other = ARMS[1 - ARMS.index(arm)]
        return bool(np.linalg.norm((self.tool(other) - FEEDER)[:2]) > SHARED)


class CellNode(Node):
    """The cell as a node. Messages that read the world are published before those that controllers answer."""

    def __init__(self, physics: Physics, lock_step: bool, speed: float, hall: bool) -> None:
        super().__init__("cell", enable_rosout=False)
        self.cell = Cell(physics)
        self.torques: dict[str, np.ndarray] = {}
        self.enabled = True
        self.here_since: float | None = None  # when both controllers were first seen
        deep = QoSProfile(depth=200)  # a relay may release many delayed messages at once
        self.clock = self.create_publisher(Clock, "/clock", 10)
        self.distance = self.create_publisher(Float64, "/cell/distance", deep)
        self.workers = {w: self.create_publisher(Float64, f"/workers/{w}/distance", deep) for w in WORKERS}
        self.tools = {arm: self.create_publisher(PointStamped, f"/{arm}/tool", deep) for arm in ARMS}
        self.parts = {arm: self.create_publisher(Float64, f"/{arm}/part", deep) for arm in ARMS}
        self.joints = {arm: self.create_publisher(JointState, f"/{arm}/joint_states", deep) for arm in ARMS}
        self.commands = {
            arm: self.create_subscription(
                JointState, f"/{arm}/joint_commands", lambda message, arm=arm: self.take(arm, message), deep
            )
            for arm in ARMS
        }
        self.create_service(Trigger, "/cell/zone_grant", self.grant_zone)
        self.create_service(SetBool, "/cell/enable", self.enable)
        self.create_service(Trigger, "/cell/reset", self.reset)
        self.declare("payload", 0.0, 5.0, "kg that hang on each tool unknown to the controllers", 0.0)
        self.declare("friction", 0.1, 10.0, "factor on the friction of all drives", 1.0)
        self.add_on_set_parameters_callback(self.set)
        if lock_step:
            self.create_service(Trigger, "/cell/step", self.step)
        elif hall:
            self.create_timer(PERIOD * 1e-9 / speed, self.gather)
        else:
            self.create_timer(PERIOD * 1e-9 / speed, self.advance)

    def declare(self, name: str, low: float, high: float, what: str, value: float) -> None:
        """Declares a parameter that changes the physics."""
        limits = [FloatingPointRange(from_value=low, to_value=high)]
        self.declare_parameter(name, value, ParameterDescriptor(description=what, floating_point_range=limits))
        self.set([self.get_parameter(name)])

    def set(self, parameters: list) -> SetParametersResult:
        """Takes new values of parameters; they hold until they are set again, also after a reset."""
        for parameter in parameters:
            if parameter.name == "payload":
                self.cell.physics.set_payload(parameter.value)
            elif parameter.name == "friction":
                self.cell.physics.set_friction(parameter.value)
        return SetParametersResult(successful=True)

    def take(self, arm: str, message: JointState) -> None:
        """Keeps torques for the next period. Those that answer a later time are left over from before a reset."""
        torques = np.array(message.effort)
        if nanoseconds(message) <= self.cell.now and len(torques) == JOINTS and np.isfinite(torques).all():
            self.torques[arm] = torques

    def drain(self) -> None:
        """Takes all torques that have arrived: an executor takes only one message per turn."""
        for arm, subscription in self.commands.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(JointState, False)) is not None:
                    self.take(arm, taken[0])

    def step(self, _, response: Trigger.Response) -> Trigger.Response:
        """Advances by one period."""
        self.drain()
        self.advance()
        response.success = True
        return response

    def reset(self, _, response: Trigger.Response) -> Trigger.Response:
        """Sets the world to time zero. Torques that are still on their way are those of the past."""
        self.drain()
        self.torques.clear()
        self.cell.reset()
        self.enabled = True
        response.success = True
        return response

    def grant_zone(self, _, response: Trigger.Response) -> Trigger.Response:
        """Says whether the right arm may enter the zone around the feeder."""
        response.success = self.cell.is_free("right")
        response.message = "granted" if response.success else "the left arm is in the zone"
        return response

    def enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Switches the drives of both arms on or off; without them, brakes hold the arms."""
        self.enabled = request.data
        response.success = True
        return response

    def gather(self) -> None:
        """Advances as soon as everybody is there; until then it is time zero."""
        if self.here_since is None and {f"{arm}_controller" for arm in ARMS} <= set(self.get_node_names()):
            self.here_since = time.monotonic()
        if self.here_since is not None and time.monotonic() - self.here_since >= GATHERING:
            self.advance()
        else:
            self.tell_time()

    def tell_time(self) -> Clock:
        """Publishes the simulation time."""
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = divmod(self.cell.now, 1_000_000_000)
        self.clock.publish(clock)
        return clock

    def advance(self) -> None:
        """Advances by one period and publishes what is new."""
        cell = self.cell
        parts = cell.advance(self.torques, self.enabled)
        self.torques.clear()
        clock = self.tell_time()
        self.distance.publish(Float64(data=cell.physics.distance()))
        for worker, publisher in self.workers.items():
            publisher.publish(Float64(data=cell.distance_to_worker(worker)))
        for arm, seconds_taken in parts.items():
            self.parts[arm].publish(Float64(data=seconds_taken))
        for arm in ARMS:
            tool = PointStamped()
            tool.header.stamp = clock.clock
            tool.header.frame_id = "table"
            tool.point.x, tool.point.y, tool.point.z = cell.tool(arm).tolist()
            self.tools[arm].publish(tool)
        for arm in ARMS:
            joints = JointState(name=NAMES)
            joints.header.stamp = clock.clock
            joints.position = cell.physics.position(arm)
            joints.velocity = cell.physics.velocity(arm)
            self.joints[arm].publish(joints)


def nanoseconds(message: JointState) -> int:
    """The time stamp of a message."""
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def physics(engine: str) -> Physics:
    """The arms in an engine. Only this engine is loaded."""
    if engine == "pybullet":
        from with_pybullet import PyBullet

        return PyBullet()
    from with_mujoco import MuJoCo

    return MuJoCo()


def main() -> None:
    """Reads the options and runs the node until it is interrupted."""
    parser = argparse.ArgumentParser(description="Two KUKA iiwa arms, simulated, as a ROS 2 node.")
    parser.add_argument("--engine", choices=["mujoco", "pybullet"], default="mujoco", help="what simulates the arms")
    parser.add_argument("--lock-step", action="store_true", help="advance only when /cell/step is called")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second, without --lock-step")
    parser.add_argument("--hall", type=int, metavar="DOMAIN", help="in this ROS domain, be the stand-in for a lab")
    own = rclpy.utilities.remove_ros_args(sys.argv)[1:]
    options = parser.parse_args(own)
    hall = options.hall is not None and os.environ.get("ROS_DOMAIN_ID") == str(options.hall)
    if hall:
        options.engine, options.lock_step = "pybullet", False
    rclpy.init(args=sys.argv)
    node = CellNode(physics(options.engine), options.lock_step, options.speed, hall)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    except Exception:
        if rclpy.ok():
            raise  # otherwise it is only the way in which waiting ended
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
