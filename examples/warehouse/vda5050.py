"""The warehouse over MQTT: `vda5050.py floor PORT`, `vda5050.py vehicles PORT` and `vda5050.py control PORT`.

The floor moves the robots as their drives say, and locates them: on `rtls/ROBOT/position` it publishes where each is,
as a real-time locating system does. The vehicles and their control speak VDA 5050, version 2.0. An order leads from one
station to the other, over a node at which a vehicle stops before each crossing. The control releases nodes as far as
the way is clear, and a vehicle drives to the last one that is released.

With `--undisturbed NAME`, messages of this name are published on `TOPIC/undisturbed`, from where a runner takes them.
"""

import argparse
import json
import queue
import time
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any

import paho.mqtt.client as mqtt
from warehouse import (
    ARRIVED,
    PERIOD,
    ROBOTS,
    SECOND,
    START_AFTER,
    Floor,
    Manager,
    Navigator,
    Place,
    Stage,
    distance,
    way,
)

MANUFACTURER = "warehouse"
STATE_AFTER = SECOND  # after which a vehicle publishes its state if nothing is new


def stamp() -> str:
    """The time, as in VDA 5050."""
    return datetime.now(timezone.utc).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def nanoseconds(text: str) -> int:
    """The time of a message."""
    return round(datetime.fromisoformat(text).timestamp() * 1e3) * (SECOND // 1000)


class Client:
    """A connection to the broker. What arrives is kept until it is asked for."""

    def __init__(self, options: argparse.Namespace, subscribed: list[str]) -> None:
        self.undisturbed = options.undisturbed
        self.arrived: queue.SimpleQueue = queue.SimpleQueue()
        self.numbers: dict[str, int] = {}
        self.client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv311)
        self.client.on_message = lambda _, __, message: self.arrived.put((message.topic, message.payload))
        ready: queue.SimpleQueue = queue.SimpleQueue()
        self.client.on_connect = lambda client, *_: client.subscribe([(topic, 1) for topic in subscribed])
        self.client.on_subscribe = lambda *_: ready.put(True)
        self.client.connect("127.0.0.1", options.port)
        self.client.loop_start()
        ready.get(timeout=30)
        print("ready", flush=True)

    def publish(self, topic: str, message: dict[str, Any], retain: bool = False) -> None:
        """Publishes a message."""
        if topic.rsplit("/", 1)[1] in self.undisturbed:
            topic += "/undisturbed"
        self.client.publish(topic, json.dumps(message), qos=1, retain=retain)

    def vda(self, robot: str, name: str, content: dict[str, Any], retain: bool = False) -> None:
        """Publishes a message of VDA 5050, with its header."""
        topic = f"uagv/v2/{MANUFACTURER}/{robot}/{name}"
        number = self.numbers.get(topic, 0)
        self.numbers[topic] = number + 1
        header = {
            "headerId": number, "timestamp": stamp(), "version": "2.0.0", "manufacturer": MANUFACTURER,
            "serialNumber": robot,
        }
        self.publish(topic, {**header, **content}, retain)

    def messages(self):
        """What has arrived: the robot and the name of each message, and its content."""
        while not self.arrived.empty():
            topic, payload = self.arrived.get()
            robot, name = topic.split("/")[-2:]
            yield robot, name, json.loads(payload)


def every_period(work) -> None:
    """Works once in each period of wall time. After a delay it makes up for the periods that were left out."""
    due = time.monotonic()
    while True:
        work()
        due += PERIOD / SECOND
        time.sleep(max(0.0, due - time.monotonic()))


def run_floor(options: argparse.Namespace) -> None:
    """Moves the robots, and locates them."""
    client = Client(options, ["drives/+/velocity"])
    floor = Floor()

    def work() -> None:
        for robot, _, velocity in client.messages():
            floor.wanted[robot] = (velocity["x"], velocity["y"])
        floor.advance()
        for robot, (x, y) in floor.places.items():
            position = {"type": "Point", "coordinates": [x, y, 0.0]}
            client.publish(f"rtls/{robot}/position", {"timestamp": stamp(), "position": position})

    every_period(work)


