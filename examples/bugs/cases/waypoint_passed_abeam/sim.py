"""A boat follows a route of three legs around a shoal, steered by an autopilot.

A waypoint counts as reached once the boat is near the line through it across the leg, however far to the side of it the
boat is. So a position that jumps ahead for a moment ends the leg too early, wherever it jumps to, and the boat cuts the
corner over the shoal: https://github.com/OpenCPN/OpenCPN/issues/4881
"""

import math

from bugs.protocol import Bus

ROUTE = ((0.0, 0.0), (300.0, 0.0), (300.0, 200.0), (600.0, 200.0))  # m
SHOAL, SHOAL_RADIUS = (245.0, 110.0), 35.0  # m
ARRIVAL = 15.0  # m
SPEED = 5.0  # m/s


class Simulator:
    subscribes = ("gps/position", "compass/heading", "rudder")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.position, self.heading, self.turn = [0.0, 0.0], 0.0, 0.0
        self.seen, self.leg, self.course = [0.0, 0.0], 1, 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        if self.steps % 5 == 0:
            bus.publish("gps/position", [*self.position, 0.0])
        bus.publish("compass/heading", math.degrees(self.heading))
        self.navigate(bus)
        for heading in bus.take("compass/heading"):
            error = (self.course - heading + 180.0) % 360.0 - 180.0
            bus.publish("rudder", max(-12.0, min(12.0, 0.5 * error)))

        self.turn = bus.latest("rudder", self.turn)
        self.heading += math.radians(self.turn) * self.step_length
        self.position[0] += SPEED * math.cos(self.heading) * self.step_length
        self.position[1] += SPEED * math.sin(self.heading) * self.step_length
        bus.publish("truth/water", math.dist(self.position, SHOAL) - SHOAL_RADIUS)

    def navigate(self, bus: Bus) -> None:
        """The chart plotter: which leg the boat is on, and the course to its end."""
        self.seen = bus.latest("gps/position", self.seen)
        start, end = ROUTE[self.leg - 1], ROUTE[self.leg]
        leg = end[0] - start[0], end[1] - start[1]
        left = (end[0] - self.seen[0]) * leg[0] + (end[1] - self.seen[1]) * leg[1]
        # The bug: how far the boat is to the side of the waypoint does not count.
        if left < ARRIVAL * math.hypot(*leg) and self.leg < len(ROUTE) - 1:
            self.leg += 1
        end = ROUTE[self.leg]
        self.course = math.degrees(math.atan2(end[1] - self.seen[1], end[0] - self.seen[0]))
