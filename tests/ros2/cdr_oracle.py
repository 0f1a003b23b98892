"""Prints messages in CDR as others serialise them, one per line, for the tests of sesame-ros2.

    venv/bin/python cdr_oracle.py rosbags 1000 7    # random definitions and values, by rosbags
    venv/bin/python cdr_oracle.py rclpy 5 7         # values of all installed interfaces, by rclpy

The numbers are how many (with rclpy: of each interface) and the seed. A line is an object: `type`, `cdr` in
hexadecimal, `fields` with real numbers as the bits of doubles in hexadecimal, and with rosbags also `files`, the texts
of the definitions by their names. The same arguments print the same lines, except for padding, which rclpy does not
initialise.
"""

import importlib
import json
import pathlib
import random
import struct
import sys

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1),
    # For rosbags a `byte` is signed, for rclpy it is not.
    "byte": (0, 2**7 - 1), "char": (0, 2**7 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1),
    # Larger ones are numbers that Sesame does not have.
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**63 - 1),
}
PRIMITIVES = ["bool", "float32", "float64", *INTEGERS]
LETTERS = "abcXYZ 019_#\"'\\äß€語𝄞"


def integer(draw, kind):
    low, high = INTEGERS[kind]
    return draw.choice([low, high, 0, draw.randint(low, high), draw.randint(low, high)])


def real(draw, kind):
    """A finite or infinite number that the kind holds."""
    value = draw.choice([0.0, -0.0, 1.5, float("inf"), -float("inf"), draw.uniform(-1e6, 1e6), draw.uniform(-1, 1)])
    return struct.unpack("<f", struct.pack("<f", value))[0] if kind == "float32" else value


def text(draw, longest=8):
    return "".join(draw.choice(LETTERS) for _ in range(draw.randint(0, longest)))


def bits(value):
    return struct.pack(">d", value).hex()


# --- rosbags: random definitions ---


def random_type(draw, messages):
    """A type as a file writes it, and as (kind, element, how many): `one`, `array`, `sequence` or `bounded`."""
    word = draw.choice(PRIMITIVES + ["string", "string", "bounded"] + (["message"] * 4 if messages else []))
    if word == "bounded":
        bound = draw.randint(1, 9)
        word, element = f"string<={bound}", ("string", bound)
    elif word == "string":
        element = ("string", 8)
    elif word == "message":
        element = ("message", draw.choice(sorted(messages)))
        word = draw.choice([element[1], f"oracle/{element[1]}", f"oracle/msg/{element[1]}"])
    else:
        element = (word, None)
    count = draw.randint(1, 4)
    return draw.choice([
        (word, ("one", element, 1)), (word, ("one", element, 1)), (f"{word}[{count}]", ("array", element, count)),
        (f"{word}[]", ("sequence", element, 4)), (f"{word}[<={count}]", ("bounded", element, count)),
    ])


def random_definitions(draw):
    """Texts and fields by name; the last one may contain all others."""
    texts, messages = {}, {}
    for at in range(draw.randint(1, 4)):
        lines, fields = ["# A message.", ""], {}
        for number in range(draw.randint(0, 7)):
            if draw.random() < 0.2:
                lines.append(draw.choice([f"int32 CONSTANT_{number}=-{number}", f"string TEXT_{number}=\"a # b\"  "]))
            word, fields[f"f{number}_a"] = random_type(draw, messages)
            lines.append(f"{word}{draw.choice([' ', '   '])}f{number}_a{draw.choice(['', '  # a comment', ' # x=1'])}")
        texts[f"M{at}"], messages[f"M{at}"] = "\n".join(lines) + "\n", fields
    return texts, messages


