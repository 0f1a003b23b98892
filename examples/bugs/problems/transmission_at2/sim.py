"""AT2, the second problem of the transmission: does the engine reach 4750/min within 10 s?"""

from problems.transmission import Transmission


class Simulator(Transmission):
    throttle = 80.0
