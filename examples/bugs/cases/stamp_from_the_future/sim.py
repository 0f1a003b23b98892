"""An arm is jogged by hand: a joint moves as long as the operator holds a key.

While a key is held, the pendant sends velocities with time stamps, and afterwards nothing. The servo loop stops the
joint once the last message is stale. It compares the sender's stamp with its own clock, so a pendant whose clock is
ahead sends messages that are never stale in time, and the joint moves on after the key was released:
https://github.com/moveit/moveit2/issues/772
"""

from bugs.protocol import Bus

# Keys that are held: from and until (s), and the velocity (rad/s).
KEYS = ((1.0, 2.5, 0.5), (4.0, 5.0, -0.4), (8.0, 10.0, 0.3), (13.0, 14.0, -0.5))
STALE_AFTER = 0.2  # s


class Simulator:
    subscribes = ("pendant/jog", "servo/velocity")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.angle, self.velocity = 0.0, 0.0
        self.jog = {"stamp": -1.0, "velocity": 0.0}
        self.coasting = 0.0  # for how long the joint has moved without a key

    def step(self, time: float, bus: Bus) -> None:
        held = [velocity for start, end, velocity in KEYS if start <= time < end]
        if held:
            bus.publish("pendant/jog", {"stamp": time, "velocity": held[0]})
        self.jog = bus.latest("pendant/jog", self.jog)
        # The bug: the stamp of another clock. A message is as old as the time since it was received.
        is_stale = time - self.jog["stamp"] > STALE_AFTER
        bus.publish("servo/velocity", 0.0 if is_stale else self.jog["velocity"])

        self.velocity = bus.latest("servo/velocity", self.velocity)
        self.angle += self.velocity * self.step_length
        moves = abs(self.velocity) > 1e-6
        self.coasting = self.coasting + self.step_length if moves and not held else 0.0
        bus.publish("truth/angle", self.angle)
        bus.publish("truth/coasting", self.coasting)
