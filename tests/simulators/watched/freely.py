"""A robot that drives towards a person, as `sim.py`, but nobody steps it: the camera says what it sees ten times a second.

The light of the camera fails from time to time, and for a while the camera is silent.
"""

import json
import sys
import threading
import time

PUBLISHES = ["camera/light", "cell/gap", "robot/drive", "robot/lamp"]
SUBSCRIBES = ["robot/drive", "eddi/transport"]

speed, lamp = 1.0, False


def send(what):
    print(json.dumps(what), flush=True)


def listen():
    global lamp, speed
    for line in sys.stdin:
        for message in json.loads(line)["deliver"]:
            if message["topic"] == "eddi/transport":
                lamp = message["value"] > 0
            else:
                speed = message["value"]["speed"]


json.loads(sys.stdin.readline())
send({"ready": {"publishes": PUBLISHES, "subscribes": SUBSCRIBES}})
listener = threading.Thread(target=listen, daemon=True)
listener.start()
gap, started, step = 10.0, time.monotonic(), 0
send({"publish": [{"topic": "robot/drive", "value": {"speed": 1.0, "gear": 3}}]})
while listener.is_alive():
    step += 1
    time.sleep(max(0.0, started + step * 0.1 - time.monotonic()))
    gap -= speed * 0.1
    messages = [{"topic": "cell/gap", "value": gap}, {"topic": "robot/lamp", "value": lamp}]
    if not 15 < step < 41:
        messages.insert(0, {"topic": "camera/light", "value": 50 if step % 12 == 0 else 200})
    send({"publish": messages})
