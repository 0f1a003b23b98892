"""Subscribes by rclpy, without deserialising, and prints number and digest of the samples as JSON.

It says `up` and `matched`, and `heard` with the number of each probe, which is no sample (`common.py`). With `--tell`
it says `count` after every so many samples. With `--until-told` it ends at a line on its standard input, once nothing
more comes. Exit codes: 0 all samples came; 2 nothing came for too long; 3 a sample could not be read (only with
`--content`).
"""

import argparse
import hashlib
import sys
import threading
import time

import common
import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.serialization import serialize_message
from samples import canonical, probes

# What is on its way when nothing more is to come is here within this time, in seconds.
REST = 0.5


def main() -> None:
    """Receives as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    common.add_topic(parser)
    parser.add_argument("--count", type=int, default=100, help="how many samples to wait for (default: 100)")
    parser.add_argument("--content", action="store_true", help="also the digest of the values alone")
    parser.add_argument("--slow", type=float, default=0.0, help="seconds to sleep after each sample: a slow consumer")
    parser.add_argument("--tell", type=int, help="say `count` after every so many samples")
    parser.add_argument("--until-told", action="store_true", help="until a line comes in, however many samples came")
    parser.add_argument("--subscriptions", type=int, default=1, help="how many of one node (default: 1)")
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("peer_subscriber")
    kind = common.message_type(options.type)
    known = probes(options.type, lambda fields: serialize_message(common.fill(kind(), fields)))
    digest, content, sizes, last = hashlib.sha256(), hashlib.sha256(), [], [time.monotonic()]

    def take(raw: bytes) -> None:
        """Counts a sample."""
        last[0] = time.monotonic()
        try:
            read = canonical(options.type, raw)
        except (ValueError, IndexError, OverflowError) as error:
            if options.content:
                common.say(count=len(sizes), error=str(error))
                sys.exit(3)
            read = raw
        if number := known.get(read):
            common.say(heard=number)
            return
        digest.update(raw)
        sizes.append(len(raw))
        if options.content:
            content.update(read)
        if options.tell and len(sizes) % options.tell == 0:
            common.say(count=len(sizes))
        time.sleep(options.slow)

    def matched(status) -> None:
        """Says that somebody publishes."""
        if status.current_count_change > 0:
            common.say(matched=status.current_count)

    events = SubscriptionEventCallbacks(matched=matched)
    quality = common.quality(options)
    for _ in range(options.subscriptions):
        node.create_subscription(kind, options.topic, take, quality, raw=True, event_callbacks=events)
    common.say(up=True)
    told = threading.Event()
    if options.until_told:
        threading.Thread(target=lambda: (sys.stdin.readline(), told.set()), daemon=True).start()
    while (
        time.monotonic() < last[0] + REST
        if told.is_set()
        else (options.until_told or len(sizes) < options.count) and time.monotonic() < last[0] + options.timeout
    ):
        rclpy.spin_once(node, timeout_sec=0.05 if options.until_told else 0.1)
    result = {"count": len(sizes), "bytes": sum(sizes), "digest": digest.hexdigest()}
    if options.content:
        result["content"] = content.hexdigest()
    code = 0 if told.is_set() or len(sizes) >= options.count else 2
    common.say(**result, code=code)
    node.destroy_node()
    rclpy.try_shutdown()
    sys.exit(code)


if __name__ == "__main__":
    main()
