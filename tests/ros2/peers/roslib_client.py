"""A client of a bridge by roslibpy that publishes numbered messages, or waits for some.

    roslib_client.py publish PORT TOPIC COUNT BATCH
    roslib_client.py wait    PORT TOPIC COUNT BATCH [COMPRESSION]

It connects as soon as somebody listens, and says `matched` then. For each line on its standard input a publisher sends
a `probe`, which is no message, or for `go` a batch of messages; who waits says `heard` with the number of the probe
that it has heard, and `count` after each batch. At the end it says as JSON how many messages there were, and the digest
of what they say; a publisher stays until its input ends. Exit codes: 0 all of them; 2 nothing came for too long.
"""

import hashlib
import json
import sys
import threading

import roslibpy

TYPE = "sensor_msgs/JointState"


def message(number: int) -> dict:
    """A message whose numbers have few digits, as JSON has them."""
    return {"name": [f"j{number}"], "position": [number / 8, -number / 4], "velocity": [], "effort": []}


def said(content: dict) -> bytes:
    """What a message says, the same in every language."""
    eighths = ",".join(str(round(position * 8)) for position in content["position"])
    return f"{content['name'][0]}:{eighths};".encode()


def say(**said) -> None:
    """Says something, in a line."""
    print(json.dumps(said), flush=True)


# How long nothing may come, in seconds.
LIMIT = 120.0


def main() -> None:
    """Publishes or waits, as the arguments say."""
    part, port, topic, count, batch, *rest = sys.argv[1:]
    client = roslibpy.Ros(host="127.0.0.1", port=int(port))
    client.factory.initialDelay = client.factory.maxDelay = 0.2
    digest = hashlib.sha256()
    if part == "wait":
        wait(client, topic, digest, int(count), int(batch), {"compression": rest[0]} if rest else {})
    talker = roslibpy.Topic(client, topic, TYPE, queue_size=1000, reconnect_on_close=True)
    client.on_ready(talker.advertise, run_in_thread=True)
    client.run(timeout=LIMIT)
    say(matched=True)
    probes = sent = 0
    for line in iter(sys.stdin.readline, ""):
        if line.strip() == "probe":
            probes += 1
            talker.publish(roslibpy.Message({**message(0), "name": ["probe"], "position": [probes, 0]}))
            continue
        for number in range(sent, min(int(count), sent + int(batch))):
            digest.update(said(message(number)))
            talker.publish(roslibpy.Message(message(number)))
            sent += 1
    say(count=sent, digest=digest.hexdigest())
    client.terminate()


def wait(client: roslibpy.Ros, topic: str, digest, count: int, batch: int, options: dict) -> None:
    """Waits for so many messages, and ends."""
    heard, news = 0, threading.Event()

    def take(content: dict) -> None:
        """Counts a message."""
        nonlocal heard
        if content["name"][0] == "probe":
            say(heard=round(content["position"][0]))
        elif heard < count:
            # What comes after is not waited for: this thread goes on until the other one ends the program.
            digest.update(said(content))
            heard += 1
            if heard % batch == 0 and heard < count:
                say(count=heard)
        news.set()

    listener = roslibpy.Topic(client, topic, TYPE, queue_length=0, **options)
    listener.subscribe(take)
    client.run(timeout=LIMIT)
    say(matched=True)
    while heard < count and news.wait(LIMIT):
        news.clear()
    is_complete = heard >= count
    say(count=heard, digest=digest.hexdigest())
    client.terminate()
    sys.exit(0 if is_complete else 2)


if __name__ == "__main__":
    main()