class Vehicle:
    """A vehicle that speaks VDA 5050."""

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.navigator = Navigator()
        self.order: dict[str, Any] = {"orderId": "", "orderUpdateId": 0, "nodes": []}
        self.nodes: list[dict[str, Any]] = []  # that are still to be reached
        self.last: dict[str, Any] = {"nodeId": "", "sequenceId": 0, "released": False}
        self.velocity: Place = (0.0, 0.0)
        self.said: dict[str, Any] = {}
        self.said_at = 0

    def take(self, order: dict[str, Any], now: int) -> None:
        """Takes an order, or an update of the one that it has, which begins with the last node that was released."""
        nodes = order["nodes"]
        if order["orderId"] != self.order["orderId"]:
            if order["orderUpdateId"] != 0:
                return  # of an order that never came
            self.last, self.nodes = nodes[0], []
            self.navigator.starts = now + START_AFTER
        elif order["orderUpdateId"] <= self.order["orderUpdateId"]:
            return
        self.order = order
        before = [node for node in self.nodes if node["sequenceId"] < nodes[0]["sequenceId"]]
        self.nodes = before + [node for node in nodes if node["sequenceId"] > self.last["sequenceId"]]
        self.aim()

    def cancel(self) -> None:
        """Gives up its order."""
        self.nodes = []
        self.aim()

    def aim(self) -> None:
        """Drives to the last node that is released."""
        released = [node for node in [self.last, *self.nodes] if node["released"]]
        self.navigator.goal = place(self.nodes[-1]) if self.nodes else None
        self.navigator.clear_to = place(released[-1]) if released else None

    def drive(self, now: int) -> Place:
        """The velocity that it wants, after it has noted which nodes it has reached or passed."""
        while self.nodes and self.nodes[0]["released"] and self.has_passed(self.nodes[0]):
            self.last = self.nodes.pop(0)
            self.aim()
        self.velocity = self.navigator.steer(now)
        return self.velocity

    def has_passed(self, node: dict[str, Any]) -> bool:
        """Whether it believes that it has reached a node or passed it."""
        here, goal = self.navigator.place, self.navigator.goal
        if here is None or goal is None:
            return False
        return distance(here, goal) <= distance(place(node), goal) + ARRIVED

    def state(self) -> dict[str, Any]:
        """Its state, in terms of VDA 5050."""
        return {
            "orderId": self.order["orderId"],
            "orderUpdateId": self.order["orderUpdateId"],
            "lastNodeId": self.last["nodeId"],
            "lastNodeSequenceId": self.last["sequenceId"],
            "driving": self.velocity != (0.0, 0.0),
            "nodeStates": [
                {"nodeId": node["nodeId"], "sequenceId": node["sequenceId"], "released": node["released"]}
                for node in self.nodes
            ],
            "edgeStates": [],
            "actionStates": [],
            "batteryState": {"batteryCharge": 80.0, "charging": False},
            "operatingMode": "AUTOMATIC",
            "errors": [],
            "safetyState": {"eStop": "NONE", "fieldViolation": False},
        }

    def news(self, now: int) -> dict[str, Any] | None:
        """Its state, if that is new or was not said for a while."""
        state = self.state()
        if state == self.said and now - self.said_at < STATE_AFTER:
            return None
        self.said, self.said_at = state, now
        return state if self.navigator.place is None else {**state, "agvPosition": self.position()}

    def position(self) -> dict[str, Any]:
        """Where it believes that it is."""
        x, y = self.navigator.place
        return {"x": x, "y": y, "theta": 0.0, "mapId": "hall", "positionInitialized": True}


def place(node: dict[str, Any]) -> Place:
    """Where a node of an order is."""
    return node["nodePosition"]["x"], node["nodePosition"]["y"]


def run_vehicles(options: argparse.Namespace) -> None:
    """Runs all vehicles."""
    own = f"uagv/v2/{MANUFACTURER}/+"
    client = Client(options, ["rtls/+/position", f"{own}/order", f"{own}/instantActions"])
    vehicles = {robot: Vehicle(robot) for robot in ROBOTS}
    for robot in ROBOTS:
        client.vda(robot, "connection", {"connectionState": "ONLINE"}, retain=True)

    def work() -> None:
        now = time.time_ns()
        for robot, name, message in client.messages():
            vehicle = vehicles[robot]
            if name == "order":
                vehicle.take(message, now)
            elif name == "instantActions":
                if any(action["actionType"] == "cancelOrder" for action in message["actions"]):
                    vehicle.cancel()
            else:
                x, y, _ = message["position"]["coordinates"]
                vehicle.navigator.place = (x, y)
                vehicle.navigator.located = nanoseconds(message["timestamp"])
        for robot, vehicle in vehicles.items():
            x, y = vehicle.drive(now)
            client.publish(f"drives/{robot}/velocity", {"x": x, "y": y})
            if vehicle.navigator.place is not None:
                client.vda(robot, "visualization", {"agvPosition": vehicle.position()})
            state = vehicle.news(now)
            if state is not None:
                client.vda(robot, "state", state)

    every_period(work)


