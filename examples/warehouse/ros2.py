"""The warehouse in ROS 2: `ros2.py floor`, `ros2.py navigator` in the namespace of each robot, and `ros2.py manager`.

The floor moves the robots as their velocity commands say, and publishes where each is: what is true, and, on the
robot's own `tf`, what its localisation says. A navigator serves `navigate_to_pose`, as that of Nav2 does, and drives no
further than its way is clear. The manager sends goals, and says up to where each way is clear.

The service `/warehouse/step` advances by one period, with what was received so far, and answers after all messages of
that period are published, the tick last. For each tick a navigator sends exactly one velocity, and the manager exactly
one place to each robot; what else they have to say they send before that. `/warehouse/reset` sets everything to time
zero and answers when every node has given up what it did.
"""

import argparse
import pathlib
import sys
from collections.abc import Callable

import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PointStamped, PoseStamped, TransformStamped, Twist
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header, String
from std_srvs.srv import Trigger
from warehouse import ROBOTS, SECOND, START_AFTER, Floor, Manager, Navigator, is_on_lane

# What `interfaces.py` has compiled.
sys.path.insert(0, str(pathlib.Path(__file__).parent / "built"))
from nav2_msgs.action import NavigateToPose  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

DEEP = QoSProfile(depth=200)  # a relay may release many delayed messages at once
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # reaches those who are found later, too
LATCHED_BY_ALL = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # from several nodes
PASSES = 3  # of an executor until the end of a goal is sent: each runs what the one before has started
RESULTS_FOR = 10  # seconds for which a server keeps the goals that have ended


def nanoseconds(header: Header) -> int:
    """The time stamp of a message."""
    return header.stamp.sec * SECOND + header.stamp.nanosec


def header(now: int) -> Header:
    """The header of a message about the map."""
    stamped = Header(frame_id="map")
    stamped.stamp.sec, stamped.stamp.nanosec = divmod(now, SECOND)
    return stamped


