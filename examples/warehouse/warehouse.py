"""The warehouse: its lanes, how its six robots move, how one navigates, and how their manager lets them cross.

Three robots drive north and south, three east and west, each to and fro between the two stations of its own lane. So
each of the first three shares one crossing with each of the others. Robots have no lasers: they stop where the manager
has not cleared their way. The manager and the robots know where a robot is only from what they hear.

Nothing here knows a middleware; times are whole nanoseconds of simulation time, places are metres.
"""

import math
from dataclasses import dataclass, field
from enum import Enum

SECOND = 1_000_000_000
PERIOD = SECOND // 5  # of control

CRUISE = 1.2  # metres per second
BRAKING = 0.5  # metres per second and second at which a navigator plans to stop
GRIP = 2.0  # metres per second and second by which a robot can change its velocity
ARRIVED = 0.15  # metres from its goal at which a robot has arrived
TOLERANCE = 5 * SECOND // 2  # how old a robot's own place may be; with an older one it stands

STOP = 1.4  # metres before a crossing at which a robot stops if it may not cross
CLEAR = 1.2  # metres behind a crossing at which others may cross
RESERVE = 3.2  # metres before a crossing at which a robot asks for it

START_AFTER = SECOND  # from a goal until the robot sets out, so that it does not matter how long a goal takes to arrive
ANSWER_WITHIN = 2 * SECOND  # how long the manager waits for an answer to a goal, and then sends another one
HEARD_WITHIN = 5 * SECOND  # how long it waits for feedback, and then cancels the goal

Place = tuple[float, float]


@dataclass(frozen=True)
class Lane:
    """The way of a robot: its stations, when it sets out first, and how long it rests at a station."""

    stations: tuple[Place, Place]
    first: int
    rest: int


def lane(stations: tuple[Place, Place], first: float, rest: float) -> Lane:
    """A lane, with times in seconds."""
    return Lane(stations, round(first * SECOND), round(rest * SECOND))


LANES = {
    "r1": lane(((4.0, 0.0), (4.0, 16.0)), 0.4, 2.0),
    "r2": lane(((8.0, 16.0), (8.0, 0.0)), 1.0, 3.0),
    "r3": lane(((12.0, 0.0), (12.0, 16.0)), 0.2, 2.6),
    "r4": lane(((0.0, 4.0), (16.0, 4.0)), 1.2, 2.4),
    "r5": lane(((16.0, 8.0), (0.0, 8.0)), 0.6, 3.4),
    "r6": lane(((0.0, 12.0), (16.0, 12.0)), 0.0, 2.2),
}
ROBOTS = tuple(LANES)


def distance(a: Place, b: Place) -> float:
    """How far two places are apart."""
    return math.hypot(b[0] - a[0], b[1] - a[1])


def ahead(place: Place, goal: Place, other: Place) -> float:
    """How far another place is ahead on the way from a place to a goal; negative if it lies behind."""
    length = distance(place, goal)
    if length == 0.0:
        return 0.0
    return ((other[0] - place[0]) * (goal[0] - place[0]) + (other[1] - place[1]) * (goal[1] - place[1])) / length


def crossings(robot: str) -> dict[str, Place]:
    """The robots whose lanes a robot's lane crosses, and where."""
    (x, y), (to_x, _) = LANES[robot].stations
    upright = x == to_x
    found = {}
    for other, lane in LANES.items():
        (other_x, other_y), (other_to_x, _) = lane.stations
        if upright != (other_x == other_to_x):
            found[other] = (x, other_y) if upright else (other_x, y)
    return found


def stop_before(robot: str, crossing: Place, goal: Place) -> Place:
    """Where a robot stops on its way to one of its stations if it may not cross a crossing."""
    first, second = LANES[robot].stations
    start = second if goal == first else first
    length = distance(start, goal)
    return (
        crossing[0] - (goal[0] - start[0]) / length * STOP,
        crossing[1] - (goal[1] - start[1]) / length * STOP,
    )


def way(robot: str, goal: Place) -> list[Place]:
    """The way of a robot to one of its stations: from the other one, over the stops before the crossings."""
    first, second = LANES[robot].stations
    start = second if goal == first else first
    stops = [stop_before(robot, crossing, goal) for crossing in crossings(robot).values()]
    return [start, *sorted(stops, key=lambda stop: distance(start, stop)), goal]


def is_on_lane(robot: str, place: Place) -> bool:
    """Whether a place lies on the lane of a robot."""
    first, second = LANES[robot].stations
    return distance(first, place) + distance(place, second) < distance(first, second) + ARRIVED


class Floor:
    """Where the robots truly are, and how their drives move them."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Puts every robot at its first station, at time zero."""
        self.now = 0
        self.places = {robot: lane.stations[0] for robot, lane in LANES.items()}
        self.velocities = dict.fromkeys(ROBOTS, (0.0, 0.0))
        self.wanted = dict.fromkeys(ROBOTS, (0.0, 0.0))

    def advance(self) -> None:
        """Advances by one period."""
        self.now += PERIOD
        seconds = PERIOD / SECOND
        for robot in ROBOTS:
            most = GRIP * seconds
            velocity = tuple(
                old + max(-most, min(most, new - old))
                for old, new in zip(self.velocities[robot], self.wanted[robot], strict=True)
            )
            self.velocities[robot] = velocity
            x, y = self.places[robot]
            self.places[robot] = (x + velocity[0] * seconds, y + velocity[1] * seconds)