@dataclass
class Order:
    """An order of the control, as far as its vehicle knows it."""

    number: int = 0
    update: int = 0
    nodes: list[Place] = field(default_factory=list)
    released: int = 0  # how many nodes
    known: bool = False  # whether the vehicle has named it

    @property
    def name(self) -> str:
        """Its `orderId`."""
        return f"order-{self.number}"

    def message(self, first: int) -> dict[str, Any]:
        """The order from one of its nodes on."""
        nodes = [
            {
                "nodeId": f"{x:g}/{y:g}", "sequenceId": 2 * at, "released": at < self.released, "actions": [],
                "nodePosition": {"x": x, "y": y, "mapId": "hall"},
            }
            for at, (x, y) in enumerate(self.nodes)
        ]
        edges = [
            {
                "edgeId": f"{start['nodeId']}-{end['nodeId']}", "sequenceId": end["sequenceId"] - 1, "actions": [],
                "released": end["released"], "startNodeId": start["nodeId"], "endNodeId": end["nodeId"],
            }
            for start, end in zip(nodes, nodes[1:])
        ]
        return {"orderId": self.name, "orderUpdateId": self.update, "nodes": nodes[first:], "edges": edges[first:]}


def run_control(options: argparse.Namespace) -> None:
    """Runs the master control. Its time begins when it has heard of every vehicle where that is."""
    own = f"uagv/v2/{MANUFACTURER}/+"
    client = Client(options, [f"{own}/state", f"{own}/visualization"])
    manager = Manager()
    orders = {robot: Order() for robot in ROBOTS}
    begun: int | None = None

    def hear(robot: str, state: dict[str, Any], now: int) -> None:
        order = orders[robot]
        if state["orderId"] != order.name:
            return
        if not order.known:
            order.known = True
            manager.accepted(robot, now)
        manager.heard(robot, now)
        if not state["nodeStates"] and state["lastNodeSequenceId"] == 2 * (len(order.nodes) - 1):
            if manager.trips[robot].stage is Stage.DRIVES:
                client.publish(f"control/{robot}/finished", {"orderId": order.name, "seconds": now / SECOND})
            manager.reached(robot)

    def work() -> None:
        nonlocal begun
        now = 0 if begun is None else time.time_ns() - begun
        for robot, name, message in client.messages():
            if name == "state":
                hear(robot, message, now)
            else:
                manager.locate(robot, (message["agvPosition"]["x"], message["agvPosition"]["y"]))
        if begun is None:
            if all(trip.place is not None for trip in manager.trips.values()):
                begun = time.time_ns()
            return
        wanted = manager.decide(now)
        for robot in wanted.cancelled:
            action = {"actionType": "cancelOrder", "actionId": orders[robot].name, "blockingType": "HARD"}
            client.vda(robot, "instantActions", {"actions": [action]})
        for robot, order in orders.items():
            goal, clear_to = wanted.goals.get(robot), wanted.clear_to[robot]
            if goal is not None:
                orders[robot] = order = Order(order.number + 1, nodes=way(robot, goal))
            released = 1 + max((at for at, node in enumerate(order.nodes) if node == clear_to), default=0)
            if goal is not None:
                order.released = released
                client.vda(robot, "order", order.message(0))
            elif released > order.released and order.nodes:
                first, order.released = order.released - 1, released
                order.update += 1
                client.vda(robot, "order", order.message(first))

    every_period(work)


def main() -> None:
    """Runs a part until it is interrupted."""
    parts = {"floor": run_floor, "vehicles": run_vehicles, "control": run_control}
    parser = argparse.ArgumentParser(description="A part of the warehouse over MQTT.")
    parser.add_argument("part", choices=parts)
    parser.add_argument("port", type=int, help="of the broker on this machine")
    parser.add_argument("--undisturbed", action="append", default=[], metavar="NAME", help="topics that are cut")
    options = parser.parse_args()
    try:
        parts[options.part](options)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
