"""Publishes or receives the samples of the peers by Cyclone DDS, without ROS, and prints number and digest as JSON.

    cyclone.py publish --topic /peer --type sensor_msgs/msg/JointState --count 100
    cyclone.py subscribe ...

`content` is over the values alone, which is the same for all vendors. Both say `up` and `matched`, and of probes that
they are told to send and have heard, as those that use rclpy (`common.py`); a publisher stays until its input ends.
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
from cyclonedds.util import duration
from samples import canonical, probe, probes, sample


def say(**said) -> None:
    """Says something, in a line."""
    print(json.dumps(said), flush=True)


def publish(options: argparse.Namespace, writer: DataWriter) -> int:
    """Sends samples as lines on the standard input say, once a subscriber is there."""
    say(up=True)
    end = time.monotonic() + options.timeout
    while not writer.get_matched_subscriptions():
        if time.monotonic() > end:
            say(error="timeout: no subscriber")
            return 2
        time.sleep(0.005)
    say(matched=True)
    probed = 0
    while sys.stdin.readline().strip() == "probe":
        probed += 1
        writer.write(build(options.type, probe(options.type, probed)))
    content = hashlib.sha256()
    for number in range(options.count):
        message = build(options.type, sample(options.type, options.seed, number))
        content.update(canonical(options.type, message.serialize()))
        writer.write(message)
        if options.rate:
            time.sleep(1 / options.rate)
    writer.wait_for_acks(duration(seconds=options.timeout))
    say(count=options.count, content=content.hexdigest(), code=0)
    sys.stdin.read()
    return 0


def subscribe(options: argparse.Namespace, reader: DataReader) -> int:
    """Receives samples until there are enough."""
    say(up=True)
    content, count, is_matched = hashlib.sha256(), 0, False
    known = probes(options.type, lambda fields: build(options.type, fields).serialize())
    last = time.monotonic()
    while count < options.count and time.monotonic() < last + options.timeout:
        if not is_matched and reader.get_matched_publications():
            is_matched = True
            say(matched=True)
        for message in reader.take(100):
            last, read = time.monotonic(), canonical(options.type, message.serialize())
            if number := known.get(read):
                say(heard=number)
                continue
            content.update(read)
            count += 1
        time.sleep(0.001)
    code = 0 if count >= options.count else 2
    say(count=count, content=content.hexdigest(), code=code)
    return code


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
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds of silence at most (default: 120)")
    options = parser.parse_args()
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    wanted = quality(options.best_effort, options.transient_local, options.depth)
    topic = Topic(participant, "rt" + options.topic, TYPES[options.type], qos=wanted)
    if options.part == "publish":
        sys.exit(publish(options, DataWriter(participant, topic, qos=wanted)))
    sys.exit(subscribe(options, DataReader(participant, topic, qos=wanted)))


if __name__ == "__main__":
    main()
