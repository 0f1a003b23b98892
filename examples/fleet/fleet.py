"""Six mobile robots on one floor, simulated by ir-sim, as a ROS 2 node.

Each robot starts on a circle and drives to the opposite side, as its velocity commands say. The node publishes where
the robots are, how close any two come, how many collide and when all have arrived. It avoids no collisions: that is
the task of the planner, which knows only what it receives.

In lock-step (`--lock-step`) the service `/fleet/step` advances the world by one period, with the commands received so
far, and answers after all messages of that period are published; `/fleet/reset` sets the world to time zero. Without
it, the world runs by the wall clock, `--speed` times as fast.
"""

import argparse
import math
import pathlib
import sys
import tempfile

import irsim
import numpy as np
import rclpy
import yaml
from geometry_msgs.msg import PoseStamped, Twist
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64, Header
from std_srvs.srv import Trigger

ROBOTS = range(6)
PERIOD = 100_000_000  # nanoseconds of a control period
RADIUS = 0.3  # metres of a robot
CIRCLE = 5.0  # metres from the middle at which robots start
TURN = 0.11  # rad by which starts are turned, so that nothing is exactly symmetric
FASTEST = 1.2  # metres per second
ARRIVED = 0.25  # metres from its goal at which a robot has arrived


def start(robot: int) -> tuple[float, float]:
    """Where a robot starts."""
    angle = robot * math.tau / len(ROBOTS) + TURN * robot * robot / len(ROBOTS)
    return CIRCLE * math.cos(angle), CIRCLE * math.sin(angle)


class Fleet:
    """The world: ir-sim for the motion, and what can be measured."""

    def __init__(self) -> None:
        places = [start(robot) for robot in ROBOTS]
        world = {
            "world": {
                "height": 20, "width": 20, "offset": [-10, -10], "step_time": PERIOD * 1e-9,
                "sample_time": PERIOD * 1e-9, "collision_mode": "unobstructed",
            },
            "robot": [
                {
                    "number": len(ROBOTS), "kinematics": {"name": "omni"},
                    "shape": {"name": "circle", "radius": RADIUS}, "vel_max": [FASTEST, FASTEST],
                    "vel_min": [-FASTEST, -FASTEST],
                    "distribution": {"name": "manual"},
                    "state": [[x, y, 0.0] for x, y in places],
                    "goal": [[-x, -y, 0.0] for x, y in places],
                }
            ],
        }
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "floor.yaml"  # ir-sim reads its world from a file
            file.write_text(yaml.dump(world))
            self.world = irsim.make(str(file), display=False, log_level="ERROR")
        self.reset()

    def reset(self) -> None:
        """Sets the world to time zero."""
        self.world.reset()
        self.periods = 0
        self.velocities = np.zeros((len(ROBOTS), 2))
        self.touching: set[tuple[int, int]] = set()
        self.collisions = 0
        self.arrived_at = [None] * len(ROBOTS)

    @property
    def now(self) -> int:
        """The simulation time in nanoseconds."""
        return self.periods * PERIOD

    def place(self, robot: int) -> np.ndarray:
        """Where the middle of a robot is."""
        return self.world.robot_list[robot].state[:2, 0]

    def advance(self) -> None:
        """Advances by one period with the current velocities."""
        self.world.step([velocity.reshape(2, 1) for velocity in self.velocities], list(ROBOTS))
        self.periods += 1
        touching = {pair for pair, gap in self.gaps().items() if gap < 0.0}
        self.collisions += len(touching - self.touching)
        self.touching = touching
        for robot in ROBOTS:
            x, y = start(robot)
            if self.arrived_at[robot] is None and np.hypot(*(self.place(robot) + (x, y))) < ARRIVED:
                self.arrived_at[robot] = self.now

    def gaps(self) -> dict[tuple[int, int], float]:
        """The gap between each two robots; negative if they overlap."""
        return {
            (a, b): float(np.hypot(*(self.place(a) - self.place(b)))) - 2 * RADIUS
            for a in ROBOTS for b in ROBOTS if a < b
        }


class FleetNode(Node):
    """The fleet as a node. The tick, which the planner answers, is published after everything else."""

    def __init__(self, lock_step: bool, speed: float) -> None:
        super().__init__("fleet", enable_rosout=False)
        self.fleet = Fleet()
        deep = QoSProfile(depth=200)  # a relay may release many delayed messages at once
        self.clock = self.create_publisher(Clock, "/clock", 10)
        self.poses = [self.create_publisher(PoseStamped, f"/robot_{robot + 1}/pose", deep) for robot in ROBOTS]
        self.distance = self.create_publisher(Float64, "/fleet/distance", deep)
        self.collisions = self.create_publisher(Float64, "/fleet/collisions", deep)
        self.arrived = self.create_publisher(Float64, "/fleet/arrived", deep)
        self.tick = self.create_publisher(Header, "/fleet/tick", deep)
        self.commands = [
            self.create_subscription(
                Twist, f"/robot_{robot + 1}/cmd_vel", lambda message, robot=robot: self.take(robot, message), deep
            )
            for robot in ROBOTS
        ]
        self.create_service(Trigger, "/fleet/reset", self.reset)
        if lock_step:
            self.create_service(Trigger, "/fleet/step", self.step)
        else:
            self.create_timer(PERIOD * 1e-9 / speed, self.advance)

    def take(self, robot: int, message: Twist) -> None:
        """Keeps a velocity; a robot without a new one keeps its last one."""
        wanted = np.array([message.linear.x, message.linear.y])
        if np.isfinite(wanted).all():
            self.fleet.velocities[robot] = np.clip(wanted, -FASTEST, FASTEST)

    def drain(self) -> None:
        """Takes all commands that have arrived: an executor takes only one message per turn."""
        for robot, subscription in enumerate(self.commands):
            with subscription.handle:
                while (taken := subscription.handle.take_message(Twist, False)) is not None:
                    self.take(robot, taken[0])

    def step(self, _, response: Trigger.Response) -> Trigger.Response:
        """Advances by one period."""
        self.drain()
        self.advance()
        response.success = True
        return response

    def reset(self, _, response: Trigger.Response) -> Trigger.Response:
        """Sets the world to time zero. Commands that are still on their way are those of the past."""
        self.drain()
        self.fleet.reset()
        response.success = True
        return response

    def advance(self) -> None:
        """Advances by one period and publishes what is new."""
        fleet = self.fleet
        fleet.advance()
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = divmod(fleet.now, 1_000_000_000)
        header = Header(stamp=clock.clock, frame_id="floor")
        self.clock.publish(clock)
        self.distance.publish(Float64(data=min(fleet.gaps().values())))
        self.collisions.publish(Float64(data=float(fleet.collisions)))
        if fleet.now in fleet.arrived_at and None not in fleet.arrived_at:
            self.arrived.publish(Float64(data=fleet.now * 1e-9))
        for robot, publisher in enumerate(self.poses):
            pose = PoseStamped(header=header)
            pose.pose.position.x, pose.pose.position.y = fleet.place(robot).tolist()
            pose.pose.orientation.w = 1.0
            publisher.publish(pose)
        self.tick.publish(header)


def main() -> None:
    """Reads the options and runs the node until it is interrupted."""
    parser = argparse.ArgumentParser(description="Six mobile robots, simulated, as a ROS 2 node.")
    parser.add_argument("--lock-step", action="store_true", help="advance only when /fleet/step is called")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second, without --lock-step")
    options = parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])
    rclpy.init(args=sys.argv)
    node = FleetNode(options.lock_step, options.speed)
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
