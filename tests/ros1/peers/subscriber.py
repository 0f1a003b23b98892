"""Takes messages as they are, and says what came.

    subscriber.py TOPIC TYPE COUNT WITHIN

It ends when so many came, or after so many seconds without one. TYPE `*` takes any type.
"""

import hashlib
import time

import rospy

from common import cls, say, start


def main():
    topic, kind, count, within = start("subscriber")
    count, within = int(count), float(within)
    received, digest, last = [], hashlib.sha256(), [time.monotonic()]
    header = {}

    def take(message):
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
    said["definition"] = len(header.get("message_definition", ""))
    say(said)


if __name__ == "__main__":
    main()
