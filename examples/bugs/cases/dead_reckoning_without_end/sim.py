"""Two small drones fly one behind the other on an ellipse.

Motion capture tells each of them by radio where it is. Between two poses, a drone integrates the velocity that it
believes to have, whose error nobody knows. Nothing limits how long it does so: without poses, it flies on as if it
were tracked, until it meets a wall or the other drone: https://github.com/IMRCLab/crazyswarm2/issues/38, and lost poses
in https://github.com/USC-ACTLab/crazyswarm/issues/588
"""

import math

from bugs.protocol import Bus

HEIGHT = 1.0  # m
FASTEST = 2.0  # m/s
# Per drone: how far ahead on the ellipse (rad), and the error of its velocity (m/s).
DRONES = {"cf1": (0.0, (0.22, -0.05)), "cf2": (0.7, (-0.1, 0.12))}


def course(time: float, ahead: float) -> tuple[float, float]:
    """Where a drone should be."""
    angle = 0.6 * time + ahead
    return 1.3 * math.cos(angle), 1.0 * math.sin(angle)


class Drone:
    def __init__(self, ahead: float, error: tuple[float, float]) -> None:
        self.ahead, self.error = ahead, error
        self.position = list(course(0.0, ahead))
        self.estimate = list(self.position)

    def fly(self, time: float, step: float, poses: list[list[float]]) -> None:
        for pose in poses:
            self.estimate = list(pose[:2])
        for axis, wanted in enumerate(course(time, self.ahead)):
            believed = max(-FASTEST, min(FASTEST, 3.0 * (wanted - self.estimate[axis])))
            self.estimate[axis] += believed * step  # the bug: without end, however old the last pose is
            self.position[axis] += (believed - self.error[axis]) * step


class Simulator:
    subscribes = ("mocap/cf1", "mocap/cf2")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.drones = {name: Drone(ahead, error) for name, (ahead, error) in DRONES.items()}

    def step(self, time: float, bus: Bus) -> None:
        for name, drone in self.drones.items():
            bus.publish(f"mocap/{name}", [*drone.position, HEIGHT])
        for name, drone in self.drones.items():
            drone.fly(time, self.step_length, bus.take(f"mocap/{name}"))
            bus.publish(f"truth/{name}", [*drone.position, HEIGHT])
