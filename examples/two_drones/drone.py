"""A drone on a straight leg: it says where it is, and flies as fast as its ground station orders.

    python drone.py SYSTEM NORTH EAST HEADING ADDRESS

It begins at NORTH and EAST in metres and flies towards HEADING, `north` or `east`, at 3 m/s.
"""

import os
import sys
import time

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  which reads the variable

PERIOD = 0.05  # s


def main() -> None:
    system, north, east, heading, address = sys.argv[1:]
    place = [float(north), float(east)]
    axis = ["north", "east"].index(heading)
    link = mavutil.mavlink_connection(f"udpout:{address}", source_system=int(system), source_component=1)
    ml, begin, speed, steps = mavutil.mavlink, time.monotonic(), 3.0, 0
    while True:
        while (order := link.recv_match(type="COMMAND_LONG")) is not None:
            if order.target_system == int(system) and order.command == ml.MAV_CMD_DO_CHANGE_SPEED:
                speed = order.param2
        if steps % 20 == 0:
            link.mav.heartbeat_send(ml.MAV_TYPE_QUADROTOR, ml.MAV_AUTOPILOT_GENERIC, 0, 0, ml.MAV_STATE_ACTIVE)
        velocity = [0.0, 0.0]
        velocity[axis] = speed
        passed = int(1000 * (time.monotonic() - begin))
        link.mav.local_position_ned_send(passed, *place, -10.0, *velocity, 0.0)
        place[axis] += speed * PERIOD
        steps += 1
        time.sleep(max(0.0, begin + steps * PERIOD - time.monotonic()))


if __name__ == "__main__":
    main()
