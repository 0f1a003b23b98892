"""Publishes a swinging angle on `/angle`, 200 times per second, by rospy until it is ended."""

import math

import rospy
from std_msgs.msg import Float64


def main():
    rospy.init_node("talker")
    publisher, pace = rospy.Publisher("/angle", Float64, queue_size=100), rospy.Rate(200)
    number = 0
    while not rospy.is_shutdown():
        publisher.publish(Float64(math.sin(number / 100)))
        number += 1
        pace.sleep()


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass
