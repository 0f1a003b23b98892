"""A cell with two KUKA iiwa arms, simulated by MuJoCo, as a ROS 2 node.

The arms face each other over a table and fetch parts from the same feeder in its middle. Each takes torques and
reports its joints; the node also reports how close the arms are to each other, and the tools to the places of two
workers.

In lock-step (`--lock-step`) the service `/cell/step` advances the world by one control period, with the torques
received so far, and answers after all messages of that period are published; `/cell/reset` sets the world to time
zero. Without it, the world runs by the wall clock, `--speed` times as fast.
"""

import argparse
import importlib.util
import pathlib
import sys

import mujoco
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

ARMS = ("left", "right")
JOINTS = 7
NAMES = [f"joint_{i + 1}" for i in range(JOINTS)]
PERIOD = 20_000_000  # nanoseconds of a control period
PHYSICS = 0.002  # seconds of a step of the physics
ROTOR = 0.15  # kg m² that a drive adds to its joint
FRICTION = np.array([20.0, 20.0, 12.0, 14.0, 5.0, 3.0, 2.0])  # Nm s/rad of the drives
FAR = 2.0  # metres beyond which a distance is not measured exactly
BASE = {"left": (-0.62, 0.0, 0.0), "right": (0.62, 0.0, np.pi)}  # x, y and rotation, on the table
PARKED = (-0.6571, 0.467, 0.1091, -1.4969, -0.053, 1.1806, -0.3854)  # joints of both arms at time zero, in rad
FEEDER = np.array([0.0, 0.0, 0.22])  # where parts are fetched
BOX = {"left": np.array([-0.16, -0.3, 0.3]), "right": np.array([0.16, 0.3, 0.3])}  # where they are put down
AT = 0.06  # metres within which a tool has reached a place
SHARED = 0.28  # metres around the feeder, as seen from above, that only one arm may enter
WORKERS = {  # the places of the workers: two opposite corners
    "a": (np.array([-1.0, -1.5, 0.0]), np.array([0.2, -0.5, 2.0])),
    "b": (np.array([-0.2, 0.5, 0.0]), np.array([1.0, 1.5, 2.0])),
}


class Cell:
    """The world: its physics, and what can be measured in it."""

    def __init__(self) -> None:
        self.model = build()
        self.data = mujoco.MjData(self.model)
        self.state = {
            arm: np.array([self.model.joint(f"{arm}_joint_{i + 1}").qposadr[0] for i in range(JOINTS)]) for arm in ARMS
        }
        self.speed = {
            arm: np.array([self.model.joint(f"{arm}_joint_{i + 1}").dofadr[0] for i in range(JOINTS)]) for arm in ARMS
        }
        self.motors = {
            arm: np.array([self.model.actuator(f"{arm}_torq_j{i + 1}").id for i in range(JOINTS)]) for arm in ARMS
        }
        self.site = {arm: self.model.site(f"{arm}_tool").id for arm in ARMS}
        self.payload = {arm: self.model.body(f"{arm}_payload").id for arm in ARMS}
        moving = {arm: solid(self.model, arm) for arm in ARMS}
        self.pairs = np.array([(a, b) for a in moving["left"] for b in moving["right"]])
        self.reach = self.model.geom_rbound[self.pairs].sum(axis=1)
        self.set_friction(1.0)
        self.reset()

    def reset(self) -> None:
        """Sets the world to time zero: both arms rest above their boxes."""
        mujoco.mj_resetData(self.model, self.data)
        for arm in ARMS:
            self.data.qpos[self.state[arm]] = PARKED
        mujoco.mj_forward(self.model, self.data)
        self.periods = 0
        self.fetched = {arm: False for arm in ARMS}
        self.last_part = {arm: 0 for arm in ARMS}

    @property
    def now(self) -> int:
        """The simulation time in nanoseconds."""
        return self.periods * PERIOD

    def set_payload(self, mass: float) -> None:
        """Hangs a weight on both tools of which the arms know nothing."""
        for body in self.payload.values():
            self.model.body_mass[body] = max(mass, 1e-4)
            self.model.body_inertia[body] = max(mass, 1e-4) * 0.03**2

    def set_friction(self, factor: float) -> None:
        """Makes the friction of all drives this many times as strong."""
        self.model.dof_damping[:] = np.tile(FRICTION, len(ARMS)) * factor

    def advance(self, torques: dict[str, np.ndarray], enabled: bool = True) -> dict[str, float]:
        """Advances by a control period and returns the arms that put down a part, with the seconds it took them.

        An arm without new torques keeps its last ones. Without `enabled` no arm moves.
        """
        for arm, wanted in torques.items():
            self.data.ctrl[self.motors[arm]] = wanted
        if enabled:
            mujoco.mj_step(self.model, self.data, round(PERIOD * 1e-9 / PHYSICS))
        else:
            self.data.qvel[:] = 0.0
        mujoco.mj_forward(self.model, self.data)
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
        return self.data.site_xpos[self.site[arm]]

    def distance(self) -> float:
        """The smallest distance between the arms; negative if they penetrate each other.

        Spheres around the bodies tell which pairs can be the closest; the exact distance is computed only for those.
        """
        middles = self.data.geom_xpos[self.pairs]
        at_least = np.linalg.norm(middles[:, 0] - middles[:, 1], axis=1) - self.reach
        smallest = FAR
        for pair in np.argsort(at_least, kind="stable"):
            if at_least[pair] >= smallest:
                break
            a, b = self.pairs[pair]
            smallest = min(smallest, mujoco.mj_geomDistance(self.model, self.data, a, b, smallest, None))
        return smallest

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


