"""Publishes or receives random samples of many types at once, each on a topic of its own: `/peer_0`, `/peer_1`, …

    any_types.py types     --types 30                  the types, one per line
    any_types.py publish   --types 30 --count 10       on `/peer_0/undisturbed` and so on, as lines say that come in
    any_types.py subscribe --types 30 --count 10

With rclpy the types are installed ones, in a random order; with Cyclone DDS (`--folder`) they are random definitions,
and `types` writes their `.msg` files below that folder. Publisher and subscriber print how many samples there were, and
a digest of each topic: over the bytes with rclpy, and with Cyclone DDS over what it serialises anew. Both say `up`, and
`matched` when somebody is at the other end of each topic. A publisher sends a probe on each topic for a line `probe`,
and all samples for `go`; a subscriber says `heard` with the number of the probe that it has heard on all topics, and at
a line it says `begun`: what comes then are samples. A publisher stays until its input ends (`common.py` says why). Exit
codes: 0 all was sent or came; 2 nobody subscribed, or not all came in time.
"""

import argparse
import dataclasses
import hashlib
import importlib
import json
import os
import pathlib
import random
import sys
import threading
import time
from types import new_class

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import cdr_oracle

# So many probes are known.
PROBES = 64


class Ros:
    """Installed types, by rclpy."""

    def __init__(self, options: argparse.Namespace) -> None:
        import rclpy
        import rclpy.duration

        share = pathlib.Path(sys.executable).parent.parent / "share"
        found = []
        for file in sorted(share.glob("*/msg/*.msg")):
            package = file.parent.parent.name
            if package == "test_msgs":
                continue  # it is there for its actions; its `WStrings` of Jazzy is not read yet, as the pages say
            try:
                getattr(importlib.import_module(f"{package}.msg"), file.stem)
            except (ImportError, AttributeError):
                continue  # its files are installed, its code is not
            found.append(f"{package}/msg/{file.stem}")
        draw = random.Random(options.seed)
        self.types = draw.sample(found, min(options.types, len(found)))
        self.rclpy, self.draw, self.node = rclpy, draw, None
        self.heard_of = set()

    def classes(self) -> list[type]:
        """The Python class of each type."""
        named = [name.split("/") for name in self.types]
        return [getattr(importlib.import_module(f"{package}.msg"), name) for package, _, name in named]

    def join(self, name: str) -> None:
        """Becomes a node."""
        self.rclpy.init()
        self.node = self.rclpy.create_node(name)

    def writers(self, topics: list[str]) -> list:
        """A publisher for each type."""
        return [self.node.create_publisher(kind, topic, 1000) for kind, topic in zip(self.classes(), topics)]

    @staticmethod
    def matched(writer) -> bool:
        """Whether somebody subscribes."""
        return writer.get_subscription_count() > 0

    def sample(self, number: int, draw: random.Random) -> bytes:
        """A random sample of a type, as it is sent."""
        return cdr_oracle.rclpy_sample(self.classes()[number], draw)[0]

    def await_acks(self, writer, seconds: float) -> None:
        """Waits until everybody has what was sent."""
        writer.wait_for_all_acked(self.rclpy.duration.Duration(seconds=seconds))

    @staticmethod
    def bytes(sample: bytes) -> bytes:
        """A sample as it is on the wire: filled up to a multiple of four bytes, between two nodes of ROS too."""
        return sample + bytes(-len(sample) % 4)

    @staticmethod
    def write(writer, sample: bytes) -> None:
        """Sends a sample."""
        writer.publish(sample)

    def listen(self, topics: list[str], take) -> None:
        """Hands samples on as they come, in `spin`."""
        from rclpy.event_handler import SubscriptionEventCallbacks

        for number, (kind, topic) in enumerate(zip(self.classes(), topics)):
            # Those that are matched say so while they are spun.
            events = SubscriptionEventCallbacks(matched=lambda _, number=number: self.heard_of.add(number))
            self.node.create_subscription(
                kind, topic, lambda raw, number=number: take(number, raw), 1000, raw=True, event_callbacks=events
            )

    def all_matched(self) -> bool:
        """Whether somebody publishes on each topic that is listened to."""
        return len(self.heard_of) == len(self.types)

    def spin(self) -> None:
        """Waits a moment for samples."""
        self.rclpy.spin_once(self.node, timeout_sec=0.1)


