"""Carts in namespaces, by rclpy: `cart` drives at the speed that it hears, and `manager` drives all that it names."""

import sys

import common
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64

PERIOD = 0.05


def cart(node: Node) -> None:
    """Publishes where it is, in its own namespace, from its parameter `start` on; without `grip` it does not move."""
    state = {"speed": 0.0, "place": node.declare_parameter("start", 0.0).value}
    node.declare_parameter("grip", 1.0)
    node.create_subscription(Float64, "speed", lambda heard: state.update(speed=heard.data), 10)
    places = node.create_publisher(Float64, "place", 10)

    def drive() -> None:
        state["place"] += state["speed"] * PERIOD * node.get_parameter("grip").value
        places.publish(Float64(data=state["place"]))

    node.create_timer(PERIOD, drive)


def manager(node: Node, carts: list[str]) -> None:
    """Publishes the same speed, its parameter `pace`, to all carts, and hears where they are."""
    node.declare_parameter("pace", 1.0)
    for name in carts:
        node.create_subscription(Float64, f"/{name}/place", lambda _: None, 10)
    speeds = [node.create_publisher(Float64, f"/{name}/speed", 10) for name in carts]

    def drive() -> None:
        pace = node.get_parameter("pace").value
        for speed in speeds:
            speed.publish(Float64(data=pace))

    node.create_timer(PERIOD, drive)


def main() -> None:
    """Arguments are the role, the carts of a manager, and those of ROS."""
    rclpy.init(args=sys.argv)
    own = rclpy.utilities.remove_ros_args(sys.argv)[1:]
    node = rclpy.create_node(own[0])
    if own[0] == "cart":
        cart(node)
    else:
        manager(node, own[1:])
    print("up", flush=True)
    common.spin(node)


if __name__ == "__main__":
    main()
