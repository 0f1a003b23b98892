"""A ground station sends a drone a mission around a closed area, and starts it once the drone has accepted it.

The drone asks for one item after another, and gives up if the next one does not come in time. When the item that it
received last comes again, it acknowledges the whole mission once more, in case its first acknowledgement was lost. It
does so after an upload that it gave up, too. Then the station starts a mission that the drone does not have, and the
drone flies its old one: https://github.com/PX4/PX4-Autopilot/pull/28738
"""

import math

from bugs.protocol import Bus

OLD = ((0.0, 0.0), (80.0, 0.0))
NEW = ((0.0, 0.0), (10.0, 30.0), (70.0, 30.0), (80.0, 0.0))
CLOSED_AT, CLOSED_RADIUS = (40.0, 0.0), 15.0  # m
UPLOAD_AT, UPLOAD_AGAIN_AFTER = 2.0, 15.0  # s
ASK_AGAIN_AFTER, GIVE_UP_AFTER = 1.0, 4.0  # s
SPEED = 4.0  # m/s


class Simulator:
    subscribes = ("station/count", "station/item", "station/start", "drone/request", "drone/ack")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        # The station.
        self.next_upload, self.is_accepted = UPLOAD_AT, False
        # The drone.
        self.mission, self.position, self.leg = OLD, (0.0, 0.0), 0  # no leg: on the ground
        self.items: list[tuple[float, float]] = []
        self.count, self.expected, self.is_uploading = 0, 0, False
        self.asked_at, self.received_at = 0.0, 0.0

    def step(self, time: float, bus: Bus) -> None:
        self.station(time, bus)
        self.upload(time, bus)
        if bus.take("station/start") and self.leg == 0:
            self.leg = 1
        if 0 < self.leg < len(self.mission):
            way = math.dist(self.position, self.mission[self.leg])
            share = min(1.0, SPEED * self.step_length / way)
            self.position = tuple(a + share * (b - a) for a, b in zip(self.position, self.mission[self.leg]))
            self.leg += share == 1.0
        bus.publish("truth/clearance", math.dist(self.position, CLOSED_AT) - CLOSED_RADIUS)

    def station(self, time: float, bus: Bus) -> None:
        for number in bus.take("drone/request"):
            bus.publish("station/item", {"number": number, "x": NEW[number][0], "y": NEW[number][1]})
        if bus.take("drone/ack") and not self.is_accepted:
            self.is_accepted = True
            bus.publish("station/start", True)
        if time >= self.next_upload and not self.is_accepted:
            self.next_upload = time + UPLOAD_AGAIN_AFTER
            bus.publish("station/count", len(NEW))

    def upload(self, time: float, bus: Bus) -> None:
        for count in bus.take("station/count"):
            self.count, self.expected, self.items, self.is_uploading = count, 0, [], True
            self.asked_at, self.received_at = -ASK_AGAIN_AFTER, time
        for item in bus.take("station/item"):
            if self.is_uploading and item["number"] == self.expected:
                self.items.append((item["x"], item["y"]))
                self.expected, self.asked_at, self.received_at = self.expected + 1, -ASK_AGAIN_AFTER, time
                if self.expected == self.count:
                    self.mission, self.is_uploading = tuple(self.items), False
                    bus.publish("drone/ack", "accepted")
            elif not self.is_uploading and item["number"] == self.expected - 1:
                bus.publish("drone/ack", "accepted")  # the bug: also if items are missing
        if self.is_uploading and time - self.received_at > GIVE_UP_AFTER:
            self.is_uploading = False
        elif self.is_uploading and time - self.asked_at > ASK_AGAIN_AFTER:
            self.asked_at = time
            bus.publish("drone/request", self.expected)
