"""A car with adaptive cruise control follows another one, which brakes hard twice.

The car ahead radios its speed, and a radar measures the gap. The controller wants a gap that grows with its own speed,
the same time at any speed. It accelerates in proportion to the errors of gap and speed, within the limits of drive and
brakes, which follow its commands with a time constant.

R. Rajamani: Vehicle dynamics and control. Springer 2012, chapter 6.
"""

from bugs.protocol import Bus

CRUISE = 28.0  # m/s, the speed that the driver has set
STANDSTILL, TIME_GAP = 4.0, 1.4  # m, s
BY_GAP, BY_SPEED = 0.25, 0.7  # m/s² per m, and per m/s
STRONGEST_DRIVE, STRONGEST_BRAKING = 2.0, -6.0  # m/s²
LAG = 0.3  # s, of drive and brakes
# The car ahead: from when on it accelerates by how much, in s and m/s², as long as its speed stays within its limits.
LEAD_SPEEDS = 4.0, 26.0  # m/s
LEAD = ((0.0, 0.0), (12.0, -4.5), (18.0, 1.5), (34.0, -5.0), (42.0, 2.0))


class Simulator:
    subscribes = ("lead/speed", "radar/gap", "ego/speed", "ego/command")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.lead, self.speed, self.acceleration = 24.0, 24.0, 0.0
        self.gap = STANDSTILL + TIME_GAP * self.speed
        self.heard, self.seen, self.own, self.command = self.lead, self.gap, self.speed, 0.0

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("lead/speed", self.lead)
        bus.publish("radar/gap", self.gap)
        bus.publish("ego/speed", self.speed)

        self.heard = bus.latest("lead/speed", self.heard)
        self.seen = bus.latest("radar/gap", self.seen)
        self.own = bus.latest("ego/speed", self.own)
        following = BY_GAP * (self.seen - STANDSTILL - TIME_GAP * self.own) + BY_SPEED * (self.heard - self.own)
        cruising = 0.5 * (CRUISE - self.own)
        bus.publish("ego/command", max(STRONGEST_BRAKING, min(STRONGEST_DRIVE, following, cruising)))

        self.command = bus.latest("ego/command", self.command)
        self.acceleration += (self.command - self.acceleration) * self.step_length / LAG
        before = self.speed
        self.speed = max(0.0, self.speed + self.acceleration * self.step_length)
        wanted = [acceleration for since, acceleration in LEAD if since <= time][-1]
        after = max(LEAD_SPEEDS[0], min(LEAD_SPEEDS[1], self.lead + wanted * self.step_length))
        self.gap += 0.5 * (self.lead + after - before - self.speed) * self.step_length
        self.lead = after
        bus.publish("truth/gap", self.gap)
