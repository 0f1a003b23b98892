"""A car, a walker on the road for ten seconds, and a supervisor for when perception fails.

The planner stops for what perception sees. A monitor notices when perception is silent and reports a hazard; then the
supervisor stops the car. If the reports themselves fall silent, the supervisor changes its state to EMERGENCY, but no
manoeuvre begins. So two losses that overlap leave the car driving with nobody who looks:
https://github.com/autowarefoundation/autoware_universe/pull/6399
"""

from bugs.protocol import Bus

CRUISE = 10.0  # m/s
WALKER_AT, NOBODY_AT = 75.0, 400.0  # m
WALKER_COMES, WALKER_GOES = 9.0, 19.0  # s
PERCEPTION_TIMEOUT, HAZARD_TIMEOUT = 0.6, 0.5  # s


class Simulator:
    subscribes = ("perception/object", "system/hazard", "planning/stop")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.position, self.speed = 0.0, 0.0
        self.object, self.seen_at = NOBODY_AT, 0.0  # distance of what perception sees, m
        self.hazard, self.heard_at = 0, 0.0
        self.state, self.manoeuvre = "NORMAL", False
        self.must_stop = False

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        obstacle = WALKER_AT if WALKER_COMES <= time < WALKER_GOES else NOBODY_AT
        if self.steps % 2 == 0:
            bus.publish("perception/object", obstacle - self.position)
        for distance in bus.take("perception/object"):
            self.object, self.seen_at = distance, time
        if self.steps % 2 == 1:
            bus.publish("system/hazard", 2 if time - self.seen_at > PERCEPTION_TIMEOUT else 0)
        self.supervise(time, bus)

        braking_distance = self.speed**2 / (2 * 4.0) + 0.3 * self.speed + 4.0
        bus.publish("planning/stop", self.object < braking_distance)
        self.must_stop = bus.latest("planning/stop", self.must_stop)
        self.drive(0.0 if self.must_stop or self.manoeuvre else CRUISE)
        bus.publish("truth/gap", obstacle - self.position)

    def supervise(self, time: float, bus: Bus) -> None:
        for level in bus.take("system/hazard"):
            self.hazard, self.heard_at = level, time
        if time - self.heard_at > HAZARD_TIMEOUT:
            self.state = "EMERGENCY"  # the bug: and no manoeuvre
        elif self.hazard >= 2:
            self.state, self.manoeuvre = "EMERGENCY", True
        else:
            self.state, self.manoeuvre = "NORMAL", False

    def drive(self, wanted: float) -> None:
        change = (wanted - self.speed) / self.step_length
        self.speed = max(0.0, self.speed + max(-6.0, min(1.5, change)) * self.step_length)
        self.position += self.speed * self.step_length
