"""Two arms plug drive shafts into an axle gearbox, side by side.

The left one is watched by a certificate of its own, which says on two topics how reliably it plugs. Each arm follows the
targets of its joints with a lag. The simulator exchanges lines of JSON with Sesame: see docs/process.md.
"""

import json
import math
import sys

UPPER_ARM, FOREARM, TOOL = 0.95, 0.95, 0.45  # metres; the tool is the gripper with its shaft
SHOULDER = 0.9  # metres above the ground: the height of the bores
SIDE = 0.75  # metres of each arm to its side of the middle
LAG = 0.15  # seconds by which drives are late
OUTSIDE, INSIDE = 1.70, 1.95  # metres along the bore's axis, of the shaft's tip before and after it is plugged
FACE = 1.80  # metres: where the flange begins
FLANGE, PLAY = 0.2, 0.01  # metres: the radius of the flange, and by how far a shaft may be off its axis
HANDS_OFF = 0.3  # metres that the arms must keep between them
TURNED = 0.1  # radians by which the shaft's splines may be turned

JOINTS = {name: [f"joints/{name}.Link{link}/R" for link in range(1, 7)] for name in ("KR22_825", "KR22_850")}
GEARBOX, GRIPPERS = "joints/KR_50.Link1/R", ["joints/Gripper_825.GripB/T", "joints/Gripper_850.GripA/T"]
TARGETS = [*JOINTS["KR22_825"], *JOINTS["KR22_850"], GEARBOX, *GRIPPERS]
ZONES, ARMS = [f"SafetyZone{number}/events" for number in range(1, 9)], "Collision_850/events"
CONSERT = "Consert_Robot_Left/guarantee_plug_driveshaft_{}_reliability"
ALIGNED, CORRECT = "KR22_left/sim_aligned_centerpoint", "KR22_left/sim_kr22_correct_position"
INSERTED = "KR22_left/shaft_inserted"
REPORTS = [*ZONES, ARMS, CONSERT.format("high"), CONSERT.format("medium"), ALIGNED, CORRECT, INSERTED]


def at_bore(along, above=0.0):
    """The joints with which the tip of the shaft is so far along the axis of the bore, and so far above it."""
    reach = along - TOOL
    far = math.hypot(reach, above)
    bend = math.acos((far * far - UPPER_ARM**2 - FOREARM**2) / (2 * UPPER_ARM * FOREARM))
    lift = math.atan2(above, reach) + math.atan2(FOREARM * math.sin(bend), UPPER_ARM + FOREARM * math.cos(bend))
    return [0.0, lift, -bend, 0.0, bend - lift, 0.0]


def programme(time):
    """Where the shaft's tip is meant to be: it waits above, comes down, is plugged in, let go, and drawn back."""
    if time < 5.0:
        return at_bore(OUTSIDE, 0.4 * (1.0 - max(0.0, time - 1.0) / 4.0))
    if time < 6.0:
        return at_bore(OUTSIDE)
    if time < 12.0:
        return at_bore(OUTSIDE + (INSIDE - OUTSIDE) * min(1.0, (time - 6.0) / 2.5))
    return at_bore(INSIDE - (INSIDE - OUTSIDE) * min(1.0, (time - 12.0) / 2.0))


class Arm:
    def __init__(self, side):
        self.side = side
        self.targets = programme(0.0)
        self.joints = list(self.targets)

    def follow(self, step):
        share = 1.0 - math.exp(-step / LAG)
        self.joints = [joint + share * (target - joint) for joint, target in zip(self.joints, self.targets)]

    def tip(self):
        """The tip of the shaft, and the direction in which it points."""
        turn, lift, bend, roll, pitch, _ = self.joints
        reach = UPPER_ARM * math.cos(lift) + FOREARM * math.cos(lift + bend)
        height = UPPER_ARM * math.sin(lift) + FOREARM * math.sin(lift + bend)
        # The wrist pitches in a plane that the roll of the forearm turns about it.
        along, across = math.cos(pitch), math.sin(pitch)
        level, aside = across * math.cos(roll), across * math.sin(roll)
        slope = lift + bend
        out, up = along * math.cos(slope) - level * math.sin(slope), along * math.sin(slope) + level * math.cos(slope)
        points = [out * math.cos(turn) - aside * math.sin(turn), out * math.sin(turn) + aside * math.cos(turn), up]
        wrist = [reach * math.cos(turn), self.side + reach * math.sin(turn), SHOULDER + height]
        return [at + TOOL * to for at, to in zip(wrist, points)], points