class Cyclone:
    """Random definitions, by Cyclone DDS."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.draw = random.Random(options.seed)
        self.definitions = []
        self.built = []
        while len(self.definitions) < options.types:
            texts, messages = cdr_oracle.random_definitions(self.draw)
            if not all(messages.values()):  # ROS gives an empty message a member that its file does not have
                continue
            at = len(self.definitions)
            self.definitions.append((texts, messages))
            self.built.append(self.build(at, messages))
            # Before its first heartbeat Cyclone DDS drops what comes, so its probes must differ.
            if len(probes(self, at)) < PROBES:
                self.definitions.pop()
                self.built.pop()
        self.types = [f"random_{at}/msg/{list(texts)[-1]}" for at, (texts, _) in enumerate(self.definitions)]
        self.readers, self.take = [], None

    def files(self, folder: pathlib.Path) -> None:
        """Writes the `.msg` files."""
        for at, (texts, _) in enumerate(self.definitions):
            package = folder / f"random_{at}" / "msg"
            package.mkdir(parents=True, exist_ok=True)
            for name, text in texts.items():
                (package / f"{name}.msg").write_text(text.replace("oracle/", f"random_{at}/"))

    @staticmethod
    def build(at: int, messages: dict) -> dict:
        """The classes of a definition and those in it, by name."""
        from cyclonedds.idl import IdlStruct, types

        named = {"byte": types.uint8, "char": types.uint8, "bool": bool}
        built = {}

        def element(kind):
            word, detail = kind
            if word == "message":
                return built[detail]
            if word == "string":
                return types.bounded_str[detail] if detail != 8 else str
            return named.get(word) or getattr(types, word)

        for name, fields in messages.items():
            members = []
            for field, (many, kind, most) in fields.items():
                of = element(kind)
                if many == "array":
                    of = types.array[of, most]
                elif many == "sequence":
                    of = types.sequence[of]
                elif many == "bounded":
                    of = types.sequence[of, most]
                members.append((field, of))
            # The name on the wire is an argument of a class statement.
            body = {"__annotations__": dict(members), "__qualname__": name}
            wire = {"typename": f"random_{at}::msg::dds_::{name}_"}
            made = new_class(name, (IdlStruct,), wire, lambda space, body=body: space.update(body))
            built[name] = dataclasses.dataclass(made)
        return built

    def join(self, _: str) -> None:
        """Becomes a participant."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.util import duration

        self.participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        self.qos = Qos(
            Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000), Policy.Durability.Volatile,
        )

    def of(self, name: str, number: int):
        """The topic of a type."""
        from cyclonedds.topic import Topic

        last = list(self.definitions[number][1])[-1]
        return Topic(self.participant, f"rt{name}", self.built[number][last], qos=self.qos)

    def writers(self, topics: list[str]) -> list:
        """A writer for each type."""
        from cyclonedds.pub import DataWriter

        return [DataWriter(self.participant, self.of(name, at), qos=self.qos) for at, name in enumerate(topics)]

    @staticmethod
    def matched(writer) -> bool:
        """Whether somebody reads."""
        return bool(writer.get_matched_subscriptions())

    @staticmethod
    def await_acks(writer, seconds: float) -> None:
        """Waits until everybody has what was sent."""
        from cyclonedds.util import duration

        writer.wait_for_acks(duration(seconds=seconds))

    def all_matched(self) -> bool:
        """Whether somebody publishes on each topic that is listened to."""
        return all(reader.get_matched_publications() for reader in self.readers)

    def sample(self, number: int, draw: random.Random):
        """A random sample of a type."""
        messages = self.definitions[number][1]

        def one(kind):
            word, detail = kind
            if word == "message":
                return message(detail)
            if word == "string":
                value = cdr_oracle.text(draw, detail)
                while len(value.encode()) > detail:
                    value = value[:-1]
                return value
            if word == "bool":
                return draw.random() < 0.5
            if word.startswith("float"):
                return cdr_oracle.real(draw, word)
            return cdr_oracle.integer(draw, word)

        def message(name):
            values = {}
            for field, (many, kind, most) in messages[name].items():
                length = most if many == "array" else draw.randint(0, most)
                values[field] = one(kind) if many == "one" else [one(kind) for _ in range(length)]
            return self.built[number][name](**values)

        return message(list(messages)[-1])

    @staticmethod
    def bytes(sample) -> bytes:
        """What counts of a sample."""
        return sample.serialize()

    @staticmethod
    def write(writer, sample) -> None:
        """Sends a sample."""
        writer.write(sample)

    def listen(self, topics: list[str], take) -> None:
        """Hands samples on as they come, in `spin`."""
        from cyclonedds.sub import DataReader

        self.readers = [DataReader(self.participant, self.of(name, at), qos=self.qos) for at, name in enumerate(topics)]
        self.take = take

    def spin(self) -> None:
        """Looks for samples."""
        for number, reader in enumerate(self.readers):
            for sample in reader.take(100):
                self.take(number, sample)
        time.sleep(0.001)


