"""What grpcio-tools makes of the files of SimlogAPI: both versions, in a folder that is gone at the end."""

import importlib
import pathlib
import sys
import tempfile

from grpc_tools import protoc

PROTO = pathlib.Path(__file__).resolve().parent.parent / "proto"


def load(name):
    """The messages and the services of a file, for example `simlog2`."""
    with tempfile.TemporaryDirectory() as folder:
        known = pathlib.Path(protoc.__file__).parent / "_proto"
        arguments = ["", f"-I{PROTO}", f"-I{known}", f"--python_out={folder}", f"--grpc_python_out={folder}"]
        if protoc.main([*arguments, f"{name}.proto"]) != 0:
            sys.exit(f"grpcio-tools refuses {name}.proto")
        sys.path.insert(0, folder)
        try:
            return importlib.import_module(f"{name}_pb2"), importlib.import_module(f"{name}_pb2_grpc")
        finally:
            sys.path.remove(folder)
