"""Random samples for the peers, the same for all of them: plain Python values of a few types of different shapes.

A sample is a function of its type, the seed and its number alone, so a subscriber can tell which samples it should get.
"""

import random
import struct

# Probes are samples of a seed of their own. So many of them are known.
PROBES = 500

TYPES = ("std_msgs/msg/String", "std_msgs/msg/Float64", "geometry_msgs/msg/PointStamped", "sensor_msgs/msg/JointState")


def text(luck: random.Random) -> str:
    """A text of up to 12 characters, some of more than one byte; its length shifts the alignment of what follows."""
    return "".join(luck.choice("abcxyz_/0129 äß€𝄞") for _ in range(luck.randrange(13)))


def any_number(luck: random.Random) -> float:
    """Any finite or infinite number."""
    return luck.choice([luck.uniform(-1e3, 1e3), luck.gauss(0, 1), 0.0, -0.0, 1e300, 5e-324, float("inf")])


def short_number(luck: random.Random) -> float:
    """A number of a few digits, which every reader of JSON reads exactly."""
    return luck.choice([round(luck.uniform(-1e3, 1e3), 3), round(luck.gauss(0, 1), 5), 0.0, -0.0])


def sample(kind: str, seed: int, count: int, short: bool = False) -> dict:
    """The fields of a sample, nested as in its `.msg` file."""
    luck = random.Random(f"{kind} {seed} {count}")
    number = short_number if short else any_number
    header = {
        "stamp": {"sec": luck.randrange(-(2**31), 2**31), "nanosec": luck.randrange(10**9)},
        "frame_id": text(luck),
    }
    if kind == "std_msgs/msg/String":
        return {"data": text(luck)}
    if kind == "std_msgs/msg/Float64":
        return {"data": number(luck)}
    if kind == "geometry_msgs/msg/PointStamped":
        return {"header": header, "point": {axis: number(luck) for axis in "xyz"}}
    joints = luck.randrange(8)
    return {
        "header": header,
        "name": [text(luck) for _ in range(joints)],
        "position": [number(luck) for _ in range(joints)],
        "velocity": [number(luck) for _ in range(luck.randrange(8))],
        "effort": [number(luck) for _ in range(luck.randrange(3))],
    }


def probe(kind: str, number: int) -> dict:
    """The fields of a probe of this number, which no other sample has."""
    if not 1 <= number <= PROBES:
        raise ValueError(f"there is no probe {number}")
    fields = sample(kind, 0, 0, short=True)
    if kind == "std_msgs/msg/String":
        return {"data": f"probe {number}"}
    if kind == "std_msgs/msg/Float64":
        return {"data": -4096.0 - number / 8}
    return {**fields, "header": {**fields["header"], "frame_id": f"probe {number}"}}


def probes(kind: str, serialised) -> dict[bytes, int]:
    """The numbers of probes by their content, as a middleware serialises their fields."""
    numbers = range(1, PROBES + 1)
    return {canonical(kind, serialised(probe(kind, number))): number for number in numbers}


def canonical(kind: str, raw: bytes) -> bytes:
    """The content of a sample in CDR without what may differ between vendors: padding, and its bytes' values.

    It reads little-endian CDR of version 1, as all peers write it.
    """
    if raw[:2] != b"\x00\x01":
        raise ValueError(f"not little-endian CDR: {raw[:4].hex()}")
    body, at, out = raw[4:], 0, bytearray()

    def take(size: int) -> bytes:
        """Takes an aligned number."""
        nonlocal at
        at += -at % size
        taken = body[at : at + size]
        if len(taken) < size:
            raise ValueError("truncated")
        at += size
        return taken

    def take_text() -> None:
        """Takes a text with its length."""
        nonlocal at
        length = struct.unpack("<I", take(4))[0]
        out.extend(struct.pack("<I", length) + body[at : at + length])
        at += length

    def take_numbers() -> None:
        """Takes a sequence of float64."""
        length = struct.unpack("<I", take(4))[0]
        out.extend(struct.pack("<I", length))
        for _ in range(length):
            out.extend(take(8))

    if kind == "std_msgs/msg/String":
        take_text()
    elif kind == "std_msgs/msg/Float64":
        out.extend(take(8))
    else:
        out.extend(take(4) + take(4))
        take_text()
        if kind == "geometry_msgs/msg/PointStamped":
            out.extend(take(8) + take(8) + take(8))
        else:
            names = struct.unpack("<I", take(4))[0]
            out.extend(struct.pack("<I", names))
            for _ in range(names):
                take_text()
            for _ in range(3):
                take_numbers()
    return bytes(out)
