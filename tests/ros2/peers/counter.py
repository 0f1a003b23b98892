"""Actions by rclpy: `counter` serves `count`, which counts up to a number, and `manager` calls that of each robot."""

import sys
import threading
import time

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Float64, String
from test_msgs.action import Fibonacci

PERIOD = 0.1
ORDER = 4
ANSWER_WITHIN = 1.5
RESULT_WITHIN = 4.0


def counter(node: Node) -> ActionServer:
    """Counts up to the order of each goal, and says each number in its feedback; a goal may be cancelled."""

    def count(goal) -> Fibonacci.Result:
        counted = []
        for number in range(1, goal.request.order + 1):
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=counted)
            counted.append(number)
            goal.publish_feedback(Fibonacci.Feedback(sequence=counted))
            time.sleep(PERIOD)
        goal.succeed()
        return Fibonacci.Result(sequence=counted)

    return ActionServer(
        node,
        Fibonacci,
        "count",
        count,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
    )


def answered(future: Future, within: float) -> bool:
    """Whether a future is done within so many seconds."""
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    return done.wait(within)


class Caller:
    """Sends goals to a robot, one after another, and says what becomes of each; it cancels each if it is told to."""

    def __init__(self, node: Node, robot: str, cancels: bool) -> None:
        self.said = node.create_publisher(String, f"/{robot}/said", 50)
        self.took = node.create_publisher(Float64, f"/{robot}/took", 50)
        self.counted = node.create_publisher(Float64, f"/{robot}/counted", 50)
        self.client = ActionClient(node, Fibonacci, f"/{robot}/count")
        self.cancels = cancels

    def say(self, word: str) -> None:
        self.said.publish(String(data=word))

    def call(self) -> None:
        """Sends a goal, and waits for its end."""
        begun = time.monotonic()
        sent = self.client.send_goal_async(Fibonacci.Goal(order=ORDER), lambda _: self.say("feedback"))
        if not answered(sent, ANSWER_WITHIN):
            self.say("no answer")
            return
        goal = sent.result()
        self.say("accepted" if goal.accepted else "refused")
        if not goal.accepted:
            time.sleep(PERIOD)
            return
        if self.cancels:
            time.sleep(PERIOD)
            goal.cancel_goal_async()
        ended = goal.get_result_async()
        if not answered(ended, RESULT_WITHIN):
            self.say("no result")
            return
        ends = {GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_CANCELED: "cancelled"}
        self.say(ends.get(ended.result().status, "aborted"))
        self.took.publish(Float64(data=time.monotonic() - begun))
        self.counted.publish(Float64(data=float(len(ended.result().result.sequence))))

    def run(self) -> None:
        self.client.wait_for_server()
        while rclpy.ok():
            self.call()


def main() -> None:
    """Arguments are the role, the robots of a manager, those that it cancels with a `-`, and those of ROS."""
    rclpy.init(args=sys.argv)
    own = rclpy.utilities.remove_ros_args(sys.argv)[1:]
    node = rclpy.create_node(own[0])
    if own[0] == "counter":
        server = counter(node)
    else:
        for robot in own[1:]:
            caller = Caller(node, robot.removesuffix("-"), robot.endswith("-"))
            threading.Thread(target=caller.run, daemon=True).start()
    print("up", flush=True)
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
