"""A robot that nobody steps, with a clock of its own. In its third run the distance falls silent after a second, and
from its fourth run on everything does."""

import json
import pathlib
import sys
import threading
import time


def send(what):
    print(json.dumps(what), flush=True)


def listen():
    for _ in sys.stdin:
        pass


runs = pathlib.Path(__file__).with_name("runs")
run = int(runs.read_text()) + 1 if runs.exists() else 1
runs.write_text(str(run))

json.loads(sys.stdin.readline())
topics = ["robot/speed", "robot/distance"]
send({"ready": {"publishes": topics, "subscribes": ["robot/speed"], "clock": True}})
listener = threading.Thread(target=listen, daemon=True)
listener.start()
tick = 0
while listener.is_alive():
    now = tick * 0.05
    send({"time": now})
    if run < 4:
        send({"publish": [{"topic": "robot/speed", "value": 1.0}]})
    if run < 3 or (run == 3 and now < 1.0):
        send({"publish": [{"topic": "robot/distance", "value": 5.0}]})
    tick += 1
    time.sleep(0.005)
