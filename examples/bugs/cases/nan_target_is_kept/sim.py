"""A multicopter flies around a rectangle, in a steady wind.

The flight task replaces its target if the waypoint is more than a millimetre away from it. Without a valid position the
target becomes that position, which is not a number. No difference to it is more than a millimetre, so the target stays
what it is when the position is valid again. The controller leaves an axis without a target alone, and the wind takes
the copter away: https://github.com/PX4/PX4-Autopilot/pull/11636
"""

import math

from bugs.protocol import Bus

WAYPOINTS = ((0.0, 0.0), (20.0, 0.0), (20.0, 15.0), (0.0, 15.0))
WIND = (0.5, -0.3)  # m/s
FASTEST = 2.0  # m/s
REACTION = 0.5  # seconds in which the velocity follows


class Simulator:
    subscribes = ("ekf/x", "ekf/y", "ekf/valid")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.position, self.velocity = [0.0, 0.0], [0.0, 0.0]
        self.estimate, self.is_valid = [0.0, 0.0], True
        self.target, self.waypoint = [0.0, 0.0], 1

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("ekf/x", self.position[0])
        bus.publish("ekf/y", self.position[1])
        bus.publish("ekf/valid", True)
        self.follow(bus)
        for axis in (0, 1):
            error = self.target[axis] - self.estimate[axis]
            wanted = 0.0 if math.isnan(error) else max(-FASTEST, min(FASTEST, 0.8 * error))
            self.velocity[axis] += (wanted - self.velocity[axis]) * self.step_length / REACTION
            self.position[axis] += (self.velocity[axis] + WIND[axis]) * self.step_length
        bus.publish("truth/off_track", off_track(*self.position))

    def follow(self, bus: Bus) -> None:
        """The flight task: chooses the target."""
        self.estimate = [bus.latest("ekf/x", self.estimate[0]), bus.latest("ekf/y", self.estimate[1])]
        self.is_valid = bus.latest("ekf/valid", self.is_valid)
        if not self.is_valid:
            self.estimate = [math.nan, math.nan]
        if any(map(math.isnan, self.estimate)):
            self.target = list(self.estimate)
            return
        if math.dist(self.estimate, WAYPOINTS[self.waypoint]) < 1.0:
            self.waypoint = (self.waypoint + 1) % len(WAYPOINTS)
        if math.dist(self.target, WAYPOINTS[self.waypoint]) > 0.001:  # the bug: false if the target is not a number
            self.target = list(WAYPOINTS[self.waypoint])


def off_track(x: float, y: float) -> float:
    """The distance from the rectangle's boundary."""
    outside = math.hypot(max(0.0, -x, x - 20.0), max(0.0, -y, y - 15.0))
    return outside or min(x, 20.0 - x, y, 15.0 - y)
