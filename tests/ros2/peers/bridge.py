"""Becomes a server of rosbridge (`rosbridge-server-rs`) on the ROS 2 Jazzy of another environment.

    bridge.py --ros tests/ros2/jazzy/venv --port 9090

The server is a program for an installed ROS: here it finds the libraries of the wheels instead. It says `listening`
once a connection to its port succeeds. With `--late` it is behind a forwarder that holds everything back.
"""

import argparse
import asyncio
import os
import pathlib
import signal
import socket
import stat
import subprocess
import sys
import sysconfig
import tempfile
import threading
import time


def environment(ros: pathlib.Path, shim: pathlib.Path) -> dict[str, str]:
    """The variables with which the server finds ROS."""
    site = ros / "lib" / "python3.11" / "site-packages"
    if not sysconfig.get_config_var("Py_ENABLE_SHARED"):
        sys.exit("bridge.py: this Python has no shared library, which libraries of ROS messages need; use another one")
    # It asks for the library that chooses a middleware; the wheels have the chosen one only.
    (shim / "librmw_implementation.so").symlink_to(ros / "lib" / "librmw_fastrtps_cpp.so")
    libraries = [ros / "lib", shim, *sorted(site.glob("ros_*.libs"))]
    python = pathlib.Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
    return {
        **os.environ,
        "LD_LIBRARY_PATH": ":".join(map(str, libraries)),
        # Libraries of generated messages for Python want its symbols.
        "LD_PRELOAD": str(python),
        "AMENT_PREFIX_PATH": str(ros),
        "ROS_DISTRO": "jazzy",
        "ROS_VERSION": "2",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
    }


async def forward(port: int, server: int, late: float) -> None:
    """Forwards connections to the server and back; each byte is so many seconds late."""

    async def one_way(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        loop = asyncio.get_running_loop()
        while data := await reader.read(1 << 16):
            loop.call_later(late, writer.write, data)
        loop.call_later(late, writer.close)

    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        from_server, to_server = await asyncio.open_connection("127.0.0.1", server)
        await asyncio.gather(one_way(reader, to_server), one_way(from_server, writer), return_exceptions=True)

    async with await asyncio.start_server(accept, "127.0.0.1", port) as forwarder:
        await forwarder.serve_forever()


def free_port() -> int:
    """A port that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main() -> None:
    """Starts the server, says when it listens, and ends with it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ros", type=pathlib.Path, required=True, help="the environment with ROS 2 Jazzy")
    parser.add_argument("--port", type=int, required=True, help="the port on this machine")
    parser.add_argument("--late", type=float, help="seconds by which a forwarder holds everything back, in each way")
    parser.add_argument("--stay", action="store_true", help="until it is terminated, not until its input ends")
    options = parser.parse_args()
    import rosbridge_server_rs

    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    port = options.port if options.late is None else free_port()

    program = pathlib.Path(rosbridge_server_rs.__file__).parent / "rosbridge_server_rs_jazzy"
    program.chmod(program.stat().st_mode | stat.S_IXUSR)  # its wheel forgets that
    with tempfile.TemporaryDirectory() as folder:
        # Without the services of rosapi, whose types are in no wheel.
        command = [str(program), "--no-rosapi", "--bind", f"127.0.0.1:{port}"]
        server = subprocess.Popen(command, env=environment(options.ros.resolve(), pathlib.Path(folder)))
        try:
            while server.poll() is None:
                with socket.socket() as probe:
                    if probe.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.05)
            if options.late is not None:
                way = forward(options.port, port, options.late)
                threading.Thread(target=lambda: asyncio.run(way), daemon=True).start()
            print("listening", flush=True)
            if options.stay:
                signal.pause()
            # The program that started this closes its input at the end, or is gone.
            sys.stdin.read()
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
