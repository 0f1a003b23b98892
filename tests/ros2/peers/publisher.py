"""Publishes seeded random samples by rclpy and prints their number and digest as JSON.

`digest` is over what was serialised, with padding whose bytes may be anything; `content` over the values alone, which
is the same for all vendors and in every run. It says `up` and `matched`. With `--hold` it does what lines on its
standard input say: a `probe` (`common.py`), `go` for all samples or a batch of them, or `alone` to wait until nobody
subscribes any more, which it then says. It stays until its input ends, so that nothing of what it has sent is lost with
it. `reliable` says whether all subscriptions that it knows at the end are reliable. Exit codes: 0 all was sent; 2
nobody subscribed in time, or somebody still did.
"""

import argparse
import hashlib
import sys
import time

import common
import rclpy
from rclpy.duration import Duration
from rclpy.qos import ReliabilityPolicy
from rclpy.serialization import serialize_message
from samples import TYPES, canonical, probe, sample


def main() -> None:
    """Publishes as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    common.add_topic(parser)
    parser.add_argument("--count", type=int, default=100, help="how many samples (default: 100)")
    parser.add_argument("--rate", type=float, help="samples per second; as fast as possible by default")
    parser.add_argument("--seed", type=int, default=1, help="of the samples (default: 1)")
    parser.add_argument("--short", action="store_true", help="numbers of a few digits, as JSON has them")
    parser.add_argument("--hold", action="store_true", help="do what lines on standard input say")
    parser.add_argument("--batch", type=int, help="with --hold: how many are sent for each `go`; by default all")
    options = parser.parse_args()
    if options.type not in TYPES:
        parser.error(f"--type must be one of {', '.join(TYPES)}")
    kind = common.message_type(options.type)
    rclpy.init()
    node = rclpy.create_node("peer_publisher")
    publisher = node.create_publisher(kind, options.topic, common.quality(options))
    common.say(up=True)
    common.wait_until("no subscriber", options.timeout, lambda: publisher.get_subscription_count() >= 1)
    common.say(matched=True)
    probed, sent = 0, 0
    digest, content, due = hashlib.sha256(), hashlib.sha256(), time.monotonic()

    def serialised(fields: dict) -> bytes:
        """A message with these fields, as it is sent."""
        return serialize_message(common.fill(kind(), fields))

    while sent < options.count:
        line = sys.stdin.readline() if options.hold else "go"
        if not line:
            break
        if line.strip() == "probe":
            probed += 1
            publisher.publish(serialised(probe(options.type, probed)))
            continue
        if line.strip() == "alone":
            heard_by = node.get_subscriptions_info_by_topic
            common.wait_until("somebody subscribes", options.timeout, lambda: not heard_by(options.topic))
            common.say(alone=True)
            continue
        # Without a rate, time does not matter; with one, the first sample of a batch is due at once.
        due = time.monotonic()
        for number in range(sent, min(options.count, sent + (options.batch or options.count))):
            raw = serialised(sample(options.type, options.seed, number, options.short))
            digest.update(raw)
            content.update(canonical(options.type, raw))
            publisher.publish(raw)
            sent += 1
            if options.rate:
                due += 1 / options.rate
                time.sleep(max(0.0, due - time.monotonic()))
    publisher.wait_for_all_acked(Duration(seconds=options.timeout))
    known = node.get_subscriptions_info_by_topic(options.topic)
    reliable = all(one.qos_profile.reliability == ReliabilityPolicy.RELIABLE for one in known)
    common.say(count=sent, digest=digest.hexdigest(), content=content.hexdigest(), reliable=reliable, code=0)
    if options.hold:
        sys.stdin.read()
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
