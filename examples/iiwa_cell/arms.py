"""What both engines know of the two arms, and what they must be able to do."""

from typing import Protocol

import numpy as np

ARMS = ("left", "right")
JOINTS = 7
PERIOD = 20_000_000  # nanoseconds of a control period
PHYSICS = 0.002  # seconds of a step of the physics
STEPS = round(PERIOD * 1e-9 / PHYSICS)  # in a control period
ROTOR = 0.15  # kg m² that a drive adds to its joint
FRICTION = np.array([20.0, 20.0, 12.0, 14.0, 5.0, 3.0, 2.0])  # Nm s/rad of the drives
FAR = 2.0  # metres beyond which a distance is not measured exactly
BASE = {"left": (-0.62, 0.0, 0.0), "right": (0.62, 0.0, np.pi)}  # x, y and rotation, on the table
TABLE = (0.9, 0.5, 0.02)  # half of its edges, in metres; its upper side is at height 0
PARKED = (-0.6571, 0.467, 0.1091, -1.4969, -0.053, 1.1806, -0.3854)  # joints of both arms at time zero, in rad
TOOL = (0.03, 0.12, 0.6)  # radius and length of the cylinder on each hand, in metres, and its mass in kg
PAYLOAD_AT = 0.1  # metres from the hand to what hangs on the tool
NO_PAYLOAD = 1e-4  # kg: an engine needs a mass where something may hang
PAYLOAD_RADIUS = 0.03  # metres of gyration


class Physics(Protocol):
    """An engine with both arms on the table. Drives carry the arms' own weight, but not that of the payload."""

    def reset(self) -> None:
        """Sets the world to time zero: both arms rest above their boxes. Payload and friction stay as they are."""

    def set_payload(self, mass: float) -> None:
        """Hangs a weight on both tools of which the arms know nothing."""

    def set_friction(self, factor: float) -> None:
        """Makes the friction of all drives this many times as strong."""

    def push(self, arm: str, torques: np.ndarray) -> None:
        """Gives an arm torques, which hold until it gets others."""

    def step(self) -> None:
        """Advances by a control period."""

    def hold(self) -> None:
        """Lets a control period pass in which brakes hold the arms."""

    def position(self, arm: str) -> list[float]:
        """The joints of an arm, in rad."""

    def velocity(self, arm: str) -> list[float]:
        """How fast they turn, in rad/s."""

    def tool(self, arm: str) -> np.ndarray:
        """Where the tip of a tool is, from the middle of the table."""

    def distance(self) -> float:
        """The smallest distance between the arms without their bases; negative if they penetrate each other."""