def rosbags_samples(count, seed):
    import numpy
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    draw = random.Random(seed)

    def element(kind, store, messages):
        kind, detail = kind
        if kind == "message":
            return message(detail, store, messages)
        if kind == "string":
            # A bound counts bytes.
            value = text(draw, detail)
            while len(value.encode()) > detail:
                value = value[:-1]
            return value, value
        if kind == "bool":
            value = draw.random() < 0.5
            return value, value
        if kind.startswith("float"):
            value = real(draw, kind)
            return value, bits(value)
        value = integer(draw, kind)
        return value, value

    def message(name, store, messages):
        values, shown = {}, {}
        for field, (many, kind, most) in messages[name].items():
            if many == "one":
                values[field], shown[field] = element(kind, store, messages)
                continue
            length = most if many == "array" else draw.randint(0, most)
            pairs = [element(kind, store, messages) for _ in range(length)]
            values[field], shown[field] = [value for value, _ in pairs], [value for _, value in pairs]
            if kind[0] in PRIMITIVES:
                number = {"byte": "uint8", "char": "uint8"}.get(kind[0], kind[0])
                values[field] = numpy.array(values[field], dtype=number)
        if not values:
            number = draw.randint(0, 255)
            values = shown = {"structure_needs_at_least_one_member": number}
        return store.types[f"oracle/msg/{name}"](**values), shown

    for _ in range(count):
        texts, messages = random_definitions(draw)
        store = get_typestore(Stores.EMPTY)
        types = {}
        for name, body in texts.items():
            types.update(get_types_from_msg(body, f"oracle/msg/{name}"))
        store.register(types)
        last = list(texts)[-1]
        value, shown = message(last, store, messages)
        cdr = store.serialize_cdr(value, f"oracle/msg/{last}", little_endian=draw.random() < 0.7)
        yield {"files": texts, "type": f"oracle/msg/{last}", "cdr": bytes(cdr).hex(), "fields": shown}


# --- rclpy: all that is installed ---


def rclpy_sample(cls, draw):
    """A random message of a class as rclpy serialises it, and as it is shown."""
    from rclpy.serialization import serialize_message
    from rosidl_parser import definition as idl

    words = {"double": "float64", "float": "float32", "octet": "byte", "boolean": "bool"}

    def value_of(kind):
        """A value as rclpy takes it, and as it is shown."""
        if isinstance(kind, idl.BasicType):
            word = words.get(kind.typename, kind.typename)
            if word == "bool":
                value = draw.random() < 0.5
                return value, value
            if word.startswith("float"):
                value = real(draw, word)
                return value, bits(value)
            value = integer(draw, word)
            return (bytes([value]) if word == "byte" else value), value
        if isinstance(kind, idl.AbstractGenericString):
            value = text(draw)
            return value, value
        if isinstance(kind, idl.NamespacedType):
            return message(getattr(importlib.import_module(".".join(kind.namespaces)), kind.name))
        if isinstance(kind, idl.Array):
            length = kind.size
        else:
            length = draw.randint(0, min(3, getattr(kind, "maximum_size", 3)))
        pairs = [value_of(kind.value_type) for _ in range(length)]
        return [value for value, _ in pairs], [value for _, value in pairs]

    def message(cls):
        values, shown = {}, {}
        for name, kind in zip(cls.get_fields_and_field_types(), cls.SLOT_TYPES):
            values[name], shown[name] = value_of(kind)
        # Nobody can set the member of an empty message, and rclpy does not show it.
        return cls(**values), shown or {"structure_needs_at_least_one_member": 0}

    value, shown = message(cls)
    return serialize_message(value), shown


def rclpy_samples(count, seed):
    draw = random.Random(seed)
    share = pathlib.Path(sys.executable).parent.parent / "share"
    for file in sorted([*share.glob("*/msg/*.msg"), *share.glob("*/srv/*.srv")]):
        kind, package = file.parent.name, file.parent.parent.name
        try:
            cls = getattr(importlib.import_module(f"{package}.{kind}"), file.stem)
        except (ImportError, AttributeError):
            # Its files are installed, its code is not.
            continue
        parts = [("", cls)] if kind == "msg" else [("_Request", cls.Request), ("_Response", cls.Response)]
        for suffix, part in parts:
            for _ in range(count):
                cdr, shown = rclpy_sample(part, draw)
                yield {"type": f"{package}/{kind}/{file.stem}{suffix}", "cdr": cdr.hex(), "fields": shown}


def main():
    by, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    for sample in {"rosbags": rosbags_samples, "rclpy": rclpy_samples}[by](count, seed):
        print(json.dumps(sample))


if __name__ == "__main__":
    main()
