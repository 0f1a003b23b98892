"""The cell of `examples/iiwa_cell` as a simulator over SimlogAPI, version 2, by grpcio: the same physics and controllers.

    python simlog_cell.py --build
    python simlog_cell.py PORT

The first builds the model of the arms, once; the second loads it, which each test does anew. It runs in the folder of the example and is generated from the files of the protocol (`stubs.py`). Names on the wire:

    left/joint_states, …    JointTrajectoryPoint: positions, velocities, and the time as `time_from_start`
    left/joint_commands, …  JointTrajectoryPoint: the torques as `effort`
    left/tool, …            PointStamped
    cell/distance, workers/a/distance, left/part, …, cell/zone_grant    text: JSON

A controller is where its messages are. Those of a topic that nobody has cut reach it within the step in which they were
published; those of one that is cut when their replacement is there, before the next step moves anything. All numbers of
contents have 32 bits, as on the wire, whether or not they were on it.
"""

import argparse
import asyncio
import json
import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # matrices are small, and idle threads cost more than they bring

import grpc
import mujoco
import numpy as np
from google.protobuf import empty_pb2

import stubs
import with_mujoco
from arms import ARMS, PERIOD
from cell import WORKERS, Cell
from controller import Controller

pb, services = stubs.load("simlog2")
MODEL = "cell.mjb"


class Simulator(services.SimlogAPIServicer):
    def __init__(self):
        self.cell = Cell(with_mujoco.MuJoCo())
        self.streams: dict[str, list[grpc.aio.ServicerContext]] = {}
        self.cuts: dict[str, str] = {}  # where a topic goes on, by the name under which its replacement comes
        self.begin()

    def begin(self):
        """Sets the world to time zero."""
        self.cell.reset()
        self.controllers = {arm: Controller(arm) for arm in ARMS}
        self.requests = 0  # how often the zone was asked for; only the reply to the latest counts
        self.torques = {}
        self.arrived = []
        self.published = []

    async def setStepSize(self, request, context):
        if request.step * 1_000_000 != PERIOD:
            await context.abort(grpc.StatusCode.INVALID_ARGUMENT, f"a step of this cell has {PERIOD // 1_000_000} ms")
        self.begin()
        return empty_pb2.Empty()

    async def step(self, request, context):
        self.work()
        parts = self.cell.advance(self.torques)
        self.torques = {}
        self.send("cell/distance", text(self.cell.physics.distance()))
        for worker in WORKERS:
            self.send(f"workers/{worker}/distance", text(self.cell.distance_to_worker(worker)))
        for arm, taken in parts.items():
            self.send(f"{arm}/part", text(taken))
        ms = self.cell.now // 1_000_000
        for arm in ARMS:
            stamp = pb.Header(stamp=pb.time(sec=ms // 1000, nsec=ms % 1000 * 1_000_000), frame_id="table")
            x, y, z = self.cell.tool(arm).tolist()
            place = pb.PointStamped(header=stamp, point=pb.Point(x=x, y=y, z=z))
            self.send(f"{arm}/tool", pb.ROSMessage(type="PointStamped", point_stamped=place))
        for arm in ARMS:
            joints = pb.JointTrajectoryPoint(
                positions=self.cell.physics.position(arm),
                velocities=self.cell.physics.velocity(arm),
                time_from_start=pb.duration(msec=ms),
            )
            self.send(f"{arm}/joint_states", pb.ROSMessage(type="JointTrajectoryPoint", joint_trajectory_point=joints))
        self.work()
        # What a step has is on its way before its answer is.
        published, self.published = self.published, []
        writes = [stream.write(message) for topic, message in published for stream in self.streams.get(f"{topic}/in", [])]
        await asyncio.gather(*writes)
        return pb.StepResponse(code=0)

    def send(self, topic, message):
        """Publishes a message. The cell and its controllers hear it unless the topic is cut."""
        self.published.append((topic, message))
        if topic not in self.cuts.values():
            self.arrived.append((topic, message))

    def work(self):
        """Lets everybody answer what has arrived. Joints come last: whoever hears them knows the rest of the instant."""
        while self.arrived:
            arrived, self.arrived = self.arrived, []
            for topic, message in sorted(arrived, key=lambda one: one[0].endswith("/joint_states")):
                self.take(topic, message)
                # The answer to a request is there before the next message.
                replies = [one for one in self.arrived if one[0] == "cell/zone_grant"]
                self.arrived = [one for one in self.arrived if one[0] != "cell/zone_grant"]
                for reply in replies:
                    self.take(*reply)

    def take(self, topic, message):
        arm, _, what = topic.partition("/")
        point = message.joint_trajectory_point
        if topic == "cell/zone_grant":
            reply = json.loads(message.value)
            if reply["request"] == self.requests:
                self.controllers["right"].answer(reply["success"])
        elif topic == "cell/distance":
            for controller in self.controllers.values():
                controller.distance = json.loads(message.value)["data"]
        elif what == "joint_commands":
            if point.time_from_start.msec <= self.cell.now // 1_000_000 and np.isfinite(point.effort).all():
                self.torques[arm] = np.array(point.effort)
        elif what == "joint_states":
            controller, ms = self.controllers[arm], point.time_from_start.msec
            stamp = ms // 1000 + ms % 1000 * 1_000_000 * 1e-9
            effort = controller.command(stamp, np.array(point.positions), np.array(point.velocities))
            if controller.wants_zone():
                self.requests += 1
                reply = {"success": self.cell.is_free("right"), "request": self.requests}
                self.send("cell/zone_grant", pb.ROSMessage(value=json.dumps(reply)))
            torques = pb.JointTrajectoryPoint(effort=effort.tolist(), time_from_start=point.time_from_start)
            self.send(f"{arm}/joint_commands", pb.ROSMessage(joint_trajectory_point=torques))

    async def GetTopic(self, request, context):
        return request

    async def stream(self, path, context):
        """Lets steps write to a stream until its client is gone."""
        await context.send_initial_metadata(())
        self.streams.setdefault(path, []).append(context)
        try:
            await asyncio.Event().wait()
        finally:
            self.streams[path].remove(context)

    async def Subscribe(self, request, context):
        await self.stream(request.path, context)

    async def Inject(self, request, context):
        self.cuts[request.injected.path] = request.target.path.removesuffix("/in")
        try:
            await self.stream(request.target.path, context)
        finally:
            self.cuts.pop(request.injected.path, None)

    async def Publish(self, requests, context):
        async for request in requests:
            if request.topic.path in self.cuts:
                self.arrived.append((self.cuts[request.topic.path], request.data))
        return empty_pb2.Empty()


def text(value):
    """A number as messages of ROS carry it."""
    return pb.ROSMessage(type="STRING", value=json.dumps({"data": float(value)}))


async def serve(port):
    server = grpc.aio.server()
    services.add_SimlogAPIServicer_to_server(Simulator(), server)
    server.add_insecure_port(f"127.0.0.1:{port}")
    await server.start()
    await server.wait_for_termination()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("port", type=int, nargs="?")
    parser.add_argument("--build", action="store_true", help="build the model, and end")
    options = parser.parse_args()
    if options.build:
        mujoco.mj_saveModel(with_mujoco.build(), MODEL, None)
        return
    with_mujoco.build = lambda: mujoco.MjModel.from_binary_path(MODEL)
    asyncio.run(serve(options.port))


if __name__ == "__main__":
    main()
