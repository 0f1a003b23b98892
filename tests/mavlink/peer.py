"""A vehicle or a ground station that speaks MAVLink by pymavlink, for tests: it says all datagrams as lines of JSON.

    python peer.py ground ADDRESS
    python peer.py vehicle ADDRESS COUNT
    python peer.py drone ADDRESS SYSTEM

A vehicle sends heartbeats until it reads a line; then so many positions, among other datagrams. The ground station
answers each position with an order. A drone sends numbered positions and, less often, other messages until it is
ended; the second one has a gimbal.
"""

import itertools
import json
import os
import sys
import threading
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  which reads the variable

ml = mavutil.mavlink
FIELDS = ("alt", "param2")


def say(**what) -> None:
    print(json.dumps({"at": time.monotonic(), **what}), flush=True)


def connect(address: str, system: int, component: int):
    link = mavutil.mavlink_connection(address, source_system=system, source_component=component)
    link.mav.robust_parsing = True
    return link


def send(link, data: bytes) -> None:
    say(sent=bytes(data).hex())
    link.write(data)


def receive(link) -> list:
    """The messages of the next datagram, if there is one; one that pymavlink does not accept is `BAD_DATA`."""
    data = link.recv()
    if not data:
        time.sleep(0.001)
        return []
    messages = link.mav.parse_buffer(data) or []
    values = [{name: getattr(it, name) for name in FIELDS if hasattr(it, name)} for it in messages]
    types = [it.get_type() for it in messages]
    sequence = [it.get_seq() if kind != "BAD_DATA" else None for it, kind in zip(messages, types)]
    say(came=bytes(data).hex(), types=types, values=values, sequence=sequence)
    return messages


def next_frame(link, message) -> bytes:
    frame = message.pack(link.mav)
    link.mav.seq = (link.mav.seq + 1) % 256
    return frame


def ground(address: str) -> None:
    link = connect(f"udpin:{address}", 255, 190)
    say(ready=True)
    while True:
        for message in receive(link):
            if message.get_type() == "GLOBAL_POSITION_INT":
                order = link.mav.command_long_encode(
                    1, 1, ml.MAV_CMD_DO_CHANGE_SPEED, 0, 1, message.alt / 1000, -1, 0, 0, 0, 0
                )
                send(link, next_frame(link, order))


def vehicle(address: str, count: int) -> None:
    link = connect(f"udpout:{address}", 1, 1)
    go = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.readline(), go.set()), daemon=True).start()
    heartbeat = link.mav.heartbeat_encode(ml.MAV_TYPE_QUADROTOR, ml.MAV_AUTOPILOT_PX4, 81, 7, ml.MAV_STATE_ACTIVE, 3)
    say(ready=True)
    while not go.is_set():
        link.write(next_frame(link, heartbeat))
        time.sleep(0.05)
    say(begin=True)
    time.sleep(0.3)
    signing = ml.MAVLink(None, srcSystem=1, srcComponent=1)
    signing.signing.secret_key, signing.signing.sign_outgoing = bytes(range(32)), True
    for number in range(count):
        position = link.mav.global_position_int_encode(number, 473977418, 85455939, 1000 * number, 0, 1, -2, 3, 0)
        send(link, next_frame(link, position))
        if number % 5 == 0:
            # Two messages in one datagram, one of version 1, one with a signature, one that nobody knows, and no
            # message at all.
            send(link, next_frame(link, heartbeat) + next_frame(link, heartbeat))
            send(link, heartbeat.pack(link.mav, force_mavlink1=True))
            send(link, heartbeat.pack(signing))
            send(link, bytes([0xFD, 1, 0, 0, number, 1, 1, 0x40, 0xE2, 0x0F, 5, 6, 7]))
            send(link, b"no message")
        for _ in range(10):
            receive(link)
    while True:
        receive(link)


def drone(address: str, system: int) -> None:
    link = connect(f"udpout:{address}", system, 1)
    gimbal = ml.MAVLink(None, srcSystem=system, srcComponent=154)
    heartbeat = link.mav.heartbeat_encode(ml.MAV_TYPE_QUADROTOR, ml.MAV_AUTOPILOT_PX4, 81, 7, ml.MAV_STATE_ACTIVE, 3)
    begin = time.monotonic()
    say(ready=True)
    for number in itertools.count():
        position = link.mav.global_position_int_encode(number, 473977418, 85455939, 1000 * number, 0, system, -2, 3, 0)
        say(number=number)
        link.write(next_frame(link, position))
        if number % 10 == 0:
            link.write(next_frame(link, heartbeat))
            link.write(next_frame(link, link.mav.statustext_encode(ml.MAV_SEVERITY_INFO, b"all is // well")))
            if system == 2:
                link.write(heartbeat.pack(gimbal))
                # One that nobody knows, and one of another definition.
                link.write(bytes([0xFD, 1, 0, 0, 0, system, 1, 0x40, 0xE2, 0x0F, 5, 6, 7]))
                link.write(bytes([0xFD, 1, 0, 0, 0, system, 1, 1, 0, 0, 5, 6, 7]))
        time.sleep(max(0.0, begin + 0.05 * (number + 1) - time.monotonic()))


if __name__ == "__main__":
    parts = {
        "ground": ground,
        "vehicle": lambda address, count: vehicle(address, int(count)),
        "drone": lambda address, system: drone(address, int(system)),
    }
    parts[sys.argv[1]](*sys.argv[2:])
