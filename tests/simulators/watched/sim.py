"""A robot drives towards a person and is stopped by what a monitor sends.

The light of the camera fails by and by: it is dim from 4 s on and dark from 5 s on, until 11 s. The robot drives as the
last message that it received says, and shows a lamp as the state of the monitor says.
"""

import json
import sys


def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


PUBLISHES = ["camera/light", "cell/gap", "robot/drive", "robot/lamp"]
SUBSCRIBES = ["robot/drive", "eddi/transport"]

order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        step, gap, speed, lamp = order["reset"]["step"], 10.0, 0.0, False
        start = [{"topic": "robot/drive", "value": {"speed": 1.0, "gear": 3}}]
        topics = {"publishes": PUBLISHES, "subscribes": SUBSCRIBES}
        order = answer({"ready": {**topics, "resets": True, "messages": start}})
        continue
    time = order["step"]["time"]
    for message in order["step"].get("messages", []):
        if message["topic"] == "eddi/transport":
            lamp = message["value"] > 0
        elif message["value"]["gear"] != 3:
            order = answer({"failed": "the gear of the last message is lost"})
        else:
            speed = message["value"]["speed"]
    gap -= speed * step
    light = 200 if time < 4.0 or time >= 11.0 else 150 if time < 5.0 else 50
    order = answer({"done": {"messages": [
        {"topic": "camera/light", "value": light},
        {"topic": "cell/gap", "value": gap},
        {"topic": "robot/lamp", "value": lamp},
    ]}})
