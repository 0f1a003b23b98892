"""Moves one arm of the cell: fetches parts from the feeder and puts them into the arm's box, every few seconds.

For each message with the joints of its arm, the controller sends exactly one with torques. It knows the time only from
these messages, so equal messages give equal torques. The left arm goes by the timetable. The right one goes in between,
after the cell has granted it the zone around the feeder (service `/cell/zone_grant`). Both slow down when the cell
reports that the arms come close.
"""

import argparse
import sys

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

TIMETABLE = 7.0  # seconds from one departure to the next
DEPARTURE = {"left": 0.4, "right": 3.1}  # seconds after the beginning of the timetable
LATEST = 1.2  # seconds after its departure until which an arm that had to wait may still go
SLOW, STOP = 0.10, 0.04  # metres between the arms at which a controller slows down, and stops
AGAIN = 0.1  # seconds after which a zone that was not granted is asked for again
BOX = np.array([-0.6571, 0.467, 0.1091, -1.4969, -0.053, 1.1806, -0.3854])
ABOVE = np.array([0.0, 0.6211, 0.0, -1.2031, 0.0, 1.3174, 0.0])
FEEDER = np.array([0.0, 0.7128, 0.0, -1.318, 0.0, 1.1107, 0.0])
WAY = [(BOX, ABOVE, 1.3), (ABOVE, FEEDER, 0.5), (FEEDER, FEEDER, 0.2), (FEEDER, ABOVE, 0.5), (ABOVE, BOX, 1.3)]
STIFFNESS = np.array([80.0, 80.0, 40.0, 50.0, 20.0, 12.0, 6.0])  # Nm/rad
DAMPING = np.array([4.0, 4.0, 2.0, 2.0, 0.5, 0.3, 0.2])  # Nm s/rad
FRICTION = np.array([20.0, 20.0, 12.0, 14.0, 5.0, 3.0, 2.0])  # Nm s/rad of the drives, as far as is known
STRONGEST = np.array([176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0])  # Nm


class Controller:
    """What an arm does, as a function of the messages it received."""

    def __init__(self, arm: str) -> None:
        self.arm = arm
        self.restart()

    def restart(self) -> None:
        """Forgets everything; the arm is above its box."""
        self.time = 0.0
        self.distance = np.inf  # between the arms, in metres, as last reported
        self.along = None  # seconds along the way, or None above the box
        self.round = -1  # the last round of the timetable in which the arm went
        self.asked_at = None  # when the zone was asked for; None if it is not
        self.granted = False

    def answer(self, granted: bool) -> None:
        """Takes the answer to the last request for the zone."""
        self.granted = granted

    def wants_zone(self) -> bool:
        """Whether the zone must be asked for now."""
        if self.arm == "left" or self.along is not None or self.granted or not self.may_depart():
            return False
        if self.asked_at is not None and self.time - self.asked_at < AGAIN:
            return False
        self.asked_at = self.time
        return True

    def may_depart(self) -> bool:
        """Whether the timetable lets the arm go now."""
        turn, since = divmod(self.time - DEPARTURE[self.arm], TIMETABLE)
        return turn > self.round and 0.0 <= since <= LATEST

    def command(self, stamp: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Returns the torques for a message with joints."""
        if stamp < self.time - 0.5:
            self.restart()  # time went back: the cell was reset
        passed, self.time = max(stamp - self.time, 0.0), max(stamp, self.time)
        if self.along is None and self.may_depart() and (self.arm == "left" or self.granted):
            self.along = 0.0
            self.round = (self.time - DEPARTURE[self.arm]) // TIMETABLE
        if self.along is not None:
            self.along += passed * max(0.0, min(1.0, (self.distance - STOP) / (SLOW - STOP)))
            if self.along >= sum(seconds for _, _, seconds in WAY):
                self.along, self.granted = None, False
        wanted, moving = self.target()
        torque = STIFFNESS * (wanted - position) + DAMPING * (moving - velocity) + FRICTION * moving
        return np.clip(torque, -STRONGEST, STRONGEST)

    def target(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the joints should be, and how fast they should move."""
        rest = self.along or 0.0
        for start, end, seconds in WAY:
            if rest <= seconds:
                x = rest / seconds  # no jerk at the ends: 10x³ - 15x⁴ + 6x⁵
                done, rate = x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2 / seconds
                return start + done * (end - start), rate * (end - start)
            rest -= seconds
        return BOX, np.zeros(7)


class ControllerNode(Node):
    """The controller as a node.

    Callbacks only keep what arrives; `work` acts when nothing more has arrived. So it does not matter which of the
    messages of an instant the executor hands over first.
    """

    def __init__(self, arm: str) -> None:
        super().__init__(f"{arm}_controller", enable_rosout=False)
        self.controller = Controller(arm)
        self.waiting: list[JointState] = []
        deep = QoSProfile(depth=200)  # a relay may release many delayed messages at once
        self.commands = self.create_publisher(JointState, f"/{arm}/joint_commands", deep)
        self.create_subscription(Float64, "/cell/distance", self.take_distance, deep)
        self.create_subscription(JointState, f"/{arm}/joint_states", self.waiting.append, deep)
        self.zone = self.create_client(Trigger, "/cell/zone_grant")
        self.request = None

    def take_distance(self, message: Float64) -> None:
        """Keeps how close the arms are."""
        self.controller.distance = message.data

    def work(self) -> None:
        """Answers all messages that have arrived."""
        if self.request is not None and self.request.done():
            self.controller.answer(self.request.result().success)
            self.request = None
        for message in self.waiting:
            stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
            torques = self.controller.command(stamp, np.array(message.position), np.array(message.velocity))
            if self.controller.asked_at is None:
                self.request = None  # asked before a reset
            if self.controller.wants_zone():
                self.request = self.zone.call_async(Trigger.Request())
            answer = JointState(header=message.header, name=message.name, effort=torques.tolist())
            self.commands.publish(answer)
        self.waiting.clear()


def main() -> None:
    """Reads the options and runs the node until it is interrupted."""
    parser = argparse.ArgumentParser(description="The controller of one arm of the cell, as a ROS 2 node.")
    parser.add_argument("--arm", choices=list(DEPARTURE), required=True, help="which arm it moves")
    options = parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])
    rclpy.init(args=sys.argv)
    node = ControllerNode(options.arm)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok():
            try:
                handler, _, _ = executor.wait_for_ready_callbacks(timeout_sec=0.0 if node.waiting else None)
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
