"""Relays a topic to another one by roslibpy, as simply as that can be done.

    roslib_relay.py PORT FROM TO TYPE
"""

import sys

import roslibpy


def main() -> None:
    """Relays until its input ends."""
    port, origin, destination, kind = sys.argv[1:]
    client = roslibpy.Ros(host="127.0.0.1", port=int(port))
    client.run(timeout=30)
    publisher = roslibpy.Topic(client, destination, kind, queue_size=1000)
    publisher.advertise()
    listener = roslibpy.Topic(client, origin, kind, queue_length=0)
    listener.subscribe(lambda content: publisher.publish(roslibpy.Message(content)))
    print("ready", flush=True)
    sys.stdin.read()
    client.terminate()


if __name__ == "__main__":
    main()
