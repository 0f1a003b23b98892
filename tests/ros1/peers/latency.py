"""Publishes joints of an arm on a topic at 200 Hz, and measures until they come back on another one.

    latency.py FROM TO

It sends until something comes back, and says `ready`. For each number on its standard input it sends so many messages,
and says as JSON how many nanoseconds each of them took.
"""

import json
import sys
import threading
import time

import rospy
from sensor_msgs.msg import JointState


def message(number: int) -> JointState:
    """Seven joints, and a number by which the message is known."""
    joints = JointState(name=[f"a{joint}" for joint in range(7)], position=[0.125] * 7, velocity=[0.5] * 7)
    joints.header.frame_id = f"n{number}"
    return joints


def main() -> None:
    """Measures as often as it is asked to."""
    origin, destination = sys.argv[1:]
    rospy.init_node("latency", anonymous=True, disable_signals=True)
    sent, took, come = {}, {}, threading.Condition()

    def take(joints: JointState) -> None:
        """Notes how long a message took."""
        now, number = time.perf_counter_ns(), int(joints.header.frame_id[1:])
        with come:
            if number in sent:
                took[number] = now - sent[number]
                come.notify()

    rospy.Subscriber(destination, JointState, take, queue_size=1000, tcp_nodelay=True)
    publisher = rospy.Publisher(origin, JointState, queue_size=1000, tcp_nodelay=True)
    first = 0
    while not took:
        sent[first] = time.perf_counter_ns()
        publisher.publish(message(first))
        first += 1
        time.sleep(0.05)
    print("ready", flush=True)
    for line in sys.stdin:
        count = int(line)
        sent.clear()
        took.clear()
        begin = time.perf_counter()
        for at in range(count):
            time.sleep(max(0.0, begin + at / 200 - time.perf_counter()))
            joints = message(first + at)
            sent[first + at] = time.perf_counter_ns()
            publisher.publish(joints)
        with come:
            come.wait_for(lambda: len(took) == count, timeout=10)
        first += count
        said = {"seconds": time.perf_counter() - begin, "nanoseconds": list(took.values())}
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main()
