"""A ground station makes a drone grab a load, fly over people, and drop the load behind them.

The command says "the other state". A gripper needs half a second, then the drone acknowledges. A station that hears no
acknowledgement sends the command again, so a late or lost one makes the gripper open over people. The report is of
acknowledgements that came too late, and of commands that were sent again every three seconds because of that; that the
command toggles is our addition: https://github.com/PX4/PX4-Autopilot/pull/20331
"""

from bugs.protocol import Bus

GRAB_AT, DROP_AT = 3.0, 25.0  # s
LOAD_UNTIL = 8.0  # the load stands there until the drone flies on
PEOPLE_FROM, PEOPLE_UNTIL = 8.0, 22.0
REPEAT_AFTER, MOST_TRIES = 2.0, 5
GRIPPER_NEEDS = 0.5


class Simulator:
    subscribes = ("station/command", "drone/ack", "drone/state")

    def __init__(self, seed: int, step: float) -> None:
        self.steps = 0
        # The ground station.
        self.plan = [GRAB_AT, DROP_AT]
        self.waits, self.sent_at, self.tries = False, 0.0, 0
        # The drone.
        self.is_closed, self.has_load = False, False
        self.moved_at: float | None = None  # when the gripper began to move
        self.fallen = 0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        self.station(time, bus)
        self.drone(time, bus)
        bus.publish("truth/fallen", self.fallen)

    def station(self, time: float, bus: Bus) -> None:
        if bus.take("drone/ack"):
            self.waits = False
        bus.take("drone/state")  # shown to the pilot
        if self.plan and time >= self.plan[0]:
            self.plan.pop(0)
            self.waits, self.tries = True, 0
        elif not (self.waits and time - self.sent_at > REPEAT_AFTER and self.tries < MOST_TRIES):
            return
        self.sent_at, self.tries = time, self.tries + 1
        bus.publish("station/command", "toggle")  # the bug: a command that means something else when it comes again

    def drone(self, time: float, bus: Bus) -> None:
        for _ in bus.take("station/command"):
            self.is_closed = not self.is_closed
            self.moved_at = time
        if self.moved_at is not None and time - self.moved_at >= GRIPPER_NEEDS:
            self.moved_at = None
            bus.publish("drone/ack", "done")
        if self.is_closed and GRAB_AT <= time < LOAD_UNTIL:
            self.has_load = True
        if self.has_load and not self.is_closed:
            self.has_load = False
            self.fallen += PEOPLE_FROM <= time < PEOPLE_UNTIL
        if self.steps % 10 == 0:
            bus.publish("drone/state", self.is_closed)
