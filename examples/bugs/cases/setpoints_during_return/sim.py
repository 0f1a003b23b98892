"""A drone inspects a line until its battery is low; then it returns and lands.

While a computer on board flies the drone, it sends targets, and stops when it hears that the mode has changed. The
return writes its target into the same variable, and whatever was written last is obeyed, in every mode. So as long as
the computer has not heard of the return, or targets of before arrive late, the drone flies on:
https://github.com/PX4/PX4-Autopilot/issues/19005
"""

from bugs.protocol import Bus

SURVEY_SPEED, SPEED = 2.0, 4.0  # m/s
RETURN_AT = 15.5  # s
BATTERY = 17.5  # seconds of flight that are left when the return begins


class Simulator:
    subscribes = ("autopilot/mode", "autopilot/home", "computer/target")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.position, self.target = 0.0, 0.0  # m along the line, from home
        self.survey, self.mode = 10.0, "OFFBOARD"
        self.home, self.reserve, self.has_landed = 0.0, BATTERY, False

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        returns = time >= RETURN_AT
        if self.steps % 10 == 0:
            bus.publish("autopilot/mode", "RETURN" if returns else "OFFBOARD")
            bus.publish("autopilot/home", 0.0)
        self.mode = bus.latest("autopilot/mode", self.mode)
        if self.mode == "OFFBOARD":
            self.survey += SURVEY_SPEED * self.step_length
            bus.publish("computer/target", self.survey)

        self.home = bus.latest("autopilot/home", self.home)
        self.target = self.home if returns else self.target
        self.target = bus.latest("computer/target", self.target)  # the bug: also while it returns
        most = 0.0 if self.has_landed else SPEED * self.step_length
        self.position += max(-most, min(most, self.target - self.position))
        self.has_landed |= returns and abs(self.position - self.home) < 0.1
        if returns and not self.has_landed:
            self.reserve = BATTERY - (time - RETURN_AT) - abs(self.position) / SPEED
        bus.publish("truth/reserve", self.reserve)
