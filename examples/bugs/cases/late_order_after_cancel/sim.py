"""A fleet control and two vehicles at a crossing, with messages as in VDA 5050.

Vehicle 1 gets an order to drive across, and a cancel before it is there. It stops and reports that it is idle; then the
crossing belongs to vehicle 2. The control sends an order again that is not acknowledged in time. The vehicle ignores an
order that it already has, but a cancel makes it forget which one that was: an order that arrives after the cancel is a
new order, and vehicle 1 drives across too. Implementations differ in what a vehicle may forget, and in repeated orders:
https://github.com/VDA5050/VDA5050/issues/183, https://github.com/VDA5050/VDA5050/issues/342
"""

from bugs.protocol import Bus

CROSSING = 10.0  # m
GOAL = 20.0
ORDER_AT, CANCEL_AT = 1.0, 6.0  # s
REPEAT_AFTER = 1.5
CLEARANCE = 2.0  # s from the report that vehicle 1 is idle until vehicle 2 drives


class Simulator:
    subscribes = ("agv1/order", "agv1/instantActions", "agv1/state")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        # Fleet control.
        self.ordered_at: float | None = None
        self.is_acknowledged, self.is_cancelled = False, False
        self.free_at: float | None = None  # since when the crossing belongs to vehicle 2
        # The vehicles.
        self.order, self.goal = 0, 0.0
        self.position, self.speed = 0.0, 0.0
        self.other = -14.0

    def step(self, time: float, bus: Bus) -> None:
        self.steps += 1
        self.control(time, bus)
        self.vehicle(bus)
        if self.free_at is not None and time > self.free_at + CLEARANCE:
            self.other = min(CROSSING, self.other + self.step_length)
        # Their corridors cross at a right angle.
        bus.publish("truth/gap", max(abs(self.position - CROSSING), abs(self.other)))

    def control(self, time: float, bus: Bus) -> None:
        for state in bus.take("agv1/state"):
            self.is_acknowledged |= state["orderUpdateId"] == 1
            if self.is_cancelled and state["idle"] and state["position"] < CROSSING - 1.0 and self.free_at is None:
                self.free_at = time
        is_due = time >= ORDER_AT if self.ordered_at is None else time - self.ordered_at > REPEAT_AFTER
        if is_due and not self.is_acknowledged and not self.is_cancelled:
            self.ordered_at = time
            bus.publish("agv1/order", {"orderUpdateId": 1, "goal": GOAL})
        if time >= CANCEL_AT and not self.is_cancelled:
            self.is_cancelled = True
            bus.publish("agv1/instantActions", "cancelOrder")

    def vehicle(self, bus: Bus) -> None:
        for order in bus.take("agv1/order"):
            if order["orderUpdateId"] != self.order:
                self.order, self.goal = order["orderUpdateId"], order["goal"]
        if "cancelOrder" in bus.take("agv1/instantActions"):
            self.order = 0  # the bug: it should remember what was cancelled
            self.goal = min(self.goal, self.position + 0.5)
        self.speed = max(0.0, min(1.0, 2.0 * (self.goal - self.position)))
        self.position += self.speed * self.step_length
        if self.steps % 4 == 0:
            idle = self.speed < 0.01
            bus.publish("agv1/state", {"orderUpdateId": self.order, "position": self.position, "idle": idle})
