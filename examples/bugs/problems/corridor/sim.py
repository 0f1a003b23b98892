"""Two robots meet in a narrow corridor and give way, each to its right.

Each knows from its own sensors where it is across the corridor and where it heads, and hears by radio how far along the
corridor the other one is. It drives along the middle. As soon as the other one is near, it moves to the right, and it
moves back once the other one has passed. It steers by its offset from the line that it wants to follow and by its
heading, and turns at a limited rate.

R. Siegwart, I. R. Nourbakhsh, D. Scaramuzza: Introduction to autonomous mobile robots. MIT Press 2011, chapter 3.
"""

import math

from bugs.protocol import Bus

LENGTH = 24.0  # m
SPEEDS = {"a": 1.0, "b": 1.2}  # m/s
NEAR, PASSED = 7.0, -1.0  # m along the corridor
ASIDE = -0.6  # m: to the right of the middle
BY_OFFSET, BY_HEADING, SHARPEST = 0.8, 2.0, 0.6  # rad/s per m, per rad; rad/s


class Robot:
    """A robot in a frame of its own, in which it drives along `x`, and `y` is to the left of the middle."""

    def __init__(self, name: str) -> None:
        self.name, self.speed = name, SPEEDS[name]
        self.x, self.y, self.heading = 0.0, 0.0, 0.0
        self.offset, self.compass = 0.0, 0.0
        self.ahead = LENGTH
        self.turn = 0.0

    def tell(self, bus: Bus) -> None:
        bus.publish(f"{self.name}/radio", self.x)
        bus.publish(f"{self.name}/offset", self.y)
        bus.publish(f"{self.name}/heading", math.degrees(self.heading))

    def drive(self, other: str, bus: Bus, step: float) -> None:
        for along in bus.take(f"{other}/radio"):
            self.ahead = LENGTH - along
        self.offset = bus.latest(f"{self.name}/offset", self.offset)
        self.compass = bus.latest(f"{self.name}/heading", self.compass)
        wanted = ASIDE if PASSED < self.ahead - self.x < NEAR else 0.0
        turn = BY_OFFSET * (wanted - self.offset) - BY_HEADING * math.radians(self.compass)
        bus.publish(f"{self.name}/turn", max(-SHARPEST, min(SHARPEST, turn)))

        self.turn = bus.latest(f"{self.name}/turn", self.turn)
        self.heading += self.turn * step
        self.x += self.speed * math.cos(self.heading) * step
        self.y += self.speed * math.sin(self.heading) * step


class Simulator:
    subscribes = ("a/radio", "a/offset", "a/heading", "a/turn", "b/radio", "b/offset", "b/heading", "b/turn")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.a, self.b = Robot("a"), Robot("b")

    def step(self, time: float, bus: Bus) -> None:
        self.a.tell(bus)
        self.b.tell(bus)
        self.a.drive("b", bus, self.step_length)
        self.b.drive("a", bus, self.step_length)
        apart = math.hypot(LENGTH - self.b.x - self.a.x, self.a.y + self.b.y)
        bus.publish("truth/apart", apart)
