"""A robot in gusts, as a program that starts others: one stays with it, one begins a session of its own, and of one the
parent is gone. It writes down that it starts, is ready for a test, and ends because its input was closed. `FAULT` asks for a fault.
One of them is no fault: after three tests, `waits` waits for the file `on`, or for the end of the input."""

import json
import os
import random
import select
import signal
import subprocess
import sys
import time

FOLDER = os.environ["SESAME_WORKER_FOLDER"]
FAULT = os.environ.get("FAULT", "")
PAUSE = float(os.environ.get("PAUSE_US", "0")) / 1e6


def say(what):
    try:
        print(json.dumps(what), flush=True)
    except BrokenPipeError:
        pass  # nobody listens any more, which the input will tell


def note(what):
    with open(os.path.join(FOLDER, what), "a") as file:
        file.write(what + "\n")


note("started")
subprocess.Popen(["sleep", "1000"])
subprocess.Popen(["sleep", "1000"], start_new_session=True)
subprocess.run(["sh", "-c", "setsid sleep 1000 &"])


def listen():
    """The next order; None once the input is closed."""
    return json.loads(sys.stdin.readline() or "null")


runs = 0
while order := listen():
    if "reset" in order:
        note("ready")
        runs += 1
        while FAULT == "waits" and runs > 3 and not os.path.exists("on"):
            if select.select([sys.stdin], [], [], 0.01)[0]:
                break
        gust = random.Random(order["reset"]["seed"]).uniform(0.5, 1.5)
        say({"ready": {"publishes": ["gusty/push", "gusty/harm"], "subscribes": ["gusty/push"], "resets": True}})
        continue
    time.sleep(PAUSE)
    say({"publish": [{"topic": "gusty/push", "value": 0.0}]})
    if not (heard := listen()):
        break
    push = sum(message["value"] for message in heard["deliver"])
    if FAULT == "hang" and push > 0:
        note("hangs")
        time.sleep(1000)
    if FAULT == "killed without disturbance" or (FAULT == "killed" and push > 0):
        os.kill(os.getpid(), signal.SIGKILL)
    say({"done": {"messages": [{"topic": "gusty/harm", "value": push * gust}]}})

# Whoever is killed at the end of its input does not come to this; a second is what it is given.
time.sleep(0.1)
note("ended")
