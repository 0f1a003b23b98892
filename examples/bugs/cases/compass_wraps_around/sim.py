"""A rover drives on a track that runs at a heading of 176 degrees, close to where a compass wraps around.

Its heading filter is a plain low-pass. A reading of -179 degrees right after one of 179 is a turn by 2 degrees, but the
filter sees a step of 358 and takes its estimate through zero; meanwhile the rover steers the other way. A filter that
did not know that yaw wraps around, on a helicopter: https://github.com/ethz-asl/mav_control_rw/pull/19
"""

import math

from bugs.protocol import Bus

TRACK = 176.0  # heading of the track, degrees
SPEED = 1.0  # m/s


def wrapped(angle: float) -> float:
    """The same direction from -180 to 180 degrees."""
    return (angle + 180.0) % 360.0 - 180.0


class Simulator:
    subscribes = ("compass", "gps/offset", "steer")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.heading, self.estimate = TRACK, TRACK
        self.offset, self.measured = 0.0, 0.0  # from the middle of the track, m
        self.turning = 0.0  # degrees per second

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        bus.publish("compass", wrapped(self.heading))
        if self.steps % 5 == 0:
            bus.publish("gps/offset", self.offset)

        for reading in bus.take("compass"):
            # The bug: the difference of two angles must be wrapped.
            self.estimate += 0.08 * (wrapped(reading) - self.estimate)
        self.measured = bus.latest("gps/offset", self.measured)
        wanted = TRACK + max(-2.0, min(2.0, 4.0 * self.measured))
        bus.publish("steer", max(-20.0, min(20.0, 0.8 * (wanted - self.estimate))))

        self.turning = bus.latest("steer", self.turning)
        self.heading += self.turning * self.step_length
        self.offset -= SPEED * math.sin(math.radians(self.heading - TRACK)) * self.step_length
        bus.publish("truth/offset", self.offset)