class Ticked(Node):
    """A node that works once for each tick, and once for each begin.

    Callbacks only keep what arrives; `work` acts when nothing more has arrived, so it does not matter which of the
    messages of an instant the executor hands over first. What it returns is published when everything else that it
    started, such as the end of a goal, was sent.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name, enable_rosout=False)
        self.due: list[Header | String] = []
        self.last: list[tuple] = []
        self.passes = 0
        self.create_subscription(Header, "/warehouse/tick", self.due.append, DEEP)
        self.create_subscription(String, "/warehouse/begin", self.due.append, LATCHED)
        self.begun = self.create_publisher(String, "/warehouse/begun", LATCHED)

    def is_busy(self) -> bool:
        """Whether there is something to do when nothing more arrives."""
        return bool(self.due or self.last)

    def turn(self) -> None:
        """Publishes what is last, or works for the next tick or begin."""
        self.passes += 1
        if self.last:
            if self.passes == PASSES:
                for publisher, message in self.last:
                    publisher.publish(message)
                self.last = []
            return
        self.passes = 0
        due = self.due.pop(0)
        if isinstance(due, String):
            self.begin()
            self.last = [(self.begun, String(data=f"{due.data} {self.get_fully_qualified_name()}"))]
        else:
            self.last = self.work(nanoseconds(due))


class FloorNode(Node):
    """The floor as a node."""

    def __init__(self) -> None:
        super().__init__("floor", enable_rosout=False)
        self.floor = Floor()
        self.clock = self.create_publisher(Clock, "/clock", 10)
        self.tf = {robot: self.create_publisher(TFMessage, f"/{robot}/tf", DEEP) for robot in ROBOTS}
        self.truth = {robot: self.create_publisher(PointStamped, f"/{robot}/ground_truth", DEEP) for robot in ROBOTS}
        self.tick = self.create_publisher(Header, "/warehouse/tick", DEEP)
        self.begin = self.create_publisher(String, "/warehouse/begin", LATCHED)
        self.velocities = {
            robot: self.create_subscription(
                Twist, f"/{robot}/cmd_vel", lambda message, robot=robot: self.take(robot, message), DEEP
            )
            for robot in ROBOTS
        }
        self.number = 0  # of resets
        self.begun: set[str] = set()
        self.all_begun = Future()
        self.create_subscription(String, "/warehouse/begun", self.note, LATCHED_BY_ALL)
        self.create_service(Trigger, "/warehouse/step", self.step)
        # While it waits for the others, what they say is heard.
        self.create_service(Trigger, "/warehouse/reset", self.reset, callback_group=ReentrantCallbackGroup())

    def is_busy(self) -> bool:
        """Whether there is something to do when nothing more arrives."""
        return False

    def take(self, robot: str, message: Twist) -> None:
        """Keeps a velocity; a robot without a new one keeps its last one."""
        self.floor.wanted[robot] = (message.linear.x, message.linear.y)

    def drain(self) -> None:
        """Takes all velocities that have arrived: an executor takes only one message per turn."""
        for robot, subscription in self.velocities.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(Twist, False)) is not None:
                    self.take(robot, taken[0])

    def note(self, message: String) -> None:
        """Notes that a node has begun anew."""
        number, name = message.data.split()
        if number == str(self.number):
            self.begun.add(name)
        if len(self.begun) == len(ROBOTS) + 1 and not self.all_begun.done():
            self.all_begun.set_result(True)

    async def reset(self, _, response: Trigger.Response) -> Trigger.Response:
        """Sets everything to time zero. Velocities that are still on their way are those of the past."""
        self.number += 1
        self.begun, self.all_begun = set(), Future()
        self.begin.publish(String(data=str(self.number)))
        await self.all_begun
        self.drain()
        self.floor.reset()
        response.success = True
        return response

    def step(self, _, response: Trigger.Response) -> Trigger.Response:
        """Advances by one period and publishes what is new."""
        self.drain()
        self.floor.advance()
        stamped = header(self.floor.now)
        self.clock.publish(Clock(clock=stamped.stamp))
        for robot, (x, y) in self.floor.places.items():
            place = PointStamped(header=stamped)
            place.point.x, place.point.y = x, y
            self.truth[robot].publish(place)
            transform = TransformStamped(header=stamped, child_frame_id="base_link")
            transform.transform.translation.x, transform.transform.translation.y = x, y
            self.tf[robot].publish(TFMessage(transforms=[transform]))
        self.tick.publish(stamped)
        response.success = True
        return response


class TickedServer(ActionServer):
    """An action server whose goals end at a tick: a coroutine that waited for it would keep the executor busy."""

    def notify_execute(self, goal_handle: ServerGoalHandle, execute_callback) -> None:
        """Leaves an accepted goal as it is."""

    def end(self, goal_handle: ServerGoalHandle, how) -> None:
        """Ends a goal; `how` is `succeed`, `abort` or `canceled` of the handle."""

        def ended(_) -> NavigateToPose.Result:
            how()
            return NavigateToPose.Result()

        super().notify_execute(goal_handle, ended)


class NavigatorNode(Ticked):
    """The navigator of the robot that its namespace names."""

    def __init__(self) -> None:
        super().__init__("navigator")
        self.robot = self.get_namespace().strip("/")
        self.navigator = Navigator()
        self.goal: ServerGoalHandle | None = None
        self.accepted = 0
        self.velocity = self.create_publisher(Twist, "cmd_vel", DEEP)
        self.create_subscription(TFMessage, "tf", self.locate, DEEP)
        self.create_subscription(PointStamped, "clear_to", self.clear, DEEP)
        self.server = TickedServer(
            self,
            NavigateToPose,
            "navigate_to_pose",
            lambda _: NavigateToPose.Result(),
            goal_callback=self.asked,
            handle_accepted_callback=self.start,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            result_timeout=RESULTS_FOR,
        )

    def locate(self, message: TFMessage) -> None:
        """Hears where it is."""
        for transform in message.transforms:
            if transform.child_frame_id == "base_link":
                place = transform.transform.translation
                self.navigator.place, self.navigator.located = (place.x, place.y), nanoseconds(transform.header)

    def clear(self, message: PointStamped) -> None:
        """Hears up to where its way is clear."""
        self.navigator.clear_to = (message.point.x, message.point.y)

    def asked(self, goal: NavigateToPose.Goal) -> GoalResponse:
        """Takes goals on its lane."""
        place = goal.pose.pose.position
        return GoalResponse.ACCEPT if is_on_lane(self.robot, (place.x, place.y)) else GoalResponse.REJECT

    def start(self, handle: ServerGoalHandle) -> None:
        """Has a new goal, and gives up the one before."""
        self.give_up()
        self.goal = handle
        goal = handle.request.pose
        self.navigator.goal = (goal.pose.position.x, goal.pose.position.y)
        self.accepted = nanoseconds(goal.header)
        self.navigator.starts = self.accepted + START_AFTER
        handle.execute()

    def give_up(self) -> None:
        """Aborts its goal."""
        if self.goal is not None:
            self.end(self.goal.abort)

    def end(self, how) -> None:
        """Ends its goal."""
        self.server.end(self.goal, how)
        self.goal, self.navigator.goal = None, None

    def begin(self) -> None:
        """Forgets everything."""
        self.give_up()
        self.navigator = Navigator()

    def work(self, now: int) -> list[tuple]:
        """Steers by what it has heard."""
        velocity = Twist()
        velocity.linear.x, velocity.linear.y = self.navigator.steer(now)
        if self.goal is not None and self.goal.is_cancel_requested:
            self.end(self.goal.canceled)
        elif self.goal is not None and self.navigator.has_arrived() and now >= self.navigator.starts:
            self.end(self.goal.succeed)
        elif self.goal is not None and self.navigator.place is not None:
            feedback = NavigateToPose.Feedback(distance_remaining=self.navigator.left())
            feedback.current_pose.header = header(self.navigator.located)
            position = feedback.current_pose.pose.position
            position.x, position.y = self.navigator.place
            spent = feedback.navigation_time
            spent.sec, spent.nanosec = divmod(max(0, now - self.accepted), SECOND)
            self.goal.publish_feedback(feedback)
        return [(self.velocity, velocity)]


class ManagerNode(Ticked):
    """The manager as a node: a client of the actions of all robots."""

    def __init__(self) -> None:
        super().__init__("manager")
        self.manager = Manager()
        self.sent = dict.fromkeys(ROBOTS, 0)  # how many goals; what is said of earlier ones is of no interest
        self.goals = dict.fromkeys(ROBOTS)
        self.heard: list[tuple[str, int, Callable[[int], None]]] = []
        self.navigate = {}
        self.clear_to = {}
        for robot in ROBOTS:
            self.create_subscription(TFMessage, f"/{robot}/tf", lambda tf, robot=robot: self.locate(robot, tf), DEEP)
            self.clear_to[robot] = self.create_publisher(PointStamped, f"/{robot}/clear_to", DEEP)
            self.navigate[robot] = ActionClient(self, NavigateToPose, f"/{robot}/navigate_to_pose")

    def locate(self, robot: str, message: TFMessage) -> None:
        """Hears where a robot is."""
        for transform in message.transforms:
            if transform.child_frame_id == "base_link":
                place = transform.transform.translation
                self.manager.locate(robot, (place.x, place.y))

    def begin(self) -> None:
        """Forgets everything."""
        self.manager.reset()
        self.heard.clear()
        for robot in ROBOTS:
            self.sent[robot] += 1
            self.goals[robot] = None

    def work(self, now: int) -> list[tuple]:
        """Decides by what it has heard."""
        for robot, number, tell in self.heard:
            if number == self.sent[robot]:
                tell(now)
        self.heard.clear()
        orders = self.manager.decide(now)
        for robot in orders.cancelled:
            if self.goals[robot] is not None:
                self.goals[robot].cancel_goal_async()
        for robot, (x, y) in orders.goals.items():
            pose = PoseStamped(header=header(now))
            pose.pose.position.x, pose.pose.position.y, pose.pose.orientation.w = x, y, 1.0
            self.send(robot, NavigateToPose.Goal(pose=pose))
        answers = []
        for robot, (x, y) in orders.clear_to.items():
            place = PointStamped(header=header(now))
            place.point.x, place.point.y = x, y
            answers.append((self.clear_to[robot], place))
        return answers

    def send(self, robot: str, goal: NavigateToPose.Goal) -> None:
        """Sends a goal, and notes what is said of it."""
        self.sent[robot] += 1
        number = self.sent[robot]

        def note(tell: Callable[[int], None]) -> None:
            self.heard.append((robot, number, tell))

        def answered(future: Future) -> None:
            handle = future.result()
            if not handle.accepted:
                note(lambda now: self.manager.refused(robot, now))
                return
            if number == self.sent[robot]:
                self.goals[robot] = handle
            note(lambda now: self.manager.accepted(robot, now))
            handle.get_result_async().add_done_callback(ended)

        def ended(future: Future) -> None:
            if future.result().status == GoalStatus.STATUS_SUCCEEDED:
                note(lambda _: self.manager.reached(robot))
            else:
                note(lambda now: self.manager.refused(robot, now))

        feedback = lambda _: note(lambda now: self.manager.heard(robot, now))  # noqa: E731
        self.navigate[robot].send_goal_async(goal, feedback).add_done_callback(answered)


def main() -> None:
    """Runs a node until it is interrupted."""
    nodes = {"floor": FloorNode, "navigator": NavigatorNode, "manager": ManagerNode}
    parser = argparse.ArgumentParser(description="A node of the warehouse in ROS 2.")
    parser.add_argument("node", choices=nodes)
    options = parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])
    rclpy.init(args=sys.argv)
    node = nodes[options.node]()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok():
            try:
                handler, _, _ = executor.wait_for_ready_callbacks(timeout_sec=0.0 if node.is_busy() else None)
                handler()
            except TimeoutException:
                node.turn()
    except KeyboardInterrupt:
        pass
    except Exception:
        if rclpy.ok():
            raise  # otherwise it is only the way in which waiting ended
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
