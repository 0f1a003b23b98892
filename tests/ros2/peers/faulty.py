"""Peers that misbehave, one mode each. They say `up`, wait for a subscriber, misbehave, and exit with 0; 2 if nobody
subscribed.

    wrong-type    publishes std_msgs/msg/String on a topic that others know as something else
    truncated     publishes samples that end too early, between good ones
    garbage       publishes samples whose lengths promise gigabytes
    gigantic      publishes samples of --bytes
    clock-stops   publishes /clock, which stands still after --after seconds
    clock-back    publishes /clock, which jumps back to zero after --after seconds, and again after as many
    two           publishes on one topic from two nodes, alternately
    dies          publishes, and ends without a farewell after --after seconds
"""

import argparse
import os
import random
import struct
import time

import common
import rclpy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from samples import sample
from std_msgs.msg import String

MODES = ("wrong-type", "truncated", "garbage", "gigantic", "clock-stops", "clock-back", "two", "dies")


def good(options: argparse.Namespace, number: int) -> bytes:
    """A sample as it should be."""
    kind = common.message_type(options.type)
    return serialize_message(common.fill(kind(), sample(options.type, options.seed, number)))


def bad(options: argparse.Namespace, number: int, luck: random.Random) -> bytes:
    """The sample of a number, spoilt as the mode says."""
    raw = good(options, number)
    if options.mode == "truncated" and number % 2:
        return raw[: luck.randrange(4, len(raw))]
    if options.mode == "garbage" and number % 2:
        return raw[:4] + b"\xff" * 8 + struct.pack("<I", 0x7FFFFFFF) + luck.randbytes(64)
    return raw


def clock(options: argparse.Namespace, node) -> None:
    """Publishes a clock that goes wrong."""
    publisher = node.create_publisher(Clock, "/clock", 10)
    common.say(up=True)
    common.wait_until("no subscriber", options.timeout, lambda: publisher.get_subscription_count() >= 1)
    begin = time.monotonic()
    while (now := time.monotonic() - begin) < options.after + options.linger:
        shown = min(now, options.after) if options.mode == "clock-stops" else now % options.after
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(int(shown * 1e9), 10**9)
        publisher.publish(message)
        time.sleep(0.02)


def samples(options: argparse.Namespace, node) -> None:
    """Publishes samples that are wrong, or at a wrong time."""
    kind = String if options.mode in ("wrong-type", "gigantic") else common.message_type(options.type)
    nodes = [node, rclpy.create_node("peer_faulty_too")] if options.mode == "two" else [node]
    publishers = [of.create_publisher(kind, options.topic, common.quality(options)) for of in nodes]
    common.say(up=True)
    for publisher in publishers if options.mode != "wrong-type" else []:  # with another type nobody can match
        common.wait_until("no subscriber", options.timeout, lambda p=publisher: p.get_subscription_count() >= 1)
    luck, begin = random.Random(options.seed), time.monotonic()
    for number in range(options.count):
        publisher = publishers[number % len(publishers)]
        if options.mode == "wrong-type":
            publisher.publish(String(data="not what you expected"))
        elif options.mode == "gigantic":
            publisher.publish(String(data="x" * options.bytes))
        else:
            publisher.publish(bad(options, number, luck))
        if options.mode == "dies" and time.monotonic() - begin > options.after:
            os._exit(0)
        time.sleep(1 / options.rate)
    time.sleep(options.linger)


def main() -> None:
    """Misbehaves as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mode", choices=MODES)
    common.add_topic(parser)
    parser.add_argument("--count", type=int, default=100, help="how many samples (default: 100)")
    parser.add_argument("--rate", type=float, default=100.0, help="samples per second (default: 100)")
    parser.add_argument("--seed", type=int, default=1, help="of the samples (default: 1)")
    parser.add_argument("--bytes", type=int, default=60_000_000, help="of a gigantic sample (default: 60 MB)")
    parser.add_argument("--after", type=float, default=1.0, help="seconds until it goes wrong (default: 1)")
    parser.add_argument("--linger", type=float, default=1.0, help="seconds to stay after that (default: 1)")
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("peer_faulty")
    (clock if options.mode.startswith("clock") else samples)(options, node)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
