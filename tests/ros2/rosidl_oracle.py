"""What rosidl_adapter, which ROS builds its interfaces with, reads in definitions.

    python rosidl_oracle.py FOLDER...

It prints a line of JSON for each `.msg`, `.srv` and `.action` file below the folders: `file`, `package`, `name` and
`kind`; with `parts`, a list of `fields` (name and type) and `constants` (name and value) for each part of the file, or
with `refused`, the reason.
"""

import contextlib
import json
import os
import re
import sys
from pathlib import Path

from rosidl_adapter import parser

PARTS = {
    ".msg": lambda package, name, text: [parser.parse_message_string(package, name, text)],
    ".srv": lambda package, name, text: services(parser.parse_service_string(package, name, text)),
    ".action": lambda package, name, text: actions(parser.parse_action_string(package, name, text)),
}


def services(service):
    return [service.request, service.response]


def actions(action):
    return [action.goal, action.result, action.feedback]


def words(ty):
    """The type on the wire: there a byte is a number."""
    if ty.type in ("time", "duration"):
        raise TypeError(f"{ty.type} is of ROS 1, and refused by what follows the parser")
    own = {"byte": "uint8", "char": "uint8"}.get(ty.type, ty.type)
    of = own if ty.is_primitive_type() else f"{ty.pkg_name}/msg/{ty.type}"
    if ty.string_upper_bound is not None:
        of = f"{of}<={ty.string_upper_bound}"
    if not ty.is_array:
        return of
    return f"{of}[{'<=' if ty.is_upper_bound else ''}{ty.array_size or ''}]"


def part(message):
    return {
        "fields": [[field.name, words(field.type)] for field in message.fields],
        "constants": [[constant.name, constant.value] for constant in message.constants],
    }


def main() -> None:
    files = (path for folder in sys.argv[1:] for path in sorted(Path(folder).rglob("*")))
    for path in files:
        if path.suffix not in PARTS or not path.is_file():
            continue
        # A file lies in `PACKAGE/msg/NAME.msg`; some workspaces have no folder for the kind.
        folder = path.parent.parent if path.parent.name in ("msg", "srv", "action") else path.parent
        # A repository that is a package may be in a folder with a name that no package can have.
        package = re.sub("__+", "_", re.sub("[^a-z0-9]", "_", folder.name.lower())).strip("_")
        said = {"file": str(path), "package": package, "name": path.stem, "kind": path.suffix[1:]}
        try:
            with contextlib.redirect_stderr(open(os.devnull, "w")):
                messages = PARTS[path.suffix](package, path.stem, path.read_text(encoding="utf-8"))
                said["parts"] = [part(message) for message in messages]
        except Exception as error:  # noqa: BLE001  which it is is not documented
            said["refused"] = f"{type(error).__name__}: {error}"
        print(json.dumps(said))


if __name__ == "__main__":
    main()
