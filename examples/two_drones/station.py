"""The ground station of two drones whose legs cross: drone 2 waits until drone 1 has passed the crossing.

    python station.py ADDRESS
"""

import os
import sys

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402  which reads the variable

CRUISE = 3.0  # m/s


def main() -> None:
    link = mavutil.mavlink_connection(f"udpin:{sys.argv[1]}", source_system=255, source_component=190)
    print("ready", flush=True)
    first = None
    while True:
        heard = link.recv_match(type="LOCAL_POSITION_NED", blocking=True)
        if heard.get_srcSystem() == 1:
            first = heard
            continue
        # Drone 2 may go on unless drone 1 is about to cross; who has not been heard of is not there.
        crossing = first is not None and -9.0 < first.y < 4.0
        waits = crossing and -7.0 < heard.x < -4.0
        link.mav.command_long_send(
            2, 1, mavutil.mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 0, 0.0 if waits else CRUISE, 0, 0, 0, 0, 0
        )


if __name__ == "__main__":
    main()
