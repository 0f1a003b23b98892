import json, sys, threading, time

def send(what):
    print(json.dumps(what), flush=True)

def listen():
    global target
    for line in sys.stdin:
        for message in json.loads(line)["deliver"]:                        # the cart
            target = message["value"]

json.loads(sys.stdin.readline())                                           # `reset`
position, target, started = 0.0, 0.0, time.monotonic()
send({"ready": {"publishes": ["cart/target", "cart/position"], "subscribes": ["cart/target"]}})
listener = threading.Thread(target=listen, daemon=True)
listener.start()
while listener.is_alive():
    wanted = 1.0 if time.monotonic() - started < 2.0 else 0.0              # the controller
    send({"publish": [{"topic": "cart/target", "value": wanted}, {"topic": "cart/position", "value": position}]})
    position += (target - position) * 0.05
    time.sleep(0.05)
