"""A client of a bridge by roslibpy that publishes numbered messages, or waits for some.

    roslib_client.py publish PORT TOPIC COUNT RATE
    roslib_client.py wait    PORT TOPIC COUNT [COMPRESSION]

It connects as soon as somebody listens. A publisher waits for a line on its standard input. At the end it says as JSON
how many messages there were, and the digest of what they say. Exit codes: 0 all of them; 2 they did not come in time.
"""

import hashlib
import json
import sys
import threading
import time

import roslibpy

TYPE = "sensor_msgs/JointState"


def message(number: int) -> dict:
    """A message whose numbers have few digits, as JSON has them."""
    return {"name": [f"j{number}"], "position": [number / 8, -number / 4], "velocity": [], "effort": []}


def said(content: dict) -> bytes:
    """What a message says, the same in every language."""
    eighths = ",".join(str(round(position * 8)) for position in content["position"])
    return f"{content['name'][0]}:{eighths};".encode()


def main() -> None:
    """Publishes or waits, as the arguments say."""
    part, port, topic, count, *rest = sys.argv[1:]
    client = roslibpy.Ros(host="127.0.0.1", port=int(port))
    client.factory.initialDelay = client.factory.maxDelay = 0.2
    digest, heard, complete = hashlib.sha256(), [], threading.Event()

    def take(content: dict) -> None:
        """Counts a message."""
        digest.update(said(content))
        heard.append(content)
        if len(heard) == int(count):
            complete.set()

    if part == "wait":
        options = {"compression": rest[0]} if rest else {}
        listener = roslibpy.Topic(client, topic, TYPE, queue_length=0, **options)
        listener.subscribe(take)
        client.run(timeout=60)
        in_time = complete.wait(60)
        print(json.dumps({"count": len(heard), "digest": digest.hexdigest()}), flush=True)
        client.terminate()
        sys.exit(0 if in_time else 2)
    talker = roslibpy.Topic(client, topic, TYPE, queue_size=1000, reconnect_on_close=True)
    client.on_ready(talker.advertise, run_in_thread=True)
    client.run(timeout=60)
    sys.stdin.readline()
    time.sleep(1)  # nodes behind the bridge may take a moment to find each other
    due = time.monotonic()
    for number in range(int(count)):
        digest.update(said(message(number)))
        talker.publish(roslibpy.Message(message(number)))
        due += 1 / float(rest[0])
        time.sleep(max(0.0, due - time.monotonic()))
    time.sleep(1)
    print(json.dumps({"count": int(count), "digest": digest.hexdigest()}), flush=True)
    client.terminate()


if __name__ == "__main__":
    main()
