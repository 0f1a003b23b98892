"""Drives the gearbox cell over SimlogAPI by grpcio, and prints what it heard as JSON.

    drive.py PORT STEPS [--disturb RADIANS]

Without a disturbance it only listens; else it cuts the target of the product arm's first axis and adds so much to it.
"""

import argparse
import json
import pathlib
import queue
import sys
import threading
import time

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[4] / "runtime" / "middleware" / "simlog" / "tests"))
import stubs  # noqa: E402 - it lies beside the protocol

pb, services = stubs.load("simlog2")
TARGET = "joints/R3200ProductMove/Link0/R/position"
HEARD = ["safetyzones/Z1", "safetyzones/ZR270073", "cell/gripper_speed/in", "joints/R270073/Link0/R/position/in"]


class Heard:
    """A stream, read by a thread of its own."""

    def __init__(self, name, call):
        self.name, self.queue, self.messages = name, queue.Queue(), []
        threading.Thread(target=self.read, args=(call,), daemon=True).start()

    def read(self, call):
        try:
            for message in call:
                self.queue.put(message)
        except grpc.RpcError:
            pass  # the channel was closed

    def take(self):
        message = self.queue.get(timeout=120)
        self.messages.append(message)
        return message


def number(message):
    """The number that a message is about."""
    return message.safety_zone.level if message.HasField("safety_zone") else float(message.value)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("port", type=int)
    parser.add_argument("steps", type=int)
    parser.add_argument("--disturb", type=float)
    options = parser.parse_args()
    with grpc.insecure_channel(f"127.0.0.1:{options.port}") as channel:
        stub = services.SimlogAPIStub(channel)
        stub.setStepSize(pb.StepSizeRequest(step=20))
        calls = {name: stub.Subscribe(pb.TopicDescriptor(path=name)) for name in HEARD}
        target = pb.TopicDescriptor(path=TARGET + "/in")
        shadow = pb.TopicDescriptor(path=TARGET + "/shadow", msgType="STRING")
        if options.disturb is None:
            calls[TARGET] = stub.Subscribe(target)
        else:
            calls[TARGET] = stub.Inject(pb.InjectRequest(injected=shadow, target=target))
        for call in calls.values():
            call.initial_metadata()  # the stream is there
        streams = {name: Heard(name, call) for name, call in calls.items()}
        began = time.monotonic()
        for _ in range(options.steps):
            code = stub.step(pb.StepRequest()).code
            assert code == 0, code
            for stream in streams.values():
                message = stream.take()
                if stream.name == TARGET and options.disturb is not None:
                    disturbed = pb.ROSMessage(type="STRING", value=repr(float(message.value) + options.disturb))
                    stub.Publish(iter([pb.PubRequest(topic=shadow, data=disturbed)]))
        print(f"{options.steps / (time.monotonic() - began):.0f} steps per second", file=sys.stderr)
        stamp = streams[TARGET].messages[-1].timeStamp.stamp
        heard = {name: [number(message) for message in stream.messages] for name, stream in streams.items()}
        print(json.dumps({"heard": heard, "now": stamp.sec + stamp.nsec * 1e-9}))


if __name__ == "__main__":
    main()
