"""Two carts whose lanes cross, at 1 m/s. Cart `a` stops before the crossing while it hears that `b` is near it.

Where they start are parameters of the simulator: `start_a` and `start_b`, in metres before the crossing.
"""
import json
import sys


def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")


order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        step, scene = order["reset"]["step"], order["reset"].get("parameters", {})
        a, b = -scene.get("start_a", 6.0), -scene.get("start_b", 9.0)
        heard = None
        topics = {"publishes": ["carts/a/pose", "carts/b/pose"], "subscribes": ["carts/a/pose", "carts/b/pose"]}
        order = answer({"ready": {**topics, "parameters": ["start_a", "start_b"], "resets": True}})
    else:
        for message in order["step"]["messages"]:
            if message["topic"] == "carts/b/pose":
                heard = message["value"][1]
        occupied = heard is not None and -4.0 < heard < 2.0
        if not (occupied and -2.5 < a < -1.5):
            a += step
        b += step
        poses = [
            {"topic": "carts/a/pose", "value": [a, 0, 0]},
            {"topic": "carts/b/pose", "value": [0, b, 0]},
        ]
        order = answer({"done": {"messages": poses}})
