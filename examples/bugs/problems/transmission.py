"""A car with an automatic transmission of four gears, from a standing start: the model of the falsification contests.

A driver holds the throttle as each problem says, and does not brake. The engine turns the impeller of a torque
converter, whose turbine drives the wheels through the gearbox. With `n` the speed of the engine, `w` that of the wheels
(both in 1/min) and `g` the ratio of the gear, the turbine turns `s = 3.23 g w / n` times as fast as the impeller.
Tables say for each `s` how much torque the converter takes up, and by how much it multiplies it:

    0.02199 dn/dt = engine torque(throttle, n) - (n / capacity(s))²
    12.0941 dw/dt = 3.23 g gain(s) (n / capacity(s))² - 40 - 0.02 v² - brake

Torques are in ft lb, and the car's speed `v` in miles per hour. A gear is left once the speed has been beyond a limit,
which depends on gear and throttle, for 0.08 s. All numbers are those of the demonstration by The MathWorks that the
contests use; the differential equations are integrated by Heun's method.

B. Hoxha, H. Abbas, G. Fainekos: Benchmarks for temporal logic requirements for automotive systems. ARCH 2014.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence

from bugs.protocol import Bus

ENGINE_INERTIA, WHEEL_INERTIA = 0.02199, 12.0941
FINAL_DRIVE = 3.23
GEARS = (2.393, 1.45, 1.0, 0.677)
MILES_PER_HOUR = 2.0 * math.pi * 60.0 / 5280.0  # of wheels with a radius of a foot that turn once per minute
SUBSTEP = 0.02  # s
DECISION = 0.04  # s from one look at the limits of the gear to the next
PATIENCE = 2  # looks that must agree before a gear is left

# Torque of the engine by its speed from 800 to 4800/min in steps of 400/min, for each throttle.
SPEEDS = tuple(range(800, 4801, 400))
THROTTLES = (0.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0)
TORQUES = (
    (-40, -44, -49, -53, -57, -61, -65, -70, -74, -78, -82),
    (215, 117, 85, 66, 44, 29, 10, -2, -13, -22, -32),
    (245, 208, 178, 148, 122, 104, 85, 66, 48, 33, 18),
    (264, 260, 241, 219, 193, 167, 152, 133, 119, 96, 85),
    (264, 279, 282, 275, 260, 238, 223, 208, 189, 171, 152),
    (267, 290, 293, 297, 290, 275, 260, 256, 234, 212, 193),
    (267, 297, 305, 305, 305, 301, 293, 282, 267, 249, 226),
    (267, 301, 308, 312, 319, 323, 319, 316, 297, 279, 253),
    (267, 301, 312, 319, 327, 327, 327, 327, 312, 293, 267),
    (267, 301, 312, 319, 327, 334, 334, 334, 319, 305, 275),
)
# The converter: 1/min by the root of the torque that it takes up, and what it multiplies this torque by.
SLIPS = (
    0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.81, 0.82, 0.83, 0.84, 0.85, 0.86, 0.87, 0.88, 0.89, 0.9, 0.92, 0.94,
)  # fmt: skip
CAPACITIES = (
    137.4652, 137.0650, 135.8644, 135.6644, 137.5653, 140.3666, 145.2689, 152.8725, 162.9773, 164.2779, 166.1788,
    167.9797, 170.0807, 172.7820, 175.3832, 179.5852, 183.5871, 189.8901, 197.6938, 215.9024, 244.5160,
)  # fmt: skip
GAINS = (
    2.232, 2.075, 1.975, 1.846, 1.72, 1.564, 1.409, 1.254, 1.096, 1.08, 1.061, 1.043, 1.028, 1.012, 1.002, 1.002, 1.001,
    0.998, 0.999, 1.001, 1.002,
)  # fmt: skip
# By throttle: the speeds in mph above which the first, second and third gear is left for the next one, and those below
# which the second, third and fourth gear is left for the one before.
UP_THROTTLES, UP = (0, 25, 35, 50, 90, 100), (
    (10, 10, 15, 23, 40, 40), (30, 30, 30, 41, 70, 70), (50, 50, 50, 60, 100, 100),
)  # fmt: skip
DOWN_THROTTLES, DOWN = (0, 5, 40, 50, 90, 100), (
    (5, 5, 5, 5, 30, 30), (20, 20, 25, 30, 50, 50), (35, 35, 40, 50, 80, 80),
)  # fmt: skip


def between(places: Sequence[float], values: Sequence[float], at: float) -> float:
    """The value at a place of a table; beyond its ends, the outermost pieces go on."""
    after = min(max(bisect_right(places, at), 1), len(places) - 1)
    low, high = places[after - 1], places[after]
    return values[after - 1] + (values[after] - values[after - 1]) * (at - low) / (high - low)


class Transmission:
    throttle = 0.0  # % of what is possible, by the driver
    subscribes = ("pedals/throttle", "pedals/brake")

    def __init__(self, seed: int, step: float) -> None:
        self.substeps = round(step / SUBSTEP)
        self.count = 0
        self.opened, self.braked = 0.0, 0.0  # %, ft lb: the pedals as the car knows them
        self.engine, self.wheels = 1000.0, 0.0  # 1/min
        self.gear, self.faster, self.slower = 0, 0, 0
        self.top_engine, self.top_speed = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("pedals/throttle", self.throttle)
        bus.publish("pedals/brake", 0.0)
        self.opened = bus.latest("pedals/throttle", self.opened)
        self.braked = bus.latest("pedals/brake", self.braked)

        torques = [between(THROTTLES, column, self.opened) for column in zip(*TORQUES)]
        for _ in range(self.substeps):
            if self.count % round(DECISION / SUBSTEP) == 0:
                self.shift()
            self.count += 1
            self.turn(torques)
            self.top_engine = max(self.top_engine, self.engine)
        speed = self.wheels * MILES_PER_HOUR
        if time <= 20.0:
            self.top_speed = max(self.top_speed, speed)
        bus.publish("truth/top_engine", self.top_engine)
        bus.publish("truth/top_speed", self.top_speed)

    def shift(self) -> None:
        speed, gear = self.wheels * MILES_PER_HOUR, self.gear
        faster = gear < 3 and speed > between(UP_THROTTLES, UP[gear], self.opened)
        slower = gear > 0 and speed < between(DOWN_THROTTLES, DOWN[gear - 1], self.opened)
        self.faster, self.slower = (self.faster + 1 if faster else 0), (self.slower + 1 if slower else 0)
        if self.faster > PATIENCE:
            self.gear, self.faster = gear + 1, 0
        elif self.slower > PATIENCE:
            self.gear, self.slower = gear - 1, 0

    def turn(self, torques: list[float]) -> None:
        """Turns engine and wheels for a substep. An engine has limits, and brakes do not turn wheels back."""
        slopes = self.slopes(self.engine, self.wheels, torques)
        ahead = self.engine + SUBSTEP * slopes[0], max(0.0, self.wheels + SUBSTEP * slopes[1])
        after = self.slopes(max(600.0, min(6000.0, ahead[0])), ahead[1], torques)
        self.engine = max(600.0, min(6000.0, self.engine + 0.5 * SUBSTEP * (slopes[0] + after[0])))
        self.wheels = max(0.0, self.wheels + 0.5 * SUBSTEP * (slopes[1] + after[1]))

    def slopes(self, engine: float, wheels: float, torques: list[float]) -> tuple[float, float]:
        ratio = FINAL_DRIVE * GEARS[self.gear]
        slip = ratio * wheels / engine
        taken = (engine / between(SLIPS, CAPACITIES, slip)) ** 2
        speed = wheels * MILES_PER_HOUR
        resistance = 40.0 + 0.02 * speed * speed + self.braked if wheels > 0.0 else 0.0
        driving = ratio * between(SLIPS, GAINS, slip) * taken
        return (between(SPEEDS, torques, engine) - taken) / ENGINE_INERTIA, (driving - resistance) / WHEEL_INERTIA
