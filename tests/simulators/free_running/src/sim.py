"""A cart that runs by a clock of its own, faster than the wall clock, and is pushed further in each of its runs."""
import json
import sys
import threading

received = threading.Condition()
pushes = []
resets = []


def send(what):
    print(json.dumps(what), flush=True)


def listen():
    for line in sys.stdin:
        request = json.loads(line)
        with received:
            if "reset" in request:
                pushes.clear()
                resets.append(request["reset"])
            else:
                pushes.extend(message["value"] for message in request["deliver"] if message["topic"] == "cart/push")
            received.notify_all()
    with received:
        resets.append(None)
        received.notify_all()


threading.Thread(target=listen, daemon=True).start()
runs = 0
while True:
    with received:
        received.wait_for(lambda: resets)
        if resets.pop(0) is None:
            sys.exit()
    runs += 1
    topics = ["cart/push", "cart/position"]
    send({"ready": {"publishes": topics, "subscribes": ["cart/push"], "resets": True, "clock": True}})
    for tenth in range(1, 30):
        send({"time": tenth / 10})
        if tenth <= 19:
            send({"publish": [{"topic": "cart/push", "value": runs}]})
            with received:
                received.wait_for(lambda: len(pushes) >= tenth or resets)
                if resets:
                    break
                position = pushes[tenth - 1]
            send({"publish": [{"topic": "cart/position", "value": position}]})