@dataclass
class Navigator:
    """Drives one robot to its goal, as far as its way is clear. It knows only the places that it hears."""

    place: Place | None = None
    located: int = 0  # when it was there
    goal: Place | None = None
    starts: int = 0  # when it sets out
    clear_to: Place | None = None

    def steer(self, now: int) -> Place:
        """The velocity that it wants."""
        if self.goal is None or self.place is None or self.clear_to is None:
            return (0.0, 0.0)
        if now < self.starts or now - self.located > TOLERANCE:
            return (0.0, 0.0)
        left = distance(self.place, self.goal)
        end = min(left, ahead(self.place, self.goal, self.clear_to))
        speed = min(CRUISE, math.sqrt(2.0 * BRAKING * max(0.0, end)))
        if left == 0.0:
            return (0.0, 0.0)
        return ((self.goal[0] - self.place[0]) / left * speed, (self.goal[1] - self.place[1]) / left * speed)

    def left(self) -> float:
        """How far it believes that it is from its goal."""
        return math.inf if self.goal is None or self.place is None else distance(self.place, self.goal)

    def has_arrived(self) -> bool:
        """Whether it believes that it is at its goal."""
        return self.left() < ARRIVED


class Stage(Enum):
    """What a robot does, as far as its manager knows."""

    RESTS = "rests"
    ASKED = "asked"
    DRIVES = "drives"


@dataclass
class Trip:
    """What the manager knows about a robot: where it is and where it is sent."""

    station: int = 0  # where it was sent last
    stage: Stage = Stage.RESTS
    since: int = 0  # of the stage, or of the last sign of life of one that drives
    place: Place | None = None
    arrived: int | None = None  # when it was first heard to be at its station


@dataclass
class Orders:
    """What the manager wants at a time: new goals, goals to cancel, and up to where each way is clear."""

    goals: dict[str, Place] = field(default_factory=dict)
    cancelled: list[str] = field(default_factory=list)
    clear_to: dict[str, Place] = field(default_factory=dict)


class Manager:
    """Sends robots to and fro, and lets one at a time cross each crossing. It knows only the places that it hears."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forgets everything."""
        self.trips = {robot: Trip() for robot in ROBOTS}
        self.holders: dict[Place, str] = {}

    def locate(self, robot: str, place: Place) -> None:
        """Hears where a robot is."""
        self.trips[robot].place = place

    def accepted(self, robot: str, now: int) -> None:
        """Hears that a robot sets out."""
        self.trips[robot].stage, self.trips[robot].since = Stage.DRIVES, now

    def refused(self, robot: str, now: int) -> None:
        """Hears that a robot does not take its goal, or gave it up: it will get it again."""
        trip = self.trips[robot]
        if trip.stage is not Stage.RESTS:
            trip.station, trip.stage, trip.since = 1 - trip.station, Stage.RESTS, now

    def heard(self, robot: str, now: int) -> None:
        """Hears that a robot is on its way."""
        self.trips[robot].since = now

    def reached(self, robot: str) -> None:
        """Hears that a robot is at its goal."""
        self.trips[robot].stage = Stage.RESTS

    def decide(self, now: int) -> Orders:
        """What it wants now."""
        orders = Orders()
        for robot, trip in self.trips.items():
            self._send(robot, trip, now, orders)
        self._release()
        self._reserve()
        for robot, trip in self.trips.items():
            orders.clear_to[robot] = self._clear_to(robot, trip)
        return orders

    def _send(self, robot: str, trip: Trip, now: int, orders: Orders) -> None:
        """Sends a robot on once it has rested, and again if it does not answer."""
        lane = LANES[robot]
        if trip.place is None:
            return
        at_station = distance(trip.place, lane.stations[trip.station]) < ARRIVED
        if trip.stage is Stage.DRIVES:
            if now - trip.since > HEARD_WITHIN:
                orders.cancelled.append(robot)
                self.refused(robot, now)
            elif at_station and trip.arrived is None:
                trip.arrived = now
            return
        if trip.stage is Stage.ASKED:
            if now - trip.since > ANSWER_WITHIN:
                self.refused(robot, now)
            return
        rested = lane.first if trip.arrived is None else trip.arrived + lane.rest
        if now >= rested:
            trip.station, trip.stage, trip.since, trip.arrived = 1 - trip.station, Stage.ASKED, now, None
            orders.goals[robot] = lane.stations[trip.station]

    def _ahead(self, robot: str) -> list[tuple[float, Place]]:
        """The crossings on the way of a robot that it has not left behind, with how far they are; nearest first."""
        trip = self.trips[robot]
        if trip.place is None:
            return []
        goal = LANES[robot].stations[trip.station]
        found = [(ahead(trip.place, goal, crossing), crossing) for crossing in crossings(robot).values()]
        return sorted(each for each in found if each[0] > -CLEAR)

    def _release(self) -> None:
        """Frees the crossings that their holders have left behind."""
        for crossing, robot in list(self.holders.items()):
            if crossing not in [place for _, place in self._ahead(robot)]:
                del self.holders[crossing]

    def _reserve(self) -> None:
        """Gives free crossings to those that are nearest to them."""
        wanted = [
            (away, robot, crossing)
            for robot, trip in self.trips.items()
            if trip.stage is Stage.DRIVES
            for away, crossing in self._ahead(robot)
            if away <= RESERVE
        ]
        for _, robot, crossing in sorted(wanted):
            self.holders.setdefault(crossing, robot)

    def _clear_to(self, robot: str, trip: Trip) -> Place:
        """Up to where the way of a robot is clear: its station, or the stop before a crossing."""
        goal = LANES[robot].stations[trip.station]
        for _, crossing in self._ahead(robot):
            if self.holders.get(crossing) != robot:
                return stop_before(robot, crossing, goal)
        return goal
