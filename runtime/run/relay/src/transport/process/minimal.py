import json, sys

def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")

order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        position, target, step = 0.0, 0.0, order["reset"]["step"]
        topics = {"publishes": ["cart/target", "cart/position"], "subscribes": ["cart/target"]}
        order = answer({"ready": {**topics, "resets": True}})
    else:
        wanted = 1.0 if order["step"]["time"] < 2.0 else 0.0               # the controller
        messages = order["step"]["messages"]                               # what is late
        messages += answer({"publish": [{"topic": "cart/target", "value": wanted}]})["deliver"]
        for message in messages:                                           # the cart
            target = message["value"]
        position += (target - position) * step
        order = answer({"done": {"messages": [{"topic": "cart/position", "value": position}]}})
