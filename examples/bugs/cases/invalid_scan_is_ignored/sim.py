"""A cart drives down an aisle in which a pallet truck parks for ten seconds.

A collision monitor stands between planner and wheels: it slows the cart down near an obstacle, and stops it in front of
one. A laser that has been silent for half a second counts as invalid, and the monitor skips invalid sources. So without
a laser, it passes on the planner's speed as if the aisle were free. Reported as a missing watchdog:
https://github.com/ros-navigation/navigation2/issues/3874
"""

import math

from bugs.protocol import Bus

CRUISE = 1.2  # speed of the planner, m/s
SLOW = 0.35
GOAL = 36.0  # where the planner stops, m
WALL = 40.0
TRUCK_AT = 20.0
TRUCK_ARRIVES, TRUCK_LEAVES = 12.0, 22.0  # s
SOURCE_TIMEOUT = 0.5  # s


class Simulator:
    subscribes = ("nav/cmd", "scan/front", "base/cmd")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.position, self.speed = 0.0, 0.0
        self.range, self.scanned_at = math.inf, -math.inf
        self.planned, self.commanded = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        obstacle = TRUCK_AT if TRUCK_ARRIVES <= time < TRUCK_LEAVES else WALL
        if self.steps % 2 == 0:
            bus.publish("scan/front", max(0.05, obstacle - self.position))
        bus.publish("nav/cmd", CRUISE if self.position < GOAL else 0.0)
        bus.publish("base/cmd", self.monitored(time, bus))
        self.drive(bus.latest("base/cmd", self.commanded))
        bus.publish("truth/gap", obstacle - self.position)

    def monitored(self, time: float, bus: Bus) -> float:
        """The collision monitor: the planner's speed, as far as valid sources permit."""
        for distance in bus.take("scan/front"):
            self.range, self.scanned_at = distance, time
        self.planned = bus.latest("nav/cmd", self.planned)
        if time - self.scanned_at > SOURCE_TIMEOUT:
            return self.planned  # the bug: no valid source is taken for no obstacle
        if self.range < 1.0:
            return 0.0
        return min(self.planned, SLOW) if self.range < 3.0 else self.planned

    def drive(self, commanded: float) -> None:
        self.commanded = commanded
        most = {True: 0.8, False: 1.5}[commanded > self.speed] * self.step_length
        self.speed += max(-most, min(most, commanded - self.speed))
        self.position += self.speed * self.step_length
