"""Takes messages as they are, and says what came.

    subscriber.py TOPIC TYPE COUNT WITHIN

It ends when so many came, or after so many seconds without one. TYPE `*` takes any type. Of messages with a header it
says how old they were when they came, in microseconds: of half of them at most so much, and of 99 in a hundred.
"""

import hashlib
import struct
import time

import rospy

from common import cls, say, start


def main():
    topic, kind, count, within = start("subscriber")
    count, within = int(count), float(within)
    received, ages, digest, last = [], [], hashlib.sha256(), [time.monotonic()]
    header = {}

    def take(message):
        if kind == "sensor_msgs/JointState":
            _, seconds, nanos = struct.unpack_from("<III", message._buff)
            ages.append(time.time() - seconds - nanos * 1e-9)
        digest.update(message._buff)
        header.update(message._connection_header)
        received.append(time.monotonic())
        last[0] = time.monotonic()

    class Raw(rospy.AnyMsg):
        """The bytes of messages of a type that is checked."""

        if kind != "*":
            _md5sum, _type, _full_text = cls(kind)._md5sum, cls(kind)._type, cls(kind)._full_text

    rospy.Subscriber(topic, Raw, take, queue_size=None, tcp_nodelay=True)
    say({"ready": True})
    while len(received) < count and time.monotonic() < last[0] + within:
        time.sleep(0.01)
    # What is too much would come now.
    time.sleep(0.3)
    said = {"received": len(received), "digest": digest.hexdigest()}
    said.update({name: header.get(name) for name in ("type", "md5sum", "latching", "callerid")})
    ages.sort()
    said["ages"] = [round(ages[len(ages) * percent // 100] * 1e6) for percent in (50, 99)] if ages else []
    said["definition"] = len(header.get("message_definition", ""))
    say(said)


if __name__ == "__main__":
    main()
