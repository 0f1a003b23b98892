"""An arm follows a trajectory, and is stopped twice because somebody comes near it.

The time of the trajectory is to stand still with the arm: the arm reports which share of its speed it may drive, and
the controller scales time by that. A controller that does not hear of a stop lets time go on, and never looks at how
far behind the arm is. Once the arm is released, it catches up as fast as it can:
https://github.com/UniversalRobots/Universal_Robots_ROS_Driver/issues/68,
https://github.com/UniversalRobots/Universal_Robots_ROS_Driver/issues/274
"""

import math

from bugs.protocol import Bus

STOPS = ((6.0, 9.0), (14.0, 14.6))  # s
FOLLOWS, FASTEST = 10.0, 3.0  # 1/s, rad/s


class Simulator:
    subscribes = ("arm/scaling", "controller/target")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.angle, self.target = 0.0, 0.0
        self.scaling, self.on_the_way = 1.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        is_stopped = any(start <= time < end for start, end in STOPS)
        bus.publish("arm/scaling", 0.0 if is_stopped else 1.0)
        self.scaling = bus.latest("arm/scaling", self.scaling)
        self.on_the_way += self.scaling * self.step_length  # the bug: whether the arm follows or not
        bus.publish("controller/target", 1.2 * (1.0 - math.cos(0.4 * self.on_the_way)))

        self.target = bus.latest("controller/target", self.target)
        most = 0.0 if is_stopped else FASTEST
        speed = max(-most, min(most, FOLLOWS * (self.target - self.angle)))
        self.angle += speed * self.step_length
        bus.publish("truth/speed", abs(speed))
