"""AT6c of the transmission: does the car reach 65 mph in 20 s although its engine stays below 3000/min for 30 s?"""

from problems.transmission import Transmission


class Simulator(Transmission):
    throttle = 0.0