class Cell:
    def __init__(self):
        self.left, self.right = Arm(SIDE), Arm(-SIDE)
        self.by_topic = {}
        for name, arm in (("KR22_825", self.left), ("KR22_850", self.right)):
            self.by_topic.update((topic, (arm, link)) for link, topic in enumerate(JOINTS[name]))
        self.well = {"aligned": 0.0, "correct": 0.0, "plugged": 0.0}  # for how long each has been so, in seconds
        self.inserted = False

    def targets(self, time):
        values = [*programme(time), *programme(time), 0.0, *[0.0 if time < 11.0 else 0.04] * 2]
        return [{"topic": topic, "value": value} for topic, value in zip(TARGETS, values)]

    def step(self, time, step, delivered):
        for message in delivered:
            arm, link = self.by_topic.get(message["topic"], (None, None))
            if arm:
                arm.targets[link] = message["value"]
        self.left.follow(step)
        self.right.follow(step)
        (x, y, z), points = self.left.tip()
        off, above = math.hypot(y - SIDE, z - SHOULDER), z - SHOULDER
        turned = abs(self.left.joints[5])
        nominal = Arm(SIDE)
        nominal.joints = programme(max(0.0, time - LAG))
        meant = nominal.tip()[0]
        aligned = points[0] > math.cos(0.03) and turned <= TURNED
        correct = math.dist((x, y, z), meant) <= 0.03
        plugged = x >= INSIDE - 0.01 and off <= PLAY and turned <= TURNED
        for name, holds in (("aligned", aligned), ("correct", correct), ("plugged", plugged)):
            self.well[name] = self.well[name] + step if holds else 0.0
        long = {name: well >= 0.5 for name, well in self.well.items()}

        messages = [
            {"topic": ALIGNED, "value": aligned},
            {"topic": CORRECT, "value": correct},
            {"topic": CONSERT.format("high"), "value": long["correct"] and long["aligned"]},
            {"topic": CONSERT.format("medium"), "value": long["correct"]},
        ]
        if x > FACE and PLAY < off <= FLANGE:
            sector = int((math.atan2(above, y - SIDE) + math.pi) / (math.pi / 4)) % 8
            messages.append(event(ZONES[sector], PLAY - off, f"SafetyZone{sector + 1}", "KR22_825"))
        apart = distance((0.0, SIDE), (x, y), (0.0, -SIDE), self.right.tip()[0][:2])
        if apart < HANDS_OFF:
            messages.append(event(ARMS, apart - HANDS_OFF, "KR22_850", "KR22_825"))
        if long["plugged"] and not self.inserted:
            self.inserted = True
            messages.append({"topic": INSERTED, "value": time})
        return messages


def event(topic, level, one, other):
    return {"topic": topic, "value": {"level": 1000.0 * level, "object1": one, "object2": other}}


def distance(a, b, c, d):
    """The distance of two line segments in the plane."""

    def side(p, q, r):
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    def to_point(p, q, r):
        length = math.dist(p, q)
        share = ((r[0] - p[0]) * (q[0] - p[0]) + (r[1] - p[1]) * (q[1] - p[1])) / (length * length)
        share = max(0.0, min(1.0, share))
        return math.dist(r, (p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])))

    if side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0:
        return 0.0
    return min(to_point(a, b, c), to_point(a, b, d), to_point(c, d, a), to_point(c, d, b))


def answer(what):
    """Sends an answer and returns the next request, or None at the end of the input."""
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


def main():
    order = json.loads(sys.stdin.readline() or "null")
    while order:
        if "reset" in order:
            cell, step = Cell(), order["reset"]["step"]
            order = answer({"ready": {"publishes": TARGETS + REPORTS, "subscribes": TARGETS, "resets": True}})
        else:
            time, late = order["step"]["time"], order["step"]["messages"]
            in_time = answer({"publish": cell.targets(time)})["deliver"]
            order = answer({"done": {"messages": cell.step(time, step, late + in_time)}})


main()
