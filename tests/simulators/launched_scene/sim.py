"""A robot that drives at 1 m/s through the world beside which it runs. It knows nothing of scenes, and is reset."""
import json
import os
import sys
from pathlib import Path


def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        if order["reset"].get("parameters"):
            sys.exit("it takes no parameters")
        start, boxes = Path(os.environ["SESAME_WORKER_FOLDER"], "world").read_text().split()
        place, step = float(start), order["reset"]["step"]
        order = answer({"ready": {"publishes": ["place", "load"], "subscribes": ["place"], "resets": True}})
    else:
        place += step
        messages = [{"topic": "place", "value": place}, {"topic": "load", "value": int(boxes)}]
        order = answer({"done": {"messages": messages}})
