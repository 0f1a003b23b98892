"""A robot takes the lift. A nurse has just left it, so its door may still be open.

Normally the robot asks for a session: the lift comes, opens, and keeps its door open until the robot has gone in. But
the robot's adapter begins a session only if it finds the door closed. If the door happens to be open, the robot goes in
without one, and nothing keeps the lift from closing: https://github.com/open-rmf/rmf_ros2/issues/314. A light curtain
at the door is our addition; it opens the door again, as in any lift.
"""

from bugs.protocol import Bus

NURSE_LEAVES, DOOR_CLOSES = 4.0, 9.0  # s
ARRIVES = 12.0
SESSION_ENDS_AFTER = 4.0  # s without a request
DOOR_SPEED, WIDTH = 0.5, 1.2  # share per second; m
ROBOT_WIDTH, ROBOT_SPEED = 0.7, 0.5  # m; m/s
DOORWAY, CURTAIN = (0.5, 2.0), (0.3, 2.0)  # where the robot is in the door, and where the curtain sees it, m
INSIDE = 3.0


class Simulator:
    subscribes = ("lift/state", "lift/close", "lift/curtain", "robot/request")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        # The lift.
        self.door, self.opens, self.is_blocked = 0.0, False, False  # 1 is open
        self.requested_at = -SESSION_ENDS_AFTER - 1.0
        # The robot.
        self.sees_open, self.in_session = False, False
        self.position, self.enters = 0.0, False

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        if self.steps % 5 == 0:
            bus.publish("lift/state", self.door > 0.9)
        bus.publish("lift/curtain", CURTAIN[0] <= self.position <= CURTAIN[1])
        self.lift(time, bus)
        self.robot(time, bus)
        room = WIDTH * self.door if DOORWAY[0] <= self.position <= DOORWAY[1] else WIDTH
        bus.publish("truth/room", room - ROBOT_WIDTH)

    def lift(self, time: float, bus: Bus) -> None:
        if bus.take("robot/request"):
            self.requested_at = time
        has_session = time - self.requested_at < SESSION_ENDS_AFTER
        if NURSE_LEAVES <= time < DOOR_CLOSES or has_session:
            self.opens = True
        elif self.opens and self.steps % 10 == 0:
            bus.publish("lift/close", True)
        if bus.take("lift/close") and not has_session:
            self.opens = False
        self.is_blocked = bus.latest("lift/curtain", self.is_blocked)
        change = DOOR_SPEED * self.step_length * (1 if self.opens or self.is_blocked else -1)
        self.door = max(0.0, min(1.0, self.door + change))

    def robot(self, time: float, bus: Bus) -> None:
        self.sees_open = bus.latest("lift/state", self.sees_open)
        if time < ARRIVES or self.position >= INSIDE:
            return
        if self.sees_open and self.door > 0.7:  # the robot's own laser sees the door, too
            self.enters = True  # the bug: also without a session
        elif not self.enters:
            self.in_session = True
        if self.in_session and self.steps % 10 == 0:
            bus.publish("robot/request", True)
        if self.enters and (self.door > 0.7 or self.position >= DOORWAY[0]):
            self.position += ROBOT_SPEED * self.step_length
