"""Publishes seeded random samples by rclpy and prints their number and digest as JSON.

`digest` is over what was serialised, with padding whose bytes may be anything; `content` over the values alone, which
is the same for all vendors and in every run. Exit codes: 0 all was sent; 2 nobody subscribed in time.
"""

import argparse
import hashlib
import json
import sys
import time

import common
import rclpy
from rclpy.serialization import serialize_message
from samples import TYPES, canonical, sample


def main() -> None:
    """Publishes as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    common.add_topic(parser)
    parser.add_argument("--count", type=int, default=100, help="how many samples (default: 100)")
    parser.add_argument("--rate", type=float, help="samples per second; as fast as possible by default")
    parser.add_argument("--seed", type=int, default=1, help="of the samples (default: 1)")
    parser.add_argument("--subscribers", type=int, default=1, help="how many to wait for (default: 1)")
    parser.add_argument("--short", action="store_true", help="numbers of a few digits, as JSON has them")
    parser.add_argument("--hold", action="store_true", help="wait for a line on standard input before the first sample")
    parser.add_argument("--linger", type=float, default=1.0, help="seconds to stay after the last sample (default: 1)")
    options = parser.parse_args()
    if options.type not in TYPES:
        parser.error(f"--type must be one of {', '.join(TYPES)}")
    kind = common.message_type(options.type)
    rclpy.init()
    node = rclpy.create_node("peer_publisher")
    publisher = node.create_publisher(kind, options.topic, common.quality(options))
    common.wait_until(
        "no subscriber", options.timeout, lambda: publisher.get_subscription_count() >= options.subscribers
    )
    if options.hold:
        sys.stdin.readline()
    time.sleep(0.3)  # the other side may take a moment longer to match
    digest, content, due = hashlib.sha256(), hashlib.sha256(), time.monotonic()
    begin = due
    for number in range(options.count):
        raw = serialize_message(common.fill(kind(), sample(options.type, options.seed, number, options.short)))
        digest.update(raw)
        content.update(canonical(options.type, raw))
        publisher.publish(raw)
        if options.rate:
            due += 1 / options.rate
            time.sleep(max(0.0, due - time.monotonic()))
    seconds = time.monotonic() - begin
    time.sleep(options.linger)
    result = {"count": options.count, "digest": digest.hexdigest(), "content": content.hexdigest()}
    print(json.dumps({**result, "per_second": round(options.count / seconds)}))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
