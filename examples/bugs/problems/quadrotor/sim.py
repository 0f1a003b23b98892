"""A quadrotor flies to a place in front of a wall and hovers there, then further down. It moves along `x` and `z` only.

Its state is position, velocity, pitch and pitch rate. The rotors give a thrust along its axis, and a torque; air
resists. Two loops control it, one inside of the other: position and velocity say which acceleration is wanted, that
says which thrust and pitch, and pitch and pitch rate say which torque.

T. Lee, M. Leok, N. H. McClamroch: Geometric tracking control of a quadrotor UAV on SE(3). CDC 2010.
"""

import math

from bugs.protocol import Bus

GRAVITY = 9.81  # m/s²
INERTIA = 0.02  # kg m², for a mass of 1 kg
DRAG = 0.25  # 1/s
GOALS = ((0.0, (0.0, 2.0)), (3.0, (8.0, 4.0)), (14.0, (8.0, 1.5)))  # since when, in s; where, in m
FASTEST = 3.0  # m/s
STEEPEST = 0.6  # rad
BY_PLACE, BY_SPEED = 1.2, 2.2  # 1/s², 1/s
BY_PITCH, BY_RATE = 90.0, 14.0  # 1/s², 1/s
THRUSTS = 0.0, 18.0  # N
TORQUES = -0.6, 0.6  # N m
WALL = 8.6  # m


class Simulator:
    subscribes = ("gps/position", "gps/velocity", "imu/pitch", "imu/rate", "rotors/thrust", "rotors/torque")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.steps = 0
        self.place, self.speed = [0.0, 2.0], [0.0, 0.0]
        self.pitch, self.rate = 0.0, 0.0
        self.seen, self.moving = [0.0, 0.0, 2.0], [0.0, 0.0, 0.0]
        self.felt, self.turning = 0.0, 0.0
        self.thrust, self.torque = GRAVITY, 0.0
        self.wanted_thrust, self.wanted_pitch = GRAVITY, 0.0

    def step(self, time: float, bus: Bus) -> None:
        if self.steps % 5 == 0:
            bus.publish("gps/position", [self.place[0], 0.0, self.place[1]])
            bus.publish("gps/velocity", [self.speed[0], 0.0, self.speed[1]])
            self.seen = bus.latest("gps/position", self.seen)
            self.moving = bus.latest("gps/velocity", self.moving)
            self.navigate([goal for since, goal in GOALS if since <= time][-1], bus)
        self.steps += 1
        bus.publish("imu/pitch", self.pitch)
        bus.publish("imu/rate", self.rate)
        self.felt = bus.latest("imu/pitch", self.felt)
        self.turning = bus.latest("imu/rate", self.turning)
        torque = INERTIA * (BY_PITCH * (self.wanted_pitch - self.felt) - BY_RATE * self.turning)
        bus.publish("rotors/torque", within(TORQUES, torque))

        self.thrust = within(THRUSTS, bus.latest("rotors/thrust", self.thrust))
        self.torque = within(TORQUES, bus.latest("rotors/torque", self.torque))
        self.fly()
        bus.publish("truth/clearance", min(WALL - self.place[0], self.place[1]))

    def navigate(self, goal: tuple[float, float], bus: Bus) -> None:
        """The outer loop: which thrust and pitch take it to its goal."""
        place, speed = self.seen[::2], self.moving[::2]
        wanted = [within((-FASTEST, FASTEST), BY_PLACE / BY_SPEED * (to - at)) for to, at in zip(goal, place)]
        along, up = [BY_SPEED * (to - at) for to, at in zip(wanted, speed)]
        up += GRAVITY
        self.wanted_pitch = within((-STEEPEST, STEEPEST), math.atan2(along, max(up, 1.0)))
        bus.publish("rotors/thrust", within(THRUSTS, up / math.cos(self.felt)))

    def fly(self) -> None:
        acceleration = self.thrust * math.sin(self.pitch), self.thrust * math.cos(self.pitch) - GRAVITY
        for axis in (0, 1):
            self.speed[axis] += (acceleration[axis] - DRAG * self.speed[axis]) * self.step_length
            self.place[axis] += self.speed[axis] * self.step_length
        self.rate += self.torque / INERTIA * self.step_length
        self.pitch += self.rate * self.step_length


def within(limits: tuple[float, float], number: float) -> float:
    return max(limits[0], min(limits[1], number))
