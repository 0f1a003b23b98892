"""Publishes numbered messages, with all that was sent as a digest.

    publisher.py TOPIC TYPE COUNT RATE [latch] [at-once] [await=COUNT]

It begins at a line on its standard input and when somebody listens, or as many as it is to await; or at once. It ends
with COUNT messages or at a line `stop`, and says how many it sent. The types are `std_msgs/String` and
`sensor_msgs/JointState`. It stays until its input ends, or a further line comes.
"""

import hashlib
import io
import math
import sys
import threading

import rospy

from common import await_, cls, go, say, start


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
    told, sent, digest = threading.Event(), 0, hashlib.sha256()
    if "at-once" not in more:
        go()
        wanted = max([int(word.split("=")[1]) for word in more if word.startswith("await=")], default=1)
        await_("subscribers", lambda: publisher.get_num_connections() >= wanted)
        threading.Thread(target=lambda: (sys.stdin.readline(), told.set()), daemon=True).start()
    pace = rospy.timer.Rate(rate) if rate < 10_000 else None
    while sent < count and not told.is_set():
        made = message(kind, sent)
        publisher.publish(made)
        # Now its header has the number that was sent.
        serialised = io.BytesIO()
        made.serialize(serialised)
        digest.update(serialised.getvalue())
        sent += 1
        if pace:
            pace.sleep()
    say({"sent": sent, "digest": digest.hexdigest()})
    if "at-once" in more:
        go()
    elif not told.is_set():
        told.wait()
    # Whoever told it to stop may still have something to come from it.
    sys.stdin.read()


if __name__ == "__main__":
    main()
