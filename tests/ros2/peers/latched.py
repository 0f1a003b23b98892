"""Publishes something once, before anybody listens, and keeps it for whoever subscribes later, as `/tf_static` is kept.
Says that it is up then, and stays until it is ended."""

import common
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("mapper")
publisher = node.create_publisher(String, "/map", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
publisher.publish(String(data="hall"))
common.say(up=True)
common.spin(node)
