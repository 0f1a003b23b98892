"""The last problem of the transmission: if the engine stays below 3000/min for 30 s, does the car reach 65 mph in 20 s?"""

from problems.transmission import Transmission


class Simulator(Transmission):
    throttle = 0.0
