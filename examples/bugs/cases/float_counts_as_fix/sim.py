"""A field robot drives between two rows of vines, and over a narrow bridge in their middle.

Its receiver tells with each position whether it is a fix, good to centimetres, or only a float. When the fix is lost,
the position jumps by a metre or two. The robot steers by it all the same, where it should stop and wait for a fix:
https://github.com/ArduPilot/ardupilot/issues/8787. It leaves out positions that are too far from what it expects, as
estimators do, until they have come for a while.
"""

import math

from bugs.protocol import Bus

SPEED = 1.5  # m/s
BRIDGE = (24.0, 36.0)  # m along the row
WIDE, NARROW = 2.0, 0.6  # how far the robot may be off the middle, m
GATE, GATE_OPENS_AFTER = 1.2, 2.5  # m, s


class Simulator:
    subscribes = ("gps/position", "compass/heading", "wheels/turn")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.along, self.offset, self.heading = 0.0, 0.0, 0.0
        self.estimate, self.accepted_at, self.measured = 0.0, 0.0, 0.0
        self.turn = 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        if self.steps % 2 == 0:
            bus.publish("gps/position", {"offset": self.offset, "fix": True})
        bus.publish("compass/heading", math.degrees(self.heading))

        self.measured = bus.latest("compass/heading", self.measured)
        self.estimate += SPEED * math.sin(math.radians(self.measured)) * self.step_length
        for position in bus.take("gps/position"):  # the bug: with or without a fix
            error = position["offset"] - self.estimate
            if abs(error) < GATE or time - self.accepted_at > GATE_OPENS_AFTER:
                self.estimate, self.accepted_at = self.estimate + 0.3 * error, time
        wanted = max(-15.0, min(15.0, -14.0 * self.estimate))
        bus.publish("wheels/turn", max(-20.0, min(20.0, 1.5 * (wanted - self.measured))))

        self.turn = bus.latest("wheels/turn", self.turn)
        self.heading += math.radians(self.turn) * self.step_length
        self.along += SPEED * math.cos(self.heading) * self.step_length
        self.offset += SPEED * math.sin(self.heading) * self.step_length
        free = NARROW if BRIDGE[0] <= self.along <= BRIDGE[1] else WIDE
        bus.publish("truth/room", free - abs(self.offset))
