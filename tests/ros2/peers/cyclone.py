"""Publishes or receives the samples of the peers by Cyclone DDS, without ROS, and prints number and digest as JSON.

    cyclone.py publish --topic /peer --type sensor_msgs/msg/JointState --count 100
    cyclone.py subscribe ...

`content` is over the values alone, which is the same for all vendors.
Exit codes: 0 all was sent or came; 2 nobody subscribed, or not all came in time.
"""

import argparse
import hashlib
import json
import os
import sys
import time

from cyclone_types import TYPES, build, quality
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from samples import canonical, sample


def publish(options: argparse.Namespace, writer: DataWriter) -> int:
    """Sends samples once a subscriber is there."""
    end = time.monotonic() + options.timeout
    while not writer.get_matched_subscriptions():
        if time.monotonic() > end:
            print(json.dumps({"error": "timeout: no subscriber"}))
            return 2
        time.sleep(0.005)
    if options.hold:
        sys.stdin.readline()
    time.sleep(0.3)  # the other side may take a moment longer to match
    content = hashlib.sha256()
    for number in range(options.count):
        message = build(options.type, sample(options.type, options.seed, number))
        content.update(canonical(options.type, message.serialize()))
        writer.write(message)
        if options.rate:
            time.sleep(1 / options.rate)
    time.sleep(options.linger)
    print(json.dumps({"count": options.count, "content": content.hexdigest()}))
    return 0


def subscribe(options: argparse.Namespace, reader: DataReader) -> int:
    """Receives samples until there are enough."""
    content, count = hashlib.sha256(), 0
    end = time.monotonic() + options.timeout
    while count < options.count and time.monotonic() < end:
        for message in reader.take(100):
            content.update(canonical(options.type, message.serialize()))
            count += 1
        time.sleep(0.001)
    print(json.dumps({"count": count, "content": content.hexdigest()}))
    return 0 if count >= options.count else 2


def main() -> None:
    """Reads the options and plays the part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["publish", "subscribe"])
    parser.add_argument("--topic", default="/peer", help="the topic, as ROS names it (default: /peer)")
    parser.add_argument("--type", choices=list(TYPES), default="sensor_msgs/msg/JointState")
    parser.add_argument("--count", type=int, default=100, help="how many samples (default: 100)")
    parser.add_argument("--rate", type=float, help="samples per second; as fast as possible by default")
    parser.add_argument("--seed", type=int, default=1, help="of the samples (default: 1)")
    parser.add_argument("--best-effort", action="store_true", help="best effort instead of reliable")
    parser.add_argument("--transient-local", action="store_true", help="transient local instead of volatile")
    parser.add_argument("--depth", type=int, default=1000, help="how many samples are kept (default: 1000)")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds after which to give up (default: 30)")
    parser.add_argument("--hold", action="store_true", help="wait for a line on standard input before the first sample")
    parser.add_argument("--linger", type=float, default=1.0, help="seconds to stay after the last sample (default: 1)")
    options = parser.parse_args()
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    wanted = quality(options.best_effort, options.transient_local, options.depth)
    topic = Topic(participant, "rt" + options.topic, TYPES[options.type], qos=wanted)
    if options.part == "publish":
        sys.exit(publish(options, DataWriter(participant, topic, qos=wanted)))
    sys.exit(subscribe(options, DataReader(participant, topic, qos=wanted)))


if __name__ == "__main__":
    main()
