"""Plans the velocities of six mobile robots by reciprocal velocity obstacles.

Each robot drives to the side opposite of where it started. Where robots are, the planner knows only from the poses
that it receives; how fast they move, from the last two poses of each. For each message on `/fleet/tick` it sends
exactly one velocity to each robot. Equal messages give equal velocities.
"""

import argparse
import sys

import numpy as np
import rclpy
from fleet import ROBOTS, start
from geometry_msgs.msg import PoseStamped, Twist
from irsim.lib.algorithm.rvo import reciprocal_vel_obs
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Header

RADIUS = 0.4  # metres of a robot, with some room
CRUISE = 1.0  # metres per second
ACCELERATION = 1.0  # metres per second and second
SIGHT = 4.0  # metres beyond which other robots are ignored


class Robot:
    """What the planner knows about a robot."""

    def __init__(self, number: int) -> None:
        self.goal = -np.array(start(number))
        self.poses: list[tuple[float, np.ndarray]] = []  # the last two, with their times

    def learn(self, time: float, place: np.ndarray) -> None:
        """Takes a pose."""
        self.poses = [*self.poses[-1:], (time, place)]

    def forget_after(self, time: float) -> None:
        """Forgets poses of a later time: the world was reset."""
        self.poses = [pose for pose in self.poses if pose[0] <= time]

    @property
    def place(self) -> np.ndarray:
        """Where it was last."""
        return self.poses[-1][1]

    @property
    def velocity(self) -> np.ndarray:
        """How it moved between its last two poses."""
        if len(self.poses) < 2 or self.poses[1][0] <= self.poses[0][0]:
            return np.zeros(2)
        return (self.poses[1][1] - self.poses[0][1]) / (self.poses[1][0] - self.poses[0][0])


def plan(robots: list[Robot], number: int) -> np.ndarray:
    """The velocity of one robot, from what is known about all."""
    robot = robots[number]
    if not robot.poses:
        return np.zeros(2)
    way = robot.goal - robot.place
    wanted = way * min(1.0, CRUISE / max(float(np.hypot(*way)), 1e-9))
    others = [
        [*other.place, *other.velocity, RADIUS]
        for other in robots
        if other is not robot and other.poses and np.hypot(*(other.place - robot.place)) < SIGHT
    ]
    own = [*robot.place, *robot.velocity, RADIUS, *wanted]
    return np.array(reciprocal_vel_obs(own, others, CRUISE, CRUISE, ACCELERATION).cal_vel("rvo"))


def seconds(header: Header) -> float:
    """The time stamp of a message."""
    return header.stamp.sec + header.stamp.nanosec * 1e-9


class PlannerNode(Node):
    """The planner as a node.

    Callbacks only keep what arrives; `work` acts when nothing more has arrived. So it does not matter which of the
    messages of an instant the executor hands over first.
    """

    def __init__(self) -> None:
        super().__init__("planner", enable_rosout=False)
        self.robots = [Robot(number) for number in ROBOTS]
        self.time = 0.0
        self.ticks: list[Header] = []
        deep = QoSProfile(depth=200)  # a relay may release many delayed messages at once
        self.velocities = [self.create_publisher(Twist, f"/robot_{robot + 1}/cmd_vel", deep) for robot in ROBOTS]
        for robot in ROBOTS:
            self.create_subscription(
                PoseStamped, f"/robot_{robot + 1}/pose", lambda message, robot=robot: self.take(robot, message), deep
            )
        self.create_subscription(Header, "/fleet/tick", self.ticks.append, deep)

    def take(self, robot: int, message: PoseStamped) -> None:
        """Keeps a pose."""
        self.robots[robot].learn(seconds(message.header), np.array([message.pose.position.x, message.pose.position.y]))

    def work(self) -> None:
        """Answers all ticks that have arrived."""
        for tick in self.ticks:
            time = seconds(tick)
            if time < self.time:
                for robot in self.robots:
                    robot.forget_after(time)
            self.time = time
            for number, publisher in enumerate(self.velocities):
                velocity = Twist()
                velocity.linear.x, velocity.linear.y = plan(self.robots, number).tolist()
                publisher.publish(velocity)
        self.ticks.clear()


def main() -> None:
    """Runs the node until it is interrupted."""
    parser = argparse.ArgumentParser(description="The planner of six mobile robots, as a ROS 2 node.")
    parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])
    rclpy.init(args=sys.argv)
    node = PlannerNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok():
            try:
                handler, _, _ = executor.wait_for_ready_callbacks(timeout_sec=0.0 if node.ticks else None)
                handler()
            except TimeoutException:
                node.work()
    except KeyboardInterrupt:
        pass
    except Exception:
        if rclpy.ok():
            raise  # otherwise it is only the way in which waiting ended
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
