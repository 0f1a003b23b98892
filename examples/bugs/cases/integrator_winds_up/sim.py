"""A gantry moves parts to a station that has a fence behind it.

Its position loop has an integral term, and nothing that stops the integral while the output is at its limit. Whenever
the gantry cannot follow for a while, the integral grows; afterwards the gantry runs past its goal until the integral
is used up: https://github.com/odriverobotics/ODrive/pull/626,
https://github.com/uri-ocean-robotics/mvp_control/issues/17
"""

from bugs.protocol import Bus

STATION = 1.0  # m
LEAVES_AT, RETURNS_AT = 14.0, 22.0  # s
PROPORTIONAL, INTEGRAL, DAMPING = 1.6, 0.35, 0.9
FRICTION = 0.6


class Simulator:
    subscribes = ("gantry/position", "gantry/force", "gantry/goal")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.position, self.velocity = 0.0, 0.0
        self.goal, self.measured = 0.0, 0.0
        self.integral, self.force = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        away = time < 2.0 or LEAVES_AT <= time < RETURNS_AT
        bus.publish("gantry/goal", 0.0 if away else STATION)
        bus.publish("gantry/position", self.position)

        self.goal = bus.latest("gantry/goal", self.goal)
        self.measured = bus.latest("gantry/position", self.measured)
        error = self.goal - self.measured
        self.integral += error * self.step_length  # the bug: also while the force below is at its limit
        wanted = PROPORTIONAL * error + INTEGRAL * self.integral - DAMPING * self.velocity
        bus.publish("gantry/force", max(-1.0, min(1.0, wanted)))

        self.force = bus.latest("gantry/force", self.force)
        self.velocity += (self.force - FRICTION * self.velocity) * self.step_length
        self.position += self.velocity * self.step_length
        bus.publish("truth/position", self.position)
