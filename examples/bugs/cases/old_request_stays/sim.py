"""Two delivery robots in a hospital need the same corridor, one after the other; the second one has medicine.

A robot asks for the corridor once per second until it has it. The laundry robot's task is cancelled at 7 s, so it must
give back what it has and forget what it asked for. Its adapter has two lists, and removes from the list of what it has
in both cases. So a request that was not answered yet stays: the robot gets the corridor, and keeps it for ever:
https://github.com/open-rmf/rmf_ros2/pull/473, and how that looks https://github.com/open-rmf/rmf_ros2/issues/448
"""

from bugs.protocol import Bus

LAUNDRY_AT, CANCELLED_AT, MEDICINE_AT = 3.0, 7.0, 9.0  # s
EXPIRES_AFTER = 4.0  # s without a word from the robot that has the corridor


class Simulator:
    subscribes = ("laundry/request", "medicine/request", "corridor/holder")

    def __init__(self, seed: int, step: float) -> None:
        self.steps = 0
        # The supervisor of the corridor.
        self.holder, self.heard_at = "", 0.0
        # The robots. `holds` and `asks` are the two lists of the laundry robot, with room for one entry.
        self.holds, self.asks, self.is_cancelled = False, False, False
        self.may_pass, self.waited = False, 0.0
        self.step_length = step

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        for holder in bus.take("corridor/holder"):
            if holder == "laundry" and self.asks:
                self.holds, self.asks = True, False
            self.may_pass |= holder == "medicine"
        self.laundry(time, bus)
        if time >= MEDICINE_AT and not self.may_pass:
            self.waited += self.step_length
        if time >= MEDICINE_AT and self.steps % 10 == 0:
            bus.publish("medicine/request", True)
        self.supervise(time, bus)
        bus.publish("truth/waited", self.waited)

    def laundry(self, time: float, bus: Bus) -> None:
        self.asks |= LAUNDRY_AT <= time < LAUNDRY_AT + self.step_length
        if time >= CANCELLED_AT and not self.is_cancelled:
            self.is_cancelled = True
            bus.publish("laundry/request", False)
            self.holds = False  # the bug: `asks` must become false, too
        if (self.asks or self.holds) and self.steps % 10 == 0:
            bus.publish("laundry/request", True)

    def supervise(self, time: float, bus: Bus) -> None:
        for name in ("laundry", "medicine"):
            for wants in bus.take(f"{name}/request"):
                if wants and self.holder in ("", name):
                    self.holder, self.heard_at = name, time
                elif not wants and self.holder == name:
                    self.holder = ""
        if self.holder and time - self.heard_at > EXPIRES_AFTER:
            self.holder = ""
        if self.steps % 5 == 0:
            bus.publish("corridor/holder", self.holder)
