"""A bus without a driver loses its place on the map for a moment, and afterwards believes that it is somewhere else.

A monitor reports the state of the localisation ten times per second. An error makes the bus stop, and it stays so until
somebody has looked after it. If the reports fall silent, the bus stops as well, but that is not held: when they come
again, it drives on. So if no report of the error arrives, it drives on with a wrong position, and out of its lane:
https://github.com/autowarefoundation/autoware_universe/pull/2634
"""

from bugs.protocol import Bus

CRUISE = 8.0  # m/s
LOST_AT, BACK_AT = 14.0, 15.0  # s
SILENT_AFTER = 0.5  # s
DRIFT = 0.05  # metres off the lane per metre driven with a wrong position


class Simulator:
    subscribes = ("monitor/state", "gate/brake", "planner/speed")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.heard_at, self.is_held = 0.0, False
        self.wanted, self.brakes = CRUISE, False
        self.speed, self.offset = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        if self.steps % 2 == 0:
            bus.publish("monitor/state", "ERROR" if LOST_AT <= time < BACK_AT else "OK")
            bus.publish("planner/speed", CRUISE)
        for state in bus.take("monitor/state"):
            self.heard_at = time
            self.is_held |= state == "ERROR"
        is_silent = time - self.heard_at > SILENT_AFTER  # the bug: this must be held, too
        bus.publish("gate/brake", self.is_held or is_silent)

        self.wanted = bus.latest("planner/speed", self.wanted)
        self.brakes = bus.latest("gate/brake", self.brakes)
        change = (0.0 if self.brakes else self.wanted) - self.speed
        self.speed += max(-3.0 * self.step_length, min(1.5 * self.step_length, change))
        if time >= LOST_AT:
            self.offset += DRIFT * self.speed * self.step_length
        bus.publish("truth/offset", self.offset)
