"""A legged robot walks up to a point a metre and a half in front of an edge.

Its driver takes velocities from a queue without a bound, one in each control cycle. Whatever puts more into the queue
than the cycles take out makes the robot obey commands of long ago: it walks on after the controller has said stop.
https://github.com/heuristicus/spot_ros/pull/16, and for an arm
https://github.com/rai-opensource/spot_ros2/issues/726
"""

from bugs.protocol import Bus

GOAL, EDGE = 8.0, 9.5  # m
FASTEST = 0.8  # m/s
PATIENCE = 10  # cycles without a command after which the robot stops


class Simulator:
    subscribes = ("cmd_vel", "odom")

    def __init__(self, seed: int, step: float) -> None:
        self.step_length = step
        self.position, self.speed = 0.0, 0.0
        self.odometry = 0.0
        self.queue: list[float] = []
        self.idle = 0

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("odom", self.position)
        self.odometry = bus.latest("odom", self.odometry)
        wanted = max(0.0, min(FASTEST, GOAL - self.odometry)) if time > 1.0 else 0.0
        bus.publish("cmd_vel", wanted if wanted > 0.02 else 0.0)

        self.queue += bus.take("cmd_vel")  # the bug: only the latest command should be kept
        if self.queue:
            self.speed, self.idle = self.queue.pop(0), 0
        else:
            self.idle += 1
            self.speed = 0.0 if self.idle > PATIENCE else self.speed
        self.position += self.speed * self.step_length
        bus.publish("truth/to_edge", EDGE - self.position)
