"""Publishes a clock that goes ten times as fast as the wall, and a message at each second of it.

    clock.py TOPIC
"""

import time

import rospy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from common import say, start


def main():
    (topic,) = start("clock")
    clock = rospy.Publisher("/clock", Clock, queue_size=100)
    publisher = rospy.Publisher(topic, String, queue_size=100)
    say({"ready": True})
    begun, at = time.monotonic(), 0
    while True:
        at += 1
        clock.publish(Clock(rospy.Time(1000 + at // 100, at % 100 * 10_000_000)))
        if at % 100 == 0:
            publisher.publish(String(str(at // 100)))
        time.sleep(max(0.0, begun + at / 1000 - time.monotonic()))


if __name__ == "__main__":
    main()
