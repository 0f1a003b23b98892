"""A linear axis moves between two positions, with mechanical ends close behind them.

A publisher sends the state of the axis 25 times per second, as its clock says: once `now` has reached the time of the
next message. If the clock is set back, it is silent until the clock has caught up. The controller goes on with the last
state that it has, and drives the axis into an end: https://github.com/ros-controls/ros_controllers/issues/101
"""

from bugs.protocol import Bus

PERIOD = 0.04  # s
NEAR, FAR = 0.1, 0.8  # m
FASTEST = 0.4  # m/s


class Simulator:
    subscribes = ("clock", "axis/state", "axis/command")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.position, self.velocity = 0.0, 0.0
        self.now, self.next = 0.0, 0.0  # of the publisher's clock
        self.state, self.command = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("clock", time)
        self.now = bus.latest("clock", self.now)
        if self.now >= self.next:  # the bug: a jump back must reset `next`
            self.next = self.now + PERIOD
            bus.publish("axis/state", self.position)

        self.state = bus.latest("axis/state", self.state)
        goal = FAR if int(time / 6.0) % 2 == 0 else NEAR
        bus.publish("axis/command", max(-FASTEST, min(FASTEST, 2.0 * (goal - self.state))))

        self.command = bus.latest("axis/command", self.command)
        self.velocity += (self.command - self.velocity) * min(1.0, self.step_length / 0.1)
        self.position += self.velocity * self.step_length
        bus.publish("truth/position", self.position)
