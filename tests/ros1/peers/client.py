"""Calls `/switch` twice over one connection and once over another, and `/ask`, and says what it was answered."""

import rospy
from std_srvs.srv import SetBool, Trigger

from common import go, say, start


def main():
    start("client")
    say({"ready": True})
    go()
    rospy.wait_for_service("/switch", 120)
    lasting = rospy.ServiceProxy("/switch", SetBool, persistent=True)
    answers = [lasting(True), lasting(False), rospy.ServiceProxy("/switch", SetBool)(True)]
    try:
        rospy.ServiceProxy("/ask", Trigger)()
        failed = None
    except rospy.ServiceException as error:
        failed = str(error)
    try:
        rospy.ServiceProxy("/switch", Trigger)()
        mistaken = None
    except rospy.ServiceException as error:
        mistaken = str(error)
    say({"answers": [[a.success, a.message] for a in answers], "failed": failed, "mistaken": mistaken})


if __name__ == "__main__":
    main()
