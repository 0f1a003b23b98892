"""An underwater vehicle dives to 15 m, two metres above the sea bed, looks around, and rises to 5 m.

It estimates its depth from a velocity log, which measures its speed over the sea bed by sound, and slowly corrects that
by pressure. A log that has lost the sea bed reports a velocity of zero, and that it has no lock. The estimator does not
look at the lock, so it believes that it stands still while it dives:
https://github.com/ArduPilot/ardupilot/pull/28548
"""

from bugs.protocol import Bus

SURVEY_DEPTH, WAITING_DEPTH = 15.0, 5.0  # m
DIVES_AT, RISES_AT = 2.0, 45.0  # s
SEA_BED = 17.0  # m
FASTEST = 0.6  # m/s
CORRECTION = 0.03  # of the difference to the pressure's depth, twice per second


class Simulator:
    subscribes = ("log/velocity", "pressure/depth", "thruster")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.depth, self.velocity = WAITING_DEPTH, 0.0
        self.estimate, self.measured = WAITING_DEPTH, 0.0
        self.thrust = 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        bus.publish("log/velocity", {"down": self.velocity, "locked": True})
        if self.steps % 5 == 0:
            bus.publish("pressure/depth", self.depth)

        for reading in bus.take("log/velocity"):
            self.measured = reading["down"]  # the bug: also without a lock
        self.estimate += self.measured * self.step_length
        for depth in bus.take("pressure/depth"):
            self.estimate += CORRECTION * (depth - self.estimate)
        goal = SURVEY_DEPTH if DIVES_AT <= time < RISES_AT else WAITING_DEPTH
        bus.publish("thruster", max(-FASTEST, min(FASTEST, 0.4 * (goal - self.estimate))))

        self.thrust = bus.latest("thruster", self.thrust)
        self.velocity += (self.thrust - self.velocity) * self.step_length / 0.8
        self.depth += self.velocity * self.step_length
        bus.publish("truth/altitude", SEA_BED - self.depth)