def say(**said) -> None:
    """Says something, in a line."""
    print(json.dumps(said), flush=True)


def probe(peer: Ros | Cyclone, number: int, count: int):
    """The probe of a number on the topic of a type: of draws that no sample has."""
    return peer.sample(number, random.Random(f"probe {number} {count}"))


def probes(peer: Ros | Cyclone, number: int) -> dict[bytes, int]:
    """The numbers of probes on the topic of a type by their content. They are fewer where a type has few values."""
    return {peer.bytes(probe(peer, number, count)): count for count in range(1, PROBES + 1)}


def publish(options: argparse.Namespace, peer: Ros | Cyclone) -> int:
    """Sends probes, and samples of all types in turn, once all topics have subscribers."""
    writers = peer.writers([f"/peer_{number}/undisturbed" for number in range(len(peer.types))])
    say(up=True)
    end = time.monotonic() + options.timeout
    while not all(peer.matched(writer) for writer in writers):
        if time.monotonic() > end:
            say(error="timeout: no subscriber")
            return 2
        time.sleep(0.005)
    say(matched=True)
    probed = 0
    while sys.stdin.readline().strip() == "probe":
        probed += 1
        for number, writer in enumerate(writers):
            peer.write(writer, probe(peer, number, probed))
    digests = [hashlib.sha256() for _ in writers]
    for _ in range(options.count):
        for number, writer in enumerate(writers):
            sample = peer.sample(number, peer.draw)
            digests[number].update(peer.bytes(sample))
            peer.write(writer, sample)
            time.sleep(1 / options.rate)
    for writer in writers:
        peer.await_acks(writer, options.timeout)
    say(count=options.count * len(writers), digests=[digest.hexdigest() for digest in digests], code=0)
    sys.stdin.read()
    return 0


def subscribe(options: argparse.Namespace, peer: Ros | Cyclone) -> int:
    """Receives samples until there are enough of all types."""
    digests, count = [hashlib.sha256() for _ in peer.types], 0
    known = [probes(peer, number) for number in range(len(peer.types))] if options.folder else None
    heard, last, begun = [0] * len(peer.types), time.monotonic(), threading.Event()

    def take(number: int, sample) -> None:
        nonlocal count, last
        content, last = peer.bytes(sample), time.monotonic()
        if begun.is_set():
            digests[number].update(content)
            count += 1
            return
        # With rclpy padding may be anything, so probes are not known by their bytes. None of them is lost, either.
        before = min(heard)
        heard[number] = known[number].get(content, 0) if known else heard[number] + 1
        if min(heard) > before:
            say(heard=min(heard))

    def begin() -> None:
        """Whatever comes from now on counts."""
        sys.stdin.readline()
        begun.set()
        say(begun=True)

    peer.listen([f"/peer_{number}" for number in range(len(peer.types))], take)
    say(up=True)
    threading.Thread(target=begin, daemon=True).start()
    is_matched = False
    wanted = options.count * len(peer.types)
    while count < wanted and time.monotonic() < last + options.timeout:
        if not is_matched and peer.all_matched():
            is_matched = True
            say(matched=True)
        peer.spin()
    code = 0 if count >= wanted else 2
    say(count=count, digests=[digest.hexdigest() for digest in digests], code=code)
    return code


def main() -> None:
    """Reads the options and plays the part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["types", "publish", "subscribe"])
    parser.add_argument("--folder", type=pathlib.Path, help="with Cyclone DDS: where definitions are written")
    parser.add_argument("--types", type=int, default=30, help="how many types (default: 30)")
    parser.add_argument("--count", type=int, default=10, help="how many samples of each (default: 10)")
    parser.add_argument("--rate", type=float, default=500, help="samples per second, of all types (default: 500)")
    parser.add_argument("--seed", type=int, default=1, help="of types and samples (default: 1)")
    parser.add_argument("--timeout", type=float, default=60, help="seconds after which to give up (default: 60)")
    options = parser.parse_args()
    peer = Cyclone(options) if options.folder else Ros(options)
    if options.part == "types":
        if options.folder:
            peer.files(options.folder)
        print("\n".join(peer.types))
        sys.exit(0)
    peer.join(f"peer_{options.part}")
    sys.exit((publish if options.part == "publish" else subscribe)(options, peer))


if __name__ == "__main__":
    main()
