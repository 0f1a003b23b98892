"""Prints what genmsg and genpy make of types of ROS 1, one per line, for the tests of sesame-ros1.

    /usr/bin/python3 oracle.py installed 5 7     # values of all installed types
    /usr/bin/python3 oracle.py random 300 7      # random types, and a value of each

The numbers are how many values each type has, or how many types there are, and the seed. A line is an object: `type`,
`md5`, `definition`, `files` (the texts of the `.msg` files by the types that they declare), and `samples`, each with
`bytes` in hexadecimal and `fields` with real numbers as the bits of doubles in hexadecimal. A service has `service`,
the text of its file, and no samples. The same arguments print the same lines.
"""

import io
import json
import pathlib
import random
import re
import struct
import sys

import genmsg
import genpy
import genpy.dynamic

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1), "byte": (-(2**7), 2**7 - 1), "char": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1),
    # Larger ones are numbers that Sesame does not have.
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**63 - 1),
}
LETTERS = "abcXYZ 019_#\"'\\äß€語𝄞"


def bits(value):
    return struct.pack(">d", value).hex()


class Draw(random.Random):
    """Random values of types, each as genpy takes it and as it is shown."""

    def value(self, kind, classes):
        array = re.fullmatch(r"(.*)\[(\d*)\]", kind)
        if array:
            length = int(array[2]) if array[2] else self.randint(0, 3)
            pairs = [self.value(array[1], classes) for _ in range(length)]
            return [value for value, _ in pairs], [shown for _, shown in pairs]
        if kind == "bool":
            value = self.random() < 0.5
            return value, value
        if kind in INTEGERS:
            low, high = INTEGERS[kind]
            value = self.choice([low, high, 0, self.randint(low, high), self.randint(low, high)])
            return value, value
        if kind in ("float32", "float64"):
            value = self.choice([0.0, -0.0, 1.5, float("inf"), self.uniform(-1e6, 1e6), self.uniform(-1, 1)])
            value = struct.unpack("<f", struct.pack("<f", value))[0] if kind == "float32" else value
            return value, bits(value)
        if kind == "string":
            value = "".join(self.choice(LETTERS) for _ in range(self.randint(0, 8)))
            return value, value
        if kind in ("time", "duration"):
            low = 0 if kind == "time" else -(2**31)
            sec, nanosec = self.randint(low, 2**31 - 1), self.randint(0, 10**9 - 1)
            cls = genpy.Time if kind == "time" else genpy.Duration
            value = cls(sec, nanosec)
            return value, {"sec": value.secs, "nanosec": value.nsecs}
        return self.message(classes[kind], classes)

    def message(self, cls, classes):
        message, shown = cls(), {}
        for name, kind in zip(cls.__slots__, cls._slot_types):
            value, shown[name] = self.value(kind, classes)
            setattr(message, name, value)
        return message, shown

    def sample(self, cls, classes):
        message, shown = self.message(cls, classes)
        out = io.BytesIO()
        message.serialize(out)
        return {"bytes": out.getvalue().hex(), "fields": shown}

    def definition(self, known):
        """The text of a `.msg` file that may contain what is known."""
        lines = ["# A message.", ""]
        for at in range(self.randint(0, 7)):
            if self.random() < 0.3:
                lines.append(self.choice([
                    f"int32 CONSTANT_{at}=-{at}", f"uint8  SPACED_{at} = {at} # a comment",
                    f"string TEXT_{at}= \"a # b\" = c  ", f"float32 REAL_{at}=0.5",
                ]))
            kind = self.choice(["bool", "float32", "float64", "string", "time", "duration", *INTEGERS] + known * 3)
            # Only alone does a header need no package.
            array = "" if kind == "Header" else self.choice(["", "", "[]", f"[{self.randint(1, 4)}]"])
            lines.append(f"{kind}{array}{self.choice([' ', '   '])}f{at}{self.choice(['', '  # a comment', ' #x=1'])}")
        return "\n".join(lines) + self.choice(["", "\n", "\n\n"])


def described(context, spec, texts):
    names = [spec.full_name, *context.get_all_depends(spec.full_name)]
    return {
        "type": spec.full_name, "md5": genmsg.compute_md5(context, spec),
        "definition": genmsg.compute_full_text(context, spec), "files": {name: texts[name] for name in names},
    }


def with_samples(line, draw, count):
    classes = genpy.dynamic.generate_dynamic(line["type"], line["definition"])
    line["samples"] = [draw.sample(classes[line["type"]], classes) for _ in range(count)]
    return line


def installed(draw, count):
    """All types with a file in the folders of the packages."""
    share = pathlib.Path("/usr/share")
    search = {}
    for file in sorted([*share.glob("*/msg/*.msg"), *share.glob("*/srv/*.srv")]):
        search.setdefault(file.parent.parent.name, []).append(str(file.parent.parent / "msg"))
    context = genmsg.MsgContext.create_default()
    texts = {f"{file.parent.parent.name}/{file.stem}": file.read_text() for file in share.glob("*/msg/*.msg")}
    for name in sorted(texts):
        spec = genmsg.load_msg_by_type(context, name, search)
        genmsg.load_depends(context, spec, search)
        yield with_samples(described(context, spec, texts), draw, count)
    for file in sorted(share.glob("*/srv/*.srv")):
        name = f"{file.parent.parent.name}/{file.stem}"
        spec = genmsg.msg_loader.load_srv_from_file(context, str(file), name)
        genmsg.load_depends(context, spec, search)
        used = {d for part in ("Request", "Response") for d in context.get_all_depends(name + part)}
        files = {name: texts[name] for name in sorted(used)}
        md5 = genmsg.compute_md5(context, spec)
        yield {"type": name, "md5": md5, "definition": "", "files": files, "service": file.read_text(), "samples": []}


def randomly(draw, count):
    """Random types, each over those of its own package, and over the header."""
    header = pathlib.Path("/usr/share/std_msgs/msg/Header.msg").read_text()
    for number in range(count):
        context = genmsg.MsgContext.create_default()
        package, texts = f"oracle{number}", {"std_msgs/Header": header}
        genmsg.msg_loader.load_msg_from_string(context, header, "std_msgs/Header")
        context.set_depends("std_msgs/Header", [])
        known = ["Header", "std_msgs/Header"]
        for at in range(draw.randint(1, 4)):
            name = f"{package}/M{at}"
            texts[name] = draw.definition(known)
            spec = genmsg.msg_loader.load_msg_from_string(context, texts[name], name)
            genmsg.load_depends(context, spec, {})
            known.append(draw.choice([f"M{at}", name]))
        yield with_samples(described(context, spec, texts), draw, 1)


def main():
    which, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    for line in {"installed": installed, "random": randomly}[which](Draw(seed), count):
        print(json.dumps(line))


if __name__ == "__main__":
    main()
