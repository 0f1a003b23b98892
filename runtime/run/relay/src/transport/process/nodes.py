import json, sys

def answer(what):
    print(json.dumps(what), flush=True)
    return json.loads(sys.stdin.readline() or "null")

order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        position, ticks, share, owed, step = 0.0, 0, 1.0, 0.0, order["reset"]["step"]
        topics = {"publishes": ["cart/target", "cart/position"], "subscribes": ["cart/target"]}
        nodes = {"controller": ["pause", "slow", "kill"]}
        order = answer({"ready": {**topics, "nodes": nodes, "resets": True}})
    else:
        for given in order["step"].get("orders", []):                      # each is for the controller
            if given["order"] == "restart":
                ticks = 0                                                  # it has lost its state
            share = given.get("share", {"pause": 0.0, "kill": 0.0}.get(given["order"], 1.0))
        messages, owed = order["step"]["messages"], owed + share
        if owed >= 1.0:                                                    # the controller has time for a step
            owed, ticks = owed - 1.0, ticks + 1
            messages += answer({"publish": [{"topic": "cart/target", "value": 0.1 * ticks}]})["deliver"]
        for message in messages:                                           # the cart
            position = message["value"]
        order = answer({"done": {"messages": [{"topic": "cart/position", "value": position}]}})