def build() -> mujoco.MjModel:
    """The model of the cell, from the arm that the robosuite package carries."""
    found = importlib.util.find_spec("robosuite")
    if found is None:
        sys.exit("cell.py: the package robosuite, which has the model of the arm, is not installed: run set_up.py")
    arm_file = pathlib.Path(found.submodule_search_locations[0]) / "models/assets/robots/iiwa/robot.xml"
    world = mujoco.MjSpec()
    world.option.timestep = PHYSICS
    world.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, -0.02], size=[0.9, 0.5, 0.02])
    for arm in ARMS:
        spec = mujoco.MjSpec.from_file(str(arm_file))
        hand = spec.body("right_hand")
        hand.add_geom(
            name="tool_collision", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, 0.06], size=[0.03, 0.06, 0], mass=0.6
        )
        hand.add_site(name="tool", pos=[0, 0, 0.12])
        payload = hand.add_body(name="payload", pos=[0, 0, 0.1])
        payload.mass, payload.inertia, payload.explicitinertial = 1e-4, [1e-7] * 3, True
        x, y, turned = BASE[arm]
        frame = world.worldbody.add_frame(pos=[x, y, 0], quat=[np.cos(turned / 2), 0, 0, np.sin(turned / 2)])
        frame.attach_body(spec.worldbody.first_body(), f"{arm}_", "")
    for body in world.bodies:
        # The drives of a real iiwa carry the arm's own weight; not that of the payload.
        body.gravcomp = 0.0 if body.name.endswith("payload") else 1.0
    for joint in world.joints:
        joint.armature = ROTOR
    for geom in world.geoms:
        # An arm touches the other one and the table, not itself; what is only for the eye touches nothing.
        drawn = geom.name.endswith("_visual")
        geom.contype = 0 if drawn else 2 if geom.name.startswith("right") else 1
        geom.conaffinity = 0 if drawn else 1 if geom.name.startswith("right") else 2
    return world.compile()


class CellNode(Node):
    """The cell as a node. Messages that read the world are published before those that controllers answer."""

    def __init__(self, lock_step: bool, speed: float) -> None:
        super().__init__("cell", enable_rosout=False)
        self.cell = Cell()
        self.torques: dict[str, np.ndarray] = {}
        self.enabled = True
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
                self.cell.set_payload(parameter.value)
            elif parameter.name == "friction":
                self.cell.set_friction(parameter.value)
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

    def advance(self) -> None:
        """Advances by one period and publishes what is new."""
        cell = self.cell
        parts = cell.advance(self.torques, self.enabled)
        self.torques.clear()
        seconds, nanos = divmod(cell.now, 1_000_000_000)
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanos
        self.clock.publish(clock)
        self.distance.publish(Float64(data=cell.distance()))
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
            joints.position = cell.data.qpos[cell.state[arm]].tolist()
            joints.velocity = cell.data.qvel[cell.speed[arm]].tolist()
            self.joints[arm].publish(joints)


def nanoseconds(message: JointState) -> int:
    """The time stamp of a message."""
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def solid(model: mujoco.MjModel, arm: str) -> list[int]:
    """The bodies of an arm that can be hit: all but its base, which does not move."""
    names = [f"{arm}_link_{i}_collision" for i in range(1, JOINTS + 1)] + [f"{arm}_tool_collision"]
    return [model.geom(name).id for name in names]


def main() -> None:
    """Reads the options and runs the node until it is interrupted."""
    parser = argparse.ArgumentParser(description="Two KUKA iiwa arms, simulated, as a ROS 2 node.")
    parser.add_argument("--lock-step", action="store_true", help="advance only when /cell/step is called")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second, without --lock-step")
    own = rclpy.utilities.remove_ros_args(sys.argv)[1:]
    options = parser.parse_args(own)
    rclpy.init(args=sys.argv)
    node = CellNode(options.lock_step, options.speed)
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
