"""A robot whose camera is in the dark for a while. What it says comes as late as the argument says, in milliseconds.

It is dark from 2.2 s to 2.3 s, and the robot is near from 2.22 s to 2.24 s.
"""

import json
import sys

late = float(sys.argv[1]) / 1000.0


def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        topics = {"publishes": ["camera/light", "cell/gap", "robot/stop"], "subscribes": ["robot/stop"]}
        order = answer({"ready": {**topics, "resets": True}})
        continue
    time = order["step"]["time"]
    messages = []
    # Only what is new is said: a message for each change.
    for at, light in [(0.05, 200), (2.2, 50), (2.3, 200)]:
        if abs(time - at - late) < 0.001:
            messages.append({"topic": "camera/light", "value": light})
    for at, gap in [(0.05, 3.0), (2.22, 1.5), (2.24, 3.0)]:
        if abs(time - at) < 0.001:
            messages.append({"topic": "cell/gap", "value": gap})
    order = answer({"done": {"messages": messages}})
