"""Serves `std_srvs/SetBool`, `std_srvs/Trigger` and `std_srvs/Empty` under `/switch`, `/ask` and `/reset`, and says what it was asked."""

import rospy
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse, Trigger, TriggerResponse

from common import go, say, start


def switch(request):
    say({"switch": request.data})
    return SetBoolResponse(success=request.data, message="on" if request.data else "off")


def ask(_):
    say({"ask": True})
    raise ValueError("not today")


def reset(_):
    say({"reset": True})
    return EmptyResponse()


def main():
    start("server")
    rospy.Service("/switch", SetBool, switch)
    rospy.Service("/ask", Trigger, ask)
    rospy.Service("/reset", Empty, reset)
    say({"ready": True})
    go()


if __name__ == "__main__":
    main()
