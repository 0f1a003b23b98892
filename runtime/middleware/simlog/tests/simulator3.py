"""A simulator over SimlogAPI, version 3, by grpcio: one port for steps, the next one for topics.

It says `port N` when it listens. Every step it publishes, and at last the marker `SIMLOG://step`:

    SIM://joint/in    a number: the target sin(t) of the cart, which can be cut
    SIM://cart/out    a number: what the cart has heard last in the step before
    SIM://zone/out    {"zone": "Z1", "level": 300 - t, "near": t > 1, "at": [t, 0, 1]}
"""

import argparse
import math
import queue
import socket
import threading
from concurrent import futures

import grpc
from google.protobuf import empty_pb2, json_format, struct_pb2, timestamp_pb2

import stubs

pb, services = stubs.load("simlog3")
sim, sim_services = stubs.load("simserver3")
TOPICS = ["SIM://joint/in", "SIM://cart/out", "SIM://zone/out", "SIMLOG://step"]


class Simulator(services.SimlogAPIServicer, sim_services.SimServerAPIServicer):
    def __init__(self, options):
        self.options = options
        self.lock = threading.Lock()
        self.streams = {}
        self.paths = {}
        self.latest = {}
        self.clock = 0
        self.steps = 0
        self.shadow = None
        self.heard = 0.0

    def publish(self, path, value):
        stamp = timestamp_pb2.Timestamp(seconds=self.clock // 1000, nanos=self.clock % 1000 * 1_000_000)
        header = pb.SimlogHeader(timestamp=stamp, path=path)
        message = pb.SimlogMessage(header=header, value=json_format.ParseDict(value, struct_pb2.Value()))
        self.latest[path] = message
        for uuid, paths in self.paths.items():
            if path in paths:
                self.streams[uuid].put(message)

    def step(self, request, context):
        with self.lock:
            self.steps += 1
            self.clock += request.deltaTime if self.steps != self.options.back_at else -5 * request.deltaTime
            t = self.clock / 1000
            self.publish("SIM://cart/out", self.heard)
            if self.shadow:
                self.publish(self.shadow + "/out", math.sin(t))
            else:
                self.heard = math.sin(t)
                self.publish("SIM://joint/in", math.sin(t))
            self.publish("SIM://zone/out", {"zone": "Z1", "level": 300 - t, "near": t > 1, "at": [t, 0, 1]})
            self.publish("SIMLOG://step", self.steps)
            alive = self.steps != self.options.end_at
            return sim.SimStatus(clock=self.clock, deltaTime=request.deltaTime, alive=alive)

    def GetTopicInfo(self, request, context):
        return pb.TopicInfo(path=request.path, exists=request.path in TOPICS)

    def Read(self, request, context):
        with self.lock:
            latest = [self.latest[path] for path in request.path if path in self.latest]
        return pb.ReadResponse(messages=latest)

    def CreateSubscriber(self, request, context):
        with self.lock:
            waiting = self.streams[request.uuid] = queue.Queue()
            self.paths.setdefault(request.uuid, set())
        while context.is_active():
            try:
                yield waiting.get(timeout=0.2)
            except queue.Empty:
                pass

    def Subscribe(self, request, context):
        with self.lock:
            self.paths[request.subscriberUUID].add(request.path)
        return empty_pb2.Empty()

    def Inject(self, request, context):
        with self.lock:
            self.shadow = f"SIMLOG://{request.shadowPathPrefix}/1"
        return pb.InjectResponse(shadowPathIn=self.shadow + "/in", shadowPathOut=self.shadow + "/out")

    def Publish(self, requests, context):
        for request in requests:
            with self.lock:
                if self.shadow and request.topic == self.shadow + "/in":
                    self.heard = request.data.value.number_value
        return empty_pb2.Empty()


def two_ports():
    """A free port after which there is another one."""
    while True:
        with socket.socket() as first, socket.socket() as second:
            first.bind(("127.0.0.1", 0))
            port = first.getsockname()[1]
            try:
                second.bind(("127.0.0.1", port + 1))
                return port
            except (OSError, OverflowError):
                pass


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--end-at", type=int, help="the step with which the simulation ends")
    parser.add_argument("--back-at", type=int, help="the step in which the clock goes back")
    simulator, port = Simulator(parser.parse_args()), two_ports()
    steps, topics = sim_services.add_SimServerAPIServicer_to_server, services.add_SimlogAPIServicer_to_server
    servers = []
    for add, at in ((steps, port), (topics, port + 1)):
        server = grpc.server(futures.ThreadPoolExecutor(16))
        add(simulator, server)
        server.add_insecure_port(f"127.0.0.1:{at}")
        server.start()
        servers.append(server)
    print(f"port {port}", flush=True)
    for server in servers:
        server.wait_for_termination()


if __name__ == "__main__":
    main()
