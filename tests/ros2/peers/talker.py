"""Publishes a swinging angle on `/angle`, 200 times per second, by rclpy until it is ended."""

import math
import time

import rclpy
from std_msgs.msg import Float64


def main() -> None:
    """Publishes; arguments are those of ROS."""
    rclpy.init()
    publisher = rclpy.create_node("talker").create_publisher(Float64, "/angle", 100)
    begin = time.monotonic()
    for number in range(10**9):
        publisher.publish(Float64(data=math.sin(number / 100)))
        time.sleep(max(0.0, begin + number / 200 - time.monotonic()))


if __name__ == "__main__":
    main()
