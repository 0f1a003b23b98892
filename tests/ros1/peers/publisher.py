"""Publishes numbered messages, with all that was sent as a digest.

    publisher.py TOPIC TYPE COUNT RATE [latch] [at-once]

It begins at a line on its standard input, or at once, and says how many it sent. The types are `std_msgs/String` and
`sensor_msgs/JointState`. One that latches stays until a second line.
"""

import hashlib
import io
import math

import rospy

from common import cls, go, say, start


def message(kind, number):
    made = kind()
    if kind._type == "std_msgs/String":
        made.data = str(number)
    else:
        made.header.stamp = rospy.Time.from_sec(rospy.get_time())
        made.header.frame_id = "base"
        made.name = [f"joint_{at}" for at in range(7)]
        made.position = [number] + [math.sin(number + at) for at in range(6)]
        made.velocity = [float("nan")] * 7
    return made


def main():
    topic, kind, count, rate, *more = start("publisher")
    kind, count, rate = cls(kind), int(count), float(rate)
    publisher = rospy.Publisher(topic, kind, queue_size=10_000, latch="latch" in more)
    say({"ready": True})
    if "at-once" not in more:
        go()
    pace, digest = rospy.timer.Rate(rate) if rate < 10_000 else None, hashlib.sha256()
    for number in range(count):
        made = message(kind, number)
        publisher.publish(made)
        # Now its header has the number that was sent.
        sent = io.BytesIO()
        made.serialize(sent)
        digest.update(sent.getvalue())
        if pace:
            pace.sleep()
    say({"sent": count, "digest": digest.hexdigest()})
    go()


if __name__ == "__main__":
    main()
