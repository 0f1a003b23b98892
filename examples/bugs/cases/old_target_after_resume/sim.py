"""An operator jogs an arm; in between a planner moves it, while servoing is paused; then the operator jogs again.

The servo loop keeps the position that it commanded last. Normally the first jog after the pause makes it start from
where the arm is. But without a fresh jog it publishes the kept position, also right after the pause, when the planner
has moved the arm elsewhere: the arm jumps back: https://github.com/moveit/moveit2/pull/707
"""

from bugs.protocol import Bus

PLAN_BEGINS, PLAN_ENDS = 5.0, 9.0  # s
PLAN_SPEED = 0.4  # rad/s
JOG_TIMEOUT = 0.1  # s
FASTEST = 3.0  # what the drive can do, rad/s


class Simulator:
    subscribes = ("operator/jog", "servo/paused", "servo/target")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.angle, self.target = 0.0, 0.0
        self.jog, self.jogged_at = 0.0, -1.0
        self.is_paused, self.resumes = False, False
        self.last_command = 0.0

    def step(self, time: float, bus: Bus) -> None:
        planning = PLAN_BEGINS <= time < PLAN_ENDS
        if not planning:
            bus.publish("operator/jog", 0.1 if time < PLAN_BEGINS else -0.05)
        bus.publish("servo/paused", planning)
        self.servo(time, planning, bus)

        before = self.angle
        if planning:
            self.angle += PLAN_SPEED * self.step_length
            self.target = self.angle
        else:
            most = FASTEST * self.step_length
            self.angle += max(-most, min(most, self.target - self.angle))
        bus.publish("truth/speed", abs(self.angle - before) / self.step_length)

    def servo(self, time: float, planning: bool, bus: Bus) -> None:
        self.is_paused = bus.latest("servo/paused", self.is_paused)
        for velocity in bus.take("operator/jog"):
            self.jog, self.jogged_at = velocity, time
        if planning or self.is_paused:
            self.resumes = True
            return
        if time - self.jogged_at < JOG_TIMEOUT:
            if self.resumes:
                self.last_command, self.resumes = self.angle, False
            self.last_command += self.jog * self.step_length
        # The bug: without a fresh jog, nothing should be published.
        bus.publish("servo/target", self.last_command)
        self.target = bus.latest("servo/target", self.target)
