"""Publishes a clock that goes ten times as fast as the wall, and a message at each second of it. `/reset` sets it back.

    clock.py TOPIC
"""

import threading
import time

import rospy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse

from common import say, start


def main():
    (topic,) = start("clock")
    # Without a limit: on a busy machine it catches up with hundreds of ticks at once, and none of them may be dropped.
    clock = rospy.Publisher("/clock", Clock, queue_size=0)
    publisher = rospy.Publisher(topic, String, queue_size=0)
    begun, at, steps = time.monotonic(), 0, 0
    ticking = threading.Lock()

    def reset(_):
        nonlocal at
        with ticking:
            at = 0
        return EmptyResponse()

    rospy.Service("/reset", Empty, reset)
    say({"ready": True})
    while True:
        with ticking:
            at, steps = at + 1, steps + 1
            clock.publish(Clock(rospy.Time(1000 + at // 50, at % 50 * 20_000_000)))
            if at % 50 == 0:
                publisher.publish(String(str(at // 50)))
        time.sleep(max(0.0, begun + steps / 500 - time.monotonic()))


if __name__ == "__main__":
    main()
