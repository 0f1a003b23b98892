"""A spacecraft takes a picture, and later turns its camera towards the sun; by then the cover must be closed.

A sequencer sends one command after another: each time it waits for the response to the last one, and gives up the
sequence if none comes in time. It takes any response for that of the command that it waits for. So a response that
comes late, or twice, completes another command that is not done yet: https://github.com/nasa/fprime/issues/5663,
https://github.com/nasa/fprime/issues/5899
"""

from bugs.protocol import Bus

# When each sequence begins (s), and its commands.
SEQUENCES = ((2.0, ("open", "expose", "close")), (20.0, ("wake", "close", "turn")))
TIMEOUT = 6.0  # s
COVER_SPEED = 0.25  # of its way per second
TAKES = {"expose": 3.0, "wake": 1.0, "turn": 2.0}  # s


class Simulator:
    subscribes = ("sequencer/command", "devices/response", "devices/cover")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        # The sequencer.
        self.sequences = list(SEQUENCES)
        self.commands: list[str] = []
        self.waits_until: float | None = None
        # The devices.
        self.cover, self.cover_goal = 0.0, 0.0  # 1 is open
        self.busy: dict[str, float] = {}  # until when
        self.turned, self.sunlight = False, 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        self.sequence(time, bus)
        self.work(time, bus)
        bus.publish("truth/sunlight", self.sunlight)

    def sequence(self, time: float, bus: Bus) -> None:
        for _ in bus.take("devices/response"):  # the bug: of whatever command
            if self.waits_until is not None:
                self.waits_until = None
                self.send(time, bus)
        if self.waits_until is not None and time > self.waits_until:
            self.commands, self.waits_until = [], None
        if self.sequences and time >= self.sequences[0][0]:
            self.commands = list(self.sequences.pop(0)[1])
            self.send(time, bus)
        bus.take("devices/cover")  # for the ground station

    def send(self, time: float, bus: Bus) -> None:
        if self.commands:
            self.waits_until = time + TIMEOUT
            bus.publish("sequencer/command", self.commands.pop(0))

    def work(self, time: float, bus: Bus) -> None:
        for command in bus.take("sequencer/command"):
            if command in TAKES:
                self.busy[command] = time + TAKES[command]
            else:
                self.cover_goal = 1.0 if command == "open" else 0.0
                self.busy[command] = time + abs(self.cover_goal - self.cover) / COVER_SPEED
        most = COVER_SPEED * self.step_length
        self.cover += max(-most, min(most, self.cover_goal - self.cover))
        for command in [command for command, until in self.busy.items() if time >= until]:
            del self.busy[command]
            self.turned |= command == "turn"
            bus.publish("devices/response", "OK")
        if self.steps % 10 == 0:
            bus.publish("devices/cover", self.cover)
        self.sunlight += self.turned * self.cover * self.step_length
