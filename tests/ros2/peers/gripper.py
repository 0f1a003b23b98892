"""A gripper whose server needs a while to come up, and its client, which waits for the service and calls it once."""

import sys
import time

import common
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

SERVICE = "/gripper/close"
SLOW = 5.0


def client(node: Node) -> None:
    """Publishes 1 as soon as its only call is answered, 0 before."""
    state = {"asked": False, "closed": 0.0}
    gripper = node.create_client(SetBool, SERVICE)
    closed = node.create_publisher(Float64, "/closed", 10)

    def look() -> None:
        if not state["asked"] and gripper.service_is_ready():
            state["asked"] = True
            asked = gripper.call_async(SetBool.Request(data=True))
            asked.add_done_callback(lambda _: state.update(closed=1.0))
        closed.publish(Float64(data=state["closed"]))

    node.create_timer(0.1, look)


def server(node: Node) -> None:
    """Offers the service late."""
    time.sleep(SLOW)

    def close(_: SetBool.Request, reply: SetBool.Response) -> SetBool.Response:
        reply.success = True
        return reply

    node.create_service(SetBool, SERVICE, close)


def main() -> None:
    """The argument is the role."""
    rclpy.init(args=sys.argv)
    role = rclpy.utilities.remove_ros_args(sys.argv)[1]
    node = rclpy.create_node(role)
    print("up", flush=True)
    {"client": client, "server": server}[role](node)
    common.spin(node)


if __name__ == "__main__":
    main()
