"""A simulator over SimlogAPI, version 2, by grpcio: a topic for each kind of message, and a cart that is driven.

It says `port N` when it listens. Every step it publishes, all stamped with the end of the step t:

    joint/in              text: the target sin(t) of the cart, which can be cut
    cart/in               text: what the cart has heard last in the step before
    point/in, stamped/in, turn/in, trajectory/in, trajectory_point/in, clock/in, safetyzones/Z1, command/in
    state/in              text: JSON
    seldom/in             text: the number of the step, every tenth step
    ordered/in            text: what came last in place of messages on order/in, which nobody publishes
"""

import argparse
import json
import math
import os
import queue
import threading
from concurrent import futures

import grpc
from google.protobuf import empty_pb2

import stubs

pb, services = stubs.load("simlog2")


class Simulator(services.SimlogAPIServicer):
    def __init__(self, options):
        self.options = options
        self.lock = threading.Lock()
        self.subscribers = {}
        self.cuts = {}
        self.step_ms = 0
        self.begin()

    def begin(self):
        self.steps = 0
        self.heard = "none"
        self.ordered = "-1"
        self.next = None

    def setStepSize(self, request, context):
        with self.lock:
            self.step_ms = request.step
            if not self.options.goes_on:
                self.begin()
        return empty_pb2.Empty()

    def header(self):
        ms = self.steps * self.step_ms
        return pb.Header(seq=self.steps, stamp=pb.time(sec=ms // 1000, nsec=ms % 1000 * 1_000_000), frame_id="world")

    def publish(self, path, message):
        for waiting in self.subscribers.get(path, []):
            waiting.put(message)

    def text(self, path, value):
        self.publish(path, pb.ROSMessage(type="STRING", value=value, timeStamp=self.header()))

    def step(self, request, context):
        with self.lock:
            self.steps += 1
            if self.steps == self.options.die_at:
                os._exit(3)
            t = self.steps * self.step_ms / 1000
            header = self.header()
            self.text("cart/in", self.heard)
            self.text("ordered/in", self.ordered)
            target = repr(math.sin(t))
            if "joint/in" not in self.cuts:
                self.heard = target
            self.text("joint/in", target)
            at = pb.Point(x=t, y=math.cos(t), z=-1)
            if self.options.malformed:
                self.publish("point/in", pb.ROSMessage(type="Point", value="{not json"))
            else:
                self.publish("point/in", pb.ROSMessage(type="Point", point=at))
            stamped = pb.PointStamped(header=header, point=at)
            self.publish("stamped/in", pb.ROSMessage(type="PointStamped", point_stamped=stamped))
            self.publish("turn/in", pb.ROSMessage(quaternion=pb.Quaternion(x=0, y=0, z=math.sin(t), w=math.cos(t))))
            reached = pb.JointTrajectoryPoint(
                positions=[t, 2 * t], velocities=[1, 2], time_from_start=pb.duration(msec=int(1000 * t))
            )
            self.publish("trajectory_point/in", pb.ROSMessage(joint_trajectory_point=reached))
            whole = pb.JointTrajectory(header=header, joint_names=["j1", "j2"], points=[reached, reached])
            self.publish("trajectory/in", pb.ROSMessage(joint_trajectory=whole))
            self.publish("clock/in", pb.ROSMessage(timeStamp=header))
            zone = pb.SafetyZone(header=header, zone="Z1", level=300 - t, object1="gripper", object2="worker")
            self.publish("safetyzones/Z1", pb.ROSMessage(safety_zone=zone))
            command = pb.SafetyZoneCmd(zone="Z1", cmd="stop" if t > 1 else "go")
            self.publish("command/in", pb.ROSMessage(safety_zone_cmd=command))
            self.text("state/in", json.dumps({"t": t, "tags": ["a", str(self.steps)], "more": {"x": None}}))
            if self.steps % 10 == 0:
                self.text("seldom/in", str(self.steps))
            return pb.StepResponse(code=-1 if self.steps == self.options.end_at else 0)

    def GetTopic(self, request, context):
        return request

    def stream(self, path, context, done=lambda: None):
        waiting = queue.Queue()
        with self.lock:
            self.subscribers.setdefault(path, []).append(waiting)
        if self.options.eager:
            context.send_initial_metadata(())
        try:
            while context.is_active():
                try:
                    yield waiting.get(timeout=0.2)
                except queue.Empty:
                    pass
        finally:
            with self.lock:
                self.subscribers[path].remove(waiting)
                done()

    def Subscribe(self, request, context):
        yield from self.stream(request.path, context)

    def Inject(self, request, context):
        with self.lock:
            self.cuts[request.target.path] = request.injected.path
        yield from self.stream(request.target.path, context, lambda: self.cuts.pop(request.target.path, None))

    def Publish(self, requests, context):
        for request in requests:
            with self.lock:
                if request.topic.path == self.cuts.get("joint/in"):
                    self.heard = request.data.value
                if request.topic.path == self.cuts.get("order/in"):
                    self.ordered = request.data.value
        return empty_pb2.Empty()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", default="0")
    parser.add_argument("--eager", action="store_true", help="acknowledge streams at once, not with their first message")
    parser.add_argument("--goes-on", action="store_true", help="time goes on from one client to the next")
    parser.add_argument("--malformed", action="store_true", help="publish on point/in what is not a point")
    parser.add_argument("--end-at", type=int, help="the step with which the simulation ends")
    parser.add_argument("--die-at", type=int, help="the step in which the process ends")
    parser.add_argument("--tls", nargs=2, metavar=("KEY", "CERTIFICATE"))
    options = parser.parse_args()
    server = grpc.server(futures.ThreadPoolExecutor(64))
    services.add_SimlogAPIServicer_to_server(Simulator(options), server)
    address = f"127.0.0.1:{options.port}"
    if options.tls:
        key, certificate = (open(file, "rb").read() for file in options.tls)
        port = server.add_secure_port(address, grpc.ssl_server_credentials([(key, certificate)]))
    else:
        port = server.add_insecure_port(address)
    server.start()
    print(f"port {port}", flush=True)
    server.wait_for_termination()


if __name__ == "__main__":
    main()
