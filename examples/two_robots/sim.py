"""Two mobile robots on crossing corridors.

`east` drives back and forth along x, `north` along y; both pass the crossing at the origin repeatedly. Each sends the
other its pose. `east` has the right of way; `north` stops before the crossing while `east`, according to the last pose
received, is in it or about to enter. The simulator exchanges lines of JSON with Sesame: see docs/process.md.
"""

import json
import math
import random
import sys

TURN = 5.0  # metres from the crossing at which a corridor ends
TRIPS = 4  # times that a robot drives from end to end
TIMETABLE = 15.0  # seconds from one departure to the next
STOP_LINE = 1.4  # metres from the crossing at which `north` waits
CLEAR = 1.2  # metres behind the crossing beyond which `east` can be ignored
REACTION = 2.6  # seconds that `north` needs to cross

POSES = {"east": "robots/east/pose", "north": "robots/north/pose"}
COMPLETED = "crossing/completed"


class Robot:
    """A robot on its corridor: `along` metres from the crossing, driving in `direction` (1 or -1)."""

    def __init__(self, along, top_speed):
        self.along, self.direction, self.top_speed = along, 1.0, top_speed
        self.speed, self.trips, self.completed = 0.0, 0, None

    def drive(self, wanted, time, step):
        limit = 1.5 * step  # the most a speed can change in a step
        self.speed += max(-limit, min(limit, wanted - self.speed))
        self.along += self.direction * self.speed * step
        if self.along * self.direction >= TURN:
            self.direction, self.speed, self.trips = -self.direction, 0.0, self.trips + 1
            if self.trips == TRIPS:
                self.completed = time


class World:
    def __init__(self, seed):
        luck = random.Random(seed)
        self.robots = {
            "east": Robot(-TURN, 1.0 + luck.uniform(-0.02, 0.02)),
            "north": Robot(-TURN, 0.95 + luck.uniform(-0.02, 0.02)),
        }
        self.heard = None  # the last pose of `east` that `north` received

    def poses(self):
        messages = []
        for name, robot in self.robots.items():
            position = [robot.along, 0.0, 0.0] if name == "east" else [0.0, robot.along, 0.0]
            velocity = robot.direction * robot.speed
            messages.append({"topic": POSES[name], "value": {"position": position, "velocity": velocity}})
        return messages

    def must_wait(self, robot):
        to_line = -robot.along * robot.direction - STOP_LINE
        if self.heard is None or not -0.1 <= to_line <= 0.4:
            return False
        along, velocity = self.heard["position"][0], self.heard["velocity"]
        direction = math.copysign(1.0, velocity)
        return -REACTION * abs(velocity) - STOP_LINE <= along * direction <= CLEAR

    def step(self, time, step, delivered):
        for message in delivered:
            if message["topic"] == POSES["east"]:
                self.heard = message["value"]
        for name, robot in self.robots.items():
            stands = robot.trips == TRIPS or time < robot.trips * TIMETABLE or (name == "north" and self.must_wait(robot))
            robot.drive(0.0 if stands else robot.top_speed, time, step)
        completed = [robot.completed for robot in self.robots.values()]
        return [] if None in completed else [{"topic": COMPLETED, "value": max(completed)}]


def answer(what):
    """Sends an answer and returns the next request, or None at the end of the input."""
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


def main():
    order = json.loads(sys.stdin.readline() or "null")
    while order:
        if "reset" in order:
            world, step = World(order["reset"]["seed"]), order["reset"]["step"]
            topics = [*POSES.values(), COMPLETED]
            order = answer({"ready": {"publishes": topics, "subscribes": list(POSES.values()), "resets": True}})
        else:
            time, late = order["step"]["time"], order["step"]["messages"]
            in_time = answer({"publish": world.poses()})["deliver"]
            messages = world.step(time, step, late + in_time)
            order = answer({"done": {"messages": messages, "ended": messages != []}})


main()
