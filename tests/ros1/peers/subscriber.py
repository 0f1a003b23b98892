"""Takes messages as they are, and says what came.

    subscriber.py TOPIC TYPE COUNT WITHIN

It ends when so many came, or that with the number in a line on its standard input, or after so many seconds without
one. TYPE `*` takes any type. Of messages with a header it says how old they were when they came, in microseconds: of
half of them at most so much, and of 99 in a hundred. Of numbers as texts it says which are missing between those that
came, as pairs of the first one and their count.
"""

import hashlib
import struct
import sys
import threading
import time

import rospy

from common import cls, say, start


def main():
    topic, kind, count, within = start("subscriber")
    count, within = int(count), float(within)
    received, ages, digest, last = [], [], hashlib.sha256(), [time.monotonic()]
    header, gaps, awaited = {}, [], []

    def take(message):
        number = len(received)
        if kind == "sensor_msgs/JointState":
            _, seconds, nanos = struct.unpack_from("<III", message._buff)
            ages.append(time.time() - seconds - nanos * 1e-9)
        elif message._buff[4:].isdigit():
            number = int(message._buff[4:])
            expected = received[-1] + 1 if received else 0
            if number != expected:
                gaps.append([expected, number - expected])
        digest.update(message._buff)
        header.update(message._connection_header)
        received.append(number)
        last[0] = time.monotonic()

    class Raw(rospy.AnyMsg):
        """The bytes of messages of a type that is checked."""

        if kind != "*":
            _md5sum, _type, _full_text = cls(kind)._md5sum, cls(kind)._type, cls(kind)._full_text

    rospy.Subscriber(topic, Raw, take, queue_size=None, tcp_nodelay=True)
    say({"ready": True})
    # At the end of the input there is nobody to hear what came.
    threading.Thread(target=lambda: awaited.extend(int(line) for line in sys.stdin), daemon=True).start()
    while len(received) < count and time.monotonic() < last[0] + within:
        if awaited and awaited[0] in received:
            break
        time.sleep(0.01)
    # What is too much would come now. Nothing else is waited for here.
    time.sleep(0.3)
    said = {"received": len(received), "digest": digest.hexdigest(), "gaps": gaps}
    said.update({name: header.get(name) for name in ("type", "md5sum", "latching", "callerid")})
    ages.sort()
    said["ages"] = [round(ages[len(ages) * percent // 100] * 1e6) for percent in (50, 99)] if ages else []
    said["definition"] = len(header.get("message_definition", ""))
    say(said)


if __name__ == "__main__":
    main()
