"""A managed node by rclpy, which says its state and its parameters of every type, and makes itself active."""

import sys

import common
import rclpy
from rcl_interfaces.msg import ParameterValue
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import Float64

PERIOD = 0.05

PARAMETERS = {
    "enabled": True,
    "mode": "auto",
    "gains": [0.5, 1.5],
    "ids": [1, 2, 3],
    "words": ["a", "b"],
    "flags": [True, True],
    "raw": [b"\x01", b"\x02"],
}


class Lidar(LifecycleNode):
    """Scans while it is active. A stubborn one, by its parameter, does not stop."""

    def __init__(self) -> None:
        super().__init__("lidar")
        self.declare_parameter("stubborn", False)
        self.said = {name: self.create_publisher(ParameterValue, name, 10) for name in PARAMETERS}
        for name, value in PARAMETERS.items():
            self.declare_parameter(name, value)
        self.states = self.create_publisher(Float64, "state", 10)
        self.scans = None
        self.create_timer(PERIOD, self.say)

    def say(self) -> None:
        """Says all that there is."""
        for name, publisher in self.said.items():
            publisher.publish(self.get_parameter(name).get_parameter_value())
        number, _ = self._state_machine.current_state
        self.states.publish(Float64(data=float(number)))
        if self.scans is not None:
            # A publisher of a node that is not active drops it.
            self.scans.publish(Float64(data=1.0))

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.scans = self.create_lifecycle_publisher(Float64, "scan", 10)
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        if self.get_parameter("stubborn").value:
            return TransitionCallbackReturn.FAILURE
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.destroy_publisher(self.scans)
        self.scans = None
        return TransitionCallbackReturn.SUCCESS


def main() -> None:
    """Arguments are those of ROS."""
    rclpy.init(args=sys.argv)
    node = Lidar()
    node.trigger_configure()
    node.trigger_activate()
    print("up", flush=True)
    common.spin(node)


if __name__ == "__main__":
    main()
