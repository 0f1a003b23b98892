"""Recordings as rosbags writes and reads them, for the tests of sesame-recording.

    venv/bin/python recordings_oracle.py write FOLDER 20 7   # writes recordings of all kinds below a folder
    venv/bin/python recordings_oracle.py read FOLDER...      # reads recordings

The numbers are how many topics, of random types, and the seed. A line is a message as rosbags reads it: `recording`
with the path, `topic`, `time` in nanoseconds, and `fields` with real numbers as the bits of doubles in hexadecimal.
Messages that rosbags cannot read are `null`; recordings that it cannot open have no lines.
"""

import contextlib
import dataclasses
import json
import pathlib
import random
import sys

import numpy
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cdr_oracle import bits, rosbags_samples

# Times of a recording: nanoseconds that no double holds.
START = 1_700_000_000_123_456_789

FOLDERS = [
    ("mcap", StoragePlugin.MCAP, CompressionMode.NONE),
    ("mcap_chunks", StoragePlugin.MCAP, CompressionMode.STORAGE),
    ("mcap_file", StoragePlugin.MCAP, CompressionMode.FILE),
    ("db3", StoragePlugin.SQLITE3, CompressionMode.NONE),
    ("db3_messages", StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    ("db3_file", StoragePlugin.SQLITE3, CompressionMode.FILE),
]


def shown(value, store):
    if dataclasses.is_dataclass(value):
        # Constants are attributes as well.
        _, fields = store.fielddefs[value.__msgtype__]
        return {name: shown(getattr(value, name), store) for name, _ in fields}
    if isinstance(value, numpy.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [shown(item, store) for item in value]
    return bits(value) if isinstance(value, float) else value


def stamped(store, draw):
    """Messages of real types, with times to the nanosecond."""
    types = store.types
    header = {"stamp": types["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=draw.randrange(10**9)),
              "frame_id": "odom"}
    if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__:
        header["seq"] = 7
    header = types["std_msgs/msg/Header"](**header)
    point = types["geometry_msgs/msg/Point"](x=draw.random(), y=-draw.random(), z=0.0)
    yield "/point", types["geometry_msgs/msg/PointStamped"](header=header, point=point)
    yield "/joints", types["sensor_msgs/msg/JointState"](
        header=header, name=["a", "b"], position=numpy.array([draw.random(), 1.0]),
        velocity=numpy.array([], dtype=float), effort=numpy.array([float("nan")]))


def write(folder, count, seed):
    folder.mkdir(parents=True, exist_ok=True)
    draw = random.Random(seed)
    random_ones = list(rosbags_samples(count, seed))
    for name, storage, mode in FOLDERS:
        writer = Writer2(folder / name, version=9, storage_plugin=storage)
        writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer:
            for at, sample in enumerate(random_ones):
                # Types of one name differ from topic to topic, so each has a package of its own.
                store = get_typestore(Stores.EMPTY)
                for kind, text in sample["files"].items():
                    own = text.replace("oracle/", f"p{at}/")
                    store.register(get_types_from_msg(own, f"p{at}/msg/{kind}"))
                kind = sample["type"].replace("oracle/", f"p{at}/")
                connection = writer.add_connection(f"/random_{at}", kind, typestore=store)
                writer.write(connection, START + at, bytes.fromhex(sample["cdr"]))
            store = get_typestore(Stores.ROS2_HUMBLE)
            for topic, message in stamped(store, draw):
                connection = writer.add_connection(topic, message.__msgtype__, typestore=store)
                for at in range(5):
                    raw = store.serialize_cdr(message, message.__msgtype__)
                    writer.write(connection, START + count + at * 1_000_000_007, raw)
    for name, method in [("plain", None), ("bz2", "BZ2"), ("lz4", "LZ4")]:
        writer = Writer1(folder / f"{name}.bag")
        if method:
            writer.set_compression(getattr(Writer1.CompressionFormat, method))
        with writer:
            store = get_typestore(Stores.ROS1_NOETIC)
            for topic, message in stamped(store, draw):
                connection = writer.add_connection(topic, message.__msgtype__, typestore=store)
                for at in range(5):
                    raw = store.serialize_ros1(message, message.__msgtype__)
                    writer.write(connection, START + at * 1_000_000_007, raw)


def read(path):
    try:
        reader = AnyReader([path])
        reader.open()
    except Exception as error:
        print(f"{path}: {error!r}", file=sys.stderr)
        return
    with contextlib.closing(reader):
        for connection, time, raw in reader.messages():
            try:
                fields = shown(reader.deserialize(raw, connection.msgtype), reader.typestore)
            except Exception:
                fields = None
            print(json.dumps({"recording": str(path), "topic": connection.topic, "time": time, "fields": fields}))


if __name__ == "__main__":
    if sys.argv[1] == "write":
        target = pathlib.Path(sys.argv[2])
        write(target, int(sys.argv[3]), int(sys.argv[4]))
        for found in sorted(target.iterdir()):
            read(found)
    else:
        for given in sys.argv[2:]:
            read(pathlib.Path(given))
